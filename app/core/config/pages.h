/* SPDX-License-Identifier: MIT */
/* The option table as a page to read and as a file to start from. Private to config/ and its tests.
 */
#ifndef CONFIG_PAGES_H
#define CONFIG_PAGES_H

#include <stdio.h>

/** Markdown: doc/reference/options.md. Context: blocking. */
void pages_write_reference(FILE *out);
/** YAML with every option at its default: doc/reference/ecdaq.sample.yaml. Context: blocking. */
void pages_write_sample(FILE *out);

#endif
