/* SPDX-License-Identifier: MIT */
#include "devices/coe_server.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "devices/coe_information.h"
#include "wire/coe.h"

/* One SDO request, taken apart. */
struct sdo {
	uint8_t command;
	uint16_t index;
	uint8_t subindex;
	const uint8_t *data; /* the four bytes, and what follows them */
	size_t data_len;
};

static void put_header(uint8_t *answer, uint8_t command, const struct sdo *sdo)
{
	memset(answer, 0, SDO_BYTES);
	put_le16(answer, COE_SDO_RESPONSE << COE_SERVICE_SHIFT);
	answer[SDO_COMMAND_AT] = command;
	put_le16(answer + SDO_INDEX_AT, sdo->index);
	answer[SDO_SUBINDEX_AT] = sdo->subindex;
}

static size_t answer_abort(uint8_t *answer, const struct sdo *sdo, enum coe_abort code)
{
	put_header(answer, SDO_ABORT, sdo);
	/* Captures: an abort comes as service 2, SDO request. */
	put_le16(answer, COE_SDO_REQUEST << COE_SERVICE_SHIFT);
	put_le32(answer + SDO_DATA_AT, (uint32_t)code);
	return SDO_BYTES;
}

/* --- upload --- */

/* Subindex 0 as 16 bits (if asked for), then the others one behind the other. */
static enum coe_abort gather(struct coe_server *server, const struct sdo *sdo)
{
	struct coe_value v;
	enum coe_abort code = coe_dictionary_read(&server->dictionary, sdo->index, 0, &v);
	uint8_t last = v.bytes[0];

	server->upload_len = 0;
	server->source = server->upload;
	if (code != COE_OK) {
		return code;
	}
	if (sdo->subindex > 1 || v.len != 1) {
		return COE_ABORT_ACCESS;
	}
	if (sdo->subindex == 0) {
		put_le16(server->upload, last);
		server->upload_len = 2;
	}
	for (unsigned i = 1; i <= last; i++) {
		code = coe_dictionary_read(&server->dictionary, sdo->index, (uint8_t)i, &v);
		if (code != COE_OK) {
			continue; /* a gap in the object */
		}
		if (server->upload_len + v.len > COE_UPLOAD_BYTES) {
			return COE_ABORT_LENGTH;
		}
		memcpy(server->upload + server->upload_len, v.bytes, v.len);
		server->upload_len += v.len;
	}
	return COE_OK;
}

static int is_memory(const struct coe_server *server, uint16_t index, uint8_t subindex)
{
	return server->memory != NULL && index == COE_MEMORY_INDEX &&
	       subindex == COE_MEMORY_SUBINDEX;
}

static enum coe_abort fetch(struct coe_server *server, const struct sdo *sdo)
{
	struct coe_value v;
	enum coe_abort code;

	if (is_memory(server, sdo->index, sdo->subindex)) {
		server->source = server->memory;
		server->upload_len = server->memory_len;
		return COE_OK;
	}
	server->source = server->upload;
	if (sdo->command & SDO_COMPLETE_ACCESS) {
		return gather(server, sdo);
	}
	code = coe_dictionary_read(&server->dictionary, sdo->index, sdo->subindex, &v);
	if (code == COE_OK) {
		memcpy(server->upload, v.bytes, v.len);
		server->upload_len = v.len;
	}
	return code;
}

static size_t upload(struct coe_server *server, const struct sdo *sdo, uint8_t *answer,
		     size_t capacity)
{
	enum coe_abort code = fetch(server, sdo);
	uint8_t access = sdo->command & SDO_COMPLETE_ACCESS;
	size_t now;

	server->upload_pos = 0;
	server->toggle = 0;
	if (code != COE_OK) {
		server->upload_len = 0;
		return answer_abort(answer, sdo, code);
	}
	if (server->upload_len > 0 && server->upload_len <= 4) {
		put_header(answer,
			   (uint8_t)(SDO_UPLOAD | access | SDO_EXPEDITED | SDO_SIZE_INDICATED |
				     (SDO_EXPEDITED_BYTES - server->upload_len)
					     << SDO_EXPEDITED_SHIFT),
			   sdo);
		memcpy(answer + SDO_DATA_AT, server->source, server->upload_len);
		server->upload_pos = server->upload_len;
		return SDO_BYTES;
	}
	put_header(answer, (uint8_t)(SDO_UPLOAD | access | SDO_SIZE_INDICATED), sdo);
	put_le32(answer + SDO_DATA_AT, (uint32_t)server->upload_len);
	now = server->upload_len < capacity - SDO_BYTES ? server->upload_len : capacity - SDO_BYTES;
	memcpy(answer + SDO_BYTES, server->source, now);
	server->upload_pos = now;
	return SDO_BYTES + now;
}

