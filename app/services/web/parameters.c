/* SPDX-License-Identifier: MIT */
#include "web/parameters.h"

#include <cjson/cJSON.h>
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "web/foxglove.h"
#include "web/text.h"

enum { NAME_BYTES = 128, HOST_NAME_BYTES = 256 };

/* Who asks for what. */
struct question {
	const char *name[FOXGLOVE_ITEMS]; /* in order; none: all */
	size_t count;
	const char *id; /* NULL: none */
};

static int by_name(const void *a, const void *b)
{
	return strcmp(*(const char *const *)a, *(const char *const *)b);
}

static int read_question(const cJSON *root, struct question *q)
{
	const cJSON *names = cJSON_GetObjectItemCaseSensitive(root, "parameterNames");
	const cJSON *value;

	q->count = 0;
	q->id = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(root, "id"));
	if (!cJSON_IsArray(names)) {
		return -EBADMSG;
	}
	cJSON_ArrayForEach(value, names)
	{
		if (q->count == FOXGLOVE_ITEMS) {
			return -E2BIG;
		}
		if (!cJSON_IsString(value)) {
			return -EBADMSG;
		}
		q->name[q->count++] = value->valuestring;
	}
	if (q->count > 1) {
		qsort(q->name, q->count, sizeof(q->name[0]), by_name);
	}
	return 0;
}

/* 1 if it is asked for; then the object of the parameter is begun. */
static int begin(struct json *js, const struct question *q, const char *name)
{
	if (q->count > 0 &&
	    bsearch(&name, q->name, q->count, sizeof(q->name[0]), by_name) == NULL) {
		return 0;
	}
	json_object_begin(js, NULL);
	json_text(js, "name", name);
	return 1;
}

static void put_text(struct json *js, const struct question *q, const char *name, const char *value)
{
	if (begin(js, q, name)) {
		json_text(js, "value", value);
		json_object_end(js);
	}
}

static void put_number(struct json *js, const struct question *q, const char *name, double value)
{
	if (begin(js, q, name)) {
		json_double(js, "value", value);
		json_object_end(js);
	}
}

static const char *name_of(char buf[NAME_BYTES], const struct channel *ch, const char *what)
{
	snprintf(buf, NAME_BYTES, "%s.%s", ch->name, what);
	return buf;
}

static void put_channel(struct json *js, const struct question *q, const struct channel *ch,
			const char *slave)
{
	char name[NAME_BYTES];

	put_text(js, q, name_of(name, ch, "slave"), slave);
	put_text(js, q, name_of(name, ch, "direction"),
		 ch->direction == CHANNEL_OUTPUT ? "output" : "input");
	put_text(js, q, name_of(name, ch, "unit"), ch->unit);
	put_number(js, q, name_of(name, ch, "scale"), ch->scale);
	put_number(js, q, name_of(name, ch, "offset"), ch->offset);
}

static void put_session(struct json *js, const struct question *q, const struct source *source)
{
	const struct sample_meta *meta = source_meta(source);
	char host[HOST_NAME_BYTES] = "";
	char number[24];

	(void)gethostname(host, sizeof(host) - 1);
	put_text(js, q, "ecdaq.appliance", host);
	put_text(js, q, "ecdaq.version", ECDAQ_VERSION);
	if (meta != NULL) {
		/* More digits than a number of JSON has in most readers. */
		snprintf(number, sizeof(number), "%" PRIu64, meta->session);
		put_text(js, q, "ecdaq.session", number);
		put_number(js, q, "ecdaq.period_ns", (double)meta->period_ns);
	}
}

static void put_channels(struct json *js, const struct question *q, const struct source *source)
{
	size_t count;
	const struct layout_topic *topic = source_slaves(source, &count);

	for (size_t i = 0; i < count; i++) {
		for (size_t k = 0; k < topic[i].field_count; k++) {
			const struct channel *ch = topic[i].field[k].channel;

			/* Its physical field is followed by its raw one. */
			if (k == 0 || ch != topic[i].field[k - 1].channel) {
				put_channel(js, q, ch, topic[i].slave->name);
			}
		}
	}
}

static int put_answer(const struct question *q, const struct source *source, char **ret_answer)
{
	struct text t = { .text = NULL };
	char *answer;

	if (text_begin(&t, "parameterValues") < 0) {
		return -ENOMEM;
	}
	if (q->id != NULL) {
		json_text(&t.json, "id", q->id);
	}
	json_array_begin(&t.json, "parameters");
	put_session(&t.json, q, source);
	put_channels(&t.json, q, source);
	json_array_end(&t.json);
	answer = text_end(&t);
	if (answer == NULL) {
		return -ENOMEM;
	}
	*ret_answer = answer;
	return 0;
}

int parameters_answer(const char *text, size_t len, const struct source *source, char **ret_answer)
{
	struct question *q = malloc(sizeof(*q));
	cJSON *root = len > FOXGLOVE_REQUEST_BYTES ? NULL : cJSON_ParseWithLength(text, len);
	int r = q == NULL ? -ENOMEM : root == NULL ? -EBADMSG : read_question(root, q);

	r = r < 0 ? r : put_answer(q, source, ret_answer);
	cJSON_Delete(root);
	free(q);
	return r;
}
