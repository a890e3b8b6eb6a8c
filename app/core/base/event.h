/* SPDX-License-Identifier: MIT */
/*
 * Something that happened, as a number and arguments: the cycle thread pushes it to the event ring
 * (kind "event", payload struct event), text is made where it is read. One table (event.c) holds
 * the name, severity and text of each.
 */
#ifndef BASE_EVENT_H
#define BASE_EVENT_H

#include <assert.h>
#include <stddef.h>
#include <stdint.h>

enum event_id {
	EVENT_NONE = 0,
	EVENT_STARTED,          /* value: period_ns; arg: slaves */
	EVENT_STOPPED,          /* value: cycles */
	EVENT_BUS_STATE,        /* arg: enum bus_state, from, to */
	EVENT_FRAME_LOST,       /* value: cycle; arg: frames lost in a row */
	EVENT_FRAME_LATE,       /* value: cycle; arg: cycles late */
	EVENT_FRAME_DOUBLED,    /* value: cycle */
	EVENT_WKC_LOW,          /* value: cycle; arg: wkc, expected */
	EVENT_WKC_OK,           /* value: cycle; arg: wkc; how many cycles it was low */
	EVENT_OVERRUN,          /* value: cycle; arg: cycles skipped; late_ns clamped to int32 */
	EVENT_NUMBERING_JUMP,   /* value: first cycle after; arg: cycles left out (clamped) */
	EVENT_DC_LOCKED,        /* value: cycle; arg: phase error ns */
	EVENT_DC_UNLOCKED,      /* value: cycle; arg: phase error ns */
	EVENT_COUNTER_BAD,      /* slave; value: cycle; arg: counter seen, counter expected */
	EVENT_SLAVE_STATE,      /* slave; arg: AL state from, to; value: AL status code */
	EVENT_SLAVE_LOST,       /* slave */
	EVENT_SLAVE_BACK,       /* slave */
	EVENT_OUTPUT_SET,       /* slave; value: channel index; arg: writer, user id */
	EVENT_OUTPUT_FAIL_SAFE, /* arg: reason */
	EVENT_COMMAND_REFUSED,  /* value: channel index or -1; arg: errno, user id */
	EVENT_RT_DEGRADED,      /* arg: which of enum event_rt, errno */
	EVENT_SDO_ABORT,        /* slave; arg: index << 8 | subindex; value: abort code */
	EVENT_LINK,             /* arg: 1 up, 0 down */
	EVENT_RECORD_STARTED,   /* value: first cycle */
	EVENT_RECORD_GAP,       /* value: first cycle missing; arg: how many (clamped) */
	EVENT_RECORD_DISK_FULL, /* value: bytes free */
	EVENT_RECORD_RESUMED,   /* value: cycle */
	EVENT_COMMAND,         /* slave; value: its object or time; arg: enum admin_verb, user id */
	EVENT_CONTROL_OVERRUN, /* value: cycle; arg: ns it took, ns it may take */
	EVENT_CONTROL_CRASHED, /* value: address; arg: number of the signal */
	/* Of ecdaq-sync0, in its own ring; all with slave and line. */
	EVENT_SYNC0_LOST,       /* value: first cycle without an edge; arg: cycles until now */
	EVENT_SYNC0_BACK,       /* value: cycle; arg: cycles without an edge */
	EVENT_SYNC0_MISSING,    /* value: first cycle without an edge; arg: how many */
	EVENT_SYNC0_EXTRA,      /* value: cycle of the first; arg: how many in the window */
	EVENT_SYNC0_OVERFLOW,   /* value: first cycle of the window; arg: edges dropped unread */
	EVENT_SYNC0_PERIOD,     /* value: first cycle of the window; arg: ppb off, limit */
	EVENT_SYNC0_JITTER,     /* the same; arg: p99 ns, limit */
	EVENT_SYNC0_PHASE,      /* the same; arg: ns after the DC time, limit */
	EVENT_SYNC0_SKEW,       /* the same; arg: ns after the first line, limit */
	EVENT_SYNC0_PHASE_STEP, /* value: cycle; arg: ns */
	EVENT_SYNC0_CLOCK_STEP, /* value: cycle; arg: ns that the host's clock went ahead */
	EVENT_SYNC0_CLEAR,      /* value: first cycle of the window; arg: enum sync0_check */
	EVENT_SYNC0_SHOT,       /* value: commanded DC time; arg: ns late, bound of its error */
	EVENT_SYNC0_SHOT_LOST,  /* value: commanded DC time that passed without an edge */
	/* Of ecdaqd again. */
	EVENT_EMERGENCY, /* slave; value: 5 data bytes, the first lowest; arg: error code, register
			  */
	EVENT_STRANGER,  /* slave: whose address it had, or none; arg: position, station
			    address; value: vendor << 32 | product */
	EVENT_STRANGER_GONE,    /* the same */
	EVENT_SLAVE_WRONG,      /* slave in whose place it is; the same */
	EVENT_SLAVE_UNREADABLE, /* slave in whose place it is, or none; the same, value 0 */
	EVENT_SLAVE_ALARM, /* slave that is not tried again; arg: AL status, attempts; value: AL
			      status code, 0: it was late */
	EVENT_OP_LOST, /* value: cycle; arg: AL status of all slaves ORed, slaves that answered */
	EVENT_SLAVE_COUNT,  /* value: cycle; arg: slaves that answered, expected */
	EVENT_SLAVE_ABSENT, /* arg: item of slaves[], optional, that was not found */
	EVENT_DC_DIFF_HIGH, /* value: cycle; arg: |0x092C| of all slaves ORed ns, limit ns */
	EVENT_SM_LENGTH,    /* slave; arg: SyncManager, bytes mapped by CoE; value: bytes by SII */
	EVENT_GATEWAY_LOST, /* arg: mails without an answer, dropped; value: connections closed */
	EVENT_EOE_LOST,   /* slave of the newest one rejected, or none; arg: frames lost, fragments
			     and frames of slaves rejected */
	EVENT_STREAM_GAP, /* value: first cycle missing; arg: how many (clamped) */
	EVENT_COUNT,
};

