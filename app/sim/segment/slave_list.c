/* SPDX-License-Identifier: MIT */
#include "segment/slave_list.h"

#include <errno.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "base/limits.h"

enum { FIRST_PORT = 1, LAST_PORT = 3 };

struct parser {
	const char *at;
	struct slave_list_entry *entry;
	size_t capacity;
	int count;
	uint8_t used[LIMIT_SLAVES]; /* ports of each slave, a bit each */
	int open[LIMIT_SLAVES];     /* slaves whose parenthesis is open */
	int open_count;
	char *why;
	size_t why_bytes;
};

static int refuse(struct parser *p, const char *format, ...) __attribute__((format(printf, 2, 3)));

static int refuse(struct parser *p, const char *format, ...)
{
	va_list args;

	va_start(args, format);
	vsnprintf(p->why, p->why_bytes, format, args);
	va_end(args);
	return -EINVAL;
}

/* A slave at @port of @parent: its place in the list. */
static int take_name(struct parser *p, int parent, unsigned port)
{
	size_t len = strcspn(p->at, ",()");
	struct slave_list_entry *entry;

	if ((size_t)p->count == p->capacity) {
		return refuse(p, "more than %zu slaves", p->capacity);
	}
	if (len == 0 || len >= SLAVE_LIST_NAME_BYTES || memchr(p->at, '/', len) != NULL) {
		return refuse(p, "expected the name of a slave at '%.20s'", p->at);
	}
	entry = &p->entry[p->count];
	snprintf(entry->name, sizeof(entry->name), "%.*s", (int)len, p->at);
	entry->parent = parent;
	entry->parent_port = port;
	if (parent >= 0) {
		p->used[parent] |= (uint8_t)(1u << port);
	}
	p->used[p->count] = 0;
	p->at += len;
	return p->count++;
}

/* After "(": which port of @slave. */
static int take_port(struct parser *p, int slave)
{
	unsigned port = FIRST_PORT;

	if (p->at[0] >= '0' && p->at[0] <= '9' && p->at[1] == ':') {
		port = (unsigned)(p->at[0] - '0');
		p->at += 2;
	}
	if (port < FIRST_PORT || port > LAST_PORT) {
		return refuse(p, "%s: ports for other slaves are 1 to 3", p->entry[slave].name);
	}
	if ((p->used[slave] & 1u << port) != 0) {
		return refuse(p, "%s: two slaves at port %u", p->entry[slave].name, port);
	}
	return (int)port;
}

static int free_port(struct parser *p, int slave)
{
	for (unsigned port = FIRST_PORT; port <= LAST_PORT; port++) {
		if ((p->used[slave] & 1u << port) == 0) {
			return (int)port;
		}
	}
	return refuse(p, "%s: no port is left", p->entry[slave].name);
}

/* From after slave *@slave to the next name: the port that it hangs on, and *@slave its parent.
 * 0: end of the text. */
static int go_on(struct parser *p, int *slave)
{
	for (;;) {
		switch (*p->at) {
		case '\0':
			return p->open_count == 0 ? 0 : refuse(p, "')' is missing");
		case ',':
			p->at++;
			return free_port(p, *slave);
		case '(':
			p->at++;
			p->open[p->open_count++] = *slave;
			return take_port(p, *slave);
		default: /* ')': take_name() stops at nothing else */
			if (*p->at != ')' || p->open_count == 0) {
				return refuse(p, "unexpected '%.20s'", p->at);
			}
			p->at++;
			*slave = p->open[--p->open_count];
			break;
		}
	}
}

int slave_list_parse(const char *text, struct slave_list_entry *ret_entry, size_t capacity,
		     char *why, size_t why_bytes)
{
	struct parser p = { .at = text,
			    .entry = ret_entry,
			    .capacity = capacity < LIMIT_SLAVES ? capacity : LIMIT_SLAVES,
			    .why = why,
			    .why_bytes = why_bytes };
	int parent = -1;
	int port = FIRST_PORT;

	do {
		int slave = take_name(&p, parent, (unsigned)port);

		if (slave < 0) {
			return slave;
		}
		parent = slave;
		port = go_on(&p, &parent);
	} while (port > 0);
	return port < 0 ? port : p.count;
}
