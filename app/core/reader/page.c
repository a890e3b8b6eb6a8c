/* SPDX-License-Identifier: MIT */
#include "reader/page.h"

#include <errno.h>
#include <signal.h>
#include <stddef.h>

#define TERMINATE(text) ((text)[sizeof(text) - 1] = '\0')

static void bound(_Atomic uint32_t *count, uint32_t limit)
{
	if (atomic_load_explicit(count, memory_order_relaxed) > limit) {
		atomic_store_explicit(count, limit, memory_order_relaxed);
	}
}

int page_read_status(const char *path, struct status_page *ret_page)
{
	int r = status_read(path, STATUS_MAGIC, sizeof(*ret_page),
			    offsetof(struct status_page, text_sequence), ret_page);

	if (r < 0) {
		return r;
	}
	TERMINATE(ret_page->version);
	TERMINATE(ret_page->interface);
	TERMINATE(ret_page->message);
	TERMINATE(ret_page->control.name);
	TERMINATE(ret_page->control.path);
	bound(&ret_page->slave_count, LIMIT_SLAVES);
	for (unsigned i = 0; i < LIMIT_SLAVES; i++) {
		TERMINATE(ret_page->slave[i].info.name);
		TERMINATE(ret_page->slave[i].info.device);
	}
	return 0;
}

int page_read_record(const char *path, struct record_status *ret_page)
{
	int r = status_read(path, RECORD_STATUS_MAGIC, sizeof(*ret_page),
			    offsetof(struct record_status, text_sequence), ret_page);

	if (r == 0) {
		TERMINATE(ret_page->path);
		TERMINATE(ret_page->message);
	}
	return r;
}

int page_read_dds(const char *path, struct dds_status *ret_page)
{
	int r = status_read(path, DDS_STATUS_MAGIC, sizeof(*ret_page), 0, ret_page);

	if (r == 0) {
		TERMINATE(ret_page->interface);
		TERMINATE(ret_page->tag);
	}
	return r;
}

int page_read_stream(const char *path, struct stream_status *ret_page)
{
	int r = status_read(path, STREAM_STATUS_MAGIC, sizeof(*ret_page),
			    offsetof(struct stream_status, text_sequence), ret_page);

	if (r == 0) {
		TERMINATE(ret_page->stream);
		TERMINATE(ret_page->appliance);
		TERMINATE(ret_page->server);
		TERMINATE(ret_page->message);
	}
	return r;
}

int page_read_uplink(const char *path, struct uplink_status *ret_page)
{
	int r = status_read(path, UPLINK_STATUS_MAGIC, sizeof(*ret_page),
			    offsetof(struct uplink_status, text_sequence), ret_page);

	if (r == 0) {
		TERMINATE(ret_page->endpoint);
		TERMINATE(ret_page->bucket);
		TERMINATE(ret_page->appliance);
		TERMINATE(ret_page->file);
		TERMINATE(ret_page->message);
	}
	return r;
}

int page_read_sync0(const char *path, struct sync0_status *ret_page)
{
	int r = status_read(path, SYNC0_STATUS_MAGIC, sizeof(*ret_page),
			    offsetof(struct sync0_status, text_sequence), ret_page);

	if (r < 0) {
		return r;
	}
	TERMINATE(ret_page->message);
	TERMINATE(ret_page->beyond_slave);
	bound(&ret_page->line_count, LIMIT_SYNC0_LINES);
	for (unsigned i = 0; i < LIMIT_SYNC0_LINES; i++) {
		TERMINATE(ret_page->line[i].slave);
		TERMINATE(ret_page->line[i].line);
	}
	return 0;
}

int page_is_alive(int64_t pid)
{
	return pid > 0 && (kill((pid_t)pid, 0) == 0 || errno == EPERM);
}
