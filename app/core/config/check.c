/* SPDX-License-Identifier: MIT */
/* Checks of options against each other. */
#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "config/gateway.h"
#include "config/option.h"

#define HOST_CHARS                                                                                 \
	"abcdefghijklmnopqrstuvwxyz"                                                               \
	"ABCDEFGHIJKLMNOPQRSTUVWXYZ"                                                               \
	"0123456789._-:"

struct relation {
	const char *subject;
	const char *other;
	int holds;
	const char *reason;
};

static int line_of(const struct option_lines *lines, const char *name)
{
	const struct option *option = option_find(name);

	return lines == NULL || option == NULL ? 0 : lines->line[option_place(option)];
}

static int check_relations(const struct config *cfg, const struct option_lines *lines,
			   const struct option_faults *faults)
{
	struct sockaddr_in6 address;
	socklen_t address_bytes;
	const struct relation relations[] = {
		{ "bus.watchdog", "cycle.period",
		  cfg->bus_watchdog_ns == 0 || cfg->bus_watchdog_ns >= 3 * cfg->cycle_period_ns,
		  "must be 0s or at least three times cycle.period" },
		{ "bus.presence", "bus.presence",
		  cfg->bus_presence != CONFIG_EXACT_SLAVES || cfg->slave_count > 0,
		  "exact requires a slaves list" },
		{ "dc.unlock_limit", "dc.lock_limit",
		  cfg->dc_unlock_limit_ns >= cfg->dc_lock_limit_ns,
		  "must not be below dc.lock_limit" },
		{ "dc.unlock_limit", "cycle.period",
		  cfg->dc_unlock_limit_ns <= cfg->cycle_period_ns / 2,
		  "must not be above half of cycle.period" },
		{ "dc.slew", "cycle.period", cfg->dc_slew_ns <= cfg->cycle_period_ns / 4,
		  "must not be above a quarter of cycle.period" },
		{ "dc.sync0_pulse", "cycle.period", cfg->dc_sync0_pulse_ns < cfg->cycle_period_ns,
		  "must be below cycle.period" },
		{ "control.budget", "cycle.period",
		  cfg->control_program[0] == '\0' || cfg->control_budget_ns < cfg->cycle_period_ns,
		  "must be below cycle.period" },
		{ "control.options", "control.program",
		  cfg->control_options[0] == '\0' || cfg->control_program[0] != '\0',
		  "requires control.program" },
		{ "sync0.window", "cycle.period",
		  cfg->sync0_window_ns >= 100 * cfg->cycle_period_ns,
		  "must be at least 100 times cycle.period" },
		{ "sync0.lost", "cycle.period", cfg->sync0_lost_ns >= 3 * cfg->cycle_period_ns,
		  "must be at least three times cycle.period" },
		{ "record.sync_period", "record.chunk_period",
		  cfg->record_sync_period_ns >= cfg->record_chunk_period_ns,
		  "must not be below record.chunk_period" },
		{ "record.rotate_period", "record.sync_period",
		  cfg->record_rotate_period_ns >= cfg->record_sync_period_ns,
		  "must not be below record.sync_period" },
		{ "record.budget", "record.rotate_size",
		  cfg->record_budget_bytes == 0 ||
			  cfg->record_budget_bytes >= cfg->record_rotate_bytes,
		  "must be 0B or at least record.rotate_size" },
		{ "record.dir", "record.enable", !cfg->record_enable || cfg->record_dir[0] != '\0',
		  "is required while record.enable is on" },
		{ "gateway.listen", "gateway.listen",
		  config_gateway_address(cfg, &address, &address_bytes) >= 0,
		  "expected off, loopback, or an IPv4 or IPv6 address" },
		{ "web.listen", "web.listen", config_web_address(cfg, &address, &address_bytes) > 0,
		  "expected loopback, or an IPv4 or IPv6 address" },
		{ "web.key", "web.certificate",
		  (cfg->web_key[0] == '\0') == (cfg->web_certificate[0] == '\0'),
		  "is required with web.certificate, and of no use without" },
		{ "eoe.interface", "bus.interface",
		  cfg->eoe_interface[0] == '\0' || strcmp(cfg->eoe_interface, cfg->interface) != 0,
		  "is bus.interface, which is for EtherCAT alone" },
	};

	for (size_t i = 0; i < sizeof(relations) / sizeof(relations[0]); i++) {
		const struct relation *rel = &relations[i];
		int line = line_of(lines, rel->subject);

		if (!rel->holds &&
		    faults->add(faults->ctx, rel->subject,
				line != 0 ? line : line_of(lines, rel->other), rel->reason)) {
			return 1;
		}
	}
	return 0;
}

