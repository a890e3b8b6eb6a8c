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
	const char *const *units;  /* the same, "" for none; NULL: of none */
	int64_t window_ns;
	int columns; /* of the terminal */
	enum plot_style style;
};

/** NULL without memory. Free with plot_destroy(). */
struct plot *plot_create(const struct plot_spec *spec);
void plot_destroy(struct plot *plot);

/** @time_ns must not go back; if it does, the plot is cleared. */
void plot_add(struct plot *plot, unsigned panel, int64_t time_ns, double value);

/** Draw @columns wide from now on; the values are kept. */
void plot_resize(struct plot *plot, int columns);

/* Two cursors, A and B, one of which is moved. */

/** Show them, or no longer. */
void plot_cursors_toggle(struct plot *plot);
int plot_cursors_are_on(const struct plot *plot);
/** Move the other one from now on. */
void plot_cursors_switch(struct plot *plot);
/** Move the one by @dots (columns of dots), within the window. */
void plot_cursors_move(struct plot *plot, int dots);
/** Time from A to B. */
int64_t plot_cursors_ns(const struct plot *plot);

/** All panels in @rows lines. */
void plot_write(const struct plot *plot, int rows, FILE *out);

#endif
