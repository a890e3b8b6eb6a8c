/* SPDX-License-Identifier: MIT */
#include "reader/table.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/slave_set.h"
#include "image/entry.h"
#include "image/image.h"

/* Far beyond any that there will be: sums of times do not overflow with it. */
#define TAI_OFFSET_LIMIT_S 86400

/* The table as it is allocated; what the const pointers of @table point to. */
struct storage {
	struct channel_table table;
	struct slave_info slaves[LIMIT_SLAVES];
	uint32_t order[LIMIT_CHANNELS];
	struct channel channels[];
};

static int is_within_limits(const struct sample_meta *meta)
{
	return meta->slave_count <= LIMIT_SLAVES && meta->channel_count <= LIMIT_CHANNELS &&
	       meta->image_bytes <= LIMIT_IMAGE_BYTES;
}

static int head_is_consistent(const struct sample_meta *meta, size_t meta_bytes)
{
	return meta->output_bytes <= meta->image_bytes && meta->period_ns > 0 &&
	       meta->period_ns < (uint64_t)NS_PER_S && meta->tai_offset_s >= -TAI_OFFSET_LIMIT_S &&
	       meta->tai_offset_s <= TAI_OFFSET_LIMIT_S &&
	       meta_bytes >= sizeof(*meta) + meta->slave_count * sizeof(struct slave_info) +
				     meta->channel_count * sizeof(struct channel);
}

static int is_terminated(const char *text, size_t bytes)
{
	return memchr(text, 0, bytes) != NULL;
}

static int sync0_is_consistent(const struct slave_info *slave, uint32_t period_ns)
{
	uint32_t cycle_ns = slave->sync0_cycle_ns;

	return cycle_ns == 0 || cycle_ns % period_ns == 0 || period_ns % cycle_ns == 0;
}

static int slaves_are_consistent(const struct channel_table *t)
{
	for (uint32_t i = 0; i < t->meta.slave_count; i++) {
		const struct slave_info *slave = &t->slaves[i];

		if (slave->slave_pos != i || !is_terminated(slave->name, sizeof(slave->name)) ||
		    !is_terminated(slave->device, sizeof(slave->device)) ||
		    slave->counter_channel >= (int32_t)t->meta.channel_count ||
		    !sync0_is_consistent(slave, (uint32_t)t->meta.period_ns)) {
			return 0;
		}
	}
	return 1;
}

static int channels_are_consistent(const struct channel_table *t)
{
	for (uint32_t i = 0; i < t->meta.channel_count; i++) {
		const struct channel *ch = &t->channels[i];

		if (ch->slave_pos >= t->meta.slave_count ||
		    !is_terminated(ch->name, sizeof(ch->name)) ||
		    !is_terminated(ch->unit, sizeof(ch->unit)) ||
		    (ch->direction != CHANNEL_INPUT && ch->direction != CHANNEL_OUTPUT) ||
		    !image_channel_fits(ch, t->meta.image_bytes)) {
			return 0;
		}
	}
	return 1;
}

static void group_by_slave(struct storage *s)
{
	struct channel_table *t = &s->table;
	uint32_t n = 0;

	for (uint32_t slave = 0; slave < t->meta.slave_count; slave++) {
		t->first[slave] = n;
		for (uint32_t i = 0; i < t->meta.channel_count; i++) {
			if (t->channels[i].slave_pos == slave) {
				s->order[n++] = i;
			}
		}
		t->count[slave] = n - t->first[slave];
	}
}

int channel_table_create(const void *meta, size_t meta_bytes, struct channel_table **ret_table)
{
	const uint8_t *slaves = (const uint8_t *)meta + sizeof(struct sample_meta);
	struct sample_meta head;
	struct storage *s;

	if (meta_bytes < sizeof(head)) {
		return -EPROTO;
	}
	memcpy(&head, meta, sizeof(head));
	if (head.version != SAMPLE_VERSION) {
		return -EPROTONOSUPPORT;
	}
	if (!is_within_limits(&head)) {
		return -E2BIG;
	}
	if (!head_is_consistent(&head, meta_bytes)) {
		return -EPROTO;
	}
	s = calloc(1, sizeof(*s) + head.channel_count * sizeof(s->channels[0]));
	if (s == NULL) {
		return -ENOMEM;
	}
	memcpy(s->slaves, slaves, head.slave_count * sizeof(s->slaves[0]));
	memcpy(s->channels, slaves + head.slave_count * sizeof(s->slaves[0]),
	       head.channel_count * sizeof(s->channels[0]));
	s->table.meta = head;
	s->table.slaves = s->slaves;
	s->table.channels = s->channels;
	s->table.order = s->order;
	if (!slaves_are_consistent(&s->table) || !channels_are_consistent(&s->table)) {
		free(s);
		return -EPROTO;
	}
	group_by_slave(s);
	*ret_table = &s->table;
	return 0;
}

void channel_table_destroy(struct channel_table *table)
{
	free(table); /* the first member of struct storage */
}

const struct channel *channel_table_at(const struct channel_table *table, uint32_t slave,
				       uint32_t n)
{
	return &table->channels[table->order[table->first[slave] + n]];
}

int channel_table_find_entry(const struct channel_table *table, uint32_t slave, const char *entry,
			     enum channel_direction direction)
{
	for (uint32_t n = 0; n < table->count[slave]; n++) {
		const struct channel *ch = channel_table_at(table, slave, n);

		if (ch->direction == direction &&
		    channel_is_entry(&table->slaves[slave], ch, entry)) {
			return (int)(ch - table->channels);
		}
	}
	return -ENOENT;
}

int sample_is_good(const struct sample_header *header, uint16_t slave_pos)
{
	return slave_pos < LIMIT_SLAVES && !slave_set_has(&header->slaves_bad, slave_pos);
}

const struct slave_set *sample_bad_slaves(const struct sample_header *header)
{
	return &header->slaves_bad;
}
