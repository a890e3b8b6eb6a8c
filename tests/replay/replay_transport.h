/* SPDX-License-Identifier: MIT */
/*
 * A capture (pcapng) as a transport: what the master sends must be, byte for byte, what was sent
 * when the capture was made; the answers come from the capture, on a virtual clock.
 */
#ifndef TESTS_REPLAY_REPLAY_TRANSPORT_H
#define TESTS_REPLAY_REPLAY_TRANSPORT_H

#include <stddef.h>
#include <stdint.h>

#include "base/platform.h"

struct replay;

/* What of a sent frame need not be as captured. */
enum replay_mask {
	REPLAY_EXACT = 0,
	REPLAY_MASK_INDEX = 1u << 0,  /* index bytes of the datagrams */
	REPLAY_MASK_SOURCE = 1u << 1, /* the master's MAC address */
};

/** Load @path. 0; or -errno with one line in @error. Free with replay_destroy(). Context: blocking.
 */
int replay_create(const char *path, unsigned mask, struct replay **ret_replay, char *error,
		  size_t error_bytes);
void replay_destroy(struct replay *rp);

/** Time that moves with the frames: an answer comes as long after its frame as it did. */
struct platform replay_platform(struct replay *rp);
/**
 * Its destroy does nothing: the replay outlives the line. After a frame that is not the captured
 * one, send() returns -EPROTO for good, and replay_trouble() says which.
 */
struct transport replay_transport(struct replay *rp);

/** Frames of the master in the capture, and how many were sent as they should be. */
size_t replay_frames(const struct replay *rp);
size_t replay_matched(const struct replay *rp);
/** One line about the first frame that differed; "" for none. */
const char *replay_trouble(const struct replay *rp);

#endif
