/* SPDX-License-Identifier: MIT */
/* ecdaq metrics: the figures of ecdaqd and its services in the text format of Prometheus. */
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/args.h"
#include "base/clock.h"
#include "cli/cli.h"
#include "cli/report.h"
#include "cli/source.h"
#include "reader/page.h"

#define GET(field) atomic_load_explicit(&(field), memory_order_relaxed)

/* One figure of a page: @offset is that of an _Atomic uint64_t. */
struct figure {
	const char *name; /* with "_total": a counter, else a gauge */
	const char *help;
	size_t offset;
};

#define CYCLE(name, field, help) { "ecdaq_" name, help, offsetof(struct status_page, cycle.field) }
#define RECORD(name, field, help)                                                                  \
	{ "ecdaq_recorder_" name, help, offsetof(struct record_status, field) }
#define DDS(name, field, help) { "ecdaq_dds_" name, help, offsetof(struct dds_status, field) }
#define STREAM(name, field, help)                                                                  \
	{ "ecdaq_stream_" name, help, offsetof(struct stream_status, field) }

#define UPLINK(name, field, help)                                                                  \
	{ "ecdaq_uplink_" name, help, offsetof(struct uplink_status, field) }

static const struct figure of_cycle[] = {
	CYCLE("cycles_total", cycles, "Exchanges of process data."),
	CYCLE("frames_sent_total", frames_sent, "Cyclic frames sent."),
	CYCLE("frames_lost_total", frames_lost, "Cyclic frames not back before their deadline."),
	CYCLE("frames_late_total", frames_late, "Frames that came in a later cycle, not used."),
	CYCLE("frames_doubled_total", frames_doubled, "Duplicates of frames, dropped."),
	CYCLE("frames_foreign_total", frames_foreign, "Frames of others or damaged, dropped."),
	CYCLE("wkc_low_total", wkc_low, "Cycles with a working counter below the expected one."),
	CYCLE("overruns_total", overruns, "Times the work passed a deadline."),
	CYCLE("cycles_skipped_total", cycles_skipped, "Deadlines passed over."),
	CYCLE("samples_good_total", samples_good, "Samples of slaves in OP that are good."),
	CYCLE("samples_bad_total", samples_bad, "Samples of slaves in OP that are not good."),
	CYCLE("op_lost_total", op_lost, "Times a slave was seen to have left OP."),
	CYCLE("stranger_cycles_total", cycles_with_stranger,
	      "Cycles in which more slaves answered than belong to the bus."),
	CYCLE("page_faults_total", page_faults, "Page faults of the cycle thread."),
	CYCLE("dc_unlocks_total", dc_unlocks, "Times the lock to the reference clock was lost."),
	CYCLE("dc_diff_high_cycles_total", cycles_dc_diff_high,
	      "Cycles in OP with a system time difference above dc.diff_limit."),
};

static const struct figure of_record[] = {
	RECORD("cycles_total", recorded_cycles, "Cycles recorded of this session."),
	RECORD("gaps_total", recorded_gaps, "Gaps in the recorded cycle numbers."),
	RECORD("missing_cycles_total", cycles_missing, "Cycles missing in these gaps."),
	RECORD("written_bytes_total", bytes_written, "Bytes written."),
	RECORD("files_total", files, "Files begun."),
	RECORD("free_bytes", bytes_free, "Free space of the recordings' file system."),
	RECORD("lag_cycles", lag_cycles, "Cycles in the ring that are not recorded yet."),
};

static const struct figure of_dds[] = {
	DDS("cycles_total", published_cycles, "Cycles published."),
	DDS("missed_cycles_total", missed_cycles, "Cycles that had left the ring."),
	DDS("failed_messages_total", failed_messages, "Messages rejected by DDS."),
	DDS("subscribers", subscribers, "Readers of samples and blocks."),
	DDS("commands_accepted_total", commands_accepted, "Commands taken."),
	DDS("commands_refused_total", commands_refused, "Commands refused."),
};

static const struct figure of_stream[] = {
	STREAM("blocks_total", blocks, "Messages with samples that were stored."),
	STREAM("slave_cycles_total", cycles, "Cycles in them, each slave's counted."),
	STREAM("sent_bytes_total", bytes_sent, "Bytes of these messages."),
	STREAM("events_total", events, "Events stored."),
	STREAM("events_lost_total", events_lost, "Events that had left the ring."),
	STREAM("gaps_total", gaps, "Gaps in the cycle numbers that were sent."),
	STREAM("missing_cycles_total", cycles_missing, "Cycles missing in these gaps."),
	STREAM("connects_total", connects, "Connections made to the server."),
	STREAM("lag_cycles", lag_cycles, "Cycles in the ring that are not sent yet."),
};

