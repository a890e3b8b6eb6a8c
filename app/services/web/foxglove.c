/* SPDX-License-Identifier: MIT */
#include "web/foxglove.h"

#include <cjson/cJSON.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "web/text.h"

enum { MESSAGE_DATA = 1 };

/* A whole number that is an id. */
static int get_id(const cJSON *value, uint32_t *ret)
{
	double number = cJSON_IsNumber(value) ? value->valuedouble : -1;

	if (!(number >= 0 && number <= UINT32_MAX) || (double)(uint32_t)number != number) {
		return -EBADMSG;
	}
	*ret = (uint32_t)number;
	return 0;
}

static int get_item(const cJSON *value, struct foxglove_request *ret)
{
	uint32_t channel = 0;
	uint32_t id;
	int r;

	if (ret->count == FOXGLOVE_ITEMS) {
		return -E2BIG;
	}
	if (ret->op == FOXGLOVE_SUBSCRIBE) {
		r = get_id(cJSON_GetObjectItemCaseSensitive(value, "id"), &id);
		r = r < 0 ? r
			  : get_id(cJSON_GetObjectItemCaseSensitive(value, "channelId"), &channel);
	} else {
		r = get_id(value, &id);
	}
	if (r == 0) {
		ret->item[ret->count].id = id;
		ret->item[ret->count].channel = channel;
		ret->count++;
	}
	return r;
}

static int get_request(const cJSON *root, struct foxglove_request *ret)
{
	const char *op = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(root, "op"));
	const cJSON *list;
	const cJSON *value;

	if (op == NULL) {
		return -EBADMSG;
	}
	ret->count = 0;
	ret->op = strcmp(op, "subscribe") == 0       ? FOXGLOVE_SUBSCRIBE
		  : strcmp(op, "unsubscribe") == 0   ? FOXGLOVE_UNSUBSCRIBE
		  : strcmp(op, "getParameters") == 0 ? FOXGLOVE_GET_PARAMETERS
		  : strcmp(op, "setParameters") == 0 ? FOXGLOVE_SET_PARAMETERS
						     : FOXGLOVE_OTHER;
	if (ret->op != FOXGLOVE_SUBSCRIBE && ret->op != FOXGLOVE_UNSUBSCRIBE) {
		return 0;
	}
	list = cJSON_GetObjectItemCaseSensitive(
		root, ret->op == FOXGLOVE_SUBSCRIBE ? "subscriptions" : "subscriptionIds");
	if (!cJSON_IsArray(list)) {
		return -EBADMSG;
	}
	cJSON_ArrayForEach(value, list)
	{
		int r = get_item(value, ret);

		if (r < 0) {
			return r;
		}
	}
	return 0;
}

int foxglove_parse(const char *text, size_t len, struct foxglove_request *ret)
{
	cJSON *root = len > FOXGLOVE_REQUEST_BYTES ? NULL : cJSON_ParseWithLength(text, len);
	int r = root == NULL ? -EBADMSG : get_request(root, ret);

	cJSON_Delete(root);
	return r;
}

char *foxglove_server_info(void)
{
	struct text t = { .text = NULL };

	if (text_begin(&t, "serverInfo") < 0) {
		return NULL;
	}
	json_text(&t.json, "name", "ecdaq " ECDAQ_VERSION);
	json_array_begin(&t.json, "capabilities");
	json_text(&t.json, NULL, "parameters");
	json_array_end(&t.json);
	json_array_begin(&t.json, "supportedEncodings");
	json_array_end(&t.json);
	return text_end(&t);
}

static void put_channel(struct json *js, uint32_t id, const char *topic, const char *type,
			const char *schema)
{
	char name[LAYOUT_NAME_BYTES + 32];

	messages_schema_name(type, name, sizeof(name));
	json_object_begin(js, NULL);
	json_u64(js, "id", id);
	json_text(js, "topic", topic);
	json_text(js, "encoding", "cdr");
	json_text(js, "schemaName", name);
	json_text(js, "schemaEncoding", "ros2msg");
	json_text(js, "schema", schema);
	json_object_end(js);
}

/* The end of an advertisement; without one of its schemas it is none. */
static char *channels_end(struct text *t, int is_complete)
{
	char *text;

	json_array_end(&t->json);
	text = text_end(t);
	if (!is_complete) {
		free(text);
		return NULL;
	}
	return text;
}

char *foxglove_advertise_fixed(void)
{
	struct text t = { .text = NULL };
	int is_complete = 1;

	if (text_begin(&t, "advertise") < 0) {
		return NULL;
	}
	json_array_begin(&t.json, "channels");
	for (uint32_t kind = 0; kind < MESSAGE_KINDS; kind++) {
		char *schema = messages_ros2msg((enum messages_kind)kind);

		is_complete = is_complete && schema != NULL;
		put_channel(&t.json, kind + 1, messages_topic((enum messages_kind)kind),
			    messages_type((enum messages_kind)kind), schema == NULL ? "" : schema);
		free(schema);
	}
	return channels_end(&t, is_complete);
}

char *foxglove_advertise_slaves(const struct source *source)
{
	struct text t = { .text = NULL };
	int is_complete = 1;
	size_t count;
	const struct layout_topic *topic = source_slaves(source, &count);

	if (text_begin(&t, "advertise") < 0) {
		return NULL;
	}
	json_array_begin(&t.json, "channels");
	for (size_t i = 0; i < count; i++) {
		char *schema = layout_ros2msg(&topic[i]);

		is_complete = is_complete && schema != NULL;
		put_channel(&t.json, source_slave_channel(source_session(source), i),
			    topic[i].topic, topic[i].type, schema == NULL ? "" : schema);
		free(schema);
	}
	return channels_end(&t, is_complete);
}

char *foxglove_unadvertise_slaves(uint32_t session, size_t count)
{
	struct text t = { .text = NULL };

	if (text_begin(&t, "unadvertise") < 0) {
		return NULL;
	}
	json_array_begin(&t.json, "channelIds");
	for (size_t i = 0; i < count; i++) {
		json_u64(&t.json, NULL, source_slave_channel(session, i));
	}
	json_array_end(&t.json);
	return text_end(&t);
}

char *foxglove_status(enum foxglove_level level, const char *message)
{
	struct text t = { .text = NULL };

	if (text_begin(&t, "status") < 0) {
		return NULL;
	}
	json_i64(&t.json, "level", level);
	json_text(&t.json, "message", message);
	return text_end(&t);
}

void foxglove_message_head(uint32_t subscription, int64_t time_ns,
			   uint8_t ret[FOXGLOVE_MESSAGE_HEAD_BYTES])
{
	ret[0] = MESSAGE_DATA;
	put_le32(ret + 1, subscription);
	put_le64(ret + 5, (uint64_t)time_ns);
}
