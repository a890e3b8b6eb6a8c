/* SPDX-License-Identifier: MIT */
/* ecdaq sii read, ecdaq sii show, ecdaq sii write, ecdaq sii alias */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/args.h"
#include "base/bytes.h"
#include "cli/admin_client.h"
#include "cli/cli.h"
#include "cli/file.h"
#include "cli/hex.h"
#include "cli/sii_show.h"
#include "cli/source.h"
#include "program/json.h"
#include "wire/sii.h"

struct sii_command {
	struct cli *cli;
	const char *output; /* file; NULL: standard output */
	int is_forced;
	int is_json;
	int is_shown; /* in words */
	struct admin_request request;
	struct admin_transfer transfer;
};

/* --- read --- */

static void show_json(const struct sii_command *cmd)
{
	const uint8_t *image = cmd->transfer.answer;
	size_t len = cmd->transfer.answer_len;
	char *text = calloc(len, 3);
	struct json js;

	json_init(&js, stdout);
	json_object_begin(&js, NULL);
	json_u64(&js, "slave", cmd->request.slave_pos);
	json_u64(&js, "length", len);
	json_u64(&js, "alias", get_le16(image + SII_ALIAS_BYTE));
	json_truth(&js, "checksum_ok", sii_is_checksum_right(image));
	json_u64(&js, "vendor", get_le32(image + SII_VENDOR_BYTE));
	json_u64(&js, "product", get_le32(image + SII_PRODUCT_BYTE));
	json_u64(&js, "revision", get_le32(image + SII_REVISION_BYTE));
	json_u64(&js, "serial", get_le32(image + SII_SERIAL_BYTE));
	if (cmd->output != NULL) {
		json_text(&js, "file", cmd->output);
	} else if (text != NULL) {
		hex_format(image, len, text, 3 * len);
		json_text(&js, "bytes", text);
	}
	json_object_end(&js);
	json_end_line(&js);
	free(text);
}

static enum exit_code read_sii(struct sii_command *cmd)
{
	const struct admin_transfer *tr = &cmd->transfer;
	enum exit_code result = admin_transfer_do(cmd->cli, &cmd->transfer);

	if (result == EXIT_CODE_OK && tr->answer_len < SII_CATEGORIES_BYTE) {
		return cli_fail(cmd->cli, EXIT_CODE_FAILED, "ecdaqd: an SII of %zu bytes",
				tr->answer_len);
	}
	if (result == EXIT_CODE_OK && cmd->output != NULL) {
		result = file_write(cmd->cli, cmd->output, tr->answer, tr->answer_len);
	}
	if (result != EXIT_CODE_OK) {
		return result;
	}
	if (cmd->is_shown && cmd->is_json) {
		return sii_show_json(cmd->cli, cmd->request.slave_pos, tr->answer, tr->answer_len);
	}
	if (cmd->is_shown) {
		return sii_show(cmd->cli, tr->answer, tr->answer_len);
	}
	if (cmd->is_json) {
		show_json(cmd);
	} else if (cmd->output == NULL) {
		hex_dump(tr->answer, tr->answer_len, 0);
	}
	return EXIT_CODE_OK;
}

/* --- write, alias --- */

static enum exit_code write_sii(struct sii_command *cmd)
{
	enum exit_code result = admin_transfer_do(cmd->cli, &cmd->transfer);
	struct admin_sii_written written = { 0 };
	struct json js;

	if (result != EXIT_CODE_OK) {
		return result;
	}
	memcpy(&written, cmd->transfer.reply.data, sizeof(written));
	if (cmd->is_json) {
		json_init(&js, stdout);
		json_object_begin(&js, NULL);
		json_u64(&js, "slave", cmd->request.slave_pos);
		json_u64(&js, "words", written.compared);
		json_u64(&js, "written", written.written);
		json_object_end(&js);
		json_end_line(&js);
	} else if (written.written == 0) {
		printf("%u words, all equal: nothing written\n", written.compared);
	} else {
		printf("%u words, %u written and verified; in effect after the slave's next "
		       "power-on\n",
		       written.compared, written.written);
	}
	return EXIT_CODE_OK;
}