static size_t upload_segment(struct coe_server *server, const struct sdo *sdo, uint8_t *answer,
			     size_t capacity)
{
	size_t left = server->upload_len - server->upload_pos;
	size_t now = left < capacity - SDO_SEGMENT_AT ? left : capacity - SDO_SEGMENT_AT;
	uint8_t command = sdo->command & SDO_TOGGLE;

	if (left == 0) {
		return answer_abort(answer, sdo, COE_ABORT_COMMAND);
	}
	if (command != server->toggle) {
		return answer_abort(answer, sdo, COE_ABORT_TOGGLE);
	}
	server->toggle ^= SDO_TOGGLE;
	memset(answer, 0, SDO_SEGMENT_AT + SDO_SEGMENT_MIN);
	put_le16(answer, COE_SDO_RESPONSE << COE_SERVICE_SHIFT);
	memcpy(answer + SDO_SEGMENT_AT, server->source + server->upload_pos, now);
	server->upload_pos += now;
	command |= server->upload_pos == server->upload_len ? SDO_LAST_SEGMENT : 0;
	/* A short segment is filled up, and says by how much. */
	command |=
		(uint8_t)(now < SDO_SEGMENT_MIN ? (SDO_SEGMENT_MIN - now) << SDO_UNUSED_SHIFT : 0);
	answer[SDO_COMMAND_AT] = command;
	return SDO_SEGMENT_AT + (now < SDO_SEGMENT_MIN ? SDO_SEGMENT_MIN : now);
}

/* --- download --- */

/* An assignment as a whole: its count, and the PDOs from there. */
static enum coe_abort write_all(struct coe_dictionary *d, const struct sdo *sdo,
				const uint8_t *bytes, size_t len)
{
	uint8_t none = 0;
	uint8_t count;
	enum coe_abort code;

	if (sdo->subindex != 0 || len < 1) {
		return COE_ABORT_ACCESS;
	}
	count = bytes[0];
	if (len < 2 + 2u * count && count > 0) {
		return COE_ABORT_LENGTH;
	}
	code = coe_dictionary_write(d, sdo->index, 0, &none, 1);
	for (unsigned i = 0; code == COE_OK && i < count; i++) {
		code = coe_dictionary_write(d, sdo->index, (uint8_t)(i + 1),
					    bytes + 2 + (size_t)2 * i, 2);
	}
	return code == COE_OK ? coe_dictionary_write(d, sdo->index, 0, &count, 1) : code;
}

static enum coe_abort write_whole(struct coe_server *server, const struct sdo *sdo,
				  const uint8_t *bytes, size_t len)
{
	server->downloads++;
	if (is_memory(server, sdo->index, sdo->subindex)) {
		memmove(server->memory, bytes, len);
		server->memory_len = len;
		return COE_OK;
	}
	if (sdo->command & SDO_COMPLETE_ACCESS) {
		return write_all(&server->dictionary, sdo, bytes, len);
	}
	return coe_dictionary_write(&server->dictionary, sdo->index, sdo->subindex, bytes, len);
}

/* What does not fit into one mail: the rest comes in segments. */
static size_t begin_segments(struct coe_server *server, const struct sdo *sdo, const uint8_t *bytes,
			     size_t len, uint8_t *answer)
{
	int is_large = is_memory(server, sdo->index, sdo->subindex);
	size_t now = sdo->data_len - 4;

	if (len > (is_large ? (size_t)COE_MEMORY_BYTES : sizeof(server->download))) {
		return answer_abort(answer, sdo, COE_ABORT_LENGTH);
	}
	server->target = is_large ? server->memory : server->download;
	memcpy(server->target, bytes, now);
	server->download_len = len;
	server->download_pos = now;
	server->download_command = sdo->command;
	server->toggle = 0;
	put_header(answer, SDO_DOWNLOADED | (sdo->command & SDO_COMPLETE_ACCESS), sdo);
	return SDO_BYTES;
}

static size_t download_segment(struct coe_server *server, const uint8_t *request,
			       size_t request_len, uint8_t *answer)
{
	struct sdo sdo = { .command = server->download_command,
			   .index = server->index,
			   .subindex = server->subindex };
	uint8_t command = request[SDO_COMMAND_AT];
	size_t left = server->download_len - server->download_pos;
	size_t now = request_len - SDO_SEGMENT_AT;
	enum coe_abort code;

	if (now == SDO_SEGMENT_MIN) {
		now -= command >> SDO_UNUSED_SHIFT & SDO_UNUSED_MASK;
	}
	if (server->target == NULL) {
		return answer_abort(answer, &sdo, COE_ABORT_COMMAND);
	}
	if ((command & SDO_TOGGLE) != server->toggle || now > left ||
	    (now == left) != (command & SDO_LAST_SEGMENT)) {
		server->target = NULL;
		return answer_abort(answer, &sdo,
				    (command & SDO_TOGGLE) != server->toggle ? COE_ABORT_TOGGLE
									     : COE_ABORT_LENGTH);
	}
	memcpy(server->target + server->download_pos, request + SDO_SEGMENT_AT, now);
	server->download_pos += now;
	server->toggle ^= SDO_TOGGLE;
	if (now == left) {
		code = write_whole(server, &sdo, server->target, server->download_len);
		server->target = NULL;
		if (code != COE_OK) {
			return answer_abort(answer, &sdo, code);
		}
	}
	memset(answer, 0, SDO_BYTES);
	put_le16(answer, COE_SDO_RESPONSE << COE_SERVICE_SHIFT);
	answer[SDO_COMMAND_AT] = (uint8_t)(SDO_SEGMENT_DOWNLOADED | (command & SDO_TOGGLE));
	return SDO_BYTES;
}

