/* SPDX-License-Identifier: MIT */
#include "record/mcap_reader.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include <libdeflate.h>
#include <zstd.h>

#include "base/bytes.h"
#include "record/mcap_buf.h"
#include "record/mcap_chunk.h"
#include "record/mcap_parse.h"

struct mcap_reader {
	struct mcap_source source;
	uint64_t offset; /* of the next top-level record */
	int has_ended;
	int is_summary;          /* reading the summary, not the data section */
	struct mcap_buf record;  /* the newest top-level record, whole */
	struct mcap_buf content; /* of the newest chunk, uncompressed, if it was compressed */
	ZSTD_DCtx *zstd;
	const uint8_t *inner; /* content of the chunk being handed out; NULL: none */
	size_t inner_len;
	size_t inner_offset;
	uint64_t chunk_offset;
	uint64_t sound_end;  /* end of the newest top-level record whose length is believed */
	unsigned searches;   /* for a record where none was */
	uint32_t data_crc;   /* of all bytes before the end of the newest top-level record */
	int has_damage;      /* handed out */
	int has_bad_magic;   /* to be handed out as damage */
	int has_pending_end; /* the data end in record, after its CRC was handed out as damage */
};

enum {
	SEARCH_BLOCK_BYTES = 65536,
	SEARCH_NAME_BYTES = 256,
	SEARCHES_BACK = 100 /* to before the place of the damage: bounds the work on any file */
};
/* From the start of a record to the last of the lengths that has_sound_lengths() looks at. */
enum { SEARCH_HEAD_BYTES = MCAP_HEAD_BYTES + 16 + 2 * (4 + SEARCH_NAME_BYTES) + 8 };

/* A text of at most SEARCH_NAME_BYTES at *@at: moved behind it. 0 if there is none. */
static int skip_name(const uint8_t *record, size_t have, size_t *at)
{
	uint32_t len = have - *at >= 4 ? get_le32(record + *at) : UINT32_MAX;

	if (len > SEARCH_NAME_BYTES || len + 4 > have - *at) {
		return 0;
	}
	*at += 4 + len;
	return 1;
}

/* Do the lengths inside of what may be a record agree with that of the record? By accident they do
 * in one of 2^32 places at most. @have bytes of it are there, at least a head. */
static int has_sound_lengths(const uint8_t *record, size_t have)
{
	uint64_t content_len = get_le64(record + 1);
	size_t at = MCAP_HEAD_BYTES;
	int is_sound = 1;

	switch (record[0]) {
	case MCAP_OP_CHUNK:
		at += 28; /* times, size, CRC */
		is_sound = have >= at && skip_name(record, have, &at) && have - at >= 8 &&
			   get_le64(record + at) > 0;
		return is_sound &&
		       get_le64(record + at) == content_len - (at + 8 - MCAP_HEAD_BYTES);
	case MCAP_OP_METADATA:
		is_sound =
			skip_name(record, have, &at) && have - at >= 4 && at > MCAP_HEAD_BYTES + 4;
		return is_sound &&
		       get_le32(record + at) == content_len - (at + 4 - MCAP_HEAD_BYTES);
	case MCAP_OP_ATTACHMENT:
		at += 16; /* times */
		is_sound = have >= at && skip_name(record, have, &at) &&
			   skip_name(record, have, &at) && have - at >= 8;
		return is_sound &&
		       get_le64(record + at) == content_len - (at + 8 + 4 - MCAP_HEAD_BYTES);
	default:
		return 0;
	}
}

