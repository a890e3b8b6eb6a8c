/* SPDX-License-Identifier: MIT */
#include "devices/voe_server.h"

#include <string.h>

#include "wire/voe.h"

size_t voe_server_answer(void *ctx, const struct mailbox_call *call)
{
	(void)ctx;
	if (call->request_len < VOE_HEADER_BYTES || call->request_len > call->capacity) {
		return 0;
	}
	memcpy(call->answer, call->request, call->request_len);
	return call->request_len;
}
