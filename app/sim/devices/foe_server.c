/* SPDX-License-Identifier: MIT */
#include "devices/foe_server.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "wire/foe.h"

static size_t put(const struct mailbox_call *call, const struct foe_message *m)
{
	return foe_format(m, call->answer, call->capacity);
}

static void end_transfer(struct foe_server *s)
{
	free(s->incoming.bytes);
	s->incoming = (struct foe_file){ .len = 0 };
	s->outgoing = NULL;
	s->transfer = FOE_TRANSFER_NONE;
}

static size_t fail(struct foe_server *s, const struct mailbox_call *call, enum foe_error code,
		   const char *text)
{
	end_transfer(s);
	return put(call, &(struct foe_message){ .operation = FOE_ERROR,
						.number = (uint32_t)code,
						.body = (const uint8_t *)text,
						.body_len = strlen(text) });
}

/* The packet that comes next: taken and given after so many BUSY answers. */
static void expect_packet(struct foe_server *s, uint32_t packet)
{
	s->packet = packet;
	s->busy_left = s->busy;
}

static int is_busy(struct foe_server *s)
{
	if (s->busy_left > 0) {
		s->busy_left--;
		return 1;
	}
	return s->busy_left < 0;
}

static size_t answer_busy(const struct foe_server *s, const struct mailbox_call *call)
{
	static const char text[] = "erasing";
	int all = s->busy > 0 ? s->busy : 100;
	int done = s->busy > 0 ? s->busy - s->busy_left : 0;

	return put(call, &(struct foe_message){ .operation = FOE_BUSY,
						.busy_done = (uint16_t)done,
						.busy_all = (uint16_t)all,
						.body = (const uint8_t *)text,
						.body_len = sizeof(text) - 1 });
}

/* --- write --- */

static size_t acknowledge(struct foe_server *s, const struct mailbox_call *call, uint32_t packet)
{
	expect_packet(s, packet);
	return put(call, &(struct foe_message){ .operation = FOE_ACK, .number = packet });
}

static int store(struct foe_server *s)
{
	struct foe_file *place = NULL;

	for (size_t i = 0; i < FOE_SERVER_FILES; i++) {
		if (strcmp(s->file[i].name, s->incoming.name) == 0) {
			place = &s->file[i];
			break;
		}
		if (place == NULL && s->file[i].name[0] == '\0') {
			place = &s->file[i];
		}
	}
	if (place == NULL) {
		return -ENOSPC;
	}
	free(place->bytes);
	*place = s->incoming;
	s->incoming = (struct foe_file){ .len = 0 };
	return 0;
}

static int append(struct foe_file *file, const struct foe_message *m)
{
	uint8_t *bytes;

	if (file->len + m->body_len > FOE_SERVER_FILE_BYTES) {
		return -ENOSPC;
	}
	bytes = realloc(file->bytes, file->len + m->body_len + 1);
	if (bytes == NULL) {
		return -ENOSPC;
	}
	if (m->body_len > 0) {
		memcpy(bytes + file->len, m->body, m->body_len);
	}
	file->bytes = bytes;
	file->len += m->body_len;
	return 0;
}

static size_t take_data(struct foe_server *s, const struct mailbox_call *call,
			const struct foe_message *m)
{
	if (s->transfer != FOE_TRANSFER_WRITE) {
		return fail(s, call, FOE_ERROR_ILLEGAL, "no write is open");
	}
	if (m->number == s->packet && s->packet != 0) {
		return put(call,
			   &(struct foe_message){ .operation = FOE_ACK, .number = s->packet });
	}
	if (m->number != s->packet + 1) {
		return fail(s, call, FOE_ERROR_PACKET_NUMBER, "packet number");
	}
	if (m->number == s->fail_at) {
		return fail(s, call, FOE_ERROR_FLASH, "sector 7 is worn out");
	}
	if (is_busy(s)) {
		return answer_busy(s, call);
	}
	if (append(&s->incoming, m) < 0) {
		return fail(s, call, FOE_ERROR_DISK_FULL, "file too long");
	}
	/* A packet that does not fill the mailbox is the last. */
	if (m->body_len < call->request_capacity - FOE_HEADER_BYTES) {
		size_t len = acknowledge(s, call, m->number);

		if (store(s) < 0) {
			return fail(s, call, FOE_ERROR_DISK_FULL, "no place for another file");
		}
		end_transfer(s);
		return len;
	}
	return acknowledge(s, call, m->number);
}

/* --- read --- */

