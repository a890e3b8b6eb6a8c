/* SPDX-License-Identifier: MIT */
/* An ENI file as a configuration tool writes it, and reading one. */
#ifndef TESTS_ENI_BENCH_H
#define TESTS_ENI_BENCH_H

#include <string.h>

#include "eni/eni.h"
#include "harness/test.h"

/* In ISO-8859-1, with CDATA, decimal and hexadecimal numbers, signs, elements in another order than
 * ours, and what ecdaq does not read. One slave with outputs and inputs; logical from 0x01000000.
 */
extern const char *const bench_foreign;

struct seen {
	int result;
	char error[256];
	struct eni *eni; /* NULL after a failure */
};

static inline struct seen bench_read(const char *text)
{
	struct seen seen = { .eni = NULL };

	seen.result =
		eni_read("t.xml", text, strlen(text), &seen.eni, seen.error, sizeof(seen.error));
	return seen;
}

/* @inner in a slave. */
#define BENCH_SLAVE(inner)                                                                         \
	"<EtherCATConfig><Config><Master/>\n<Slave>\n" inner "</Slave></Config></EtherCATConfig>"

#endif
