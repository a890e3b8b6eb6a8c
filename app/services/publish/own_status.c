/* SPDX-License-Identifier: MIT */
#include "publish/own_status.h"

#include <stdio.h>
#include <unistd.h>

#include "publish/domain.h"

static void set(_Atomic uint64_t *field, uint64_t value)
{
	atomic_store_explicit(field, value, memory_order_relaxed);
}

static int have_page(struct own_status *own, const struct config *cfg)
{
	struct dds_status *page;

	if (own->page != NULL) {
		return 1;
	}
	page = status_create_own(own->path, DDS_STATUS_MAGIC, sizeof(*page));
	if (page == NULL) {
		return 0;
	}
	page->pid = getpid();
	page->domain = cfg->dds_domain;
	snprintf(page->interface, sizeof(page->interface), "%s", cfg->dds_interface);
	snprintf(page->tag, sizeof(page->tag), "%s", cfg->dds_tag);
	page->is_secure = (uint32_t)domain_is_secure(cfg);
	page->are_commands_on = (uint32_t)domain_takes_commands(cfg);
	own->page = page;
	return 1;
}

void own_status_put(struct own_status *own, const struct config *cfg, const struct topics *topics,
		    uint64_t session, const struct sample_counts *samples,
		    struct commands_counts commands)
{
	struct dds_status *page;

	if (!have_page(own, cfg)) {
		return;
	}
	page = own->page;
	set(&page->session, session);
	set(&page->published_cycles, samples->published);
	set(&page->missed_cycles, samples->missed);
	set(&page->failed_messages, samples->failed);
	set(&page->subscribers,
	    topics_reader_count(topics->sample) + topics_reader_count(topics->block));
	set(&page->commands_accepted, commands.accepted);
	set(&page->commands_refused, commands.refused);
	atomic_fetch_add_explicit(&page->heartbeat, 1, memory_order_relaxed);
}

void own_status_close(struct own_status *own)
{
	status_unmap(own->page, sizeof(*own->page));
	own->page = NULL;
}
