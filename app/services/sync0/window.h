/* SPDX-License-Identifier: MIT */
/* One window of cycles: the edges of each line and the frames of the master. */
#ifndef SYNC0_WINDOW_H
#define SYNC0_WINDOW_H

#include <stddef.h>
#include <stdint.h>

enum window_mark { WINDOW_UNSEEN = 0, WINDOW_SEEN, WINDOW_OVERFLOWN };

struct window_line {
	int64_t first;    /* pulse */
	uint32_t pulses;  /* that are due in this window */
	uint32_t room;    /* for so many */
	int64_t *mono_ns; /* by pulse, where mark is WINDOW_SEEN */
	uint8_t *mark;    /* enum window_mark */
	uint64_t extra;
	int64_t first_extra; /* pulse */
	uint64_t overflow;
	int64_t step_ns;
	int64_t step_pulse;
};

struct window {
	int64_t first_cycle;
	uint32_t cycles;
	size_t line_count;
	struct window_line *line;
	/* The frame of each cycle; has_frame 0: lost, skipped, or there is no master. */
	uint8_t *has_frame;
	int64_t *frame_dc_ns;
	int64_t *frame_mono_ns;
	int64_t *frame_latency_ns; /* either way */
	int64_t dc_diff_ns;        /* largest; -1: not read */
	int64_t clock_step_ns;     /* 0: none */
};

/** @room: for the pulses of each line. 0 or -ENOMEM. Free with window_destroy(). */
int window_create(uint32_t cycles, size_t line_count, const uint32_t *room,
		  struct window **ret_window);
void window_destroy(struct window *w);
/** Clear all counts; the window starts at @first_cycle. The pulses of its lines are not set. */
void window_clear(struct window *w, int64_t first_cycle);

#endif
