/* SPDX-License-Identifier: MIT */
/*
 * A copy of every frame of a transport, out and in, for a capture file. Whoever owns the transport,
 * which is the cycle thread in operation, copies each frame into a ring that was made before; it
 * never waits, and what nobody reads in time is overwritten. Without a ring it costs a call and a
 * branch for each frame.
 */
#ifndef LINK_CAPTURE_H
#define LINK_CAPTURE_H

#include "base/platform.h"

struct capture;
struct ring;

/** 0 or -ENOMEM. Free with capture_destroy() when the transport is destroyed. Context: blocking. */
int capture_create(struct platform platform, struct capture **ret_capture);
void capture_destroy(struct capture *capture);

/**
 * @inner with the copy, in place of @inner, which it destroys with itself. One at a time. Context:
 * service thread.
 */
struct transport capture_wrap(struct capture *capture, struct transport inner);

/**
 * From now on frames go to @ring (slots of FRAME_SLOT_BYTES); NULL: to none. The owner of the
 * transport may still be writing to the ring before: it stays valid until the transport has another
 * owner. Context: service thread.
 */
void capture_set_ring(struct capture *capture, struct ring *ring);

#endif
