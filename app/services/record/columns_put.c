/* SPDX-License-Identifier: MIT */
/* A row of the table as text. */
#include <inttypes.h>
#include <string.h>

#include "program/json.h"
#include "record/columns_internal.h"

/* As RFC 4180 has it. */
static void put_csv_text(FILE *out, const char *text)
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
		fputc(',', out);
		put_csv_text(out, c->column[i].name);
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

static void put_value(const struct columns *c, const struct column *col, FILE *out)
{
	const struct topic *t = &c->topic[col->topic];
	const struct ros2msg_field *field = &t->msg.field[col->field];
	const struct ros2msg_value *value = &t->value[col->field];
	int is_plain = c->is_raw || (col->scale == 1 && col->offset == 0);

	if (!is_plain || field->type == ROS2MSG_FLOAT) {
		double number = ros2msg_number(field, value);

		put_real(c, is_plain ? number : number * col->scale + col->offset, out);
	} else if (field->type == ROS2MSG_INT) {
		fprintf(out, "%" PRId64, (int64_t)value->raw);
	} else if (field->type == ROS2MSG_BOOL && c->format == LOG_JSON) {
		fputs(value->raw != 0 ? "true" : "false", out);
	} else {
		fprintf(out, "%" PRIu64, value->raw);
	}
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
		if (c->topic[c->column[i].topic].is_fresh) {
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
		if (c->topic[c->column[i].topic].is_fresh) {
			put_value(c, &c->column[i], out);
		}
	}
	fputc('\n', out);
}
