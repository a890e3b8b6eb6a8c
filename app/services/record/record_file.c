/* SPDX-License-Identifier: MIT */
#include "record/record_file.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "record/envelope.h"
#include "record/file_io.h"
#include "record/mcap_writer.h"
#include "record/record_head.h"

struct record_file {
	struct mcap_writer *w;
	const struct layout *layout;
	struct envelope *envelope;
	const struct layout_topic *topic;
	size_t topic_count;
	size_t cycle_cost; /* room that one cycle takes in a chunk */
	uint8_t *buf;      /* one message */
	size_t buf_len;
	uint64_t cycles;
	uint64_t open_cycles; /* of those: in the open chunk */
	uint64_t first_cycle;
	uint64_t last_cycle;
	uint64_t last_utc_ns; /* log times go up only */
	uint32_t event_count;
	int has_end;
	int is_finished;
	int fd;
	char dir[PATH_MAX];
	char path[PATH_MAX];
	char final[PATH_MAX];
};

static int set_paths(struct record_file *f, const struct record_file_spec *spec)
{
	int n = snprintf(f->dir, sizeof(f->dir), "%s", spec->dir);
	int part = snprintf(f->path, sizeof(f->path), "%s/%s.part", spec->dir, spec->name);
	int final = snprintf(f->final, sizeof(f->final), "%s/%s.mcap", spec->dir, spec->name);

	return n >= PATH_MAX || part >= PATH_MAX || final >= PATH_MAX ? -ENAMETOOLONG : 0;
}

