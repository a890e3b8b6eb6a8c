/* SPDX-License-Identifier: MIT */
#include "cli/report.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/clock.h"
#include "base/event.h"
#include "base/sync0.h"
#include "cli/fit.h"
#include "cli/screen.h"
#include "cli/source.h"
#include "cli/sync0_source.h"
#include "cli/text.h"
#include "reader/page.h"

#define GET(field) atomic_load_explicit(&(field), memory_order_relaxed)

enum { LABEL_COLUMNS = 11 };

void report_gather(struct cli *cli, const struct status_page *page,
		   const struct record_status *record, struct report *ret_report)
{
	struct report report = { .page = page, .record = record };
	struct samples samples;

	report.is_running = page != NULL && page_is_alive(page->pid);
	report.is_recorder_running = record != NULL && page_is_alive(record->pid);
	report.dds = source_dds(cli);
	report.is_dds_running = report.dds != NULL && page_is_alive(report.dds->pid);
	report.stream = source_stream(cli);
	report.is_stream_running = report.stream != NULL && page_is_alive(report.stream->pid);
	report.uplink = source_uplink(cli);
	report.is_uplink_running = report.uplink != NULL && page_is_alive(report.uplink->pid);
	report.sync0 = sync0_source_try(cli);
	report.is_sync0_running = report.sync0 != NULL && page_is_alive(report.sync0->pid);
	if (samples_try(cli, &samples) == 0) {
		if (page != NULL && samples.meta->session == page->session &&
		    reader_read_newest(samples.reader)) {
			struct sample_header header = samples_header(&samples);

			report.has_wkc = 1;
			report.wkc = header.wkc;
			report.wkc_expected = header.wkc_expected;
			report.flags = header.flags;
		}
		samples_close(&samples);
	}
	*ret_report = report;
}

void report_release(const struct report *report)
{
	source_dds_close(report->dds);
	source_stream_close(report->stream);
	source_uplink_close(report->uplink);
	sync0_source_close(report->sync0);
}

/* Behind the name of a program; at the end of a run all have ended, and should have. */
static const char *mark_absent(const struct report *report, int is_running)
{
	return is_running || report->is_summary ? "" : " (not running)";
}

static int64_t tai_now_ns(void)
{
	struct timespec ts;

	clock_gettime(CLOCK_TAI, &ts);
	return (int64_t)ts.tv_sec * NS_PER_S + ts.tv_nsec;
}

static void write_link(const struct status_page *page, FILE *out)
{
	uint32_t link = GET(page->link);
	uint32_t mbps = GET(page->link_mbps);

	if (link == STATUS_LINK_UP && mbps != 0) {
		fprintf(out, ", link %u Mbit/s", mbps);
	} else if (link != STATUS_LINK_UNKNOWN) {
		fprintf(out, ", link %s", link == STATUS_LINK_UP ? "up" : "DOWN");
	}
}

static enum screen_colour colour_of_bus(const struct status_page *page)
{
	uint32_t state = GET(page->bus_state);

	if (state == BUS_FAILED || state == BUS_RECOVERING || GET(page->is_waiting)) {
		return SCREEN_BAD;
	}
	return state == GET(page->bus_target) ? SCREEN_GOOD : SCREEN_WARN;
}

static void write_head(const struct report *report, FILE *out)
{
	const struct status_page *page = report->page;
	uint32_t expected = GET(page->slaves_expected);
	char buf[TEXT_BYTES];

	if (!report->is_running) {
		fprintf(out, "ecdaqd has ended (process %" PRId64 " is gone): last known state\n",
			page->pid);
	}
	fprintf(out, "ecdaqd %.32s   %s%s%s%s", page->version, screen_colour(colour_of_bus(page)),
		bus_state_to_str(GET(page->bus_state)), GET(page->is_waiting) ? ", waiting" : "",
		screen_colour(SCREEN_PLAIN));
	if (GET(page->bus_target) != BUS_OP || GET(page->is_waiting)) {
		fprintf(out, ", target %s", bus_state_to_str(GET(page->bus_target)));
	}
	fputs("   ", out);
	if (expected != 0 && expected != source_slave_count(page)) {
		fprintf(out, "%u of %u slaves", source_slave_count(page), expected);
	} else {
		fprintf(out, "%u slave%s", source_slave_count(page),
			source_slave_count(page) == 1 ? "" : "s");
	}
	fprintf(out, " on %.32s%s", page->interface, page->is_simulated ? " (simulated)" : "");
	write_link(page, out);
	if (report->is_running) {
		fprintf(out, "   up %s", text_uptime(tai_now_ns() - page->start_tai_ns, buf));
	}
	fputc('\n', out);
}

