/* SPDX-License-Identifier: MIT */
/*
 * The application of a real slave, played back. What firmware does cannot follow from an SII, so it
 * is taken from the capture's own answers, and put into the simulated chip through its PDI: an AL
 * status just before the master saw it, a mailbox answer just before its SyncManager showed it
 * full. What is tested then is the chip between the two: the locks, handshakes and status bits.
 */
#ifndef TESTS_REPLAY_PLAYER_H
#define TESTS_REPLAY_PLAYER_H

#include "capture.h"
#include "segment/device.h"

/**
 * The application of @station; the capture's first frame is sent at @start_ns. It looks at AL
 * control 20 ms after it was written, or when its AL status changes.
 */
struct sim_device *player_create(const struct capture_pairs *pairs, uint16_t station,
				 int64_t start_ns);

#endif
