/* SPDX-License-Identifier: MIT */
#include "bus/channels.h"

#include <assert.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bus/bus_internal.h"
#include "bus/names.h"
#include "image/entry.h"

#define PIECE_BITS 64u
enum { PIECE_SUFFIX_BYTES = 4 }; /* _0 to _3, and the zero */

/* 12 bits over the range of the converter's reference. */
#define PICCOLO_ADC_VOLT 3.3
#define PICCOLO_ADC_MAX 4095.0

static uint8_t type_of(const struct pdo_entry *e, unsigned bits)
{
	switch (e->data_type) {
	case ECT_INTEGER8:
	case ECT_INTEGER16:
	case ECT_INTEGER24:
	case ECT_INTEGER32:
	case ECT_INTEGER64:
		return CHANNEL_INT;
	case ECT_REAL32:
		return bits == 32 ? CHANNEL_FLOAT : CHANNEL_UINT;
	case ECT_REAL64:
		return bits == 64 ? CHANNEL_FLOAT : CHANNEL_UINT;
	default:
		return bits == 1 ? CHANNEL_BOOL : CHANNEL_UINT;
	}
}

/* What the FB1111-Piccolo's values mean; other slaves' stay raw. */
static void apply_meaning(struct slave_info *slave, struct channel *ch, size_t number)
{
	if (!slave_is_piccolo(slave) || ch->index != PICCOLO_OBJECT_ADC) {
		return;
	}
	if (ch->subindex == PICCOLO_SUBINDEX_ADC) {
		snprintf(ch->unit, sizeof(ch->unit), "V");
		ch->scale = PICCOLO_ADC_VOLT / PICCOLO_ADC_MAX;
	}
	if (ch->subindex == PICCOLO_SUBINDEX_COUNTER) {
		slave->counter_channel = (int32_t)number;
	}
}

/* Room for the name of an entry behind the slave's, with the closing zero. */
static size_t entry_name_bytes(const struct slave_info *slave)
{
	static_assert(sizeof(slave->name) + PIECE_SUFFIX_BYTES + 16 <= LIMIT_NAME_BYTES,
		      "beside the longest slave's name there is room for an entry's");
	return LIMIT_NAME_BYTES - 1 - strlen(slave->name);
}

static void fill(struct channel *ch, const struct slave_info *slave, const struct pdo_entry *e,
		 const char *name)
{
	*ch = (struct channel){
		.slave_pos = slave->slave_pos,
		.index = e->index,
		.subindex = e->subindex,
		.type = type_of(e, e->bit_len),
		.direction = e->is_output ? CHANNEL_OUTPUT : CHANNEL_INPUT,
		.bit_len = e->bit_len,
		.scale = 1.0,
	};
	snprintf(ch->name, sizeof(ch->name), "%s.%.*s", slave->name,
		 (int)entry_name_bytes(slave) - 1, name);
	if (e->bit_len <= PIECE_BITS) {
		memcpy(ch->unit, e->unit, sizeof(ch->unit));
	}
}

/* An entry of more than 64 bits becomes several channels, name_0 first. Returns how many. */
static size_t put_entry(struct channel *ch, const struct slave_info *slave,
			const struct pdo_entry *e, const char *name, uint32_t bit_offset)
{
	unsigned pieces = (e->bit_len + PIECE_BITS - 1) / PIECE_BITS;

	for (unsigned i = 0; i < pieces; i++) {
		unsigned left = e->bit_len - i * PIECE_BITS;
		char piece_name[PDO_NAME_BYTES];

		if (pieces > 1) {
			snprintf(piece_name, sizeof(piece_name), "%.*s_%u",
				 (int)entry_name_bytes(slave) - PIECE_SUFFIX_BYTES, name, i);
		}
		fill(&ch[i], slave, e, pieces > 1 ? piece_name : name);
		ch[i].bit_offset = bit_offset + i * PIECE_BITS;
		if (pieces > 1) {
			ch[i].type = CHANNEL_UINT;
			ch[i].bit_len = (uint8_t)(left < PIECE_BITS ? left : PIECE_BITS);
		}
	}
	return pieces;
}

int channels_add(struct slave_info *slave, const struct pdo_entry *entry, size_t entry_count,
		 const struct channels_place *place, struct channels_table *table)
{
	struct channels_place at = *place;
	size_t n = table->count;
	char (*name)[PDO_NAME_BYTES] = calloc(entry_count + 1, sizeof(*name));

	if (name == NULL) {
		return -ENOMEM;
	}
	name_entries(entry, entry_count, entry_name_bytes(slave), name);
	slave->counter_channel = -1;
	slave->input_bits = 0;
	slave->output_bits = 0;
	for (size_t i = 0; i < entry_count; i++) {
		const struct pdo_entry *e = &entry[i];
		size_t put = 0;

		if (e->index != 0 && e->bit_len != 0) {
			if (n + (e->bit_len + PIECE_BITS - 1) / PIECE_BITS > table->capacity) {
				free(name);
				return -E2BIG;
			}
			put = put_entry(&table->channel[n], slave, e, name[i],
					at.bit_offset[e->sm]);
			apply_meaning(slave, &table->channel[n], n);
		}
		n += put;
		at.bit_offset[e->sm] += e->bit_len;
		*(e->is_output ? &slave->output_bits : &slave->input_bits) += e->bit_len;
	}
	table->count = n;
	free(name);
	return 0;
}

size_t channels_of(const struct channel *channel, size_t count, uint16_t slave_pos,
		   size_t *ret_first)
{
	size_t first = 0;
	size_t n = 0;

	while (first < count && channel[first].slave_pos != slave_pos) {
		first++;
	}
	while (first + n < count && channel[first + n].slave_pos == slave_pos) {
		n++;
	}
	*ret_first = first;
	return n;
}
