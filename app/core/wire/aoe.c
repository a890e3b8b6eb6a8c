/* SPDX-License-Identifier: MIT */
#include "wire/aoe.h"

#include <errno.h>
#include <string.h>

#include "base/bytes.h"

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
