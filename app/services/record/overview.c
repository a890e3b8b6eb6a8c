/* SPDX-License-Identifier: MIT */
#include "record/overview.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "record/mcap_parse.h"
#include "record/mcap_places.h"

enum {
	TIMES_AT = MCAP_HEAD_BYTES + 8 + 2 + 4 * 4,     /* in the statistics */
	STATISTICS_BYTES = TIMES_AT + 16,               /* that are read of them */
	INDEX_HEAD_BYTES = MCAP_HEAD_BYTES + 8 + 8 + 4, /* of a metadata index, before its name */
	GROUP_LIMIT_BYTES = 64 * 1024,
	NOTES_LIMIT_BYTES = 64 * 1024,
	NUMBER_BYTES = 24,
};

static const char notes_name[] = "ecdaq.end";

/* The last metadata with the name of the closing notes. 0, -ENOENT. */
static int find_notes(const uint8_t *index, uint64_t bytes, struct mcap_range *ret)
{
	int r = -ENOENT;
	uint64_t len;

	for (uint64_t at = 0; bytes - at >= INDEX_HEAD_BYTES; at += MCAP_HEAD_BYTES + len) {
		const uint8_t *p = index + at;
		uint32_t name_len = get_le32(p + INDEX_HEAD_BYTES - 4);

		len = get_le64(p + 1);
		if (p[0] != MCAP_OP_METADATA_INDEX || len > bytes - at - MCAP_HEAD_BYTES ||
		    len + MCAP_HEAD_BYTES < INDEX_HEAD_BYTES ||
		    name_len != len + MCAP_HEAD_BYTES - INDEX_HEAD_BYTES) {
			return -EBADMSG;
		}
		if (name_len == strlen(notes_name) &&
		    memcmp(p + INDEX_HEAD_BYTES, notes_name, name_len) == 0) {
			*ret = (struct mcap_range){ get_le64(p + MCAP_HEAD_BYTES),
						    get_le64(p + MCAP_HEAD_BYTES + 8) };
			r = 0;
		}
	}
	return r;
}

static int get_number(const struct mcap_item *notes, const char *key, uint64_t *ret)
{
	char text[NUMBER_BYTES];
	int r = mcap_pairs_get(notes, key, text, sizeof(text));

	if (r == 0) {
		char *end;

		errno = 0;
		*ret = strtoull(text, &end, 10);
		r = end == text || *end != '\0' || errno != 0 ? -EBADMSG : 0;
	}
	return r;
}

static int read_notes(const struct mcap_source *source, const struct mcap_range *metadata,
		      struct overview *overview)
{
	struct mcap_range part = { 0, 0 };
	struct mcap_item notes = { .offset = 0 };
	uint8_t *data;
	int r;

	data = mcap_range_read(source, metadata, GROUP_LIMIT_BYTES, &r);
	r = r < 0 ? r : find_notes(data, metadata->bytes, &part);
	free(data);
	if (r < 0) {
		return r;
	}
	data = mcap_range_read(source, &part, NOTES_LIMIT_BYTES, &r);
	if (r < 0) {
		return r;
	}
	notes.record = data;
	notes.record_len = (size_t)part.bytes;
	r = part.bytes < MCAP_HEAD_BYTES || data[0] != MCAP_OP_METADATA ||
			    get_le64(data + 1) != part.bytes - MCAP_HEAD_BYTES
		    ? -EBADMSG
		    : mcap_parse_record(&notes);
	r = r < 0 ? r : get_number(&notes, "cycles", &overview->cycles);
	r = r < 0 ? r : get_number(&notes, "first_cycle", &overview->first_cycle);
	r = r < 0 ? r : get_number(&notes, "last_cycle", &overview->last_cycle);
	free(data);
	if (r == 0 && overview->cycles > 0) {
		uint64_t between = overview->last_cycle - overview->first_cycle;

		if (overview->last_cycle < overview->first_cycle ||
		    between < overview->cycles - 1) {
			return -EBADMSG;
		}
		overview->missing = between - (overview->cycles - 1);
	}
	return r;
}

int overview_read(const struct mcap_source *source, struct overview *ret)
{
	struct overview found = { .start_ns = 0 };
	struct mcap_groups groups;
	struct mcap_range *statistics = &groups.kind[MCAP_OP_STATISTICS];
	const struct mcap_range *metadata = &groups.kind[MCAP_OP_METADATA_INDEX];
	uint8_t *data;
	int r = mcap_groups_find(source, &groups);

	if (r < 0) {
		return r;
	}
	if (statistics->bytes < STATISTICS_BYTES) {
		return -EBADMSG;
	}
	statistics->bytes = STATISTICS_BYTES;
	data = mcap_range_read(source, statistics, STATISTICS_BYTES, &r);
	if (r < 0) {
		return r;
	}
	r = data[0] == MCAP_OP_STATISTICS ? 0 : -EBADMSG;
	found.start_ns = get_le64(data + TIMES_AT);
	found.end_ns = get_le64(data + TIMES_AT + 8);
	free(data);
	if (r == 0 && metadata->bytes > 0) {
		r = read_notes(source, metadata, &found);
		found.has_counts = r == 0;
		r = r == -ENOENT ? 0 : r;
	}
	if (r == 0) {
		*ret = found;
	}
	return r;
}
