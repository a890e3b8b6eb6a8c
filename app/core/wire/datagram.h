/* SPDX-License-Identifier: MIT */
/*
 * EtherCAT frames and datagrams (ETG.1000.4): built into a buffer, walked in a buffer. Every length
 * is checked against the buffer, so bytes from the wire may be anything. Context: any, RT-safe.
 */
#ifndef WIRE_DATAGRAM_H
#define WIRE_DATAGRAM_H

#include <stddef.h>
#include <stdint.h>

enum ecat_cmd {
	ECAT_CMD_NOP = 0,
	ECAT_CMD_APRD = 1,
	ECAT_CMD_APWR = 2,
	ECAT_CMD_APRW = 3,
	ECAT_CMD_FPRD = 4,
	ECAT_CMD_FPWR = 5,
	ECAT_CMD_FPRW = 6,
	ECAT_CMD_BRD = 7,
	ECAT_CMD_BWR = 8,
	ECAT_CMD_BRW = 9,
	ECAT_CMD_LRD = 10,
	ECAT_CMD_LWR = 11,
	ECAT_CMD_LRW = 12,
	ECAT_CMD_ARMW = 13,
	ECAT_CMD_FRMW = 14,
};

enum ecat_size {
	ECAT_ETHERTYPE = 0x88a4,
	ECAT_ETHERNET_BYTES = 14,
	ECAT_FRAME_HEADER_BYTES = 2, /* length in bits 0..10, type 1 in bits 12..15 */
	ECAT_DATAGRAM_HEADER_BYTES = 10,
	ECAT_WKC_BYTES = 2,
	ECAT_FRAME_MAX_BYTES = 1514,
	ECAT_FRAME_MIN_BYTES = 60, /* shorter ones are padded with zeros */
	ECAT_DATAGRAM_MAX_BYTES = 1486,
};

/* 100 Mbit/s: 80 ns a byte; a frame costs its bytes, and preamble, FCS and gap. */
enum ecat_time { ECAT_BYTE_NS = 80, ECAT_UNSEEN_BYTES = 8 + 4 + 12 };

/** How long the wire is busy with a frame of @frame_len bytes (Ethernet header first, no FCS). */
static inline int64_t ecat_wire_time_ns(size_t frame_len)
{
	size_t len = frame_len < ECAT_FRAME_MIN_BYTES ? ECAT_FRAME_MIN_BYTES : frame_len;

	return (int64_t)(len + ECAT_UNSEEN_BYTES) * ECAT_BYTE_NS;
}

/* One datagram inside a frame buffer. @data points into the frame. */
struct ecat_datagram {
	uint8_t cmd; /* enum ecat_cmd */
	uint8_t idx;
	uint16_t adp; /* position (negative), station address; with @ado the logical address */
	uint16_t ado;
	uint16_t data_len;
	uint16_t irq;
	uint8_t *data;
	uint8_t *wkc; /* two bytes behind the data */
};

static inline uint32_t ecat_logical_address(const struct ecat_datagram *dg)
{
	return (uint32_t)dg->ado << 16 | dg->adp;
}

/* Builds one frame. Start with ecat_frame_begin(), add, end with ecat_frame_end(). */
struct ecat_frame_builder {
	uint8_t *buf; /* ECAT_FRAME_MAX_BYTES */
	size_t len;
	uint8_t *last_header; /* whose "more follows" bit is set when another comes */
};

/** Ethernet header to broadcast from @source (6 bytes), room for the EtherCAT header. */
void ecat_frame_begin(struct ecat_frame_builder *fb, uint8_t *buf, const uint8_t *source);

/**
 * Append a datagram with its data zeroed. Returns where the data is, NULL when it does not fit.
 * For logical commands @adp is the low word of the address, @ado the high word.
 */
uint8_t *ecat_frame_add(struct ecat_frame_builder *fb, enum ecat_cmd cmd, uint8_t idx, uint16_t adp,
			uint16_t ado, uint16_t data_len);

/** Write the EtherCAT header, pad to 60 bytes. Returns the frame's length. */
size_t ecat_frame_end(struct ecat_frame_builder *fb);

/** 1 if @frame is an Ethernet frame (untagged) of type 0x88A4 with EtherCAT type 1 and whole
 * header. */
int ecat_frame_is_valid(const uint8_t *frame, size_t frame_len);

/**
 * Walk the datagrams: *pos starts at 0 and is moved on. 1: *ret is filled; 0: no more;
 * -1: damaged (a length runs past the frame, or "more follows" at its end).
 */
int ecat_frame_next(uint8_t *frame, size_t frame_len, size_t *pos, struct ecat_datagram *ret);

/** "LRW" and so on; "?" for a number that is no command. */
const char *ecat_cmd_to_str(uint8_t cmd);

#endif
