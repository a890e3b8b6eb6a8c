/* SPDX-License-Identifier: MIT */
/* ecdaq scan: what is on the bus, as a configuration. */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/args.h"
#include "cli/cli.h"
#include "cli/coe_type.h"
#include "cli/each_slave.h"
#include "cli/file.h"
#include "cli/fit.h"
#include "cli/pdo_info.h"
#include "cli/screen.h"
#include "cli/source.h"
#include "image/image.h"
#include "program/json.h"
#include "program/progress.h"

#define GET(field) atomic_load_explicit(&(field), memory_order_relaxed)

enum { ERROR_BYTES = 512 };

struct scan_command {
	struct cli *cli;
	const struct status_page *page;
	struct samples samples; /* the channel table of this session */
	int has_channels;
	const char *path; /* NULL: standard output */
	int is_forced;
	int is_json;
	FILE *out;
};

/* --- comments: text of slaves, made printable --- */

static void put_entry(FILE *out, const struct pdo_info_entry *entry)
{
	char type[TEXT_BYTES];
	char name[SII_NAME_BYTES];

	if (entry->index == 0) {
		fprintf(out, "    #     -          %3u padding\n", entry->bits);
		return;
	}
	fprintf(out, "    #     0x%04x:%02x  %3u %-6s %s\n", entry->index, entry->subindex,
		entry->bits, entry->type == 0 ? "?" : coe_type_to_str(entry->type, type),
		text_plain(entry->name, name, sizeof(name)));
}

static void put_pdos(FILE *out, const struct pdo_info *info)
{
	char text[256];

	if (info->why[0] != '\0') {
		fprintf(out, "    # PDOs by SII, not by CoE: %s\n",
			text_plain(info->why, text, sizeof(text)));
	} else if (info->pdo_count > 0) {
		fprintf(out, "    # PDOs by %s:\n", info->is_by_coe ? "CoE" : "SII");
	}
	for (size_t i = 0; i < info->pdo_count; i++) {
		const struct pdo_info_pdo *pdo = &info->pdo[i];

		fprintf(out, "    #   %s 0x%04x ", pdo->is_tx ? "TxPDO" : "RxPDO", pdo->index);
		if (pdo->is_assigned) {
			fprintf(out, "SM%d", pdo->sm);
		} else {
			fputs("not assigned", out);
		}
		fprintf(out, "%s%s\n", pdo->name[0] == '\0' ? "" : "  ",
			text_plain(pdo->name, text, sizeof(text)));
		for (size_t e = 0; e < pdo->count && pdo->is_assigned; e++) {
			put_entry(out, &info->entry[pdo->first + e]);
		}
	}
}

/* An object of more than 64 bits is several channels, which are selected by name. */
static int is_only_one(const struct samples *samples, const struct channel *ch)
{
	unsigned count = 0;

	for (uint32_t i = 0; i < samples->meta->channel_count; i++) {
		const struct channel *other = &samples->channels[i];

		count += other->slave_pos == ch->slave_pos && other->index == ch->index &&
			 other->subindex == ch->subindex;
	}
	return count == 1;
}

/* An item of slaves[].channels[] that changes nothing, as a comment. */
static void put_channel(FILE *out, const struct samples *samples, const struct channel *ch)
{
	const char *dot = strrchr(ch->name, '.');
	char type[TEXT_BYTES];
	char name[LIMIT_NAME_BYTES];
	char unit[sizeof(ch->unit)];

	text_plain(dot != NULL ? dot + 1 : ch->name, name, sizeof(name));
	text_plain(ch->unit, unit, sizeof(unit));
	fputs("    #  - { match: ", out);
	if (is_only_one(samples, ch)) {
		fprintf(out, "\"0x%04x:%02x\", name: %s", ch->index, ch->subindex, name);
	} else {
		fputs(name, out);
	}
	if (unit[0] != '\0' && strcmp(unit, ch->unit) == 0) {
		fputs(", unit: ", out);
		json_put_text(out, unit);
	}
	if (image_is_scaled(ch)) {
		fputs(", scale: ", out);
		json_put_real(out, ch->scale);
		fputs(", offset: ", out);
		json_put_real(out, ch->offset);
	}
	image_type_format(ch, type, sizeof(type));
	fprintf(out, " }  # %s %s\n", ch->direction == CHANNEL_OUTPUT ? "output" : "input", type);
}

