/* SPDX-License-Identifier: MIT */
/* ecdaq foe read, ecdaq foe write */
#include "cli/foe.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/args.h"
#include "cli/file.h"
#include "cli/hex.h"
#include "cli/mail.h"
#include "cli/source.h"
#include "program/json.h"

struct foe {
	struct mail mail;
	const char *output; /* NULL: none */
	const char *name;   /* at the slave; NULL: that of the file */
};

enum exit_code foe_name(const struct cli *cli, const char *given, const char *path,
			struct admin_request *request)
{
	const char *slash = strrchr(path, '/');
	const char *name = given != NULL ? given : slash != NULL ? slash + 1 : path;

	if (name[0] == '\0' || strlen(name) >= sizeof(request->name)) {
		return cli_fail(cli, EXIT_CODE_USAGE,
				"%s: a file of a slave has a name of 1 to %zu bytes (--name)", name,
				sizeof(request->name) - 1);
	}
	snprintf(request->name, sizeof(request->name), "%s", name);
	return EXIT_CODE_OK;
}

static void show_json(const struct foe *foe, size_t len, const char *bytes)
{
	struct json js;

	json_init(&js, stdout);
	json_object_begin(&js, NULL);
	json_u64(&js, "slave", foe->mail.request.slave_pos);
	json_text(&js, "name", foe->mail.request.name);
	json_u64(&js, "length", len);
	if (bytes != NULL) {
		json_text(&js, "bytes", bytes);
	}
	json_object_end(&js);
	json_end_line(&js);
}

static enum exit_code show_read(const struct foe *foe)
{
	const struct admin_transfer *tr = &foe->mail.transfer;
	char *text;

	if (foe->output != NULL) {
		enum exit_code result =
			file_write(foe->mail.cli, foe->output, tr->answer, tr->answer_len);

		if (result == EXIT_CODE_OK && foe->mail.is_json) {
			show_json(foe, tr->answer_len, NULL);
		}
		return result;
	}
	if (!foe->mail.is_json) {
		hex_dump(tr->answer, tr->answer_len, 0);
		return EXIT_CODE_OK;
	}
	text = malloc(3 * tr->answer_len + 1);
	if (text == NULL) {
		return cli_fail(foe->mail.cli, EXIT_CODE_FAILED, "out of memory");
	}
	text[0] = '\0';
	hex_format(tr->answer, tr->answer_len, text, 3 * tr->answer_len + 1);
	show_json(foe, tr->answer_len, text);
	free(text);
	return EXIT_CODE_OK;
}

static enum exit_code read_file(struct foe *foe, const char *name)
{
	enum exit_code result = foe_name(foe->mail.cli, name, name, &foe->mail.request);

	result = result == EXIT_CODE_OK ? mail_ask(&foe->mail, ADMIN_FOE_READ) : result;
	return result == EXIT_CODE_OK ? show_read(foe) : result;
}

static enum exit_code write_file(struct foe *foe, const char *path)
{
	struct mail *mail = &foe->mail;
	size_t len;
	enum exit_code result = foe_name(mail->cli, foe->name, path, &mail->request);

	result = result == EXIT_CODE_OK
			 ? file_read(mail->cli, path, ADMIN_TRANSFER_BYTES, &mail->data, &len)
			 : result;
	if (result != EXIT_CODE_OK) {
		return result;
	}
	mail->transfer.data = mail->data;
	mail->transfer.data_len = len;
	result = mail_ask(mail, ADMIN_FOE_WRITE);
	if (result == EXIT_CODE_OK && mail->is_json) {
		show_json(foe, len, NULL);
	} else if (result == EXIT_CODE_OK) {
		printf("%s: %zu bytes written\n", mail->request.name, len);
	}
	return result;
}

static enum exit_code run(struct foe *foe, const struct args *args)
{
	const char *verb = args->operands[0];
	int is_write = strcmp(verb, "write") == 0;
	enum exit_code result;

	if (!is_write && strcmp(verb, "read") != 0) {
		return cli_fail(foe->mail.cli, EXIT_CODE_USAGE, "%s: expected read or write", verb);
	}
	if (is_write ? foe->output != NULL : foe->name != NULL) {
		return cli_fail(foe->mail.cli, EXIT_CODE_USAGE, "%s: has no option %s", verb,
				is_write ? "--output" : "--name");
	}
	result = source_slave_pos(foe->mail.cli, args->operands[1], &foe->mail.request.slave_pos);
	if (result != EXIT_CODE_OK) {
		return result;
	}
	return is_write ? write_file(foe, args->operands[2]) : read_file(foe, args->operands[2]);
}

enum exit_code verb_foe(struct cli *cli, int argc, char **argv)
{
	struct foe foe = { .output = NULL };
	struct args_integer password = { .high = UINT32_MAX };
	const struct args_option options[] = {
		{ "output", 'o', args_text, &foe.output, "FILE", "read: write the file to FILE" },
		{ "name", 'n', args_text, &foe.name, "NAME", "write: its name at the slave" },
		{ "password", 0, args_integer, &password, "NUMBER", "that the slave asks for" },
		{ "json", 0, args_flag, &foe.mail.is_json, NULL, "the result as a JSON object" },
	};
	struct args args = {
		.options = options, .option_count = 4, .operands_min = 3, .operands_max = 3
	};
	enum exit_code result;

	mail_init(&foe.mail, cli);
	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	foe.mail.request.argument[0] = (uint32_t)password.value;
	result = run(&foe, &args);
	mail_done(&foe.mail);
	return result;
}
