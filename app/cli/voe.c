/* SPDX-License-Identifier: MIT */
/* ecdaq voe: one exchange of a vendor's own protocol (VoE). */
#include <stdio.h>
#include <stdlib.h>

#include "base/args.h"
#include "base/bytes.h"
#include "cli/hex.h"
#include "cli/mail.h"
#include "cli/source.h"

enum { TYPE_BYTES = 2 };

/* The vendor of the slave itself, where none is given. */
static enum exit_code take_slave(struct mail *mail, const char *word, int is_vendor_given)
{
	const struct status_page *page = NULL;
	enum exit_code result = source_status(mail->cli, &page);

	if (result != EXIT_CODE_OK) {
		return result;
	}
	result = source_find_slave(mail->cli, page, word, &mail->request.slave_pos);
	if (result == EXIT_CODE_OK && !is_vendor_given) {
		mail->request.argument[0] = source_slave(page, mail->request.slave_pos).vendor;
	}
	source_status_close(page);
	return result;
}

static enum exit_code show(const struct mail *mail)
{
	const struct admin_transfer *tr = &mail->transfer;
	size_t len = tr->answer_len < TYPE_BYTES ? 0 : tr->answer_len - TYPE_BYTES;
	char *text = malloc(3 * len + 1);
	struct json js;

	if (text == NULL) {
		return cli_fail(mail->cli, EXIT_CODE_FAILED, "out of memory");
	}
	hex_format(tr->answer + TYPE_BYTES, len, text, 3 * len + 1);
	if (mail->is_json) {
		json_init(&js, stdout);
		json_object_begin(&js, NULL);
		json_u64(&js, "slave", mail->request.slave_pos);
		json_u64(&js, "vendor", mail->request.argument[0]);
		json_u64(&js, "type", get_le16(tr->answer));
		json_text(&js, "bytes", text);
		json_object_end(&js);
		json_end_line(&js);
	} else {
		puts(text);
	}
	free(text);
	return EXIT_CODE_OK;
}

static enum exit_code exchange(struct mail *mail, char **operands, int is_vendor_given)
{
	enum exit_code result = mail_parse_bytes(mail, operands[1]);

	result = result == EXIT_CODE_OK ? take_slave(mail, operands[0], is_vendor_given) : result;
	result = result == EXIT_CODE_OK ? mail_ask(mail, ADMIN_VOE) : result;
	return result == EXIT_CODE_OK && mail->transfer.answer_len >= TYPE_BYTES ? show(mail)
										 : result;
}

enum exit_code verb_voe(struct cli *cli, int argc, char **argv)
{
	struct mail mail;
	struct args_integer vendor = { .low = 0, .high = UINT32_MAX, .value = -1 };
	struct args_integer type = { .low = 0, .high = UINT16_MAX };
	int has_no_answer = 0;
	const struct args_option options[] = {
		{ "vendor", 0, args_integer, &vendor, "ID", "vendor ID (that of the slave)" },
		{ "type", 't', args_integer, &type, "N", "the vendor's type, 0 to 65535 (0)" },
		{ "no-answer", 0, args_flag, &has_no_answer, NULL,
		  "send only: the slave does not answer" },
		{ "json", 0, args_flag, &mail.is_json, NULL, "the answer as a JSON object" },
	};
	struct args args = {
		.options = options, .option_count = 4, .operands_min = 2, .operands_max = 2
	};
	enum exit_code result;

	mail_init(&mail, cli);
	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	mail.request.argument[0] = vendor.value < 0 ? 0 : (uint32_t)vendor.value;
	mail.request.argument[1] = (uint32_t)type.value;
	mail.request.argument[2] = (uint32_t)has_no_answer;
	result = exchange(&mail, args.operands, vendor.value >= 0);
	mail_done(&mail);
	return result;
}
