/* SPDX-License-Identifier: MIT */
/* Little-endian bytes, as EtherCAT, SII, CDR and MCAP have them. Context: any, RT-safe. */
#ifndef BASE_BYTES_H
#define BASE_BYTES_H

#include <endian.h>
#include <stdint.h>
#include <string.h>

/* By memcpy(): one load or store at any address, where shifted octets may be as many. */

static inline uint16_t get_le16(const uint8_t *p)
{
	uint16_t v;

	memcpy(&v, p, sizeof(v));
	return le16toh(v);
}

static inline uint32_t get_le32(const uint8_t *p)
{
	uint32_t v;

	memcpy(&v, p, sizeof(v));
	return le32toh(v);
}

static inline uint64_t get_le64(const uint8_t *p)
{
	uint64_t v;

	memcpy(&v, p, sizeof(v));
	return le64toh(v);
}

/* The @octets (1 to 8) at @p. Two loads that overlap cost less than a loop. */
static inline uint64_t get_le(const uint8_t *p, unsigned octets)
{
	if (octets == 1) {
		return *p;
	}
	if (octets < 4) {
		return get_le16(p) | (uint64_t)get_le16(p + octets - 2) << 8 * (octets - 2);
	}
	return get_le32(p) | (uint64_t)get_le32(p + octets - 4) << 8 * (octets - 4);
}

static inline void put_le16(uint8_t *p, uint16_t v)
{
	v = htole16(v);
	memcpy(p, &v, sizeof(v));
}

static inline void put_le32(uint8_t *p, uint32_t v)
{
	v = htole32(v);
	memcpy(p, &v, sizeof(v));
}

static inline void put_le64(uint8_t *p, uint64_t v)
{
	v = htole64(v);
	memcpy(p, &v, sizeof(v));
}

/* The lowest @octets (1 to 8) of @v. */
static inline void put_le(uint8_t *p, unsigned octets, uint64_t v)
{
	if (octets == 1) {
		*p = (uint8_t)v;
	} else if (octets < 4) {
		put_le16(p, (uint16_t)v);
		put_le16(p + octets - 2, (uint16_t)(v >> 8 * (octets - 2)));
	} else {
		put_le32(p, (uint32_t)v);
		put_le32(p + octets - 4, (uint32_t)(v >> 8 * (octets - 4)));
	}
}

#endif
