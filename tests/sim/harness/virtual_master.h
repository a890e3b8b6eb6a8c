/* SPDX-License-Identifier: MIT */
/*
 * The daemon's session on a virtual bench: one thread, virtual time, the cycle held to its
 * real-time rules (rt_guard.h). Every sample that comes out of the ring is counted and hashed, so
 * that two runs can be compared to the last byte.
 */
#ifndef TESTS_SIM_HARNESS_VIRTUAL_MASTER_H
#define TESTS_SIM_HARNESS_VIRTUAL_MASTER_H

#include <stdint.h>

#include "base/admin_protocol.h"
#include "base/ring.h"
#include "base/sample.h"
#include "config/config.h"
#include "daemon/session.h"
#include "sim/harness/virtual_bench.h"

enum { VIRTUAL_SERVICE_CYCLES = 10 }; /* the service loop runs once in so many cycles */

/* Summary of the samples. All counts are of samples read from the ring. */
struct virtual_result {
	uint64_t samples;
	uint64_t gaps;            /* a cycle number that is not one more */
	uint64_t op;              /* samples in OP; of those: */
	uint64_t bad;             /* with any slave's bit */
	uint64_t bad_unexplained; /* bad, and neither lost, late, skipped, WKC low nor
				     unchecked */
	uint64_t lost;
	uint64_t late;
	uint64_t doubled;
	uint64_t skipped;
	uint64_t wkc_low;
	uint64_t unlocked;    /* in OP and not locked */
	int64_t phase_max_ns; /* largest |phase error| in OP */
	uint64_t hash;        /* over every byte of every sample, eight at once */
	uint64_t first_cycle;
	uint64_t last_cycle;
};

struct virtual_master {
	struct virtual_bench *bench;
	char dir[64];
	struct config cfg;
	struct session *session;
	struct cycle *cycle; /* NULL: does not run */
	struct ring_reader *samples;
	struct virtual_result result;
	struct failure failure; /* of the newest call that failed */
	unsigned steps;         /* since the service loop ran */
	int64_t op_ns;          /* virtual time that bring-up took */
	int64_t stop_at_ns;     /* when a stop is requested, in a bring-up, too; 0: never */
	void (*each_cycle)(struct virtual_master *vm); /* a checker, after every cycle; NULL: none
							*/
	/* Every sample, in order, as virtual_master_sample() and virtual_master_value() show it. */
	void (*each_sample)(struct virtual_master *vm);
	/* Every frame that comes back to the master; NULL: none looks. */
	void (*each_frame)(struct virtual_master *vm, const uint8_t *frame, size_t frame_len);
	/* The same of every frame that the master sends. */
	void (*each_sent)(struct virtual_master *vm, const uint8_t *frame, size_t frame_len);
	void *user; /* of those */
	struct sample_header newest_header;
	_Alignas(8) uint8_t newest[sizeof(struct sample_header) + LIMIT_IMAGE_BYTES];
};

/**
 * A master with @settings ("cycle.period=2ms", ..., NULL at the end; NULL: none) over the defaults.
 * Ends the test if it cannot be made.
 */
void virtual_master_init(struct virtual_master *vm, struct virtual_bench *bench,
			 const char *const *settings);
/** The same, but a bring-up that fails leaves the bus as far as it came, as ecdaqd does. */
void virtual_master_init_waiting(struct virtual_master *vm, struct virtual_bench *bench,
				 const char *const *settings);
/**
 * A bench of two boards, "a" and "b", whose clocks drift apart, with a master that waits as above,
 * or ends where a bring-up fails. @setting is one more; NULL: none.
 */
void virtual_master_init_pair(struct virtual_master *vm, struct virtual_bench *bench,
			      const char *setting, int waits);
/** End without sending a frame, as by SIGKILL. */
void virtual_master_kill(struct virtual_master *vm);

/** The same, with the bench under it. */
void virtual_master_close(struct virtual_master *vm);

/** session_bring_up(); 0 or -errno with vm->failure. */
int virtual_master_bring_up(struct virtual_master *vm);
/** @cycles cycles, or periods where no cycle runs, with the service loop between them. An enum
 * session_result or -errno. */
int virtual_master_run(struct virtual_master *vm, uint64_t cycles);
/** Outputs safe, INIT; 0 or -errno with vm->failure. The samples up to there are in the result. */
int virtual_master_stop(struct virtual_master *vm);

/** Discard the samples counted so far. */
void virtual_master_forget(struct virtual_master *vm);

/** In OP, some cycles on, with no sample counted yet. Ends the test where OP is not reached. */
void virtual_master_settle(struct virtual_master *vm);
/** At least @samples cycles since it settled, all in OP, none lost, late, skipped, low or bad. */
void virtual_master_check_undisturbed(const struct virtual_master *vm, uint64_t samples);

/** The newest sample's header; the value of the channel named @name in it. */
const struct sample_header *virtual_master_sample(const struct virtual_master *vm);
uint64_t virtual_master_value(const struct virtual_master *vm, const char *name);

/** Print the newest @count events, for a test that is about to fail. */
void virtual_master_print_events(const struct virtual_master *vm, uint64_t count);

/** A request through the admin socket, cycles going on until the reply is there; a restart that it
 * asks for is made. */
struct admin_reply virtual_master_ask(struct virtual_master *vm,
				      const struct admin_request *request);

/** A connection to the admin socket; the caller closes it. */
int virtual_master_connect(const struct virtual_master *vm);

/* Data with a request and its answer, beyond one message. Zero it first. */
struct virtual_transfer {
	const uint8_t *data; /* NULL: those of the request */
	size_t data_len;
	size_t answer_len;
	unsigned reports; /* of progress */
	uint8_t answer[8192];
};

/** virtual_master_ask() with them. */
struct admin_reply virtual_master_transfer(struct virtual_master *vm,
					   const struct admin_request *request,
					   struct virtual_transfer *tr);

#endif
