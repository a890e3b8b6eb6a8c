/* SPDX-License-Identifier: MIT */
#include "stream/ack.h"

#include <cjson/cJSON.h>
#include <stdio.h>

/* Numbers are double in cJSON: what a stream counts to stays exact below this. */
#define SEQUENCE_LIMIT 0x1p53

static void take_reason(const cJSON *error, struct ack *ret)
{
	const cJSON *text = cJSON_GetObjectItemCaseSensitive(error, "description");
	size_t n = 0;

	ret->result = ACK_REJECTED;
	snprintf(ret->reason, sizeof(ret->reason), "no reason given");
	if (!cJSON_IsString(text) || text->valuestring[0] == '\0') {
		return;
	}
	for (; text->valuestring[n] != '\0' && n < sizeof(ret->reason) - 1; n++) {
		char c = text->valuestring[n];

		ret->reason[n] = c;
		if (c < ' ' || c > '~') {
			ret->reason[n] = '?';
		}
	}
	ret->reason[n] = '\0';
}

void ack_parse(const char *text, size_t len, struct ack *ret)
{
	cJSON *json = cJSON_ParseWithLength(text, len);
	const cJSON *error = cJSON_GetObjectItemCaseSensitive(json, "error");
	const cJSON *sequence = cJSON_GetObjectItemCaseSensitive(json, "seq");

	*ret = (struct ack){ .result = ACK_INVALID };
	if (cJSON_IsObject(error)) {
		take_reason(error, ret);
	} else if (cJSON_IsNumber(sequence) && sequence->valuedouble >= 1 &&
		   sequence->valuedouble < SEQUENCE_LIMIT) {
		ret->sequence = (uint64_t)sequence->valuedouble;
		ret->result = cJSON_IsTrue(cJSON_GetObjectItemCaseSensitive(json, "duplicate"))
				      ? ACK_DUPLICATE
				      : ACK_STORED;
	}
	cJSON_Delete(json);
}
