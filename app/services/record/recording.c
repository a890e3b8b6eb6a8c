/* SPDX-License-Identifier: MIT */
#include "record/recording.h"

#include <errno.h>
#include <limits.h>
#include <stdlib.h>

#include "record/messages.h"
#include "record/overview.h"

static uint64_t number_of(const struct mcap_item *item, const char *key)
{
	char text[24] = "";

	(void)mcap_pairs_get(item, key, text, sizeof(text));
	return strtoull(text, NULL, 10);
}

/* Its session and channels: all that is before its first chunk. */
static int read_head(struct recording *rec)
{
	struct mcap_item item;
	int r;

	rec->cycle_channel = -1;
	while ((r = mcap_reader_next(rec->reader, &item)) > 0 && item.kind != MCAP_ITEM_CHUNK) {
		if (item.kind == MCAP_ITEM_SCHEMA || item.kind == MCAP_ITEM_CHANNEL) {
			r = columns_learn(rec->columns, &item);
			if (r < 0) {
				return r;
			}
		}
		if (item.kind == MCAP_ITEM_CHANNEL &&
		    mcap_text_is(item.name, messages_topic(MESSAGE_CYCLE))) {
			rec->cycle_channel = item.id;
		} else if (item.kind == MCAP_ITEM_METADATA &&
			   mcap_text_is(item.name, "ecdaq.session")) {
			rec->session = number_of(&item, "session");
			rec->period_ns = number_of(&item, "period_ns");
		}
	}
	return r < 0 ? r : 0;
}

void recording_close(struct recording *rec)
{
	columns_destroy(rec->columns);
	mcap_reader_destroy(rec->reader);
	log_file_close(&rec->file);
}

int recording_open(struct recording *rec, const char *path, const char *channels)
{
	int r;

	*rec = (struct recording){ .path = path };
	r = log_file_open(path, &rec->file);
	if (r < 0) {
		return r;
	}
	r = mcap_reader_create(&rec->file.source, &rec->reader);
	if (r == 0) {
		rec->columns = columns_create(channels, 0, LOG_TEXT);
		r = rec->columns == NULL ? -ENOMEM : read_head(rec);
	}
	if (r < 0) {
		recording_close(rec);
	}
	return r;
}

int recording_open_of(struct recording *rec, const char *dir, const char *name, uint64_t session,
		      const char *channels, char path[PATH_MAX])
{
	int r;

	if (!store_name_is_of(name, session)) {
		return 0;
	}
	r = store_path(dir, name, path, PATH_MAX);
	r = r < 0 ? r : recording_open(rec, path, channels);
	if (r == -ENOENT && log_part_to_final(path)) { /* finished just now */
		r = recording_open(rec, path, channels);
	}
	if (r < 0) {
		return r == -ENOENT || (r == -ENODATA && log_is_recording(path)) ? 0 : r;
	}
	if (rec->session != session) {
		recording_close(rec);
		return 0;
	}
	return 1;
}

/* The first cycle of the chunk at @offset; UINT64_MAX: there is none. 0 or -errno. */
static int read_first_cycle(struct recording *rec, uint64_t offset, uint64_t *ret_cycle)
{
	struct mcap_item item;
	int r;

	*ret_cycle = UINT64_MAX;
	mcap_reader_seek(rec->reader, offset);
	r = mcap_reader_next(rec->reader, &item);
	while (r > 0 && (r = mcap_reader_next(rec->reader, &item)) > 0 && item.is_inner) {
		if (item.kind == MCAP_ITEM_MESSAGE && item.id == rec->cycle_channel) {
			(void)messages_decode_cycle(item.data, item.data_len, ret_cycle);
			return 0;
		}
	}
	return r < 0 ? r : 0;
}

int recording_find_chunk(struct recording *rec, const struct mcap_places *chunks, uint64_t wanted,
			 size_t *ret_chunk)
{
	size_t low = 0;
	size_t high = chunks->count;
	int r = 0;

	while (r == 0 && high - low > 1) {
		size_t middle = low + (high - low) / 2;
		uint64_t cycle;

		r = read_first_cycle(rec, chunks->at[middle], &cycle);
		low = cycle <= wanted ? middle : low;
		high = cycle <= wanted ? high : middle;
	}
	*ret_chunk = low;
	return r;
}

/* The last cycle of the chunk at @offset; left alone if it has none. 1 if it has one, 0, -errno. */
static int read_last_cycle(struct recording *rec, uint64_t offset, uint64_t *ret_cycle)
{
	struct mcap_item item;
	int found = 0;
	int r;

	mcap_reader_seek(rec->reader, offset);
	r = mcap_reader_next(rec->reader, &item);
	while (r > 0 && (r = mcap_reader_next(rec->reader, &item)) > 0 && item.is_inner) {
		if (item.kind == MCAP_ITEM_MESSAGE && item.id == rec->cycle_channel &&
		    messages_decode_cycle(item.data, item.data_len, ret_cycle) == 0) {
			found = 1;
		}
	}
	return r < 0 ? r : found;
}

int recording_find_range(struct recording *rec, uint64_t *ret_first, uint64_t *ret_last)
{
	struct overview overview;
	struct mcap_places chunks;
	uint64_t first = UINT64_MAX;
	int found = 0;
	int r;

	if (overview_read(&rec->file.source, &overview) == 0 && overview.has_counts) {
		*ret_first = overview.first_cycle;
		*ret_last = overview.last_cycle;
		return overview.cycles > 0;
	}
	r = mcap_places_read(&rec->file.source, MCAP_OP_CHUNK, &chunks);
	for (size_t i = chunks.count; i > 0 && r == 0 && !found; i--) {
		r = read_last_cycle(rec, chunks.at[i - 1], ret_last);
		found = r > 0;
		r = r < 0 ? r : 0;
	}
	for (size_t i = 0; i < chunks.count && r == 0 && first == UINT64_MAX; i++) {
		r = read_first_cycle(rec, chunks.at[i], &first);
	}
	mcap_places_done(&chunks);
	*ret_first = first;
	return r < 0 ? r : found;
}

uint64_t recording_newest_session(const char *dir, const struct store_entry *entries, size_t count)
{
	uint64_t session = 0;

	while (count-- > 0 && session == 0) {
		struct recording rec;
		char path[PATH_MAX];

		if (store_path(dir, entries[count].name, path, sizeof(path)) == 0 &&
		    recording_open(&rec, path, NULL) == 0) {
			session = rec.session;
			recording_close(&rec);
		}
	}
	return session;
}
