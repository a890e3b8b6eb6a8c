/* SPDX-License-Identifier: MIT */
#include "sync0/window.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

static int have_frames(struct window *w)
{
	w->has_frame = calloc(w->cycles, sizeof(w->has_frame[0]));
	w->frame_dc_ns = calloc(w->cycles, sizeof(w->frame_dc_ns[0]));
	w->frame_mono_ns = calloc(w->cycles, sizeof(w->frame_mono_ns[0]));
	w->frame_latency_ns = calloc(w->cycles, sizeof(w->frame_latency_ns[0]));
	return w->has_frame != NULL && w->frame_dc_ns != NULL && w->frame_mono_ns != NULL &&
	       w->frame_latency_ns != NULL;
}

static int have_line(struct window_line *wl, uint32_t room)
{
	wl->room = room;
	wl->mono_ns = calloc(room, sizeof(wl->mono_ns[0]));
	wl->mark = calloc(room, sizeof(wl->mark[0]));
	return wl->mono_ns != NULL && wl->mark != NULL;
}

int window_create(uint32_t cycles, size_t line_count, const uint32_t *room,
		  struct window **ret_window)
{
	struct window *w = calloc(1, sizeof(*w));
	int is_whole;

	if (w == NULL) {
		return -ENOMEM;
	}
	w->cycles = cycles;
	w->line = calloc(line_count, sizeof(w->line[0]));
	is_whole = w->line != NULL && have_frames(w);
	for (size_t i = 0; is_whole && i < line_count; i++) {
		w->line_count = i + 1;
		is_whole = have_line(&w->line[i], room[i]);
	}
	if (!is_whole) {
		window_destroy(w);
		return -ENOMEM;
	}
	window_clear(w, 0);
	*ret_window = w;
	return 0;
}

void window_destroy(struct window *w)
{
	if (w == NULL) {
		return;
	}
	for (size_t i = 0; i < w->line_count; i++) {
		free(w->line[i].mono_ns);
		free(w->line[i].mark);
	}
	free(w->line);
	free(w->has_frame);
	free(w->frame_dc_ns);
	free(w->frame_mono_ns);
	free(w->frame_latency_ns);
	free(w);
}

void window_clear(struct window *w, int64_t first_cycle)
{
	w->first_cycle = first_cycle;
	w->dc_diff_ns = -1;
	w->clock_step_ns = 0;
	memset(w->has_frame, 0, w->cycles * sizeof(w->has_frame[0]));
	for (size_t i = 0; i < w->line_count; i++) {
		struct window_line *wl = &w->line[i];

		memset(wl->mark, WINDOW_UNSEEN, wl->room * sizeof(wl->mark[0]));
		wl->extra = 0;
		wl->first_extra = 0;
		wl->overflow = 0;
		wl->step_ns = 0;
		wl->step_pulse = 0;
	}
}
