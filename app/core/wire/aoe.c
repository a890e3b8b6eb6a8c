/* SPDX-License-Identifier: MIT */
#include "wire/aoe.h"

#include <errno.h>
#include <string.h>

#include "base/bytes.h"
#include "wire/sdo_abort.h"

static struct aoe_address get_address(const uint8_t *p)
{
	struct aoe_address a;

	memcpy(a.net_id, p, AOE_NET_ID_BYTES);
	a.port = get_le16(p + AOE_NET_ID_BYTES);
	return a;
}

static void put_address(uint8_t *p, const struct aoe_address *a)
{
	memcpy(p, a->net_id, AOE_NET_ID_BYTES);
	put_le16(p + AOE_NET_ID_BYTES, a->port);
}

int aoe_header_get(const uint8_t *data, size_t data_len, struct aoe_header *ret)
{
	if (data_len < AOE_HEADER_BYTES || get_le32(data + 20) > data_len - AOE_HEADER_BYTES) {
		return -EBADMSG;
	}
	*ret = (struct aoe_header){ .target = get_address(data),
				    .source = get_address(data + 8),
				    .command = get_le16(data + 16),
				    .flags = get_le16(data + 18),
				    .data_len = get_le32(data + 20),
				    .error = get_le32(data + 24),
				    .invoke_id = get_le32(data + 28) };
	return 0;
}

void aoe_header_put(uint8_t *data, const struct aoe_header *h)
{
	put_address(data, &h->target);
	put_address(data + 8, &h->source);
	put_le16(data + 16, h->command);
	put_le16(data + 18, h->flags);
	put_le32(data + 20, h->data_len);
	put_le32(data + 24, h->error);
	put_le32(data + 28, h->invoke_id);
}

const char *aoe_error_to_str(uint32_t code)
{
	static const struct {
		uint16_t code;
		const char *text;
	} texts[] = {
		{ 0x0006, "target port not found" },
		{ 0x0007, "target machine not found" },
		{ 0x0008, "unknown command" },
		{ 0x000e, "invalid length" },
		{ 0x0012, "port disabled" },
		{ 0x0700, "device error" },
		{ AOE_ERROR_SERVICE, "service not supported" },
		{ AOE_ERROR_GROUP, "invalid index group" },
		{ 0x0703, "invalid index offset" },
		{ 0x0704, "reading or writing not permitted" },
		{ AOE_ERROR_SIZE, "wrong parameter size" },
		{ 0x0706, "invalid parameter value" },
		{ 0x0707, "device not ready" },
		{ 0x0708, "device busy" },
		{ 0x070a, "out of memory" },
		{ 0x070b, "invalid parameter" },
		{ 0x070c, "not found" },
		{ 0x0710, "not initialised" },
		{ 0x0712, "device in invalid state" },
		{ 0x0719, "device time-out" },
		{ 0x0723, "access denied" },
	};

	if (code > UINT16_MAX) {
		return sdo_abort_to_str(code);
	}
	for (size_t i = 0; i < sizeof(texts) / sizeof(texts[0]); i++) {
		if (texts[i].code == code) {
			return texts[i].text;
		}
	}
	return "unknown error";
}

int aoe_net_id_parse(const char *text, uint8_t ret_net_id[AOE_NET_ID_BYTES])
{
	uint8_t id[AOE_NET_ID_BYTES] = { 0 };
	const char *p = text;

	for (size_t i = 0; i < AOE_NET_ID_BYTES && *text != '\0'; i++) {
		unsigned value = 0;
		unsigned digits = 0;

		for (; *p >= '0' && *p <= '9' && digits < 3; p++, digits++) {
			value = value * 10 + (unsigned)(*p - '0');
		}
		if (digits == 0 || value > UINT8_MAX ||
		    *p != (i + 1 < AOE_NET_ID_BYTES ? '.' : '\0')) {
			return -EINVAL;
		}
		id[i] = (uint8_t)value;
		p++;
	}
	memcpy(ret_net_id, id, sizeof(id));
	return 0;
}
