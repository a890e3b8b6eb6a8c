/* SPDX-License-Identifier: MIT */
#include "record/layout.h"

#include <assert.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "base/clock.h"
#include "base/limits.h"
#include "image/field.h"
#include "image/image.h"
#include "reader/table.h"
#include "record/cdr.h"
#include "record/messages.h"
#include "record/names.h"

#define RAW_SUFFIX "_raw"

enum {
	RAW_SUFFIX_BYTES = sizeof(RAW_SUFFIX) - 1,
};

/* Where the head of a slave's message has what: as CDR aligns it. */
enum head_at {
	HEAD_SECONDS = CDR_HEADER_BYTES, /* header.stamp */
	HEAD_NANOSECONDS = HEAD_SECONDS + 4,
	HEAD_FRAME_ID = HEAD_NANOSECONDS + 4, /* empty: its length, and the closing zero */
	HEAD_CYCLE = HEAD_FRAME_ID + 4 + 1 + 3,
	HEAD_DC_TIME = HEAD_CYCLE + 8,
	HEAD_FLAGS = HEAD_DC_TIME + 8,
	HEAD_GOOD = HEAD_FLAGS + 4,
	HEAD_BYTES = HEAD_GOOD + 1,
};

static_assert((HEAD_CYCLE - CDR_HEADER_BYTES) % 8 == 0, "a number of 8 octets");

struct layout {
	const struct channel_table *table;
	struct layout_topic topic[LIMIT_SLAVES];
	size_t topic_count;
	struct layout_field *field; /* grouped by topic */
	enum config_record_values values;
};

static const struct {
	const char *ros;
	const char *idl;
} uint_types[] = { { "uint8", "octet" },
		   { "uint16", "unsigned short" },
		   { "uint32", "unsigned long" },
		   { "uint64", "unsigned long long" } },
  int_types[] = {
	  { "int8", "int8" }, { "int16", "short" }, { "int32", "long" }, { "int64", "long long" }
  };

static void set_raw_type(struct layout_field *f)
{
	const struct channel *ch = f->channel;
	unsigned size = ch->bit_len <= 8 ? 0 : ch->bit_len <= 16 ? 1 : ch->bit_len <= 32 ? 2 : 3;

	f->bytes = (uint8_t)(1u << size);
	switch ((enum channel_type)ch->type) {
	case CHANNEL_BOOL:
		f->ros_type = "bool";
		f->idl_type = "boolean";
		return;
	case CHANNEL_UINT:
		f->ros_type = uint_types[size].ros;
		f->idl_type = uint_types[size].idl;
		return;
	case CHANNEL_INT:
		f->ros_type = int_types[size].ros;
		f->idl_type = int_types[size].idl;
		return;
	case CHANNEL_FLOAT:
		f->ros_type = ch->bit_len == 32 ? "float32" : "float64";
		f->idl_type = ch->bit_len == 32 ? "float" : "double";
		return;
	}
}

/* "piccolo0.adc" of slave "piccolo0" is "adc". */
static const char *entry_name(const struct channel *ch, const struct slave_info *slave)
{
	size_t len = strlen(slave->name);

	return strncmp(ch->name, slave->name, len) == 0 && ch->name[len] == '.' ? ch->name + len + 1
										: ch->name;
}

static int field_exists(const struct layout_topic *t, const char *name)
{
	static const char *const head[LAYOUT_HEAD_FIELDS] = { "header", "cycle", "dc_time_ns",
							      "flags", "good" };

	for (size_t i = 0; i < LAYOUT_HEAD_FIELDS; i++) {
		if (strcmp(head[i], name) == 0) {
			return 1;
		}
	}
	for (size_t i = 0; i < t->field_count; i++) {
		if (strcmp(t->field[i].name, name) == 0) {
			return 1;
		}
	}
	return 0;
}

static struct layout_field *add_field(struct layout_topic *t, struct layout_field *field,
				      const struct channel *ch, const char *suffix)
{
	struct layout_field *f = &field[t->field_count];
	char entry[LAYOUT_NAME_BYTES - 12 - RAW_SUFFIX_BYTES];
	char plain[LAYOUT_NAME_BYTES - 12];

	f->channel = ch;
	name_make_field(entry_name(ch, t->slave), entry, sizeof(entry));
	snprintf(plain, sizeof(plain), "%s%s", entry, suffix);
	snprintf(f->name, sizeof(f->name), "%s", plain);
	for (unsigned n = 2; field_exists(t, f->name); n++) {
		snprintf(f->name, sizeof(f->name), "%s_%u", plain, n);
	}
	t->field_count++;
	return f;
}

static void place(struct layout_topic *t, struct layout_field *f)
{
	f->image = image_field_of(f->channel);
	f->sign = f->channel->type == CHANNEL_INT ? UINT64_C(1) << (f->channel->bit_len - 1) : 0;
	f->is_copied = f->raw_name == NULL && f->image.whole == f->bytes;
	f->at = (uint32_t)cdr_align(t->message_bytes, f->bytes);
	t->message_bytes = f->at + f->bytes;
}

static void add_channel(struct layout *l, struct layout_topic *t, struct layout_field *field,
			const struct channel *ch)
{
	int has_physical = image_is_scaled(ch) && l->values != CONFIG_RECORD_RAW;
	int has_raw = !has_physical || l->values == CONFIG_RECORD_BOTH;
	struct layout_field *physical = NULL;

	if (has_physical) {
		physical = add_field(t, field, ch, "");
		physical->ros_type = "float64";
		physical->idl_type = "double";
		physical->bytes = 8;
		physical->raw_name = "";
		place(t, physical);
	}
	if (has_raw) {
		struct layout_field *raw = add_field(t, field, ch, has_physical ? RAW_SUFFIX : "");

		set_raw_type(raw);
		place(t, raw);
		if (has_physical) {
			physical->raw_name = raw->name;
		}
	}
}

