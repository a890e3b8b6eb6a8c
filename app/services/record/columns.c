/* SPDX-License-Identifier: MIT */
#include "record/columns.h"

#include <assert.h>
#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "program/json.h"
#include "record/messages.h"
#include "record/ros2msg.h"

enum { COLUMN_NAME_BYTES = 192, COLUMN_UNIT_BYTES = 64 };

struct column {
	char name[COLUMN_NAME_BYTES];
	size_t topic;
	size_t field;
	char unit[COLUMN_UNIT_BYTES]; /* of the values in the table; "" without one */
	double scale;
	double offset;
};

struct topic {
	uint16_t id;
	struct ros2msg msg;
	struct ros2msg_value *value; /* of the newest message */
	size_t cycle_field;
	size_t good_field;
	uint64_t cycle; /* of that */
	int is_fresh;   /* it belongs to the row */
};

struct schema {
	uint16_t id;
	char *text;
	size_t text_len;
};

struct columns {
	const char *channels;
	int is_raw;
	enum log_format format;
	struct schema *schema;
	size_t schema_count;
	struct topic *topic;
	size_t topic_count;
	struct column *column;
	size_t column_count;
	char without_raw[COLUMN_NAME_BYTES]; /* first channel whose raw values are missing */
	int cycle_channel;                   /* -1: none */
	int is_frozen;
	int has_row;
	struct {
		uint64_t cycle;
		uint64_t utc_ns;
		int64_t dc_time_ns;
		uint32_t flags;
	} row;
};

struct columns *columns_create(const char *channels, int is_raw, enum log_format format)
{
	struct columns *c = calloc(1, sizeof(*c));

	if (c != NULL) {
		c->channels = channels;
		c->is_raw = is_raw;
		c->format = format;
		c->cycle_channel = -1;
	}
	return c;
}

void columns_destroy(struct columns *c)
{
	if (c == NULL) {
		return;
	}
	for (size_t i = 0; i < c->schema_count; i++) {
		free(c->schema[i].text);
	}
	for (size_t i = 0; i < c->topic_count; i++) {
		ros2msg_done(&c->topic[i].msg);
		free(c->topic[i].value);
	}
	free(c->schema);
	free(c->topic);
	free(c->column);
	free(c);
}

/* One more element at the end of *@array, zeroed; NULL without memory. */
static void *grow(void **array, size_t *count, size_t element_bytes)
{
	char *grown;

	assert(*count == 0 || *array != NULL);
	if ((*count & (*count - 1)) == 0) { /* full at each power of two */
		grown = realloc(*array, (*count == 0 ? 1 : *count * 2) * element_bytes);
		if (grown == NULL) {
			return NULL;
		}
		*array = grown;
	}
	grown = (char *)*array + *count * element_bytes;
	memset(grown, 0, element_bytes);
	(*count)++;
	return grown;
}

static int learn_schema(struct columns *c, const struct mcap_item *item)
{
	struct schema *s;

	if (!mcap_text_is(item->encoding, "ros2msg")) {
		return 0;
	}
	s = grow((void **)&c->schema, &c->schema_count, sizeof(*s));
	if (s == NULL) {
		return -ENOMEM;
	}
	s->id = item->id;
	s->text = malloc(item->data_len + 1);
	if (s->text == NULL) {
		return -ENOMEM;
	}
	memcpy(s->text, item->data, item->data_len);
	s->text_len = item->data_len;
	return 0;
}

/* 1 if @name is in the requested list; no list means all. */
static int is_selected(const struct columns *c, const char *name)
{
	size_t len = strlen(name);

	if (c->channels == NULL) {
		return 1;
	}
	for (const char *at = c->channels; at != NULL; at = strchr(at, ',')) {
		at += *at == ',';
		if (strncmp(at, name, len) == 0 && (at[len] == ',' || at[len] == '\0')) {
			return 1;
		}
	}
	return 0;
}

static double real_of(const struct mcap_item *item, const char *field, const char *what,
		      double otherwise)
{
	char key[COLUMN_NAME_BYTES];
	char text[64];
	char *end;
	double value;

	snprintf(key, sizeof(key), "%s.%s", field, what);
	if (mcap_pairs_get(item, key, text, sizeof(text)) < 0) {
		return otherwise;
	}
	value = strtod(text, &end);
	return end == text || *end != '\0' ? otherwise : value;
}

