/* SPDX-License-Identifier: MIT */
/* The table of slaves of `ecdaq status` and `ecdaq top`. */
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "cli/fit.h"
#include "cli/report.h"
#include "cli/screen.h"
#include "cli/source.h"
#include "cli/text.h"
#include "wire/al.h"

#define GET(field) atomic_load_explicit(&(field), memory_order_relaxed)

enum { NAME_COLUMNS = 16, NAME_COLUMNS_MIN = 8, CODE_INDENT = 4 };

/* Widths of the columns, one blank between them; 0: not shown. */
struct layout {
	int name;
	int state;
	int good;
	int bad;
	int diff;
	int errors; /* of receive errors and of lost links */
	int columns;
};

static const struct layout wide = { .state = 13, .good = 12, .bad = 10, .diff = 10, .errors = 6 };
static const struct layout narrow = { .state = 9, .bad = 8, .diff = 9, .errors = 5 };

/* Columns of all but the name, with the position and the mark at the end. */
static int rest_of(const struct layout *l)
{
	return 3 + 1 + 1 + l->state + (l->good > 0 ? 1 + l->good : 0) + 1 + l->bad + 1 + l->diff +
	       2 * (1 + l->errors) + 1;
}

/* The same for the same slaves and width, so that the table does not move. */
static struct layout layout_of(const struct status_page *page, int columns)
{
	struct layout l = wide;
	int longest = NAME_COLUMNS_MIN;

	for (uint32_t i = 0; i < source_slave_count(page); i++) {
		struct slave_info info = source_slave(page, i);
		int len = (int)strlen(info.name);

		longest = len > longest ? len : longest;
	}
	if (columns == 0) {
		l.name = longest > NAME_COLUMNS ? longest : NAME_COLUMNS;
		return l;
	}
	if (columns - rest_of(&l) < (longest < NAME_COLUMNS ? longest : NAME_COLUMNS)) {
		l = narrow;
	}
	l.name = columns - rest_of(&l);
	l.name = l.name > longest ? longest : l.name;
	l.name = l.name < 1 ? 1 : l.name;
	l.columns = columns;
	return l;
}

static uint64_t errors_of(const struct slave_status *slave, uint64_t *ret_rx, uint64_t *ret_links)
{
	*ret_rx = 0;
	*ret_links = 0;
	for (int port = 0; port < 4; port++) {
		*ret_rx += GET(slave->rx_errors[port]);
		*ret_links += GET(slave->lost_links[port]);
	}
	return *ret_rx + *ret_links;
}

/* --- order --- */

struct place {
	uint64_t weight; /* the largest first */
	char name[32];
	uint32_t index;
};

static uint64_t trouble_of(const struct status_page *page, uint32_t index)
{
	const struct slave_status *slave = &page->slave[index];
	uint32_t state = GET(slave->al_state);
	uint64_t rx;
	uint64_t links;

	if (GET(slave->is_lost) || (state & AL_STATE_MASK) == 0) {
		return 4;
	}
	if ((state & AL_ERROR) != 0 ||
	    (GET(page->bus_state) == BUS_OP && (state & AL_STATE_MASK) != AL_OP)) {
		return 3;
	}
	if (GET(slave->al_status_code) != 0) {
		return 2;
	}
	return errors_of(slave, &rx, &links) > 0 ? 1 : 0;
}

static uint64_t weight_of(const struct status_page *page, uint32_t index, enum report_sort sort)
{
	uint64_t rx;
	uint64_t links;

	switch (sort) {
	case REPORT_BY_TROUBLE:
		return trouble_of(page, index);
	case REPORT_BY_BAD:
		return GET(page->cycle.slave_bad[index]);
	case REPORT_BY_ERRORS:
		return errors_of(&page->slave[index], &rx, &links);
	case REPORT_BY_POSITION:
	case REPORT_BY_NAME:
	case REPORT_SORT_COUNT:
		break;
	}
	return 0;
}

static int compare_places(const void *a, const void *b)
{
	const struct place *x = a;
	const struct place *y = b;
	int by_name = strcmp(x->name, y->name);

	if (x->weight != y->weight) {
		return x->weight > y->weight ? -1 : 1;
	}
	if (by_name != 0) {
		return by_name;
	}
	return x->index < y->index ? -1 : 1;
}

/* NULL: no slaves, or no memory. Free with free(). */
static struct place *order_of(const struct status_page *page, enum report_sort sort)
{
	uint32_t count = source_slave_count(page);
	struct place *order = count == 0 ? NULL : calloc(count, sizeof(*order));

	for (uint32_t i = 0; order != NULL && i < count; i++) {
		order[i].index = i;
		order[i].weight = weight_of(page, i, sort);
		if (sort == REPORT_BY_NAME) {
			struct slave_info info = source_slave(page, i);

			memcpy(order[i].name, info.name, sizeof(order[i].name));
		}
	}
	if (order != NULL) {
		qsort(order, count, sizeof(*order), compare_places);
	}
	return order;
}

