/* SPDX-License-Identifier: MIT */
/*
 * Curves over time in characters: the newest window of each channel, one panel a channel, with
 * minimum, maximum and time axis. Every value counts: a column shows the span from the smallest to
 * the largest of its time.
 */
#ifndef CLI_PLOT_H
#define CLI_PLOT_H

#include <stdint.h>
#include <stdio.h>

struct plot;

enum plot_style { PLOT_ASCII, PLOT_BRAILLE };

struct plot_spec {
	unsigned panels;
	const char *const *titles; /* as many; kept by the caller */
	int64_t window_ns;
	int columns; /* of the terminal */
	enum plot_style style;
};

/** NULL without memory. Free with plot_destroy(). */
struct plot *plot_create(const struct plot_spec *spec);
void plot_destroy(struct plot *plot);

/** @time_ns must not go back; if it does, the plot is cleared. */
void plot_add(struct plot *plot, unsigned panel, int64_t time_ns, double value);

/** All panels in @rows lines. */
void plot_write(const struct plot *plot, int rows, FILE *out);

#endif