static void put_channels(const struct scan_command *cmd, uint16_t pos)
{
	int is_open = 0;

	for (uint32_t i = 0; cmd->has_channels && i < cmd->samples.meta->channel_count; i++) {
		if (cmd->samples.channels[i].slave_pos != pos) {
			continue;
		}
		if (!is_open) {
			fputs("    #channels:\n", cmd->out);
			is_open = 1;
		}
		put_channel(cmd->out, &cmd->samples, &cmd->samples.channels[i]);
	}
}

/* --- the file --- */

static void put_head(const struct scan_command *cmd)
{
	char interface[sizeof(cmd->page->interface)];

	fprintf(cmd->out,
		"# Written by ecdaq scan: the slaves on this bus, in their order. The list is "
		"exact: a slave\n"
		"# that is missing, or one too many, keeps the bus from OP (bus.presence).\n"
		"bus:\n  interface: ");
	text_plain(cmd->page->interface, interface, sizeof(interface));
	json_put_text(cmd->out, interface);
	fputs("\n\nslaves:\n", cmd->out);
}

static enum exit_code put_slave(void *ctx, uint16_t pos)
{
	const struct scan_command *cmd = ctx;
	struct slave_info slave = source_slave(cmd->page, pos);
	char device[sizeof(slave.device)];
	struct pdo_info *info;
	enum exit_code result;

	progress_at(pos);
	result = pdo_info_read(cmd->cli, pos, &info);
	if (result != EXIT_CODE_OK) {
		return result;
	}
	fprintf(cmd->out, "  # %u: %s%s\n", pos, text_plain(slave.device, device, sizeof(device)),
		GET(cmd->page->slave[pos].is_lost) ? " (lost)" : "");
	fprintf(cmd->out, "  - name: %s\n", slave.name);
	fprintf(cmd->out, "    vendor: 0x%08x\n    product: 0x%08x\n    revision: 0x%08x\n",
		slave.vendor, slave.product, slave.revision);
	if (slave.serial != 0) {
		fprintf(cmd->out, "    # only this very device: serial: %u\n", slave.serial);
	}
	if (slave.alias != 0) {
		fprintf(cmd->out, "    alias: 0x%04x\n", slave.alias);
	}
	put_channels(cmd, pos);
	put_pdos(cmd->out, info);
	if (cmd->path != NULL) {
		pdo_info_warn(cmd->cli, pos, info);
	}
	pdo_info_free(info);
	return EXIT_CODE_OK;
}

/* Whoever starts with the file must not be the first to see that it is wrong. */
static enum exit_code check(const struct scan_command *cmd, const char *text, size_t len)
{
	struct config *cfg = malloc(sizeof(*cfg));
	char error[ERROR_BYTES] = "out of memory";
	int r = cfg == NULL ? -ENOMEM
			    : config_parse("ecdaq scan", text, len, cfg, error, sizeof(error));

	free(cfg);
	return r == 0 ? EXIT_CODE_OK : cli_fail(cmd->cli, EXIT_CODE_FAILED, "%s", error);
}

/* On a terminal, what continues a comment is one as well: it stays the same configuration. */
static void show_text(const char *text, int columns)
{
	while (*text != '\0') {
		size_t len = strcspn(text, "\n");
		size_t lead = strspn(text, " ");
		char prefix[32] = "";

		if (text[lead] == '#') {
			snprintf(prefix, sizeof(prefix), "%.*s#      ",
				 (int)(lead < 16 ? lead : 16), text);
		}
		fit_write_line(text, len, prefix[0] == '\0' ? 0 : columns, prefix, stdout);
		text += len + (text[len] == '\n');
	}
}

static enum exit_code write_out(const struct scan_command *cmd, const char *text, size_t len)
{
	enum exit_code result = check(cmd, text, len);
	char size[TEXT_BYTES];

	if (result != EXIT_CODE_OK) {
		return result;
	}
	if (cmd->path == NULL) {
		show_text(text, screen_columns());
		return EXIT_CODE_OK;
	}
	result = cmd->is_forced ? file_write(cmd->cli, cmd->path, (const uint8_t *)text, len)
				: file_write_new(cmd->cli, cmd->path, (const uint8_t *)text, len);
	if (result == EXIT_CODE_OK) {
		printf("%s: %u slaves, %s\n", cmd->path, source_slave_count(cmd->page),
		       text_bytes(len, size));
	}
	return result;
}

