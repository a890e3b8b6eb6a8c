/* SPDX-License-Identifier: MIT */
/*
 * Read the samples and events of ecdaqd from a program of your own, in C or C++. Installed as
 * <ecdaq/reader.h>; link with `pkg-config --libs ecdaq` or ecdaq::ecdaq of find_package(ecdaq).
 *
 * A session is one run of the bus: it has its own slaves and channels. A reader follows ecdaqd
 * through its restarts, from one session to the next. It reads only: nothing it does, a crash
 * included, disturbs the master, and no damage of the shared memory harms it.
 *
 * Context: one thread at a time for each reader. Pointers that a function returns belong to the
 * reader and are valid until the next call of ecdaq_reader_next() or ecdaq_events_next(), those to
 * slaves and channels until the next ECDAQ_READ_SESSION.
 */
#ifndef ECDAQ_READER_H
#define ECDAQ_READER_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Structs only grow at their ends; a change that breaks programs is a new major version. */
#define ECDAQ_READER_API 1

/* Where the first session is entered; later ones are read from their first sample. */
enum ecdaq_start {
	ECDAQ_FROM_NEWEST = 0, /* what is measured from now on */
	ECDAQ_FROM_OLDEST = 1, /* first what the ring still holds, 64 s by default */
};

/* What ecdaq_reader_next() returns, if it is not a negative errno. */
enum ecdaq_read {
	ECDAQ_READ_TIMEOUT = 0, /* nothing new within the timeout */
	ECDAQ_READ_SAMPLE = 1,  /* the next sample: ecdaq_reader_sample() */
	ECDAQ_READ_LOST = 2,    /* too slow: ecdaq_reader_lost() samples were overwritten unread */
	ECDAQ_READ_SESSION = 3, /* a session has begun: look up your channels */
	ECDAQ_READ_ENDED = 4,   /* the session has ended and all of it was read; the next call waits
				 * for the next session */
};

/* Why a sample is not good for some or all slaves, or what else is remarkable about it. */
enum ecdaq_sample_flag {
	ECDAQ_SAMPLE_LOST = 1 << 0,        /* no frame came back in time: the inputs are old */
	ECDAQ_SAMPLE_LATE = 1 << 1,        /* a frame of an earlier cycle came and was dropped */
	ECDAQ_SAMPLE_WKC_LOW = 1 << 2,     /* fewer slaves answered than expected */
	ECDAQ_SAMPLE_NOT_OP = 1 << 3,      /* the bus is not in OP */
	ECDAQ_SAMPLE_FAIL_SAFE = 1 << 4,   /* the outputs hold their fail-safe values */
	ECDAQ_SAMPLE_SKIPPED = 1 << 5,     /* the master overran: no frame was sent */
	ECDAQ_SAMPLE_BAD_COUNTER = 1 << 6, /* a slave's conversion counter is wrong */
	ECDAQ_SAMPLE_DC_UNLOCKED = 1 << 7, /* the master is not locked to the reference clock */
	ECDAQ_SAMPLE_DOUBLED = 1 << 8,     /* a frame came back twice */
	ECDAQ_SAMPLE_UNCHECKED = 1 << 9,   /* first sample of a slave in OP: nothing to compare with
					    */
};

/* One cycle: the inputs of all slaves at one SYNC0 edge, and the outputs of that cycle. */
struct ecdaq_sample {
	uint64_t session;        /* identifies the session; the same in all its samples */
	uint64_t cycle;          /* index of the SYNC0 edge; one more in every sample */
	int64_t dc_time_ns;      /* DC time of that edge, ns since 2000-01-01; 0 without DC */
	int64_t utc_ns;          /* the same instant, ns since 1970, as good as the host's clock */
	uint32_t flags;          /* enum ecdaq_sample_flag */
	int32_t wake_latency_ns; /* of the master in this cycle */
	int32_t round_trip_ns;   /* of the frame; -1: lost */
	int32_t phase_error_ns;  /* of the frame against its set point after SYNC0 */
	uint16_t wkc;            /* working counter of the process data */
	uint16_t wkc_expected;
	uint32_t image_bytes;
	const uint8_t *image; /* process image: outputs, then inputs */
};

struct ecdaq_slave {
	const char *name;   /* "piccolo0" */
	const char *device; /* name in the slave's SII */
	uint32_t position;  /* on the bus, from 0 */
	uint32_t vendor;
	uint32_t product;
	uint32_t revision;
	uint32_t serial;
};

enum ecdaq_channel_type {
	ECDAQ_BOOL = 1,
	ECDAQ_UINT = 2,
	ECDAQ_INT = 3,
	ECDAQ_FLOAT = 4,
};

