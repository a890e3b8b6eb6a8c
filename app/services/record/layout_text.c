/* SPDX-License-Identifier: MIT */
/* The texts that describe a layout. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#include "image/image.h"
#include "program/json.h"
#include "record/layout.h"
#include "record/messages.h"
#include "record/names.h"

enum { COMMENT_BYTES = 160 };

/* As MCAP has the definitions of nested messages. */
#define SEPARATOR                                                                                  \
	"================================================================================\n"
#define HEADER_DEFINITIONS                                                                         \
	SEPARATOR                                                                                  \
	"MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n" SEPARATOR         \
	"MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"

/* Close the stream; its text, or NULL if it could not be made. */
static char *finish_text(FILE *out, char **text)
{
	int is_bad = ferror(out);

	if (fclose(out) != 0 || is_bad) {
		free(*text);
		return NULL;
	}
	return *text;
}

#define HEADER_IDL                                                                                 \
	"module builtin_interfaces {\n module msg {\n  @final\n  struct Time {\n"                  \
	"    long sec;\n    unsigned long nanosec;\n  };\n };\n};\n"                               \
	"module std_msgs {\n module msg {\n  @final\n  struct Header {\n"                          \
	"    builtin_interfaces::msg::Time stamp;\n    string frame_id;\n  };\n };\n};\n"

static void put_comment(FILE *out, const struct layout_field *f)
{
	const struct channel *ch = f->channel;
	char unit[sizeof(ch->unit)];
	char name[sizeof(ch->name)];
	char scale[40];
	char offset[40];

	name_make_comment(ch->name, name, sizeof(name));
	name_make_comment(ch->unit, unit, sizeof(unit));
	json_real_format(ch->scale, scale, sizeof(scale));
	json_real_format(ch->offset, offset, sizeof(offset));
	fprintf(out, "%s, %s 0x%04x:%02x, %u bit", name,
		ch->direction == CHANNEL_OUTPUT ? "output" : "input", ch->index, ch->subindex,
		ch->bit_len);
	if (f->raw_name != NULL) {
		fprintf(out, "; %s", unit[0] != '\0' ? unit : "physical");
	} else if (unit[0] != '\0' || image_is_scaled(ch)) {
		fprintf(out, "; %s = raw * %s + %s", unit[0] != '\0' ? unit : "value", scale,
			offset);
	}
}

static void put_slave_comment(FILE *out, const struct slave_info *s)
{
	char name[COMMENT_BYTES];
	char device[COMMENT_BYTES];

	name_make_comment(s->name, name, sizeof(name));
	name_make_comment(s->device, device, sizeof(device));
	fprintf(out,
		"Slave %s at position %u: %s, vendor 0x%08" PRIx32 ", product 0x%08" PRIx32
		", revision 0x%08" PRIx32 ".",
		name, s->slave_pos, device, s->vendor, s->product, s->revision);
}

char *layout_ros2msg(const struct layout_topic *topic)
{
	char *text = NULL;
	size_t len;
	FILE *out = open_memstream(&text, &len);

	if (out == NULL) {
		return NULL;
	}
	fprintf(out, "# ");
	put_slave_comment(out, topic->slave);
	fprintf(out, "\nstd_msgs/Header header  # stamp: UTC of that edge, as the log time\n"
		     "uint64 cycle  # index of the SYNC0 edge, one more in every message\n"
		     "int64 dc_time_ns  # DC time of that edge, ns since 2000-01-01\n"
		     "uint32 flags  # as in " MESSAGES_PACKAGE "/msg/Cycle\n"
		     "bool good  # fresh, and the slave's own checks hold\n");
	for (size_t i = 0; i < topic->field_count; i++) {
		const struct layout_field *f = &topic->field[i];

		fprintf(out, "%s %s  # ", f->ros_type, f->name);
		put_comment(out, f);
		fputc('\n', out);
	}
	fputs(HEADER_DEFINITIONS, out);
	return finish_text(out, &text);
}

