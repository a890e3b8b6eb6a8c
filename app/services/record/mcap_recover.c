/* SPDX-License-Identifier: MIT */
#include "record/mcap_recover.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "record/mcap_chunk.h"
#include "record/mcap_definitions.h"

struct mcap_scan {
	struct mcap_findings found;
	struct mcap_index index;
	struct mcap_index best;            /* of its schemas and channels: the best copy */
	struct mcap_chunk_index *messages; /* of the newest chunk */
	size_t index_seen;                 /* bytes of its message index found behind it */
	int has_open_index;                /* more of it is to come */
	uint64_t chunk_end;
	uint32_t chunk_crc; /* of all bytes before chunk_end */
	uint32_t valid_crc; /* of all bytes before found.valid_bytes */
	int has_header;
	int has_ended;
};

void mcap_scan_destroy(struct mcap_scan *scan)
{
	if (scan == NULL) {
		return;
	}
	mcap_chunk_index_destroy(scan->messages);
	mcap_index_done(&scan->index);
	mcap_index_done(&scan->best);
	free(scan);
}

const struct mcap_findings *mcap_scan_findings(const struct mcap_scan *scan)
{
	return &scan->found;
}

int mcap_scan_is_whole(const struct mcap_scan *scan)
{
	return scan->has_ended && scan->found.ending == MCAP_ENDING_GOOD &&
	       scan->found.damaged == 0;
}

static size_t index_len(const struct mcap_scan *scan)
{
	size_t len;

	mcap_chunk_index_bytes(scan->messages, &len);
	return len;
}

/* Ours writes the index right behind the chunk, always the same bytes; anything else needs a copy.
 */
static void take_message_index(struct mcap_scan *scan, const struct mcap_item *item)
{
	size_t wanted_len;
	const uint8_t *wanted = mcap_chunk_index_bytes(scan->messages, &wanted_len);

	if (!scan->has_open_index || item->record_len > wanted_len - scan->index_seen ||
	    memcmp(item->record, wanted + scan->index_seen, item->record_len) != 0) {
		scan->found.needs_copy = 1;
		return;
	}
	scan->index_seen += item->record_len;
	scan->has_open_index = scan->index_seen < wanted_len;
}

static int take_chunk(struct mcap_scan *scan, const struct mcap_item *item)
{
	struct mcap_chunk_place place = { .offset = item->offset,
					  .record_len = item->record_len,
					  .uncompressed_len = item->data_len };
	char compression[16];
	int r = mcap_chunk_index_build(scan->messages, item->data, item->data_len);

	if (r == -EBADMSG) {
		scan->found.damaged++;
		scan->found.needs_copy = 1;
		return 0;
	}
	if (r < 0) {
		return r;
	}
	snprintf(compression, sizeof(compression), "%.*s", (int)item->encoding.len,
		 item->encoding.at);
	place.compression = compression;
	place.compressed_len = mcap_chunk_content_len(item->record_len, item->encoding.len);
	r = mcap_index_chunk(&scan->index, &place, scan->messages);
	scan->found.chunks++;
	scan->found.messages += mcap_chunk_index_messages(scan->messages);
	scan->index_seen = 0;
	scan->has_open_index = index_len(scan) > 0;
	scan->chunk_end = item->offset + item->record_len;
	return r;
}

static void take_damage(struct mcap_scan *scan, const char *reason, uint64_t offset)
{
	if (scan->found.damaged++ == 0) {
		scan->found.reason = reason;
		scan->found.reason_offset = offset;
	}
}

/* A schema or channel, which may have been seen before. */
static int take_definition(struct mcap_scan *scan, const struct mcap_item *item)
{
	int r = 0;

	if (mcap_index_contradicts(&scan->index, item->record, item->record_len) ||
	    mcap_index_contradicts(&scan->best, item->record, item->record_len)) {
		take_damage(scan, "schema or channel differs from its copy", item->offset);
		scan->found.needs_copy = 1;
	}
	if (item->is_inner) { /* under the chunk's CRC */
		r = mcap_index_define(&scan->best, item->record, item->record_len);
	}
	return r < 0 ? r : mcap_index_define(&scan->index, item->record, item->record_len);
}

