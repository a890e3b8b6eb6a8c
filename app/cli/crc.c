/* SPDX-License-Identifier: MIT */
/*
 * ecdaq crc: the error counters in the slaves' registers, slave by slave and port by port, once or
 * again and again, with the cable that the errors of a port come from.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/args.h"
#include "base/clock.h"
#include "cli/admin_client.h"
#include "cli/cable.h"
#include "cli/cli.h"
#include "cli/each_slave.h"
#include "cli/screen.h"
#include "cli/source.h"
#include "program/args_duration.h"
#include "program/json.h"

enum { LINE_COLUMNS = 80 };

/* The counters of one slave as they were read last. */
struct reading {
	int is_there;
	struct admin_diagnosis found;
};

struct crc {
	struct cli *cli;
	const struct status_page *page;
	int is_reset;
	int is_json;
	int64_t interval_ns;    /* 0: once */
	uint64_t count;         /* of readings; 0: no end */
	struct reading *before; /* by position; with an interval */
	struct json js;
};

/* --- what has been added --- */

/* A counter that went down was set to zero in between: by --reset, or by ecdaqd, which does so
 * before one reaches its end. */
static uint8_t added(uint8_t before, uint8_t now)
{
	return now >= before ? (uint8_t)(now - before) : now;
}

static struct admin_port port_added(const struct admin_port *before, const struct admin_port *now)
{
	struct admin_port port = *now;

	port.invalid_frames = added(before->invalid_frames, now->invalid_frames);
	port.rx_errors = added(before->rx_errors, now->rx_errors);
	port.forwarded_errors = added(before->forwarded_errors, now->forwarded_errors);
	port.lost_links = added(before->lost_links, now->lost_links);
	return port;
}

static int is_quiet(const struct admin_port *port)
{
	return port->invalid_frames == 0 && port->rx_errors == 0 && port->lost_links == 0;
}

/* --- text --- */

/* The errors of a port, not counting forwarded ones, arise between it and the port before it. */
static void show_cable(const struct crc *crc, uint16_t pos, unsigned number,
		       const struct admin_port *port)
{
	const char *what = port->is_ebus ? "the E-bus" : "the cable";
	char text[CABLE_TEXT_BYTES];
	char *second;

	cable_describe(crc->page, pos, number, text);
	second = strstr(text, " and ");
	if (strlen("    port 0: check ") + strlen(what) + 1 + strlen(text) > LINE_COLUMNS &&
	    second != NULL) {
		*second++ = '\0';
		printf("    port %u: check %s %s\n            %s\n", number, what, text, second);
	} else {
		printf("    port %u: check %s %s\n", number, what, text);
	}
}

static void show_head(const struct crc *crc, uint16_t pos)
{
	printf("%3u %s\n"
	       "    port  state  invalid frames  receive errors  forwarded  lost links\n",
	       pos, source_slave(crc->page, pos).name);
}

static void show_port(unsigned number, const struct admin_port *port)
{
	printf("    %-4u  %-5s  %14u  %14u  %9u  %10u\n", number,
	       port->is_communicating ? "open"
	       : port->is_link        ? "link"
				      : "-",
	       port->invalid_frames, port->rx_errors, port->forwarded_errors, port->lost_links);
}

static void show_text(const struct crc *crc, uint16_t pos, const struct admin_diagnosis *found)
{
	show_head(crc, pos);
	for (unsigned i = 0; i < ADMIN_PORTS; i++) {
		show_port(i, &found->port[i]);
	}
	if (found->has_processing_errors) {
		printf("    processing errors %u, PDI errors %u\n", found->processing_errors,
		       found->pdi_errors);
	}
	if (found->has_expirations) {
		printf("    watchdog expired: process data %u, PDI %u\n", found->expirations_pd,
		       found->expirations_pdi);
	}
	for (unsigned i = 0; i < ADMIN_PORTS; i++) {
		if (!is_quiet(&found->port[i])) {
			show_cable(crc, pos, i, &found->port[i]);
		}
	}
}

/* Only ports whose counters have gone up. */
static void show_added(const struct crc *crc, uint16_t pos, const struct admin_diagnosis *before,
		       const struct admin_diagnosis *now)
{
	for (unsigned i = 0; i < ADMIN_PORTS; i++) {
		struct admin_port port = port_added(&before->port[i], &now->port[i]);

		if (is_quiet(&port) && port.forwarded_errors == 0) {
			continue;
		}
		printf("%3u %s: port %u: +%u invalid frames, +%u receive errors,\n"
		       "    +%u forwarded, +%u lost links\n",
		       pos, source_slave(crc->page, pos).name, i, port.invalid_frames,
		       port.rx_errors, port.forwarded_errors, port.lost_links);
		if (!is_quiet(&port)) {
			show_cable(crc, pos, i, &port);
		}
	}
}

/* --- JSON --- */

static void count_or_null(struct json *js, const char *key, int is_there, unsigned count)
{
	if (is_there) {
		json_u64(js, key, count);
	} else {
		json_null(js, key);
	}
}

static void write_counts(struct json *js, const struct admin_port *port)
{
	json_u64(js, "invalid_frames", port->invalid_frames);
	json_u64(js, "receive_errors", port->rx_errors);
	json_u64(js, "forwarded_errors", port->forwarded_errors);
	json_u64(js, "lost_links", port->lost_links);
}

