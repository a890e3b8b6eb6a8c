/* SPDX-License-Identifier: MIT */
/* Between the files of the cycle; not for others. */
#ifndef CYCLE_CYCLE_INTERNAL_H
#define CYCLE_CYCLE_INTERNAL_H

#include <stdatomic.h>

#include "base/event.h"
#include "base/slave_set.h"
#include "cycle/check.h"
#include "cycle/cycle.h"
#include "cycle/dc_servo.h"
#include "cycle/numbering.h"
#include "cycle/outputs.h"

/* The statistics have one writer: no read-modify-write is needed. */
#define ADD(field, n)                                                                              \
	atomic_store_explicit(&(field),                                                            \
			      atomic_load_explicit(&(field), memory_order_relaxed) + (n),          \
			      memory_order_relaxed)
#define SET(field, v) atomic_store_explicit(&(field), (v), memory_order_relaxed)

struct event_gate {
	uint64_t window;
	unsigned count;
};

/*
 * A set of slaves from the service thread to the cycle without a lock: each side owns one of three,
 * and takes the spare one for its own in one atomic step.
 */
#define CYCLE_SLAVES_NEW 4u /* added to the spare's index: not taken yet */

struct cycle_named {
	struct slave_set slaves;
	uint64_t alerts; /* known to whoever named them */
};

struct cycle_slaves {
	struct cycle_named named[3];
	unsigned filled;        /* [service] index of the one to be filled next */
	unsigned taken;         /* [cycle] index of the one in force */
	_Atomic unsigned spare; /* [any] */
};

struct cycle {
	struct cycle_spec spec;
	span_t period;
	int64_t set_point_ns;
	int64_t receive_ns;    /* cycle.receive */
	int64_t diff_proof_ns; /* a difference from this on proves that one slave is above the limit
				*/
	mono_t deadline;
	_Atomic int64_t next_wake_ns; /* [cycle] the deadline, for others, while it sleeps */
	mono_t start;
	struct dc_servo servo;
	struct numbering numbering;
	struct check check;
	struct outputs outputs;
	struct sample_header sample; /* of the cycle being made */
	uint8_t image[LIMIT_IMAGE_BYTES];
	enum cycle_phase phase;
	struct slave_set all;  /* of the bus */
	unsigned set_words;    /* of a set that are in use */
	int has_live;          /* live is not empty */
	struct slave_set live; /* in OP: real outputs, judged samples; none unless in CYCLE_OP */
	int has_gone;
	struct slave_set gone; /* as frames have shown since the service thread named the live */
	uint16_t al_status;    /* of all slaves ORed, newest frame */
	uint64_t al_step;      /* in which it was read */
	uint16_t strangers_al; /* bits of it that are not of our slaves */
	uint16_t slaves_found; /* how many answered, newest frame */
	uint64_t alerts;
	int has_started;
	int was_fail_safe;
	int is_diff_high;    /* 0x092C, in the newest frame */
	int is_latched_safe; /* overrun policy fail_safe, or the cycle is about to end */
	unsigned last_steps; /* steps left until it stops; 0: no limit */
	unsigned lost_in_row;
	unsigned wkc_low_in_row;
	uint64_t steps;
	long faults_at_start;
	struct event_gate gate[EVENT_COUNT];
	int result;
	_Atomic int stop;              /* [any] */
	_Atomic int wanted_phase;      /* [service] */
	_Atomic uint64_t alerts_shown; /* [cycle] */
	struct cycle_slaves wanted_slaves;
	_Atomic uint64_t dc_sequence; /* [cycle] odd: the pair below is being written */
	_Atomic int64_t dc_ns;        /* [cycle] */
	_Atomic int64_t dc_mono_ns;   /* [cycle] */
};

/* --- cycle_request.c --- */

void cycle_slaves_init(struct cycle *cy);
/** What the service thread named last; valid until the next call. */
const struct cycle_named *cycle_named_take(struct cycle *cy);

/* --- cycle_slaves.c: which slaves are live --- */

/** At the start of a step, after the phase. */
void cycle_update_live(struct cycle *cy);
/** The slaves whose next outputs are real: the live ones, unless something keeps all at fail-safe.
 */
const struct slave_set *cycle_outputs_live(const struct cycle *cy);
/** After the exchange: what the frame shows of the slaves' states and number. */
void cycle_watch_slaves(struct cycle *cy, const struct exchange_result *res);

/* --- cycle_event.c --- */

/** Stamp @ev and push it, unless there were too many of its kind lately. */
void cycle_emit(struct cycle *cy, struct event *ev);
/** Push an event of this cycle without a slave; arguments are clamped to int32. */
void cycle_note(struct cycle *cy, enum event_id id, int64_t value, int64_t arg0, int64_t arg1);

/* --- cycle_follow.c: frames and the reference clock --- */

/** Count what became of the cycle's frames. */
void cycle_count_frames(struct cycle *cy, const struct exchange_result *res);
/** Correction of the next deadline from the frame's DC time, ns. */
int64_t cycle_follow(struct cycle *cy, const struct exchange_result *res);
/** The smallest difference of all slaves ORed that proves that one of them is above @limit_ns. */
int64_t cycle_diff_proof_ns(int64_t limit_ns);
/** 1 if outputs are at fail-safe because lock is lost (dc.unlock_policy). */
int cycle_is_unlocked_safe(const struct cycle *cy);

/* --- cycle_control.c: the control program --- */

/** Call it, if outputs are real in this cycle. */
void cycle_control(struct cycle *cy);
/** 1 if it is there and its outputs are to be fail-safe. */
int cycle_is_control_safe(const struct cycle *cy);

/* --- cycle_end.c --- */

/** All outputs fail-safe from the next frame on; after some of those frames the cycle ends with
 * @result. */
void cycle_end_safely(struct cycle *cy, int result);
/** At the end of a step: stop, if this was the last one. */
void cycle_count_down(struct cycle *cy);

/* --- cycle_skip.c: edges that passed while the master was late --- */

/** The number of this step's sample goes on by @count: that many edges have passed. */
void cycle_pass_edges(struct cycle *cy, uint64_t count);
/**
 * The edges passed in this step: counters, event, a sample each, and the reaction of cycle.overrun.
 * After the exchange: writing many samples must not make a late frame later.
 */
void cycle_report_skipped(struct cycle *cy);

/* --- cycle_judge.c: one sample for every SYNC0 edge --- */

void cycle_push_sample(struct cycle *cy);
struct cycle_place {
	/* 1: the frames passed in their edge's window. 0: while the slaves were still updating
	 * their inputs, or not all of them before the next edge, or there is no plausible DC time.
	 */
	int is_in_window;
	/* Edges between the sample's own and the one that the inputs belong to: its number is to
	 * go on by them. */
	uint64_t passed_edges;
	/* Periods by which the master itself was late: the deadline is to move by them. */
	uint64_t late_periods;
};

/** Which SYNC0 edge the frame's inputs belong to, by the DC time at which it passed. It moves
 * neither number nor deadline. */
struct cycle_place cycle_place(struct cycle *cy, const struct exchange_result *res);
/** 1 if the exchange brought inputs of at least one slave: all answered, or some with per_slave. */
int cycle_has_inputs(const struct cycle *cy, const struct exchange_result *res);

/** Judge each slave's sample by flags and counters. */
void cycle_judge(struct cycle *cy, const struct exchange_result *res, int is_in_window);

#endif