static void write_degraded(const struct status_page *page, FILE *out)
{
	static const char *const names[EVENT_RT_COUNT] = {
		[EVENT_RT_PRIORITY] = "priority",        [EVENT_RT_CPU] = "core",
		[EVENT_RT_MEMORY] = "memory lock",       [EVENT_RT_DMA_LATENCY] = "CPU latency",
		[EVENT_RT_RING_DISK] = "ring on a disk",
	};
	uint32_t bits = GET(page->rt_degraded);
	const char *separator = "";

	if (bits == 0) {
		return;
	}
	fputs("real time  not granted: ", out);
	for (unsigned i = 0; i < EVENT_RT_COUNT; i++) {
		if ((bits >> i & 1) != 0) {
			fprintf(out, "%s%s", separator, names[i]);
			separator = ", ";
		}
	}
	fputs("  (see ecdaq events)\n", out);
}

static void write_cycle(const struct report *report, FILE *out)
{
	const struct cycle_stats *st = &report->page->cycle;
	int64_t lock_ns = GET(st->dc_lock_ns);
	char buf[TEXT_BYTES];

	fprintf(out, "cycle      %" PRIu64 "   period %s", GET(st->cycle_number),
		text_ns((int64_t)report->page->period_ns, buf));
	if (report->has_wkc) {
		fprintf(out, "   WKC %u/%u", report->wkc, report->wkc_expected);
	}
	if (GET(report->page->cycle_cpu) != UINT32_MAX) {
		fprintf(out, "   core %u", GET(report->page->cycle_cpu));
	}
	fputs(GET(st->is_fail_safe) ? "   outputs FAIL-SAFE\n" : "\n", out);
	fprintf(out, "DC         %s", dc_state_to_str(GET(st->dc_state)));
	if (lock_ns > 0) {
		fprintf(out, " after %s", text_ns(lock_ns, buf));
	}
	fprintf(out,
		"   correction %+" PRId64 " ppb   lock lost %" PRIu64 "   largest difference %s\n",
		GET(st->correction_ppb), GET(st->dc_unlocks),
		text_ns(GET(st->dc_diff_max_ns), buf));
	fprintf(out,
		"frames     sent %" PRIu64 "   lost %" PRIu64 "   late %" PRIu64
		"   doubled %" PRIu64 "   foreign %" PRIu64 "   computed time %s\n",
		GET(st->frames_sent), GET(st->frames_lost), GET(st->frames_late),
		GET(st->frames_doubled), GET(st->frames_foreign),
		text_ns(GET(st->frames_need_ns), buf));
	fprintf(out,
		"cycles     %" PRIu64 "   overruns %" PRIu64 "   skipped %" PRIu64
		"   WKC low %" PRIu64 "   page faults %" PRIu64 "   rides %" PRIu64 "\n",
		GET(st->cycles), GET(st->overruns), GET(st->cycles_skipped), GET(st->wkc_low),
		GET(st->page_faults), GET(st->rides));
	fprintf(out,
		"samples    good %" PRIu64 "   bad %" PRIu64 "   of these unexplained %" PRIu64
		"\n",
		GET(st->samples_good), GET(st->samples_bad), GET(st->samples_bad_unexplained));
}

