/* SPDX-License-Identifier: MIT */
/*
 * Output of ecdaq-sync0: one result per line and window in a ring of its own (kind "sync0", payload
 * struct sync0_result), one status page, and alarms as events in a ring like ecdaqd's. A figure
 * below the noise of the measurement is marked unresolved.
 */
#ifndef BASE_SYNC0_H
#define BASE_SYNC0_H

#include <assert.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>

#include "histogram.h"
#include "limits.h"

/* Source of the edges; readers must show it. */
enum sync0_source {
	SYNC0_GPIO = 0,
	SYNC0_SIMULATED, /* the edge file of ecdaq-sim: no wire, no interrupt */
	SYNC0_RECORDED,  /* a file of recorded edges */
};

enum sync0_kind { SYNC0_WINDOW = 0, SYNC0_SHOT };

/* Ordered by severity: the worst check is the verdict of the line. */
enum sync0_verdict {
	SYNC0_NONE = 0,   /* not enabled, or nothing to judge */
	SYNC0_OK,         /* within the limit, and resolved by the measurement */
	SYNC0_UNRESOLVED, /* the measurement's own noise does not allow an answer */
	SYNC0_WARN,
	SYNC0_FAIL,
};

enum sync0_check {
	SYNC0_CHECK_COUNT = 0, /* pulses against cycles: missing, extra */
	SYNC0_CHECK_PERIOD,    /* SYNC0's rate against the DC time, DC against the host */
	SYNC0_CHECK_JITTER,    /* spread of the period */
	SYNC0_CHECK_PHASE,     /* edge against its DC time */
	SYNC0_CHECK_SKEW,      /* against the first line */
	SYNC0_CHECKS,
};

/* Bits of has and is_resolved. */
enum sync0_figure {
	SYNC0_HAS_PERIOD = 1u << 0,
	SYNC0_HAS_DRIFT = 1u << 1,
	SYNC0_HAS_RATE = 1u << 2,
	SYNC0_HAS_PHASE = 1u << 3,
	SYNC0_HAS_SKEW = 1u << 4,
	SYNC0_HAS_JITTER = 1u << 5, /* for is_resolved only */
};

/*
 * A window of one line, or one shot. Errors are bounds (four sigma of the estimate, plus what
 * cannot be known), not spreads.
 */
struct sync0_result {
	int64_t mono_ns; /* end of the window, or when the shot was due: CLOCK_MONOTONIC */
	int64_t tai_ns;  /* the same instant in CLOCK_TAI */
	uint64_t first_cycle;
	uint64_t cycles;        /* expected pulses */
	uint64_t edges;         /* taken as one of them */
	uint64_t missing;       /* no edge within a quarter of the period of its time */
	uint64_t extra;         /* edges that belong to no cycle */
	uint64_t overflow;      /* edges that the kernel had and dropped from its full queue */
	uint64_t first_missing; /* cycle; 0 if none is missing */
	int64_t step_ns;        /* phase or clock step within the window; 0: none */
	double period_ns;       /* mean, by the host's clock */
	double period_sd_ns;
	int64_t jitter_p50_ns; /* of |period - mean| */
	int64_t jitter_p99_ns;
	int64_t jitter_max_ns;
	double drift_ppb; /* the slave's clock against the host's: positive, it is faster */
	double drift_error_ppb;
	double rate_ppb; /* SYNC0 against DC time as the master reads it; 0 is right */
	double rate_error_ppb;
	int64_t phase_ns;       /* edge after its DC time: median */
	int64_t phase_error_ns; /* half the frame's round trip is most of it */
	int64_t frame_ns;       /* from the edge to the cycle's frame: median */
	int64_t skew_ns;        /* edge after the first line's: median, calibrated */
	int64_t skew_error_ns;
	int64_t dc_diff_ns; /* largest |0x092C| reported by any slave in the window; -1: not read */
	int64_t shot_dc_ns; /* commanded DC time of the shot */
	int64_t shot_late_ns; /* edge after it */
	uint64_t session;     /* of the master; 0: none */
	uint32_t has;         /* enum sync0_figure */
	uint32_t is_resolved; /* the same bits: above the noise */
	uint16_t kind;        /* enum sync0_kind */
	uint16_t slave_pos;
	uint16_t line;  /* from 0, in the order of the configuration */
	uint8_t source; /* enum sync0_source */
	uint8_t verdict;
	uint8_t check[SYNC0_CHECKS]; /* enum sync0_verdict of each */
	uint8_t is_disturbed;        /* the clock stepped: counts are not judged */
	uint8_t has_come;            /* SYNC0_SHOT: 1 */
	uint8_t reserved;
};

