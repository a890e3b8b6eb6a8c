/* SPDX-License-Identifier: MIT */
#include "web/bus_view.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "base/slave_place.h"
#include "web/state.h"
#include "web/text.h"
#include "wire/al.h"

#define GET(field) atomic_load_explicit(&(field), memory_order_relaxed)

enum { NUMBER_BYTES = 16, STATE_BYTES = 24 };

/* Errors and lost links of a cable. */
struct sums {
	uint64_t errors;
	uint64_t links;
};

static uint32_t slaves_of(const struct bus_view *view)
{
	uint32_t count = view->page_error == 0 ? GET(view->page->slave_count) : 0;

	return count < LIMIT_SLAVES ? count : LIMIT_SLAVES;
}

static struct slave_place place_of(const struct bus_view *view, uint32_t pos)
{
	return slave_place_unpack(GET(view->page->slave[pos].place), pos);
}

static void add_port(const struct slave_status *slave, unsigned port, struct sums *sums)
{
	sums->errors += GET(slave->rx_errors[port]);
	sums->links += GET(slave->lost_links[port]);
}

/* At both ends of the cable towards the master; of all ports where the tree is not known. */
static struct sums sums_of(const struct bus_view *view, uint32_t pos)
{
	const struct slave_status *slave = &view->page->slave[pos];
	struct slave_place place = place_of(view, pos);
	struct sums sums = { 0, 0 };

	for (unsigned port = 0; port < SLAVE_PORTS; port++) {
		if (!place.is_known || port == place.entry_port) {
			add_port(slave, port, &sums);
		}
	}
	if (place.is_known && place.parent >= 0) {
		add_port(&view->page->slave[place.parent], place.parent_port, &sums);
	}
	return sums;
}

static enum state_level level_of(const struct bus_view *view, uint32_t pos)
{
	const struct slave_status *slave = &view->page->slave[pos];
	uint32_t al = GET(slave->al_state);

	if (GET(slave->is_lost) || (al & AL_STATE_MASK) == 0 || (al & AL_ERROR) != 0) {
		return STATE_BAD;
	}
	if (GET(view->page->bus_state) == BUS_OP && (al & AL_STATE_MASK) != AL_OP) {
		return STATE_BAD;
	}
	return GET(slave->al_status_code) != 0 ? STATE_WARNING : STATE_GOOD;
}

static void put_state(struct json *js, const struct bus_view *view, uint32_t pos)
{
	char state[STATE_BYTES] = "LOST";

	if (!GET(view->page->slave[pos].is_lost)) {
		al_status_format(GET(view->page->slave[pos].al_state), state, sizeof(state));
	}
	json_text(js, "state", state);
	json_text(js, "level", state_level_to_str(level_of(view, pos)));
}

static void put_slave(struct json *js, const struct bus_view *view, uint32_t pos)
{
	const struct slave_status *slave = &view->page->slave[pos];
	struct slave_place place = place_of(view, pos);
	struct sums sums = sums_of(view, pos);

	json_object_begin(js, NULL);
	json_text(js, "name", slave->info.name);
	json_text(js, "device", slave->info.device);
	put_state(js, view, pos);
	if (place.is_known) {
		json_i64(js, "parent", place.parent);
		json_u64(js, "parent_port", place.parent_port);
		json_u64(js, "port", place.entry_port);
	}
	if (GET(slave->cable_ns) >= 0) {
		json_i64(js, "cable_ns", GET(slave->cable_ns));
	}
	json_u64(js, "errors", sums.errors);
	json_u64(js, "links", sums.links);
	json_object_end(js);
}

/* Items of slaves[] that no slave was found for; all of them, if the daemon could not say which
 * slave is which: then its message says why. */
static void put_missing(struct json *js, const struct bus_view *view)
{
	uint8_t is_found[LIMIT_SLAVES] = { 0 };
	int is_bound = 0;

	for (uint32_t i = 0; i < slaves_of(view); i++) {
		uint16_t item = view->page->slave[i].info.config_item;

		if (item > 0 && item <= view->cfg->slave_count) {
			is_found[item - 1] = 1;
			is_bound = 1;
		}
	}
	json_array_begin(js, "missing");
	for (size_t i = 0; i < view->cfg->slave_count; i++) {
		const struct config_slave *want = &view->cfg->slave[i];
		char name[sizeof(want->name)];

		if (is_found[i]) {
			continue;
		}
		snprintf(name, sizeof(name), "%s", want->name);
		if (name[0] == '\0') {
			snprintf(name, sizeof(name), "slaves[%zu]", i);
		}
		json_object_begin(js, NULL);
		json_text(js, "name", name);
		json_text(js, "state",
			  !is_bound           ? "expected"
			  : want->is_optional ? "absent, optional"
					      : "missing");
		json_text(js, "level",
			  state_level_to_str(want->is_optional ? STATE_GOOD
					     : is_bound        ? STATE_BAD
							       : STATE_WARNING));
		json_object_end(js);
	}
	json_array_end(js);
}

/* Whether slaves[] of this program's configuration is that of the daemon, as far as can be seen. */
static int is_same_config(const struct bus_view *view)
{
	return view->page_error == 0 && GET(view->page->slaves_expected) == view->cfg->slave_count;
}

