/* SPDX-License-Identifier: MIT */
/*
 * The seam: everything that is not deterministic enters the master through these two structs, so
 * that a whole run can be repeated from a seed on virtual time (sim/in_process) or live on the
 * machine (base/platform_posix, link/packet_socket). Whoever hands one out keeps ctx alive.
 */
#ifndef BASE_PLATFORM_H
#define BASE_PLATFORM_H

#include <stddef.h>
#include <stdint.h>

#include "clock.h"

/* What the kernel states of the host's clock (adjtimex), by what disciplines it: chrony, or ptp4l
 * and phc2sys of linuxptp. */
struct clock_quality {
	int is_disciplined;   /* not STA_UNSYNC */
	int64_t error_ns;     /* CLOCK_TAI is so far off at most (maxerror) */
	int64_t estimate_ns;  /* probably (esterror) */
	int32_t tai_offset_s; /* TAI - UTC; 0: nothing has set it and CLOCK_TAI equals UTC */
};

struct platform {
	/** The monotonic clock. Context: any, RT-safe. */
	mono_t (*now)(void *ctx);
	/** CLOCK_TAI, ns since 1970; equals UTC where the kernel's TAI offset is unset. RT-safe. */
	int64_t (*tai_ns)(void *ctx);
	/**
	 * Sleep until @deadline; returns 0 or a negative errno. An interrupted sleep is resumed.
	 * In virtual time this advances the clock to @deadline plus a seeded wake latency.
	 */
	int (*sleep_until)(void *ctx, mono_t deadline);
	/** 0 or -errno (ret untouched). NULL: not known. Context: any but the cycle. */
	int (*clock_quality)(void *ctx, struct clock_quality *ret);
	void *ctx;
};

/** Frames out and in on one Ethernet port. A frame is LIMIT_FRAME_BYTES at most, header first. */
struct transport {
	/** Send without waiting. 0, or -errno (-ENOBUFS, -ENETDOWN: the frame is lost). RT-safe. */
	int (*send)(void *ctx, const uint8_t *frame, size_t frame_len);
	/**
	 * Take the next received frame. Returns its length; -EAGAIN when none came before
	 * @deadline (a deadline in the past still polls once); another -errno on failure.
	 * @ret_at, if not NULL, is when the frame was taken. RT-safe: polls, never blocks past
	 * @deadline. On virtual time it advances the clock to the frame's arrival or @deadline.
	 */
	int (*receive)(void *ctx, uint8_t *frame, size_t capacity, mono_t deadline, mono_t *ret_at);
	/** 1 link up, 0 down, -errno unknown. Context: any but the cycle. */
	int (*is_up)(void *ctx);
	void (*destroy)(void *ctx);
	void *ctx;
};

/** The machine's own clocks and sleep. */
struct platform platform_posix(void);

/**
 * The kernel's TAI - UTC in seconds; 0: nothing has set it and CLOCK_TAI equals UTC. 0 or -errno
 * (ret untouched). Context: any but the cycle.
 */
int platform_tai_offset_s(int32_t *ret_offset_s);

#endif