/* @before: NULL where nothing was read before. */
static void show_json(struct crc *crc, uint16_t pos, const struct admin_diagnosis *before,
		      const struct admin_diagnosis *found)
{
	struct json *js = &crc->js;
	char cable[CABLE_TEXT_BYTES];

	json_object_begin(js, NULL);
	json_u64(js, "position", pos);
	json_text(js, "name", source_slave(crc->page, pos).name);
	json_array_begin(js, "port");
	for (unsigned i = 0; i < ADMIN_PORTS; i++) {
		const struct admin_port *port = &found->port[i];

		json_object_begin(js, NULL);
		json_truth(js, "link", port->is_link);
		json_truth(js, "open", port->is_communicating);
		json_truth(js, "ebus", port->is_ebus);
		write_counts(js, port);
		json_text(js, "cable", cable_describe(crc->page, pos, i, cable));
		if (before != NULL) {
			struct admin_port more = port_added(&before->port[i], port);

			json_object_begin(js, "added");
			write_counts(js, &more);
			json_object_end(js);
		}
		json_object_end(js);
	}
	json_array_end(js);
	count_or_null(js, "processing_errors", found->has_processing_errors,
		      found->processing_errors);
	count_or_null(js, "pdi_errors", found->has_processing_errors, found->pdi_errors);
	count_or_null(js, "watchdog_process_data", found->has_expirations, found->expirations_pd);
	count_or_null(js, "watchdog_pdi", found->has_expirations, found->expirations_pdi);
	json_object_end(js);
}

/* --- reading --- */

static void show(struct crc *crc, uint16_t pos, const struct admin_diagnosis *found)
{
	struct reading *last = crc->before == NULL ? NULL : &crc->before[pos];
	int has_before = last != NULL && last->is_there;

	if (crc->is_json) {
		show_json(crc, pos, has_before ? &last->found : NULL, found);
	} else if (has_before) {
		show_added(crc, pos, &last->found, found);
	} else {
		show_text(crc, pos, found);
	}
	if (last != NULL) {
		*last = (struct reading){ .is_there = 1, .found = *found };
	}
}

/* Shown as they were before a reset. */
static enum exit_code run_one(void *ctx, uint16_t pos)
{
	struct crc *crc = ctx;
	struct admin_request rq = { .verb = ADMIN_DIAGNOSIS, .slave_pos = pos };
	struct admin_diagnosis found;
	struct admin_reply reply;
	enum exit_code result = admin_do(crc->cli, &rq, &reply);

	if (result != EXIT_CODE_OK) {
		return result;
	}
	memcpy(&found, reply.data, sizeof(found));
	show(crc, pos, &found);
	if (crc->is_reset) {
		rq.verb = ADMIN_ERRORS_RESET;
		result = admin_do(crc->cli, &rq, &reply);
		if (result == EXIT_CODE_OK && crc->before != NULL) {
			crc->before[pos].found = (struct admin_diagnosis){ 0 };
		}
	}
	return result;
}

/* One reading. */
static enum exit_code read_all(struct crc *crc, const struct args *args)
{
	enum exit_code result = each_slave_listed(crc->cli, crc->page, args,
						  crc->is_json ? &crc->js : NULL, run_one, crc);

	fflush(stdout);
	return result;
}

/* Until so many readings were made, the user ends it, or ecdaqd is gone. */
static enum exit_code repeat(struct crc *crc, const struct args *args)
{
	enum exit_code result;

	crc->before = calloc(LIMIT_SLAVES, sizeof(*crc->before));
	if (crc->before == NULL) {
		return cli_fail(crc->cli, EXIT_CODE_FAILED, "out of memory");
	}
	screen_catch_signals();
	for (uint64_t n = 1;; n++) {
		result = read_all(crc, args);
		crc->is_reset = 0; /* once, before what is counted */
		if (n == crc->count || screen_is_over() || result == EXIT_CODE_NO_DAEMON ||
		    result == EXIT_CODE_PERMISSION || result == EXIT_CODE_FAILED) {
			break;
		}
		screen_wait(crc->interval_ns);
		if (screen_is_over()) {
			break;
		}
	}
	free(crc->before);
	return result;
}

enum exit_code verb_crc(struct cli *cli, int argc, char **argv)
{
	struct crc crc = { .cli = cli };
	const struct args_option options[] = {
		{ "reset", 0, args_flag, &crc.is_reset, NULL,
		  "set them to zero after they were read" },
		{ "interval", 'i', args_duration, &crc.interval_ns, "T",
		  "again and again: what was added since the reading before" },
		{ "count", 'n', args_count, &crc.count, "N",
		  "end after N readings, 1s apart without --interval" },
		{ "json", 0, args_flag, &crc.is_json, NULL, "a JSON array, one a reading" },
	};
	struct args args = { .options = options, .option_count = 4, .operands_max = 4096 };
	enum exit_code result;

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	if (crc.count > 0 && crc.interval_ns == 0) {
		crc.interval_ns = NS_PER_S;
	}
	result = source_status(cli, &crc.page);
	if (result != EXIT_CODE_OK) {
		return result;
	}
	result = crc.interval_ns > 0 ? repeat(&crc, &args) : read_all(&crc, &args);
	source_status_close(crc.page);
	return result;
}
