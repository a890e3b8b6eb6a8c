/* SPDX-License-Identifier: MIT */
/* ecdaq crc: the error counters in the slaves' registers, slave by slave and port by port. */
#include <stdio.h>
#include <string.h>

#include "base/args.h"
#include "cli/admin_client.h"
#include "cli/cli.h"
#include "cli/source.h"
#include "program/json.h"

struct crc {
	struct cli *cli;
	const struct status_page *page;
	int is_reset;
	int is_json;
	struct json js;
};

static void show_text(const struct crc *crc, uint16_t pos, const struct admin_diagnosis *found)
{
	printf("%3u %s\n"
	       "    port  state  invalid frames  receive errors  forwarded  lost links\n",
	       pos, source_slave(crc->page, pos).name);
	for (unsigned i = 0; i < ADMIN_PORTS; i++) {
		const struct admin_port *port = &found->port[i];

		printf("    %-4u  %-5s  %14u  %14u  %9u  %10u\n", i,
		       port->is_communicating ? "open"
		       : port->is_link        ? "link"
					      : "-",
		       port->invalid_frames, port->rx_errors, port->forwarded_errors,
		       port->lost_links);
	}
	if (found->has_processing_errors) {
		printf("    processing errors %u, PDI errors %u\n", found->processing_errors,
		       found->pdi_errors);
	}
	if (found->has_expirations) {
		printf("    watchdog expired: process data %u, PDI %u\n", found->expirations_pd,
		       found->expirations_pdi);
	}
}

static void count_or_null(struct json *js, const char *key, int is_there, unsigned count)
{
	if (is_there) {
		json_u64(js, key, count);
	} else {
		json_null(js, key);
	}
}

static void show_json(struct crc *crc, uint16_t pos, const struct admin_diagnosis *found)
{
	struct json *js = &crc->js;

	json_object_begin(js, NULL);
	json_u64(js, "position", pos);
	json_text(js, "name", source_slave(crc->page, pos).name);
	json_array_begin(js, "port");
	for (unsigned i = 0; i < ADMIN_PORTS; i++) {
		const struct admin_port *port = &found->port[i];

		json_object_begin(js, NULL);
		json_truth(js, "link", port->is_link);
		json_truth(js, "open", port->is_communicating);
		json_u64(js, "invalid_frames", port->invalid_frames);
		json_u64(js, "receive_errors", port->rx_errors);
		json_u64(js, "forwarded_errors", port->forwarded_errors);
		json_u64(js, "lost_links", port->lost_links);
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

/* Shown as they were before a reset. */
static enum exit_code run_one(struct crc *crc, uint16_t pos)
{
	struct admin_request rq = { .verb = ADMIN_DIAGNOSIS, .slave_pos = pos };
	struct admin_diagnosis found;
	struct admin_reply reply;
	enum exit_code result = admin_do(crc->cli, &rq, &reply);

	if (result != EXIT_CODE_OK) {
		return result;
	}
	memcpy(&found, reply.data, sizeof(found));
	if (crc->is_json) {
		show_json(crc, pos, &found);
	} else {
		show_text(crc, pos, &found);
	}
	if (crc->is_reset) {
		rq.verb = ADMIN_ERRORS_RESET;
		result = admin_do(crc->cli, &rq, &reply);
	}
	return result;
}

/* All, or those named; a slave that does not answer does not keep the others from it. */
static enum exit_code run_all(struct crc *crc, const struct args *args)
{
	int is_all = args->operand_count == 0;
	uint32_t count = is_all ? source_slave_count(crc->page) : (uint32_t)args->operand_count;
	enum exit_code first = EXIT_CODE_OK;

	for (uint32_t i = 0; i < count; i++) {
		uint16_t pos = (uint16_t)i;
		enum exit_code result =
			is_all ? EXIT_CODE_OK
			       : source_find_slave(crc->cli, crc->page, args->operands[i], &pos);

		if (result == EXIT_CODE_OK) {
			result = run_one(crc, pos);
		}
		first = first == EXIT_CODE_OK ? result : first;
		if (result == EXIT_CODE_NO_DAEMON || result == EXIT_CODE_PERMISSION) {
			break; /* the same for all */
		}
	}
	return first;
}

enum exit_code verb_crc(struct cli *cli, int argc, char **argv)
{
	struct crc crc = { .cli = cli };
	const struct args_option options[] = {
		{ "reset", 0, args_flag, &crc.is_reset, NULL,
		  "set them to zero after they were read" },
		{ "json", 0, args_flag, &crc.is_json, NULL, "a JSON array" },
	};
	struct args args = { .options = options, .option_count = 2, .operands_max = 4096 };
	enum exit_code result;

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	result = source_status(cli, &crc.page);
	if (result != EXIT_CODE_OK) {
		return result;
	}
	json_init(&crc.js, stdout);
	if (crc.is_json) {
		json_array_begin(&crc.js, NULL);
	}
	result = run_all(&crc, &args);
	if (crc.is_json) {
		json_array_end(&crc.js);
		json_end_line(&crc.js);
	}
	source_status_close(crc.page);
	return result;
}
