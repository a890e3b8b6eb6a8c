/* SPDX-License-Identifier: MIT */
/* What is damaged outside of chunks: head, schemas, channels, metadata, summary. */
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "harness/test.h"
#include "record/mcap_reader.h"
#include "record/mcap_recover.h"
#include "unit/services/record/sample_file.h"

enum { MESSAGES = SAMPLE_CHUNKS * SAMPLE_CHUNK_MESSAGES };

static const char SCHEMA[] = "uint64 number\n";

/* The record with @opcode, the @nth from 0 on, at the top level; 0 if there is none. */
static size_t find(const struct memory_file *f, enum mcap_opcode opcode, unsigned nth)
{
	size_t at = MCAP_MAGIC_BYTES;

	while (at + MCAP_HEAD_BYTES < f->len) {
		if (f->data[at] == opcode && nth-- == 0) {
			return at;
		}
		at += MCAP_HEAD_BYTES + (size_t)get_le64(f->data + at + 1);
	}
	return 0;
}

/* All copies of @from in @f become @to, of the same length; or the first only. */
static void replace(struct memory_file *f, const char *from, const char *to, unsigned most)
{
	size_t len = strlen(from);

	for (size_t at = 0; at + len <= f->len && most > 0; at++) {
		if (memcmp(f->data + at, from, len) == 0) {
			memcpy(f->data + at, to, len);
			most--;
		}
	}
}

static void check_definition(const struct mcap_item *item)
{
	char value[16];

	if (item->kind == MCAP_ITEM_SCHEMA) {
		CHECK_EQ(item->data_len, strlen(SCHEMA));
		CHECK_MEM(item->data, SCHEMA, strlen(SCHEMA));
	} else if (item->kind == MCAP_ITEM_CHANNEL) {
		CHECK(item->id < 2 && item->schema_id == 1);
		CHECK(mcap_text_is(item->name, item->id == 0 ? "/even" : "/odd"));
		if (item->id == 1) {
			CHECK_EQ(mcap_pairs_get(item, "answer", value, sizeof(value)), 0);
			CHECK_STR(value, "42");
		}
	}
}

/* @f, recovered: whole, and right in every definition and message. Messages in it, or -errno. */
static int recover(struct memory_file *f)
{
	struct memory_file copy = { .data = NULL };
	struct mcap_source copied;
	struct mcap_reader *reader;
	struct mcap_item item;
	int messages = 0;
	int r = sample_file_recover(f, &copy);

	if (r < 0) {
		return r;
	}
	copied = memory_source(&copy, copy.len);
	CHECK_EQ(mcap_reader_create(&copied, &reader), 0);
	while (mcap_reader_next(reader, &item) > 0) {
		check_definition(&item);
		if (item.kind == MCAP_ITEM_MESSAGE) {
			CHECK_EQ(item.id, item.sequence % 2);
			CHECK_EQ(item.log_time_ns, 1000 + item.sequence);
			CHECK_EQ(get_le64(item.data + 4), item.sequence);
			messages++;
		}
	}
	mcap_reader_destroy(reader);
	memory_done(&copy);
	return messages;
}

/* What is wrong with @f; NULL if it is whole. */
static const char *damage_of(struct memory_file *f)
{
	const struct mcap_source source = memory_source(f, f->len);
	struct mcap_scan *scan;
	const char *reason = "not readable";

	if (mcap_scan_create(&source, NULL, &scan) == 0) {
		reason = mcap_scan_is_whole(scan) ? NULL
			 : mcap_scan_findings(scan)->reason != NULL
				 ? mcap_scan_findings(scan)->reason
				 : "end";
		mcap_scan_destroy(scan);
	}
	return reason;
}

TEST(mcap_damage, no_changed_byte_of_the_file_is_clean)
{
	struct memory_file f = { .data = NULL };

	sample_file_make(&f, 1);
	CHECK(damage_of(&f) == NULL);
	for (size_t at = 0; at < f.len; at++) {
		for (unsigned bit = 1; bit <= 0x100; bit <<= 4) {
			uint8_t mask = bit < 0x100 ? (uint8_t)bit : 0xff;

			f.data[at] ^= mask;
			CHECK(damage_of(&f) != NULL);
			f.data[at] ^= mask;
		}
	}
	memory_done(&f);
}

