/* SPDX-License-Identifier: MIT */
/* ESI texts around a device, and the devices that come out. */
#ifndef TESTS_ESI_BENCH_H
#define TESTS_ESI_BENCH_H

#include <stdarg.h>

#include "esi/esi.h"
#include "harness/test.h"

enum { SEEN_MAX = 16 };

struct seen {
	struct esi_device *device[SEEN_MAX];
	size_t count;
	uint32_t wanted; /* product; 0: all */
	char error[256];
	int result;
};

static inline int bench_wants(void *ctx, const struct esi_identity *id)
{
	const struct seen *seen = ctx;

	return seen->wanted == 0 || id->product == seen->wanted;
}

static inline int bench_take(void *ctx, struct esi_device *device)
{
	struct seen *seen = ctx;

	CHECK(seen->count < SEEN_MAX);
	seen->device[seen->count++] = device;
	return 0;
}

static inline void bench_read(struct seen *seen, const char *text, size_t len)
{
	const struct esi_visitor visitor = { bench_wants, bench_take, seen };

	seen->result = esi_read("t.xml", text, len, &visitor, seen->error, sizeof(seen->error));
}

#define BENCH_HEAD                                                                                 \
	"<?xml version=\"1.0\"?>\n<EtherCATInfo><Vendor><Id>#x1337</Id><Name>V</Name></Vendor>\n"  \
	"<Descriptions><Groups><Group><Type>g</Type><Name LcId=\"1031\">Klemmen</Name>"            \
	"<Name LcId=\"1033\">Terminals</Name></Group></Groups><Devices>\n"
#define BENCH_TAIL "\n</Devices></Descriptions></EtherCATInfo>"
/* The text within it begins in line 4. */
#define BENCH_DEVICE(inside)                                                                       \
	BENCH_HEAD "<Device Physics=\"YY\">"                                                       \
		   "<Type ProductCode=\"#x10\" RevisionNo=\"2\">EL1</Type>\n" inside               \
		   "</Device>" BENCH_TAIL

static inline struct seen bench_text(const char *text)
{
	struct seen seen = { .count = 0 };

	bench_read(&seen, text, strlen(text));
	return seen;
}

static inline void bench_free(struct seen *seen)
{
	for (size_t i = 0; i < seen->count; i++) {
		esi_device_free(seen->device[i]);
	}
	seen->count = 0;
}

#endif
