/* SPDX-License-Identifier: MIT */
/* ecdaq aoe: objects of a slave by ADS over EtherCAT (AoE). */
#include <stdio.h>

#include "base/args.h"
#include "cli/mail.h"
#include "wire/aoe.h"

enum { READ_BYTES = 256 };

static void write_keys(struct json *js, const struct mail *mail)
{
	json_u64(js, "slave", mail->request.slave_pos);
	json_u64(js, "port", mail->request.argument[2]);
	json_u64(js, "index", mail->request.index);
	json_u64(js, "subindex", mail->request.subindex);
}

static enum exit_code take_object(struct mail *mail, const char *word)
{
	enum exit_code result = mail_parse_object(mail, word);

	mail->request.argument[0] = AOE_GROUP_SDO;
	mail->request.argument[1] = aoe_sdo_offset(mail->request.index, mail->request.subindex);
	return result;
}

static enum exit_code read_object(struct mail *mail, char **operands, int count)
{
	enum exit_code result = take_object(mail, operands[2]);

	(void)count;
	mail->request.length = READ_BYTES;
	return result == EXIT_CODE_OK ? mail_read(mail, ADMIN_AOE_READ, operands[1], write_keys)
				      : result;
}

static enum exit_code write_object(struct mail *mail, char **operands, int count)
{
	enum exit_code result = mail_parse_value(mail, operands[3]);

	(void)count;
	result = result == EXIT_CODE_OK ? take_object(mail, operands[2]) : result;
	return result == EXIT_CODE_OK ? mail_write(mail, ADMIN_AOE_WRITE, operands[1]) : result;
}

enum exit_code verb_aoe(struct cli *cli, int argc, char **argv)
{
	static const struct mail_action actions[] = {
		{ "read", 3, 3, "read: expected SLAVE INDEX:SUB", read_object },
		{ "write", 4, 4, "write: expected SLAVE INDEX:SUB VALUE", write_object },
	};
	struct mail mail;
	struct args_integer port = { .low = 0, .high = UINT16_MAX, .value = -1 };
	const char *net_id = "";
	uint8_t net_id_bytes[AOE_NET_ID_BYTES];
	const struct args_option options[] = {
		{ "port", 0, args_integer, &port, "P", "AMS port in the slave; required" },
		{ "net-id", 0, args_text, &net_id, "ID", "AMS Net ID of the slave (0.0.0.0.0.0)" },
		{ "type", 't', args_text, &mail.type, "TYPE", "data type of the object" },
		{ "json", 0, args_flag, &mail.is_json, NULL, "the value as a JSON object" },
	};
	struct args args = {
		.options = options, .option_count = 4, .operands_min = 3, .operands_max = 4
	};
	enum exit_code result;

	mail_init(&mail, cli);
	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	if (port.value < 0) {
		return cli_fail(cli, EXIT_CODE_USAGE, "--port is missing");
	}
	if (aoe_net_id_parse(net_id, net_id_bytes) < 0) {
		return cli_fail(cli, EXIT_CODE_USAGE,
				"--net-id: %s: expected an AMS Net ID such as 192.168.0.1.1.1",
				net_id);
	}
	snprintf(mail.request.name, sizeof(mail.request.name), "%s", net_id);
	mail.request.argument[2] = (uint32_t)port.value;
	return mail_run(&mail, actions, sizeof(actions) / sizeof(actions[0]), args.operands,
			args.operand_count);
}
