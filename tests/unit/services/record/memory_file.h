/* SPDX-License-Identifier: MIT */
/* A file in memory for the MCAP writer and reader, whose n-th call can be made to fail. */
#ifndef TESTS_UNIT_RECORD_MEMORY_FILE_H
#define TESTS_UNIT_RECORD_MEMORY_FILE_H

#include "record/mcap.h"

struct memory_file {
	uint8_t *data;
	size_t len;
	size_t synced_len; /* what a power cut would leave */
	unsigned calls;
	unsigned fail_call;  /* the call with this number (from 1 on) fails; 0: none */
	unsigned fail_count; /* and so many more */
	int error;           /* with this */
	size_t quota;        /* writing beyond fails with -ENOSPC; 0: no quota */
};

struct mcap_io memory_io(struct memory_file *f);
/** The first @len bytes of it. */
struct mcap_source memory_source(struct memory_file *f, size_t len);
void memory_done(struct memory_file *f);

#endif