/* The next place from @from on where a record seems to start. 0, -ENOENT, -errno of the I/O. */
static int find_record(const struct mcap_source *source, uint64_t from, uint64_t *ret_offset)
{
	uint8_t block[SEARCH_BLOCK_BYTES];

	while (source->bytes > from && source->bytes - from >= MCAP_HEAD_BYTES) {
		uint64_t left = source->bytes - from;
		size_t n = left < sizeof(block) ? (size_t)left : sizeof(block);
		size_t places = n == left ? n - MCAP_HEAD_BYTES : n - SEARCH_HEAD_BYTES;
		int err = source->read_at(source->ctx, from, block, n);

		if (err < 0) {
			return err;
		}
		for (size_t i = 0; i <= places; i++) {
			uint64_t content_len = get_le64(block + i + 1);

			if (content_len <= MCAP_LIMIT_RECORD_BYTES &&
			    content_len <= left - i - MCAP_HEAD_BYTES &&
			    has_sound_lengths(block + i, n - i)) {
				*ret_offset = from + i;
				return 0;
			}
		}
		from += n == left ? n : places + 1;
	}
	return -ENOENT;
}

/* A file whose first bytes are destroyed is still one. */
static int find_start(const struct mcap_source *source, uint64_t *ret_offset)
{
	struct mcap_source start = *source;
	int err;

	start.bytes = start.bytes < MCAP_LIMIT_RECORD_BYTES ? start.bytes : MCAP_LIMIT_RECORD_BYTES;
	err = find_record(&start, 0, ret_offset);
	return err == -ENOENT ? -EPROTO : err;
}

int mcap_reader_create(const struct mcap_source *source, struct mcap_reader **ret_reader)
{
	uint8_t magic[MCAP_MAGIC_BYTES];
	uint64_t offset = MCAP_MAGIC_BYTES;
	int has_bad_magic;
	size_t have = source->bytes < sizeof(magic) ? (size_t)source->bytes : sizeof(magic);
	struct mcap_reader *r;
	int err = have > 0 ? source->read_at(source->ctx, 0, magic, have) : 0;

	if (err < 0) {
		return err;
	}
	has_bad_magic = memcmp(magic, MCAP_MAGIC, have) != 0;
	err = has_bad_magic ? find_start(source, &offset) : 0;
	if (err < 0) {
		return err;
	}
	if (have < sizeof(magic)) {
		return -ENODATA;
	}
	r = calloc(1, sizeof(*r));
	if (r == NULL) {
		return -ENOMEM;
	}
	r->source = *source;
	r->offset = offset;
	r->sound_end = offset;
	r->has_bad_magic = has_bad_magic;
	r->data_crc = libdeflate_crc32(0, magic, sizeof(magic));
	r->zstd = ZSTD_createDCtx();
	if (r->zstd == NULL) {
		mcap_reader_destroy(r);
		return -ENOMEM;
	}
	*ret_reader = r;
	return 0;
}

int mcap_reader_create_summary(const struct mcap_source *source, struct mcap_reader **ret_reader)
{
	enum mcap_ending ending;
	struct mcap_reader *r;
	uint8_t footer[MCAP_FOOTER_BYTES] = { 0 };
	int err = mcap_ending_check(source, &ending);

	if (err == 0 && ending != MCAP_ENDING_GOOD) {
		err = ending == MCAP_ENDING_BAD ? -EBADMSG : -ENODATA;
	}
	err = err < 0 ? err : mcap_reader_create(source, &r);
	if (err < 0) {
		return err;
	}
	err = source->read_at(source->ctx, source->bytes - MCAP_MAGIC_BYTES - sizeof(footer),
			      footer, sizeof(footer));
	r->offset = get_le64(footer + MCAP_HEAD_BYTES);
	if (err == 0 && (r->offset == 0 || r->offset > source->bytes)) {
		err = -ENODATA;
	}
	if (err < 0) {
		mcap_reader_destroy(r);
		return err;
	}
	r->is_summary = 1;
	r->has_bad_magic = 0;
	*ret_reader = r;
	return 0;
}

void mcap_reader_destroy(struct mcap_reader *r)
{
	if (r == NULL) {
		return;
	}
	ZSTD_freeDCtx(r->zstd);
	mcap_buf_done(&r->record);
	mcap_buf_done(&r->content);
	free(r);
}

enum is_final { GOES_ON, FINAL };

