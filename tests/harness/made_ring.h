/* SPDX-License-Identifier: MIT */
/*
 * Sample rings of two slaves, made for tests, and ways to damage them. Slave 0 ("a") has an adc and
 * a counter, slave 1 ("b") an adc and an output "led".
 */
#ifndef HARNESS_MADE_RING_H
#define HARNESS_MADE_RING_H

#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>

#include "base/ring.h"
#include "base/sample.h"

enum { MADE_SLAVES = 2, MADE_CHANNELS = 4, MADE_IMAGE_BYTES = 8, MADE_OUTPUT_BYTES = 1 };

#define MADE_PERIOD_NS 1000000
#define MADE_SESSION 4711

struct made_meta {
	struct sample_meta head;
	struct slave_info slave[MADE_SLAVES];
	struct channel channel[MADE_CHANNELS];
};

struct made_meta made_meta(void);

/** A path of this process on a tmpfs; @name is part of it. */
const char *made_path(const char *name);

struct ring *made_ring(const char *path, const struct made_meta *meta, uint64_t slots);
/** Push the sample of @cycle, with DC time; @slaves_bad and @flags as given. */
void made_push(struct ring *ring, uint64_t cycle, uint64_t slaves_bad, uint32_t flags);

/** Places in the header of a ring, which is part of its format. */
enum made_place { MADE_VERSION = 8, MADE_PAYLOAD_BYTES = 12, MADE_HEAD = 128 };

void made_overwrite(const char *path, off_t offset, const void *bytes, size_t count);
void made_truncate(const char *path, off_t bytes);

#endif