static int is_made_of(const char *text, const char *chars)
{
	return text[strspn(text, chars)] == '\0';
}

static int check_dds(const struct config *cfg, const struct option_lines *lines,
		     const struct option_faults *faults)
{
	const char *key = "dds.interface";
	const char *fault = NULL;
	int line;

	if (!cfg->dds_enable) {
		return 0;
	}
	if (cfg->dds_interface[0] == '\0') {
		fault = "is required while dds.enable is on";
	} else if (strcmp(cfg->dds_interface, cfg->interface) == 0) {
		fault = "is bus.interface, which is for EtherCAT alone";
	} else if (!is_made_of(cfg->dds_interface, HOST_CHARS)) {
		fault = "is not the name of a network interface";
	} else if (!is_made_of(cfg->dds_peers, HOST_CHARS ",")) {
		key = "dds.peers";
		fault = "must be addresses or host names with commas between";
	} else if (strpbrk(cfg->dds_security, "<>&\"'${}") != NULL) {
		key = "dds.security";
		fault = "must be a path without < > & $ { } and quotes";
	}
	if (fault == NULL) {
		return 0;
	}
	line = line_of(lines, key);
	if (line == 0 && cfg->dds_interface[0] == '\0') {
		line = line_of(lines, "dds.enable");
	}
	return faults->add(faults->ctx, key, line, fault);
}

static int is_token(const char *text)
{
	return is_made_of(text, CONFIG_TOKEN);
}

static int check_stream(const struct config *cfg, const struct option_lines *lines,
			const struct option_faults *faults)
{
	const char *key = "stream.servers";
	const char *fault = NULL;
	int line;

	if (!cfg->stream_enable) {
		return 0;
	}
	if (cfg->stream_servers[0] == '\0') {
		fault = "is required while stream.enable is on";
	} else if (strchr(cfg->stream_servers, '@') != NULL) {
		fault = "must be without user and password: use stream.credentials";
	} else if (!is_token(cfg->stream_appliance)) {
		key = "stream.appliance";
		fault = "must be letters, digits, - and _";
	} else if (cfg->stream_name[0] == '\0' || !is_token(cfg->stream_name)) {
		key = "stream.stream";
		fault = "must be letters, digits, - and _";
	} else if ((cfg->stream_certificate[0] == '\0') != (cfg->stream_key[0] == '\0')) {
		key = "stream.certificate";
		fault = "and stream.key require each other";
	}
	if (fault == NULL) {
		return 0;
	}
	line = line_of(lines, key);
	return faults->add(faults->ctx, key, line != 0 ? line : line_of(lines, "stream.enable"),
			   fault);
}

static int is_prefix(const char *text)
{
	size_t len = strlen(text);

	return is_made_of(text, CONFIG_TOKEN "./") && text[0] != '/' &&
	       (len == 0 || text[len - 1] != '/') && strstr(text, "//") == NULL;
}

static int is_endpoint(const char *text)
{
	const char *host = strncmp(text, "https://", 8) == 0  ? text + 8
			   : strncmp(text, "http://", 7) == 0 ? text + 7
							      : "";

	return host[0] != '\0' && is_made_of(host, HOST_CHARS "[]");
}

