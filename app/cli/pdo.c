/* SPDX-License-Identifier: MIT */
/* ecdaq pdo: SyncManagers, PDOs and their entries. */
#include <stdio.h>

#include "base/args.h"
#include "cli/cli.h"
#include "cli/coe_type.h"
#include "cli/each_slave.h"
#include "cli/fit.h"
#include "cli/pdo_info.h"
#include "cli/screen.h"
#include "cli/source.h"
#include "program/json.h"

/* Columns before what continues a line. */
enum { INDENT = 12 };

struct pdo_command {
	struct cli *cli;
	const struct status_page *page;
	int is_json;
	struct json js;
};

static const char *sm_type_to_str(unsigned type)
{
	static const char *const texts[] = { "unused", "mailbox out", "mailbox in", "outputs",
					     "inputs" };

	return type < sizeof(texts) / sizeof(texts[0]) ? texts[type] : "?";
}

/* Of the PDOs that are assigned to it. */
static uint32_t bits_of_sm(const struct pdo_info *info, unsigned sm)
{
	uint32_t bits = 0;

	for (size_t i = 0; i < info->pdo_count; i++) {
		if (info->pdo[i].is_assigned && info->pdo[i].sm == (int)sm) {
			bits += info->pdo[i].bits;
		}
	}
	return bits;
}

/* Bytes in its memory: of a mailbox as the SII says, of process data what is assigned. */
static unsigned bytes_of_sm(const struct pdo_info *info, unsigned sm)
{
	unsigned type = pdo_info_sm_type(info, sm);

	return type == 3 || type == 4 ? (bits_of_sm(info, sm) + 7) / 8 : info->sii.sm[sm].len;
}

/* --- text --- */

static void put_pdo(FILE *out, const struct pdo_info *info, const struct pdo_info_pdo *pdo)
{
	char type[TEXT_BYTES];
	char name[SII_NAME_BYTES];

	fprintf(out, "      %s 0x%04x  %u bit%s", pdo->is_tx ? "TxPDO" : "RxPDO", pdo->index,
		pdo->bits, pdo->bits == 1 ? "" : "s");
	if (!pdo->is_assigned && pdo->sm != PDO_INFO_NO_SM) {
		fprintf(out, ", SM%d by default", pdo->sm);
	}
	if (pdo->times > 1) {
		fprintf(out, ", ASSIGNED %u TIMES", pdo->times);
	}
	fprintf(out, "%s%s\n", pdo->name[0] == '\0' ? "" : "  ",
		text_plain(pdo->name, name, sizeof(name)));
	for (size_t i = 0; i < pdo->count; i++) {
		const struct pdo_info_entry *e = &info->entry[pdo->first + i];

		if (e->index == 0) {
			fprintf(out, "        -          %3u  padding\n", e->bits);
			continue;
		}
		fprintf(out, "        0x%04x:%02x  %3u  %-6s %s\n", e->index, e->subindex, e->bits,
			e->type == 0 ? "?" : coe_type_to_str(e->type, type),
			text_plain(e->name, name, sizeof(name)));
	}
}

static void put_slave(FILE *out, const struct pdo_command *cmd, uint16_t pos,
		      const struct pdo_info *info)
{
	struct slave_info slave = source_slave(cmd->page, pos);
	char text[256];
	int is_open = 0;

	fprintf(out, "%3u %s  %s  assigned by %s\n", pos, slave.name,
		text_plain(slave.device, text, sizeof(text)), info->is_by_coe ? "CoE" : "SII");
	if (info->why[0] != '\0') {
		fprintf(out, "    not by CoE: %s\n", text_plain(info->why, text, sizeof(text)));
	}
	if (info->damage[0] != '\0') {
		fprintf(out, "    SII: %s\n", text_plain(info->damage, text, sizeof(text)));
	}
	for (unsigned sm = 0; sm < pdo_info_sm_count(info); sm++) {
		if (sm >= info->sii.sm_count && bits_of_sm(info, sm) == 0) {
			continue;
		}
		fprintf(out, "    SM%u %s", sm, sm_type_to_str(pdo_info_sm_type(info, sm)));
		if (sm < info->sii.sm_count) {
			fprintf(out, ", start 0x%04x", info->sii.sm[sm].start);
		}
		fprintf(out, ", %u byte%s\n", bytes_of_sm(info, sm),
			bytes_of_sm(info, sm) == 1 ? "" : "s");
		for (size_t i = 0; i < info->pdo_count; i++) {
			if (info->pdo[i].is_assigned && info->pdo[i].sm == (int)sm) {
				put_pdo(out, info, &info->pdo[i]);
			}
		}
	}
	for (size_t i = 0; i < info->pdo_count; i++) {
		if (!info->pdo[i].is_assigned) {
			if (!is_open) {
				fputs("    not assigned\n", out);
			}
			is_open = 1;
			put_pdo(out, info, &info->pdo[i]);
		}
	}
}