static size_t download(struct coe_server *server, const struct sdo *sdo, uint8_t *answer)
{
	const uint8_t *bytes = sdo->data;
	size_t len = 4;
	enum coe_abort code;

	if (sdo->command & SDO_EXPEDITED) {
		len = sdo->command & SDO_SIZE_INDICATED
			      ? 4u - (sdo->command >> SDO_EXPEDITED_SHIFT & SDO_EXPEDITED_MASK)
			      : 4;
	} else {
		len = get_le32(bytes);
		bytes += 4;
		if (len > sdo->data_len - 4) {
			return begin_segments(server, sdo, bytes, len, answer);
		}
	}
	code = write_whole(server, sdo, bytes, len);
	if (code != COE_OK) {
		return answer_abort(answer, sdo, code);
	}
	put_header(answer, SDO_DOWNLOADED | (sdo->command & SDO_COMPLETE_ACCESS), sdo);
	return SDO_BYTES;
}

/* A new transfer ends the one before. */
static void begin(struct coe_server *server, const struct sdo *sdo)
{
	server->index = sdo->index;
	server->subindex = sdo->subindex;
	server->target = NULL;
}

size_t coe_server_abort(struct coe_server *server, uint8_t *answer)
{
	const struct sdo sdo = { .index = server->index, .subindex = server->subindex };

	server->target = NULL;
	server->upload_len = server->upload_pos = 0;
	return answer_abort(answer, &sdo, COE_ABORT_GENERAL);
}

int coe_server_set(struct coe_server *server, const char *key, const char *value)
{
	char *end;
	unsigned long bytes = strtoul(value, &end, 0);

	if (strcmp(key, "memory") != 0 || *end != '\0' || bytes == 0 || bytes > COE_MEMORY_BYTES) {
		return -EINVAL;
	}
	if (server->memory == NULL) {
		server->memory = malloc(COE_MEMORY_BYTES);
		if (server->memory == NULL) {
			return -ENOMEM;
		}
	}
	server->memory_len = bytes;
	for (size_t i = 0; i < bytes; i++) {
		server->memory[i] = (uint8_t)(i ^ i >> 8 ^ i >> 16);
	}
	return 0;
}

void coe_server_done(struct coe_server *server)
{
	free(server->memory);
	server->memory = NULL;
}

size_t coe_server_answer(struct coe_server *server, const uint8_t *request, size_t request_len,
			 uint8_t *answer, size_t capacity)
{
	struct sdo sdo = { .command = 0 };
	unsigned service;

	if (request_len < 2 || capacity < SDO_BYTES) {
		return 0;
	}
	service = get_le16(request) >> COE_SERVICE_SHIFT;
	if (service == COE_SDO_INFORMATION) {
		return coe_information_answer(&server->dictionary, request, request_len, answer,
					      capacity);
	}
	if (service != COE_SDO_REQUEST || request_len < SDO_BYTES) {
		return 0;
	}
	sdo.command = request[SDO_COMMAND_AT];
	sdo.index = get_le16(request + SDO_INDEX_AT);
	sdo.subindex = request[SDO_SUBINDEX_AT];
	sdo.data = request + SDO_DATA_AT;
	sdo.data_len = request_len - SDO_DATA_AT;
	switch (sdo.command & SDO_SPECIFIER) {
	case SDO_DOWNLOAD_SEGMENT:
		return download_segment(server, request, request_len, answer);
	case SDO_DOWNLOAD:
		begin(server, &sdo);
		return download(server, &sdo, answer);
	case SDO_UPLOAD:
		begin(server, &sdo);
		return upload(server, &sdo, answer, capacity);
	case SDO_UPLOAD_SEGMENT:
		return upload_segment(server, &sdo, answer, capacity);
	case SDO_ABORT:
		server->upload_len = server->upload_pos = 0;
		server->target = NULL;
		return 0;
	default: /* three bits of the wire */
		return answer_abort(answer, &sdo, COE_ABORT_COMMAND);
	}
}