static const struct figure of_uplink[] = {
	UPLINK("recordings_total", uploaded, "Recordings uploaded."),
	UPLINK("uploaded_bytes_total", uploaded_bytes, "Bytes of these recordings."),
	UPLINK("waiting_recordings", waiting, "Finished recordings that are not uploaded."),
	UPLINK("waiting_bytes", waiting_bytes, "Bytes of these recordings."),
	UPLINK("deleted_recordings_total", deleted, "Recordings deleted before their upload."),
	UPLINK("failures_total", failures, "Attempts that failed."),
};

/* Upper bounds of the buckets of a time. */
static const int64_t bounds_ns[] = { 1000,   2000,   5000,    10000,   20000,   50000,   100000,
				     200000, 500000, 1000000, 2000000, 5000000, 10000000 };

enum { BOUNDS = sizeof(bounds_ns) / sizeof(bounds_ns[0]) };

static void put_head(FILE *out, const char *name, const char *type, const char *help)
{
	fprintf(out, "# HELP %s %s\n# TYPE %s %s\n", name, help, name, type);
}

static void put_gauge(FILE *out, const char *name, const char *help, double value)
{
	put_head(out, name, "gauge", help);
	fprintf(out, "%s %.15g\n", name, value);
}

static void put_figures(FILE *out, const struct figure *figures, size_t count, const void *page)
{
	for (size_t i = 0; i < count; i++) {
		const char *name = figures[i].name;
		size_t len = strlen(name);
		int is_counter = len > 6 && strcmp(name + len - 6, "_total") == 0;
		const _Atomic uint64_t *value =
			(const void *)((const uint8_t *)page + figures[i].offset);

		put_head(out, name, is_counter ? "counter" : "gauge", figures[i].help);
		fprintf(out, "%s %" PRIu64 "\n", name, GET(*value));
	}
}

#define PUT_FIGURES(out, figures, page)                                                            \
	put_figures(out, figures, sizeof(figures) / sizeof((figures)[0]), page)

/* In the quotes of a label. */
static void put_label(FILE *out, const char *text)
{
	for (; *text != '\0'; text++) {
		if (*text == '\n') {
			fputs("\\n", out);
			continue;
		}
		if (*text == '"' || *text == '\\') {
			fputc('\\', out);
		}
		fputc(*text, out);
	}
}

/* A value is in the bucket of @bounds_ns whose bound its own bucket does not pass: 3 % late. */
static void put_histogram(FILE *out, const char *name, const char *help, const struct histogram *h)
{
	uint64_t below = 0;
	uint64_t count = 0;
	unsigned next = 0;

	put_head(out, name, "histogram", help);
	for (unsigned i = 0; i < BOUNDS; i++) {
		while (next < HISTOGRAM_BUCKETS &&
		       histogram_bucket_floor(next + 1) <= bounds_ns[i]) {
			below += GET(h->bucket[next++]);
		}
		fprintf(out, "%s_bucket{le=\"%g\"} %" PRIu64 "\n", name,
			(double)bounds_ns[i] / NS_PER_S, below);
	}
	for (count = below; next < HISTOGRAM_BUCKETS; next++) {
		count += GET(h->bucket[next]);
	}
	fprintf(out, "%s_bucket{le=\"+Inf\"} %" PRIu64 "\n%s_sum %.9f\n%s_count %" PRIu64 "\n",
		name, count, name, (double)GET(h->sum_ns) / NS_PER_S, name, count);
}

/* --- slaves --- */

static double good_of(const struct status_page *page, uint32_t i)
{
	return (double)GET(page->cycle.slave_good[i]);
}

static double bad_of(const struct status_page *page, uint32_t i)
{
	return (double)GET(page->cycle.slave_bad[i]);
}

static double state_of(const struct status_page *page, uint32_t i)
{
	return GET(page->slave[i].al_state);
}

static double code_of(const struct status_page *page, uint32_t i)
{
	return GET(page->slave[i].al_status_code);
}

static double lost_of(const struct status_page *page, uint32_t i)
{
	return GET(page->slave[i].is_lost) != 0;
}

static double sum_of_ports(const _Atomic uint32_t *ports)
{
	double sum = 0;

	for (int port = 0; port < 4; port++) {
		sum += GET(ports[port]);
	}
	return sum;
}

static double rx_errors_of(const struct status_page *page, uint32_t i)
{
	return sum_of_ports(page->slave[i].rx_errors);
}

static double lost_links_of(const struct status_page *page, uint32_t i)
{
	return sum_of_ports(page->slave[i].lost_links);
}

