/* SPDX-License-Identifier: MIT */
#include "unit/services/record/memory_file.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "harness/test.h"

static int call_fails(struct memory_file *f)
{
	f->calls++;
	return f->fail_call != 0 && f->calls >= f->fail_call &&
	       f->calls <= f->fail_call + f->fail_count;
}

static void append(struct memory_file *f, const void *data, size_t len)
{
	f->data = realloc(f->data, f->len + len + 1);
	CHECK(f->data != NULL);
	memcpy(f->data + f->len, data, len);
	f->len += len;
}

static int io_write(void *ctx, const void *data, size_t len)
{
	struct memory_file *f = ctx;

	if (call_fails(f)) {
		append(f, data, len / 2); /* half of it gets there: the worst case */
		return f->error;
	}
	if (f->quota > 0 && f->len + len > f->quota) {
		append(f, data, f->len < f->quota ? f->quota - f->len : 0);
		return -ENOSPC;
	}
	append(f, data, len);
	return 0;
}

static int io_sync(void *ctx)
{
	struct memory_file *f = ctx;

	if (call_fails(f)) {
		return f->error;
	}
	f->synced_len = f->len;
	return 0;
}

static int io_truncate(void *ctx, uint64_t bytes)
{
	struct memory_file *f = ctx;

	if (call_fails(f)) {
		return f->error;
	}
	CHECK(bytes <= f->len);
	f->len = (size_t)bytes;
	return 0;
}

struct mcap_io memory_io(struct memory_file *f)
{
	return (struct mcap_io){
		.write = io_write, .sync = io_sync, .truncate = io_truncate, .ctx = f
	};
}

static int source_read_at(void *ctx, uint64_t offset, void *buf, size_t len)
{
	struct memory_file *f = ctx;

	if (call_fails(f)) {
		return f->error;
	}
	CHECK(offset + len <= f->len);
	memcpy(buf, f->data + offset, len);
	return 0;
}

struct mcap_source memory_source(struct memory_file *f, size_t len)
{
	return (struct mcap_source){ .read_at = source_read_at, .bytes = len, .ctx = f };
}

void memory_done(struct memory_file *f)
{
	free(f->data);
	*f = (struct memory_file){ .data = NULL };
}
