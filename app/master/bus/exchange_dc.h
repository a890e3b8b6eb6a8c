/* SPDX-License-Identifier: MIT */
/*
 * What the cyclic frame does with the reference clock. Normally FRMW reads its time and writes it
 * to the slaves behind. While the reference does not answer, an FRMW would write the master's own
 * payload into all others (T17): then the frame only reads (FPRD), until the reference answers with
 * a plausible time. Whether a payload that came back unchanged under a low WKC was its answer is
 * found out by reading it in the next frame. Context: cycle thread.
 */
#ifndef BUS_EXCHANGE_DC_H
#define BUS_EXCHANGE_DC_H

#include <stdint.h>

#include "base/clock.h"

struct dc_track {
	int is_following; /* FRMW; else FPRD */
	int is_known;     /* last_ns and last_at hold a time of the reference */
	int64_t last_ns;
	mono_t last_at;
	int64_t sent_ns;   /* what the FRMW on the wire carries: where the reference should be */
	uint16_t wkc_full; /* most slaves that ever answered an FRMW */
	unsigned rejected; /* implausible times in a row */
	int is_confirmed; /* the reference was identified: its next time is right, whatever it is */
};

/** The command for the next frame (enum ecat_cmd), and its payload in *ret_payload_ns. */
uint8_t dc_track_command(struct dc_track *track, mono_t at, int64_t *ret_payload_ns);

/** 1: implausible times have come for so long that somebody has to ask who it is that answers. */
int dc_track_is_doubted(const struct dc_track *track);

/** The answer to that: DC time of the reference at the frame, 0 if it is missing or implausible. */
int64_t dc_track_answer(struct dc_track *track, uint8_t cmd, uint16_t wkc, int64_t time_ns,
			mono_t sent);

#endif
