/* SPDX-License-Identifier: MIT */
/*
 * Is a received frame the answer to a frame that was sent? Slaves change data, working counters,
 * the IRQ field, the position of broadcast and auto-increment addresses, the circulating bit, and
 * set bit 0x02 in the first octet of the source address; all else comes back unchanged. Context:
 * any, RT-safe.
 */
#ifndef WIRE_ECHO_H
#define WIRE_ECHO_H

#include <stddef.h>
#include <stdint.h>

enum echo_index { ECHO_INDEX_SAME, ECHO_INDEX_ANY };

/** 1 if @frame answers @sent (a whole, valid frame) in every datagram; @index: whether index bytes
 * are compared. */
int echo_matches(const uint8_t *sent, const uint8_t *frame, size_t frame_len,
		 enum echo_index index);

/** 1 if @frame is @sent as it was sent: no slave has processed it, something has returned it. */
int echo_is_unchanged(const uint8_t *sent, size_t sent_len, const uint8_t *frame, size_t frame_len);

#endif
