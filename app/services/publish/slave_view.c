/* SPDX-License-Identifier: MIT */
#include "publish/slave_view.h"

#include <errno.h>
#include <string.h>

#include "image/image.h"

#define NOT_FRESH (SAMPLE_LOST | SAMPLE_WKC_LOW | SAMPLE_NOT_OP | SAMPLE_SKIPPED)

static int is_sound(const struct sample_meta *meta, size_t meta_bytes)
{
	return meta_bytes >= sizeof(*meta) && meta->version == SAMPLE_VERSION &&
	       meta->slave_count <= LIMIT_SLAVES && meta->channel_count <= LIMIT_CHANNELS &&
	       meta->image_bytes <= LIMIT_IMAGE_BYTES && meta->period_ns > 0 &&
	       meta_bytes >= sizeof(*meta) + meta->slave_count * sizeof(struct slave_info) +
				     meta->channel_count * sizeof(struct channel);
}

static int is_named(const struct channel *ch, const char *entry)
{
	const char *dot = memrchr(ch->name, '.', strnlen(ch->name, sizeof(ch->name)));

	return dot != NULL && strcmp(dot + 1, entry) == 0;
}

static void take_name(struct slave_view *view, const struct channel *ch, uint32_t index)
{
	if (ch->direction != CHANNEL_INPUT) {
		return;
	}
	if (is_named(ch, "adc")) {
		view->adc = (int32_t)index;
	} else if (is_named(ch, "counter")) {
		view->counter = (int32_t)index;
	} else if (is_named(ch, "sample_time")) {
		view->sample_time = (int32_t)index;
	}
}

static uint32_t take_slave(struct slave_table *t, uint32_t slave, uint32_t first)
{
	struct slave_view *view = &t->view[slave];

	*view = (struct slave_view){ .info = &t->slaves[slave],
				     .first = first,
				     .adc = -1,
				     .counter = -1,
				     .sample_time = -1 };
	for (uint32_t i = 0; i < t->meta->channel_count; i++) {
		if (t->channels[i].slave_pos == view->info->slave_pos) {
			t->order[first + view->count++] = i;
			take_name(view, &t->channels[i], i);
		}
	}
	return first + view->count;
}

int slave_table_read(struct slave_table *table, const void *meta, size_t meta_bytes)
{
	struct slave_table *t = table;
	uint32_t first = 0;

	if (!is_sound(meta, meta_bytes)) {
		return -EPROTO;
	}
	t->meta = meta;
	t->slaves = sample_meta_slaves(t->meta);
	t->channels = sample_meta_channels(t->meta);
	for (uint32_t i = 0; i < t->meta->channel_count; i++) {
		if (!image_channel_fits(&t->channels[i], t->meta->image_bytes) ||
		    t->channels[i].name[sizeof(t->channels[i].name) - 1] != '\0') {
			return -EPROTO;
		}
	}
	/* Places differ from slave to slave, or order[] would overflow. */
	for (uint32_t s = 0; s < t->meta->slave_count; s++) {
		if (t->slaves[s].slave_pos != s) {
			return -EPROTO;
		}
		first = take_slave(t, s, first);
	}
	return 0;
}

int slave_is_good(const struct sample_header *h, const struct slave_view *view)
{
	uint16_t pos = view->info->slave_pos;

	return (h->flags & NOT_FRESH) == 0 && pos < 64 && (h->slaves_bad >> pos & 1) == 0;
}