static int check_uplink(const struct config *cfg, const struct option_lines *lines,
			const struct option_faults *faults)
{
	const char *key = NULL;
	const char *fault = "is required while uplink.enable is on";
	int line;

	if (!cfg->uplink_enable) {
		return 0;
	}
	if (cfg->uplink_endpoint[0] == '\0') {
		key = "uplink.endpoint";
	} else if (!is_endpoint(cfg->uplink_endpoint)) {
		key = "uplink.endpoint";
		fault = "expected https://HOST or http://HOST, with :PORT or without, and no more";
	} else if (cfg->uplink_bucket[0] == '\0') {
		key = "uplink.bucket";
	} else if (!is_made_of(cfg->uplink_bucket, CONFIG_TOKEN ".")) {
		key = "uplink.bucket";
		fault = "must be letters, digits, -, _ and .";
	} else if (cfg->uplink_region[0] == '\0' || !is_token(cfg->uplink_region)) {
		key = "uplink.region";
		fault = "must be letters, digits, - and _";
	} else if (!is_prefix(cfg->uplink_prefix)) {
		key = "uplink.prefix";
		fault = "must be letters, digits, -, _ and . with single / between";
	} else if (!is_token(cfg->uplink_appliance)) {
		key = "uplink.appliance";
		fault = "must be letters, digits, - and _";
	} else if (cfg->uplink_credentials[0] == '\0') {
		key = "uplink.credentials";
	} else if (cfg->uplink_dir[0] == '\0') {
		key = "uplink.dir";
	} else {
		return 0;
	}
	line = line_of(lines, key);
	return faults->add(faults->ctx, key, line != 0 ? line : line_of(lines, "uplink.enable"),
			   fault);
}

/* Slave @i against those before it. */
static const char *slave_fault(const struct config *cfg, size_t i, const char **ret_key,
			       char *reason)
{
	const struct config_slave *slave = &cfg->slave[i];

	*ret_key = "slaves[].sync0_shift";
	if (slave->sync0_shift_ns <= -cfg->cycle_period_ns ||
	    slave->sync0_shift_ns >= cfg->cycle_period_ns) {
		return "must be less than one cycle.period";
	}
	for (size_t j = 0; j < i; j++) {
		if (slave->sync0_line[0] != '\0' &&
		    strcmp(slave->sync0_line, cfg->slave[j].sync0_line) == 0) {
			*ret_key = "slaves[].sync0_line";
			snprintf(reason, OPTION_WHY_BYTES, "is already used by slave %zu", j);
			return reason;
		}
		if (slave->name[0] != '\0' && strcmp(slave->name, cfg->slave[j].name) == 0) {
			*ret_key = "slaves[].name";
			snprintf(reason, OPTION_WHY_BYTES,
				 "slaves %zu and %zu have the same name %s", j, i, slave->name);
			return reason;
		}
	}
	return NULL;
}

static int check_slaves(const struct config *cfg, const struct option_faults *faults)
{
	size_t sync0_lines = 0;
	char reason[OPTION_WHY_BYTES];

	for (size_t i = 0; i < cfg->slave_count; i++) {
		const char *key = "slaves[].sync0_line";
		const char *fault;

		sync0_lines += cfg->slave[i].sync0_line[0] != '\0';
		if (cfg->slave[i].sync0_line[0] != '\0' && sync0_lines == LIMIT_SYNC0_LINES + 1) {
			snprintf(reason, OPTION_WHY_BYTES, "more than LIMIT_SYNC0_LINES = %d lines",
				 LIMIT_SYNC0_LINES);
			fault = reason;
		} else {
			fault = slave_fault(cfg, i, &key, reason);
		}
		if (fault != NULL && faults->add(faults->ctx, key, cfg->slave[i].line, fault)) {
			return 1;
		}
	}
	return 0;
}

