/* SPDX-License-Identifier: MIT */
#include "base/event.h"
#include "cli/report.h"
#include "cli/source.h"
#include "cli/sync0_source.h"
#include "wire/al.h"

#define GET(field) atomic_load_explicit(&(field), memory_order_relaxed)

static void write_histogram(struct json *js, const char *key, const struct histogram *h)
{
	uint64_t count = GET(h->count);

	json_object_begin(js, key);
	json_u64(js, "count", count);
	json_i64(js, "p50", histogram_percentile(h, 500000));
	json_i64(js, "p99", histogram_percentile(h, 990000));
	json_i64(js, "p999", histogram_percentile(h, 999000));
	json_i64(js, "max", histogram_max_magnitude(h));
	if (count > 0) {
		json_double(js, "mean", (double)GET(h->sum_ns) / (double)count);
	} else {
		json_null(js, "mean");
	}
	json_object_end(js);
}

static void write_counters(struct json *js, const struct cycle_stats *st)
{
	json_u64(js, "cycles", GET(st->cycles));
	json_u64(js, "cycle_number", GET(st->cycle_number));
	json_u64(js, "frames_sent", GET(st->frames_sent));
	json_u64(js, "frames_lost", GET(st->frames_lost));
	json_u64(js, "frames_late", GET(st->frames_late));
	json_u64(js, "frames_doubled", GET(st->frames_doubled));
	json_u64(js, "frames_foreign", GET(st->frames_foreign));
	json_u64(js, "wkc_low", GET(st->wkc_low));
	json_u64(js, "overruns", GET(st->overruns));
	json_u64(js, "cycles_skipped", GET(st->cycles_skipped));
	json_u64(js, "samples_good", GET(st->samples_good));
	json_u64(js, "samples_bad", GET(st->samples_bad));
	json_u64(js, "samples_bad_unexplained", GET(st->samples_bad_unexplained));
	json_u64(js, "page_faults", GET(st->page_faults));
	json_u64(js, "rides", GET(st->rides));
	json_i64(js, "frames_need_ns", GET(st->frames_need_ns));
	json_u64(js, "op_lost", GET(st->op_lost));
	json_u64(js, "cycles_with_stranger", GET(st->cycles_with_stranger));
	json_u64(js, "slaves_answering", GET(st->slaves_found));
	json_truth(js, "fail_safe", GET(st->is_fail_safe) != 0);
}

static void write_clocks(struct json *js, const struct cycle_stats *st)
{
	int64_t lock_ns = GET(st->dc_lock_ns);

	json_text(js, "dc_state", dc_state_to_str(GET(st->dc_state)));
	if (lock_ns > 0) {
		json_double(js, "dc_lock_ms", (double)lock_ns / 1e6);
	} else {
		json_null(js, "dc_lock_ms");
	}
	json_u64(js, "dc_unlocks", GET(st->dc_unlocks));
	json_i64(js, "dc_time_ns", GET(st->dc_time_ns));
	json_i64(js, "dc_diff_max_ns", GET(st->dc_diff_max_ns));
	json_u64(js, "cycles_dc_diff_high", GET(st->cycles_dc_diff_high));
	json_i64(js, "correction_ppb", GET(st->correction_ppb));
}

static void write_degraded(struct json *js, const struct status_page *page)
{
	static const char *const names[EVENT_RT_COUNT] = {
		[EVENT_RT_PRIORITY] = "priority",      [EVENT_RT_CPU] = "cpu",
		[EVENT_RT_MEMORY] = "lock_memory",     [EVENT_RT_DMA_LATENCY] = "cpu_dma_latency",
		[EVENT_RT_RING_DISK] = "ring_on_disk",
	};
	uint32_t bits = GET(page->rt_degraded);

	json_array_begin(js, "rt_degraded");
	for (unsigned i = 0; i < EVENT_RT_COUNT; i++) {
		if ((bits >> i & 1) != 0) {
			json_text(js, NULL, names[i]);
		}
	}
	json_array_end(js);
	if (GET(page->cycle_cpu) == UINT32_MAX) {
		json_null(js, "cycle_cpu");
	} else {
		json_u64(js, "cycle_cpu", GET(page->cycle_cpu));
	}
}

