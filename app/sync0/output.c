/* SPDX-License-Identifier: MIT */
#include "sync0/output.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/ring.h"
#include "base/status.h"

enum { RESULT_SLOTS = 4096, EVENT_SLOTS = 1024, FILE_MODE = 0644 };

struct output {
	struct ring *results;
	struct ring *events;
	struct sync0_status *page;
	struct sync0_status own;
	char results_path[CONFIG_PATH_BYTES];
	char events_path[CONFIG_PATH_BYTES];
	char page_path[CONFIG_PATH_BYTES];
	char said[256];
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
	if (r < 0) {
		free(out);
		errno = -r;
		return NULL;
	}
	out->page = &out->own;
	out->own.magic = SYNC0_STATUS_MAGIC;
	out->own.bytes = sizeof(out->own);
	out->own.source = source;
	out->own.pid = getpid();
	return out;
}

void output_destroy(struct output *out)
{
	if (out == NULL) {
		return;
	}
	ring_destroy(out->results);
	ring_destroy(out->events);
	if (out->page != &out->own) {
		status_unmap(out->page, sizeof(*out->page));
	}
	free(out);
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

	return *ret != NULL ? 0 : ring_create(&spec, ret);
}

int output_open(struct output *out)
{
	struct sync0_status *page;
	int r;

	r = open_ring(out->results_path, "sync0", sizeof(struct sync0_result), RESULT_SLOTS,
		      &out->results);
	r = r < 0 ? r
		  : open_ring(out->events_path, "event", sizeof(struct event), EVENT_SLOTS,
			      &out->events);
	if (r < 0 || out->page != &out->own) {
		return r;
	}
	page = status_create(out->page_path, SYNC0_STATUS_MAGIC, sizeof(*page), FILE_MODE);
	if (page == NULL) {
		return -errno;
	}
	memcpy(page, &out->own, sizeof(*page));
	out->page = page;
	return 0;
}

struct sync0_status *output_page(struct output *out)
{
	return out->page;
}

void output_say(struct output *out, const char *text)
{
	if (strncmp(out->said, text, sizeof(out->said) - 1) == 0) {
		return;
	}
	snprintf(out->said, sizeof(out->said), "%s", text);
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
