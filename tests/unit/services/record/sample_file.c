/* SPDX-License-Identifier: MIT */
#include "unit/services/record/sample_file.h"

#include <string.h>

#include "base/bytes.h"
#include "harness/test.h"
#include "record/mcap_reader.h"
#include "record/mcap_recover.h"

struct mcap_writer *sample_file_begin(struct memory_file *f, int zstd_level)
{
	const struct mcap_pair pairs[] = { { "answer", "42" }, { "empty", "" } };
	const struct mcap_io io = memory_io(f);
	struct mcap_channel_spec channel = { .topic = "/even", .message_encoding = "cdr" };
	struct mcap_writer *w;

	CHECK_EQ(mcap_writer_create(&io, zstd_level, &w), 0);
	CHECK_EQ(mcap_writer_begin(w, "ros2", "test"), 0);
	CHECK_EQ(mcap_writer_schema(w, "pkg/msg/Number", "ros2msg", "uint64 number\n"), 1);
	channel.schema_id = 1;
	CHECK_EQ(mcap_writer_channel(w, &channel), 0);
	channel.topic = "/odd";
	channel.pairs = pairs;
	channel.pair_count = 2;
	CHECK_EQ(mcap_writer_channel(w, &channel), 1);
	CHECK_EQ(mcap_writer_metadata(w, "head", pairs, 2), 0);
	return w;
}

int sample_file_message(struct mcap_writer *w, unsigned n)
{
	uint8_t data[12] = { 0, 1, 0, 0 };

	put_le64(data + 4, n);
	return mcap_writer_message(w, &(struct mcap_message){ .channel_id = n % 2,
							      .sequence = n,
							      .log_time_ns = 1000 + n,
							      .publish_time_ns = 1000 + n,
							      .data = data,
							      .data_len = sizeof(data) });
}

void sample_file_make(struct memory_file *f, int zstd_level)
{
	struct mcap_writer *w = sample_file_begin(f, zstd_level);

	for (unsigned n = 0; n < SAMPLE_CHUNKS * SAMPLE_CHUNK_MESSAGES; n++) {
		CHECK_EQ(sample_file_message(w, n), 0);
		if (n % SAMPLE_CHUNK_MESSAGES == SAMPLE_CHUNK_MESSAGES - 1) {
			CHECK_EQ(mcap_writer_close_chunk(w), 0);
		}
	}
	CHECK_EQ(mcap_writer_attachment(w, "note.txt", "text/plain", 7, "hello", 5), 0);
	CHECK_EQ(mcap_writer_finish(w), 0);
	mcap_writer_destroy(w);
}

static void take_message(struct sample_findings *found, const struct mcap_item *item)
{
	CHECK_EQ(item->sequence, found->messages);
	CHECK_EQ(item->id, found->messages % 2);
	CHECK_EQ(item->log_time_ns, 1000 + found->messages);
	CHECK_EQ(item->publish_time_ns, 1000 + found->messages);
	CHECK_EQ(item->data_len, 12);
	CHECK_EQ(get_le64(item->data + 4), found->messages);
	found->messages++;
}

struct sample_findings sample_file_read(struct memory_file *f, size_t len)
{
	const struct mcap_source source = memory_source(f, len);
	struct sample_findings found = { .chunks = 0 };
	struct mcap_reader *r;
	struct mcap_item item;

	found.result = mcap_reader_create(&source, &r);
	if (found.result < 0) {
		return found;
	}
	while ((found.result = mcap_reader_next(r, &item)) > 0) {
		switch (item.kind) {
		case MCAP_ITEM_CHUNK:
			found.chunks++;
			break;
		case MCAP_ITEM_MESSAGE:
			take_message(&found, &item);
			break;
		case MCAP_ITEM_DAMAGE:
			CHECK(item.reason != NULL);
			found.damage++;
			break;
		case MCAP_ITEM_METADATA:
			found.metadata++;
			break;
		case MCAP_ITEM_ATTACHMENT:
			CHECK(mcap_text_is(item.name, "note.txt"));
			CHECK_MEM(item.data, "hello", 5);
			found.attachments++;
			break;
		case MCAP_ITEM_DATA_END:
			found.has_data_end = 1;
			break;
		case MCAP_ITEM_HEADER:
		case MCAP_ITEM_SCHEMA:
		case MCAP_ITEM_CHANNEL:
		case MCAP_ITEM_MESSAGE_INDEX:
		case MCAP_ITEM_STATISTICS:
		case MCAP_ITEM_OTHER:
			break;
		}
	}
	mcap_reader_destroy(r);
	return found;
}

int sample_file_recover(struct memory_file *f, struct memory_file *ret_copy)
{
	const struct mcap_io io = memory_io(ret_copy);
	const struct mcap_source source = memory_source(f, f->len);
	struct mcap_source copied;
	struct mcap_writer *w;
	struct mcap_scan *scan;
	int r = mcap_scan_create(&source, NULL, &scan);

	if (r < 0) {
		return r;
	}
	CHECK_EQ(mcap_writer_create(&io, 0, &w), 0);
	CHECK_EQ(mcap_copy_whole(&source, scan, w), 0);
	mcap_scan_destroy(scan);
	CHECK_EQ(mcap_writer_finish(w), 0);
	mcap_writer_destroy(w);
	copied = memory_source(ret_copy, ret_copy->len);
	CHECK_EQ(mcap_scan_create(&copied, NULL, &scan), 0);
	CHECK(mcap_scan_is_whole(scan));
	mcap_scan_destroy(scan);
	return 0;
}
