/* SPDX-License-Identifier: MIT */
/* What ecdaq-dds shows of itself to `ecdaq status`: its page in the run directory. */
#ifndef PUBLISH_OWN_STATUS_H
#define PUBLISH_OWN_STATUS_H

#include "base/status.h"
#include "config/config.h"
#include "publish/commands.h"
#include "publish/samples.h"
#include "publish/topics.h"

struct own_status {
	char path[CONFIG_PATH_BYTES];
	struct dds_status *page; /* NULL: not yet to be had, or not for us to write */
};

/**
 * Say how it is. The run directory may come later than ecdaq-dds and may not be ours to write: the
 * page is tried for each time, and nothing depends on it. Context: publisher's thread.
 */
void own_status_put(struct own_status *own, const struct config *cfg, const struct topics *topics,
		    uint64_t session, const struct samples_counts *samples,
		    struct commands_counts commands);
/** The page stays for readers. */
void own_status_close(struct own_status *own);

#endif
