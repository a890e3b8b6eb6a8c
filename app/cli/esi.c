/* SPDX-License-Identifier: MIT */
/* ecdaq esi: what ESI files describe, and whether they can be read. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/args.h"
#include "cli/cli.h"
#include "cli/coe_type.h"
#include "esi/esi.h"
#include "esi/library.h"
#include "program/json.h"

struct esi_run {
	struct cli *cli;
	const char *file; /* that is being read */
	int is_json;
	int is_verbose;
	struct json js;
	enum exit_code result;
};

/* --- text --- */

static void show_pdo(const struct esi_device *d, const struct esi_pdo *pdo)
{
	char type[TEXT_BYTES];
	char name[ESI_NAME_BYTES];

	printf("    %s 0x%04x  %u bits", pdo->is_tx ? "TxPDO" : "RxPDO", pdo->index, pdo->bits);
	if (pdo->sm != ESI_NO_SM) {
		printf(", SM%d", pdo->sm);
	}
	printf("%s%s  %s\n", pdo->is_fixed ? ", fixed" : "", pdo->is_mandatory ? ", mandatory" : "",
	       text_plain(pdo->name, name, sizeof(name)));
	for (size_t i = 0; i < pdo->count; i++) {
		const struct esi_entry *e = &d->entry[pdo->first + i];

		if (e->index == 0) {
			printf("      -          %3u  padding\n", e->bits);
			continue;
		}
		printf("      0x%04x:%02x  %3u  %-6s %s\n", e->index, e->subindex, e->bits,
		       e->type == 0 ? "?" : coe_type_to_str(e->type, type),
		       text_plain(e->name, name, sizeof(name)));
	}
	if (pdo->exclude_count > 0) {
		fputs("      not with", stdout);
		for (size_t i = 0; i < pdo->exclude_count; i++) {
			printf(" 0x%04x", pdo->exclude[i]);
		}
		putchar('\n');
	}
}

static void show_details(const struct esi_device *d)
{
	char name[ESI_NAME_BYTES];
	char text[ESI_NAME_BYTES];

	for (size_t i = 0; i < d->pdo_count; i++) {
		show_pdo(d, &d->pdo[i]);
	}
	for (size_t i = 0; i < d->dc_count; i++) {
		printf("    DC mode 0x%04x  %s  %s\n", d->dc[i].assign_activate,
		       text_plain(d->dc[i].name, name, sizeof(name)),
		       text_plain(d->dc[i].text, text, sizeof(text)));
	}
	for (size_t i = 0; i < d->object_count; i++) {
		const struct esi_object *o = &d->object[i];

		if (o->unit[0] != '\0') {
			printf("    unit 0x%04x:%02x  %s  %s\n", o->index, o->subindex,
			       text_plain(o->unit, text, sizeof(text)),
			       text_plain(o->name, name, sizeof(name)));
		}
	}
	for (size_t i = 0; i < d->command_count; i++) {
		const struct esi_command *c = &d->command[i];

		printf("    start-up 0x%04x:%02x  %u byte%s  %s\n", c->index, c->subindex, c->len,
		       c->len == 1 ? "" : "s", text_plain(c->comment, text, sizeof(text)));
	}
}

static void show_text(const struct esi_run *run, const struct esi_device *d)
{
	char type[ESI_NAME_BYTES];
	char name[ESI_NAME_BYTES];

	printf("%s 0x%08x 0x%08x", d->id.kind == ESI_MODULE ? "module" : "device", d->id.vendor,
	       d->id.product);
	if (d->id.kind == ESI_DEVICE) {
		printf(" 0x%08x", d->id.revision);
	}
	printf("  %s  %s\n", text_plain(d->type, type, sizeof(type)),
	       text_plain(d->name, name, sizeof(name)));
	if (run->is_verbose) {
		show_details(d);
	}
}

/* --- JSON --- */

static void pdo_json(struct json *js, const struct esi_device *d, const struct esi_pdo *pdo)
{
	json_object_begin(js, NULL);
	json_u64(js, "index", pdo->index);
	json_text(js, "name", pdo->name);
	json_text(js, "direction", pdo->is_tx ? "input" : "output");
	if (pdo->sm == ESI_NO_SM) {
		json_null(js, "sm");
	} else {
		json_i64(js, "sm", pdo->sm);
	}
	json_truth(js, "fixed", pdo->is_fixed);
	json_truth(js, "mandatory", pdo->is_mandatory);
	json_u64(js, "bits", pdo->bits);
	json_array_begin(js, "exclude");
	for (size_t i = 0; i < pdo->exclude_count; i++) {
		json_u64(js, NULL, pdo->exclude[i]);
	}
	json_array_end(js);
	json_array_begin(js, "entry");
	for (size_t i = 0; i < pdo->count; i++) {
		const struct esi_entry *e = &d->entry[pdo->first + i];

		coe_entry_json(js, &(struct coe_entry){ .index = e->index,
							.subindex = e->subindex,
							.bits = e->bits,
							.type = e->type,
							.name = e->name });
	}
	json_array_end(js);
	json_object_end(js);
}

