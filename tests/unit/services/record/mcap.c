/* SPDX-License-Identifier: MIT */
#include <errno.h>
#include <string.h>

#include "base/bytes.h"
#include "harness/test.h"
#include "record/mcap_chunk.h"
#include "record/mcap_index.h"
#include "record/mcap_reader.h"
#include "record/mcap_recover.h"
#include "unit/services/record/sample_file.h"

enum { MESSAGES = SAMPLE_CHUNKS * SAMPLE_CHUNK_MESSAGES };

static void round_trip(int zstd_level)
{
	struct memory_file f = { .data = NULL };
	struct sample_findings found;
	struct mcap_source source;
	enum mcap_ending ending;

	sample_file_make(&f, zstd_level);
	found = sample_file_read(&f, f.len);
	CHECK_EQ(found.result, 0);
	CHECK_EQ(found.messages, MESSAGES);
	CHECK_EQ(found.chunks, SAMPLE_CHUNKS);
	CHECK_EQ(found.metadata, 1);
	CHECK_EQ(found.attachments, 1);
	CHECK_EQ(found.damage, 0);
	CHECK(found.has_data_end);
	source = memory_source(&f, f.len);
	CHECK_EQ(mcap_ending_check(&source, &ending), 0);
	CHECK_EQ(ending, MCAP_ENDING_GOOD);
	CHECK_EQ(f.synced_len, f.len);
	memory_done(&f);
}

TEST(mcap, what_is_written_is_read_back_uncompressed)
{
	round_trip(0);
}

TEST(mcap, what_is_written_is_read_back_from_zstd)
{
	round_trip(1);
}

TEST(mcap, statistics_and_indexes_in_the_summary_are_right)
{
	struct memory_file f = { .data = NULL };
	struct mcap_reader *r;
	struct mcap_source source;
	struct mcap_item item;
	unsigned chunk_indexes = 0;
	unsigned statistics = 0;

	sample_file_make(&f, 0);
	source = memory_source(&f, f.len);
	CHECK_EQ(mcap_reader_create_summary(&source, &r), 0);
	while (mcap_reader_next(r, &item) > 0) {
		CHECK(item.kind != MCAP_ITEM_DAMAGE);
		if (item.kind == MCAP_ITEM_STATISTICS) {
			statistics++;
			CHECK_EQ(mcap_statistics_count(&item, 0), MESSAGES / 2);
			CHECK_EQ(mcap_statistics_count(&item, 1), MESSAGES / 2);
			CHECK_EQ(mcap_statistics_count(&item, 2), 0);
			CHECK_EQ(item.log_time_ns, 1000);
			CHECK_EQ(item.publish_time_ns, 1000 + MESSAGES - 1);
		}
		if (item.record[0] == MCAP_OP_CHUNK_INDEX) {
			uint64_t offset = get_le64(item.record + MCAP_HEAD_BYTES + 16);
			uint64_t first_index = get_le64(item.record + MCAP_HEAD_BYTES + 38);

			chunk_indexes++;
			CHECK_EQ(f.data[offset], MCAP_OP_CHUNK);
			CHECK_EQ(f.data[first_index], MCAP_OP_MESSAGE_INDEX);
		}
	}
	CHECK_EQ(chunk_indexes, SAMPLE_CHUNKS);
	CHECK_EQ(statistics, 1);
	mcap_reader_destroy(r);
	memory_done(&f);
}

/* Whole chunks in the first @len bytes of @f. */
static unsigned chunks_within(const struct memory_file *f, size_t len, size_t *ret_first_record_end)
{
	size_t at = MCAP_MAGIC_BYTES;
	unsigned chunks = 0;

	*ret_first_record_end = 0;
	while (at + MCAP_HEAD_BYTES <= len) {
		size_t end = at + MCAP_HEAD_BYTES + (size_t)get_le64(f->data + at + 1);

		if (end > len) {
			break;
		}
		*ret_first_record_end = *ret_first_record_end == 0 ? end : *ret_first_record_end;
		chunks += f->data[at] == MCAP_OP_CHUNK;
		if (f->data[at] == MCAP_OP_DATA_END) {
			break;
		}
		at = end;
	}
	return chunks;
}

