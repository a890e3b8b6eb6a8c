/* SPDX-License-Identifier: MIT */
/* ecdaq log info: what is in a recording, printed as it is found; the counts at the end. */
#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "program/json.h"
#include "record/log.h"
#include "record/log_common.h"

struct topic {
	char *name;
	uint16_t id;
	uint16_t schema_id;
	uint64_t messages;
};

struct schema {
	char *name;
	char *text;
	uint16_t id;
};

struct info {
	struct track track;
	struct topic *topic;
	size_t topic_count;
	struct schema *schema;
	size_t schema_count;
	enum log_format format;
	FILE *out;
	const char *comma; /* between metadata in JSON */
	int is_short_of_memory;
};

static char *copy_text(const char *text, size_t len)
{
	char *copy = malloc(len + 1); /* not strndup(): the text in a record has no zero behind it
				       */

	if (copy != NULL) {
		memcpy(copy, text, len);
		copy[len] = '\0';
	}
	return copy;
}

static struct topic *find_topic(const struct info *in, uint16_t id)
{
	for (size_t i = 0; i < in->topic_count; i++) {
		if (in->topic[i].id == id) {
			return &in->topic[i];
		}
	}
	return NULL;
}

static void add_topic(struct info *in, const struct mcap_item *item)
{
	struct topic *grown;

	if (find_topic(in, item->id) != NULL) {
		return;
	}
	grown = realloc(in->topic, (in->topic_count + 1) * sizeof(in->topic[0]));
	if (grown == NULL) {
		in->is_short_of_memory = 1;
		return;
	}
	in->topic = grown;
	in->topic[in->topic_count++] =
		(struct topic){ .name = copy_text(item->name.at, item->name.len),
				.id = item->id,
				.schema_id = item->schema_id };
}

static void add_schema(struct info *in, const struct mcap_item *item)
{
	struct schema *grown;

	for (size_t i = 0; i < in->schema_count; i++) {
		if (in->schema[i].id == item->id) {
			return;
		}
	}
	grown = realloc(in->schema, (in->schema_count + 1) * sizeof(in->schema[0]));
	if (grown == NULL) {
		in->is_short_of_memory = 1;
		return;
	}
	in->schema = grown;
	in->schema[in->schema_count++] =
		(struct schema){ .name = copy_text(item->name.at, item->name.len),
				 .text = copy_text((const char *)item->data, item->data_len),
				 .id = item->id };
}

static void put_indented(FILE *out, const char *text)
{
	int starts_line = 1;

	for (const char *p = text; *p != '\0'; p++) {
		if (starts_line) {
			fputs("      ", out);
		}
		fputc(*p == '\n' || (*p >= ' ' && *p != 0x7f) ? *p : '?', out);
		starts_line = *p == '\n';
	}
	if (!starts_line) {
		fputc('\n', out);
	}
}

static void put_value(FILE *out, struct mcap_text value)
{
	char *text = copy_text(value.at, value.len);

	if (text == NULL) {
		return;
	}
	if (strchr(text, '\n') != NULL) {
		fputc('\n', out);
		put_indented(out, text);
	} else {
		fprintf(out, "%s\n", text);
	}
	free(text);
}

static void put_metadata(struct info *in, const struct mcap_item *item)
{
	struct mcap_text key;
	struct mcap_text value;
	const char *comma = "";
	size_t at = 0;

	if (in->format == LOG_JSON) {
		fprintf(in->out, "%s{\"name\":", in->comma);
		json_put_text_n(in->out, item->name.at, item->name.len);
		fprintf(in->out, ",\"values\":{");
	} else {
		fprintf(in->out, "metadata %.*s\n", (int)item->name.len, item->name.at);
	}
	while (mcap_pairs_next(item->data, item->data_len, &at, &key, &value) > 0) {
		if (in->format == LOG_JSON) {
			fputs(comma, in->out);
			json_put_text_n(in->out, key.at, key.len);
			fputc(':', in->out);
			json_put_text_n(in->out, value.at, value.len);
			comma = ",";
		} else {
			fprintf(in->out, "  %.*s: ", (int)key.len, key.at);
			put_value(in->out, value);
		}
	}
	if (in->format == LOG_JSON) {
		fprintf(in->out, "}}");
		in->comma = ",";
	}
}

static void visit(void *ctx, const struct mcap_item *item)
{
	struct info *in = ctx;
	struct topic *topic;

	track_item(&in->track, item);
	if (item->kind == MCAP_ITEM_SCHEMA) {
		add_schema(in, item);
	} else if (item->kind == MCAP_ITEM_CHANNEL) {
		add_topic(in, item);
	} else if (item->kind == MCAP_ITEM_METADATA) {
		put_metadata(in, item);
	} else if (item->kind == MCAP_ITEM_ATTACHMENT && in->format == LOG_TEXT) {
		fprintf(in->out, "attachment %.*s (%.*s, %zu bytes)\n", (int)item->name.len,
			item->name.at, (int)item->encoding.len, item->encoding.at, item->data_len);
	} else if (item->kind == MCAP_ITEM_MESSAGE) {
		topic = find_topic(in, item->id);
		if (topic != NULL) {
			topic->messages++;
		}
	}
}

