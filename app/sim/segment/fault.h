/* SPDX-License-Identifier: MIT */
/*
 * Faults: what happens to frames and slaves, and when. A plan is a list of lines, from a file, a
 * test or the control socket of ecdaq-sim:
 *
 *   WHEN ACTION [KEY=VALUE...]
 *   at=2s lose                         one frame, the first after 2 s
 *   frame=1000 delay by=300us          the 1000th frame
 *   p=1 jitter by=500ns                each frame reaches the slaves later by 0 to 500 ns
 *   at=1s for=5s mirror                it comes back unchanged, from a plug that loops the port
 *   frame=1000 hold                    it comes back only when the next frame is sent
 *   at=2s damage slave=1               its check sum is wrong from the wire towards slave 1 on
 *   every=500 double                   each 500th frame
 *   p=0.001 corrupt                    each frame with this probability
 *   at=1s for=200ms lose               all frames of that time
 *   at=3s cut slave=1 / heal slave=1 / power-off slave=0 / power-on slave=0
 *   at=3s reset slave=1                as if RES was written to 0x0040
 *   at=3s drift slave=1 ppm=80
 *   at=3s al-error slave=1 code=0x001b
 *   at=3s port-error slave=1 port=0
 *   at=3s watchdog slave=1             its process data watchdog expires
 *   at=3s mailbox-stuck slave=1 for=1s its answers are lost, for ever without for=
 *   at=3s mailbox kind=late slave=1 by=1s  its next answer: late, double, counter, length, silent,
 *                                      eoe, abort; count=N: the next N; busy: it reads no request
 *   at=3s sync0-lost slave=1 count=3   its next SYNC0 pulses do not come out of the chip
 *   at=3s identity slave=1 product=0x1 its EEPROM names another product from now on
 *   at=0s unplug slave=1               out of the line, with power; its neighbours are connected
 *   at=3s plug slave=1 address=0x1001  back, with the station address of another master (default:
 *                                      the one it has)
 *   at=3s slow slave=1 state=safeop by=3s its changes to SAFE-OP take 3 s
 *   at=3s refuse slave=1 state=safeop code=0x0018 it refuses SAFE-OP with that code
 *   at=0s switch slave=1 id=5          its identification switch (AL control bit 5) is at 5
 *   at=3s obey slave=1                 neither slow nor refusing any more
 */
#ifndef SIM_SEGMENT_FAULT_H
#define SIM_SEGMENT_FAULT_H

#include <stddef.h>
#include <stdint.h>

#include "segment/segment.h"

enum fault_action {
	FAULT_LOSE,     /* the frame goes through the slaves and is lost on the way back */
	FAULT_DROP,     /* the frame is lost before the first slave */
	FAULT_DELAY,    /* it comes back later by @by_ns */
	FAULT_JITTER,   /* it reaches the slaves later by up to @by_ns */
	FAULT_MIRROR,   /* it comes back unchanged; no slave has seen it */
	FAULT_HOLD,     /* it comes back when the next frame is sent */
	FAULT_DOUBLE,   /* it comes back twice */
	FAULT_TRUNCATE, /* it comes back short */
	FAULT_DAMAGE,   /* nobody from @slave on takes it, and it is lost */
	FAULT_CORRUPT,  /* one byte of it is changed */
	FAULT_CUT,
	FAULT_HEAL,
	FAULT_POWER_OFF,
	FAULT_POWER_ON,
	FAULT_RESET,
	FAULT_DRIFT,
	FAULT_AL_ERROR,
	FAULT_PORT_ERROR,
	FAULT_WATCHDOG,
	FAULT_MAILBOX_STUCK,
	FAULT_MAILBOX,
	FAULT_IDENTITY,
	FAULT_SYNC0_LOST,
	FAULT_UNPLUG,
	FAULT_PLUG,
	FAULT_SLOW,
	FAULT_REFUSE,
	FAULT_OBEY,
	FAULT_SWITCH,
};

enum fault_trigger { FAULT_AT, FAULT_FRAME, FAULT_EVERY, FAULT_PROBABLY };

struct fault {
	enum fault_trigger trigger;
	enum fault_action action;
	int64_t at_ns;      /* FAULT_AT: from the plan's start */
	int64_t for_ns;     /* 0: once */
	uint64_t frame;     /* FAULT_FRAME, FAULT_EVERY */
	double probability; /* FAULT_PROBABLY */
	int64_t by_ns;
	unsigned slave;
	unsigned port;
	double ppm;
	uint16_t code;
	uint32_t product;
	uint32_t count;
	enum esc_mailbox_fault_kind kind;
	uint16_t address; /* 0: as it is */
	uint8_t state;    /* AL state */
	uint16_t id;      /* of the identification switch */
	int is_done;
};

/* What is to be done with one frame. */
struct fault_verdict {
	int is_dropped; /* before the slaves */
	int is_lost;    /* behind them */
	int is_mirrored;
	int is_doubled;
	int is_held;        /* until the next frame is sent */
	int64_t delay_ns;   /* on the way back */
	int64_t transit_ns; /* on the way to the slaves */
	size_t truncate_to; /* 0: not */
	size_t corrupt_at;  /* 0: not */
	uint8_t corrupt_xor;
};

/**
 * Take a line apart (it is changed). 1 and @ret; 0: empty or a comment; -EINVAL with why in @error.
 */
int fault_parse(char *line, size_t slave_count, struct fault *ret, char *error, size_t error_bytes);

struct fault_plan;

struct fault_plan *fault_plan_create(uint64_t seed, int64_t start_ns);
void fault_plan_destroy(struct fault_plan *plan);
/** Add one line. 0; -EINVAL with why in @error; empty lines and # comments are fine. */
int fault_plan_add(struct fault_plan *plan, const char *line, size_t slave_count, char *error,
		   size_t error_bytes);
/** Add a file; "FILE:LINE: why" in @error. */
int fault_plan_load(struct fault_plan *plan, const char *path, size_t slave_count, char *error,
		    size_t error_bytes);
/** Times of lines added from now on count from @start_ns. */
void fault_plan_restart(struct fault_plan *plan, int64_t start_ns);

/** Do what is due to the segment at @t_ns, and say what happens to the frame that is sent now. */
struct fault_verdict fault_plan_judge(struct fault_plan *plan, struct segment *segment,
				      int64_t t_ns, size_t frame_len);

#endif