/* Nothing where there is none. */
static void write_control(const struct status_page *page, FILE *out)
{
	const struct control_status *st = &page->control;
	char plain[TEXT_BYTES * 4];
	char budget[TEXT_BYTES];

	if (GET(st->state) == CONTROL_NONE) {
		return;
	}
	fprintf(out,
		"control    %s: %s   %" PRIu64 " calls   %" PRIu64
		" beyond %s   fail-safe requests %" PRIu64 "   values limited %" PRIu64
		", refused %" PRIu64 "\n",
		text_plain(st->name, plain, sizeof(plain)), control_state_to_str(GET(st->state)),
		GET(st->calls), GET(st->overruns), text_ns(st->budget_ns, budget),
		GET(st->safe_cycles), GET(st->limited), GET(st->refused));
}

static void write_times(const struct status_page *page, FILE *out)
{
	const struct cycle_stats *st = &page->cycle;
	const struct {
		const char *name;
		const struct histogram *histogram;
	} rows[] = { { "wake", &st->wake_latency },
		     { "round trip", &st->round_trip },
		     { "phase", &st->phase },
		     { "work", &st->work },
		     { "control", &page->control.time } };
	size_t count = sizeof(rows) / sizeof(rows[0]);
	char p50[TEXT_BYTES];
	char p999[TEXT_BYTES];
	char max[TEXT_BYTES];

	fprintf(out, "%-10s %11s %11s %11s\n", "time", "p50", "p99.9", "max");
	if (GET(page->control.state) == CONTROL_NONE) {
		count--;
	}
	for (size_t i = 0; i < count; i++) {
		const struct histogram *h = rows[i].histogram;

		if (GET(h->count) == 0) {
			fprintf(out, "%-10s %11s %11s %11s\n", rows[i].name, "-", "-", "-");
			continue;
		}
		fprintf(out, "%-10s %11s %11s %11s\n", rows[i].name,
			text_ns(histogram_percentile(h, 500000), p50),
			text_ns(histogram_percentile(h, 999000), p999),
			text_ns(histogram_max_magnitude(h), max));
	}
}

static void write_recorder(const struct report *report, FILE *out)
{
	const struct record_status *record = report->record;
	char written[TEXT_BYTES];
	char left[TEXT_BYTES];

	if (record == NULL) {
		fputs("recorder   none\n", out);
		return;
	}
	fprintf(out,
		"recorder   %s%s   %" PRIu64 " cycles, %" PRIu64 " gaps (%" PRIu64
		" missing)   lag %" PRIu64 " cycles   %s written   %s free\n",
		record_state_to_str(GET(record->state)),
		GET(record->state) == RECORD_ENDED
			? ""
			: mark_absent(report, report->is_recorder_running),
		GET(record->recorded_cycles), GET(record->recorded_gaps),
		GET(record->cycles_missing), GET(record->lag_cycles),
		text_bytes(GET(record->bytes_written), written),
		text_bytes(GET(record->bytes_free), left));
	if (record->path[0] != '\0') {
		fprintf(out, "           %s\n", record->path);
	}
	if (record->message[0] != '\0') {
		fprintf(out, "           %s\n", record->message);
	}
}

/* Nothing where there is none: DDS is a choice. */
static void write_dds(const struct report *report, FILE *out)
{
	const struct dds_status *dds = report->dds;
	char plain[TEXT_BYTES * 4];

	if (dds == NULL) {
		return;
	}
	fprintf(out, "dds        %s%s, domain %u", text_plain(dds->interface, plain, sizeof(plain)),
		mark_absent(report, report->is_dds_running), dds->domain);
	if (dds->tag[0] != '\0') {
		fprintf(out, ", tag %s", text_plain(dds->tag, plain, sizeof(plain)));
	}
	fprintf(out,
		"   %" PRIu64 " cycles, %" PRIu64 " missed   %" PRIu64
		" subscribers   commands: %s, %" PRIu64 " accepted, %" PRIu64 " refused%s\n",
		GET(dds->published_cycles), GET(dds->missed_cycles), GET(dds->subscribers),
		dds->are_commands_on ? "on" : "off", GET(dds->commands_accepted),
		GET(dds->commands_refused), dds->is_secure ? "   secured" : "");
}

