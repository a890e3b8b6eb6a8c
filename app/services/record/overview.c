/* SPDX-License-Identifier: MIT */
#include "record/overview.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "record/mcap_parse.h"

enum {
	TAIL_BYTES = MCAP_FOOTER_BYTES + MCAP_MAGIC_BYTES,
	OFFSET_BYTES = MCAP_HEAD_BYTES + 1 + 8 + 8,     /* of a summary offset */
	OFFSETS_LIMIT_BYTES = 4096,                     /* of them; there are seven kinds */
	TIMES_AT = MCAP_HEAD_BYTES + 8 + 2 + 4 * 4,     /* in the statistics */
	STATISTICS_BYTES = TIMES_AT + 16,               /* that are read of them */
	INDEX_HEAD_BYTES = MCAP_HEAD_BYTES + 8 + 8 + 4, /* of a metadata index, before its name */
	GROUP_LIMIT_BYTES = 64 * 1024,
	NOTES_LIMIT_BYTES = 64 * 1024,
	NUMBER_BYTES = 24,
};

static const char notes_name[] = "ecdaq.end";

/* A part of the file. */
struct range {
	uint64_t at;
	uint64_t bytes;
};

struct ends {
	struct range statistics;
	struct range metadata; /* index of it */
};

static int is_within(const struct range *part, const struct range *whole)
{
	return part->at >= whole->at && part->bytes <= whole->bytes &&
	       part->at - whole->at <= whole->bytes - part->bytes;
}

/* @part as memory: free() it. NULL with *@ret_error. */
static uint8_t *read_part(const struct mcap_source *source, const struct range *part,
			  uint64_t limit, int *ret_error)
{
	const struct range file = { 0, source->bytes };
	uint8_t *data = NULL;

	*ret_error = -EBADMSG;
	if (part->bytes > 0 && part->bytes <= limit && is_within(part, &file)) {
		data = malloc(part->bytes);
		*ret_error = data == NULL ? -ENOMEM
					  : source->read_at(source->ctx, part->at, data,
							    (size_t)part->bytes);
	}
	if (*ret_error < 0) {
		free(data);
		return NULL;
	}
	return data;
}

/* Where the summary's parts are, by the footer and the summary offsets. */
static int find_ends(const struct mcap_source *source, struct ends *ret)
{
	uint8_t tail[TAIL_BYTES];
	struct range summary;
	struct range offsets;
	uint8_t *data;
	int r;

	if (source->bytes < MCAP_MAGIC_BYTES + TAIL_BYTES) {
		return -ENODATA;
	}
	offsets.bytes = source->bytes - TAIL_BYTES; /* where the footer is */
	r = source->read_at(source->ctx, offsets.bytes, tail, sizeof(tail));
	if (r < 0) {
		return r;
	}
	if (memcmp(tail + MCAP_FOOTER_BYTES, MCAP_MAGIC, MCAP_MAGIC_BYTES) != 0) {
		return -ENODATA;
	}
	summary.at = get_le64(tail + MCAP_HEAD_BYTES);
	offsets.at = get_le64(tail + MCAP_HEAD_BYTES + 8);
	if (tail[0] != MCAP_OP_FOOTER || summary.at < MCAP_MAGIC_BYTES || summary.at > offsets.at ||
	    offsets.at > offsets.bytes) {
		return -EBADMSG;
	}
	offsets.bytes -= offsets.at;
	summary.bytes = offsets.at - summary.at;
	data = read_part(source, &offsets, OFFSETS_LIMIT_BYTES, &r);
	*ret = (struct ends){ .statistics = { 0, 0 } };
	for (uint64_t at = 0; r == 0 && at + OFFSET_BYTES <= offsets.bytes; at += OFFSET_BYTES) {
		const uint8_t *p = data + at;
		struct range group = { get_le64(p + MCAP_HEAD_BYTES + 1),
				       get_le64(p + MCAP_HEAD_BYTES + 9) };

		if (p[0] != MCAP_OP_SUMMARY_OFFSET ||
		    get_le64(p + 1) != OFFSET_BYTES - MCAP_HEAD_BYTES ||
		    !is_within(&group, &summary)) {
			r = -EBADMSG;
		} else if (p[MCAP_HEAD_BYTES] == MCAP_OP_STATISTICS) {
			ret->statistics = group;
		} else if (p[MCAP_HEAD_BYTES] == MCAP_OP_METADATA_INDEX) {
			ret->metadata = group;
		}
	}
	free(data);
	return r;
}

/* The last metadata with the name of the closing notes. 0, -ENOENT. */
static int find_notes(const uint8_t *index, uint64_t bytes, struct range *ret)
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
			*ret = (struct range){ get_le64(p + MCAP_HEAD_BYTES),
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

static int read_notes(const struct mcap_source *source, const struct range *metadata,
		      struct overview *overview)
{
	struct range part = { 0, 0 };
	struct mcap_item notes = { .offset = 0 };
	uint64_t first = 0;
	uint64_t last = 0;
	uint8_t *data;
	int r;

	data = read_part(source, metadata, GROUP_LIMIT_BYTES, &r);
	r = r < 0 ? r : find_notes(data, metadata->bytes, &part);
	free(data);
	if (r < 0) {
		return r;
	}
	data = read_part(source, &part, NOTES_LIMIT_BYTES, &r);
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
	r = r < 0 ? r : get_number(&notes, "first_cycle", &first);
	r = r < 0 ? r : get_number(&notes, "last_cycle", &last);
	free(data);
	if (r == 0 && overview->cycles > 0) {
		if (last < first || last - first < overview->cycles - 1) {
			return -EBADMSG;
		}
		overview->missing = last - first - (overview->cycles - 1);
	}
	return r;
}

int overview_read(const struct mcap_source *source, struct overview *ret)
{
	struct overview found = { .start_ns = 0 };
	struct ends ends;
	uint8_t *data;
	int r = find_ends(source, &ends);

	if (r < 0) {
		return r;
	}
	if (ends.statistics.bytes < STATISTICS_BYTES) {
		return -EBADMSG;
	}
	ends.statistics.bytes = STATISTICS_BYTES;
	data = read_part(source, &ends.statistics, STATISTICS_BYTES, &r);
	if (r < 0) {
		return r;
	}
	r = data[0] == MCAP_OP_STATISTICS ? 0 : -EBADMSG;
	found.start_ns = get_le64(data + TIMES_AT);
	found.end_ns = get_le64(data + TIMES_AT + 8);
	free(data);
	if (r == 0 && ends.metadata.bytes > 0) {
		r = read_notes(source, &ends.metadata, &found);
		found.has_counts = r == 0;
		r = r == -ENOENT ? 0 : r;
	}
	if (r == 0) {
		*ret = found;
	}
	return r;
}