/* Real-time facilities that ecdaqd requested and did not get (arg[0] of EVENT_RT_DEGRADED; bit in
 * rt_degraded). */
enum event_rt {
	EVENT_RT_PRIORITY,    /* SCHED_FIFO */
	EVENT_RT_CPU,         /* the cycle thread on its own core */
	EVENT_RT_MEMORY,      /* mlockall */
	EVENT_RT_DMA_LATENCY, /* /dev/cpu_dma_latency */
	EVENT_RT_RING_DISK,   /* the run directory is not on a tmpfs */
	EVENT_RT_COUNT,
};

enum event_severity { EVENT_INFO, EVENT_NOTICE, EVENT_WARNING, EVENT_ERROR };

struct event {
	int64_t mono_ns; /* CLOCK_MONOTONIC */
	int64_t tai_ns;  /* CLOCK_TAI */
	uint64_t cycle;  /* cycle in which it was noticed */
	int64_t value;
	int32_t arg[2];
	uint16_t id;        /* enum event_id */
	uint16_t slave_pos; /* 0xffff: none */
	uint32_t line;      /* ecdaq-sync0: of the configuration, from 1; 0: none */
};

static_assert(sizeof(struct event) == 48, "part of the ring's format");

#define EVENT_NO_SLAVE UINT16_C(0xffff)

/** The machine-readable name, "frame_lost"; "unknown" for a number out of range. */
const char *event_name(uint16_t id);
enum event_severity event_severity(uint16_t id);
/** "info", "notice", "warning", "error". */
const char *event_severity_to_str(enum event_severity severity);
/** Back from that; NULL is no name. 0; -EINVAL (@ret untouched). */
int event_severity_parse(const char *name, enum event_severity *ret);
/** One line of text without a newline. Returns its length as snprintf does. */
int event_format(const struct event *ev, char *buf, size_t buf_len);

#endif