static int note_record(struct mcap_scan *scan, const struct mcap_item *item)
{
	switch (item->kind) {
	case MCAP_ITEM_SCHEMA:
	case MCAP_ITEM_CHANNEL:
		return take_definition(scan, item);
	case MCAP_ITEM_CHUNK:
		return take_chunk(scan, item);
	case MCAP_ITEM_ATTACHMENT:
		return mcap_index_attachment(&scan->index, item->offset, item->record,
					     item->record_len);
	case MCAP_ITEM_METADATA:
		return mcap_index_metadata(&scan->index, item->offset, item->record,
					   item->record_len);
	case MCAP_ITEM_MESSAGE_INDEX:
		take_message_index(scan, item);
		return 0;
	case MCAP_ITEM_MESSAGE:
		if (!item->is_inner) {
			scan->found.needs_copy = 1; /* not in a chunk: no CRC, no index */
			mcap_index_count(&scan->index, item->id, 1);
		}
		return 0;
	case MCAP_ITEM_HEADER:
		scan->has_header = 1;
		return 0;
	case MCAP_ITEM_DATA_END:
		scan->has_ended = 1;
		return 0;
	case MCAP_ITEM_STATISTICS:
	case MCAP_ITEM_OTHER:
	case MCAP_ITEM_DAMAGE:
		return 0;
	}
	return 0;
}

static int take_item(struct mcap_scan *scan, const struct mcap_item *item, uint32_t data_crc)
{
	if (item->kind == MCAP_ITEM_DAMAGE) {
		take_damage(scan, item->reason, item->offset);
		return 0;
	}
	if (!item->is_inner && scan->found.damaged > 0) {
		scan->found.needs_copy = 1; /* there are complete records after the damage */
	}
	if (!item->is_inner && scan->has_open_index && item->kind != MCAP_ITEM_MESSAGE_INDEX) {
		scan->found.needs_copy = 1; /* a chunk without its index */
		scan->has_open_index = 0;
	}
	if (!item->is_inner && item->kind != MCAP_ITEM_DATA_END) {
		scan->found.valid_bytes = item->offset + item->record_len;
		scan->valid_crc = data_crc;
		scan->chunk_crc = item->kind == MCAP_ITEM_CHUNK ? data_crc : scan->chunk_crc;
	}
	return note_record(scan, item);
}

static int scan_all(struct mcap_scan *scan, struct mcap_reader *reader,
		    const struct mcap_visitor *visitor)
{
	struct mcap_item item;
	int r;

	while ((r = mcap_reader_next(reader, &item)) > 0) {
		r = take_item(scan, &item, mcap_reader_data_crc(reader));
		if (r < 0) {
			return r;
		}
		if (visitor != NULL) {
			visitor->item(visitor->ctx, &item);
		}
	}
	return r;
}

/* All was read: what should have been there? */
static int judge(struct mcap_scan *scan, const struct mcap_source *source)
{
	const char *missing = mcap_definitions_missing(&scan->index, &scan->best);
	int r = mcap_ending_check(source, &scan->found.ending);

	if (!scan->has_header && scan->found.chunks == 0) {
		r = r < 0 ? r : -ENODATA;
	}
	if (!scan->has_header) {
		take_damage(scan, "no header", 0);
		scan->found.needs_copy = 1;
	}
	if (missing != NULL) {
		take_damage(scan, missing, scan->found.valid_bytes);
		scan->found.needs_copy = 1;
	}
	if (!mcap_scan_is_whole(scan)) {
		scan->found.lost_bytes = source->bytes - scan->found.valid_bytes;
	}
	return r < 0 ? r : mcap_definitions_complete(&scan->best, &scan->index);
}

int mcap_scan_create(const struct mcap_source *source, const struct mcap_visitor *visitor,
		     struct mcap_scan **ret_scan)
{
	struct mcap_reader *reader;
	struct mcap_scan *scan;
	int r = mcap_reader_create(source, &reader);

	if (r < 0) {
		return r;
	}
	scan = calloc(1, sizeof(*scan));
	if (scan != NULL) {
		scan->messages = mcap_chunk_index_create();
	}
	if (scan == NULL || scan->messages == NULL || mcap_index_init(&scan->index) < 0 ||
	    mcap_index_init(&scan->best) < 0) {
		r = -ENOMEM;
		goto destroy;
	}
	r = mcap_definitions_read_summary(source, &scan->best);
	r = r < 0 ? r : scan_all(scan, reader, visitor);
	r = r < 0 ? r : judge(scan, source);
	if (r < 0) {
		goto destroy;
	}
	mcap_reader_destroy(reader);
	*ret_scan = scan;
	return 0;

destroy:
	mcap_reader_destroy(reader);
	mcap_scan_destroy(scan);
	return r;
}

int mcap_scan_resume(struct mcap_scan *scan, const struct mcap_io *io,
		     struct mcap_writer **ret_writer)
{
	struct mcap_writer *w;
	const uint8_t *index;
	size_t len;
	int r;

	if (scan->found.needs_copy) {
		return -EXDEV;
	}
	r = mcap_writer_create(io, 0, &w);
	if (r < 0) {
		return r;
	}
	/* The index of the last chunk was cut: write it again completely. */
	mcap_writer_resume(w, scan->has_open_index ? scan->chunk_end : scan->found.valid_bytes,
			   scan->has_open_index ? scan->chunk_crc : scan->valid_crc, &scan->index);
	if (scan->has_open_index) {
		index = mcap_chunk_index_bytes(scan->messages, &len);
		r = mcap_writer_copy(w, index, len);
	}
	if (r < 0) {
		mcap_writer_destroy(w);
		return r;
	}
	*ret_writer = w;
	return 0;
}