static int topic_exists(const struct layout *l, const struct layout_topic *t)
{
	if (messages_has_topic(t->topic) || messages_has_type(t->type)) {
		return 1;
	}
	for (size_t i = 0; i < l->topic_count; i++) {
		if (strcmp(l->topic[i].topic, t->topic) == 0 ||
		    strcmp(l->topic[i].type, t->type) == 0) {
			return 1;
		}
	}
	return 0;
}

/* Returns the number of fields used. */
static size_t add_topic(struct layout *l, const struct slave_info *slave,
			struct layout_field *field)
{
	struct layout_topic *t = &l->topic[l->topic_count];
	char name[LAYOUT_NAME_BYTES - 24];
	size_t type_len;

	*t = (struct layout_topic){ .slave = slave, .field = field };
	t->message_bytes = HEAD_BYTES;
	for (uint32_t i = 0; i < l->table->count[slave->slave_pos]; i++) {
		add_channel(l, t, field, channel_table_at(l->table, slave->slave_pos, i));
	}
	if (t->field_count == 0) {
		return 0;
	}
	name_make_field(slave->name, name, sizeof(name));
	snprintf(t->topic, sizeof(t->topic), "/ecdaq/%s", name);
	name_make_type(name, t->type, sizeof(t->type) - 12);
	type_len = strlen(t->type);
	for (unsigned n = slave->slave_pos; topic_exists(l, t); n += LIMIT_SLAVES) {
		snprintf(t->topic, sizeof(t->topic), "/ecdaq/%s_at_%u", name, n);
		snprintf(t->type + type_len, sizeof(t->type) - type_len, "At%u", n);
	}
	l->topic_count++;
	return t->field_count;
}

int layout_create(const struct channel_table *table, enum config_record_values values,
		  struct layout **ret_layout)
{
	struct layout *l = calloc(1, sizeof(*l));
	size_t used = 0;

	if (l == NULL) {
		return -ENOMEM;
	}
	l->table = table;
	l->values = values;
	l->field = calloc(2u * table->meta.channel_count + 1u, sizeof(l->field[0]));
	if (l->field == NULL) {
		layout_destroy(l);
		return -ENOMEM;
	}
	for (uint32_t i = 0; i < table->meta.slave_count; i++) {
		used += add_topic(l, &table->slaves[i], l->field + used);
	}
	*ret_layout = l;
	return 0;
}

void layout_destroy(struct layout *l)
{
	if (l == NULL) {
		return;
	}
	free(l->field);
	free(l);
}

const struct sample_meta *layout_meta(const struct layout *l)
{
	return &l->table->meta;
}

const struct slave_info *layout_slaves(const struct layout *l)
{
	return l->table->slaves;
}

const struct layout_topic *layout_topics(const struct layout *l, size_t *ret_count)
{
	*ret_count = l->topic_count;
	return l->topic;
}

size_t layout_largest_bytes(const struct layout *l)
{
	size_t largest = 0;

	for (size_t i = 0; i < l->topic_count; i++) {
		if (l->topic[i].message_bytes > largest) {
			largest = l->topic[i].message_bytes;
		}
	}
	return largest;
}

size_t layout_cycle_bytes(const struct layout *l)
{
	size_t bytes = 0;

	for (size_t i = 0; i < l->topic_count; i++) {
		bytes += l->topic[i].message_bytes;
	}
	return bytes;
}

/* 1, 2, 4 or 8: each a load and a store. */
static inline void copy_octets(uint8_t *to, const uint8_t *from, unsigned octets)
{
	switch (octets) {
	case 1:
		*to = *from;
		break;
	case 2:
		memcpy(to, from, 2);
		break;
	case 4:
		memcpy(to, from, 4);
		break;
	default:
		memcpy(to, from, 8);
		break;
	}
}

/* The field's bits. */
static uint64_t field_value(const struct layout_field *f, const uint8_t *image, int is_good)
{
	uint64_t raw = image_field_get(image, f->image);
	double physical;
	uint64_t bits;

	if (f->raw_name == NULL) {
		return (raw ^ f->sign) - f->sign; /* extends the sign, if it has one */
	}
	physical = is_good ? image_raw_to_physical(f->channel, raw) : (double)NAN;
	memcpy(&bits, &physical, sizeof(bits));
	return bits;
}

size_t layout_encode(const struct layout_topic *topic, const struct sample_header *header,
		     const uint8_t *image, uint64_t utc_ns, uint8_t *buf, size_t buf_len)
{
	int is_good = sample_is_good(header, topic->slave->slave_pos) != 0;

	assert(topic->message_bytes <= buf_len);
	memset(buf, 0, topic->message_bytes); /* what aligning leaves out */
	cdr_begin(buf, buf_len);
	put_le32(buf + HEAD_SECONDS, (uint32_t)(utc_ns / NS_PER_S));
	put_le32(buf + HEAD_NANOSECONDS, (uint32_t)(utc_ns % NS_PER_S));
	put_le32(buf + HEAD_FRAME_ID, 1);
	put_le64(buf + HEAD_CYCLE, header->cycle);
	put_le64(buf + HEAD_DC_TIME, (uint64_t)header->dc_time_ns);
	put_le32(buf + HEAD_FLAGS, header->flags);
	buf[HEAD_GOOD] = (uint8_t)is_good;
	for (size_t i = 0; i < topic->field_count; i++) {
		const struct layout_field *f = &topic->field[i];

		if (f->is_copied) {
			copy_octets(buf + f->at, image + f->image.byte, f->bytes);
		} else {
			put_le(buf + f->at, f->bytes, field_value(f, image, is_good));
		}
	}
	return topic->message_bytes;
}
