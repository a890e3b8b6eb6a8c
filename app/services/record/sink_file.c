/* SPDX-License-Identifier: MIT */
/* The sink's open file. */
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "record/sink_internal.h"

/* Own events carry no ring sequence. */
static int put_own_event(struct sink *s, const struct event *ev, int64_t utc_ns)
{
	char text[256];

	event_format(ev, text, sizeof(text));
	return record_file_event(s->file, &(struct messages_event){ .event = *ev,
								    .sequence = UINT64_MAX,
								    .utc_ns = utc_ns,
								    .text = text });
}

static int put_first_events(struct sink *s, uint64_t first_cycle, int64_t utc_ns)
{
	struct event ev = { .id = EVENT_RECORD_STARTED,
			    .cycle = first_cycle,
			    .value = (int64_t)first_cycle,
			    .slave_pos = EVENT_NO_SLAVE };
	int r = put_own_event(s, &ev, utc_ns);

	if (r < 0 || s->full_event.id == EVENT_NONE) {
		return r;
	}
	r = put_own_event(s, &s->full_event, s->full_utc_ns);
	ev.id = EVENT_RECORD_RESUMED;
	r = r < 0 ? r : put_own_event(s, &ev, utc_ns);
	if (r == 0) {
		s->full_event.id = EVENT_NONE;
	}
	return r;
}

int sink_open_file(struct sink *s, uint64_t first_cycle, int64_t utc_ns)
{
	char name[STORE_NAME_BYTES];
	struct record_file_spec spec = { .dir = s->opt.dir,
					 .name = name,
					 .layout = s->layout,
					 .zstd_level = s->opt.zstd_level,
					 .before = &s->resume,
					 .file_sequence = s->resume.sequence + 1,
					 .start_utc_ns = utc_ns > 0 ? (uint64_t)utc_ns : 0,
					 .timemap = &s->timemap,
					 .config_path = s->opt.config_path,
					 .config_text = s->opt.config_text,
					 .seam = s->opt.seam };
	int r;

	if (s->file != NULL) {
		return 0;
	}
	if (sink_ask_free_bytes(s) == 0 && s->bytes_free < s->opt.reserve_bytes) {
		return sink_trouble(s, -ENOSPC, s->opt.dir);
	}
	store_make_name(name, utc_ns, s->resume.session, spec.file_sequence);
	r = record_file_create(&spec, &s->file);
	if (r < 0) {
		return sink_trouble(s, r, name);
	}
	s->resume.sequence++;
	s->files++;
	snprintf(s->path, sizeof(s->path), "%s", record_file_path(s->file));
	s->file_opened_ns = s->now_ns;
	s->synced_ns = s->now_ns;
	s->chunk_opened_ns = s->now_ns;
	s->is_dirty = 1;
	r = put_first_events(s, first_cycle, utc_ns);
	return r < 0 ? sink_trouble(s, r, name) : 0;
}

int sink_finish_file(struct sink *s, const char *reason)
{
	const struct record_file_end end = { .reason = reason,
					     .events_lost = s->events_lost,
					     .after = &s->resume,
					     .timemap = &s->timemap };
	int r = record_file_finish(s->file, &end);

	if (r == 0) {
		/* The state before the name: if we are killed in between, .part and state agree. */
		int saved = store_save_state(s->store, &s->resume);

		if (saved < 0) { /* the newest file holds the same, it is only slower to read */
			sink_say(s, "%s: state file: %s", s->opt.dir, strerror(-saved));
		}
		r = record_file_publish(s->file);
	}
	if (r < 0) {
		return sink_trouble(s, r, record_file_path(s->file));
	}
	snprintf(s->path, sizeof(s->path), "%s", record_file_path(s->file));
	s->synced_cycle = sink_last_cycle(s);
	s->is_dirty = 0;
	s->chunk_opened_ns = 0;
	s->bytes_done += record_file_bytes(s->file);
	record_file_destroy(s->file);
	s->file = NULL;
	r = store_enforce_budget(s->store, s->opt.budget_bytes, 0);
	if (r < 0) {
		sink_say(s, "%s: cannot delete old recordings: %s", s->opt.dir, strerror(-r));
	}
	return 0;
}

int sink_end_session(struct sink *s, const char *reason)
{
	int r = s->file != NULL ? sink_finish_file(s, reason) : 0;

	if (r < 0) {
		return r;
	}
	s->layout = NULL;
	return 0;
}

