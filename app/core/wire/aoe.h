/* SPDX-License-Identifier: MIT */
/*
 * ADS over EtherCAT (AoE, ETG.1020 part 3): an AMS header, then a command. SDOs are read and
 * written as index group 0xF302. Context: any, RT-safe.
 */
#ifndef WIRE_AOE_H
#define WIRE_AOE_H

#include <stddef.h>
#include <stdint.h>

enum {
	AOE_NET_ID_BYTES = 6,
	AOE_HEADER_BYTES = 32,
	AOE_READ_BYTES = 12,        /* request: group, offset, length */
	AOE_WRITE_BYTES = 12,       /* request: the same, then data */
	AOE_READ_ANSWER_BYTES = 8,  /* result, length, then data */
	AOE_WRITE_ANSWER_BYTES = 4, /* result */
};

enum aoe_command { AOE_READ = 2, AOE_WRITE = 3 };

enum aoe_flag { AOE_FLAG_RESPONSE = 0x0001, AOE_FLAG_COMMAND = 0x0004 };

/* ADS error codes. */
enum aoe_error {
	AOE_ERROR_SERVICE = 0x0701, /* service not supported */
	AOE_ERROR_GROUP = 0x0702,
	AOE_ERROR_SIZE = 0x0705,
};

enum { AOE_GROUP_SDO = 0xf302, AOE_OFFSET_COMPLETE = 0x0100 };

struct aoe_address {
	uint8_t net_id[AOE_NET_ID_BYTES];
	uint16_t port;
};

struct aoe_header {
	struct aoe_address target;
	struct aoe_address source;
	uint16_t command; /* enum aoe_command */
	uint16_t flags;
	uint32_t data_len; /* behind the header */
	uint32_t error;    /* of the transport */
	uint32_t invoke_id;
};

/** The header in @data of @data_len bytes. 0; -EBADMSG: shorter than it says. */
int aoe_header_get(const uint8_t *data, size_t data_len, struct aoe_header *ret);
/** AOE_HEADER_BYTES. */
void aoe_header_put(uint8_t *data, const struct aoe_header *h);

/** Text of an ADS error, or of the SDO abort code that comes in its place. */
const char *aoe_error_to_str(uint32_t code);
/** AMS Net ID "1.2.3.4.5.6" of @text; "": zeros. 0 or -EINVAL. */
int aoe_net_id_parse(const char *text, uint8_t ret_net_id[AOE_NET_ID_BYTES]);

/** Index offset of an SDO. */
static inline uint32_t aoe_sdo_offset(uint16_t index, uint8_t subindex)
{
	return (uint32_t)index << 16 | subindex;
}

#endif
