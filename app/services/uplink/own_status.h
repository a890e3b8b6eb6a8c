/* SPDX-License-Identifier: MIT */
/* The status page of ecdaq-uplink in the run directory, for `ecdaq status`. */
#ifndef UPLINK_OWN_STATUS_H
#define UPLINK_OWN_STATUS_H

#include "base/status.h"
#include "config/config.h"

struct own_status {
	char path[CONFIG_PATH_BYTES];
	struct uplink_status *page; /* NULL: not created yet, or no permission */
	struct uplink_status now;   /* what is to be in it */
};

/** 0, -ENAMETOOLONG. */
int own_status_init(struct own_status *own, const struct config *cfg, const char *appliance);
/** Write the page, created if necessary. Failure is ignored and retried. Context: the uplink's
 * thread. */
void own_status_put(struct own_status *own);
/** The file stays for readers. */
void own_status_close(struct own_status *own);

#endif
