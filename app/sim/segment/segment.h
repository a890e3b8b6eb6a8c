/* SPDX-License-Identifier: MIT */
/*
 * A segment on one axis of true time: their ESCs, clocks and applications, the wires between
 * them. Nothing here reads a clock or waits: segment_advance() runs everything that is due,
 * segment_frame() sends a frame through. Same calls, same results.
 */
#ifndef SIM_SEGMENT_SEGMENT_H
#define SIM_SEGMENT_SEGMENT_H

#include <stddef.h>
#include <stdint.h>

#include "base/limits.h"
#include "segment/device.h"
#include "segment/esc.h"
#include "segment/frame_path.h"
#include "segment/signal.h"

enum { SEGMENT_SII_BYTES = 65536 };

struct segment_slave_spec {
	const struct esc_features *features;
	const uint8_t *sii; /* copied */
	size_t sii_bytes;
	struct sim_device *device; /* taken over; NULL: the ESC alone */
	struct signal_spec signal;
	double ppm;              /* of its crystal */
	double wander_ppm;       /* how far the crystal wanders from that; 0: not */
	int64_t jitter_ns;       /* its time stamps are off by up to this, either way; 0: exact */
	uint64_t seed;           /* of wander and jitter */
	uint64_t clock_start_ns; /* its local time at power-on */
	int parent;              /* index of the slave towards the master; -1: the master */
	unsigned parent_port;    /* 1, 2 or 3 of the parent */
	int64_t wire_ns;         /* one way, from the parent's port */
	int64_t processing_ns;   /* port 0 to the next port, through the processing unit */
	int64_t forwarding_ns;   /* any port to the next, on the way back */
};

struct segment;

/**
 * Power up @count slaves at @t_ns; their devices are taken over, on failure, too. 0; -EINVAL: not 1
 * to LIMIT_SLAVES of them, or one hangs on no free port; -ENOMEM.
 */
int segment_create(const struct segment_slave_spec *slaves, size_t count, int64_t t_ns,
		   struct segment **ret_segment);
void segment_destroy(struct segment *segment);

/** Connect a free port of @slave to the master's second port. 0, or -EINVAL. */
int segment_close_ring(struct segment *segment, size_t slave, unsigned port, int64_t wire_ns);

/** Run every event up to and including @t_ns, in order. Time never goes back. */
void segment_advance(struct segment *segment, int64_t t_ns);
/** True time of the next event of anything; INT64_MAX: none. */
int64_t segment_next_event_ns(const struct segment *segment);

/* Where and when the start of a frame comes back to the master. */
struct segment_return {
	enum segment_port port;
	int64_t t_ns;
};

/**
 * A frame whose start leaves the master's port @from at @t_ns, or as soon as the wire is free:
 * changed in place. 0 with when and where its start is back; -ENOLINK: it does not come back;
 * -EBADMSG: it was no whole EtherCAT frame (slaves destroy it); -ENOBUFS: 5 ms of frames stand
 * before the wire. The segment is advanced to @t_ns first; slaves are run until the frame has
 * passed them.
 */
int segment_frame_from(struct segment *segment, enum segment_port from, int64_t t_ns,
		       uint8_t *frame, size_t frame_len, struct segment_return *ret);
/** The same from the primary port of a segment that is no ring. */
int segment_frame(struct segment *segment, int64_t t_ns, uint8_t *frame, size_t frame_len,
		  int64_t *ret_back_ns);
/**
 * A frame that is damaged on the wire towards @slave: nobody from there on takes it, each counts
 * it, and the master's NIC drops it.
 */
void segment_damaged_frame(struct segment *segment, int64_t t_ns, size_t slave);

/** 1 if the master's port has a link. */
int segment_is_up(const struct segment *segment, enum segment_port port);

size_t segment_slave_count(const struct segment *segment);
struct esc *segment_esc(struct segment *segment, size_t slave);
struct sim_device *segment_device(struct segment *segment, size_t slave);

/** Every SYNC0 edge of every slave, exact. */
void segment_sync0_to(struct segment *segment,
		      void (*sink)(void *ctx, unsigned slave, int64_t t_ns,
				   uint64_t system_time_ns),
		      void *ctx);

/* --- faults that are a state of the segment --- */

/** Cut or heal the cable towards @slave from its parent. Its port errors are counted as a link
 * loss. */
void segment_cut(struct segment *segment, size_t slave, int64_t t_ns);
void segment_heal(struct segment *segment, size_t slave, int64_t t_ns);
/** A slave without power passes nothing on. Power-on starts it anew, with its clock at 0. */
void segment_power_off(struct segment *segment, size_t slave, int64_t t_ns);
void segment_power_on(struct segment *segment, size_t slave, int64_t t_ns);

/**
 * Take @slave out of the line, with power, and connect what was behind its port 1 to its parent;
 * and put it back. 0; -EINVAL: it has slaves at other ports, or it is the only slave, or part of a
 * ring's end.
 */
int segment_unplug(struct segment *segment, size_t slave, int64_t t_ns);
int segment_plug(struct segment *segment, size_t slave, int64_t t_ns);

/** The same for the cable that closes the ring. */
void segment_cut_ring(struct segment *segment, int64_t t_ns);
void segment_heal_ring(struct segment *segment, int64_t t_ns);
/** The crystal of @slave is @ppm off from now on. */
void segment_drift(struct segment *segment, size_t slave, double ppm, int64_t t_ns);
/** Power-on reset of the chip and its application, without a loss of links. */
void segment_reset(struct segment *segment, size_t slave, int64_t t_ns);

#endif
