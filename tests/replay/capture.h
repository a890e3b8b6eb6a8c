/* SPDX-License-Identifier: MIT */
/* Captures and EEPROM images of real slaves. They are not part of this repository: who has none
 * skips. */
#ifndef TESTS_REPLAY_CAPTURE_H
#define TESTS_REPLAY_CAPTURE_H

#include <stddef.h>
#include <stdint.h>

struct bytes {
	uint8_t *at;
	size_t len;
};

/**
 * A file below $ECDAQ_DATA, $ECDAQ_SHARED_DATA or ../shared/data beside the repository. Skips the
 * test when the folder is not there; fails it when the folder is and the file is not.
 */
struct bytes capture_load(const char *name);

/** Path of a folder of them, e.g. "sii". Good until the next call. */
const char *capture_folder(const char *name);

/**
 * What a capture shows of the EEPROM of station @station: every word that the master read, all
 * others 0, the configuration word 0 as APRD/FPRD of 0x0140 gave it at @position, the checksum made
 * to fit.
 */
struct bytes capture_learn_sii(const struct bytes *capture, uint16_t station, uint16_t position);

void capture_free(struct bytes *b);

/* A frame of the master and what came back of it. Both lie in the capture's buffer. */
struct capture_pair {
	int64_t t_ns; /* of the request, from the capture's first EtherCAT frame */
	const uint8_t *request;
	const uint8_t *answer; /* NULL: none */
	size_t len;            /* of the request; an answer is no shorter */
	size_t answer_len;
};

struct capture_pairs {
	struct capture_pair *at;
	size_t count;
};

/** All requests in order, each with its answer: that with the same first command, index and length.
 */
struct capture_pairs capture_pair_up(const struct bytes *capture);

/**
 * The local time that station @station must start with at time 0, so that its receive times are
 * those of the capture's first latch if its first frame is sent at @start_ns.
 */
uint64_t capture_learn_clock(const struct capture_pairs *pairs, uint16_t station, int64_t start_ns);

#endif