static enum exit_code write_yaml(struct scan_command *cmd)
{
	enum exit_code result;
	char *text = NULL;
	size_t len = 0;

	cmd->out = open_memstream(&text, &len);
	if (cmd->out == NULL) {
		return cli_fail(cmd->cli, EXIT_CODE_FAILED, "out of memory");
	}
	put_head(cmd);
	progress_begin_of("scan", source_slave_count(cmd->page), "slaves");
	result = each_slave(cmd->cli, cmd->page, NULL, 0, put_slave, cmd);
	progress_end();
	if (fclose(cmd->out) != 0 && result == EXIT_CODE_OK) {
		result = cli_fail(cmd->cli, EXIT_CODE_FAILED, "out of memory");
	}
	if (result == EXIT_CODE_OK) {
		result = write_out(cmd, text, len);
	}
	free(text);
	return result;
}

/* --- JSON --- */

static void show_json(const struct scan_command *cmd)
{
	struct json js;

	json_init(&js, stdout);
	json_array_begin(&js, NULL);
	for (uint32_t i = 0; i < source_slave_count(cmd->page); i++) {
		struct slave_info slave = source_slave(cmd->page, i);

		json_object_begin(&js, NULL);
		json_u64(&js, "position", i);
		json_text(&js, "name", slave.name);
		json_text(&js, "device", slave.device);
		json_u64(&js, "vendor", slave.vendor);
		json_u64(&js, "product", slave.product);
		json_u64(&js, "revision", slave.revision);
		json_u64(&js, "serial", slave.serial);
		json_u64(&js, "alias", slave.alias);
		json_truth(&js, "dc", slave.has_dc);
		json_truth(&js, "lost", GET(cmd->page->slave[i].is_lost) != 0);
		json_array_begin(&js, "channel");
		for (uint32_t c = 0; cmd->has_channels && c < cmd->samples.meta->channel_count;
		     c++) {
			if (cmd->samples.channels[c].slave_pos == i) {
				json_text(&js, NULL, cmd->samples.channels[c].name);
			}
		}
		json_array_end(&js);
		json_object_end(&js);
	}
	json_array_end(&js);
	json_end_line(&js);
}

/* --- all --- */

static enum exit_code run(struct scan_command *cmd)
{
	if (source_slave_count(cmd->page) == 0) {
		return cli_fail(cmd->cli, EXIT_CODE_NO_SLAVE,
				"%s: no slave was found: ecdaq state, ecdaq rescan",
				cmd->page->interface);
	}
	if (cmd->is_json) {
		show_json(cmd);
		return EXIT_CODE_OK;
	}
	return write_yaml(cmd);
}

enum exit_code verb_scan(struct cli *cli, int argc, char **argv)
{
	struct scan_command cmd = { .cli = cli };
	int is_progress = 0;
	const struct args_option options[] = {
		{ "write", 'w', args_text, &cmd.path, "FILE", "write it to FILE" },
		{ "force", 0, args_flag, &cmd.is_forced, NULL, "replace FILE if it is there" },
		{ "json", 0, args_flag, &cmd.is_json, NULL,
		  "the slaves as a JSON array, not as a configuration" },
		{ "progress", 0, args_flag, &is_progress, NULL,
		  "show how far it is where standard error is no terminal, too" },
	};
	struct args args = { .options = options, .option_count = 4 };
	enum exit_code result;

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	if (cmd.path != NULL ? cmd.is_json : cmd.is_forced) {
		return cli_fail(cli, EXIT_CODE_USAGE,
				cmd.is_json ? "--write and --json exclude each other"
					    : "--force requires --write");
	}
	if (is_progress) {
		progress_always();
	}
	result = source_status(cli, &cmd.page);
	if (result != EXIT_CODE_OK) {
		return result;
	}
	/* That of an earlier session has other slaves. */
	if (samples_try(cli, &cmd.samples) == 0) {
		cmd.has_channels = cmd.samples.meta->session == cmd.page->session;
		result = run(&cmd);
		samples_close(&cmd.samples);
	} else {
		result = run(&cmd);
	}
	source_status_close(cmd.page);
	return result;
}
