/* SPDX-License-Identifier: MIT */
/*
 * ecdaq domains: the datagrams of the cyclic frames with their working counters, and of each slave
 * the SyncManagers and FMMUs, as its registers have them now, and what it adds to each counter.
 */
#include <inttypes.h>
#include <stdio.h>

#include "base/args.h"
#include "cli/cli.h"
#include "cli/each_slave.h"
#include "cli/mapping.h"
#include "cli/source.h"
#include "program/json.h"
#include "wire/datagram.h"
#include "wire/fmmu.h"

struct domains {
	struct cli *cli;
	const struct status_page *page;
	struct datagrams list;
	int is_json;
	struct json js;
};

static unsigned adds_to(const struct mapping *mapping, const struct admin_datagram *dg)
{
	return fmmu_wkc(dg->command, dg->address, dg->bytes, mapping->fmmu, mapping->fmmu_count);
}

/* --- text --- */

static const char *wkc_to_str(uint16_t wkc, char buf[8])
{
	if (wkc == ADMIN_WKC_UNKNOWN) {
		return "-";
	}
	snprintf(buf, 8, "%u", wkc);
	return buf;
}

static void show_datagrams(const struct domains *d)
{
	if (d->list.count == 0) {
		printf("no cyclic frames: %s\n", d->list.why);
		return;
	}
	printf("datagram frame  command  address        bytes  expected  measured\n");
	for (size_t i = 0; i < d->list.count; i++) {
		const struct admin_datagram *dg = &d->list.datagram[i];
		char address[16];
		char expected[8];
		char measured[8];

		if (datagram_is_logical(dg)) {
			snprintf(address, sizeof(address), "0x%08" PRIx32, dg->address);
		} else {
			snprintf(address, sizeof(address), "0x%04x:0x%04x",
				 (unsigned)(dg->address & 0xffff), (unsigned)(dg->address >> 16));
		}
		printf("%8zu %5u  %-7s  %-13s  %5u  %8s  %8s\n", i, dg->frame,
		       ecat_cmd_to_str(dg->command), address, dg->bytes,
		       wkc_to_str(dg->wkc_expected, expected), wkc_to_str(dg->wkc, measured));
	}
}

static void show_fmmu(unsigned number, const struct fmmu *f)
{
	uint32_t last = f->logical + (f->bytes > 0 ? f->bytes - 1u : 0);

	printf("    FMMU %-2u  %-7s  0x%08" PRIx32 ".%u to 0x%08" PRIx32 ".%u at 0x%04x.%u\n",
	       number,
	       f->is_read && f->is_write ? "both"
	       : f->is_read              ? "inputs"
	       : f->is_write             ? "outputs"
					 : "none",
	       f->logical, f->start_bit, last, f->stop_bit, f->physical, f->physical_bit);
}

static void show_text(const struct domains *d, uint16_t pos, const struct mapping *mapping)
{
	printf("%3u %s\n", pos, source_slave(d->page, pos).name);
	for (unsigned i = 0; i < mapping->sm_count; i++) {
		const struct sync_manager *sm = &mapping->sm[i];

		if (sm->bytes > 0) {
			printf("    SM %-2u    %-7s  %u bytes at 0x%04x%s%s%s\n", i,
			       sm->is_write ? "outputs" : "inputs", sm->bytes, sm->start,
			       sm->is_mailbox ? ", mailbox" : "",
			       sm->has_watchdog ? ", watchdog" : "",
			       sm->is_active ? "" : ", switched off");
		}
	}
	for (unsigned i = 0; i < mapping->fmmu_count; i++) {
		if (mapping->fmmu[i].is_active) {
			show_fmmu(i, &mapping->fmmu[i]);
		}
	}
	for (size_t i = 0; i < d->list.count; i++) {
		unsigned adds = adds_to(mapping, &d->list.datagram[i]);

		if (adds > 0) {
			printf("    adds %u to datagram %zu\n", adds, i);
		}
	}
}

/* --- JSON --- */

static void put_wkc(struct json *js, const char *key, uint16_t wkc)
{
	if (wkc == ADMIN_WKC_UNKNOWN) {
		json_null(js, key);
	} else {
		json_u64(js, key, wkc);
	}
}

