/* SPDX-License-Identifier: MIT */
/*
 * Least, greatest, mean and RMS value of each channel in each second (a block), beside the samples
 * of a recording: with them a picture of a day is drawn without reading 86 million samples. They
 * are attachments "ecdaq.envelope" between the chunks, one for at most ENVELOPE_BLOCKS blocks, each
 * readable by itself. Little-endian:
 *
 *   u32 version, u32 cycles of a block, u32 number of blocks, u32 number of channels
 *   of each channel: u16 length of its name, the name
 *   of each block: u64 block (cycle / cycles of a block), u32 samples,
 *       of each channel: u32 good samples, f32 min, f32 max, f32 mean, f32 RMS; NaN if none is good
 *
 * Values are physical. Blocks without a sample are left out.
 */
#ifndef RECORD_ENVELOPE_H
#define RECORD_ENVELOPE_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>

#include "base/sample.h"
#include "record/layout.h"
#include "record/mcap_parse.h"

#define ENVELOPE_NAME "ecdaq.envelope"
#define ENVELOPE_MEDIA_TYPE "application/x-ecdaq-envelope"

enum { ENVELOPE_BLOCKS = 64 };

/* Of some samples of one channel; begins as ENVELOPE_SUM_NONE. */
struct envelope_sum {
	uint64_t good;
	double min; /* of the good ones, as all below */
	double max;
	double sum;
	double squares;
};

/** All zero but for the bounds, which any value replaces. */
#define ENVELOPE_SUM_NONE ((struct envelope_sum){ .min = HUGE_VAL, .max = -HUGE_VAL })

/** Count one good value, which is not NaN. Context: any, RT-safe. */
static inline void envelope_sum_add(struct envelope_sum *s, double value)
{
	s->good++;
	s->min = value < s->min ? value : s->min;
	s->max = value > s->max ? value : s->max;
	s->sum += value;
	s->squares += value * value;
}

/** Count those of @more, too. Context: any, RT-safe. */
void envelope_sum_join(struct envelope_sum *s, const struct envelope_sum *more);

/** Cycles of a block: a second, or one cycle where that is longer. */
uint32_t envelope_block_cycles(uint64_t period_ns);

struct envelope;

/** For the channels of @layout, which the caller keeps. 0, -ENOMEM. Free with envelope_destroy().
 */
int envelope_create(const struct layout *layout, struct envelope **ret_envelope);
void envelope_destroy(struct envelope *e);

/** Count a sample; cycles go up. Not while envelope_is_full(). Context: any, RT-safe. */
void envelope_add(struct envelope *e, const struct sample_header *header, const uint8_t *image);
/** 1: the next sample may find no room: write the blocks, then envelope_clear(). */
int envelope_is_full(const struct envelope *e);
/** Bytes of the blocks, of the one that is not over, too; 0 without a sample. */
size_t envelope_size(const struct envelope *e);
/** They themselves; valid until the next call. */
const uint8_t *envelope_bytes(struct envelope *e);
/** Begin anew. The rest of a block that was written before its end is another block with the same
 * number: readers join them. */
void envelope_clear(struct envelope *e);

/* The blocks of an attachment, which stays where it is. */
struct envelope_view {
	const uint8_t *data;
	size_t names_at;
	size_t blocks_at;
	size_t block_bytes;
	uint32_t block_cycles; /* 1 or more */
	uint32_t blocks;
	uint32_t channels;
};

/** Whatever the bytes are. 0; -EBADMSG: they are no envelope; -ENOTSUP: of another version. */
int envelope_parse(const uint8_t *data, size_t len, struct envelope_view *ret);
/** The name of channel @i of the view, not zero-terminated. */
struct mcap_text envelope_channel(const struct envelope_view *v, uint32_t i);
/** Block @i of the view: its first cycle and its samples. */
uint64_t envelope_block(const struct envelope_view *v, uint32_t i, uint32_t *ret_samples);
/** Of channel @channel in block @i. */
struct envelope_sum envelope_get(const struct envelope_view *v, uint32_t i, uint32_t channel);

#endif
