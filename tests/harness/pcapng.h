/* SPDX-License-Identifier: MIT */
/*
 * Capture files in pcapng: frames with their times, read from memory and written to memory. Either
 * byte order, any time resolution; block types that are not needed are passed over. Bytes may be
 * anything: every length is checked against the buffer. Context: any; nothing allocates.
 */
#ifndef HARNESS_PCAPNG_H
#define HARNESS_PCAPNG_H

#include <stddef.h>
#include <stdint.h>

enum { PCAPNG_LIMIT_INTERFACES = 16, PCAPNG_LINK_ETHERNET = 1 };

struct pcapng_interface {
	uint16_t link_type;
	uint32_t snap_bytes;
	uint8_t resolution; /* if_tsresol: powers of ten, or of two with bit 7 */
	int64_t offset_s;   /* if_tsoffset */
};

/* A walk over one file. Start with pcapng_open(). */
struct pcapng {
	const uint8_t *bytes;
	size_t len;
	size_t pos;
	int is_swapped; /* the file's byte order is not little-endian */
	unsigned interface_count;
	struct pcapng_interface interface[PCAPNG_LIMIT_INTERFACES];
};

struct pcapng_packet {
	int64_t t_ns; /* Unix time */
	unsigned interface;
	const uint8_t *bytes; /* in the file's buffer */
	size_t len;
	size_t wire_len; /* what it had on the wire; more than len if it was cut */
};

/** Begin at a section header. 0, or -EBADMSG: this is no pcapng. */
int pcapng_open(struct pcapng *file, const uint8_t *bytes, size_t len);

/**
 * The next packet. 1: *ret is filled; 0: end of the file; -EBADMSG: a block is damaged or cut off,
 * -E2BIG: more interfaces than PCAPNG_LIMIT_INTERFACES; the walk ends there.
 */
int pcapng_next(struct pcapng *file, struct pcapng_packet *ret);

/* --- writing: section header and interface (Ethernet, ns), then packets --- */

enum { PCAPNG_HEAD_BYTES = 60, PCAPNG_PACKET_OVERHEAD_BYTES = 32 };

/** Write the head to @buf (PCAPNG_HEAD_BYTES). Returns PCAPNG_HEAD_BYTES. */
size_t pcapng_write_head(uint8_t *buf);

/** Bytes that a packet of @frame_len takes in the file. */
size_t pcapng_packet_bytes(size_t frame_len);

/** Write one packet to @buf (pcapng_packet_bytes()). Returns its size; @t_ns is Unix time, not
 * before 1970. */
size_t pcapng_write_packet(uint8_t *buf, int64_t t_ns, const uint8_t *frame, size_t frame_len);

#endif