static void write_record(struct json *js, const struct report *report)
{
	const struct record_status *record = report->record;

	if (record == NULL) {
		json_null(js, "recording");
		json_u64(js, "recorded_cycles", 0);
		json_u64(js, "recorded_gaps", 0);
		json_null(js, "recorder");
		return;
	}
	json_text(js, "recording", record->path);
	json_u64(js, "recorded_cycles", GET(record->recorded_cycles));
	json_u64(js, "recorded_gaps", GET(record->recorded_gaps));
	json_object_begin(js, "recorder");
	json_text(js, "state", record_state_to_str(GET(record->state)));
	json_truth(js, "running", report->is_recorder_running);
	json_i64(js, "pid", record->pid);
	json_u64(js, "session", GET(record->session));
	json_u64(js, "cycles_missing", GET(record->cycles_missing));
	json_u64(js, "first_cycle", GET(record->first_cycle));
	json_u64(js, "last_cycle", GET(record->last_cycle));
	json_u64(js, "synced_cycle", GET(record->synced_cycle));
	json_u64(js, "lag_cycles", GET(record->lag_cycles));
	json_u64(js, "bytes_written", GET(record->bytes_written));
	json_u64(js, "bytes_free", GET(record->bytes_free));
	json_u64(js, "files", GET(record->files));
	json_text(js, "message", record->message);
	json_object_end(js);
}

static void write_dds(struct json *js, const struct report *report)
{
	const struct dds_status *dds = report->dds;

	if (dds == NULL) {
		json_null(js, "dds");
		return;
	}
	json_object_begin(js, "dds");
	json_truth(js, "running", report->is_dds_running);
	json_i64(js, "pid", dds->pid);
	json_text(js, "interface", dds->interface);
	json_u64(js, "domain", dds->domain);
	json_text(js, "tag", dds->tag);
	json_truth(js, "secure", dds->is_secure != 0);
	json_truth(js, "commands", dds->are_commands_on != 0);
	json_u64(js, "session", GET(dds->session));
	json_u64(js, "published_cycles", GET(dds->published_cycles));
	json_u64(js, "missed_cycles", GET(dds->missed_cycles));
	json_u64(js, "failed_messages", GET(dds->failed_messages));
	json_u64(js, "subscribers", GET(dds->subscribers));
	json_u64(js, "commands_accepted", GET(dds->commands_accepted));
	json_u64(js, "commands_refused", GET(dds->commands_refused));
	json_object_end(js);
}

static void write_stream(struct json *js, const struct report *report)
{
	const struct stream_status *st = report->stream;

	if (st == NULL) {
		json_null(js, "stream");
		return;
	}
	json_object_begin(js, "stream");
	json_text(js, "state", stream_state_to_str(GET(st->state)));
	json_truth(js, "running", report->is_stream_running);
	json_i64(js, "pid", st->pid);
	json_text(js, "server", st->server);
	json_text(js, "stream", st->stream);
	json_text(js, "appliance", st->appliance);
	json_u64(js, "session", GET(st->session));
	json_u64(js, "next_cycle", GET(st->next_cycle));
	json_u64(js, "blocks", GET(st->blocks));
	json_u64(js, "slave_cycles", GET(st->cycles));
	json_u64(js, "bytes_sent", GET(st->bytes_sent));
	json_u64(js, "events", GET(st->events));
	json_u64(js, "events_lost", GET(st->events_lost));
	json_u64(js, "gaps", GET(st->gaps));
	json_u64(js, "cycles_missing", GET(st->cycles_missing));
	json_u64(js, "connects", GET(st->connects));
	json_u64(js, "lag_cycles", GET(st->lag_cycles));
	json_text(js, "message", st->message);
	json_object_end(js);
}