static void recover_cut(const struct memory_file *whole, size_t len, unsigned chunks)
{
	struct memory_file f = { .data = NULL };
	struct mcap_io io = memory_io(&f);
	struct mcap_source source;
	struct mcap_scan *scan;
	struct mcap_writer *w;
	struct sample_findings found;
	enum mcap_ending ending;

	io.write(io.ctx, whole->data, len);
	source = memory_source(&f, f.len);
	CHECK_EQ(mcap_scan_create(&source, NULL, &scan), 0);
	CHECK_EQ(mcap_scan_is_whole(scan), len == whole->len);
	CHECK_EQ(mcap_scan_findings(scan)->chunks, chunks);
	CHECK_EQ(mcap_scan_findings(scan)->messages, chunks * SAMPLE_CHUNK_MESSAGES);
	if (len < whole->len) {
		CHECK(!mcap_scan_findings(scan)->needs_copy);
		CHECK_EQ(mcap_scan_resume(scan, &io, &w), 0);
		CHECK_EQ(mcap_writer_finish(w), 0);
		mcap_writer_destroy(w);
	}
	mcap_scan_destroy(scan);
	found = sample_file_read(&f, f.len);
	CHECK_EQ(found.result, 0);
	CHECK_EQ(found.messages, chunks * SAMPLE_CHUNK_MESSAGES);
	CHECK_EQ(found.damage, 0);
	CHECK(found.has_data_end);
	source = memory_source(&f, f.len);
	CHECK_EQ(mcap_ending_check(&source, &ending), 0);
	CHECK_EQ(ending, MCAP_ENDING_GOOD);
	/* And the repaired file has nothing left to repair. */
	CHECK_EQ(mcap_scan_create(&source, NULL, &scan), 0);
	CHECK(mcap_scan_is_whole(scan));
	CHECK(!mcap_scan_findings(scan)->needs_copy);
	mcap_scan_destroy(scan);
	memory_done(&f);
}

static void cut_everywhere(int zstd_level)
{
	struct memory_file f = { .data = NULL };

	sample_file_make(&f, zstd_level);
	for (size_t len = 0; len <= f.len; len++) {
		struct mcap_source source = memory_source(&f, len);
		struct mcap_scan *scan;
		size_t first_record_end;
		unsigned chunks = chunks_within(&f, len, &first_record_end);
		struct sample_findings found = sample_file_read(&f, len);

		CHECK_EQ(found.chunks, chunks);
		CHECK_EQ(found.messages, chunks * SAMPLE_CHUNK_MESSAGES);
		if (first_record_end == 0) {
			CHECK_EQ(mcap_scan_create(&source, NULL, &scan), -ENODATA);
		} else {
			recover_cut(&f, len, chunks);
		}
	}
	memory_done(&f);
}

TEST(mcap, cut_at_every_byte_each_chunk_before_the_cut_is_read_and_the_file_is_repaired)
{
	cut_everywhere(0);
}

TEST(mcap, cut_at_every_byte_a_compressed_file_is_repaired_too)
{
	cut_everywhere(3);
}

/* @f with everything whole in it copied. */
static struct sample_findings copy_and_read(struct memory_file *f)
{
	struct memory_file copy = { .data = NULL };
	struct mcap_source copied;
	struct mcap_item item;
	struct mcap_reader *r;
	struct sample_findings found = { .chunks = 0 };

	CHECK_EQ(sample_file_recover(f, &copy), 0);
	copied = memory_source(&copy, copy.len);
	CHECK_EQ(mcap_reader_create(&copied, &r), 0);
	while (mcap_reader_next(r, &item) > 0) {
		found.chunks += item.kind == MCAP_ITEM_CHUNK;
		found.messages += item.kind == MCAP_ITEM_MESSAGE;
	}
	mcap_reader_destroy(r);
	memory_done(&copy);
	return found;
}

TEST(mcap, one_flipped_bit_in_a_chunk_costs_that_chunk_and_no_other)
{
	struct memory_file f = { .data = NULL };
	struct mcap_source source;
	struct mcap_scan *scan;
	struct mcap_io io = memory_io(&f);
	struct mcap_writer *w;
	struct sample_findings found;
	size_t at = MCAP_MAGIC_BYTES;

	sample_file_make(&f, 0);
	for (unsigned chunks = 0; chunks < 2;) {
		chunks += f.data[at] == MCAP_OP_CHUNK;
		if (chunks < 2) {
			at += MCAP_HEAD_BYTES + (size_t)get_le64(f.data + at + 1);
		}
	}
	f.data[at + 100] ^= 0x10;
	source = memory_source(&f, f.len);
	CHECK_EQ(mcap_scan_create(&source, NULL, &scan), 0);
	CHECK(!mcap_scan_is_whole(scan));
	CHECK_EQ(mcap_scan_findings(scan)->damaged, 1);
	CHECK_EQ(mcap_scan_findings(scan)->reason_offset, at);
	CHECK_STR(mcap_scan_findings(scan)->reason, "chunk has a wrong CRC");
	CHECK(mcap_scan_findings(scan)->needs_copy);
	CHECK_EQ(mcap_scan_resume(scan, &io, &w), -EXDEV);
	mcap_scan_destroy(scan);
	found = copy_and_read(&f);
	CHECK_EQ(found.chunks, SAMPLE_CHUNKS - 1);
	CHECK_EQ(found.messages, MESSAGES - SAMPLE_CHUNK_MESSAGES);
	memory_done(&f);
}