TEST(mcap_damage, with_any_changed_byte_what_is_recovered_is_right)
{
	struct memory_file f = { .data = NULL };
	unsigned all = 0;

	sample_file_make(&f, 0);
	for (size_t at = 0; at < f.len; at++) {
		int messages;

		f.data[at] ^= 0x11;
		messages = recover(&f);
		CHECK(messages >= MESSAGES - SAMPLE_CHUNK_MESSAGES);
		all += messages == MESSAGES;
		f.data[at] ^= 0x11;
	}
	CHECK(all > f.len / 2);
	memory_done(&f);
}

TEST(mcap_damage, a_changed_value_in_the_head_is_found_and_the_summary_has_the_right_one)
{
	struct memory_file f = { .data = NULL };

	sample_file_make(&f, 1); /* the first of its copies is in the head */
	f.data[find(&f, MCAP_OP_CHANNEL, 1) + MCAP_HEAD_BYTES + 4 + 8 + 7 + 4 + 4 + 6 + 4 + 1]++;
	CHECK_STR(damage_of(&f), "schema or channel differs from its copy");
	CHECK_EQ(recover(&f), MESSAGES);
	memory_done(&f);
}

TEST(mcap_damage, metadata_without_a_second_copy_is_covered_by_the_crc_of_the_section)
{
	struct memory_file f = { .data = NULL };

	sample_file_make(&f, 1);
	f.data[find(&f, MCAP_OP_METADATA, 0) + MCAP_HEAD_BYTES + 4]++; /* its name */
	CHECK_STR(damage_of(&f), "wrong CRC of the data section: head or metadata are damaged");
	memory_done(&f);
}

TEST(mcap_damage, a_file_without_that_crc_is_whole_and_its_definitions_are_compared)
{
	struct memory_file f = { .data = NULL };
	size_t end;

	sample_file_make(&f, 1);
	end = find(&f, MCAP_OP_DATA_END, 0);
	put_le32(f.data + end + MCAP_HEAD_BYTES, 0); /* as recordings had it before */
	CHECK(damage_of(&f) == NULL);
	replace(&f, "uint64 number", "uint64 wonder", 1);
	CHECK_STR(damage_of(&f), "schema or channel differs from its copy");
	CHECK_EQ(recover(&f), MESSAGES);
	memory_done(&f);
}

TEST(mcap_damage, a_destroyed_head_costs_no_message)
{
	struct memory_file f = { .data = NULL };
	size_t first_chunk;

	sample_file_make(&f, 1);
	first_chunk = find(&f, MCAP_OP_CHUNK, 0);
	memset(f.data, 0, first_chunk);
	CHECK_STR(damage_of(&f), "does not start as an MCAP file");
	CHECK_EQ(recover(&f), MESSAGES);
	memory_done(&f);
	/* And without a summary, by the copy in the first chunk. */
	sample_file_make(&f, 1);
	f.len = find(&f, MCAP_OP_DATA_END, 0);
	memset(f.data, 0xff, first_chunk);
	CHECK_EQ(recover(&f), MESSAGES);
	memory_done(&f);
}

TEST(mcap_damage, a_destroyed_record_in_the_middle_costs_that_record)
{
	struct memory_file f = { .data = NULL };
	size_t chunk;

	sample_file_make(&f, 1);
	chunk = find(&f, MCAP_OP_CHUNK, 2);
	memset(f.data + chunk, 0, MCAP_HEAD_BYTES); /* where its end is is lost, too */
	CHECK_STR(damage_of(&f), "no record where one should start");
	CHECK_EQ(recover(&f), MESSAGES - SAMPLE_CHUNK_MESSAGES);
	memory_done(&f);
}

TEST(mcap_damage, a_record_that_swallows_the_next_ones_does_not_lose_them)
{
	struct memory_file f = { .data = NULL };
	size_t chunk;

	sample_file_make(&f, 1);
	chunk = find(&f, MCAP_OP_CHUNK, 1);
	put_le64(f.data + chunk + 1, f.len - chunk - 200);
	CHECK(damage_of(&f) != NULL);
	CHECK_EQ(recover(&f), MESSAGES - SAMPLE_CHUNK_MESSAGES);
	memory_done(&f);
}

TEST(mcap_damage, messages_of_a_channel_that_nobody_defines_are_left_out)
{
	struct memory_file f = { .data = NULL };
	size_t channel;

	sample_file_make(&f, 0);
	f.len = find(&f, MCAP_OP_DATA_END, 0);
	channel = find(&f, MCAP_OP_CHANNEL, 1);
	memset(f.data + channel + MCAP_HEAD_BYTES + 4, 0xff, 8); /* in the head */
	/* In the first chunk: its CRC is wrong then, it is lost as a whole. */
	f.data[find(&f, MCAP_OP_CHUNK, 0) + 100] ^= 1;
	CHECK_EQ(recover(&f), (MESSAGES - SAMPLE_CHUNK_MESSAGES) / 2);
	memory_done(&f);
}

