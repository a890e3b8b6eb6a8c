/* SPDX-License-Identifier: MIT */
/* ecdaq slaves */
#include <inttypes.h>
#include <stdio.h>

#include "base/args.h"
#include "cli/cli.h"
#include "cli/each_slave.h"
#include "cli/report.h"
#include "cli/source.h"
#include "cli/text.h"
#include "wire/al.h"

#define GET(field) atomic_load_explicit(&(field), memory_order_relaxed)

struct slaves {
	const struct status_page *page;
	int is_json;
	int is_verbose;
	struct json js;
};

static char mark_of(const struct status_page *page, uint32_t index)
{
	uint32_t al_state = GET(page->slave[index].al_state);

	if (al_state == 0 || GET(page->slave[index].is_lost)) {
		return '?';
	}
	return (al_state & AL_ERROR) != 0 ? 'E' : '+';
}

static void show(const struct status_page *page, uint32_t index)
{
	struct slave_info info = source_slave(page, index);
	char device[sizeof(info.device)];
	char state[24];

	al_status_format(GET(page->slave[index].al_state), state, sizeof(state));
	printf("%2u  %u:%u  %-13s %c  %-16s %s\n", index, info.alias, index,
	       GET(page->slave[index].is_lost) ? "LOST" : state, mark_of(page, index), info.name,
	       text_plain(info.device, device, sizeof(device)));
}

static void show_ports(const char *name, const _Atomic uint32_t *counts)
{
	printf("    %-16s", name);
	for (int port = 0; port < 4; port++) {
		printf(" %u", GET(counts[port]));
	}
	putchar('\n');
}

static void show_more(const struct status_page *page, uint32_t index)
{
	const struct slave_status *slave = &page->slave[index];
	struct slave_info info = source_slave(page, index);
	uint32_t code = GET(slave->al_status_code);
	char group[SOURCE_GROUP_BYTES];
	char buf[TEXT_BYTES];

	if (source_group(page, index, group)[0] != '\0') {
		printf("    %-16s %s\n", "group", group);
	}
	printf("    %-16s 0x%08x\n", "vendor", info.vendor);
	printf("    %-16s 0x%08x\n", "product", info.product);
	printf("    %-16s 0x%08x\n", "revision", info.revision);
	printf("    %-16s 0x%08x\n", "serial", info.serial);
	printf("    %-16s 0x%04x\n", "station address", info.station_addr);
	printf("    %-16s 0x%04x %s\n", "AL status code", code,
	       al_status_code_to_str((uint16_t)code));
	printf("    %-16s %u in, %u out\n", "bits", info.input_bits, info.output_bits);
	if (info.has_dc) {
		printf("    %-16s %s%s\n", "DC delay", text_ns(info.dc_delay_ns, buf),
		       info.is_dc_reference ? " (reference clock)" : "");
		printf("    %-16s %s\n", "DC difference", text_ns(GET(slave->dc_diff_ns), buf));
		printf("    %-16s %s\n", "SYNC0 cycle",
		       info.sync0_cycle_ns == 0 ? "none" : text_ns(info.sync0_cycle_ns, buf));
		printf("    %-16s %s\n", "SYNC0 shift", text_ns(info.sync0_shift_ns, buf));
	} else {
		printf("    %-16s none\n", "DC");
	}
	printf("    %-16s outputs %u, inputs %u\n", "sync type", GET(slave->output_sync_type),
	       GET(slave->input_sync_type));
	if (GET(slave->minimum_cycle_ns) > 0) {
		printf("    %-16s %s\n", "minimum cycle",
		       text_ns((int64_t)GET(slave->minimum_cycle_ns), buf));
	}
	printf("    %-16s %" PRIu64 " good, %" PRIu64 " bad\n", "samples",
	       GET(page->cycle.slave_good[index]), GET(page->cycle.slave_bad[index]));
	show_ports("receive errors", slave->rx_errors);
	show_ports("forwarded errors", slave->forwarded_errors);
	show_ports("lost links", slave->lost_links);
	printf("    %-16s %u processing, %u PDI\n", "other errors", GET(slave->processing_errors),
	       GET(slave->pdi_errors));
	if (GET(slave->are_errors_short)) {
		printf("    %-16s a counter reached 255: there were more errors than counted\n",
		       "");
	}
}

static enum exit_code run_one(void *ctx, uint16_t pos)
{
	struct slaves *cmd = ctx;

	if (cmd->is_json) {
		report_slave_json(cmd->page, pos, &cmd->js);
		return EXIT_CODE_OK;
	}
	show(cmd->page, pos);
	if (cmd->is_verbose) {
		show_more(cmd->page, pos);
	}
	return EXIT_CODE_OK;
}

enum exit_code verb_slaves(struct cli *cli, int argc, char **argv)
{
	struct slaves cmd = { .page = NULL };
	const struct args_option options[] = {
		{ "json", 0, args_flag, &cmd.is_json, NULL, "a JSON array" },
		{ "verbose", 'v', args_flag, &cmd.is_verbose, NULL,
		  "identity, clock and error counters" },
	};
	struct args args = { .options = options, .option_count = 2, .operands_max = 4096 };
	enum exit_code result;

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	result = source_status(cli, &cmd.page);
	if (result != EXIT_CODE_OK) {
		return result;
	}
	result = each_slave_listed(cli, cmd.page, &args, cmd.is_json ? &cmd.js : NULL, run_one,
				   &cmd);
	source_status_close(cmd.page);
	return result;
}