static void show_text(const struct pdo_command *cmd, uint16_t pos, const struct pdo_info *info)
{
	struct fit fit;

	put_slave(fit_begin(&fit, screen_columns(), stdout), cmd, pos, info);
	fit_end(&fit, INDENT);
}

/* --- JSON --- */

static void pdo_json(struct json *js, const struct pdo_info *info, const struct pdo_info_pdo *pdo)
{
	json_object_begin(js, NULL);
	json_u64(js, "index", pdo->index);
	json_text(js, "name", pdo->name);
	json_text(js, "direction", pdo->is_tx ? "input" : "output");
	json_truth(js, "assigned", pdo->is_assigned);
	json_u64(js, "times", pdo->is_assigned && pdo->times == 0 ? 1 : pdo->times);
	if (pdo->sm == PDO_INFO_NO_SM) {
		json_null(js, "sm");
	} else {
		json_i64(js, "sm", pdo->sm);
	}
	json_u64(js, "bits", pdo->bits);
	json_array_begin(js, "entry");
	for (size_t i = 0; i < pdo->count; i++) {
		const struct pdo_info_entry *e = &info->entry[pdo->first + i];

		coe_entry_json(js, &(struct coe_entry){ .index = e->index,
							.subindex = e->subindex,
							.bits = e->bits,
							.type = e->type,
							.name = e->name });
	}
	json_array_end(js);
	json_object_end(js);
}

static void show_json(struct pdo_command *cmd, uint16_t pos, const struct pdo_info *info)
{
	struct json *js = &cmd->js;

	json_object_begin(js, NULL);
	json_u64(js, "position", pos);
	json_text(js, "name", source_slave(cmd->page, pos).name);
	json_text(js, "source", info->is_by_coe ? "coe" : "sii");
	if (info->why[0] != '\0') {
		json_text(js, "not_by_coe", info->why);
	} else {
		json_null(js, "not_by_coe");
	}
	if (info->damage[0] != '\0') {
		json_text(js, "sii_damage", info->damage);
	} else {
		json_null(js, "sii_damage");
	}
	json_array_begin(js, "sm");
	for (unsigned sm = 0; sm < pdo_info_sm_count(info); sm++) {
		if (sm >= info->sii.sm_count && bits_of_sm(info, sm) == 0) {
			continue;
		}
		json_object_begin(js, NULL);
		json_u64(js, "number", sm);
		json_text(js, "type", sm_type_to_str(pdo_info_sm_type(info, sm)));
		if (sm < info->sii.sm_count) {
			json_u64(js, "start", info->sii.sm[sm].start);
			json_u64(js, "control", info->sii.sm[sm].control);
			json_u64(js, "enable", info->sii.sm[sm].enable);
		} else {
			json_null(js, "start");
			json_null(js, "control");
			json_null(js, "enable");
		}
		json_u64(js, "bytes", bytes_of_sm(info, sm));
		json_object_end(js);
	}
	json_array_end(js);
	json_array_begin(js, "pdo");
	for (size_t i = 0; i < info->pdo_count; i++) {
		pdo_json(js, info, &info->pdo[i]);
	}
	json_array_end(js);
	json_object_end(js);
}

/* --- all --- */

static enum exit_code run_one(void *ctx, uint16_t pos)
{
	struct pdo_command *cmd = ctx;
	struct pdo_info *info;
	enum exit_code result = pdo_info_read(cmd->cli, pos, &info);

	if (result != EXIT_CODE_OK) {
		return result;
	}
	if (cmd->is_json) {
		show_json(cmd, pos, info);
	} else {
		show_text(cmd, pos, info);
	}
	pdo_info_free(info);
	return EXIT_CODE_OK;
}

enum exit_code verb_pdo(struct cli *cli, int argc, char **argv)
{
	struct pdo_command cmd = { .cli = cli };
	const struct args_option options[] = {
		{ "json", 0, args_flag, &cmd.is_json, NULL, "a JSON array" },
	};
	struct args args = { .options = options, .option_count = 1, .operands_max = 4096 };
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
