/* SPDX-License-Identifier: MIT */
#include "devices/eoe_server.h"

#include <string.h>

/* Offsets in an Ethernet frame without VLAN tag. */
enum frame_layout {
	ETH_TO = 0,
	ETH_FROM = 6,
	ETH_TYPE = 12,
	ETH_HEADER = 14,
	MAC = 6,
	IPV4 = 4,
	/* ARP */
	ARP_OPERATION = 20,
	ARP_FROM_MAC = 22,
	ARP_FROM_IP = 28,
	ARP_TO_MAC = 32,
	ARP_TO_IP = 38,
	ARP_END = 42,
	/* IPv4 without options, ICMP */
	IP_PROTOCOL = 23,
	IP_FROM = 26,
	IP_TO = 30,
	ICMP_TYPE = 34,
	ICMP_CHECKSUM = 36,
	ICMP_END = 42,
};

enum { ETH_MIN = 60, ARP_REQUEST = 1, ARP_REPLY = 2, ICMP = 1, PING = 8, IHL_5 = 0x45 };

static const uint8_t broadcast[MAC] = { 0xff, 0xff, 0xff, 0xff, 0xff, 0xff };

void eoe_server_reset(struct eoe_server *s)
{
	*s = (struct eoe_server){ .queued = 0 };
}

static unsigned get_be16(const uint8_t *p)
{
	return (unsigned)p[0] << 8 | p[1];
}

static void put_be16(uint8_t *p, unsigned value)
{
	p[0] = (uint8_t)(value >> 8);
	p[1] = (uint8_t)value;
}

/* A frame to the master; lost when too many wait. */
static struct eoe_queued *enqueue(struct eoe_server *s, size_t len)
{
	struct eoe_queued *q;

	if (s->queued == EOE_SERVER_QUEUE) {
		return NULL;
	}
	q = &s->queue[s->queued++];
	memset(q->bytes, 0, sizeof(q->bytes));
	q->len = len < ETH_MIN ? ETH_MIN : len;
	return q;
}

/* --- the endpoint --- */

static void send_arp(struct eoe_server *s, const uint8_t *to_mac, const uint8_t *to_ip,
		     unsigned operation)
{
	static const uint8_t fixed[] = { 0x08, 0x06, 0, 1, 0x08, 0x00, MAC, IPV4 };
	struct eoe_queued *q = enqueue(s, ARP_END);

	if (q == NULL) {
		return;
	}
	memcpy(q->bytes + ETH_TO, to_mac, MAC);
	memcpy(q->bytes + ETH_FROM, s->ip.mac, MAC);
	memcpy(q->bytes + ETH_TYPE, fixed, sizeof(fixed));
	put_be16(q->bytes + ARP_OPERATION, operation);
	memcpy(q->bytes + ARP_FROM_MAC, s->ip.mac, MAC);
	memcpy(q->bytes + ARP_FROM_IP, s->ip.address, IPV4);
	memcpy(q->bytes + ARP_TO_MAC, to_mac, MAC);
	memcpy(q->bytes + ARP_TO_IP, to_ip, IPV4);
}

static void take_arp(struct eoe_server *s, const uint8_t *frame, size_t len)
{
	if (len >= ARP_END && get_be16(frame + ARP_OPERATION) == ARP_REQUEST &&
	    memcmp(frame + ARP_TO_IP, s->ip.address, IPV4) == 0) {
		send_arp(s, frame + ARP_FROM_MAC, frame + ARP_FROM_IP, ARP_REPLY);
	}
}

/* A reply differs from the request in its type, so its check sum by that (RFC 1624). */
static void take_ping(struct eoe_server *s, const uint8_t *frame, size_t len)
{
	struct eoe_queued *q;
	unsigned sum;

	if (len < ICMP_END || frame[ETH_HEADER] != IHL_5 || frame[IP_PROTOCOL] != ICMP ||
	    frame[ICMP_TYPE] != PING || memcmp(frame + IP_TO, s->ip.address, IPV4) != 0) {
		return;
	}
	q = enqueue(s, len);
	if (q == NULL) {
		return;
	}
	memcpy(q->bytes, frame, len);
	memcpy(q->bytes + ETH_TO, frame + ETH_FROM, MAC);
	memcpy(q->bytes + ETH_FROM, s->ip.mac, MAC);
	memcpy(q->bytes + IP_FROM, frame + IP_TO, IPV4);
	memcpy(q->bytes + IP_TO, frame + IP_FROM, IPV4);
	q->bytes[ICMP_TYPE] = 0;
	sum = get_be16(frame + ICMP_CHECKSUM) + (PING << 8);
	put_be16(q->bytes + ICMP_CHECKSUM, (sum & 0xffff) + (sum >> 16));
}