static int damage(struct mcap_reader *r, uint64_t offset, const char *reason,
		  enum is_final is_final, struct mcap_item *ret_item)
{
	*ret_item = (struct mcap_item){ .kind = MCAP_ITEM_DAMAGE,
					.offset = offset,
					.reason = reason,
					.is_final = is_final == FINAL };
	r->has_damage = 1;
	if (is_final == FINAL) {
		r->has_ended = 1;
	}
	return 1;
}

/* The chunk's content, uncompressed, into r->inner. NULL, or what is wrong with it. */
static const char *open_chunk(struct mcap_reader *r, const struct mcap_chunk_fields *c)
{
	size_t len;

	if (c->uncompressed_len > MCAP_LIMIT_RECORD_BYTES) {
		return "chunk is larger than this reader takes";
	}
	if (c->compression.len == 0) {
		if (c->data_len != c->uncompressed_len) {
			return "chunk sizes do not agree";
		}
		r->inner = c->data;
	} else if (mcap_text_is(c->compression, "zstd")) {
		mcap_buf_clear(&r->content);
		if (mcap_buf_grow(&r->content, (size_t)c->uncompressed_len + 1) == NULL) {
			return "not enough memory for the chunk";
		}
		len = ZSTD_decompressDCtx(r->zstd, r->content.data, (size_t)c->uncompressed_len,
					  c->data, c->data_len);
		if (ZSTD_isError(len) || len != c->uncompressed_len) {
			return "chunk does not decompress";
		}
		r->inner = r->content.data;
	} else {
		return "chunk has a compression that this reader does not know";
	}
	r->inner_len = (size_t)c->uncompressed_len;
	/* A CRC of 0 means: none. */
	if (c->crc != 0 && c->crc != libdeflate_crc32(0, r->inner, r->inner_len)) {
		return "chunk has a wrong CRC";
	}
	return NULL;
}

static int take_chunk(struct mcap_reader *r, struct mcap_item *ret_item)
{
	struct mcap_chunk_fields c;
	uint64_t offset = ret_item->offset;
	const char *reason = "chunk is malformed";

	r->inner = NULL;
	if (mcap_parse_chunk(ret_item->record + MCAP_HEAD_BYTES,
			     ret_item->record_len - MCAP_HEAD_BYTES, &c) == 0) {
		reason = open_chunk(r, &c);
	}
	if (reason != NULL) {
		r->inner = NULL;
		return damage(r, offset, reason, GOES_ON, ret_item);
	}
	r->inner_offset = 0;
	r->chunk_offset = offset;
	ret_item->encoding = c.compression;
	ret_item->data = r->inner;
	ret_item->data_len = r->inner_len;
	return 1;
}

/* The next record of the open chunk; 0 when there is none left. */
static int next_inner(struct mcap_reader *r, struct mcap_item *ret_item)
{
	struct mcap_inner inner;
	int got = mcap_chunk_next(r->inner, r->inner_len, &r->inner_offset, &inner);

	if (got == 0) {
		r->inner = NULL;
		return 0;
	}
	if (got > 0) {
		*ret_item = (struct mcap_item){
			.offset = r->chunk_offset,
			.record = inner.content - MCAP_HEAD_BYTES,
			.record_len = inner.content_len + MCAP_HEAD_BYTES,
			.is_inner = 1,
		};
		got = mcap_parse_record(ret_item);
		if (got == 0 && ret_item->kind != MCAP_ITEM_SCHEMA &&
		    ret_item->kind != MCAP_ITEM_CHANNEL && ret_item->kind != MCAP_ITEM_MESSAGE) {
			ret_item->kind = MCAP_ITEM_OTHER; /* nothing else belongs into a chunk */
		}
	}
	if (got < 0) {
		r->inner = NULL;
		return damage(r, r->chunk_offset, "record in the chunk is malformed", GOES_ON,
			      ret_item);
	}
	return 1;
}