TEST(mcap, a_tail_of_zeros_is_cut_off)
{
	struct memory_file f = { .data = NULL };
	struct mcap_io io = memory_io(&f);
	struct mcap_writer *w = sample_file_begin(&f, 1);
	uint8_t zeros[4096] = { 0 };
	struct mcap_source source;
	struct mcap_scan *scan;

	CHECK_EQ(sample_file_message(w, 0), 0);
	CHECK_EQ(mcap_writer_close_chunk(w), 0);
	mcap_writer_destroy(w);
	io.write(io.ctx, zeros, sizeof(zeros));
	source = memory_source(&f, f.len);
	CHECK_EQ(mcap_scan_create(&source, NULL, &scan), 0);
	CHECK_EQ(mcap_scan_findings(scan)->messages, 1);
	CHECK_EQ(mcap_scan_findings(scan)->lost_bytes, sizeof(zeros));
	CHECK_EQ(mcap_scan_resume(scan, &io, &w), 0);
	CHECK_EQ(mcap_writer_finish(w), 0);
	mcap_writer_destroy(w);
	mcap_scan_destroy(scan);
	CHECK_EQ(sample_file_read(&f, f.len).messages, 1);
	memory_done(&f);
}

TEST(mcap, a_flipped_byte_anywhere_is_survived_and_never_read_as_a_wrong_message)
{
	struct memory_file f = { .data = NULL };

	sample_file_make(&f, 1);
	for (size_t at = 0; at < f.len; at++) {
		struct mcap_source source = memory_source(&f, f.len);
		struct mcap_reader *r;
		struct mcap_item item;

		f.data[at] ^= 0xff;
		if (mcap_reader_create(&source, &r) == 0) {
			while (mcap_reader_next(r, &item) > 0) {
				if (item.kind == MCAP_ITEM_MESSAGE) {
					CHECK_EQ(item.log_time_ns, 1000 + item.sequence);
					CHECK_EQ(get_le64(item.data + 4), item.sequence);
				}
			}
			mcap_reader_destroy(r);
		}
		f.data[at] ^= 0xff;
	}
	memory_done(&f);
}

TEST(mcap, what_is_not_mcap_is_refused)
{
	struct memory_file f = { .data = NULL };
	struct mcap_io io = memory_io(&f);
	struct mcap_source source;
	struct mcap_reader *r = NULL;

	source = memory_source(&f, 0);
	CHECK_EQ(mcap_reader_create(&source, &r), -ENODATA);
	io.write(io.ctx, "\x89MC", 3);
	source = memory_source(&f, f.len);
	CHECK_EQ(mcap_reader_create(&source, &r), -ENODATA);
	io.write(io.ctx, "hello, world", 12);
	source = memory_source(&f, f.len);
	CHECK_EQ(mcap_reader_create(&source, &r), -EPROTO);
	CHECK(r == NULL);
	memory_done(&f);
}

TEST(mcap, a_chunk_that_is_full_says_so_before_it_is_too_large)
{
	static uint8_t data[1 << 20];
	struct memory_file f = { .data = NULL };
	struct mcap_writer *w = sample_file_begin(&f, 0);
	const struct mcap_message m = { .data = data, .data_len = sizeof(data) };
	unsigned taken = 0;

	while (mcap_writer_message(w, &m) == 0) {
		taken++;
	}
	CHECK_EQ(taken, MCAP_LIMIT_CHUNK_BYTES / sizeof(data) - 1);
	CHECK_EQ(mcap_writer_message(w, &m), -ENOBUFS);
	CHECK(mcap_writer_room(w) < sizeof(data) + MCAP_MESSAGE_COST_BYTES);
	CHECK_EQ(mcap_writer_close_chunk(w), 0);
	CHECK_EQ(mcap_writer_message(w, &m), 0);
	mcap_writer_destroy(w);
	memory_done(&f);
}