char *bus_view_tree(const struct bus_view *view)
{
	struct text t;

	if (text_begin(&t, "bus") < 0) {
		return NULL;
	}
	json_truth(&t.json, "alive", view->page_error == 0 && view->is_alive);
	if (view->page_error == 0) {
		json_text(&t.json, "interface", view->page->interface);
		json_text(&t.json, "message", view->page->message);
		json_u64(&t.json, "expected", GET(view->page->slaves_expected));
	}
	json_truth(&t.json, "same_config", is_same_config(view));
	json_array_begin(&t.json, "slaves");
	for (uint32_t i = 0; i < slaves_of(view); i++) {
		put_slave(&t.json, view, i);
	}
	json_array_end(&t.json);
	if (is_same_config(view)) {
		put_missing(&t.json, view);
	}
	return text_end(&t);
}

static void put_hex(struct json *js, const char *key, uint32_t value, int digits)
{
	char text[NUMBER_BYTES];

	snprintf(text, sizeof(text), "0x%0*" PRIx32, digits, value);
	json_text(js, key, text);
}

static void put_counts(struct json *js, const char *key, const _Atomic uint32_t *counts)
{
	json_array_begin(js, key);
	for (unsigned port = 0; port < SLAVE_PORTS; port++) {
		json_u64(js, NULL, GET(counts[port]));
	}
	json_array_end(js);
}

/* What slaves[] says this slave is; what it leaves open is not there. */
static void put_expected(struct json *js, const struct config_slave *want)
{
	json_object_begin(js, "expected");
	if (want->vendor != 0) {
		put_hex(js, "vendor", want->vendor, 8);
	}
	if (want->product != 0) {
		put_hex(js, "product", want->product, 8);
	}
	if (want->revision != 0) {
		put_hex(js, "revision", want->revision, 8);
	}
	if (want->serial != 0) {
		put_hex(js, "serial", want->serial, 8);
	}
	if (want->alias != 0) {
		json_u64(js, "alias", want->alias);
	}
	json_object_end(js);
}

static void put_identity(struct json *js, const struct slave_info *info)
{
	json_object_begin(js, "found");
	put_hex(js, "vendor", info->vendor, 8);
	put_hex(js, "product", info->product, 8);
	put_hex(js, "revision", info->revision, 8);
	put_hex(js, "serial", info->serial, 8);
	json_u64(js, "alias", info->alias);
	json_object_end(js);
	put_hex(js, "station", info->station_addr, 4);
	json_u64(js, "input_bits", info->input_bits);
	json_u64(js, "output_bits", info->output_bits);
}

static void put_clock(struct json *js, const struct slave_status *slave)
{
	const struct slave_info *info = &slave->info;

	if (!info->has_dc) {
		return;
	}
	json_object_begin(js, "clock");
	json_truth(js, "reference", info->is_dc_reference);
	json_i64(js, "delay_ns", info->dc_delay_ns);
	json_i64(js, "difference_ns", GET(slave->dc_diff_ns));
	json_u64(js, "sync0_cycle_ns", info->sync0_cycle_ns);
	json_i64(js, "sync0_shift_ns", info->sync0_shift_ns);
	json_object_end(js);
}

static void put_details(struct json *js, const struct bus_view *view, uint32_t pos)
{
	const struct slave_status *slave = &view->page->slave[pos];
	uint16_t code = (uint16_t)GET(slave->al_status_code);
	uint16_t item = slave->info.config_item;
	char group[sizeof(slave->group) + 1];

	snprintf(group, sizeof(group), "%.*s", (int)sizeof(slave->group), slave->group);
	json_text(js, "name", slave->info.name);
	json_text(js, "device", slave->info.device);
	json_text(js, "group", group);
	put_state(js, view, pos);
	put_hex(js, "code", code, 4);
	json_text(js, "code_text", al_status_code_to_str(code));
	json_text(js, "hint", code == 0 ? "" : al_status_code_hint(code));
	put_identity(js, &slave->info);
	if (is_same_config(view) && item > 0 && item <= view->cfg->slave_count) {
		put_expected(js, &view->cfg->slave[item - 1]);
	}
	put_clock(js, slave);
	json_u64(js, "samples_good", GET(view->page->cycle.slave_good[pos]));
	json_u64(js, "samples_bad", GET(view->page->cycle.slave_bad[pos]));
	json_u64(js, "open_ports", place_of(view, pos).open_ports);
	put_counts(js, "rx_errors", slave->rx_errors);
	put_counts(js, "forwarded_errors", slave->forwarded_errors);
	put_counts(js, "lost_links", slave->lost_links);
	json_u64(js, "processing_errors", GET(slave->processing_errors));
	json_u64(js, "pdi_errors", GET(slave->pdi_errors));
	json_truth(js, "short", GET(slave->are_errors_short) != 0);
}

char *bus_view_slave(const struct bus_view *view, uint32_t pos)
{
	struct text t;

	if (text_begin(&t, "slave") < 0) {
		return NULL;
	}
	json_u64(&t.json, "position", pos);
	if (pos < slaves_of(view)) { /* else it has no name */
		put_details(&t.json, view, pos);
	}
	return text_end(&t);
}
