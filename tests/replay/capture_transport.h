/* SPDX-License-Identifier: MIT */
/* A transport that records the frames that pass through another one, as pcapng. */
#ifndef TESTS_REPLAY_CAPTURE_TRANSPORT_H
#define TESTS_REPLAY_CAPTURE_TRANSPORT_H

#include <stddef.h>

#include "base/platform.h"

/**
 * Wrap @inner (taken over): frames go through it and are recorded in @limit_bytes of memory,
 * allocated here; the file is written when the transport is destroyed. When the memory is full,
 * recording stops. RT-safe but for destroy.
 */
int capture_create(const char *path, size_t limit_bytes, struct platform platform,
		   struct transport inner, struct transport *ret_transport);

#endif
