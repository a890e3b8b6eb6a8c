/* SPDX-License-Identifier: MIT */
#include "record/mcap_recover.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "record/mcap_chunk.h"

struct mcap_scan {
	struct mcap_findings found;
	struct mcap_index index;
	struct mcap_chunk_index *messages; /* of the newest chunk */
	size_t index_seen;                 /* bytes of its message index found behind it */
	int has_open_index;                /* more of it is to come */
	uint64_t chunk_end;
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

static void take_damage(struct mcap_scan *scan, const struct mcap_item *item)
{
	if (scan->found.damaged++ == 0) {
		scan->found.reason = item->reason;
		scan->found.reason_offset = item->offset;
	}
}

static int note_record(struct mcap_scan *scan, const struct mcap_item *item)
{
	switch (item->kind) {
	case MCAP_ITEM_SCHEMA:
		return mcap_index_schema(&scan->index, item->record, item->record_len);
	case MCAP_ITEM_CHANNEL:
		return mcap_index_channel(&scan->index, item->record, item->record_len);
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

static int take_item(struct mcap_scan *scan, const struct mcap_item *item)
{
	if (item->kind == MCAP_ITEM_DAMAGE) {
		take_damage(scan, item);
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
	}
	return note_record(scan, item);
}

static int scan_all(struct mcap_scan *scan, struct mcap_reader *reader,
		    const struct mcap_visitor *visitor)
{
	struct mcap_item item;
	int r;

	while ((r = mcap_reader_next(reader, &item)) > 0) {
		r = take_item(scan, &item);
		if (r < 0) {
			return r;
		}
		if (visitor != NULL) {
			visitor->item(visitor->ctx, &item);
		}
	}
	return r;
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
	if (scan == NULL || scan->messages == NULL || mcap_index_init(&scan->index) < 0) {
		r = -ENOMEM;
		goto destroy;
	}
	r = scan_all(scan, reader, visitor);
	if (r < 0) {
		goto destroy;
	}
	r = mcap_ending_check(source, &scan->found.ending);
	if (r == 0 && !scan->has_header) {
		r = -ENODATA;
	}
	if (r < 0) {
		goto destroy;
	}
	if (!mcap_scan_is_whole(scan)) {
		scan->found.lost_bytes = source->bytes - scan->found.valid_bytes;
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
			   &scan->index);
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

static int copy_message(struct mcap_writer *w, const struct mcap_item *item)
{
	struct mcap_message m = { .channel_id = item->id,
				  .sequence = item->sequence,
				  .log_time_ns = item->log_time_ns,
				  .publish_time_ns = item->publish_time_ns,
				  .data = item->data,
				  .data_len = item->data_len };
	int r = mcap_writer_message(w, &m);

	if (r == -ENOBUFS) {
		r = mcap_writer_close_chunk(w);
		r = r < 0 ? r : mcap_writer_message(w, &m);
	}
	return r;
}

static int copy_chunk(struct mcap_writer *w, struct mcap_chunk_index *messages,
		      const struct mcap_item *item)
{
	char compression[16];
	int r = mcap_chunk_index_build(messages, item->data, item->data_len);

	if (r < 0) {
		return r == -EBADMSG ? 0 : r; /* right CRC, wrong content: leave it out */
	}
	snprintf(compression, sizeof(compression), "%.*s", (int)item->encoding.len,
		 item->encoding.at);
	return mcap_writer_copy_chunk(w, item->record, item->record_len, compression,
				      item->data_len, messages);
}

static int copy_header(struct mcap_writer *w, const struct mcap_item *item)
{
	char profile[256];
	char library[256];

	snprintf(profile, sizeof(profile), "%.*s", (int)item->name.len, item->name.at);
	snprintf(library, sizeof(library), "%.*s", (int)item->encoding.len, item->encoding.at);
	return mcap_writer_begin(w, profile, library);
}

static int copy_item(struct mcap_writer *w, struct mcap_chunk_index *messages,
		     const struct mcap_item *item)
{
	switch (item->kind) {
	case MCAP_ITEM_HEADER:
		return mcap_writer_bytes(w) == 0 ? copy_header(w, item) : 0;
	case MCAP_ITEM_CHUNK:
		return copy_chunk(w, messages, item);
	case MCAP_ITEM_MESSAGE:
		return item->is_inner ? 0 : copy_message(w, item);
	case MCAP_ITEM_SCHEMA:
	case MCAP_ITEM_CHANNEL:
		return item->is_inner ? mcap_writer_note(w, item->record, item->record_len)
				      : mcap_writer_copy(w, item->record, item->record_len);
	case MCAP_ITEM_ATTACHMENT:
	case MCAP_ITEM_METADATA:
		return mcap_writer_copy(w, item->record, item->record_len);
	case MCAP_ITEM_MESSAGE_INDEX: /* generated again after its chunk */
	case MCAP_ITEM_STATISTICS:
	case MCAP_ITEM_OTHER:
	case MCAP_ITEM_DATA_END:
	case MCAP_ITEM_DAMAGE:
		return 0;
	}
	return 0;
}

int mcap_copy_whole(const struct mcap_source *source, struct mcap_writer *w)
{
	struct mcap_chunk_index *messages = mcap_chunk_index_create();
	struct mcap_reader *reader = NULL;
	struct mcap_item item;
	int r = messages == NULL ? -ENOMEM : mcap_reader_create(source, &reader);

	if (r < 0) {
		mcap_chunk_index_destroy(messages);
		return r;
	}
	while ((r = mcap_reader_next(reader, &item)) > 0) {
		if (mcap_writer_bytes(w) == 0 && item.kind != MCAP_ITEM_HEADER) {
			r = -ENODATA;
			break;
		}
		r = copy_item(w, messages, &item);
		if (r < 0) {
			break;
		}
	}
	if (r == 0 && mcap_writer_bytes(w) == 0) {
		r = -ENODATA;
	}
	mcap_reader_destroy(reader);
	mcap_chunk_index_destroy(messages);
	return r;
}