static_assert(sizeof(struct sync0_result) == 248, "part of the ring's format");

#define SYNC0_STATUS_MAGIC UINT64_C(0x306e797371646331) /* "1cdqsyn0" */

enum sync0_state {
	SYNC0_WAITING = 0, /* for ecdaqd, or for it to reach OP */
	SYNC0_NO_LINE,     /* no line could be had: see the message */
	SYNC0_NO_DC,       /* the bus runs without distributed clocks */
	SYNC0_LEARNING,    /* the first window is not full yet */
	SYNC0_RUNNING,
	SYNC0_ENDED,
};

enum { SYNC0_LINE_BYTES = 96 };

/* One line since the start. [sync0] */
struct sync0_line_status {
	char slave[32];
	char line[SYNC0_LINE_BYTES]; /* as configured */
	uint32_t slave_pos;
	uint32_t is_open;
	uint32_t is_oneshot;
	uint32_t is_hte;   /* times are of the hardware timestamp engine */
	uint32_t cycle_ns; /* of its SYNC0, as the master states it; 0: none */
	int32_t shift_ns;
	_Atomic uint64_t edges;
	_Atomic uint64_t missing;
	_Atomic uint64_t extra;
	_Atomic uint64_t overflow;
	_Atomic uint64_t steps;
	_Atomic uint64_t shots;      /* commanded */
	_Atomic uint64_t shots_lost; /* expected pulses without an edge */
	_Atomic uint32_t is_lost;    /* now */
	_Atomic uint32_t verdict;    /* of the newest window */
	struct histogram deviation;  /* |period - nominal period| */
};

/* "sync0-status" in the run directory. [sync0] writes all of it. */
struct sync0_status {
	uint64_t magic;
	uint32_t bytes;
	uint32_t source; /* enum sync0_source */
	int64_t pid;
	_Atomic uint64_t text_sequence;
	char message[256]; /* newest trouble, one line */
	_Atomic uint32_t state;
	_Atomic uint32_t line_count;
	_Atomic uint64_t heartbeat;
	_Atomic uint64_t windows;
	_Atomic uint64_t alarms;      /* raised since the start */
	_Atomic int64_t noise_p99_ns; /* of the calibration; -1: not calibrated */
	_Atomic int64_t noise_sd_ns;
	_Atomic int64_t window_ns;
	/* Slaves with SYNC0 that have no line, as all LIMIT_SYNC0_LINES are taken; the first. */
	_Atomic uint32_t beyond_count;
	_Atomic uint32_t beyond_pos;
	char beyond_slave[32];
	struct sync0_line_status line[LIMIT_SYNC0_LINES];
};

/**
 * One line of text. A figure below the noise of the measurement is "< N (unresolved)", never 0.
 * Returns its length as snprintf does.
 */
int sync0_result_format(const struct sync0_result *r, char *buf, size_t buf_len);

/** The slaves without a line in one line of text; "" and 0: there are none. */
int sync0_beyond_format(const struct sync0_status *page, char *buf, size_t buf_len);

const char *sync0_source_to_str(uint32_t source);
const char *sync0_verdict_to_str(uint32_t verdict);
const char *sync0_check_to_str(uint32_t check);
const char *sync0_state_to_str(uint32_t state);

#endif
