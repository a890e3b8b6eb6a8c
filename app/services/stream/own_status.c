/* SPDX-License-Identifier: MIT */
#include "stream/own_status.h"

#include <stdio.h>
#include <unistd.h>

#define COPY(to, from, field)                                                                      \
	atomic_store_explicit(&(to)->field,                                                        \
			      atomic_load_explicit(&(from)->field, memory_order_relaxed),          \
			      memory_order_relaxed)

int own_status_init(struct own_status *own, const struct config *cfg, const char *appliance)
{
	*own = (struct own_status){ .page = NULL };
	snprintf(own->now.stream, sizeof(own->now.stream), "%s", cfg->stream_name);
	snprintf(own->now.appliance, sizeof(own->now.appliance), "%s", appliance);
	return config_run_path(cfg, CONFIG_RUN_STREAM_STATUS, own->path, sizeof(own->path));
}

static int have_page(struct own_status *own)
{
	if (own->page == NULL) {
		own->page = status_create_own(own->path, STREAM_STATUS_MAGIC, sizeof(*own->page));
		if (own->page != NULL) {
			own->page->pid = getpid();
			snprintf(own->page->stream, sizeof(own->page->stream), "%s",
				 own->now.stream);
			snprintf(own->page->appliance, sizeof(own->page->appliance), "%s",
				 own->now.appliance);
		}
	}
	return own->page != NULL;
}

void own_status_put(struct own_status *own)
{
	struct stream_status *page;

	if (!have_page(own)) {
		return;
	}
	page = own->page;
	status_text_set(&page->text_sequence, page->server, sizeof(page->server), own->now.server);
	status_text_set(&page->text_sequence, page->message, sizeof(page->message),
			own->now.message);
	COPY(page, &own->now, state);
	COPY(page, &own->now, session);
	COPY(page, &own->now, next_cycle);
	COPY(page, &own->now, blocks);
	COPY(page, &own->now, cycles);
	COPY(page, &own->now, bytes_sent);
	COPY(page, &own->now, events);
	COPY(page, &own->now, events_lost);
	COPY(page, &own->now, gaps);
	COPY(page, &own->now, cycles_missing);
	COPY(page, &own->now, connects);
	COPY(page, &own->now, lag_cycles);
	atomic_fetch_add_explicit(&page->heartbeat, 1, memory_order_relaxed);
}

void own_status_close(struct own_status *own)
{
	status_unmap(own->page, sizeof(*own->page));
	own->page = NULL;
}
