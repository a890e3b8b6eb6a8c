/* SPDX-License-Identifier: MIT */
#include "program/event_text.h"

#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "base/clock.h"
#include "wire/al.h"

#define FOLD_NS (10 * NS_PER_S)

/* Put a text behind what @buf has, cut where it is full. */
__attribute__((format(printf, 2, 3))) static void append(char buf[EVENT_TEXT_BYTES],
							 const char *format, ...)
{
	size_t used = strlen(buf);
	va_list args;

	va_start(args, format);
	vsnprintf(buf + used, EVENT_TEXT_BYTES - used, format, args);
	va_end(args);
}

/* Put @more behind the first @what in @buf, if there is room. */
static void insert_behind(char buf[EVENT_TEXT_BYTES], const char *what, const char *more)
{
	char *found = strstr(buf, what);
	char rest[EVENT_TEXT_BYTES];

	if (found != NULL && strlen(buf) + strlen(more) < EVENT_TEXT_BYTES) {
		found += strlen(what);
		snprintf(rest, sizeof(rest), "%s", found);
		*found = '\0';
		append(buf, "%s%s", more, rest);
	}
}

/* " rear" behind "slave 1"; nothing if it has no name. */
static void insert_name(uint16_t pos, const struct status_page *page, char buf[EVENT_TEXT_BYTES])
{
	struct slave_info info;
	char what[24];
	char more[sizeof(info.name) + 1];

	if (page == NULL || pos >= atomic_load_explicit(&page->slave_count, memory_order_relaxed)) {
		return;
	}
	info = page->slave[pos].info;
	if (info.name[0] != '\0') {
		snprintf(what, sizeof(what), "slave %u", pos);
		snprintf(more, sizeof(more), " %s", info.name);
		insert_behind(buf, what, more);
	}
}

void event_text(const struct event *ev, const struct status_page *page, char buf[EVENT_TEXT_BYTES])
{
	event_format(ev, buf, EVENT_TEXT_BYTES);
	if (ev->slave_pos != EVENT_NO_SLAVE) {
		insert_name(ev->slave_pos, page, buf);
	}
	if ((ev->id == EVENT_SLAVE_STATE || ev->id == EVENT_SLAVE_ALARM) &&
	    (ev->value & 0xffff) != 0) {
		uint16_t code = (uint16_t)(ev->value & 0xffff);
		char what[16];
		char more[128];

		snprintf(what, sizeof(what), "0x%04x", code);
		snprintf(more, sizeof(more), " (%s)", al_status_code_to_str(code));
		insert_behind(buf, what, more);
	}
}

/* --- what repeats --- */

/* In the order in which they are shown: of one, of many; NULL: not shown beside others. */
static const struct {
	enum event_id id;
	const char *one;
	const char *many;
} folded[] = {
	{ EVENT_FRAME_LOST, "frame lost", "frames lost" },
	{ EVENT_FRAME_LATE, "frame late", "frames late" },
	{ EVENT_FRAME_DOUBLED, "duplicate frame", "duplicate frames" },
	{ EVENT_OVERRUN, "overrun", "overruns" },
	{ EVENT_WKC_LOW, "time a low working counter", "times a low working counter" },
	{ EVENT_WKC_OK, NULL, NULL },
	{ EVENT_COUNTER_BAD, "wrong counter", "wrong counters" },
	{ EVENT_DC_DIFF_HIGH, "time a system time difference above the limit",
	  "times a system time difference above the limit" },
	{ EVENT_CONTROL_OVERRUN, "overrun of the control program",
	  "overruns of the control program" },
};

enum { FOLDED_COUNT = sizeof(folded) / sizeof(folded[0]) };

int event_fold_is_for(const struct event *ev)
{
	for (size_t i = 0; i < FOLDED_COUNT; i++) {
		if (folded[i].id == ev->id) {
			return 1;
		}
	}
	return 0;
}

int event_fold_is_over(const struct event_fold *fold, int64_t mono_ns)
{
	return fold->total > 0 && mono_ns - fold->first.mono_ns > FOLD_NS;
}

int event_fold_add(struct event_fold *fold, const struct event *ev)
{
	if (!event_fold_is_for(ev) || event_fold_is_over(fold, ev->mono_ns)) {
		return 0;
	}
	if (fold->total == 0) {
		*fold = (struct event_fold){ .first = *ev, .are_of_one_slave = 1 };
	}
	fold->last = *ev;
	fold->total++;
	fold->count[ev->id]++;
	fold->cycles_skipped += ev->id == EVENT_OVERRUN ? ev->arg[0] : 0;
	fold->are_of_one_slave &= ev->slave_pos == fold->first.slave_pos;
	return 1;
}

size_t event_fold_kinds(const struct event_fold *fold)
{
	size_t count = 0;

	for (size_t i = 0; i < FOLDED_COUNT; i++) {
		count += fold->count[folded[i].id] > 0;
	}
	return count;
}

enum event_id event_fold_kind(const struct event_fold *fold, size_t n)
{
	for (size_t i = 0; i < FOLDED_COUNT; i++) {
		if (fold->count[folded[i].id] > 0 && n-- == 0) {
			return folded[i].id;
		}
	}
	return EVENT_NONE;
}

enum event_severity event_fold_severity(const struct event_fold *fold)
{
	enum event_severity worst = EVENT_INFO;

	for (size_t i = 0; i < FOLDED_COUNT; i++) {
		enum event_severity own = event_severity((uint16_t)folded[i].id);

		worst = fold->count[folded[i].id] > 0 && own > worst ? own : worst;
	}
	return worst;
}

/* "38 frames lost, 41 late": the word is not repeated. */
static void put_kind(const struct event_fold *fold, size_t i, char buf[EVENT_TEXT_BYTES])
{
	uint64_t count = fold->count[folded[i].id];
	int is_late_beside_lost =
		folded[i].id == EVENT_FRAME_LATE && fold->count[EVENT_FRAME_LOST] > 0;
	const char *words = count == 1 ? folded[i].one : folded[i].many;

	append(buf, "%s%" PRIu64 " %s", buf[0] != '\0' ? ", " : "", count,
	       is_late_beside_lost ? "late" : words);
	if (folded[i].id == EVENT_OVERRUN && fold->cycles_skipped > 0) {
		append(buf, " (%" PRId64 " cycles skipped)", fold->cycles_skipped);
	}
}

void event_fold_text(const struct event_fold *fold, const struct status_page *page,
		     char buf[EVENT_TEXT_BYTES])
{
	if (fold->total == 1) {
		event_text(&fold->first, page, buf);
		return;
	}
	buf[0] = '\0';
	for (size_t i = 0; i < FOLDED_COUNT; i++) {
		if (fold->count[folded[i].id] > 0 && folded[i].one != NULL) {
			put_kind(fold, i, buf);
		}
	}
	if (buf[0] == '\0') {
		append(buf, "%" PRIu64 " times the working counter is right again", fold->total);
	}
	if (fold->are_of_one_slave && fold->first.slave_pos != EVENT_NO_SLAVE) {
		append(buf, " of slave %u", fold->first.slave_pos);
		insert_name(fold->first.slave_pos, page, buf);
	}
	append(buf, " in %.1f s, cycle %" PRIu64 " to %" PRIu64,
	       (double)(fold->last.mono_ns - fold->first.mono_ns) / 1e9, fold->first.cycle,
	       fold->last.cycle);
}