/* Of two fields of one channel the first is physical and names the second, which is raw. Whether
 * @field is the one for this table. */
static int is_chosen(struct columns *c, const struct mcap_item *item, size_t topic,
		     const char *field, const char *channel)
{
	const struct column *last = c->column_count > 0 ? &c->column[c->column_count - 1] : NULL;
	char key[COLUMN_NAME_BYTES];
	char raw[COLUMN_NAME_BYTES];

	snprintf(key, sizeof(key), "%s.raw", field);
	if (mcap_pairs_get(item, key, raw, sizeof(raw)) < 0) { /* a raw field */
		return c->is_raw || last == NULL || last->topic != topic ||
		       strcmp(last->name, channel) != 0;
	}
	if (c->is_raw && raw[0] == '\0' && c->without_raw[0] == '\0') {
		snprintf(c->without_raw, sizeof(c->without_raw), "%s", channel);
	}
	return !c->is_raw;
}

static int add_column(struct columns *c, const struct mcap_item *item, size_t topic, size_t field)
{
	const char *name = c->topic[topic].msg.field[field].name;
	struct column col = { .topic = topic, .field = field };
	struct column *added;
	char slave[64] = "";
	char key[COLUMN_NAME_BYTES];

	snprintf(key, sizeof(key), "%s.channel", name);
	if (mcap_pairs_get(item, key, col.name, sizeof(col.name)) < 0) {
		/* "good" has no entry of its own, nor have fields of another writer's recording. */
		mcap_pairs_get(item, "slave", slave, sizeof(slave));
		snprintf(col.name, sizeof(col.name), "%s.%s", slave, name);
	}
	if (!is_selected(c, col.name) || c->topic[topic].msg.field[field].type == ROS2MSG_STRING ||
	    !is_chosen(c, item, topic, name, col.name)) {
		return 0;
	}
	col.scale = real_of(item, name, "scale", 1);
	col.offset = real_of(item, name, "offset", 0);
	snprintf(key, sizeof(key), "%s.unit", name);
	if (c->is_raw || mcap_pairs_get(item, key, col.unit, sizeof(col.unit)) < 0) {
		col.unit[0] = '\0';
	}
	added = grow((void **)&c->column, &c->column_count, sizeof(col));
	if (added == NULL) {
		return -ENOMEM;
	}
	*added = col;
	return 0;
}

static int learn_topic(struct columns *c, const struct mcap_item *item, const struct schema *schema)
{
	struct ros2msg msg;
	struct topic *t;
	int cycle_field;
	int good_field;
	int r = ros2msg_parse(schema->text, schema->text_len, &msg);

	if (r < 0) {
		return r == -ENOMEM ? r : 0; /* not one of ours */
	}
	cycle_field = ros2msg_find(&msg, "cycle");
	good_field = ros2msg_find(&msg, "good");
	if (cycle_field < 0 || good_field < cycle_field) {
		ros2msg_done(&msg);
		return 0;
	}
	t = grow((void **)&c->topic, &c->topic_count, sizeof(*t));
	if (t == NULL) {
		ros2msg_done(&msg);
		return -ENOMEM;
	}
	t->id = item->id;
	t->msg = msg;
	t->cycle_field = (size_t)cycle_field;
	t->good_field = (size_t)good_field;
	t->value = calloc(msg.count, sizeof(t->value[0]));
	if (t->value == NULL) {
		return -ENOMEM;
	}
	for (size_t i = t->good_field; i < msg.count; i++) {
		r = add_column(c, item, c->topic_count - 1, i);
		if (r < 0) {
			return r;
		}
	}
	return 0;
}

static int learn_channel(struct columns *c, const struct mcap_item *item)
{
	if (mcap_text_is(item->name, messages_topic(MESSAGE_CYCLE))) {
		c->cycle_channel = item->id;
		return 0;
	}
	for (size_t i = 0; i < c->topic_count; i++) {
		if (c->topic[i].id == item->id) {
			return 0; /* a repeated record */
		}
	}
	for (size_t i = 0; i < c->schema_count; i++) {
		if (c->schema[i].id == item->schema_id && mcap_text_is(item->encoding, "cdr")) {
			return learn_topic(c, item, &c->schema[i]);
		}
	}
	return 0;
}

