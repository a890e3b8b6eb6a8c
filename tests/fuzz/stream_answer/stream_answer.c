/* SPDX-License-Identifier: MIT */
/* Bytes as the answer of a NATS server, and as the text of a header. Whatever they are: no crash,
 * and what is taken from them is within its bounds. */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "stream/ack.h"
#include "stream/mark.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct mark mark = { .has = 0 };
	struct ack ack;
	char text[64] = "";

	ack_parse((const char *)data, size, &ack);
	if (memchr(ack.reason, '\0', sizeof(ack.reason)) == NULL ||
	    (ack.result == ACK_STORED && ack.sequence == 0)) {
		abort();
	}
	memcpy(text, data, size < sizeof(text) ? size : sizeof(text) - 1);
	mark_take(&mark, MARK_SESSION, text);
	if (mark_has(&mark, MARK_SESSION)) {
		char again[MARK_TEXT_BYTES];

		mark_format(&mark, MARK_SESSION, again);
		if (strlen(again) > strlen(text)) {
			abort();
		}
	}
	return 0;
}
