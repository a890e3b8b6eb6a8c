/* SPDX-License-Identifier: MIT */
#include "stream/topics.h"

#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "program/json.h"
#include "record/messages.h"

#define PREFIX "/ecdaq/"

const char *topics_token(const char *topic_name)
{
	size_t n = strlen(PREFIX);

	if (strncmp(topic_name, PREFIX, n) != 0 || messages_has_topic(topic_name)) {
		return NULL;
	}
	return topic_name + n;
}

/* What a name of the recording consists of (record/names.h), and no subject of its own. */
static int is_token(const char *text)
{
	return text[0] != '\0' && strlen(text) < LAYOUT_NAME_BYTES &&
	       text[strspn(text, "abcdefghijklmnopqrstuvwxyz0123456789_")] == '\0';
}

static int make_room(struct topics *t)
{
	size_t wanted = t->capacity > 0 ? 2 * t->capacity : 8;
	struct topic *more;

	if (t->count < t->capacity) {
		return 0;
	}
	if (t->count >= TOPICS_LIMIT) {
		return -E2BIG;
	}
	more = realloc(t->topic, wanted * sizeof(*more));
	if (more == NULL) {
		return -ENOMEM;
	}
	t->topic = more;
	t->capacity = wanted;
	return 0;
}

int topics_add(struct topics *t, const char *token, const char *schema, const char *text)
{
	int r = is_token(token) ? make_room(t) : -EINVAL;
	struct topic *topic;

	if (r < 0) {
		return r;
	}
	topic = &t->topic[t->count];
	snprintf(topic->name, sizeof(topic->name), "%s", token);
	snprintf(topic->schema, sizeof(topic->schema), "%s", schema);
	topic->text = strdup(text);
	if (topic->text == NULL) {
		return -ENOMEM;
	}
	return (int)t->count++;
}

int topics_of_layout(struct topics *t, const struct layout *layout)
{
	size_t count;
	const struct layout_topic *from = layout_topics(layout, &count);
	char schema[LAYOUT_NAME_BYTES + 32];
	int r = 0;

	t->session = layout_meta(layout)->session;
	t->layout_json = layout_json(layout);
	for (size_t i = 0; i < count && r >= 0; i++) {
		char *text = layout_ros2msg(&from[i]);

		messages_schema_name(from[i].type, schema, sizeof(schema));
		r = text == NULL ? -ENOMEM
				 : topics_add(t, topics_token(from[i].topic), schema, text);
		free(text);
	}
	return t->layout_json == NULL ? -ENOMEM : r < 0 ? r : 0;
}

void topics_done(struct topics *t)
{
	for (size_t i = 0; i < t->count; i++) {
		free(t->topic[i].text);
	}
	free(t->topic);
	free(t->layout_json);
	*t = (struct topics){ .session = 0 };
}

char *topics_document(const struct topics *t, const char *appliance)
{
	char *text = NULL;
	size_t len;
	FILE *out = open_memstream(&text, &len);
	int is_bad;

	if (out == NULL) {
		return NULL;
	}
	fprintf(out, "{\"appliance\":");
	json_put_text(out, appliance);
	fprintf(out, ",\"session\":%" PRIu64 ",\"encoding\":\"cdr\",\"topics\":[", t->session);
	for (size_t i = 0; i < t->count; i++) {
		fprintf(out, "%s{\"topic\":", i > 0 ? "," : "");
		json_put_text(out, t->topic[i].name);
		fprintf(out, ",\"schema\":");
		json_put_text(out, t->topic[i].schema);
		fprintf(out, ",\"ros2msg\":");
		json_put_text(out, t->topic[i].text);
		fputc('}', out);
	}
	fprintf(out, "],\"layout\":%s}", t->layout_json != NULL ? t->layout_json : "null");
	is_bad = ferror(out);
	if (fclose(out) != 0 || is_bad) {
		free(text);
		return NULL;
	}
	return text;
}
