/* SPDX-License-Identifier: MIT */
#include "status.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "foreign.h"
#include "new_file.h"
#include "run_path.h"

enum { READ_TRIES = 100, OWN_MODE = 0644 };

static const char *const bus_names[] = { "DOWN",       "SCANNING", "PREOP",  "SAFEOP", "OP",
					 "RECOVERING", "STOPPED",  "FAILED", "INIT" };
static const char *const dc_names[] = { "off", "acquiring", "locked", "lost" };
static const char *const stream_names[] = { "connecting", "waiting", "recordings", "live" };
static const char *const uplink_names[] = { "idle", "sending", "retrying" };
static const char *const record_names[] = { "waiting", "running", "disk full", "ended", "failed" };

static const char *name_of(const char *const *names, size_t count, uint32_t state)
{
	return state < count ? names[state] : "unknown";
}

const char *bus_state_to_str(uint32_t state)
{
	return name_of(bus_names, sizeof(bus_names) / sizeof(bus_names[0]), state);
}

const char *dc_state_to_str(uint32_t state)
{
	return name_of(dc_names, sizeof(dc_names) / sizeof(dc_names[0]), state);
}

static const char *const control_names[] = {
	[CONTROL_NONE] = "none",       [CONTROL_WAITING] = "waiting", [CONTROL_RUNNING] = "running",
	[CONTROL_SAFE] = "safe",       [CONTROL_PARKED] = "parked",   [CONTROL_STOPPED] = "stopped",
	[CONTROL_CRASHED] = "crashed", [CONTROL_STUCK] = "stuck",
};

const char *control_state_to_str(uint32_t state)
{
	return name_of(control_names, sizeof(control_names) / sizeof(control_names[0]), state);
}

const char *stream_state_to_str(uint32_t state)
{
	return name_of(stream_names, sizeof(stream_names) / sizeof(stream_names[0]), state);
}

const char *uplink_state_to_str(uint32_t state)
{
	return name_of(uplink_names, sizeof(uplink_names) / sizeof(uplink_names[0]), state);
}

const char *record_state_to_str(uint32_t state)
{
	return name_of(record_names, sizeof(record_names) / sizeof(record_names[0]), state);
}

void *status_create(const char *path, uint64_t magic, uint32_t bytes, unsigned file_mode)
{
	struct new_file file = { .map = NULL };
	int r = new_file_create(path, file_mode, bytes, &file);

	if (r == 0) {
		memcpy(file.map, &magic, sizeof(magic));
		memcpy((char *)file.map + sizeof(magic), &bytes, sizeof(bytes));
		r = new_file_publish(&file, path);
	}
	if (r < 0) {
		errno = -r;
		return NULL;
	}
	return file.map;
}

void *status_create_own(const char *path, uint64_t magic, uint32_t bytes)
{
	int r = run_path_own_folder(path);

	if (r < 0) {
		errno = -r;
		return NULL;
	}
	return status_create(path, magic, bytes, OWN_MODE);
}

/* 1: all texts of the copy are whole; 0: one was being written; -EPROTO: the file is too short. */
static int read_once(int fd, uint32_t bytes, size_t sequence_offset, void *ret_page)
{
	uint64_t before = 0;
	uint64_t after = 0;
	size_t n = sequence_offset == 0 ? 0 : sizeof(before);
	int r = foreign_read(fd, &before, n, sequence_offset);

	atomic_thread_fence(memory_order_acquire);
	r = r < 0 ? r : foreign_read(fd, ret_page, bytes, 0);
	atomic_thread_fence(memory_order_acquire);
	r = r < 0 ? r : foreign_read(fd, &after, n, sequence_offset);
	return r < 0 ? -EPROTO : before % 2 == 0 && before == after;
}

int status_read(const char *path, uint64_t magic, uint32_t bytes, size_t sequence_offset,
		void *ret_page)
{
	struct stat st;
	int fd = foreign_open(path, &st);
	int r;

	if (fd < 0) {
		return fd;
	}
	r = st.st_size == (off_t)bytes ? 0 : -EPROTO;
	/* A writer that died during a write leaves the sequence odd: accept the text after a while.
	 */
	for (int tries = 0; r == 0 && tries < READ_TRIES; tries++) {
		r = read_once(fd, bytes, sequence_offset, ret_page);
	}
	close(fd);
	if (r < 0 || memcmp(ret_page, &magic, sizeof(magic)) != 0 ||
	    memcmp((char *)ret_page + sizeof(magic), &bytes, sizeof(bytes)) != 0) {
		return -EPROTO;
	}
	return 0;
}

void status_unmap(const void *page, uint32_t bytes)
{
	if (page != NULL) {
		munmap((void *)(uintptr_t)page, bytes);
	}
}

/* NOLINTNEXTLINE(readability-non-const-parameter): the atomic store writes through it */
void status_text_set(_Atomic uint64_t *sequence, char *field, uint32_t field_bytes,
		     const char *text)
{
	size_t len = strnlen(text, field_bytes - 1);

	atomic_fetch_add_explicit(sequence, 1, memory_order_acq_rel);
	for (size_t i = 0; i < field_bytes; i++) {
		__atomic_store_n(field + i, i < len ? text[i] : '\0', __ATOMIC_RELAXED);
	}
	atomic_fetch_add_explicit(sequence, 1, memory_order_release);
}
