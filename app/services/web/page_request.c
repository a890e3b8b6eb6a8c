/* SPDX-License-Identifier: MIT */
#include <cjson/cJSON.h>
#include <errno.h>
#include <math.h>
#include <string.h>

#include "web/page.h"

#define CYCLE_MAX (UINT64_C(1) << 53) /* exact in a JSON number */

static int get_number(const cJSON *root, const char *name, uint64_t max, uint64_t *ret)
{
	const cJSON *value = cJSON_GetObjectItemCaseSensitive(root, name);
	double number = cJSON_IsNumber(value) ? value->valuedouble : -1;

	if (!(number >= 0 && number <= (double)max) || floor(number) != number) {
		return -EBADMSG;
	}
	*ret = (uint64_t)number;
	return 0;
}

static int get_u32(const cJSON *root, const char *name, uint32_t *ret)
{
	uint64_t number;
	int r = get_number(root, name, UINT32_MAX, &number);

	*ret = r < 0 ? 0 : (uint32_t)number;
	return r;
}

static int get_channels(const cJSON *root, struct history_request *ret)
{
	const cJSON *list = cJSON_GetObjectItemCaseSensitive(root, "channels");
	const cJSON *value;

	ret->count = 0;
	if (!cJSON_IsArray(list)) {
		return -EBADMSG;
	}
	cJSON_ArrayForEach(value, list)
	{
		if (ret->count == HISTORY_CHANNELS || !cJSON_IsNumber(value) ||
		    !(value->valuedouble >= 0 && value->valuedouble <= UINT32_MAX)) {
			return -EBADMSG;
		}
		ret->channel[ret->count++] = (uint32_t)value->valuedouble;
	}
	return 0;
}

static int get_level(const cJSON *root, const char *name, double *ret)
{
	const cJSON *value = cJSON_GetObjectItemCaseSensitive(root, name);

	if (!cJSON_IsNumber(value)) {
		return -EBADMSG;
	}
	*ret = value->valuedouble;
	return 0;
}

static int get_optional(const cJSON *root, const char *name, uint64_t max, uint64_t *ret)
{
	return cJSON_GetObjectItemCaseSensitive(root, name) == NULL
		       ? 0
		       : get_number(root, name, max, ret);
}

static int get_kind(const char *name, enum trigger_kind *ret)
{
	for (int i = TRIGGER_NONE; i < TRIGGER_KINDS; i++) {
		enum trigger_kind kind = (enum trigger_kind)i;

		if (name == NULL || strcmp(name, trigger_kind_to_str(kind)) == 0) {
			*ret = kind;
			return 0;
		}
	}
	return -EBADMSG;
}

static int has_level(enum trigger_kind kind)
{
	return kind >= TRIGGER_RISING && kind <= TRIGGER_LEAVES;
}

static int get_trigger(const cJSON *root, struct page_request *request)
{
	struct trigger *ret = &request->draw.trigger;
	const char *name = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(root, "edge"));
	int r = get_kind(name, &ret->kind);

	if (r < 0 || ret->kind == TRIGGER_NONE) {
		return r;
	}
	r = get_number(root, "before", HISTORY_CYCLES, &ret->before);
	r = r < 0 ? r : get_optional(root, "hold", HISTORY_CYCLES, &ret->hold);
	r = r < 0 ? r : get_optional(root, "last", CYCLE_MAX, &ret->last);
	if (r == 0 && ret->kind == TRIGGER_EVENT) {
		const cJSON *severity = cJSON_GetObjectItemCaseSensitive(root, "severity");

		r = event_severity_parse(cJSON_GetStringValue(severity), &request->severity) < 0
			    ? -EBADMSG
			    : 0;
	}
	r = r < 0 || !trigger_has_channel(ret) ? r : get_u32(root, "trigger", &ret->channel);
	r = r < 0 || !has_level(ret->kind) ? r : get_level(root, "level", &ret->level);
	return r < 0 || (ret->kind != TRIGGER_ENTERS && ret->kind != TRIGGER_LEAVES)
		       ? r
		       : get_level(root, "level2", &ret->level2);
}

static int get_draw(const cJSON *root, struct page_request *ret)
{
	struct history_request *draw = &ret->draw;
	int r = get_u32(root, "id", &ret->id);

	*draw = (struct history_request){ .count = 0 };
	r = r < 0 ? r : get_number(root, "cycles", HISTORY_CYCLES, &draw->cycles);
	r = r < 0 ? r : get_u32(root, "pixels", &draw->pixels);
	r = r < 0 ? r : get_number(root, "end", CYCLE_MAX, &draw->end);
	r = r < 0 ? r : get_channels(root, draw);
	return r < 0 ? r : get_trigger(root, ret);
}

static int get_bus(const cJSON *root, struct page_request *ret)
{
	ret->has_slave = cJSON_GetObjectItemCaseSensitive(root, "slave") != NULL;
	return ret->has_slave ? get_u32(root, "slave", &ret->slave) : 0;
}

static int get_request(const cJSON *root, struct page_request *ret)
{
	static const char *const names[] = {
		[PAGE_VALUES] = "values", [PAGE_DRAW] = "draw",   [PAGE_RECORDINGS] = "recordings",
		[PAGE_BUS] = "bus",       [PAGE_FOLDS] = "folds",
	};
	const char *op = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(root, "op"));
	size_t count = sizeof(names) / sizeof(names[0]);
	size_t i = 0;

	while (op != NULL && i < count && strcmp(op, names[i]) != 0) {
		i++;
	}
	if (op == NULL || i == count) {
		return -EBADMSG;
	}
	ret->op = (enum page_op)i;
	ret->is_on = cJSON_IsTrue(cJSON_GetObjectItemCaseSensitive(root, "on"));
	return ret->op == PAGE_DRAW  ? get_draw(root, ret)
	       : ret->op == PAGE_BUS ? get_bus(root, ret)
				     : 0;
}

int page_parse(const char *text, size_t len, struct page_request *ret)
{
	cJSON *root = len > PAGE_REQUEST_BYTES ? NULL : cJSON_ParseWithLength(text, len);
	int r = get_request(root, ret);

	cJSON_Delete(root);
	return r;
}

void page_add_events(struct page_request *request, const struct event_log *log,
		     uint64_t cycle[EVENT_LOG_EVENTS])
{
	struct trigger *trigger = &request->draw.trigger;

	if (request->op == PAGE_DRAW && trigger->kind == TRIGGER_EVENT) {
		trigger->events = cycle;
		trigger->event_count = event_log_cycles(log, request->severity, cycle);
	}
}
