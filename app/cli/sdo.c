/* SPDX-License-Identifier: MIT */
/* ecdaq sdo: objects of a slave by CoE. Lists of them: sdo_list.c. */
#include <string.h>

#include "base/args.h"
#include "cli/mail.h"
#include "cli/sdo_list.h"
#include "cli/source.h"
#include "cli/startup_list.h"

static void write_keys(struct json *js, const struct mail *mail)
{
	json_u64(js, "slave", mail->request.slave_pos);
	json_u64(js, "index", mail->request.index);
	json_u64(js, "subindex", mail->request.subindex);
}

static enum exit_code take_object(struct mail *mail, const char *word)
{
	enum exit_code result = mail_parse_object(mail, word);

	if (result == EXIT_CODE_OK && mail->request.argument[0] != 0 &&
	    mail->request.subindex > 1) {
		return cli_fail(mail->cli, EXIT_CODE_USAGE,
				"%s: --complete: expected subindex 0 or 1", word);
	}
	return result;
}

static enum exit_code read_object(struct mail *mail, char **operands, int count)
{
	enum exit_code result = take_object(mail, operands[2]);

	(void)count;
	return result == EXIT_CODE_OK ? mail_read(mail, ADMIN_SDO_READ, operands[1], write_keys)
				      : result;
}

static enum exit_code write_object(struct mail *mail, char **operands, int count)
{
	enum exit_code result;

	(void)count;
	if (mail->request.argument[0] == 0) {
		result = mail_parse_value(mail, operands[3]);
	} else if (mail->type != NULL) {
		return cli_fail(mail->cli, EXIT_CODE_USAGE,
				"write: --complete takes bytes in hex, without --type");
	} else {
		result = mail_parse_bytes(mail, operands[3]);
	}
	result = result == EXIT_CODE_OK ? take_object(mail, operands[2]) : result;
	return result == EXIT_CODE_OK ? mail_write(mail, ADMIN_SDO_WRITE, operands[1]) : result;
}

/* What shows a list has no options of a transfer. */
static enum exit_code take_slave(struct mail *mail, char **operands)
{
	if (mail->type != NULL || mail->request.argument[0] != 0) {
		return cli_fail(mail->cli, EXIT_CODE_USAGE, "%s: has no option %s", operands[0],
				mail->type != NULL ? "--type" : "--complete");
	}
	return source_slave_pos(mail->cli, operands[1], &mail->request.slave_pos);
}

static enum exit_code list_objects(struct mail *mail, char **operands, int count)
{
	struct sdo_part part = { .is_indices = mail->is_indices, .count = mail->count };
	enum exit_code result = EXIT_CODE_OK;

	if (count == 3) {
		result = mail_parse_object(mail, operands[2]);
		part.index = mail->request.index;
		part.subindex = mail->request.subindex;
		part.is_one = !mail->is_indices;
	}
	if (result == EXIT_CODE_OK && part.count > 0 && !part.is_one && !part.is_indices) {
		return cli_fail(mail->cli, EXIT_CODE_USAGE,
				"list: --count is of --indices, or of an object INDEX:SUB");
	}
	result = result == EXIT_CODE_OK ? take_slave(mail, operands) : result;
	return result == EXIT_CODE_OK ? sdo_list(mail, &part) : result;
}

static enum exit_code list_startup(struct mail *mail, char **operands, int count)
{
	enum exit_code result = take_slave(mail, operands);
	struct json js;

	(void)count;
	return result == EXIT_CODE_OK ? startup_list_show(mail->cli, mail->request.slave_pos,
							  mail->is_json ? &js : NULL)
				      : result;
}

enum exit_code verb_sdo(struct cli *cli, int argc, char **argv)
{
	static const struct mail_action actions[] = {
		{ "read", 3, 3, "read: expected SLAVE INDEX:SUB", read_object },
		{ "write", 4, 4, "write: expected SLAVE INDEX:SUB VALUE", write_object },
		{ "list", 2, 3, "list: expected SLAVE [INDEX:SUB]", list_objects },
		{ "startup", 2, 2, "startup: expected SLAVE", list_startup },
	};
	struct mail mail;
	int is_complete = 0;
	const struct args_option options[] = {
		{ "type", 't', args_text, &mail.type, "TYPE", "data type of the object" },
		{ "complete", 0, args_flag, &is_complete, NULL,
		  "complete access: all subindices; VALUE is bytes in hex" },
		{ "indices", 0, args_flag, &mail.is_indices, NULL,
		  "list: the indices of the objects only" },
		{ "count", 0, args_count, &mail.count, "N",
		  "list: N entries from INDEX:SUB on, or N indices" },
		{ "json", 0, args_flag, &mail.is_json, NULL, "the value as a JSON object" },
	};
	struct args args = {
		.options = options, .option_count = 5, .operands_min = 2, .operands_max = 4
	};
	enum exit_code result;

	mail_init(&mail, cli);
	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	mail.request.argument[0] = (uint32_t)is_complete;
	if ((mail.is_indices || mail.count > 0) && strcmp(args.operands[0], "list") != 0) {
		return cli_fail(cli, EXIT_CODE_USAGE, "%s: has no option %s", args.operands[0],
				mail.is_indices ? "--indices" : "--count");
	}
	return mail_run(&mail, actions, sizeof(actions) / sizeof(actions[0]), args.operands,
			args.operand_count);
}