static void take_frame(struct eoe_server *s, const uint8_t *frame, size_t len)
{
	s->frames++;
	if (len < ETH_HEADER || !(s->ip.flags & EOE_HAS_ADDRESS) ||
	    (memcmp(frame + ETH_TO, s->ip.mac, MAC) != 0 &&
	     memcmp(frame + ETH_TO, broadcast, MAC) != 0)) {
		return;
	}
	if (get_be16(frame + ETH_TYPE) == 0x0806) {
		take_arp(s, frame, len);
	} else if (get_be16(frame + ETH_TYPE) == 0x0800) {
		take_ping(s, frame, len);
	}
}

/* --- the mailbox --- */

static void merge(struct eoe_ip *ip, const struct eoe_ip *from)
{
	struct eoe_ip all = *from;

	all.flags = ip->flags | from->flags;
	if (!(from->flags & EOE_HAS_MAC)) {
		memcpy(all.mac, ip->mac, sizeof(all.mac));
	}
	if (!(from->flags & EOE_HAS_ADDRESS)) {
		memcpy(all.address, ip->address, sizeof(all.address));
	}
	if (!(from->flags & EOE_HAS_NETMASK)) {
		memcpy(all.netmask, ip->netmask, sizeof(all.netmask));
	}
	if (!(from->flags & EOE_HAS_GATEWAY)) {
		memcpy(all.gateway, ip->gateway, sizeof(all.gateway));
	}
	if (!(from->flags & EOE_HAS_DNS)) {
		memcpy(all.dns, ip->dns, sizeof(all.dns));
	}
	if (!(from->flags & EOE_HAS_NAME)) {
		memcpy(all.name, ip->name, sizeof(all.name));
	}
	*ip = all;
}

static size_t set_ip(struct eoe_server *s, const struct mailbox_call *call, uint8_t port)
{
	struct eoe_header answer = { .type = EOE_SET_IP_RESPONSE, .port = port, .is_last = 1 };
	struct eoe_ip ip;

	if (eoe_ip_get(call->request + EOE_HEADER_BYTES, call->request_len - EOE_HEADER_BYTES,
		       &ip) < 0) {
		answer.result = EOE_UNSPECIFIED;
	} else {
		merge(&s->ip, &ip);
		if (ip.flags & EOE_HAS_ADDRESS) {
			send_arp(s, broadcast, s->ip.address, ARP_REQUEST);
		}
	}
	eoe_header_put(call->answer, &answer);
	return EOE_HEADER_BYTES;
}

static size_t get_ip(const struct eoe_server *s, const struct mailbox_call *call, uint8_t port)
{
	eoe_header_put(
		call->answer,
		&(struct eoe_header){ .type = EOE_GET_IP_RESPONSE, .port = port, .is_last = 1 });
	eoe_ip_put(call->answer + EOE_HEADER_BYTES, &s->ip);
	return EOE_HEADER_BYTES + EOE_IP_BYTES;
}

size_t eoe_server_answer(void *ctx, const struct mailbox_call *call)
{
	struct eoe_server *s = ctx;
	struct eoe_header h;

	if (call->capacity < EOE_HEADER_BYTES + EOE_IP_BYTES ||
	    eoe_header_get(call->request, call->request_len, &h) < 0) {
		return 0;
	}
	switch (h.type) {
	case EOE_FRAGMENT:
		if (eoe_assemble(&s->in, call->request, call->request_len) == 1) {
			take_frame(s, s->in.frame, s->in.len);
		}
		return 0;
	case EOE_SET_IP:
		return set_ip(s, call, h.port);
	case EOE_GET_IP:
		return get_ip(s, call, h.port);
	default: /* four bits of the wire */
		eoe_header_put(call->answer, &(struct eoe_header){ .type = (uint8_t)(h.type + 1),
								   .port = h.port,
								   .is_last = 1,
								   .result = EOE_UNSUPPORTED });
		return EOE_HEADER_BYTES;
	}
}

size_t eoe_server_next(void *ctx, const struct mailbox_call *call)
{
	struct eoe_server *s = ctx;
	size_t len;

	if (s->queued == 0 || call->capacity < EOE_HEADER_BYTES + EOE_BLOCK_BYTES) {
		return 0;
	}
	if (s->out.frame == NULL) {
		s->frame_number = (uint8_t)((s->frame_number + 1) % EOE_FRAME_NUMBERS);
		s->out = (struct eoe_split){ .frame = s->queue[0].bytes,
					     .len = s->queue[0].len,
					     .frame_number = s->frame_number };
	}
	len = eoe_split_next(&s->out, call->answer, call->capacity);
	if (s->out.pos == s->out.len) {
		s->out.frame = NULL;
		s->queued--;
		memmove(s->queue, s->queue + 1, s->queued * sizeof(s->queue[0]));
	}
	return len;
}
