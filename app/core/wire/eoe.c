/* SPDX-License-Identifier: MIT */
#include "wire/eoe.h"

#include <errno.h>
#include <string.h>

#include "base/bytes.h"

enum { LAST = 0x01, TIME_APPENDED = 0x02, TIME_BYTES = 4, FRAGMENT_MASK = 0x3f };

int eoe_header_get(const uint8_t *data, size_t data_len, struct eoe_header *ret)
{
	uint16_t word;

	if (data_len < EOE_HEADER_BYTES) {
		return -EBADMSG;
	}
	word = get_le16(data + 2);
	*ret = (struct eoe_header){ .type = data[0] & 0x0f,
				    .port = data[0] >> 4,
				    .is_last = data[1] & LAST,
				    .has_time = (data[1] & TIME_APPENDED) != 0,
				    .result = word,
				    .fragment = word & FRAGMENT_MASK,
				    .blocks = word >> 6 & FRAGMENT_MASK,
				    .frame_number = (uint8_t)(word >> 12) };
	return 0;
}

void eoe_header_put(uint8_t *data, const struct eoe_header *h)
{
	data[0] = (uint8_t)((h->type & 0x0f) | h->port << 4);
	data[1] = (uint8_t)((h->is_last ? LAST : 0) | (h->has_time ? TIME_APPENDED : 0));
	if (h->type == EOE_FRAGMENT) {
		put_le16(data + 2,
			 (uint16_t)((h->fragment & FRAGMENT_MASK) |
				    (h->blocks & FRAGMENT_MASK) << 6 | h->frame_number << 12));
	} else {
		put_le16(data + 2, h->result);
	}
}

/* --- IP parameters --- */

enum ip_layout {
	IP_MAC = 4,
	IP_ADDRESS = 10,
	IP_NETMASK = 14,
	IP_GATEWAY = 18,
	IP_DNS = 22,
	IP_NAME = 26
};

/* Addresses go as 32-bit numbers: the last byte first. */
static void turn(uint8_t *to, const uint8_t *from)
{
	for (unsigned i = 0; i < 4; i++) {
		to[i] = from[3 - i];
	}
}

int eoe_ip_get(const uint8_t *data, size_t data_len, struct eoe_ip *ret)
{
	uint8_t all[EOE_IP_BYTES] = { 0 };
	size_t needed = IP_MAC;
	static const uint8_t end[] = { IP_ADDRESS, IP_NETMASK, IP_GATEWAY, IP_DNS, IP_NAME };

	if (data_len < IP_MAC) {
		return -EBADMSG;
	}
	*ret = (struct eoe_ip){ .flags = get_le32(data) };
	for (unsigned i = 0; i < sizeof(end); i++) {
		if (ret->flags & 1u << i) {
			needed = end[i];
		}
	}
	if (data_len < needed || ((ret->flags & EOE_HAS_NAME) && data_len < IP_NAME)) {
		return -EBADMSG;
	}
	memcpy(all, data, data_len < sizeof(all) ? data_len : sizeof(all));
	memcpy(ret->mac, all + IP_MAC, sizeof(ret->mac));
	turn(ret->address, all + IP_ADDRESS);
	turn(ret->netmask, all + IP_NETMASK);
	turn(ret->gateway, all + IP_GATEWAY);
	turn(ret->dns, all + IP_DNS);
	memcpy(ret->name, all + IP_NAME, EOE_NAME_BYTES);
	return 0;
}

void eoe_ip_put(uint8_t *data, const struct eoe_ip *ip)
{
	memset(data, 0, EOE_IP_BYTES);
	put_le32(data, ip->flags);
	memcpy(data + IP_MAC, ip->mac, sizeof(ip->mac));
	turn(data + IP_ADDRESS, ip->address);
	turn(data + IP_NETMASK, ip->netmask);
	turn(data + IP_GATEWAY, ip->gateway);
	turn(data + IP_DNS, ip->dns);
	memcpy(data + IP_NAME, ip->name, EOE_NAME_BYTES);
}

/* --- frames --- */

static int drop(struct eoe_assembly *a)
{
	a->len = 0;
	a->next_fragment = 0;
	return -EBADMSG;
}

/* Does fragment @h of @len bytes follow what @a has? */
static int fits(const struct eoe_assembly *a, const struct eoe_header *h, size_t len)
{
	size_t pos = h->fragment == 0 ? 0 : (size_t)h->blocks * EOE_BLOCK_BYTES;

	return h->type == EOE_FRAGMENT && h->fragment == a->next_fragment && pos == a->len &&
	       (h->fragment == 0 || h->frame_number == a->frame_number) && len > 0 &&
	       len <= EOE_FRAME_MAX_BYTES - pos && (h->is_last || len % EOE_BLOCK_BYTES == 0);
}

int eoe_assemble(struct eoe_assembly *a, const uint8_t *data, size_t data_len)
{
	struct eoe_header h;
	size_t len;

	if (eoe_header_get(data, data_len, &h) < 0) {
		return drop(a);
	}
	if (h.fragment == 0) { /* a new frame, whatever became of the one before */
		a->len = 0;
		a->next_fragment = 0;
		a->frame_number = h.frame_number;
	}
	len = data_len - EOE_HEADER_BYTES;
	if (h.is_last && h.has_time) {
		len -= len < TIME_BYTES ? len : TIME_BYTES;
	}
	if (!fits(a, &h, len)) {
		return drop(a);
	}
	memcpy(a->frame + a->len, data + EOE_HEADER_BYTES, len);
	a->len += len;
	a->next_fragment = h.is_last ? 0 : (uint8_t)(h.fragment + 1);
	return h.is_last;
}

size_t eoe_split_next(struct eoe_split *s, uint8_t *data, size_t capacity)
{
	size_t left = s->len - s->pos;
	size_t room = (capacity - EOE_HEADER_BYTES) / EOE_BLOCK_BYTES * EOE_BLOCK_BYTES;
	size_t now = left < room ? left : room;
	size_t blocks = s->fragment == 0 ? (s->len + EOE_BLOCK_BYTES - 1) / EOE_BLOCK_BYTES
					 : s->pos / EOE_BLOCK_BYTES;

	if (now == 0) {
		return 0;
	}
	eoe_header_put(data, &(struct eoe_header){ .type = EOE_FRAGMENT,
						   .is_last = now == left,
						   .fragment = s->fragment,
						   .blocks = (uint8_t)blocks,
						   .frame_number = s->frame_number });
	memcpy(data + EOE_HEADER_BYTES, s->frame + s->pos, now);
	s->pos += now;
	s->fragment++;
	return EOE_HEADER_BYTES + now;
}

const char *eoe_result_to_str(uint32_t result)
{
	switch (result) {
	case EOE_SUCCESS:
		return "success";
	case EOE_UNSPECIFIED:
		return "unspecified error";
	case EOE_UNSUPPORTED:
		return "frame type not supported";
	case EOE_NO_IP:
		return "no IP support";
	case EOE_NO_DHCP:
		return "DHCP not supported";
	default: /* of the slave */
		return "unknown result";
	}
}
