/* SPDX-License-Identifier: MIT */
/*
 * Ethernet over EtherCAT (EoE, ETG.1000.6 part 5.7): IP parameters of a slave, and Ethernet frames
 * in fragments of a multiple of 32 bytes. Bytes may be anything. Context: any, RT-safe.
 */
#ifndef WIRE_EOE_H
#define WIRE_EOE_H

#include <stddef.h>
#include <stdint.h>

enum {
	EOE_HEADER_BYTES = 4,
	EOE_BLOCK_BYTES = 32,
	EOE_FRAME_MAX_BYTES = 1518, /* Ethernet frame with VLAN tag, without FCS */
	EOE_IP_BYTES = 58,          /* flags, MAC, 4 addresses, name */
	EOE_NAME_BYTES = 32,
	EOE_FRAME_NUMBERS = 16,
	EOE_PORTS = 16,
};

enum eoe_type {
	EOE_FRAGMENT = 0,
	EOE_SET_IP = 2,
	EOE_SET_IP_RESPONSE = 3,
	EOE_GET_IP = 6,
	EOE_GET_IP_RESPONSE = 7,
};

enum eoe_result {
	EOE_SUCCESS = 0x0000,
	EOE_UNSPECIFIED = 0x0001,
	EOE_UNSUPPORTED = 0x0002,
	EOE_NO_IP = 0x0201,
	EOE_NO_DHCP = 0x0202,
};

struct eoe_header {
	uint8_t type; /* enum eoe_type, 4 bits */
	uint8_t port; /* 4 bits */
	uint8_t is_last;
	uint8_t has_time;     /* four bytes of time stamp behind the last fragment */
	uint16_t result;      /* of a response: enum eoe_result */
	uint8_t fragment;     /* of a fragment: its number, 6 bits ... */
	uint8_t blocks;       /* ... 0: size of the frame, else where it goes; in EOE_BLOCK_BYTES */
	uint8_t frame_number; /* 4 bits */
};

/* Which of them are meant. */
enum eoe_ip_flag {
	EOE_HAS_MAC = 0x01,
	EOE_HAS_ADDRESS = 0x02,
	EOE_HAS_NETMASK = 0x04,
	EOE_HAS_GATEWAY = 0x08,
	EOE_HAS_DNS = 0x10,
	EOE_HAS_NAME = 0x20,
};

/* IP parameters; addresses in the order in which they are written (192.168.0.1: 192 first). */
struct eoe_ip {
	uint32_t flags; /* enum eoe_ip_flag */
	uint8_t mac[6];
	uint8_t address[4];
	uint8_t netmask[4];
	uint8_t gateway[4];
	uint8_t dns[4];
	char name[EOE_NAME_BYTES + 1];
};

/** The header of @data. 0; -EBADMSG: too short. */
int eoe_header_get(const uint8_t *data, size_t data_len, struct eoe_header *ret);
/** EOE_HEADER_BYTES. */
void eoe_header_put(uint8_t *data, const struct eoe_header *h);

/** Text of an enum eoe_result; "unknown result" for one that is not listed. */
const char *eoe_result_to_str(uint32_t result);

/** IP parameters behind the header. 0; -EBADMSG: too short for what its flags say. */
int eoe_ip_get(const uint8_t *data, size_t data_len, struct eoe_ip *ret);
/** EOE_IP_BYTES. */
void eoe_ip_put(uint8_t *data, const struct eoe_ip *ip);

/* A frame that comes in fragments. */
struct eoe_assembly {
	uint8_t frame[EOE_FRAME_MAX_BYTES];
	size_t len; /* so far; 0: none has begun */
	uint8_t next_fragment;
	uint8_t frame_number;
};

/**
 * Take one fragment (with its header). 1: @a->frame of @a->len bytes is whole, until the next call;
 * 0: more follow; -EBADMSG: it does not fit what came before, everything of this frame is dropped.
 */
int eoe_assemble(struct eoe_assembly *a, const uint8_t *data, size_t data_len);

/* A frame that goes out in fragments. */
struct eoe_split {
	const uint8_t *frame;
	size_t len;
	size_t pos;
	uint8_t fragment;
	uint8_t frame_number;
};

/** The next fragment into @data of @capacity bytes (36 at least); its length; 0: the frame is out.
 */
size_t eoe_split_next(struct eoe_split *s, uint8_t *data, size_t capacity);

#endif