char *layout_idl(const struct layout *l)
{
	char *text = NULL;
	size_t len;
	size_t count;
	const struct layout_topic *topic = layout_topics(l, &count);
	FILE *out = open_memstream(&text, &len);

	if (out == NULL) {
		return NULL;
	}
	fputs(HEADER_IDL "module " MESSAGES_PACKAGE " {\n module msg {\n", out);
	for (int kind = 0; kind < MESSAGE_KINDS; kind++) {
		messages_put_idl((enum messages_kind)kind, out);
	}
	for (size_t i = 0; i < count; i++) {
		fprintf(out, "  // ");
		put_slave_comment(out, topic[i].slave);
		fprintf(out,
			"\n  @final\n  struct %s {\n    std_msgs::msg::Header header;\n"
			"    unsigned long long cycle;\n"
			"    long long dc_time_ns;\n    unsigned long flags;\n    boolean good;\n",
			topic[i].type);
		for (size_t n = 0; n < topic[i].field_count; n++) {
			const struct layout_field *f = &topic[i].field[n];

			fprintf(out, "    %s %s; // ", f->idl_type, f->name);
			put_comment(out, f);
			fputc('\n', out);
		}
		fprintf(out, "  };\n");
	}
	fprintf(out, " };\n};\n");
	return finish_text(out, &text);
}

static const char *type_to_str(uint8_t type)
{
	switch ((enum channel_type)type) {
	case CHANNEL_BOOL:
		return "bool";
	case CHANNEL_UINT:
		return "uint";
	case CHANNEL_INT:
		return "int";
	case CHANNEL_FLOAT:
		return "float";
	}
	return "unknown";
}

/* One object a channel: its physical field, if there is one, names the raw one. */
static void put_json_channel(FILE *out, const struct layout_topic *topic,
			     const struct layout_field *f)
{
	const struct channel *ch = f->channel;
	const char *raw = f->raw_name != NULL ? f->raw_name : f->name;

	fprintf(out, "{\"name\":");
	json_put_text(out, ch->name);
	fprintf(out, ",\"topic\":");
	json_put_text(out, topic->topic);
	fprintf(out, ",\"field\":");
	json_put_text(out, f->name);
	fprintf(out, ",\"raw_field\":");
	if (raw[0] != '\0') {
		json_put_text(out, raw);
	} else {
		fputs("null", out);
	}
	fprintf(out,
		",\"slave\":%u,\"index\":%u,\"subindex\":%u,\"type\":\"%s\","
		"\"direction\":\"%s\",\"bit_len\":%u,\"bit_offset\":%" PRIu32 ",\"unit\":",
		ch->slave_pos, ch->index, ch->subindex, type_to_str(ch->type),
		ch->direction == CHANNEL_OUTPUT ? "output" : "input", ch->bit_len, ch->bit_offset);
	json_put_text(out, ch->unit);
	fprintf(out, ",\"scale\":");
	json_put_real(out, ch->scale);
	fprintf(out, ",\"offset\":");
	json_put_real(out, ch->offset);
	if (image_has_range(ch)) { /* an open end is null */
		fprintf(out, ",\"min\":");
		json_put_real(out, ch->min);
		fprintf(out, ",\"max\":");
		json_put_real(out, ch->max);
	}
	fputc('}', out);
}

static void put_json_slave(FILE *out, const struct slave_info *s)
{
	fprintf(out, "{\"name\":");
	json_put_text(out, s->name);
	fprintf(out, ",\"device\":");
	json_put_text(out, s->device);
	fprintf(out,
		",\"position\":%u,\"vendor\":%" PRIu32 ",\"product\":%" PRIu32
		",\"revision\":%" PRIu32 ",\"serial\":%" PRIu32 ",\"has_dc\":%s,"
		"\"is_dc_reference\":%s,\"dc_delay_ns\":%" PRId32 "}",
		s->slave_pos, s->vendor, s->product, s->revision, s->serial,
		s->has_dc ? "true" : "false", s->is_dc_reference ? "true" : "false",
		s->dc_delay_ns);
}

char *layout_json(const struct layout *l)
{
	const struct sample_meta *meta = layout_meta(l);
	size_t count;
	const struct layout_topic *topic = layout_topics(l, &count);
	const char *comma = "";
	char *text = NULL;
	size_t len;
	FILE *out = open_memstream(&text, &len);

	if (out == NULL) {
		return NULL;
	}
	fprintf(out, "{\"period_ns\":%" PRIu64 ",\"image_bytes\":%" PRIu32 ",\"slaves\":[",
		meta->period_ns, meta->image_bytes);
	for (uint32_t i = 0; i < meta->slave_count; i++) {
		fputs(i > 0 ? "," : "", out);
		put_json_slave(out, &layout_slaves(l)[i]);
	}
	fprintf(out, "],\"channels\":[");
	for (size_t i = 0; i < count; i++) {
		for (size_t n = 0; n < topic[i].field_count; n++) {
			fputs(comma, out);
			put_json_channel(out, &topic[i], &topic[i].field[n]);
			comma = ",";
			n += (size_t)layout_has_raw_beside(&topic[i].field[n]);
		}
	}
	fprintf(out, "]}");
	return finish_text(out, &text);
}
