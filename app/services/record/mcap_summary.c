/* SPDX-License-Identifier: MIT */
#include "record/mcap_summary.h"

#include <libdeflate.h>

#include "base/bytes.h"

enum {
	GROUPS = 6,
	OFFSET_RECORD_BYTES = MCAP_HEAD_BYTES + 1 + 8 + 8,
	STATISTICS_BYTES = MCAP_HEAD_BYTES + 8 + 2 + 4 * 4 + 8 + 8 + 4,
	CHANNEL_COUNT_BYTES = 10
};

static void put_statistics(const struct mcap_index *ix, struct mcap_buf *out)
{
	size_t start = mcap_buf_begin(out, MCAP_OP_STATISTICS);
	size_t counts;

	mcap_buf_u64(out, ix->messages);
	mcap_buf_u16(out, (uint16_t)ix->schema_count);
	mcap_buf_u32(out, ix->channel_count);
	mcap_buf_u32(out, ix->attachment_count);
	mcap_buf_u32(out, ix->metadata_count);
	mcap_buf_u32(out, ix->chunk_count);
	mcap_buf_u64(out, ix->messages > 0 ? ix->start_ns : 0);
	mcap_buf_u64(out, ix->messages > 0 ? ix->end_ns : 0);
	counts = out->len;
	mcap_buf_u32(out, 0);
	for (uint32_t id = 0; id < ix->channel_end; id++) {
		if (ix->channel_messages[id] > 0) {
			mcap_buf_u16(out, (uint16_t)id);
			mcap_buf_u64(out, ix->channel_messages[id]);
		}
	}
	if (out->error == 0) {
		put_le32(out->data + counts, (uint32_t)(out->len - counts - 4));
	}
	mcap_buf_end(out, start);
}

static void put_summary_offset(struct mcap_buf *out, enum mcap_opcode opcode, uint64_t group_start,
			       uint64_t group_len)
{
	size_t start = mcap_buf_begin(out, MCAP_OP_SUMMARY_OFFSET);

	mcap_buf_u8(out, (uint8_t)opcode);
	mcap_buf_u64(out, group_start);
	mcap_buf_u64(out, group_len);
	mcap_buf_end(out, start);
}

static const struct mcap_buf *group_records(const struct mcap_index *ix, enum mcap_opcode opcode)
{
	static const struct mcap_buf none;

	switch ((int)opcode) {
	case MCAP_OP_SCHEMA:
		return &ix->schemas;
	case MCAP_OP_CHANNEL:
		return &ix->channels;
	case MCAP_OP_CHUNK_INDEX:
		return &ix->chunks;
	case MCAP_OP_ATTACHMENT_INDEX:
		return &ix->attachments;
	case MCAP_OP_METADATA_INDEX:
		return &ix->metadata;
	default: /* statistics are made on the spot */
		return &none;
	}
}

void mcap_summary_put(const struct mcap_index *ix, uint64_t offset, uint32_t data_crc,
		      struct mcap_buf *out)
{
	static const enum mcap_opcode order[GROUPS] = {
		MCAP_OP_SCHEMA,      MCAP_OP_CHANNEL,          MCAP_OP_STATISTICS,
		MCAP_OP_CHUNK_INDEX, MCAP_OP_ATTACHMENT_INDEX, MCAP_OP_METADATA_INDEX,
	};
	size_t base = out->len;
	size_t group_start[GROUPS + 1];
	size_t summary_start;
	size_t offsets_start;
	size_t footer;

	mcap_buf_begin(out, MCAP_OP_DATA_END);
	mcap_buf_u32(out, data_crc);
	mcap_buf_end(out, base);
	summary_start = out->len;
	for (size_t i = 0; i < GROUPS; i++) {
		const struct mcap_buf *records = group_records(ix, order[i]);

		group_start[i] = out->len;
		if (order[i] == MCAP_OP_STATISTICS) {
			put_statistics(ix, out);
		} else {
			mcap_buf_put(out, records->data, records->len);
		}
	}
	group_start[GROUPS] = out->len;
	offsets_start = out->len;
	for (size_t i = 0; i < GROUPS; i++) {
		if (group_start[i + 1] > group_start[i]) {
			put_summary_offset(out, order[i], offset + group_start[i] - base,
					   group_start[i + 1] - group_start[i]);
		}
	}
	footer = mcap_buf_begin(out, MCAP_OP_FOOTER);
	mcap_buf_u64(out, offset + summary_start - base);
	mcap_buf_u64(out, offset + offsets_start - base);
	mcap_buf_u32(out, 0);
	mcap_buf_end(out, footer);
	if (out->error == 0) {
		/* Over the summary section and the footer up to the CRC itself. */
		put_le32(out->data + out->len - 4,
			 libdeflate_crc32(0, out->data + summary_start,
					  (out->len - 4 - summary_start)));
	}
	mcap_buf_put(out, MCAP_MAGIC, MCAP_MAGIC_BYTES);
}

uint64_t mcap_summary_bytes(const struct mcap_index *ix)
{
	return MCAP_DATA_END_BYTES + ix->schemas.len + ix->channels.len + ix->chunks.len +
	       ix->attachments.len + ix->metadata.len + STATISTICS_BYTES +
	       (uint64_t)CHANNEL_COUNT_BYTES * ix->channel_count +
	       (uint64_t)GROUPS * OFFSET_RECORD_BYTES + MCAP_FOOTER_BYTES + MCAP_MAGIC_BYTES;
}