static void write_uplink(struct json *js, const struct report *report)
{
	const struct uplink_status *up = report->uplink;

	if (up == NULL) {
		json_null(js, "uplink");
		return;
	}
	json_object_begin(js, "uplink");
	json_text(js, "state", uplink_state_to_str(GET(up->state)));
	json_truth(js, "running", report->is_uplink_running);
	json_i64(js, "pid", up->pid);
	json_text(js, "endpoint", up->endpoint);
	json_text(js, "bucket", up->bucket);
	json_text(js, "appliance", up->appliance);
	json_text(js, "file", up->file);
	json_u64(js, "file_bytes", GET(up->file_bytes));
	json_u64(js, "file_sent", GET(up->file_sent));
	json_u64(js, "uploaded", GET(up->uploaded));
	json_u64(js, "uploaded_bytes", GET(up->uploaded_bytes));
	json_u64(js, "waiting", GET(up->waiting));
	json_u64(js, "waiting_bytes", GET(up->waiting_bytes));
	json_u64(js, "waiting_utc_s", GET(up->waiting_utc_s));
	json_u64(js, "deleted", GET(up->deleted));
	json_u64(js, "failures", GET(up->failures));
	json_u64(js, "uploaded_utc_s", GET(up->uploaded_utc_s));
	json_text(js, "message", up->message);
	json_object_end(js);
}

static void write_control(struct json *js, const struct status_page *page)
{
	const struct control_status *st = &page->control;
	char text[sizeof(st->path)];

	if (GET(st->state) == CONTROL_NONE) {
		json_null(js, "control");
		return;
	}
	json_object_begin(js, "control");
	snprintf(text, sizeof(text), "%.*s", (int)sizeof(st->name), st->name);
	json_text(js, "program", text);
	snprintf(text, sizeof(text), "%.*s", (int)sizeof(st->path), st->path);
	json_text(js, "path", text);
	json_text(js, "state", control_state_to_str(GET(st->state)));
	json_i64(js, "budget_ns", st->budget_ns);
	json_u64(js, "calls", GET(st->calls));
	json_u64(js, "overruns", GET(st->overruns));
	json_u64(js, "safe_cycles", GET(st->safe_cycles));
	json_u64(js, "limited", GET(st->limited));
	json_u64(js, "refused", GET(st->refused));
	write_histogram(js, "time_ns", &st->time);
	json_object_end(js);
}

static void write_ports(struct json *js, const char *key, const _Atomic uint32_t *counts)
{
	json_array_begin(js, key);
	for (int port = 0; port < 4; port++) {
		json_u64(js, NULL, GET(counts[port]));
	}
	json_array_end(js);
}

void report_slave_json(const struct status_page *page, uint32_t index, struct json *js)
{
	const struct slave_status *slave = &page->slave[index];
	struct slave_info info = source_slave(page, index);
	uint32_t code = GET(slave->al_status_code);
	char group[SOURCE_GROUP_BYTES];
	char state[24];

	al_status_format(GET(slave->al_state), state, sizeof(state));
	json_object_begin(js, NULL);
	json_u64(js, "position", index);
	json_text(js, "name", info.name);
	json_text(js, "group", source_group(page, index, group));
	json_text(js, "device", info.device);
	json_u64(js, "vendor", info.vendor);
	json_u64(js, "product", info.product);
	json_u64(js, "revision", info.revision);
	json_u64(js, "serial", info.serial);
	json_u64(js, "station_address", info.station_addr);
	json_u64(js, "alias", info.alias);
	json_text(js, "state", state);
	json_truth(js, "lost", GET(slave->is_lost) != 0);
	json_u64(js, "al_status_code", code);
	json_text(js, "al_status", al_status_code_to_str((uint16_t)code));
	json_u64(js, "good", GET(page->cycle.slave_good[index]));
	json_u64(js, "bad", GET(page->cycle.slave_bad[index]));
	json_truth(js, "has_dc", info.has_dc != 0);
	json_truth(js, "is_dc_reference", info.is_dc_reference != 0);
	json_i64(js, "dc_delay_ns", info.dc_delay_ns);
	json_i64(js, "dc_diff_ns", GET(slave->dc_diff_ns));
	json_u64(js, "sync0_cycle_ns", info.sync0_cycle_ns);
	json_i64(js, "sync0_shift_ns", info.sync0_shift_ns);
	json_u64(js, "input_bits", info.input_bits);
	json_u64(js, "output_bits", info.output_bits);
	json_u64(js, "output_sync_type", GET(slave->output_sync_type));
	json_u64(js, "input_sync_type", GET(slave->input_sync_type));
	json_u64(js, "minimum_cycle_ns", GET(slave->minimum_cycle_ns));
	write_ports(js, "rx_errors", slave->rx_errors);
	write_ports(js, "forwarded_errors", slave->forwarded_errors);
	write_ports(js, "lost_links", slave->lost_links);
	json_u64(js, "processing_errors", GET(slave->processing_errors));
	json_u64(js, "pdi_errors", GET(slave->pdi_errors));
	json_truth(js, "errors_incomplete", GET(slave->are_errors_short) != 0);
	json_object_end(js);
}