int columns_learn(struct columns *c, const struct mcap_item *item)
{
	if (c->is_frozen) {
		return 0;
	}
	return item->kind == MCAP_ITEM_SCHEMA ? learn_schema(c, item) : learn_channel(c, item);
}

static int has_column(const struct columns *c, const char *name, size_t len)
{
	for (size_t i = 0; i < c->column_count; i++) {
		if (strlen(c->column[i].name) == len && memcmp(c->column[i].name, name, len) == 0) {
			return 1;
		}
	}
	return 0;
}

int columns_freeze(struct columns *c, char *ret_missing, size_t missing_bytes)
{
	const char *at = c->channels;

	if (c->cycle_channel < 0) {
		return -ENODATA;
	}
	if (c->without_raw[0] != '\0') {
		snprintf(ret_missing, missing_bytes, "%s", c->without_raw);
		return -ENOTSUP;
	}
	while (at != NULL) {
		size_t len = strcspn(at, ",");

		if (!has_column(c, at, len)) {
			snprintf(ret_missing, missing_bytes, "%.*s", (int)len, at);
			return -ENOENT;
		}
		at = at[len] == ',' ? at + len + 1 : NULL;
	}
	c->is_frozen = 1;
	return 0;
}

int columns_is_frozen(const struct columns *c)
{
	return c->is_frozen;
}

int columns_are_equal(const struct columns *a, const struct columns *b)
{
	if (a->column_count != b->column_count) {
		return 0;
	}
	for (size_t i = 0; i < a->column_count; i++) {
		if (strcmp(a->column[i].name, b->column[i].name) != 0 ||
		    strcmp(a->column[i].unit, b->column[i].unit) != 0) {
			return 0;
		}
	}
	return 1;
}

int columns_is_cycle(const struct columns *c, const struct mcap_item *item)
{
	return item->id == c->cycle_channel;
}

int columns_begin_row(struct columns *c, const struct mcap_item *item)
{
	/* Header, cycle, dc_time_ns, three times, four figures, flags: see messages.c. */
	const size_t dc_at = 4 + 8;
	const size_t flags_at = 4 + 5 * 8 + 4 * 4;
	uint64_t cycle;

	if (messages_decode_cycle(item->data, item->data_len, &cycle) < 0 ||
	    item->data_len < flags_at + 4) {
		c->has_row = 0;
		return -EBADMSG;
	}
	c->row.cycle = cycle;
	c->row.utc_ns = item->log_time_ns;
	c->row.dc_time_ns = (int64_t)get_le64(item->data + dc_at);
	c->row.flags = get_le32(item->data + flags_at);
	c->has_row = 1;
	for (size_t i = 0; i < c->topic_count; i++) {
		c->topic[i].is_fresh = 0;
	}
	return 0;
}

int columns_take(struct columns *c, const struct mcap_item *item)
{
	for (size_t i = 0; i < c->topic_count; i++) {
		struct topic *t = &c->topic[i];

		if (t->id != item->id) {
			continue;
		}
		if (ros2msg_decode(&t->msg, item->data, item->data_len, t->value) < 0) {
			return -EBADMSG;
		}
		t->is_fresh = c->has_row && t->value[t->cycle_field].raw == c->row.cycle;
		return 0;
	}
	return 0;
}

int columns_has_row(const struct columns *c)
{
	return c->has_row;
}

uint64_t columns_row_cycle(const struct columns *c)
{
	return c->row.cycle;
}

void columns_put_csv_text(FILE *out, const char *text)
{
	if (strpbrk(text, ",\"\r\n") == NULL) {
		fputs(text, out);
		return;
	}
	fputc('"', out);
	for (; *text != '\0'; text++) {
		if (*text == '"') {
			fputc('"', out); /* a quote is doubled */
		}
		fputc(*text, out);
	}
	fputc('"', out);
}

