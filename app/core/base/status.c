/* SPDX-License-Identifier: MIT */
#include "status.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "pages.h"

static const char *const bus_names[] = { "DOWN", "SCANNING",   "PREOP",   "SAFEOP",
					 "OP",   "RECOVERING", "STOPPED", "FAILED" };
static const char *const dc_names[] = { "off", "acquiring", "locked", "lost" };
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

const char *record_state_to_str(uint32_t state)
{
	return name_of(record_names, sizeof(record_names) / sizeof(record_names[0]), state);
}

void *status_create(const char *path, uint64_t magic, uint32_t bytes, unsigned file_mode)
{
	char temporary[4096];
	void *map = MAP_FAILED;
	int fd;
	int r;

	if (snprintf(temporary, sizeof(temporary), "%s.new", path) >= (int)sizeof(temporary)) {
		errno = ENAMETOOLONG;
		return NULL;
	}
	fd = open(temporary, O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
	if (fd < 0) {
		return NULL;
	}
	r = fchmod(fd, file_mode) < 0 ? errno : posix_fallocate(fd, 0, bytes);
	if (r == 0) {
		map = mmap(NULL, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, fd, 0);
		r = map == MAP_FAILED ? errno : 0;
	}
	close(fd);
	if (r == 0) {
		pages_touch(map, bytes);
		memcpy(map, &magic, sizeof(magic));
		memcpy((char *)map + sizeof(magic), &bytes, sizeof(bytes));
		r = rename(temporary, path) < 0 ? errno : 0;
	}
	if (r != 0) {
		if (map != MAP_FAILED) {
			munmap(map, bytes);
		}
		unlink(temporary);
		errno = r;
		return NULL;
	}
	return map;
}

const void *status_open(const char *path, uint64_t magic, uint32_t bytes)
{
	int fd = open(path, O_RDONLY | O_CLOEXEC);
	struct stat st;
	void *map = MAP_FAILED;
	int r = EPROTO;

	if (fd < 0) {
		return NULL;
	}
	if (fstat(fd, &st) == 0 && st.st_size == (off_t)bytes) {
		map = mmap(NULL, bytes, PROT_READ, MAP_SHARED, fd, 0);
		r = map == MAP_FAILED ? errno : 0;
	}
	close(fd);
	if (r == 0 && (memcmp(map, &magic, sizeof(magic)) != 0 ||
		       memcmp((char *)map + sizeof(magic), &bytes, sizeof(bytes)) != 0)) {
		munmap(map, bytes);
		r = EPROTO;
	}
	if (r != 0) {
		errno = r;
		return NULL;
	}
	return map;
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

void status_text_get(const _Atomic uint64_t *sequence, const char *field, uint32_t field_bytes,
		     char *ret_text)
{
	/* A writer that died half way leaves the sequence odd: take what is there after a while. */
	for (int tries = 0; tries < 1000; tries++) {
		uint64_t before = atomic_load_explicit(sequence, memory_order_acquire);

		for (size_t i = 0; i < field_bytes; i++) {
			ret_text[i] = __atomic_load_n(field + i, __ATOMIC_RELAXED);
		}
		atomic_thread_fence(memory_order_acquire);
		if (before % 2 == 0 &&
		    atomic_load_explicit(sequence, memory_order_relaxed) == before) {
			break;
		}
	}
	ret_text[field_bytes - 1] = '\0';
}
