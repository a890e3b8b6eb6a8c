/* SPDX-License-Identifier: MIT */
#include "sync0/output.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/ring.h"
#include "base/run_path.h"
#include "base/status.h"
#include "reader/page.h"

enum { RESULT_SLOTS = 4096, EVENT_SLOTS = 1024, FILE_MODE = 0644 };

struct output {
	int lock; /* -1: rings and page are not made */
	struct ring *results;
	struct ring *events;
	struct sync0_status *page;
	struct sync0_status own;
	char results_path[CONFIG_PATH_BYTES];
	char events_path[CONFIG_PATH_BYTES];
	char page_path[CONFIG_PATH_BYTES];
	char lock_path[CONFIG_PATH_BYTES];
	char last_text[256];
};

struct output *output_create(const struct config *cfg, enum sync0_source source)
{
	struct output *out = calloc(1, sizeof(*out));
	int r;

	if (out == NULL) {
		return NULL;
	}
	r = config_run_path(cfg, CONFIG_RUN_SYNC0, out->results_path, CONFIG_PATH_BYTES);
	r = r < 0 ? r
		  : config_run_path(cfg, CONFIG_RUN_SYNC0_EVENTS, out->events_path,
				    CONFIG_PATH_BYTES);
	r = r < 0 ? r
		  : config_run_path(cfg, CONFIG_RUN_SYNC0_STATUS, out->page_path,
				    CONFIG_PATH_BYTES);
	r = r < 0 ? r
		  : config_run_path(cfg, CONFIG_RUN_SYNC0_LOCK, out->lock_path, CONFIG_PATH_BYTES);
	if (r < 0) {
		free(out);
		errno = -r;
		return NULL;
	}
	out->lock = -1;
	out->page = &out->own;
	out->own.magic = SYNC0_STATUS_MAGIC;
	out->own.bytes = sizeof(out->own);
	out->own.source = source;
	out->own.pid = getpid();
	return out;
}

/* From here on the private page is written. */
static void close_all(struct output *out)
{
	ring_destroy(out->results);
	ring_destroy(out->events);
	out->results = NULL;
	out->events = NULL;
	if (out->page != &out->own) {
		memcpy(&out->own, out->page, sizeof(out->own));
		status_unmap(out->page, sizeof(*out->page));
		out->page = &out->own;
	}
	if (out->lock >= 0) {
		close(out->lock);
		out->lock = -1;
	}
}

void output_destroy(struct output *out)
{
	if (out != NULL) {
		close_all(out);
		free(out);
	}
}

static int open_ring(const char *path, const char *kind, uint32_t bytes, uint64_t slots,
		     struct ring **ret)
{
	const struct ring_spec spec = {
		.path = path,
		.kind = kind,
		.payload_bytes = bytes,
		.slot_count = slots,
		.file_mode = FILE_MODE,
	};

	return ring_create(&spec, ret);
}

static int fail(const char *path, int error, char *why)
{
	snprintf(why, OUTPUT_WHY_BYTES, "%.200s: %s", path, strerror(-error));
	return error;
}

static int busy(const struct output *out, char *why)
{
	struct sync0_status *page = malloc(sizeof(*page));
	char pid[32] = "";

	if (page != NULL && page_read_sync0(out->page_path, page) == 0) {
		snprintf(pid, sizeof(pid), " (pid %" PRId64 ")", page->pid);
	}
	free(page);
	snprintf(why, OUTPUT_WHY_BYTES, "%.170s: another ecdaq-sync0 is running here%s",
		 out->lock_path, pid);
	return -EBUSY;
}

/* To hold it no right to write is needed: it may have been made by another user's. */
static int take_lock(struct output *out, char *why)
{
	int r = run_path_own_folder(out->lock_path);

	if (r < 0) {
		return fail(out->lock_path, r, why);
	}
	out->lock = open(out->lock_path, O_RDONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW, FILE_MODE);
	if (out->lock < 0) {
		return fail(out->lock_path, -errno, why);
	}
	if (flock(out->lock, LOCK_EX | LOCK_NB) == 0) {
		return 0;
	}
	r = errno == EWOULDBLOCK ? busy(out, why) : fail(out->lock_path, -errno, why);
	close(out->lock);
	out->lock = -1;
	return r;
}

static int make_all(struct output *out, char *why)
{
	struct sync0_status *page;
	int r = open_ring(out->results_path, "sync0", sizeof(struct sync0_result), RESULT_SLOTS,
			  &out->results);

	if (r < 0) {
		return fail(out->results_path, r, why);
	}
	r = open_ring(out->events_path, "event", sizeof(struct event), EVENT_SLOTS, &out->events);
	if (r < 0) {
		return fail(out->events_path, r, why);
	}
	page = status_create(out->page_path, SYNC0_STATUS_MAGIC, sizeof(*page), FILE_MODE);
	if (page == NULL) {
		return fail(out->page_path, -errno, why);
	}
	memcpy(page, &out->own, sizeof(*page));
	out->page = page;
	return 0;
}

/* Its directory was removed, and ours is no more what others open. */
static int is_gone(const struct output *out)
{
	struct stat st;

	return fstat(out->lock, &st) < 0 || st.st_nlink == 0;
}

int output_open(struct output *out, char *why)
{
	int r;

	if (out->lock >= 0 && !is_gone(out)) {
		return 0;
	}
	close_all(out);
	r = take_lock(out, why);
	if (r < 0) {
		return r;
	}
	r = make_all(out, why);
	if (r < 0) {
		close_all(out);
	}
	return r;
}

struct sync0_status *output_page(struct output *out)
{
	return out->page;
}

void output_message(struct output *out, const char *text)
{
	if (strncmp(out->last_text, text, sizeof(out->last_text) - 1) == 0) {
		return;
	}
	snprintf(out->last_text, sizeof(out->last_text), "%s", text);
	status_text_set(&out->page->text_sequence, out->page->message, sizeof(out->page->message),
			text);
	if (text[0] != '\0') {
		fprintf(stderr, "ecdaq-sync0: %s\n", text);
	}
}

static void add(_Atomic uint64_t *field, uint64_t n)
{
	atomic_fetch_add_explicit(field, n, memory_order_relaxed);
}

void output_result(struct output *out, const struct sync0_result *r)
{
	struct sync0_line_status *ls = &out->page->line[r->line];

	add(&ls->edges, r->edges);
	add(&ls->missing, r->kind == SYNC0_WINDOW ? r->missing : 0);
	add(&ls->extra, r->extra);
	add(&ls->overflow, r->overflow);
	add(&ls->steps, r->step_ns != 0 ? 1 : 0);
	add(&ls->shots, r->kind == SYNC0_SHOT ? 1 : 0);
	add(&ls->shots_lost, r->kind == SYNC0_SHOT && !r->has_come ? 1 : 0);
	atomic_store_explicit(&ls->verdict, r->verdict, memory_order_relaxed);
	if (out->results != NULL) {
		ring_push(out->results, r, sizeof(*r), NULL, 0);
	}
}

void output_event(struct output *out, const struct event *event)
{
	char text[256];

	event_format(event, text, sizeof(text));
	fprintf(stderr, "ecdaq-sync0: %s\n", text);
	if (out->events != NULL) {
		ring_push(out->events, event, sizeof(*event), NULL, 0);
	}
}