/* One mapped variable. physical = raw * scale + offset, in unit. */
struct ecdaq_channel {
	const char *name; /* "piccolo0.adc" */
	const char *unit; /* "" where raw counts are all there is */
	uint32_t slave;   /* position of its slave */
	uint32_t type;    /* enum ecdaq_channel_type */
	uint32_t is_output;
	uint32_t bit_offset; /* in the process image */
	uint32_t bit_len;    /* 1 to 64 */
	uint16_t index;      /* CoE object, 0x6000 */
	uint16_t subindex;
	double scale;
	double offset;
};

struct ecdaq_event {
	int64_t mono_ns;      /* CLOCK_MONOTONIC of the host at the event */
	int64_t tai_ns;       /* CLOCK_TAI, ns since 1970 */
	uint64_t cycle;       /* in which it was noticed */
	int32_t slave;        /* position; -1: none */
	const char *name;     /* "frame_lost" */
	const char *severity; /* "info", "notice", "warning", "error" */
	const char *text;     /* one line */
};

struct ecdaq_reader;
struct ecdaq_events;

/**
 * Read the samples in @run_dir, the run directory of ecdaqd; NULL or "": the one that ecdaqd itself
 * takes (option run_dir). Succeeds without an ecdaqd; ecdaq_reader_next() then waits for one. 0;
 * -ENOMEM; -ENAMETOOLONG (ret untouched on failure). Release with ecdaq_reader_close().
 */
int ecdaq_reader_open(const char *run_dir, enum ecdaq_start start,
		      struct ecdaq_reader **ret_reader);
/** NULL is allowed. */
void ecdaq_reader_close(struct ecdaq_reader *reader);

/**
 * Take the next step; wait up to @timeout_ms for it (0: do not wait, -1: without limit). An enum
 * ecdaq_read, or -ENOMEM; if at the start of a session, for all of its samples.
 */
int ecdaq_reader_next(struct ecdaq_reader *reader, int timeout_ms);

/**
 * After ECDAQ_READ_TIMEOUT: why no session can be read. After ECDAQ_READ_ENDED: why it did not end
 * in order. One line; "" if nothing is wrong.
 */
const char *ecdaq_reader_problem(const struct ecdaq_reader *reader);

/** The sample that was read last; NULL before the first one of a session. */
const struct ecdaq_sample *ecdaq_reader_sample(const struct ecdaq_reader *reader);
/** After ECDAQ_READ_LOST: the number of samples that were overwritten. */
uint64_t ecdaq_reader_lost(const struct ecdaq_reader *reader);

/**
 * 1 if the sample read last is good for @slave (a position): in OP, inputs of this cycle,
 * conversion counter right. 0: it is not, or there is no such slave or sample.
 */
int ecdaq_reader_is_good(const struct ecdaq_reader *reader, uint32_t slave);

/** Cycle time in ns; 0 without a session. */
uint64_t ecdaq_reader_period_ns(const struct ecdaq_reader *reader);
/** Number of slaves and of channels; 0 without a session. */
uint32_t ecdaq_reader_slave_count(const struct ecdaq_reader *reader);
uint32_t ecdaq_reader_channel_count(const struct ecdaq_reader *reader);
/** The slave at @position and the channel at @index; NULL: there is none. */
const struct ecdaq_slave *ecdaq_reader_slave(const struct ecdaq_reader *reader, uint32_t position);
const struct ecdaq_channel *ecdaq_reader_channel(const struct ecdaq_reader *reader, uint32_t index);
/** Index of the channel called @name; -ENOENT: there is none, or no session. */
int ecdaq_reader_find(const struct ecdaq_reader *reader, const char *name);

/** Physical value of a channel in the sample read last; NaN: no such channel or sample. */
double ecdaq_reader_value(const struct ecdaq_reader *reader, uint32_t channel);
/** Its bits, zero-extended to 64; 0: no such channel or sample. */
uint64_t ecdaq_reader_raw(const struct ecdaq_reader *reader, uint32_t channel);

/**
 * Read the events in @run_dir (as in ecdaq_reader_open()). 0; -ENOMEM; -ENAMETOOLONG (ret untouched
 * on failure). Release with ecdaq_events_close().
 */
int ecdaq_events_open(const char *run_dir, enum ecdaq_start start,
		      struct ecdaq_events **ret_events);
/** NULL is allowed. */
void ecdaq_events_close(struct ecdaq_events *events);
/** The next event, or NULL if there is none yet. Never waits. */
const struct ecdaq_event *ecdaq_events_next(struct ecdaq_events *events);
/** Number of events since ecdaq_events_open() that were overwritten before they could be read. */
uint64_t ecdaq_events_lost(const struct ecdaq_events *events);

/** Version of the library, "0.1.0". */
const char *ecdaq_version(void);

#ifdef __cplusplus
}
#endif

#endif
