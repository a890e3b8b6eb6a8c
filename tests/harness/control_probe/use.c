/* SPDX-License-Identifier: MIT */
#include <dlfcn.h>

#include "harness/control_probe/probe.h"
#include "harness/test.h"

struct probe *probe_use(void)
{
	/* Kept open: what ecdaqd loads afterwards is the same object. */
	static void *object;
	struct probe *probe;

	if (object == NULL) {
		object = dlopen(PROBE_PATH, RTLD_NOW | RTLD_LOCAL);
	}
	probe = object != NULL ? dlsym(object, "probe") : NULL;
	if (probe == NULL) {
		test_fail(__FILE__, __LINE__, "%s: %s", PROBE_PATH, dlerror());
	}
	*probe = (struct probe){ .init = NULL };
	return probe;
}
