/* SPDX-License-Identifier: MIT */
/*
 * Changes of answers, from the bytes of a fuzz input, four each: how many answers pass before it,
 * where it is (2 bytes), and what the byte there is XORed with; 0: the answer is lost.
 *
 * What counts as an answer is chosen: a whole frame, or a datagram of one kind. The bytes of a
 * datagram are followed by the two of its working counter; lost, its counter is 0.
 */
#ifndef FUZZ_CHANGES_H
#define FUZZ_CHANGES_H

#include <stddef.h>
#include <stdint.h>

enum { CHANGE_BYTES = 4 };

enum change_what { CHANGE_FRAME, CHANGE_MAIL, CHANGE_EEPROM, CHANGE_AL };

struct changes {
	enum change_what what;
	const uint8_t *next;
	size_t left;
	unsigned passed; /* answers since the last change */
};

/** 0: the frame is lost. */
int changes_apply(struct changes *c, uint8_t *frame, size_t len);

#endif