int sink_close_chunk(struct sink *s)
{
	int r = record_file_close_chunk(s->file);

	if (r < 0) {
		return sink_trouble(s, r, record_file_path(s->file));
	}
	s->chunk_opened_ns = 0;
	s->is_dirty = 1;
	return 0;
}

int sink_is_rotation_due(const struct sink *s)
{
	return (s->opt.rotate_bytes > 0 &&
		record_file_final_bytes(s->file) >= s->opt.rotate_bytes) ||
	       (s->opt.rotate_period_ns > 0 &&
		s->now_ns - s->file_opened_ns >= s->opt.rotate_period_ns) ||
	       record_file_is_full(s->file);
}

static void note_open(struct sink *s)
{
	if (s->chunk_opened_ns == 0) {
		s->chunk_opened_ns = s->now_ns;
	}
}

int sink_sample(struct sink *s, const struct sample_header *header, const uint8_t *image,
		int64_t utc_ns)
{
	int64_t period_ns = (int64_t)layout_meta(s->layout)->period_ns;
	int r = record_file_sample(s->file, header, image, utc_ns > 0 ? (uint64_t)utc_ns : 0);

	if (r < 0) {
		return sink_trouble(s, r, record_file_path(s->file));
	}
	note_open(s);
	if (s->resume.cycles++ == 0) {
		s->resume.first_cycle = header->cycle;
	}
	s->last_utc_ns = utc_ns;
	s->resume.next_cycle = header->cycle + 1;
	/* By bus time, too: a backlog is read much faster than it came. */
	if ((int64_t)record_file_open_cycles(s->file) >= s->opt.chunk_period_ns / period_ns) {
		(void)sink_close_chunk(s); /* the sample is kept; an error shows in the state */
		if (s->state == SINK_READY && sink_is_rotation_due(s)) {
			(void)sink_finish_file(s, "rotated");
		}
	}
	return 0;
}

int sink_event(struct sink *s, const struct messages_event *ev)
{
	int r = record_file_event(s->file, ev);

	if (r < 0) {
		return sink_trouble(s, r, record_file_path(s->file));
	}
	note_open(s);
	if (ev->sequence != UINT64_MAX) {
		s->resume.event_next = ev->sequence + 1;
		s->resume.event_mono_ns = ev->event.mono_ns;
	}
	return 0;
}

int sink_sync0(struct sink *s, const struct sync0_result *result, int64_t utc_ns, uint64_t sequence)
{
	int r = record_file_sync0(s->file, result, utc_ns);

	if (r < 0) {
		return sink_trouble(s, r, record_file_path(s->file));
	}
	note_open(s);
	s->resume.sync0_next = sequence + 1;
	s->resume.sync0_mono_ns = result->mono_ns;
	return 0;
}

void sink_mark_sync0_event(struct sink *s, const struct event *ev, uint64_t sequence)
{
	s->resume.sync0_event_next = sequence + 1;
	s->resume.sync0_event_mono_ns = ev->mono_ns;
}

int sink_timemap(struct sink *s, const struct timemap_state *state)
{
	int r = 0;

	s->timemap = *state;
	if (s->file != NULL) {
		r = record_file_timemap(s->file, state,
					state->utc_ns > 0 ? (uint64_t)state->utc_ns : 0);
		note_open(s);
	}
	return r < 0 ? sink_trouble(s, r, record_file_path(s->file)) : 0;
}

int sink_clock_step(struct sink *s, const struct timemap_state *state)
{
	int r = s->file != NULL ? sink_finish_file(s, "clock step") : 0;

	s->timemap = *state;
	sink_say(s, "the host's clock took a step of %" PRId64 " ns: new file", state->step_ns);
	return r;
}

int sink_sync_file(struct sink *s)
{
	uint64_t last_closed;
	int r;

	if (s->chunk_opened_ns != 0) {
		r = sink_close_chunk(s);
		if (r < 0) {
			return r;
		}
	}
	last_closed = record_file_last_cycle(s->file);
	r = record_file_sync(s->file);
	if (r < 0) {
		return sink_trouble(s, r, record_file_path(s->file));
	}
	s->synced_ns = s->now_ns;
	s->synced_cycle = last_closed;
	s->is_dirty = 0;
	return 0;
}