/* A chunk's content: a schema record with id 1 and three texts, the first of @name_len bytes. */
static size_t put_schema(uint8_t *chunk, uint32_t name_len)
{
	uint8_t *at = chunk + MCAP_HEAD_BYTES;

	put_le16(at, 1);
	put_le32(at + 2, name_len);
	memcpy(at + 6, "pkg/M", 5);
	put_le32(at + 11, 0);
	put_le32(at + 15, 0);
	chunk[0] = MCAP_OP_SCHEMA;
	put_le64(chunk + 1, 19);
	return MCAP_HEAD_BYTES + 19;
}

TEST(mcap, a_schema_inside_a_chunk_is_checked_by_its_own_bytes)
{
	struct mcap_chunk_index *ix = mcap_chunk_index_create();
	uint8_t chunk[64] = { 0 };
	size_t len = put_schema(chunk, 5);

	CHECK(ix != NULL);
	CHECK_EQ(mcap_chunk_index_build(ix, chunk, len), 0);
	CHECK_EQ(mcap_chunk_index_messages(ix), 0);
	put_schema(chunk, 500); /* the name is longer than the record */
	CHECK_EQ(mcap_chunk_index_build(ix, chunk, len), -EBADMSG);
	mcap_chunk_index_destroy(ix);
}

TEST(mcap, metadata_whose_name_exceeds_the_record_is_malformed)
{
	uint8_t record[MCAP_HEAD_BYTES + 16] = { MCAP_OP_METADATA, 16 };
	struct mcap_index ix;

	CHECK_EQ(mcap_index_init(&ix), 0);
	put_le32(record + MCAP_HEAD_BYTES, 4);
	CHECK_EQ(mcap_index_metadata(&ix, 100, record, sizeof(record)), 0);
	CHECK_EQ(ix.metadata_count, 1);
	put_le32(record + MCAP_HEAD_BYTES, 13);
	CHECK_EQ(mcap_index_metadata(&ix, 200, record, sizeof(record)), -EBADMSG);
	CHECK_EQ(mcap_index_metadata(&ix, 200, record, MCAP_HEAD_BYTES + 3), -EBADMSG);
	CHECK_EQ(ix.metadata_count, 1);
	mcap_index_done(&ix);
}

TEST(mcap, a_message_has_the_offset_of_its_chunk)
{
	struct memory_file f = { .len = 0 };
	uint64_t chunk_offset = 0;
	struct mcap_source source;
	struct mcap_reader *r;
	struct mcap_item item;
	unsigned messages = 0;

	sample_file_make(&f, 1);
	source = memory_source(&f, f.len);
	CHECK_EQ(mcap_reader_create(&source, &r), 0);
	while (mcap_reader_next(r, &item) > 0) {
		if (item.kind == MCAP_ITEM_CHUNK) {
			CHECK(item.offset > chunk_offset);
			chunk_offset = item.offset;
			CHECK_EQ(f.data[chunk_offset], MCAP_OP_CHUNK);
		} else if (item.kind == MCAP_ITEM_MESSAGE) {
			CHECK_EQ(item.offset, chunk_offset);
			messages++;
		}
	}
	CHECK_EQ(messages, SAMPLE_CHUNKS * SAMPLE_CHUNK_MESSAGES);
	mcap_reader_destroy(r);
	memory_done(&f);
}

TEST(mcap, an_ending_that_is_missing_is_no_error)
{
	struct memory_file f = { .len = 0 };
	enum mcap_ending ending = MCAP_ENDING_BAD;
	struct mcap_source source;

	sample_file_make(&f, 1);
	source = memory_source(&f, f.len);
	CHECK_EQ(mcap_ending_check(&source, &ending), 0);
	CHECK_EQ(ending, MCAP_ENDING_GOOD);
	source = memory_source(&f, f.len - 1);
	CHECK_EQ(mcap_ending_check(&source, &ending), 0);
	CHECK_EQ(ending, MCAP_ENDING_MISSING);
	source = memory_source(&f, MCAP_MAGIC_BYTES);
	ending = MCAP_ENDING_BAD;
	CHECK_EQ(mcap_ending_check(&source, &ending), 0);
	CHECK_EQ(ending, MCAP_ENDING_MISSING);
	memory_done(&f);
}
