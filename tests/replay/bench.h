/* SPDX-License-Identifier: MIT */
/* A capture, and a segment that is to answer as its slaves did. */
#ifndef TESTS_REPLAY_BENCH_H
#define TESTS_REPLAY_BENCH_H

#include "capture.h"
#include "compare.h"
#include "segment/segment.h"

enum { BENCH_SLAVES = 8 };

/* What a master before this one has left: it had read DL status, so that its event is pending no
 * more; or it had let the event through (0x0200 = 4). */
enum bench_history { BENCH_FIRST_MASTER, BENCH_LINK_SEEN, BENCH_EVENT_LET_THROUGH };

struct bench_slave {
	uint16_t station;
	const struct esc_features *features; /* NULL: as the catalogue says */
	const char *sii; /* file, or NULL: what the master read in the capture */
	uint16_t pdi;    /* without a file: EEPROM word 0, where the master did not read 0x0140 */
	int has_application;    /* its AL states and mailbox answers are played back */
	uint8_t leftover_ports; /* without link: receive times are of an earlier run */
	int64_t processing_ns;
	double ppm;
};

struct bench {
	struct bytes capture;
	struct capture_pairs pairs;
	struct bytes sii[BENCH_SLAVES];
	struct segment_slave_spec spec[BENCH_SLAVES];
	unsigned count;
	struct compare result;
};

/** Send the master's half of @name through @slaves and print the table. bench_end() frees. */
void bench_run(struct bench *b, const char *name, const struct bench_slave *slaves, unsigned count,
	       enum bench_history history);
/** bench_run(), and check that nothing differs that is not explained. */
void bench_replay(struct bench *b, const char *name, const struct bench_slave *slaves,
		  unsigned count, enum bench_history history);
/** Receive time of @port after that of port 0, real and simulated, within two ticks. */
void bench_check_round_trip(const struct bench *b, uint16_t station, unsigned port);
void bench_end(struct bench *b);

#endif
