/* SPDX-License-Identifier: MIT */
/*
 * Any bytes as a recording: read, checked, printed as a table, repaired. What was repaired must be
 * whole, and have the messages that were found before.
 */
#include <assert.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "record/columns.h"
#include "record/mcap_places.h"
#include "record/mcap_recover.h"
#include "record/overview.h"
#include "record/track.h"

struct bytes {
	uint8_t *data;
	size_t len;
};

static int read_at(void *ctx, uint64_t offset, void *buf, size_t len)
{
	const struct bytes *b = ctx;

	assert(offset <= b->len && len <= b->len - offset);
	memcpy(buf, b->data + offset, len);
	return 0;
}

static int write_end(void *ctx, const void *data, size_t len)
{
	struct bytes *b = ctx;

	b->data = realloc(b->data, b->len + len + 1);
	assert(b->data != NULL);
	memcpy(b->data + b->len, data, len);
	b->len += len;
	return 0;
}

static int sync_nothing(void *ctx)
{
	(void)ctx;
	return 0;
}

static int truncate_bytes(void *ctx, uint64_t len)
{
	struct bytes *b = ctx;

	assert(len <= b->len);
	b->len = (size_t)len;
	return 0;
}

static struct mcap_source source_of(struct bytes *b)
{
	return (struct mcap_source){ .read_at = read_at, .bytes = b->len, .ctx = b };
}

static struct mcap_io io_of(struct bytes *b)
{
	return (struct mcap_io){
		.write = write_end, .sync = sync_nothing, .truncate = truncate_bytes, .ctx = b
	};
}

static void print_table(struct bytes *b, FILE *nowhere)
{
	const struct mcap_source source = source_of(b);
	struct columns *c = columns_create(NULL, 0, b->len % 2 ? LOG_JSON : LOG_TEXT);
	struct mcap_reader *reader;
	struct mcap_item item;
	char missing[64];
	int r;

	assert(c != NULL);
	if (mcap_reader_create(&source, &reader) == 0) {
		while (mcap_reader_next(reader, &item) > 0) {
			if (item.kind == MCAP_ITEM_SCHEMA || item.kind == MCAP_ITEM_CHANNEL) {
				r = columns_learn(c, &item);
				assert(r == 0);
			} else if (item.kind != MCAP_ITEM_MESSAGE ||
				   (!columns_is_frozen(c) &&
				    columns_freeze(c, missing, sizeof(missing)) < 0)) {
				continue;
			} else if (columns_is_cycle(c, &item)) {
				(void)columns_begin_row(c, &item);
			} else {
				(void)columns_take(c, &item);
			}
			if (columns_is_frozen(c) && columns_has_row(c)) {
				columns_put_header(c, nowhere);
				columns_put_row(c, nowhere);
			}
		}
		mcap_reader_destroy(reader);
	}
	columns_destroy(c);
}

/* Each place that is found can be gone to, whatever is there. */
static void go_to_places(struct bytes *b, enum mcap_opcode kind)
{
	const struct mcap_source source = source_of(b);
	struct mcap_places places;
	struct mcap_reader *reader;
	struct mcap_item item;
	int r = mcap_places_read(&source, kind, &places);

	assert(r == 0);
	if (mcap_reader_create(&source, &reader) == 0) {
		for (size_t i = 0; i < places.count; i++) {
			assert(i == 0 || places.at[i] >= places.at[i - 1]);
			mcap_reader_seek(reader, places.at[i]);
			(void)mcap_reader_next(reader, &item);
			(void)mcap_reader_next(reader, &item);
		}
		mcap_reader_destroy(reader);
	}
	mcap_places_done(&places);
}

/* @b must be a whole file with @messages messages. */
static void check_whole(struct bytes *b, uint64_t messages)
{
	const struct mcap_source source = source_of(b);
	struct mcap_scan *scan;
	int r = mcap_scan_create(&source, NULL, &scan);

	assert(r == 0);
	assert(mcap_scan_is_whole(scan));
	assert(mcap_scan_findings(scan)->messages == messages);
	mcap_scan_destroy(scan);
}

static void repair(struct bytes *b)
{
	const struct mcap_source source = source_of(b);
	const struct mcap_io io = io_of(b);
	struct track track;
	const struct mcap_visitor visitor = { .item = track_visit, .ctx = &track };
	struct bytes copy = { .data = NULL };
	const struct mcap_io copy_io = io_of(&copy);
	struct mcap_writer *w;
	struct mcap_scan *scan;
	uint64_t messages;
	int r;

	track_init(&track);
	if (mcap_scan_create(&source, &visitor, &scan) < 0) {
		return;
	}
	r = mcap_writer_create(&copy_io, 0, &w);
	assert(r == 0);
	if (mcap_copy_whole(&source, scan, w) == 0) {
		r = mcap_writer_finish(w);
		assert(r == 0);
		check_whole(&copy, mcap_writer_index(w)->messages);
	}
	mcap_writer_destroy(w);
	free(copy.data);
	messages = mcap_scan_findings(scan)->messages;
	if (!mcap_scan_is_whole(scan) && mcap_scan_resume(scan, &io, &w) == 0) {
		r = mcap_writer_finish(w);
		assert(r == 0);
		mcap_writer_destroy(w);
		check_whole(b, messages);
	}
	mcap_scan_destroy(scan);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	static FILE *nowhere;
	struct bytes b = { .data = NULL };
	struct mcap_source source;
	struct mcap_reader *reader;
	struct mcap_item item;
	struct overview overview;

	if (nowhere == NULL) {
		nowhere = fopen("/dev/null", "w");
		assert(nowhere != NULL);
	}
	write_end(&b, data, size);
	source = source_of(&b);
	if (mcap_reader_create_summary(&source, &reader) == 0) {
		while (mcap_reader_next(reader, &item) > 0) {
		}
		mcap_reader_destroy(reader);
	}
	if (overview_read(&source, &overview) == 0) {
		assert(!overview.has_counts ||
		       overview.missing + overview.cycles >= overview.missing);
	}
	go_to_places(&b, MCAP_OP_CHUNK);
	go_to_places(&b, MCAP_OP_ATTACHMENT);
	print_table(&b, nowhere);
	repair(&b);
	free(b.data);
	return 0;
}
