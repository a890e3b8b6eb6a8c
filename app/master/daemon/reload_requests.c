/* SPDX-License-Identifier: MIT */
/* The configuration is read again while the bus is up: by a request of the admin socket, or SIGHUP.
 */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "daemon/reload.h"
#include "daemon/session_internal.h"

enum { NOTE_BYTES = 2 * CONFIG_CHANGE_VALUE_BYTES + 256 };

static void note(const struct session *s, const char *text)
{
	char line[NOTE_BYTES + 16];

	if (s->spec.hooks.note != NULL) {
		snprintf(line, sizeof(line), "reload: %s", text);
		s->spec.hooks.note(s->spec.hooks.ctx, line);
	}
}

/* A fail-safe value or a limit may be one that its channel cannot hold. */
static int fits_outputs(void *ctx, const struct config *cfg, char *error, size_t error_bytes)
{
	const struct session *s = ctx;

	return s->is_riding ? cycle_outputs_set(s->cycle, cfg, error, error_bytes) : 0;
}

static void note_changes(const struct session *s, const struct config_change *change, size_t count)
{
	char text[NOTE_BYTES];

	if (count == 0) {
		note(s, "no option has another value");
	}
	for (size_t i = 0; i < count; i++) {
		config_change_format(&change[i], text, sizeof(text));
		note(s, text);
	}
}

/* 0, or -errno with one line in @error; both are reported. Free *@ret_change. */
static int read_again(struct session *s, struct config_change **ret_change, size_t *ret_count,
		      char *error, size_t error_bytes)
{
	const struct reload_check check = { .is_possible = fits_outputs, .ctx = s };
	char text[FAILURE_TEXT_BYTES + 96];
	int r;

	if (s->spec.reload == NULL) {
		snprintf(error, error_bytes, "this ecdaqd has no configuration to read again");
		return -EOPNOTSUPP;
	}
	r = reload_read(s->spec.reload, &check, ret_change, ret_count, error, error_bytes);
	if (r < 0) {
		snprintf(text, sizeof(text), "%s (the running configuration stays)", error);
		note(s, text);
		return r;
	}
	if (s->bus != NULL) {
		bus_config_follow(s->bus);
	}
	note_changes(s, *ret_change, *ret_count);
	return 0;
}

static int answer(struct admin_pending *pending, const struct config_change *change, size_t count)
{
	size_t bytes = count * sizeof(*change);
	uint8_t *room;

	if (bytes > ADMIN_TRANSFER_BYTES) {
		bytes = ADMIN_TRANSFER_BYTES / sizeof(*change) * sizeof(*change);
	}
	if (bytes == 0) {
		return 0;
	}
	room = admin_pending_reserve(pending, bytes);
	if (room == NULL) {
		return -ENOMEM;
	}
	memcpy(room, change, bytes);
	admin_pending_answer_len(pending, bytes);
	return 0;
}

void session_reload_request(struct session *s, struct admin_pending *pending)
{
	struct config_change *change = NULL;
	char error[FAILURE_TEXT_BYTES] = "";
	size_t count = 0;
	int r = read_again(s, &change, &count, error, sizeof(error));

	if (r < 0) {
		admin_pending_refuse(pending, r, "%s", error);
		return;
	}
	snprintf(pending->reply.text, sizeof(pending->reply.text), "%s", s->spec.cfg->path);
	admin_pending_complete(pending, answer(pending, change, count));
	free(change);
}

void session_reload_ask(struct session *session)
{
	atomic_store_explicit(&session->reload_asked, 1, memory_order_relaxed);
}

void session_reload_if_asked(struct session *s)
{
	struct config_change *change = NULL;
	char error[FAILURE_TEXT_BYTES] = "";
	size_t count = 0;

	if (atomic_exchange_explicit(&s->reload_asked, 0, memory_order_relaxed) &&
	    read_again(s, &change, &count, error, sizeof(error)) == 0) {
		free(change);
	}
}

void session_take_reloaded(struct session *s)
{
	const struct config *cfg = s->spec.cfg;
	enum config_target before = cfg->bus_target;

	if (s->spec.reload == NULL || !reload_take_rescan(s->spec.reload)) {
		return;
	}
	atomic_store_explicit(&s->run.page->slaves_expected, (uint32_t)cfg->slave_count,
			      memory_order_relaxed);
	if (cfg->bus_target != before) {
		session_target_set(s, cfg->bus_target);
	}
}
