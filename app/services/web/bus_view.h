/* SPDX-License-Identifier: MIT */
/*
 * The bus for the view of that name: the tree of ports with states and errors, what the
 * configuration expects and was not found, and all that is known of one slave. From the status page
 * alone: nobody asks a slave for it. Context: blocking.
 */
#ifndef WEB_BUS_VIEW_H
#define WEB_BUS_VIEW_H

#include <stdint.h>

#include "base/status.h"
#include "config/config.h"

struct bus_view {
	const struct status_page *page;
	int page_error; /* 0, or why @page could not be read */
	int is_alive;   /* ecdaqd is */
	const struct config *cfg;
};

/** All slaves (op "bus"). free() it; NULL without memory. */
char *bus_view_tree(const struct bus_view *view);
/** Identity and counters of the slave at @pos (op "slave"); the same. */
char *bus_view_slave(const struct bus_view *view, uint32_t pos);

#endif
