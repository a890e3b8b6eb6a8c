/* SPDX-License-Identifier: MIT */
/* The status page of ecdaq-dds in the run directory, for `ecdaq status`. */
#ifndef PUBLISH_OWN_STATUS_H
#define PUBLISH_OWN_STATUS_H

#include "base/status.h"
#include "config/config.h"
#include "publish/commands.h"
#include "publish/sample_writer.h"
#include "publish/topics.h"

struct own_status {
	char path[CONFIG_PATH_BYTES];
	struct dds_status *page; /* NULL: not created yet, or no permission */
};

/**
 * Write the page, created if necessary. The run directory may appear later than ecdaq-dds or may
 * not be writable: failure is ignored and retried. Context: publisher's thread.
 */
void own_status_put(struct own_status *own, const struct config *cfg, const struct topics *topics,
		    uint64_t session, const struct sample_counts *samples,
		    struct commands_counts commands);
/** The file stays for readers. */
void own_status_close(struct own_status *own);

#endif