void columns_put_header(const struct columns *c, FILE *out)
{
	fputs(c->channels == NULL ? "cycle,utc_ns,dc_time_ns,flags" : "cycle,utc_ns", out);
	for (size_t i = 0; i < c->column_count; i++) {
		char title[COLUMN_NAME_BYTES + COLUMN_UNIT_BYTES + 3];
		const struct column *col = &c->column[i];

		snprintf(title, sizeof(title), col->unit[0] != '\0' ? "%s [%s]" : "%s", col->name,
			 col->unit);
		fputc(',', out);
		columns_put_csv_text(out, title);
	}
	fputc('\n', out);
}

static void put_real(const struct columns *c, double value, FILE *out)
{
	char text[40];

	if (c->format == LOG_JSON) {
		json_put_real(out, value);
	} else {
		json_real_format(value, text, sizeof(text));
		fputs(text, out);
	}
}

/* The value is the number of its field: it has no scale and no offset. */
static int is_plain(const struct columns *c, const struct column *col)
{
	return c->is_raw || (col->scale == 1 && col->offset == 0);
}

static double number_of(const struct columns *c, const struct column *col)
{
	const struct topic *t = &c->topic[col->topic];
	double number = ros2msg_number(&t->msg.field[col->field], &t->value[col->field]);

	return is_plain(c, col) ? number : number * col->scale + col->offset;
}

static void put_value(const struct columns *c, const struct column *col, FILE *out)
{
	const struct topic *t = &c->topic[col->topic];
	const struct ros2msg_field *field = &t->msg.field[col->field];
	const struct ros2msg_value *value = &t->value[col->field];

	if (!is_plain(c, col) || field->type == ROS2MSG_FLOAT) {
		put_real(c, number_of(c, col), out);
	} else if (field->type == ROS2MSG_INT) {
		fprintf(out, "%" PRId64, (int64_t)value->raw);
	} else if (field->type == ROS2MSG_BOOL && c->format == LOG_JSON) {
		fputs(value->raw != 0 ? "true" : "false", out);
	} else {
		fprintf(out, "%" PRIu64, value->raw);
	}
}

/* A value of a slave that did not answer is an old one or none: the cell is empty. */
static int has_value(const struct columns *c, const struct column *col)
{
	const struct topic *t = &c->topic[col->topic];

	return t->is_fresh &&
	       (c->is_raw || col->field == t->good_field || t->value[t->good_field].raw != 0);
}

size_t columns_count(const struct columns *c)
{
	return c->column_count;
}

const char *columns_name(const struct columns *c, size_t i)
{
	return c->column[i].name;
}

const char *columns_unit(const struct columns *c, size_t i)
{
	return c->column[i].unit;
}

int columns_is_channel(const struct columns *c, size_t i)
{
	return c->column[i].field != c->topic[c->column[i].topic].good_field;
}

int columns_number(const struct columns *c, size_t i, double *ret)
{
	if (!has_value(c, &c->column[i])) {
		return 0;
	}
	*ret = number_of(c, &c->column[i]);
	return 1;
}

static void put_json_row(const struct columns *c, FILE *out)
{
	fprintf(out, "{\"cycle\":%" PRIu64 ",\"utc_ns\":%" PRIu64, c->row.cycle, c->row.utc_ns);
	if (c->channels == NULL) {
		fprintf(out, ",\"dc_time_ns\":%" PRId64 ",\"flags\":%" PRIu32, c->row.dc_time_ns,
			c->row.flags);
	}
	for (size_t i = 0; i < c->column_count; i++) {
		fputc(',', out);
		json_put_text(out, c->column[i].name);
		fputc(':', out);
		if (has_value(c, &c->column[i])) {
			put_value(c, &c->column[i], out);
		} else {
			fputs("null", out);
		}
	}
	fputs("}\n", out);
}

void columns_put_row(const struct columns *c, FILE *out)
{
	if (c->format == LOG_JSON) {
		put_json_row(c, out);
		return;
	}
	fprintf(out, "%" PRIu64 ",%" PRIu64, c->row.cycle, c->row.utc_ns);
	if (c->channels == NULL) {
		fprintf(out, ",%" PRId64 ",%" PRIu32, c->row.dc_time_ns, c->row.flags);
	}
	for (size_t i = 0; i < c->column_count; i++) {
		fputc(',', out);
		if (has_value(c, &c->column[i])) {
			put_value(c, &c->column[i], out);
		}
	}
	fputc('\n', out);
}
