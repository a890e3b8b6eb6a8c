/* SPDX-License-Identifier: MIT */
/* The name of this machine where others have theirs beside it: subjects, keys. Context: blocking.
 */
#ifndef PROGRAM_APPLIANCE_H
#define PROGRAM_APPLIANCE_H

enum { APPLIANCE_BYTES = 64 };

/** @configured, or, where it is "", the host's name up to its first dot. 0; -EINVAL: it is not made
 * of CONFIG_TOKEN (@ret_name undefined). */
int appliance_name(const char *configured, char ret_name[APPLIANCE_BYTES]);

#endif
