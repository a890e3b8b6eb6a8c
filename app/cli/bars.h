/* SPDX-License-Identifier: MIT */
#ifndef CLI_BARS_H
#define CLI_BARS_H

#include "base/histogram.h"

/** The histogram on standard output, a quarter of an octave a row. */
void bars_print(const struct histogram *h);

#endif