const char *report_sort_to_str(unsigned sort)
{
	static const char *const names[REPORT_SORT_COUNT] = {
		[REPORT_BY_POSITION] = "position", [REPORT_BY_TROUBLE] = "trouble",
		[REPORT_BY_NAME] = "name",         [REPORT_BY_BAD] = "bad",
		[REPORT_BY_ERRORS] = "errors",
	};

	return sort < REPORT_SORT_COUNT ? names[sort] : NULL;
}

/* --- lines --- */

static void write_state(const struct slave_status *slave, const struct layout *l, FILE *out)
{
	uint32_t al_state = GET(slave->al_state);
	int is_bad = GET(slave->is_lost) || (al_state & AL_ERROR) != 0 || al_state == 0;
	enum screen_colour colour = is_bad                                ? SCREEN_BAD
				    : (al_state & AL_STATE_MASK) == AL_OP ? SCREEN_GOOD
									  : SCREEN_WARN;
	char state[24];
	char *error;

	al_status_format(al_state, state, sizeof(state));
	error = strstr(state, "+ERROR");
	if (error != NULL && l->state < wide.state) {
		error[2] = '\0'; /* "SAFE-OP+E" */
	}
	fprintf(out, " %s%-*s%s", screen_colour(colour), l->state,
		GET(slave->is_lost) ? "LOST" : state, screen_colour(SCREEN_PLAIN));
}

static void write_errors(uint64_t count, const struct layout *l, FILE *out)
{
	char buf[TEXT_BYTES];

	fprintf(out, " %s%*s%s", screen_colour(count > 0 ? SCREEN_WARN : SCREEN_PLAIN), l->errors,
		fit_count(count, l->errors, buf, sizeof(buf)), screen_colour(SCREEN_PLAIN));
}

/* Behind the line, or below where there is not room for it. */
static void write_code(const struct slave_status *slave, const struct layout *l, FILE *out)
{
	uint32_t code = GET(slave->al_status_code);
	char text[128];
	int len;

	if (code == 0) {
		fputc('\n', out);
		return;
	}
	len = snprintf(text, sizeof(text), "0x%04x %s", code,
		       al_status_code_to_str((uint16_t)code));
	if (l->columns == 0 || rest_of(l) + l->name + 2 + len <= l->columns) {
		fprintf(out, "  %s%s%s\n", screen_colour(SCREEN_BAD), text,
			screen_colour(SCREEN_PLAIN));
		return;
	}
	if (l->columns > CODE_INDENT && len > l->columns - CODE_INDENT) {
		len = l->columns - CODE_INDENT;
	}
	fprintf(out, "\n%*s%s%.*s%s\n", CODE_INDENT, "", screen_colour(SCREEN_BAD), len, text,
		screen_colour(SCREEN_PLAIN));
}

static void write_slave(const struct status_page *page, uint32_t index, const struct layout *l,
			FILE *out)
{
	const struct slave_status *slave = &page->slave[index];
	struct slave_info info = source_slave(page, index);
	char name[sizeof(info.name)];
	char count[TEXT_BYTES];
	char diff[TEXT_BYTES] = "-";
	uint64_t rx;
	uint64_t links;

	errors_of(slave, &rx, &links);
	if (info.has_dc) {
		text_ns(GET(slave->dc_diff_ns), diff);
	}
	fprintf(out, "%3u %-*s", index, l->name, fit_name(info.name, l->name, name, sizeof(name)));
	write_state(slave, l, out);
	if (l->good > 0) {
		fprintf(out, " %*s", l->good,
			fit_count(GET(page->cycle.slave_good[index]), l->good, count,
				  sizeof(count)));
	}
	fprintf(out, " %*s", l->bad,
		fit_count(GET(page->cycle.slave_bad[index]), l->bad, count, sizeof(count)));
	fprintf(out, " %*s", l->diff, info.is_dc_reference ? "reference" : diff);
	write_errors(rx, l, out);
	write_errors(links, l, out);
	fputs(GET(slave->are_errors_short) ? "+" : "", out);
	write_code(slave, l, out);
}

void report_write_slaves_heading(const struct report *report, int columns, FILE *out)
{
	struct layout l = layout_of(report->page, columns);

	if (source_slave_count(report->page) == 0) {
		return;
	}
	fprintf(out, "%s%3s %-*s %-*s", screen_colour(SCREEN_BOLD), "pos", l.name, "slave", l.state,
		"state");
	if (l.good > 0) {
		fprintf(out, " %*s", l.good, "good");
	}
	fprintf(out, " %*s %*s %*s %*s%s\n", l.bad, "bad", l.diff, "dc diff", l.errors,
		l.errors < wide.errors ? "rxerr" : "rx err", l.errors, "links",
		screen_colour(SCREEN_PLAIN));
}

void report_write_slaves(const struct report *report, enum report_sort sort, int columns, FILE *out)
{
	struct layout l = layout_of(report->page, columns);
	uint32_t count = source_slave_count(report->page);
	struct place *order = order_of(report->page, sort);

	for (uint32_t i = 0; i < count; i++) {
		write_slave(report->page, order == NULL ? i : order[i].index, &l, out);
	}
	free(order);
}
