/* SPDX-License-Identifier: MIT */
#include "record/layout.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/limits.h"
#include "image/image.h"
#include "reader/table.h"
#include "record/cdr.h"
#include "record/messages.h"
#include "record/names.h"

struct layout {
	const struct channel_table *table;
	struct layout_topic topic[LIMIT_SLAVES];
	size_t topic_count;
	struct layout_field *field; /* one a channel, grouped by topic */
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

static void set_type(struct layout_field *f)
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
	static const char *const head[LAYOUT_HEAD_FIELDS] = { "cycle", "dc_time_ns", "flags",
							      "good" };

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

static void add_field(struct layout_topic *t, struct layout_field *f, const struct channel *ch)
{
	char plain[LAYOUT_NAME_BYTES - 12];

	f->channel = ch;
	name_make_field(entry_name(ch, t->slave), plain, sizeof(plain));
	snprintf(f->name, sizeof(f->name), "%s", plain);
	for (unsigned n = 2; field_exists(t, f->name); n++) {
		snprintf(f->name, sizeof(f->name), "%s_%u", plain, n);
	}
	set_type(f);
	t->message_bytes = cdr_align(t->message_bytes, f->bytes) + f->bytes;
	t->field_count++;
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
	/* cycle, dc_time_ns, flags, good */
	t->message_bytes = CDR_HEADER_BYTES + 8 + 8 + 4 + 1;
	for (uint32_t i = 0; i < l->table->count[slave->slave_pos]; i++) {
		add_field(t, &field[i], channel_table_at(l->table, slave->slave_pos, i));
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

int layout_create(const struct channel_table *table, struct layout **ret_layout)
{
	struct layout *l = calloc(1, sizeof(*l));
	size_t used = 0;

	if (l == NULL) {
		return -ENOMEM;
	}
	l->table = table;
	l->field = calloc(table->meta.channel_count + 1u, sizeof(l->field[0]));
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

static uint64_t field_value(const struct channel *ch, const uint8_t *image)
{
	uint64_t raw = image_get_raw(image, ch);

	if (ch->type == CHANNEL_INT && ch->bit_len < 64) {
		uint64_t sign = UINT64_C(1) << (ch->bit_len - 1);

		raw = (raw ^ sign) - sign; /* extends the sign */
	}
	return raw;
}

size_t layout_encode(const struct layout_topic *topic, const struct sample_header *header,
		     const uint8_t *image, uint8_t *buf, size_t buf_len)
{
	struct cdr c = cdr_begin(buf, buf_len);

	cdr_put(&c, header->cycle, 8);
	cdr_put(&c, (uint64_t)header->dc_time_ns, 8);
	cdr_put(&c, header->flags, 4);
	cdr_put(&c, sample_is_good(header, topic->slave->slave_pos) != 0, 1);
	for (size_t i = 0; i < topic->field_count; i++) {
		const struct layout_field *f = &topic->field[i];

		cdr_put(&c, field_value(f->channel, image), f->bytes);
	}
	return c.len;
}
