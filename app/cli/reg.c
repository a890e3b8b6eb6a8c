/* SPDX-License-Identifier: MIT */
/* ecdaq reg read, ecdaq reg write */
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "base/args.h"
#include "base/bytes.h"
#include "cli/admin_client.h"
#include "cli/cli.h"
#include "cli/hex.h"
#include "cli/source.h"
#include "config/sdo_value.h"
#include "program/json.h"

enum { DEFAULT_BYTES = 2 };

struct reg {
	struct cli *cli;
	const char *type; /* of the values written; NULL: bytes */
	int is_forced;
	int is_json;
	struct admin_request request;
	struct admin_reply reply;
};

static enum exit_code parse_values(struct reg *reg, char **words, int count)
{
	int type = reg->type == NULL ? (int)SDO_USINT : sdo_type_find(reg->type);

	if (type < 0) {
		return cli_fail(reg->cli, EXIT_CODE_USAGE,
				"--type: %s: expected one of " SDO_TYPE_WORDS, reg->type);
	}
	for (int i = 0; i < count; i++) {
		unsigned bytes = sdo_type_bytes((enum sdo_type)type);
		uint8_t value[8];
		uint64_t bits;

		if (sdo_value_parse((enum sdo_type)type, words[i], &bits) < 0) {
			return cli_fail(reg->cli, EXIT_CODE_USAGE, "%s: is not a valid %s%s",
					words[i], sdo_type_to_str((enum sdo_type)type),
					reg->type == NULL ? " (--type for longer ones)" : "");
		}
		if (reg->request.data_len + bytes > ADMIN_REGISTER_BYTES) {
			return cli_fail(reg->cli, EXIT_CODE_USAGE,
					"write: one access has up to %d bytes",
					ADMIN_REGISTER_BYTES);
		}
		put_le64(value, bits);
		memcpy(reg->request.data + reg->request.data_len, value, bytes);
		reg->request.data_len += bytes;
	}
	return EXIT_CODE_OK;
}

static int is_number(size_t len)
{
	return len == 1 || len == 2 || len == 4 || len == 8;
}

static uint64_t number_of(const struct reg *reg)
{
	uint8_t padded[8] = { 0 };

	memcpy(padded, reg->reply.data, reg->reply.data_len);
	return get_le64(padded);
}

static void show(const struct reg *reg)
{
	const struct admin_reply *reply = &reg->reply;
	char text[3 * ADMIN_REGISTER_BYTES];
	struct json js;

	if (!reg->is_json && is_number(reply->data_len)) {
		printf("0x%0*" PRIx64 " %" PRIu64 "\n", (int)(2 * reply->data_len), number_of(reg),
		       number_of(reg));
		return;
	}
	if (!reg->is_json) {
		hex_dump(reply->data, reply->data_len, reg->request.address);
		return;
	}
	hex_format(reply->data, reply->data_len, text, sizeof(text));
	json_init(&js, stdout);
	json_object_begin(&js, NULL);
	json_u64(&js, "slave", reg->request.slave_pos);
	json_u64(&js, "register", reg->request.address);
	json_text(&js, "bytes", text);
	if (is_number(reply->data_len)) {
		json_u64(&js, "value", number_of(reg));
	} else {
		json_null(&js, "value");
	}
	json_object_end(&js);
	json_end_line(&js);
}

/* Everything but the slave. */
static enum exit_code parse(struct reg *reg, const struct args *args)
{
	int is_write = strcmp(args->operands[0], "write") == 0;

	if (!is_write && strcmp(args->operands[0], "read") != 0) {
		return cli_fail(reg->cli, EXIT_CODE_USAGE, "%s: expected read or write",
				args->operands[0]);
	}
	if (is_write ? args->operand_count < 4 : args->operand_count > 4) {
		return cli_fail(reg->cli, EXIT_CODE_USAGE,
				is_write ? "write: expected SLAVE REGISTER VALUE..."
					 : "read: expected SLAVE REGISTER [LENGTH]");
	}
	if (hex_number(args->operands[2], UINT16_MAX, &reg->request.address) < 0) {
		return cli_fail(reg->cli, EXIT_CODE_USAGE,
				"%s: expected a register, 0x0000 to 0xffff", args->operands[2]);
	}
	reg->request.verb = is_write ? ADMIN_REGISTER_WRITE : ADMIN_REGISTER_READ;
	if (is_write) {
		reg->request.argument[1] = (uint32_t)reg->is_forced;
		return parse_values(reg, args->operands + 3, args->operand_count - 3);
	}
	if (reg->is_forced || reg->type != NULL) {
		return cli_fail(reg->cli, EXIT_CODE_USAGE, "read: %s: is an option of write",
				reg->is_forced ? "--force" : "--type");
	}
	reg->request.length = DEFAULT_BYTES;
	if (args->operand_count == 4 &&
	    (hex_number(args->operands[3], ADMIN_REGISTER_BYTES, &reg->request.length) < 0 ||
	     reg->request.length == 0)) {
		return cli_fail(reg->cli, EXIT_CODE_USAGE, "%s: expected a length of 1 to %d bytes",
				args->operands[3], ADMIN_REGISTER_BYTES);
	}
	return EXIT_CODE_OK;
}

enum exit_code verb_reg(struct cli *cli, int argc, char **argv)
{
	struct reg reg = { .cli = cli };
	const struct args_option options[] = {
		{ "type", 't', args_text, &reg.type, "TYPE", "data type of each VALUE: UINT" },
		{ "force", 0, args_flag, &reg.is_forced, NULL,
		  "write also what the master needs unchanged" },
		{ "json", 0, args_flag, &reg.is_json, NULL, "what was read as a JSON object" },
	};
	struct args args = { .options = options,
			     .option_count = 3,
			     .operands_min = 3,
			     .operands_max = 3 + ADMIN_REGISTER_BYTES };
	enum exit_code result;

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	result = parse(&reg, &args);
	if (result == EXIT_CODE_OK) {
		result = source_slave_pos(cli, args.operands[1], &reg.request.slave_pos);
	}
	if (result == EXIT_CODE_OK) {
		result = admin_do(cli, &reg.request, &reg.reply);
	}
	if (result == EXIT_CODE_OK && reg.request.verb == ADMIN_REGISTER_READ) {
		show(&reg);
	}
	return result;
}
