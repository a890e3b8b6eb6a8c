/* SPDX-License-Identifier: MIT */
/*
 * The process image as a C header: a packed structure of the outputs and one of the inputs, with a
 * member for each channel and others for what is between. It is for little-endian machines and for
 * gcc and clang, which put bit-fields from the lowest bit up and, in a packed structure, across
 * the borders of their types. Context: blocking.
 */
#ifndef CLI_CSTRUCT_H
#define CLI_CSTRUCT_H

#include <stdio.h>

#include "base/sample.h"

/**
 * Write the header of @channels, which need not be in order, to @out; @prefix begins the names of
 * the structures and is a C name. A channel that lies over one before it is a comment. With
 * @columns the lines fit a terminal (cli/fit.h). 0 or -ENOMEM.
 */
int cstruct_write(FILE *out, const struct sample_meta *meta, const struct channel *channels,
		  const char *prefix, int columns);

/** 1 if @text can be a name in C and C++: letters, digits, underscores, 40 at most. */
int cstruct_is_name(const char *text);

#endif