/* What is at r->offset is no record: go on where the next one starts. 2, or -errno. */
static int search_on(struct mcap_reader *r, const char *reason, struct mcap_item *ret_item)
{
	uint64_t offset = r->offset;
	/* The length of the record before may be what is wrong, if that was damaged. */
	uint64_t from = r->searches++ < SEARCHES_BACK ? r->sound_end : offset;
	int err = r->is_summary ? -ENOENT : find_record(&r->source, from + 1, &r->offset);

	if (err < 0 && err != -ENOENT) {
		return err;
	}
	damage(r, offset, reason, err == 0 ? GOES_ON : FINAL, ret_item);
	return 2;
}

/* Load the record at r->offset. 1, 0 at the end of the file, -errno; or damage as an item: 2. */
static int load_record(struct mcap_reader *r, struct mcap_item *ret_item)
{
	uint64_t left = r->source.bytes - r->offset;
	uint8_t head[MCAP_HEAD_BYTES];
	uint64_t content_len;
	uint64_t offset = r->offset;
	int err;

	if (left == 0) {
		return 0;
	}
	if (left < sizeof(head)) {
		return search_on(r, "file ends within a record", ret_item);
	}
	err = r->source.read_at(r->source.ctx, offset, head, sizeof(head));
	if (err < 0) {
		return err;
	}
	content_len = get_le64(head + 1);
	if (head[0] == 0 || (head[0] > MCAP_OP_DATA_END && head[0] < MCAP_OP_PRIVATE)) {
		return search_on(r, "no record where one should start", ret_item);
	}
	if (content_len > left - sizeof(head)) {
		return search_on(r, "file ends within a record", ret_item);
	}
	r->offset += sizeof(head) + content_len;
	if (content_len > MCAP_LIMIT_RECORD_BYTES) {
		damage(r, offset, "record is larger than this reader takes", GOES_ON, ret_item);
		return 2;
	}
	mcap_buf_clear(&r->record);
	if (mcap_buf_grow(&r->record, sizeof(head) + (size_t)content_len) == NULL) {
		return -ENOMEM;
	}
	err = r->source.read_at(r->source.ctx, offset, r->record.data, r->record.len);
	if (err < 0) {
		return err;
	}
	*ret_item = (struct mcap_item){ .offset = offset,
					.record = r->record.data,
					.record_len = r->record.len };
	return 1;
}

static int belongs_to_summary(uint8_t opcode)
{
	return opcode == MCAP_OP_FOOTER || opcode == MCAP_OP_CHUNK_INDEX ||
	       opcode == MCAP_OP_ATTACHMENT_INDEX || opcode == MCAP_OP_STATISTICS ||
	       opcode == MCAP_OP_METADATA_INDEX || opcode == MCAP_OP_SUMMARY_OFFSET;
}

/* What a top-level record that was loaded is, beyond its bytes. */
static void take_record(struct mcap_reader *r, struct mcap_item *item)
{
	if (has_sound_lengths(item->record, item->record_len)) {
		r->sound_end = r->offset;
	}
	if (mcap_parse_record(item) < 0) {
		damage(r, item->offset, "record is malformed", GOES_ON, item);
		return;
	}
	if (!r->is_summary && belongs_to_summary(item->record[0])) {
		damage(r, item->offset, "record of the summary in the data", GOES_ON, item);
		return;
	}
	if (item->kind == MCAP_ITEM_CHUNK) {
		take_chunk(r, item);
	}
	if (item->kind == MCAP_ITEM_DATA_END) {
		if (item->crc != 0 && item->crc != r->data_crc && !r->has_damage) {
			damage(r, item->offset,
			       "wrong CRC of the data section: head or metadata are damaged",
			       GOES_ON, item);
			r->has_pending_end = 1;
			return;
		}
	} else if (!r->is_summary && item->record != NULL) {
		r->data_crc = libdeflate_crc32(r->data_crc, item->record, item->record_len);
	}
	if (item->kind != MCAP_ITEM_OTHER && item->kind != MCAP_ITEM_DAMAGE) {
		r->sound_end = r->offset;
	}
}

