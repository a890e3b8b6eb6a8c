/* SPDX-License-Identifier: MIT */
/* Numbers of the configuration, with units and bounds. Private to config/ and to cli/schema.c. */
#ifndef CONFIG_NUMBER_H
#define CONFIG_NUMBER_H

#include "config/option.h"

/* As option_parse(), for the types that are whole numbers of something, and for OPTION_NUMBER. */
int number_parse_whole(const struct option *option, const char *text, void *base, char *reason);
int number_parse_real(const struct option *option, const char *text, void *base, char *reason);

/* What units a number of an option may have. */
enum number_family { NUMBER_PLAIN, NUMBER_OF_TIME, NUMBER_OF_SIZE };

/** The family of @option's own unit; NUMBER_PLAIN: that unit only, or none. */
enum number_family number_unit_family(const struct option *option);

/** 1 if @text, a value of @option, is a plain number of a duration, a size or per cent. */
int number_lacks_unit(const struct option *option, const char *text);

#endif
