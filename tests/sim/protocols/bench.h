/* SPDX-License-Identifier: MIT */
/*
 * A line of simulated slaves on virtual time and the mailbox engine on a line in direct mode; no
 * bus: the test leads each slave from state to state itself.
 */
#ifndef TESTS_SIM_PROTOCOLS_BENCH_H
#define TESTS_SIM_PROTOCOLS_BENCH_H

#include "link/line.h"
#include "mailbox/mailbox.h"
#include "segment/fault.h"
#include "segment/in_process.h"
#include "segment/segment.h"
#include "wire/sii.h"

enum { BENCH_SLAVES = 4, BENCH_STATION = 0x1001 };

struct protocol_bench {
	struct segment *segment;
	struct in_process *host;
	struct fault_plan *faults;
	struct line *line;
	struct mailbox_engine *mb;
	struct sii sii[BENCH_SLAVES];
};

/** Slaves "fb1111_piccolo", of the catalogue, or "all": a drive with every protocol; NULL at the
 * end; all in INIT with an address. */
void bench_begin(struct protocol_bench *b, const char *const *names);
void bench_end(struct protocol_bench *b);
int64_t bench_now_ns(const struct protocol_bench *b);

/** Ask for @state and wait for up to 1 s; AL status. */
uint16_t bench_request(struct protocol_bench *b, unsigned pos, uint16_t state);
uint16_t bench_al_code(struct protocol_bench *b, unsigned pos);
/** The mailboxes of PRE-OP (or BOOT) programmed and given to the engine, and that state reached. */
void bench_to_preop(struct protocol_bench *b, unsigned pos);
void bench_to_boot(struct protocol_bench *b, unsigned pos);
/** A property of the simulated slave, as "foe.busy". */
void bench_set(struct protocol_bench *b, unsigned pos, const char *key, const char *value);

/** Submit @rq to slave @pos and wait for its end: its result. */
int bench_do(struct protocol_bench *b, unsigned pos, struct mailbox_request *rq);
/** Text of the object 0x100A. */
void bench_version(struct protocol_bench *b, unsigned pos, char *ret_text, size_t text_bytes);
/** A FoE request for @name. */
struct mailbox_request bench_foe(uint8_t operation, const char *name, uint8_t *buffer,
				 size_t capacity);

#endif
