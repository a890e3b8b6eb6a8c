/* SPDX-License-Identifier: MIT */
#include "uplink/own_status.h"

#include <stdio.h>
#include <unistd.h>

#define COPY(to, from, field)                                                                      \
	atomic_store_explicit(&(to)->field,                                                        \
			      atomic_load_explicit(&(from)->field, memory_order_relaxed),          \
			      memory_order_relaxed)

static void name(struct uplink_status *page, const struct config *cfg, const char *appliance)
{
	snprintf(page->endpoint, sizeof(page->endpoint), "%s", cfg->uplink_endpoint);
	snprintf(page->bucket, sizeof(page->bucket), "%s", cfg->uplink_bucket);
	snprintf(page->appliance, sizeof(page->appliance), "%s", appliance);
}

int own_status_init(struct own_status *own, const struct config *cfg, const char *appliance)
{
	*own = (struct own_status){ .page = NULL };
	name(&own->now, cfg, appliance);
	return config_run_path(cfg, CONFIG_RUN_UPLINK_STATUS, own->path, sizeof(own->path));
}

void own_status_put(struct own_status *own)
{
	struct uplink_status *page = own->page;
	const struct uplink_status *now = &own->now;

	if (page == NULL) {
		page = status_create_own(own->path, UPLINK_STATUS_MAGIC, sizeof(*page));
		if (page == NULL) {
			return;
		}
		page->pid = getpid();
		snprintf(page->endpoint, sizeof(page->endpoint), "%s", now->endpoint);
		snprintf(page->bucket, sizeof(page->bucket), "%s", now->bucket);
		snprintf(page->appliance, sizeof(page->appliance), "%s", now->appliance);
		own->page = page;
	}
	status_text_set(&page->text_sequence, page->file, sizeof(page->file), now->file);
	status_text_set(&page->text_sequence, page->message, sizeof(page->message), now->message);
	COPY(page, now, state);
	COPY(page, now, file_bytes);
	COPY(page, now, file_sent);
	COPY(page, now, uploaded);
	COPY(page, now, uploaded_bytes);
	COPY(page, now, waiting);
	COPY(page, now, waiting_bytes);
	COPY(page, now, deleted);
	COPY(page, now, failures);
	COPY(page, now, uploaded_utc_s);
	COPY(page, now, waiting_utc_s);
	atomic_fetch_add_explicit(&page->heartbeat, 1, memory_order_relaxed);
}

void own_status_close(struct own_status *own)
{
	status_unmap(own->page, sizeof(*own->page));
	own->page = NULL;
}