static void put_slaves(FILE *out, const struct status_page *page)
{
	static const struct {
		const char *name;
		const char *type;
		const char *help;
		double (*value)(const struct status_page *page, uint32_t i);
	} all[] = {
		{ "ecdaq_slave_samples_good_total", "counter", "Good samples in OP.", good_of },
		{ "ecdaq_slave_samples_bad_total", "counter", "Other samples in OP.", bad_of },
		{ "ecdaq_slave_al_state", "gauge",
		  "AL state: 1 INIT, 2 PRE-OP, 3 BOOT, 4 SAFE-OP, 8 OP, 16 more: error; 0: not "
		  "known.",
		  state_of },
		{ "ecdaq_slave_al_status_code", "gauge", "AL status code.", code_of },
		{ "ecdaq_slave_lost", "gauge", "1: the slave does not answer.", lost_of },
		{ "ecdaq_slave_rx_errors_total", "counter",
		  "Invalid frames and receive errors, of all ports.", rx_errors_of },
		{ "ecdaq_slave_lost_links_total", "counter", "Lost links, of all ports.",
		  lost_links_of },
	};

	for (size_t k = 0; k < sizeof(all) / sizeof(all[0]); k++) {
		put_head(out, all[k].name, all[k].type, all[k].help);
		for (uint32_t i = 0; i < source_slave_count(page); i++) {
			fprintf(out, "%s{position=\"%u\",slave=\"", all[k].name, i);
			put_label(out, source_slave(page, i).name);
			fprintf(out, "\"} %.15g\n", all[k].value(page, i));
		}
	}
}

/* --- bus --- */

static void put_bus(FILE *out, const struct status_page *page)
{
	static const char state[] = "ecdaq_bus_state";

	put_head(out, state, "gauge", "1: the state that the bus is in.");
	for (uint32_t s = BUS_DOWN; s <= BUS_INIT; s++) {
		fprintf(out, "%s{state=\"%s\"} %d\n", state, bus_state_to_str(s),
			GET(page->bus_state) == s);
	}
	put_gauge(out, "ecdaq_bus_waiting", "1: what is configured is not there.",
		  GET(page->is_waiting) != 0);
	put_gauge(out, "ecdaq_link_up", "1: the network link is up, -1: not known.",
		  GET(page->link) == STATUS_LINK_UNKNOWN ? -1 : GET(page->link) == STATUS_LINK_UP);
	put_gauge(out, "ecdaq_slaves", "Slaves found.", source_slave_count(page));
	put_gauge(out, "ecdaq_slaves_expected", "Slaves configured; 0: whatever is there.",
		  GET(page->slaves_expected));
	put_gauge(out, "ecdaq_outputs_fail_safe", "1: outputs have their fail-safe values.",
		  GET(page->cycle.is_fail_safe));
	put_gauge(out, "ecdaq_period_seconds", "Period of the cycle.",
		  (double)page->period_ns / NS_PER_S);
	put_gauge(out, "ecdaq_dc_locked", "1: the cycle follows the reference clock.",
		  GET(page->cycle.dc_state) == DC_LOCKED);
	put_gauge(out, "ecdaq_dc_diff_max_seconds",
		  "Largest system time difference of a slave since lock.",
		  (double)GET(page->cycle.dc_diff_max_ns) / NS_PER_S);
	put_gauge(out, "ecdaq_dc_correction_ratio", "Correction of the host's period.",
		  (double)GET(page->cycle.correction_ppb) / 1e9);
}

static void put_info(FILE *out, const struct status_page *page)
{
	char version[sizeof(page->version) + 1];
	char interface[sizeof(page->interface) + 1];

	snprintf(version, sizeof(version), "%.*s", (int)sizeof(page->version), page->version);
	snprintf(interface, sizeof(interface), "%.*s", (int)sizeof(page->interface),
		 page->interface);
	put_head(out, "ecdaq_info", "gauge", "1; labels: what runs.");
	fputs("ecdaq_info{version=\"", out);
	put_label(out, version);
	fputs("\",interface=\"", out);
	put_label(out, interface);
	fprintf(out, "\",session=\"%" PRIu64 "\",simulated=\"%d\"} 1\n", page->session,
		page->is_simulated != 0);
}

static void put_uplink(FILE *out, const struct uplink_status *page)
{
	static const char state[] = "ecdaq_uplink_state";

	PUT_FIGURES(out, of_uplink, page);
	put_gauge(out, "ecdaq_uplink_uploaded_timestamp_seconds",
		  "Unix time of the newest upload; 0: none since the start.",
		  (double)GET(page->uploaded_utc_s));
	put_gauge(out, "ecdaq_uplink_waiting_timestamp_seconds",
		  "Unix time at which the oldest recording that waits was begun; 0: none waits.",
		  (double)GET(page->waiting_utc_s));
	put_head(out, state, "gauge", "1: the state that the upload is in.");
	for (uint32_t s = UPLINK_IDLE; s <= UPLINK_RETRYING; s++) {
		fprintf(out, "%s{state=\"%s\"} %d\n", state, uplink_state_to_str(s),
			GET(page->state) == s);
	}
}