TEST(mcap_damage, text_that_is_not_utf8_is_malformed_and_never_written)
{
	struct memory_file f = { .data = NULL };
	struct mcap_writer *w = sample_file_begin(&f, 1);
	const struct mcap_pair pair = { "name", "M\xfcller" };
	struct mcap_source source;
	struct mcap_reader *reader;
	struct mcap_item item;
	char value[16] = "";

	CHECK_EQ(mcap_writer_metadata(w, "vendor", &pair, 1), 0);
	CHECK_EQ(sample_file_message(w, 0), 0);
	CHECK_EQ(mcap_writer_finish(w), 0);
	mcap_writer_destroy(w);
	CHECK(damage_of(&f) == NULL);
	source = memory_source(&f, f.len);
	CHECK_EQ(mcap_reader_create(&source, &reader), 0);
	while (mcap_reader_next(reader, &item) > 0) {
		if (item.kind == MCAP_ITEM_METADATA && mcap_text_is(item.name, "vendor")) {
			CHECK_EQ(mcap_pairs_get(&item, "name", value, sizeof(value)), 0);
		}
	}
	mcap_reader_destroy(reader);
	CHECK_STR(value, "M\xef\xbf\xbdller");
	f.data[find(&f, MCAP_OP_METADATA, 1) + MCAP_HEAD_BYTES + 4] = 0xfc;
	CHECK_STR(damage_of(&f), "record is malformed");
	memory_done(&f);
}

TEST(mcap_damage, definitions_are_repeated_in_chunks_for_less_than_2_percent)
{
	static uint8_t data[2000];
	struct memory_file f = { .data = NULL };
	struct mcap_writer *w = sample_file_begin(&f, 0);
	struct mcap_source source;
	struct mcap_reader *reader;
	struct mcap_item item;
	size_t repeated = 0;
	unsigned schemas = 0;

	for (unsigned n = 0; n < 400; n++) {
		const struct mcap_message m = { .data = data, .data_len = sizeof(data) };

		CHECK_EQ(mcap_writer_message(w, &m), 0);
		CHECK_EQ(mcap_writer_close_chunk(w), 0);
	}
	CHECK_EQ(mcap_writer_finish(w), 0);
	mcap_writer_destroy(w);
	CHECK(damage_of(&f) == NULL);
	source = memory_source(&f, f.len);
	CHECK_EQ(mcap_reader_create(&source, &reader), 0);
	while (mcap_reader_next(reader, &item) > 0) {
		check_definition(&item);
		if (item.is_inner && item.kind != MCAP_ITEM_MESSAGE) {
			repeated += item.record_len;
			schemas += item.kind == MCAP_ITEM_SCHEMA;
		}
	}
	mcap_reader_destroy(reader);
	CHECK(schemas > 20);
	CHECK(repeated * 50 < f.len);
	memory_done(&f);
}

TEST(mcap_damage, a_file_full_of_what_looks_like_records_ends)
{
	/* Malformed records in a row, each with the start of a sound one in it: the search goes
	 * back to each of them, but not for ever. */
	static uint8_t bytes[1 << 20];
	struct memory_file f = { .data = NULL };
	struct mcap_io io = memory_io(&f);
	struct mcap_source source;
	struct mcap_reader *reader;
	struct mcap_item item;
	unsigned items = 0;

	memcpy(bytes, MCAP_MAGIC, MCAP_MAGIC_BYTES);
	for (size_t at = MCAP_MAGIC_BYTES; at + 64 < sizeof(bytes); at += 9 + 18) {
		bytes[at] = MCAP_OP_HEADER;
		put_le64(bytes + at + 1, 18);
		bytes[at + 9] = MCAP_OP_METADATA;
		put_le64(bytes + at + 10, 9);
		put_le32(bytes + at + 18, 1);
		bytes[at + 22] = 'x';
	}
	io.write(io.ctx, bytes, sizeof(bytes));
	source = memory_source(&f, f.len);
	CHECK_EQ(mcap_reader_create(&source, &reader), 0);
	while (mcap_reader_next(reader, &item) > 0) {
		items++;
	}
	mcap_reader_destroy(reader);
	CHECK(items < 102 * (sizeof(bytes) / 27));
	memory_done(&f);
}