static size_t give_data(struct foe_server *s, const struct mailbox_call *call)
{
	size_t room = call->capacity - FOE_HEADER_BYTES;
	size_t left = s->outgoing->len - s->pos;

	s->given = left < room ? left : room;
	s->has_full = s->given == room;
	return put(call, &(struct foe_message){ .operation = FOE_DATA,
						.number = s->packet,
						.body = s->outgoing->bytes + s->pos,
						.body_len = s->given });
}

static size_t take_ack(struct foe_server *s, const struct mailbox_call *call,
		       const struct foe_message *m)
{
	if (s->transfer != FOE_TRANSFER_READ) {
		return 0; /* late: nothing goes on */
	}
	if (m->number != s->packet) {
		return fail(s, call, FOE_ERROR_PACKET_NUMBER, "packet number");
	}
	if (!s->has_full) {
		end_transfer(s);
		return 0;
	}
	if (s->packet + 1 == s->fail_at) {
		return fail(s, call, FOE_ERROR_FLASH, "sector 7 is worn out");
	}
	if (is_busy(s)) {
		return answer_busy(s, call);
	}
	s->pos += s->given;
	expect_packet(s, s->packet + 1);
	return give_data(s, call);
}

/* --- opening --- */

static int is_allowed(const struct foe_server *s, const struct foe_message *m)
{
	return s->password == 0 || m->number == s->password;
}

static size_t open_file(struct foe_server *s, const struct mailbox_call *call,
			const struct foe_message *m)
{
	char name[FOE_SERVER_NAME_BYTES] = "";
	size_t len = m->body_len > 0 ? strnlen((const char *)m->body, m->body_len) : 0;

	end_transfer(s);
	if (len == 0 || len >= sizeof(name)) {
		return fail(s, call, FOE_ERROR_ILLEGAL, "file name");
	}
	memcpy(name, m->body, len);
	if (!is_allowed(s, m)) {
		return fail(s, call, FOE_ERROR_NO_RIGHTS, "password");
	}
	if (m->operation == FOE_READ) {
		s->outgoing = foe_server_find(s, name);
		if (s->outgoing == NULL) {
			return fail(s, call, FOE_ERROR_NOT_FOUND, name);
		}
		s->transfer = FOE_TRANSFER_READ;
		s->pos = 0;
		expect_packet(s, 1);
		return give_data(s, call);
	}
	s->transfer = FOE_TRANSFER_WRITE;
	memcpy(s->incoming.name, name, sizeof(name));
	return acknowledge(s, call, 0);
}

/* --- public --- */

size_t foe_server_answer(void *ctx, const struct mailbox_call *call)
{
	struct foe_server *s = ctx;
	struct foe_message m;

	if (call->capacity < FOE_HEADER_BYTES + FOE_SERVER_NAME_BYTES / 2) {
		return 0;
	}
	if (foe_parse(call->request, call->request_len, &m) < 0) {
		return fail(s, call, FOE_ERROR_ILLEGAL, "no FoE request");
	}
	switch ((enum foe_operation)m.operation) {
	case FOE_READ:
	case FOE_WRITE:
		return open_file(s, call, &m);
	case FOE_DATA:
		return take_data(s, call, &m);
	case FOE_ACK:
		return take_ack(s, call, &m);
	case FOE_ERROR:
	case FOE_BUSY:
		end_transfer(s);
		return 0;
	}
	return 0;
}

void foe_server_reset(struct foe_server *s)
{
	end_transfer(s);
}

int foe_server_set(struct foe_server *s, const char *key, const char *value)
{
	char *end;
	long long number = strtoll(value, &end, 0);

	if (*value == '\0' || *end != '\0' || number < FOE_SERVER_BUSY_FOREVER ||
	    number > UINT32_MAX) {
		return -EINVAL;
	}
	if (strcmp(key, "password") == 0 && number >= 0) {
		s->password = (uint32_t)number;
	} else if (strcmp(key, "busy") == 0 && number <= UINT16_MAX) {
		s->busy = (int)number;
	} else if (strcmp(key, "fail_at") == 0 && number >= 0) {
		s->fail_at = (unsigned)number;
	} else {
		return -EINVAL;
	}
	return 0;
}

const struct foe_file *foe_server_find(const struct foe_server *s, const char *name)
{
	for (size_t i = 0; i < FOE_SERVER_FILES; i++) {
		if (name[0] != '\0' && strcmp(s->file[i].name, name) == 0) {
			return &s->file[i];
		}
	}
	return NULL;
}

void foe_server_done(struct foe_server *s)
{
	end_transfer(s);
	for (size_t i = 0; i < FOE_SERVER_FILES; i++) {
		free(s->file[i].bytes);
		s->file[i] = (struct foe_file){ .len = 0 };
	}
}