/* A copy in the making. */
struct copy {
	const struct mcap_scan *scan;
	struct mcap_writer *w;
	struct mcap_chunk_index *messages;
	int takes_inner; /* the messages of this chunk go over one by one */
};

static int copy_message(struct copy *c, const struct mcap_item *item)
{
	struct mcap_message m = { .channel_id = item->id,
				  .sequence = item->sequence,
				  .log_time_ns = item->log_time_ns,
				  .publish_time_ns = item->publish_time_ns,
				  .data = item->data,
				  .data_len = item->data_len };
	int r;

	if (!mcap_index_can_read(&c->scan->best, item->id)) {
		return 0; /* nobody could read it */
	}
	r = mcap_writer_message(c->w, &m);
	if (r == -ENOBUFS) {
		r = mcap_writer_close_chunk(c->w);
		r = r < 0 ? r : mcap_writer_message(c->w, &m);
	}
	return r == -ENOBUFS ? 0 : r; /* larger than any that we write: not one of ours */
}

static int copy_chunk(struct copy *c, const struct mcap_item *item)
{
	char compression[16];
	int r = mcap_chunk_index_build(c->messages, item->data, item->data_len);

	c->takes_inner =
		r == 0 && !mcap_definitions_fit(&c->scan->best, item->data, item->data_len);
	if (r < 0 || c->takes_inner) {
		return r == -EBADMSG ? 0 : r; /* right CRC, wrong content: leave it out */
	}
	r = mcap_writer_close_chunk(c->w);
	if (r < 0) {
		return r;
	}
	snprintf(compression, sizeof(compression), "%.*s", (int)item->encoding.len,
		 item->encoding.at);
	return mcap_writer_copy_chunk(c->w, item->record, item->record_len, compression,
				      item->data_len, c->messages);
}

/* Before anything else; a lost header is that of the recorder. */
static int copy_head(struct copy *c, const struct mcap_item *item)
{
	char profile[256] = "ros2";
	char library[256] = "ecdaq";
	int r;

	if (item->kind == MCAP_ITEM_HEADER) {
		snprintf(profile, sizeof(profile), "%.*s", (int)item->name.len, item->name.at);
		snprintf(library, sizeof(library), "%.*s", (int)item->encoding.len,
			 item->encoding.at);
	}
	r = mcap_writer_begin(c->w, profile, library);
	return r < 0 ? r : mcap_definitions_put(&c->scan->best, c->w);
}

static int copy_item(struct copy *c, const struct mcap_item *item)
{
	switch (item->kind) {
	case MCAP_ITEM_CHUNK:
		return copy_chunk(c, item);
	case MCAP_ITEM_MESSAGE:
		return item->is_inner && !c->takes_inner ? 0 : copy_message(c, item);
	case MCAP_ITEM_ATTACHMENT:
	case MCAP_ITEM_METADATA:
		return mcap_writer_copy(c->w, item->record, item->record_len);
	case MCAP_ITEM_HEADER:
	case MCAP_ITEM_SCHEMA: /* the best copies are behind the header already */
	case MCAP_ITEM_CHANNEL:
	case MCAP_ITEM_MESSAGE_INDEX: /* generated again after its chunk */
	case MCAP_ITEM_STATISTICS:
	case MCAP_ITEM_OTHER:
	case MCAP_ITEM_DATA_END:
	case MCAP_ITEM_DAMAGE:
		return 0;
	}
	return 0;
}

int mcap_copy_whole(const struct mcap_source *source, const struct mcap_scan *scan,
		    struct mcap_writer *w)
{
	struct copy c = { .scan = scan, .w = w, .messages = mcap_chunk_index_create() };
	struct mcap_reader *reader = NULL;
	struct mcap_item item;
	int r = c.messages == NULL ? -ENOMEM : mcap_reader_create(source, &reader);

	if (r < 0) {
		mcap_chunk_index_destroy(c.messages);
		return r;
	}
	while ((r = mcap_reader_next(reader, &item)) > 0) {
		if (mcap_writer_bytes(w) == 0 && item.kind != MCAP_ITEM_DAMAGE) {
			r = copy_head(&c, &item);
		}
		r = r < 0 ? r : copy_item(&c, &item);
		if (r < 0) {
			break;
		}
	}
	if (r == 0 && mcap_writer_bytes(w) == 0) {
		r = -ENODATA;
	}
	mcap_reader_destroy(reader);
	mcap_chunk_index_destroy(c.messages);
	return r;
}
