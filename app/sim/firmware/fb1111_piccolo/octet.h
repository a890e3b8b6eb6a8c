/* SPDX-License-Identifier: MIT */
/*
 * Octets of the wire. The C28x core has no 8-bit type (CHAR_BIT is 16), so an octet is the smallest
 * type that holds 0..255, is masked wherever it is made, and lengths are counted in octets, never
 * taken from sizeof. On a host octet_t is uint8_t.
 */
#ifndef FB1111_PICCOLO_OCTET_H
#define FB1111_PICCOLO_OCTET_H

#include <stdint.h>

typedef uint_least8_t octet_t;

#define OCTET(v) ((octet_t)((unsigned)(v) & 0xffu))

static inline uint16_t octets_get16(const octet_t *p)
{
	return (uint16_t)((unsigned)p[0] | (unsigned)p[1] << 8);
}

static inline uint32_t octets_get32(const octet_t *p)
{
	return (uint32_t)octets_get16(p) | (uint32_t)octets_get16(p + 2) << 16;
}

static inline uint64_t octets_get64(const octet_t *p)
{
	return (uint64_t)octets_get32(p) | (uint64_t)octets_get32(p + 4) << 32;
}

static inline void octets_put16(octet_t *p, uint16_t v)
{
	p[0] = OCTET(v);
	p[1] = OCTET(v >> 8);
}

static inline void octets_put32(octet_t *p, uint32_t v)
{
	octets_put16(p, (uint16_t)(v & 0xffffu));
	octets_put16(p + 2, (uint16_t)(v >> 16));
}

static inline void octets_put64(octet_t *p, uint64_t v)
{
	octets_put32(p, (uint32_t)(v & 0xffffffffu));
	octets_put32(p + 4, (uint32_t)(v >> 32));
}

#endif
