/* SPDX-License-Identifier: MIT */
/* The object beside a recording that says what was uploaded: made only once all of it is there.
 * Context: blocking. */
#ifndef UPLINK_MANIFEST_H
#define UPLINK_MANIFEST_H

#include <stdint.h>

#include "uplink/plan.h"

/* What a recording has, found by reading all of it. */
struct contents {
	uint64_t session; /* of the master; 0: not known */
	uint64_t cycles;
	uint64_t first_cycle; /* if cycles > 0, as those below */
	uint64_t last_cycle;
	uint64_t missing; /* between these */
	uint64_t start_ns;
	uint64_t end_ns;
	const char *state; /* "clean", "recovered", "damaged" */
};

/** Of the file @fd. 0; -EPROTO: no recording; -errno of reading it. *@stop ends it: -EINTR. */
int contents_read(int fd, const volatile sig_atomic_t *stop, struct contents *ret);

struct manifest {
	const char *appliance;
	const char *name; /* of the recording's file */
	const char *key;  /* of its object */
	const struct plan *plan;
	const struct contents *contents;
};

/** As JSON, the same for the same recording. NULL: out of memory. free() it. */
char *manifest_format(const struct manifest *m);

#endif