static int open_writer(struct record_file *f, const struct record_file_spec *spec)
{
	struct mcap_io io = file_io(&f->fd);

	f->fd = open(f->path, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
	if (f->fd < 0) {
		return -errno;
	}
	if (spec->seam != NULL && spec->seam->wrap != NULL) {
		spec->seam->wrap(spec->seam->ctx, f->path, &io);
	}
	return mcap_writer_create(&io, spec->zstd_level, &f->w);
}

int record_file_create(const struct record_file_spec *spec, struct record_file **ret_file)
{
	struct record_file *f = calloc(1, sizeof(*f));
	int r;

	if (f == NULL) {
		return -ENOMEM;
	}
	f->fd = -1;
	f->layout = spec->layout;
	f->topic = layout_topics(spec->layout, &f->topic_count);
	f->last_utc_ns = spec->start_utc_ns;
	f->buf_len = layout_largest_bytes(spec->layout);
	f->buf_len = f->buf_len > MESSAGES_LARGEST_BYTES ? f->buf_len : MESSAGES_LARGEST_BYTES;
	f->buf = malloc(f->buf_len);
	f->cycle_cost = layout_cycle_bytes(spec->layout) + MESSAGES_LARGEST_BYTES +
			(f->topic_count + 1) * MCAP_MESSAGE_COST_BYTES;
	r = f->buf == NULL ? -ENOMEM : set_paths(f, spec);
	r = r < 0 ? r : envelope_create(spec->layout, &f->envelope);
	if (r < 0) {
		record_file_destroy(f);
		return r;
	}
	r = open_writer(f, spec);
	r = r < 0 ? r : record_head_put(f->w, spec);
	/* The name must be durable, or a power cut takes the whole file. */
	r = r < 0 ? r : file_sync_dir(f->dir);
	if (r < 0) {
		if (f->fd >= 0) {
			unlink(f->path);
		}
		record_file_destroy(f);
		return r;
	}
	*ret_file = f;
	return 0;
}

void record_file_destroy(struct record_file *f)
{
	if (f == NULL) {
		return;
	}
	mcap_writer_destroy(f->w);
	envelope_destroy(f->envelope);
	if (f->fd >= 0) {
		close(f->fd);
	}
	free(f->buf);
	free(f);
}

static int make_room(struct record_file *f, size_t bytes)
{
	return mcap_writer_room(f->w) < bytes ? record_file_close_chunk(f) : 0;
}

/* The seconds since the last one that was written. */
static int put_envelope(struct record_file *f)
{
	size_t len = envelope_size(f->envelope);
	int r = len == 0 ? 0
			 : mcap_writer_attachment(f->w, ENVELOPE_NAME, ENVELOPE_MEDIA_TYPE,
						  f->last_utc_ns, envelope_bytes(f->envelope), len);

	if (r == 0) {
		envelope_clear(f->envelope);
	}
	return r;
}

static int put(struct record_file *f, unsigned channel, uint32_t sequence, size_t data_len)
{
	return mcap_writer_message(f->w, &(struct mcap_message){ .channel_id = (uint16_t)channel,
								 .sequence = sequence,
								 .log_time_ns = f->last_utc_ns,
								 .publish_time_ns = f->last_utc_ns,
								 .data = f->buf,
								 .data_len = data_len });
}

static void go_to(struct record_file *f, uint64_t utc_ns)
{
	f->last_utc_ns = utc_ns > f->last_utc_ns ? utc_ns : f->last_utc_ns;
}

int record_file_sample(struct record_file *f, const struct sample_header *header,
		       const uint8_t *image, uint64_t utc_ns)
{
	uint32_t sequence = (uint32_t)header->cycle;
	int r = make_room(f, f->cycle_cost);

	r = r == 0 && envelope_is_full(f->envelope) ? put_envelope(f) : r;
	if (r < 0) {
		return r;
	}
	go_to(f, utc_ns);
	r = put(f, MESSAGE_CYCLE, sequence,
		messages_encode_cycle(header, layout_meta(f->layout)->slave_count, f->buf));
	for (size_t i = 0; i < f->topic_count && r == 0; i++) {
		r = put(f, MESSAGE_KINDS + (unsigned)i, sequence,
			layout_encode(&f->topic[i], header, image, f->last_utc_ns, f->buf,
				      f->buf_len));
	}
	if (r < 0) {
		return r;
	}
	envelope_add(f->envelope, header, image);
	if (f->cycles++ == 0) {
		f->first_cycle = header->cycle;
	}
	f->open_cycles++;
	f->last_cycle = header->cycle;
	return 0;
}

int record_file_event(struct record_file *f, const struct messages_event *ev)
{
	size_t len = messages_encode_event(ev, f->buf);
	int r = make_room(f, MCAP_MESSAGE_COST_BYTES + len);

	if (r < 0) {
		return r;
	}
	r = put(f, MESSAGE_EVENT, f->event_count, len);
	if (r == 0) {
		f->event_count++;
	}
	return r;
}

int record_file_sync0(struct record_file *f, const struct sync0_result *result, int64_t utc_ns)
{
	size_t len = messages_encode_sync0(result, utc_ns, f->buf);
	int r = make_room(f, MCAP_MESSAGE_COST_BYTES + len);

	return r < 0 ? r : put(f, MESSAGE_SYNC0, (uint32_t)result->line, len);
}

int record_file_timemap(struct record_file *f, const struct timemap_state *state, uint64_t utc_ns)
{
	size_t len = messages_encode_timemap(state, f->buf);
	int r = make_room(f, MCAP_MESSAGE_COST_BYTES + len);

	if (r < 0) {
		return r;
	}
	go_to(f, utc_ns);
	return put(f, MESSAGE_TIMEMAP, 0, len);
}

int record_file_close_chunk(struct record_file *f)
{
	int r = mcap_writer_close_chunk(f->w);

	if (r == 0) {
		f->open_cycles = 0;
	}
	return r;
}

int record_file_cut(struct record_file *f, uint64_t bytes)
{
	return mcap_writer_cut(f->w, bytes);
}

int record_file_sync(struct record_file *f)
{
	return mcap_writer_sync(f->w);
}

int record_file_finish(struct record_file *f, const struct record_file_end *end)
{
	const struct record_head_counts counts = { .first_cycle = f->first_cycle,
						   .last_cycle = f->last_cycle,
						   .cycles = f->cycles };
	int r = record_file_close_chunk(f);

	r = r < 0 ? r : put_envelope(f);
	if (r == 0 && !f->has_end) { /* a second try does not note it twice */
		r = record_head_put_end(f->w, &counts, end);
		f->has_end = r == 0;
	}
	if (r == 0 && !f->is_finished) {
		r = mcap_writer_finish(f->w);
		f->is_finished = r == 0;
	}
	return r;
}

int record_file_publish(struct record_file *f)
{
	if (rename(f->path, f->final) < 0) {
		return -errno;
	}
	memcpy(f->path, f->final, sizeof(f->path));
	return file_sync_dir(f->dir);
}

const char *record_file_path(const struct record_file *f)
{
	return f->path;
}

uint64_t record_file_bytes(const struct record_file *f)
{
	return mcap_writer_bytes(f->w);
}

uint64_t record_file_final_bytes(const struct record_file *f)
{
	return mcap_writer_bytes(f->w) + envelope_size(f->envelope) +
	       mcap_writer_summary_bytes(f->w);
}

int record_file_is_full(const struct record_file *f)
{
	return mcap_writer_is_full(f->w);
}

uint64_t record_file_open_cycles(const struct record_file *f)
{
	return f->open_cycles;
}
