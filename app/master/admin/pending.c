/* SPDX-License-Identifier: MIT */
#include "admin/pending.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void admin_pending_complete(struct admin_pending *pending, int result)
{
	pending->reply.result = result;
	if (result < 0) {
		pending->reply.data_len = 0;
		pending->answer_len = 0;
		if (pending->reply.text[0] == '\0') {
			snprintf(pending->reply.text, sizeof(pending->reply.text), "%s",
				 strerror(-result));
		}
	}
	pending->has_progress = 0;
	pending->state = ADMIN_PENDING_COMPLETE;
}

void admin_pending_refuse(struct admin_pending *pending, int result, const char *format, ...)
{
	va_list args;

	va_start(args, format);
	vsnprintf(pending->reply.text, sizeof(pending->reply.text), format, args);
	va_end(args);
	admin_pending_complete(pending, result);
}

void admin_pending_progress(struct admin_pending *pending, uint32_t done, uint32_t total)
{
	pending->reply.done = done;
	pending->reply.total = total;
	pending->has_progress = 1;
}

uint8_t *admin_pending_reserve(struct admin_pending *pending, size_t bytes)
{
	uint8_t *room =
		bytes == 0 || bytes > ADMIN_TRANSFER_BYTES ? NULL : realloc(pending->answer, bytes);

	if (room != NULL) {
		pending->answer = room;
	}
	return room;
}

void admin_pending_answer_len(struct admin_pending *pending, size_t bytes)
{
	pending->answer_len = bytes;
}

int admin_pending_init(struct admin_pending *pending, const struct admin_request *request,
		       uint32_t uid)
{
	*pending = (struct admin_pending){
		.request = *request,
		.data_len = request->data_len,
		.uid = uid,
		.reply = { .magic = ADMIN_MAGIC, .id = request->id },
		.state = ADMIN_PENDING_OPEN,
	};
	pending->data = pending->request.data;
	if (request->data_total <= request->data_len) {
		return 0;
	}
	pending->upload = malloc(request->data_total);
	if (pending->upload == NULL) {
		pending->state = ADMIN_PENDING_FREE;
		return -ENOMEM;
	}
	memcpy(pending->upload, request->data, request->data_len);
	pending->data = pending->upload;
	pending->state = ADMIN_PENDING_COLLECTING;
	return 0;
}

int admin_pending_collect(struct admin_pending *pending, const struct admin_request *more)
{
	if (pending->state != ADMIN_PENDING_COLLECTING || more->data_offset != pending->data_len ||
	    more->data_len > pending->request.data_total - pending->data_len) {
		return -EINVAL;
	}
	memcpy(pending->upload + pending->data_len, more->data, more->data_len);
	pending->data_len += more->data_len;
	if (pending->data_len == pending->request.data_total) {
		pending->state = ADMIN_PENDING_OPEN;
	}
	return 0;
}

void admin_pending_next(const struct admin_pending *pending, struct admin_reply *ret_message)
{
	size_t left = pending->answer_len - pending->sent;

	*ret_message = pending->reply;
	ret_message->kind = ADMIN_REPLY_DONE;
	if (pending->answer == NULL) {
		ret_message->data_total = ret_message->data_len;
		return;
	}
	if (left > ADMIN_DATA_BYTES) {
		left = ADMIN_DATA_BYTES;
		ret_message->kind = ADMIN_REPLY_DATA;
	}
	memcpy(ret_message->data, pending->answer + pending->sent, left);
	ret_message->data_len = (uint32_t)left;
	ret_message->data_offset = (uint32_t)pending->sent;
	ret_message->data_total = (uint32_t)pending->answer_len;
}

int admin_pending_has_sent(struct admin_pending *pending, const struct admin_reply *message)
{
	pending->sent += message->data_len;
	return message->kind == ADMIN_REPLY_DONE;
}

void admin_pending_release(struct admin_pending *pending)
{
	free(pending->upload);
	free(pending->answer);
	pending->upload = NULL;
	pending->answer = NULL;
	pending->client = NULL;
	pending->state = ADMIN_PENDING_FREE;
}
