/* SPDX-License-Identifier: MIT */
/* ecdaq-dds without its command line: follows the master, publishes, forwards commands. */
#ifndef PUBLISH_PUBLISHER_H
#define PUBLISH_PUBLISHER_H

#include <stddef.h>

#include "config/config.h"

struct publisher;

/** @cfg is kept by the caller. 0, or -errno with one line in @error. Context: blocking. */
int publisher_create(const struct config *cfg, struct publisher **ret_publisher, char *error,
		     size_t error_bytes);
void publisher_destroy(struct publisher *publisher);

/** One step; blocks for at most one cycle. 0; -EINVAL: DDS uses the EtherCAT NIC: end. */
int publisher_step(struct publisher *publisher, char *error, size_t error_bytes);

#endif