static void put_datagrams(struct domains *d)
{
	struct json *js = &d->js;

	json_array_begin(js, "datagram");
	for (size_t i = 0; i < d->list.count; i++) {
		const struct admin_datagram *dg = &d->list.datagram[i];

		json_object_begin(js, NULL);
		json_u64(js, "frame", dg->frame);
		json_text(js, "command", ecat_cmd_to_str(dg->command));
		if (datagram_is_logical(dg)) {
			json_u64(js, "logical", dg->address);
		} else {
			json_u64(js, "station", dg->address & 0xffff);
			json_u64(js, "register", dg->address >> 16);
		}
		json_u64(js, "length", dg->bytes);
		put_wkc(js, "expected", dg->wkc_expected);
		put_wkc(js, "measured", dg->wkc);
		json_object_end(js);
	}
	json_array_end(js);
	if (d->list.count == 0) {
		json_text(js, "why", d->list.why);
	}
}

static void put_fmmus(struct json *js, const struct mapping *mapping)
{
	json_array_begin(js, "fmmu");
	for (unsigned i = 0; i < mapping->fmmu_count; i++) {
		const struct fmmu *f = &mapping->fmmu[i];

		if (!f->is_active) {
			continue;
		}
		json_object_begin(js, NULL);
		json_u64(js, "number", i);
		json_u64(js, "logical", f->logical);
		json_u64(js, "length", f->bytes);
		json_u64(js, "start_bit", f->start_bit);
		json_u64(js, "stop_bit", f->stop_bit);
		json_u64(js, "physical", f->physical);
		json_u64(js, "physical_bit", f->physical_bit);
		json_truth(js, "read", f->is_read);
		json_truth(js, "write", f->is_write);
		json_object_end(js);
	}
	json_array_end(js);
}

static void put_sync_managers(struct json *js, const struct mapping *mapping)
{
	json_array_begin(js, "sync_manager");
	for (unsigned i = 0; i < mapping->sm_count; i++) {
		const struct sync_manager *sm = &mapping->sm[i];

		if (sm->bytes == 0) {
			continue;
		}
		json_object_begin(js, NULL);
		json_u64(js, "number", i);
		json_u64(js, "start", sm->start);
		json_u64(js, "length", sm->bytes);
		json_text(js, "direction", sm->is_write ? "output" : "input");
		json_truth(js, "mailbox", sm->is_mailbox);
		json_truth(js, "watchdog", sm->has_watchdog);
		json_truth(js, "active", sm->is_active);
		json_object_end(js);
	}
	json_array_end(js);
}

static void put_slave(struct domains *d, uint16_t pos, const struct mapping *mapping)
{
	struct json *js = &d->js;

	json_object_begin(js, NULL);
	json_u64(js, "position", pos);
	json_text(js, "name", source_slave(d->page, pos).name);
	put_sync_managers(js, mapping);
	put_fmmus(js, mapping);
	json_array_begin(js, "wkc");
	for (size_t i = 0; i < d->list.count; i++) {
		if (adds_to(mapping, &d->list.datagram[i]) > 0) {
			json_object_begin(js, NULL);
			json_u64(js, "datagram", i);
			json_u64(js, "adds", adds_to(mapping, &d->list.datagram[i]));
			json_object_end(js);
		}
	}
	json_array_end(js);
	json_object_end(js);
}

/* --- all --- */

static enum exit_code run_one(void *ctx, uint16_t pos)
{
	struct domains *d = ctx;
	struct mapping mapping;
	enum exit_code result = mapping_read(d->cli, pos, &mapping);

	if (result == EXIT_CODE_OK && d->is_json) {
		put_slave(d, pos, &mapping);
	} else if (result == EXIT_CODE_OK) {
		show_text(d, pos, &mapping);
	}
	return result;
}

static enum exit_code run(struct domains *d, const struct args *args)
{
	enum exit_code result = datagrams_read(d->cli, &d->list);

	if (result != EXIT_CODE_OK) {
		return result;
	}
	if (!d->is_json) {
		show_datagrams(d);
		return each_slave(d->cli, d->page, args->operands, args->operand_count, run_one, d);
	}
	json_object_begin(&d->js, NULL);
	put_datagrams(d);
	json_array_begin(&d->js, "slave");
	result = each_slave(d->cli, d->page, args->operands, args->operand_count, run_one, d);
	json_array_end(&d->js);
	json_object_end(&d->js);
	json_end_line(&d->js);
	return result;
}

enum exit_code verb_domains(struct cli *cli, int argc, char **argv)
{
	struct domains d = { .cli = cli };
	const struct args_option options[] = {
		{ "json", 0, args_flag, &d.is_json, NULL, "a JSON object" },
	};
	struct args args = { .options = options, .option_count = 1, .operands_max = 4096 };
	enum exit_code result;

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	result = source_status(cli, &d.page);
	if (result != EXIT_CODE_OK) {
		return result;
	}
	json_init(&d.js, stdout);
	result = run(&d, &args);
	datagrams_done(&d.list);
	source_status_close(d.page);
	return result;
}