/* The same. */
static void write_stream(const struct report *report, FILE *out)
{
	const struct stream_status *st = report->stream;
	char plain[sizeof(st->message)];
	char sent[TEXT_BYTES];

	if (st == NULL) {
		return;
	}
	fprintf(out, "stream     %s%s, as %s", stream_state_to_str(GET(st->state)),
		mark_absent(report, report->is_stream_running),
		text_plain(st->appliance, plain, sizeof(plain)));
	fprintf(out, " in %s", text_plain(st->stream, plain, sizeof(plain)));
	if (st->server[0] != '\0') {
		fprintf(out, " at %s", text_plain(st->server, plain, sizeof(plain)));
	}
	fprintf(out,
		"   to cycle %" PRIu64 ", %" PRIu64 " gaps (%" PRIu64 " missing)   %" PRIu64
		" events   lag %" PRIu64 " cycles   %s sent\n",
		GET(st->next_cycle), GET(st->gaps), GET(st->cycles_missing), GET(st->events),
		GET(st->lag_cycles), text_bytes(GET(st->bytes_sent), sent));
	if (st->message[0] != '\0') {
		fprintf(out, "           %s\n", text_plain(st->message, plain, sizeof(plain)));
	}
}

/* The same. */
static void write_uplink(const struct report *report, FILE *out)
{
	const struct uplink_status *up = report->uplink;
	char plain[sizeof(up->message)];
	char bytes[TEXT_BYTES];
	char total[TEXT_BYTES];

	if (up == NULL) {
		return;
	}
	fprintf(out, "uplink     %s%s, as %s", uplink_state_to_str(GET(up->state)),
		mark_absent(report, report->is_uplink_running),
		text_plain(up->appliance, plain, sizeof(plain)));
	fprintf(out, " in %s", text_plain(up->bucket, plain, sizeof(plain)));
	fprintf(out, " at %s", text_plain(up->endpoint, plain, sizeof(plain)));
	fprintf(out, "   %" PRIu64 " uploaded, %s   %" PRIu64 " waiting, %s", GET(up->uploaded),
		text_bytes(GET(up->uploaded_bytes), bytes), GET(up->waiting),
		text_bytes(GET(up->waiting_bytes), total));
	if (GET(up->deleted) > 0) {
		fprintf(out, "   %" PRIu64 " deleted before", GET(up->deleted));
	}
	fputc('\n', out);
	if (up->file[0] != '\0') {
		fprintf(out, "           %s: %s of %s\n",
			text_plain(up->file, plain, sizeof(plain)),
			text_bytes(GET(up->file_sent), bytes),
			text_bytes(GET(up->file_bytes), total));
	}
	if (up->message[0] != '\0') {
		fprintf(out, "           %s\n", text_plain(up->message, plain, sizeof(plain)));
	}
}

uint32_t report_sync0_verdict(const struct sync0_status *page)
{
	uint32_t v = SYNC0_NONE;

	for (uint32_t i = 0; i < sync0_source_lines(page); i++) {
		const struct sync0_line_status *ls = &page->line[i];
		uint32_t own = GET(ls->is_lost) ? SYNC0_FAIL : GET(ls->verdict);

		v = own > v ? own : v;
	}
	return v;
}

/* Nothing where there is none. */
static void write_sync0(const struct report *report, FILE *out)
{
	const struct sync0_status *page = report->sync0;
	uint64_t missing = 0;

	if (page == NULL) {
		return;
	}
	for (uint32_t i = 0; i < sync0_source_lines(page); i++) {
		missing += GET(page->line[i].missing);
	}
	fprintf(out,
		"sync0      %s%s: %s   %u lines: %s   %" PRIu64 " windows   %" PRIu64
		" pulses missing   %" PRIu64 " alarms\n",
		sync0_source_to_str(page->source), mark_absent(report, report->is_sync0_running),
		sync0_state_to_str(GET(page->state)), sync0_source_lines(page),
		sync0_verdict_to_str(report_sync0_verdict(page)), GET(page->windows), missing,
		GET(page->alarms));
}

