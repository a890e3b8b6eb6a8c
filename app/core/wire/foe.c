/* SPDX-License-Identifier: MIT */
#include "wire/foe.h"

#include <errno.h>
#include <string.h>

#include "base/bytes.h"

int foe_parse(const uint8_t *data, size_t data_len, struct foe_message *ret)
{
	struct foe_message m = { .operation = 0 };

	if (data_len < FOE_HEADER_BYTES || data[0] < FOE_READ || data[0] > FOE_BUSY) {
		return -EBADMSG;
	}
	m.operation = data[0];
	if (m.operation == FOE_BUSY) {
		m.busy_done = get_le16(data + 2);
		m.busy_all = get_le16(data + 4);
	} else {
		m.number = get_le32(data + 2);
	}
	if (m.operation != FOE_ACK) {
		m.body = data + FOE_HEADER_BYTES;
		m.body_len = data_len - FOE_HEADER_BYTES;
	}
	*ret = m;
	return 0;
}

size_t foe_format(const struct foe_message *m, uint8_t *data, size_t capacity)
{
	if (capacity < FOE_HEADER_BYTES || m->body_len > capacity - FOE_HEADER_BYTES) {
		return 0;
	}
	data[0] = m->operation;
	data[1] = 0;
	if (m->operation == FOE_BUSY) {
		put_le16(data + 2, m->busy_done);
		put_le16(data + 4, m->busy_all);
	} else {
		put_le32(data + 2, m->number);
	}
	if (m->body_len > 0) {
		memcpy(data + FOE_HEADER_BYTES, m->body, m->body_len);
	}
	return FOE_HEADER_BYTES + m->body_len;
}

const char *foe_error_to_str(uint32_t code)
{
	static const struct {
		uint32_t code;
		const char *text;
	} texts[] = {
		{ FOE_ERROR_NOT_DEFINED, "not defined" },
		{ FOE_ERROR_NOT_FOUND, "file not found" },
		{ FOE_ERROR_ACCESS_DENIED, "access denied" },
		{ FOE_ERROR_DISK_FULL, "disk full" },
		{ FOE_ERROR_ILLEGAL, "illegal operation" },
		{ FOE_ERROR_PACKET_NUMBER, "wrong packet number" },
		{ FOE_ERROR_EXISTS, "file already exists" },
		{ FOE_ERROR_NO_USER, "no such user" },
		{ FOE_ERROR_BOOTSTRAP_ONLY, "only in state BOOT" },
		{ FOE_ERROR_NOT_IN_BOOTSTRAP, "not in state BOOT" },
		{ FOE_ERROR_NO_RIGHTS, "no access rights" },
		{ FOE_ERROR_PROGRAM, "program error" },
		{ FOE_ERROR_CHECKSUM, "wrong checksum" },
		{ FOE_ERROR_FIRMWARE, "firmware does not fit the hardware" },
		{ FOE_ERROR_NO_FILE, "no file to read" },
		{ FOE_ERROR_NO_HEADER, "file has no header" },
		{ FOE_ERROR_FLASH, "flash error" },
	};

	for (size_t i = 0; i < sizeof(texts) / sizeof(texts[0]); i++) {
		if (texts[i].code == code) {
			return texts[i].text;
		}
	}
	return "unknown error";
}