int mcap_reader_next(struct mcap_reader *r, struct mcap_item *ret_item)
{
	struct mcap_item item = { .record = NULL };
	int got;

	if (r->has_bad_magic) {
		r->has_bad_magic = 0;
		return damage(r, 0, "does not start as an MCAP file", GOES_ON, ret_item);
	}
	if (r->inner != NULL && next_inner(r, &item) > 0) {
		*ret_item = item;
		return 1;
	}
	if (r->has_ended) {
		return 0;
	}
	if (r->has_pending_end) {
		item = (struct mcap_item){ .offset = r->offset - r->record.len,
					   .record = r->record.data,
					   .record_len = r->record.len,
					   .kind = MCAP_ITEM_DATA_END };
	} else {
		got = load_record(r, &item);
		if (got <= 0) {
			return got;
		}
		if (got == 1) {
			take_record(r, &item);
		}
	}
	if (item.kind == MCAP_ITEM_DATA_END ||
	    (item.record != NULL && item.record[0] == MCAP_OP_FOOTER)) {
		r->has_ended = 1;
	}
	*ret_item = item;
	return 1;
}

void mcap_reader_seek(struct mcap_reader *r, uint64_t offset)
{
	r->offset = offset;
	r->sound_end = offset;
	r->inner = NULL;
	r->has_ended = 0;
	r->has_pending_end = 0;
	r->has_bad_magic = 0;
	r->has_damage = 1; /* r->data_crc is of something else now */
}

uint32_t mcap_reader_data_crc(const struct mcap_reader *r)
{
	return r->data_crc;
}

static int check_summary(const struct mcap_source *source, uint64_t start, uint32_t wanted,
			 enum mcap_ending *ret_ending)
{
	uint8_t block[65536];
	uint64_t end = source->bytes - MCAP_MAGIC_BYTES - 4;
	uint32_t crc = 0;

	while (start < end) {
		size_t n = end - start < sizeof(block) ? (size_t)(end - start) : sizeof(block);
		int err = source->read_at(source->ctx, start, block, n);

		if (err < 0) {
			return err;
		}
		crc = libdeflate_crc32(crc, block, n);
		start += n;
	}
	*ret_ending = crc == wanted ? MCAP_ENDING_GOOD : MCAP_ENDING_BAD;
	return 0;
}

int mcap_ending_check(const struct mcap_source *source, enum mcap_ending *ret_ending)
{
	uint8_t tail[MCAP_FOOTER_BYTES + MCAP_MAGIC_BYTES];
	uint64_t tail_at = source->bytes - sizeof(tail);
	uint64_t summary_start;
	int err;

	if (source->bytes < MCAP_MAGIC_BYTES + sizeof(tail)) {
		*ret_ending = MCAP_ENDING_MISSING;
		return 0;
	}
	err = source->read_at(source->ctx, tail_at, tail, sizeof(tail));
	if (err < 0) {
		return err;
	}
	if (memcmp(tail + MCAP_FOOTER_BYTES, MCAP_MAGIC, MCAP_MAGIC_BYTES) != 0 ||
	    tail[0] != MCAP_OP_FOOTER ||
	    get_le64(tail + 1) != MCAP_FOOTER_BYTES - MCAP_HEAD_BYTES) {
		*ret_ending = MCAP_ENDING_MISSING;
		return 0;
	}
	summary_start = get_le64(tail + 9);
	if (summary_start == 0 || get_le32(tail + 25) == 0) {
		*ret_ending = MCAP_ENDING_GOOD; /* no summary, or none with a CRC: allowed */
		return 0;
	}
	if (summary_start > tail_at || summary_start < MCAP_MAGIC_BYTES) {
		*ret_ending = MCAP_ENDING_BAD;
		return 0;
	}
	return check_summary(source, summary_start, get_le32(tail + 25), ret_ending);
}