static void units_json(struct json *js, const struct esi_device *d)
{
	json_array_begin(js, "unit");
	for (size_t i = 0; i < d->object_count; i++) {
		const struct esi_object *o = &d->object[i];

		if (o->unit[0] != '\0') {
			json_object_begin(js, NULL);
			json_u64(js, "index", o->index);
			json_u64(js, "subindex", o->subindex);
			json_text(js, "name", o->name);
			json_text(js, "unit", o->unit);
			json_object_end(js);
		}
	}
	json_array_end(js);
}

static void commands_json(struct json *js, const struct esi_device *d)
{
	char data[2 * ESI_LIMIT_COMMAND_BYTES + 1];

	json_array_begin(js, "startup");
	for (size_t i = 0; i < d->command_count; i++) {
		const struct esi_command *c = &d->command[i];

		data[0] = '\0';
		for (size_t k = 0; k < c->len; k++) {
			snprintf(data + 2 * k, 3, "%02x", c->data[k]);
		}
		json_object_begin(js, NULL);
		json_u64(js, "index", c->index);
		json_u64(js, "subindex", c->subindex);
		json_truth(js, "complete_access", c->is_complete_access);
		json_text(js, "data", data);
		json_text(js, "comment", c->comment);
		json_object_end(js);
	}
	json_array_end(js);
}

static void show_json(struct esi_run *run, const struct esi_device *d)
{
	struct json *js = &run->js;

	json_object_begin(js, NULL);
	json_text(js, "file", run->file);
	json_i64(js, "line", d->line);
	json_text(js, "kind", d->id.kind == ESI_MODULE ? "module" : "device");
	json_u64(js, "vendor", d->id.vendor);
	json_u64(js, "product", d->id.product);
	json_u64(js, "revision", d->id.revision);
	json_text(js, "vendor_name", d->vendor_name);
	json_text(js, "type", d->type);
	json_text(js, "name", d->name);
	json_text(js, "group", d->group_name);
	json_array_begin(js, "pdo");
	for (size_t i = 0; i < d->pdo_count; i++) {
		pdo_json(js, d, &d->pdo[i]);
	}
	json_array_end(js);
	json_array_begin(js, "dc_mode");
	for (size_t i = 0; i < d->dc_count; i++) {
		json_object_begin(js, NULL);
		json_text(js, "name", d->dc[i].name);
		json_u64(js, "assign_activate", d->dc[i].assign_activate);
		json_object_end(js);
	}
	json_array_end(js);
	units_json(js, d);
	commands_json(js, d);
	json_object_end(js);
}

/* --- all --- */

static int take(void *ctx, struct esi_device *device)
{
	struct esi_run *run = ctx;

	if (run->is_json) {
		show_json(run, device);
	} else {
		show_text(run, device);
	}
	esi_device_free(device);
	return 0;
}

/* A bad file keeps no other one from being read. */
static int read_file(void *ctx, const char *path)
{
	struct esi_run *run = ctx;
	const struct esi_visitor visitor = { .device = take, .ctx = run };
	char error[512];

	run->file = path;
	if (esi_read_file(path, &visitor, error, sizeof(error)) < 0) {
		run->result = cli_fail(run->cli, EXIT_CODE_FAILED, "%s", error);
	}
	return 0;
}

static void read_operand(struct esi_run *run, const char *path)
{
	struct stat st;
	int r;

	if (stat(path, &st) < 0 || !S_ISDIR(st.st_mode)) {
		read_file(run, path);
		return;
	}
	r = esi_library_each_file(path, read_file, run);
	if (r < 0) {
		run->result = cli_fail(run->cli, EXIT_CODE_FAILED, "%s: %s", path, strerror(-r));
	}
}

enum exit_code verb_esi(struct cli *cli, int argc, char **argv)
{
	struct esi_run run = { .cli = cli, .result = EXIT_CODE_OK };
	const struct args_option options[] = {
		{ "verbose", 'v', args_flag, &run.is_verbose, NULL,
		  "with PDOs, DC modes, units and start-up commands" },
		{ "json", 0, args_flag, &run.is_json, NULL, "a JSON array" },
	};
	struct args args = {
		.options = options, .option_count = 2, .operands_min = 1, .operands_max = 4096
	};
	enum exit_code result;

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	json_init(&run.js, stdout);
	if (run.is_json) {
		json_array_begin(&run.js, NULL);
	}
	for (int i = 0; i < args.operand_count; i++) {
		read_operand(&run, args.operands[i]);
	}
	if (run.is_json) {
		json_array_end(&run.js);
		json_end_line(&run.js);
	}
	return run.result;
}
