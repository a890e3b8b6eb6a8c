/* SPDX-License-Identifier: MIT */
/* One capture against one simulated segment: what was answered, and where the two differ. */
#ifndef TESTS_REPLAY_COMPARE_H
#define TESTS_REPLAY_COMPARE_H

#include <stddef.h>
#include <stdint.h>

#include "capture.h"
#include "segment/segment.h"

enum { COMPARE_ROWS = 64 };

/* Bytes of one register of one slave that differ, and why that is as it should be. */
struct compare_row {
	uint8_t cmd;
	uint16_t adp;
	uint16_t ado;
	unsigned datagrams;
	unsigned bytes;
	const char *why; /* NULL: not explained */
	uint8_t real[8]; /* of the first such datagram */
	uint8_t simulated[8];
};

/* Receive times of one latch, as read back. */
struct compare_latch {
	uint16_t station;
	uint32_t real[4];
	uint32_t simulated[4];
	unsigned ports_read;
};

struct compare {
	/* Set before the run: ports of one slave whose receive times are leftovers, no frame sets
	 * them. */
	uint16_t leftover_station;
	uint8_t leftover_ports;

	unsigned frames;
	unsigned datagrams;
	unsigned unanswered; /* requests that the capture has no answer to */
	unsigned wkc_differ;
	unsigned header_differ; /* command, index, address, length, irq, source address */
	unsigned bytes;
	unsigned ram_bytes; /* of them read from process RAM: mailbox answers, which are played back
			     */
	unsigned bytes_differ;
	unsigned bytes_unexplained;
	unsigned row_count;
	struct compare_row row[COMPARE_ROWS];
	unsigned latch_count;
	struct compare_latch latch[COMPARE_ROWS];
};

/** Send the master's frames through @segment at their times and compare each answer. */
void compare_run(const struct capture_pairs *pairs, struct segment *segment, int64_t start_ns,
		 struct compare *ret);
/** The table, on stdout. */
void compare_print(const char *title, const struct compare *c);

#endif