static void put_services(FILE *out, const struct report *report)
{
	const struct {
		const char *name;
		int is_running;
	} all[] = { { "recorder", report->is_recorder_running },
		    { "dds", report->is_dds_running },
		    { "stream", report->is_stream_running },
		    { "uplink", report->is_uplink_running },
		    { "sync0", report->is_sync0_running } };

	put_head(out, "ecdaq_service_up", "gauge", "1: the service runs.");
	for (size_t i = 0; i < sizeof(all) / sizeof(all[0]); i++) {
		fprintf(out, "ecdaq_service_up{service=\"%s\"} %d\n", all[i].name,
			all[i].is_running);
	}
	if (report->record != NULL) {
		PUT_FIGURES(out, of_record, report->record);
		put_gauge(out, "ecdaq_recorder_running",
			  "1: the recorder records; 0: waits, has failed, or its disk is full.",
			  GET(report->record->state) == RECORD_RUNNING);
	}
	if (report->dds != NULL) {
		PUT_FIGURES(out, of_dds, report->dds);
	}
	if (report->stream != NULL) {
		PUT_FIGURES(out, of_stream, report->stream);
	}
	if (report->uplink != NULL) {
		put_uplink(out, report->uplink);
	}
}

static void put_master(FILE *out, const struct status_page *page)
{
	const struct cycle_stats *st = &page->cycle;

	put_info(out, page);
	put_bus(out, page);
	PUT_FIGURES(out, of_cycle, page);
	put_histogram(out, "ecdaq_wake_latency_seconds", "Wake of the cycle minus its deadline.",
		      &st->wake_latency);
	put_histogram(out, "ecdaq_round_trip_seconds", "Frame out to frame back.", &st->round_trip);
	put_histogram(out, "ecdaq_work_seconds", "Wake to end of work.", &st->work);
	put_slaves(out, page);
}

/* Of services that have run: they do without ecdaqd, too, an upload above all. */
static int has_service(const struct report *report)
{
	return report->record != NULL || report->dds != NULL || report->stream != NULL ||
	       report->uplink != NULL || report->sync0 != NULL;
}

static enum exit_code write_to(struct cli *cli, FILE *out)
{
	const struct status_page *page = NULL;
	struct report report;
	int r = source_try_status(cli, &page);

	if (r < 0 && r != -ENOENT && r != -ENOTDIR) {
		return source_status(cli, &page); /* reports why */
	}
	put_gauge(out, "ecdaq_up", "1: ecdaqd runs.", r == 0 && page_is_alive(page->pid));
	report_gather(cli, r < 0 ? NULL : page, source_record(cli), &report);
	if (r == 0) {
		put_master(out, page);
		source_status_close(page);
	}
	if (r == 0 || has_service(&report)) {
		put_services(out, &report);
	}
	report_release(&report);
	source_record_close(report.record);
	return EXIT_CODE_OK;
}

/* Whoever reads @path sees the old text or the new one, whole. */
static enum exit_code write_file(struct cli *cli, const char *path)
{
	char temporary[CONFIG_PATH_BYTES];
	enum exit_code result;
	FILE *out;
	int err;

	if ((size_t)snprintf(temporary, sizeof(temporary), "%s.%d", path, (int)getpid()) >=
	    sizeof(temporary)) {
		return cli_fail(cli, EXIT_CODE_USAGE, "%s: name too long", path);
	}
	out = fopen(temporary, "we");
	if (out == NULL) {
		return errno == EACCES ? cli_fail_permission(cli, "write", temporary)
				       : cli_fail(cli, EXIT_CODE_FAILED, "%s: %s", temporary,
						  strerror(errno));
	}
	result = write_to(cli, out);
	err = ferror(out) ? EIO : 0;
	err = fclose(out) != 0 ? errno : err;
	if (result == EXIT_CODE_OK && err == 0 && rename(temporary, path) != 0) {
		err = errno;
	}
	if (result != EXIT_CODE_OK || err != 0) {
		unlink(temporary);
	}
	return err == 0 ? result : cli_fail(cli, EXIT_CODE_FAILED, "%s: %s", path, strerror(err));
}

enum exit_code verb_metrics(struct cli *cli, int argc, char **argv)
{
	const char *output = NULL;
	const struct args_option options[] = {
		{ "output", 'o', args_text, &output, "FILE",
		  "write FILE, as a whole, for the textfile collector of node_exporter" },
	};
	struct args args = { .options = options, .option_count = 1 };
	enum exit_code result;

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	return output != NULL ? write_file(cli, output) : write_to(cli, stdout);
}
