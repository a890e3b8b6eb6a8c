/* SPDX-License-Identifier: MIT */
#include "record/mcap_places.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"

enum {
	TAIL_BYTES = MCAP_FOOTER_BYTES + MCAP_MAGIC_BYTES,
	OFFSET_BYTES = MCAP_HEAD_BYTES + 1 + 8 + 8, /* of a summary offset */
	OFFSETS_LIMIT_BYTES = 4096,                 /* of them; there are seven kinds */
};

static int is_within(const struct mcap_range *part, const struct mcap_range *whole)
{
	return part->at >= whole->at && part->bytes <= whole->bytes &&
	       part->at - whole->at <= whole->bytes - part->bytes;
}

uint8_t *mcap_range_read(const struct mcap_source *source, const struct mcap_range *part,
			 uint64_t limit, int *ret_error)
{
	const struct mcap_range file = { 0, source->bytes };
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

int mcap_groups_find(const struct mcap_source *source, struct mcap_groups *ret)
{
	uint8_t tail[TAIL_BYTES];
	struct mcap_range summary;
	struct mcap_range offsets;
	uint8_t *data;
	int r;

	memset(ret, 0, sizeof(*ret));
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
	data = mcap_range_read(source, &offsets, OFFSETS_LIMIT_BYTES, &r);
	for (uint64_t at = 0; r == 0 && at + OFFSET_BYTES <= offsets.bytes; at += OFFSET_BYTES) {
		const uint8_t *p = data + at;
		struct mcap_range group = { get_le64(p + MCAP_HEAD_BYTES + 1),
					    get_le64(p + MCAP_HEAD_BYTES + 9) };

		if (p[0] != MCAP_OP_SUMMARY_OFFSET ||
		    get_le64(p + 1) != OFFSET_BYTES - MCAP_HEAD_BYTES ||
		    !is_within(&group, &summary)) {
			r = -EBADMSG;
		} else if (p[MCAP_HEAD_BYTES] <= MCAP_OP_DATA_END) {
			ret->kind[p[MCAP_HEAD_BYTES]] = group;
		}
	}
	free(data);
	return r;
}

static int add(struct mcap_places *places, uint64_t offset)
{
	if ((places->count & (places->count - 1)) == 0) { /* full at each power of two */
		size_t room = places->count == 0 ? 1 : places->count * 2;
		uint64_t *grown = reallocarray(places->at, room, sizeof(places->at[0]));

		if (grown == NULL) {
			return -ENOMEM;
		}
		places->at = grown;
	}
	places->at[places->count++] = offset;
	return 0;
}

/* From the index records of the summary: each has the offset at @offset_at. */
static int read_group(const struct mcap_source *source, const struct mcap_range *group,
		      uint8_t opcode, size_t offset_at, struct mcap_places *ret)
{
	uint64_t before = MCAP_MAGIC_BYTES;
	uint64_t len;
	uint8_t *data;
	int r = 0;

	if (group->bytes == 0) {
		return 0;
	}
	data = mcap_range_read(source, group, 2 * (uint64_t)MCAP_LIMIT_INDEX_BYTES, &r);
	for (uint64_t at = 0; r == 0 && at < group->bytes; at += MCAP_HEAD_BYTES + len) {
		uint64_t left = group->bytes - at;
		uint64_t offset;

		if (left < MCAP_HEAD_BYTES + offset_at + 8 || data[at] != opcode ||
		    get_le64(data + at + 1) > left - MCAP_HEAD_BYTES) {
			r = -EBADMSG;
			break;
		}
		len = get_le64(data + at + 1);
		offset = get_le64(data + at + MCAP_HEAD_BYTES + offset_at);
		r = offset < before || offset > source->bytes || len < offset_at + 8
			    ? -EBADMSG
			    : add(ret, offset);
		before = offset;
	}
	free(data);
	return r;
}

/* From record to record, as far as there are some. */
static int walk(const struct mcap_source *source, enum mcap_opcode kind, struct mcap_places *ret)
{
	uint64_t at = MCAP_MAGIC_BYTES;
	uint8_t head[MCAP_HEAD_BYTES];
	int r = 0;

	while (r == 0 && source->bytes - at >= sizeof(head)) {
		uint64_t len;

		r = source->read_at(source->ctx, at, head, sizeof(head));
		len = get_le64(head + 1);
		if (r < 0 || head[0] == 0 || len > source->bytes - at - sizeof(head)) {
			break;
		}
		r = head[0] == kind ? add(ret, at) : 0;
		at += sizeof(head) + len;
	}
	return r;
}

int mcap_places_read(const struct mcap_source *source, enum mcap_opcode kind,
		     struct mcap_places *ret)
{
	struct mcap_groups groups;
	int is_chunk = kind == MCAP_OP_CHUNK;
	uint8_t opcode = is_chunk ? MCAP_OP_CHUNK_INDEX : MCAP_OP_ATTACHMENT_INDEX;
	int r = source->bytes < MCAP_MAGIC_BYTES ? -ENODATA : mcap_groups_find(source, &groups);

	*ret = (struct mcap_places){ .count = 0 };
	/* A chunk index has two times before the offset. */
	r = r < 0 ? r : read_group(source, &groups.kind[opcode], opcode, is_chunk ? 16 : 0, ret);
	if (r == -ENODATA || r == -EBADMSG) {
		ret->count = 0;
		r = source->bytes < MCAP_MAGIC_BYTES ? 0 : walk(source, kind, ret);
	}
	return r;
}

void mcap_places_done(struct mcap_places *places)
{
	free(places->at);
	*places = (struct mcap_places){ .count = 0 };
}
