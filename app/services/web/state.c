/* SPDX-License-Identifier: MIT */
#include "web/state.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

#define GET(field) atomic_load_explicit(&(field), memory_order_relaxed)

static const char no_daemon[] = "ecdaqd is not running: start it, on a PC or board with Debian by "
				"systemctl start ecdaqd";

const char *state_level_to_str(enum state_level level)
{
	switch (level) {
	case STATE_GOOD:
		return "good";
	case STATE_WARNING:
		return "warning";
	case STATE_BAD:
		return "bad";
	}
	return "?";
}

static void put(struct state *s, const char *word, enum state_level level, const char *sentence)
{
	s->word = word;
	s->level = level;
	snprintf(s->sentence, sizeof(s->sentence), "%s", sentence);
}

static uint32_t count_lost(const struct status_page *page)
{
	uint32_t slaves = GET(page->slave_count);
	uint32_t lost = 0;

	for (uint32_t i = 0; i < slaves && i < LIMIT_SLAVES; i++) {
		lost += GET(page->slave[i].is_lost) != 0;
	}
	return lost;
}

/* In OP, what else is wrong; the newest trouble as ecdaqd reports it comes first. */
static void judge_op(const struct status_page *page, const char *word, struct state *s)
{
	uint32_t lost = count_lost(page);
	uint32_t dc = GET(page->cycle.dc_state);

	if (lost > 0) {
		put(s, word, STATE_BAD, "");
		snprintf(s->sentence, sizeof(s->sentence),
			 "%u of %u slaves do not answer%s%s: check their power and cables", lost,
			 GET(page->slave_count), page->message[0] != '\0' ? ": " : "",
			 page->message);
	} else if (GET(page->cycle.is_fail_safe)) {
		put(s, word, STATE_WARNING,
		    page->message[0] != '\0' ? page->message
					     : "The outputs hold their fail-safe values.");
	} else if (page->message[0] != '\0') {
		put(s, word, STATE_WARNING, page->message);
	} else if (dc == DC_ACQUIRING || dc == DC_LOST) {
		put(s, word, STATE_WARNING,
		    "The master is not locked to the reference clock: see the events.");
	} else {
		put(s, word, STATE_GOOD, "");
		snprintf(s->sentence, sizeof(s->sentence), "%u slaves exchange process data.",
			 GET(page->slave_count));
	}
}

static void judge_running(const struct status_page *page, struct state *s)
{
	uint32_t bus = GET(page->bus_state);
	const char *word = bus_state_to_str(bus);
	const char *message = page->message;

	switch ((enum bus_state)bus) {
	case BUS_OP:
		judge_op(page, word, s);
		return;
	case BUS_RECOVERING:
		put(s, word, STATE_BAD,
		    message[0] != '\0' ? message : "The bus has left OP and is led back.");
		return;
	case BUS_STOPPED:
	case BUS_FAILED:
		put(s, word, STATE_BAD, message[0] != '\0' ? message : "See the events.");
		return;
	case BUS_DOWN:
	case BUS_SCANNING:
	case BUS_INIT:
	case BUS_PREOP:
	case BUS_SAFEOP:
		break;
	}
	if (bus == GET(page->bus_target)) {
		put(s, word, STATE_WARNING,
		    message[0] != '\0' ? message : "This is the state that bus.target asks for.");
	} else {
		put(s, word, GET(page->is_waiting) ? STATE_BAD : STATE_WARNING,
		    message[0] != '\0' ? message : "The bus is being brought up.");
	}
}

void state_judge(const struct status_page *page, int error, int is_alive, struct state *ret)
{
	if (error == -ENOENT) {
		put(ret, "OFF", STATE_BAD, no_daemon);
	} else if (error < 0) {
		put(ret, "UNKNOWN", STATE_BAD, "");
		snprintf(ret->sentence, sizeof(ret->sentence),
			 "the status of ecdaqd cannot be read: %s: ecdaq-web must be of the same "
			 "version, and its user in the group that may read",
			 strerror(-error));
	} else if (!is_alive) {
		put(ret, "OFF", STATE_BAD, no_daemon);
		if (page->message[0] != '\0') {
			snprintf(ret->sentence, sizeof(ret->sentence), "%s; its last message: %s",
				 no_daemon, page->message);
		}
	} else {
		judge_running(page, ret);
	}
}