static const struct schema *schema_of(const struct info *in, const struct topic *t)
{
	for (size_t i = 0; i < in->schema_count; i++) {
		if (in->schema[i].id == t->schema_id) {
			return &in->schema[i];
		}
	}
	return NULL;
}

static void put_topics(const struct info *in)
{
	for (size_t i = 0; i < in->topic_count; i++) {
		const struct topic *t = &in->topic[i];
		const struct schema *s = schema_of(in, t);
		const char *name = s != NULL && s->name != NULL ? s->name : "";

		if (in->format == LOG_JSON) {
			fprintf(in->out, "%s{\"topic\":", i > 0 ? "," : "");
			json_put_text(in->out, t->name != NULL ? t->name : "");
			fprintf(in->out, ",\"messages\":%" PRIu64 ",\"schema\":", t->messages);
			json_put_text(in->out, name);
			fprintf(in->out, ",\"definition\":");
			json_put_text(in->out, s != NULL && s->text != NULL ? s->text : "");
			fputc('}', in->out);
		} else {
			fprintf(in->out, "topic %s: %" PRIu64 " messages, %s\n",
				t->name != NULL ? t->name : "", t->messages, name);
			put_indented(in->out, s != NULL && s->text != NULL ? s->text : "");
		}
	}
}

static void put_counts(const struct info *in, const struct mcap_findings *found)
{
	const struct track *t = &in->track;
	char start[LOG_TIME_BYTES];
	char end[LOG_TIME_BYTES];

	if (in->format == LOG_JSON) {
		fprintf(in->out,
			"],\"ending\":\"%s\",\"cycles\":%" PRIu64 ",\"first_cycle\":%" PRIu64
			",\"last_cycle\":%" PRIu64 ",\"start_ns\":%" PRIu64 ",\"end_ns\":%" PRIu64
			",\"gaps\":%" PRIu64 ",\"cycles_missing\":%" PRIu64 ",\"events\":%" PRIu64
			",\"chunks\":%" PRIu64 ",\"messages\":%" PRIu64
			",\"damaged_records\":%" PRIu64 "}\n",
			log_ending_to_str(found->ending), t->cycles, t->first_cycle, t->last_cycle,
			t->start_ns, t->end_ns, t->gaps, t->missing, t->events, found->chunks,
			found->messages, found->damaged);
		return;
	}
	log_format_time(t->start_ns, start);
	log_format_time(t->end_ns, end);
	fprintf(in->out,
		"%s; %" PRIu64 " chunks, %" PRIu64 " messages, %" PRIu64 " damaged records\n",
		log_ending_to_str(found->ending), found->chunks, found->messages, found->damaged);
	if (t->cycles > 0) {
		fprintf(in->out,
			"%" PRIu64 " cycles, %" PRIu64 " to %" PRIu64 ", %s to %s; %" PRIu64
			" gaps, %" PRIu64 " cycles missing; %" PRIu64 " events\n",
			t->cycles, t->first_cycle, t->last_cycle, start, end, t->gaps, t->missing,
			t->events);
	}
}

static void info_done(struct info *in)
{
	for (size_t i = 0; i < in->topic_count; i++) {
		free(in->topic[i].name);
	}
	for (size_t i = 0; i < in->schema_count; i++) {
		free(in->schema[i].name);
		free(in->schema[i].text);
	}
	free(in->topic);
	free(in->schema);
}

int log_info(const char *path, enum log_format format, FILE *out, FILE *err)
{
	struct info in = { .format = format, .out = out, .comma = "" };
	const struct mcap_visitor visitor = { .item = visit, .ctx = &in };
	struct mcap_reader *reader;
	struct mcap_scan *scan;
	struct log_file file;
	int r = log_file_open(path, &file);

	if (r < 0) {
		return log_fail_errno(err, path, r);
	}
	r = mcap_reader_create(&file.source, &reader);
	if (r < 0) { /* nothing is printed of what is no recording */
		log_file_close(&file);
		return log_fail_errno(err, path, r);
	}
	mcap_reader_destroy(reader);
	track_init(&in.track);
	if (format == LOG_JSON) {
		fprintf(out, "{\"file\":");
		json_put_text(out, path);
		fprintf(out, ",\"bytes\":%" PRIu64 ",\"metadata\":[", file.source.bytes);
	} else {
		fprintf(out, "%s: %" PRIu64 " bytes\n", path, file.source.bytes);
	}
	r = mcap_scan_create(&file.source, &visitor, &scan);
	log_file_close(&file);
	if (r == 0) {
		fputs(format == LOG_JSON ? "],\"topics\":[" : "", out);
		put_topics(&in);
		put_counts(&in, mcap_scan_findings(scan));
		mcap_scan_destroy(scan);
	}
	info_done(&in);
	if (r == 0 && in.is_short_of_memory) {
		r = -ENOMEM;
	}
	return r < 0 ? log_fail_errno(err, path, r) : log_finish_output(out, err);
}