static const char *channel_fault(const struct config *cfg, size_t i, const char **ret_key,
				 char *reason)
{
	const struct config_channel *item = &cfg->channel[i];
	const struct config_slave *slave = &cfg->slave[item->slave_pos];

	*ret_key = "slaves[].channels[].match";
	if (item->match[0] == '\0') {
		return "is empty";
	}
	*ret_key = "slaves[].channels[].offset";
	if (item->offset != 0 && item->scale == 0) {
		return "requires scale";
	}
	*ret_key = "slaves[].channels[].max";
	if (!(item->min < item->max)) {
		return "is not above min";
	}
	*ret_key = "slaves[].channels[].name";
	if (strlen(slave->name) + 1 + strlen(item->name) >= LIMIT_NAME_BYTES) {
		snprintf(reason, OPTION_WHY_BYTES, "%s.%s is longer than %d characters",
			 slave->name, item->name, LIMIT_NAME_BYTES - 1);
		return reason;
	}
	for (size_t j = 0; j < i && item->name[0] != '\0'; j++) {
		if (cfg->channel[j].slave_pos == item->slave_pos &&
		    strcmp(cfg->channel[j].name, item->name) == 0) {
			snprintf(reason, OPTION_WHY_BYTES, "%s is already used in line %d",
				 item->name, cfg->channel[j].line);
			return reason;
		}
	}
	return NULL;
}

static int check_channels(const struct config *cfg, const struct option_faults *faults)
{
	char reason[OPTION_WHY_BYTES];

	for (size_t i = 0; i < cfg->channel_count; i++) {
		const char *key;
		const char *fault = channel_fault(cfg, i, &key, reason);

		if (fault != NULL && faults->add(faults->ctx, key, cfg->channel[i].line, fault)) {
			return 1;
		}
	}
	return 0;
}

static const char *output_fault(const struct config *cfg, size_t i, const char **ret_key,
				char *reason)
{
	const struct config_output *output = &cfg->output[i];

	*ret_key = "channel";
	if (output->channel[0] == '\0') {
		return "is missing";
	}
	for (size_t j = 0; j < i; j++) {
		if (strcmp(output->channel, cfg->output[j].channel) != 0) {
			continue;
		}
		if (cfg->output[j].line == 0) {
			return "duplicate channel";
		}
		snprintf(reason, OPTION_WHY_BYTES, "%s is already in line %d", output->channel,
			 cfg->output[j].line);
		return reason;
	}
	*ret_key = "max";
	if (!(output->min <= output->max)) {
		return "is below min";
	}
	*ret_key = "fail_safe";
	if (!(output->fail_safe >= output->min && output->fail_safe <= output->max)) {
		return "is not within min and max";
	}
	*ret_key = "timeout";
	if (output->timeout_ns != 0 && output->owner != CONFIG_OWNER_REMOTE) {
		return "requires owner: remote";
	}
	return NULL;
}

static int check_outputs(const struct config *cfg, const struct option_faults *faults)
{
	char reason[OPTION_WHY_BYTES];
	char key[OPTION_KEY_BYTES];

	for (size_t i = 0; i < cfg->output_count; i++) {
		const struct config_output *output = &cfg->output[i];
		const char *option;
		const char *fault = output_fault(cfg, i, &option, reason);

		if (fault == NULL) {
			continue;
		}
		snprintf(key, sizeof(key), "%soutputs[].%s",
			 output->slave_pos == CONFIG_NO_SLAVE ? "" : "slaves[].", option);
		if (faults->add(faults->ctx, key, output->line, fault)) {
			return 1;
		}
	}
	return 0;
}

/* Counts what it hands on. */
struct counted {
	const struct option_faults *faults;
	size_t count;
};

static int count_fault(void *ctx, const char *key, int line, const char *reason)
{
	struct counted *counted = ctx;

	counted->count++;
	return counted->faults->add(counted->faults->ctx, key, line, reason);
}

int option_cross_check(const struct config *cfg, const struct option_lines *lines,
		       const struct option_faults *faults)
{
	struct counted counted = { .faults = faults };
	const struct option_faults all = { .add = count_fault, .ctx = &counted };
	int is_over = check_relations(cfg, lines, &all);

	is_over = is_over || check_dds(cfg, lines, &all);
	is_over = is_over || check_stream(cfg, lines, &all);
	is_over = is_over || check_uplink(cfg, lines, &all);
	is_over = is_over || check_slaves(cfg, &all);
	is_over = is_over || check_channels(cfg, &all);
	is_over = is_over || check_outputs(cfg, &all);
	return is_over || counted.count > 0 ? -EINVAL : 0;
}