static enum exit_code write_file(struct sii_command *cmd, const char *path)
{
	uint8_t *image;
	enum exit_code result =
		file_read(cmd->cli, path, SII_LIMIT_BYTES, &image, &cmd->transfer.data_len);

	if (result != EXIT_CODE_OK) {
		return result;
	}
	cmd->transfer.data = image;
	result = write_sii(cmd);
	free(image);
	return result;
}

/* --- all --- */

enum { READ, SHOW, WRITE, ALIAS, VERBS };

static const struct sii_verb {
	const char *word;
	enum admin_verb verb;
	int operands;
	const char *usage;
} verbs[VERBS] = { [READ] = { "read", ADMIN_SII_READ, 2, "read: expected SLAVE" },
		   [SHOW] = { "show", ADMIN_SII_READ, 2, "show: expected SLAVE" },
		   [WRITE] = { "write", ADMIN_SII_WRITE, 3, "write: expected SLAVE FILE" },
		   [ALIAS] = { "alias", ADMIN_SII_ALIAS, 3, "alias: expected SLAVE ALIAS" } };

/* An option that @n does not have; NULL: none was given. */
static const char *foreign_option(const struct sii_command *cmd, size_t n)
{
	if (cmd->output != NULL && n != READ) {
		return "--output";
	}
	return cmd->is_forced && (n == READ || n == SHOW) ? "--force" : NULL;
}

static enum exit_code run(struct sii_command *cmd, const struct args *args)
{
	enum exit_code result;
	size_t n = 0;

	while (n < VERBS && strcmp(args->operands[0], verbs[n].word) != 0) {
		n++;
	}
	if (n == VERBS) {
		return cli_fail(cmd->cli, EXIT_CODE_USAGE,
				"%s: expected read, show, write or alias", args->operands[0]);
	}
	if (args->operand_count != verbs[n].operands) {
		return cli_fail(cmd->cli, EXIT_CODE_USAGE, "%s", verbs[n].usage);
	}
	cmd->request.verb = verbs[n].verb;
	cmd->is_shown = n == SHOW;
	if (foreign_option(cmd, n) != NULL) {
		return cli_fail(cmd->cli, EXIT_CODE_USAGE, "%s: has no option %s", verbs[n].word,
				foreign_option(cmd, n));
	}
	if (verbs[n].verb == ADMIN_SII_ALIAS &&
	    hex_number(args->operands[2], UINT16_MAX, &cmd->request.argument[0]) < 0) {
		return cli_fail(cmd->cli, EXIT_CODE_USAGE, "%s: expected an alias, 0 to 65535",
				args->operands[2]);
	}
	cmd->request.argument[1] = (uint32_t)cmd->is_forced;
	result = source_slave_pos(cmd->cli, args->operands[1], &cmd->request.slave_pos);
	if (result != EXIT_CODE_OK) {
		return result;
	}
	if (verbs[n].verb == ADMIN_SII_WRITE) {
		return write_file(cmd, args->operands[2]);
	}
	return verbs[n].verb == ADMIN_SII_READ ? read_sii(cmd) : write_sii(cmd);
}

enum exit_code verb_sii(struct cli *cli, int argc, char **argv)
{
	struct sii_command cmd = { .cli = cli };
	const struct args_option options[] = {
		{ "output", 'o', args_text, &cmd.output, "FILE", "read: write the image to FILE" },
		{ "force", 0, args_flag, &cmd.is_forced, NULL,
		  "write also in SAFE-OP and OP, and the image of another device" },
		{ "json", 0, args_flag, &cmd.is_json, NULL, "the result as a JSON object" },
	};
	struct args args = {
		.options = options, .option_count = 3, .operands_min = 2, .operands_max = 3
	};
	enum exit_code result;

	cmd.transfer = (struct admin_transfer){ .request = &cmd.request,
						.what = "EEPROM",
						.unit = "words" };
	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	result = run(&cmd, &args);
	admin_transfer_done(&cmd.transfer);
	return result;
}