static void write_process(struct json *js, const struct report *report)
{
	const struct status_page *page = report->page;
	uint32_t state = GET(page->bus_state);
	char text[64];

	/* The summary shows the state of the run, not its end: that is in "running". */
	if (report->is_summary && GET(page->bus_state) == BUS_STOPPED) {
		state = GET(page->bus_state_at_stop);
	}
	json_text(js, "state", bus_state_to_str(state));
	json_text(js, "target", bus_state_to_str(GET(page->bus_target)));
	json_truth(js, "waiting", GET(page->is_waiting) != 0);
	if (GET(page->link) == STATUS_LINK_UNKNOWN) {
		json_null(js, "link_up");
	} else {
		json_truth(js, "link_up", GET(page->link) == STATUS_LINK_UP);
	}
	json_u64(js, "link_mbps", GET(page->link_mbps));
	json_truth(js, "running", report->is_running);
	json_u64(js, "exit_code", GET(page->exit_code));
	json_text(js, "message", page->message);
	snprintf(text, sizeof(text), "%.*s", (int)sizeof(page->version), page->version);
	json_text(js, "version", text);
	json_i64(js, "pid", page->pid);
	snprintf(text, sizeof(text), "%.*s", (int)sizeof(page->interface), page->interface);
	json_text(js, "interface", text);
	json_truth(js, "simulated", page->is_simulated != 0);
	json_u64(js, "session", page->session);
	json_i64(js, "start_tai_ns", page->start_tai_ns);
	json_u64(js, "heartbeat", GET(page->heartbeat));
	json_u64(js, "period_ns", page->period_ns);
	json_u64(js, "slaves", source_slave_count(page));
	json_u64(js, "slaves_expected", GET(page->slaves_expected));
}

static void write_sync0(const struct report *report, struct json *js)
{
	const struct sync0_status *page = report->sync0;

	if (page == NULL) {
		json_null(js, "sync0");
		return;
	}
	json_object_begin(js, "sync0");
	json_truth(js, "running", report->is_sync0_running);
	json_text(js, "source", sync0_source_to_str(page->source));
	json_text(js, "state", sync0_state_to_str(GET(page->state)));
	json_text(js, "verdict", sync0_verdict_to_str(report_sync0_verdict(page)));
	json_u64(js, "lines", sync0_source_lines(page));
	json_u64(js, "windows", GET(page->windows));
	json_u64(js, "alarms", GET(page->alarms));
	json_object_end(js);
}

void report_write_json(const struct report *report, struct json *js)
{
	const struct status_page *page = report->page;

	json_object_begin(js, NULL);
	write_process(js, report);
	write_counters(js, &page->cycle);
	if (report->has_wkc) {
		json_u64(js, "wkc", report->wkc);
		json_u64(js, "wkc_expected", report->wkc_expected);
	} else {
		json_null(js, "wkc");
		json_null(js, "wkc_expected");
	}
	write_clocks(js, &page->cycle);
	write_histogram(js, "wake_latency_ns", &page->cycle.wake_latency);
	write_histogram(js, "round_trip_ns", &page->cycle.round_trip);
	write_histogram(js, "phase_ns", &page->cycle.phase);
	write_histogram(js, "work_ns", &page->cycle.work);
	write_control(js, page);
	write_record(js, report);
	write_dds(js, report);
	write_stream(js, report);
	write_uplink(js, report);
	write_sync0(report, js);
	write_degraded(js, page);
	json_array_begin(js, "slave");
	for (uint32_t i = 0; i < source_slave_count(page); i++) {
		report_slave_json(page, i, js);
	}
	json_array_end(js);
	json_object_end(js);
}
