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

/**
 * What a capture shows of the EEPROM of station @station: every word that the master read, all
 * others 0, the configuration word 0 as APRD/FPRD of 0x0140 gave it at @position, the checksum made
 * to fit.
 */
struct bytes capture_learn_sii(const struct bytes *capture, uint16_t station, uint16_t position);

void capture_free(struct bytes *b);

#endif