static void write_message(const struct status_page *page, FILE *out)
{
	char plain[sizeof(page->message)];

	if (page->message[0] != '\0') {
		fprintf(out, "message    %s%s%s\n", screen_colour(SCREEN_WARN),
			text_plain(page->message, plain, sizeof(plain)),
			screen_colour(SCREEN_PLAIN));
	}
}

/* In place of the lines of cycle, times and services, where there is not room for them. */
static void write_short(const struct report *report, FILE *out)
{
	const struct cycle_stats *st = &report->page->cycle;
	char wake[TEXT_BYTES];
	char trip[TEXT_BYTES];

	fprintf(out, "cycle      %" PRIu64, GET(st->cycle_number));
	if (report->has_wkc) {
		fprintf(out, "   WKC %u/%u", report->wkc, report->wkc_expected);
	}
	fprintf(out, "   DC %s%s   lost %" PRIu64 "   late %" PRIu64 "   overruns %" PRIu64 "\n",
		dc_state_to_str(GET(st->dc_state)),
		GET(st->is_fail_safe) ? "   outputs FAIL-SAFE" : "", GET(st->frames_lost),
		GET(st->frames_late), GET(st->overruns));
	fprintf(out, "samples    good %" PRIu64 "   bad %" PRIu64, GET(st->samples_good),
		GET(st->samples_bad));
	if (GET(st->round_trip.count) > 0) {
		fprintf(out, "   p99.9 wake %s, round trip %s",
			text_ns(histogram_percentile(&st->wake_latency, 999000), wake),
			text_ns(histogram_percentile(&st->round_trip, 999000), trip));
	}
	if (report->record != NULL) {
		fprintf(out, "   recorder %s, %" PRIu64 " gaps",
			record_state_to_str(GET(report->record->state)),
			GET(report->record->recorded_gaps));
	}
	fputc('\n', out);
}

static void write_head_lines(const struct report *report, enum report_detail detail, FILE *out)
{
	write_head(report, out);
	write_message(report->page, out);
	if (detail == REPORT_SHORT) {
		write_short(report, out);
		return;
	}
	write_degraded(report->page, out);
	write_cycle(report, out);
	write_control(report->page, out);
	write_times(report->page, out);
	write_recorder(report, out);
	write_dds(report, out);
	write_stream(report, out);
	write_uplink(report, out);
	write_sync0(report, out);
}

void report_write_head(const struct report *report, enum report_detail detail, int columns,
		       FILE *out)
{
	char *text = NULL;
	size_t len = 0;
	FILE *lines = open_memstream(&text, &len);

	if (lines == NULL) {
		return;
	}
	write_head_lines(report, detail, lines);
	if (fclose(lines) == 0) {
		fit_write(text, columns, LABEL_COLUMNS, out);
	}
	free(text);
}

void report_write_screen(const struct report *report, int columns, FILE *out)
{
	report_write_head(report, REPORT_FULL, columns, out);
	report_write_slaves_heading(report, columns, out);
	report_write_slaves(report, REPORT_BY_POSITION, columns, out);
}

void report_write_summary(const struct report *report, FILE *out)
{
	const struct cycle_stats *st = &report->page->cycle;
	uint32_t count = source_slave_count(report->page);

	fprintf(out,
		"%s: %u slave%s, %" PRIu64 " cycles; frames: %" PRIu64 " lost, %" PRIu64
		" late; %" PRIu64 " overruns; samples: %" PRIu64 " good, %" PRIu64 " bad, %" PRIu64
		" unexplained; %" PRIu64 " page faults\n",
		bus_state_to_str(GET(report->page->bus_state)), count, count == 1 ? "" : "s",
		GET(st->cycles), GET(st->frames_lost), GET(st->frames_late), GET(st->overruns),
		GET(st->samples_good), GET(st->samples_bad), GET(st->samples_bad_unexplained),
		GET(st->page_faults));
	write_control(report->page, out);
	write_times(report->page, out);
	write_recorder(report, out);
	write_dds(report, out);
	write_stream(report, out);
	write_uplink(report, out);
	write_sync0(report, out);
	write_message(report->page, out);
}
