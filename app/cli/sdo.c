/* SPDX-License-Identifier: MIT */
/* ecdaq sdo read, ecdaq sdo write */
#include <ctype.h>
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "base/args.h"
#include "base/bytes.h"
#include "cli/admin_client.h"
#include "cli/cli.h"
#include "cli/hex.h"
#include "cli/source.h"
#include "config/sdo_value.h"
#include "program/json.h"
#include "wire/sdo_abort.h"

struct sdo {
	struct cli *cli;
	const char *type; /* as given; NULL: none */
	int is_json;
	struct admin_request request;
	struct admin_transfer transfer;
};

/* "0x1018:1": hexadecimal with 0x, else decimal; the subindex may be left out. */
static int parse_object(const char *text, uint16_t *ret_index, uint8_t *ret_subindex)
{
	unsigned long index;
	unsigned long subindex = 0;
	char *end;

	if (!isdigit((unsigned char)text[0])) {
		return -EINVAL;
	}
	index = strtoul(text, &end, 0);
	if (*end == ':' && isdigit((unsigned char)end[1])) {
		subindex = strtoul(end + 1, &end, 0);
	}
	if (*end != '\0' || index == 0 || index > 0xffff || subindex > 0xff) {
		return -EINVAL;
	}
	*ret_index = (uint16_t)index;
	*ret_subindex = (uint8_t)subindex;
	return 0;
}

/* Send the request; report an abort with its text. */
static enum exit_code ask(struct sdo *sdo)
{
	const struct admin_reply *reply = &sdo->transfer.reply;
	enum exit_code result = admin_transfer(sdo->cli, &sdo->transfer);

	if (result == EXIT_CODE_OK && reply->result < 0 && reply->slave_code != 0) {
		return cli_fail(sdo->cli, EXIT_CODE_REFUSED,
				"slave %u: 0x%04x:%02x: SDO abort 0x%08x: %s",
				sdo->request.slave_pos, sdo->request.index, sdo->request.subindex,
				reply->slave_code, sdo_abort_to_str(reply->slave_code));
	}
	return result == EXIT_CODE_OK ? admin_judge(sdo->cli, reply) : result;
}

/* The type that data of @len bytes are shown in when none was given; -1: none fits. */
static int type_by_length(size_t len)
{
	switch (len) {
	case 1:
		return SDO_USINT;
	case 2:
		return SDO_UINT;
	case 4:
		return SDO_UDINT;
	case 8:
		return SDO_ULINT;
	default:
		return -1;
	}
}

static uint64_t bits_of(const struct admin_transfer *tr)
{
	uint8_t padded[8] = { 0 };

	if (tr->answer_len > 0) {
		memcpy(padded, tr->answer, tr->answer_len > 8 ? 8 : tr->answer_len);
	}
	return get_le64(padded);
}

static void copy_string(const struct admin_transfer *tr, int is_terminal, char *buf, size_t buf_len)
{
	const char *text = tr->answer_len > 0 ? (const char *)tr->answer : "";

	snprintf(buf, buf_len, "%.*s", (int)strnlen(text, tr->answer_len), text);
	for (char *p = buf; is_terminal && *p != '\0'; p++) {
		if ((unsigned char)*p < 0x20 || *p == 0x7f) {
			*p = '?';
		}
	}
}

static void write_json_value(struct json *js, int type, uint64_t bits)
{
	char text[32];

	if (type == SDO_BOOL) {
		json_truth(js, "value", bits != 0);
	} else if (type == SDO_REAL || type == SDO_LREAL) {
		sdo_value_format((enum sdo_type)type, bits, text, sizeof(text));
		json_double(js, "value", strtod(text, NULL));
	} else if (type == SDO_SINT || type == SDO_INT || type == SDO_DINT || type == SDO_LINT) {
		sdo_value_format((enum sdo_type)type, bits, text, sizeof(text));
		json_i64(js, "value", strtoll(text, NULL, 10));
	} else {
		json_u64(js, "value", bits);
	}
}

/* @type as show() has it; @text has room for all bytes in hex. */
static void show_text(const struct sdo *sdo, int type, char *text, size_t text_len)
{
	const struct admin_transfer *tr = &sdo->transfer;
	uint64_t bits = bits_of(tr);

	if (type == SDO_TYPES) {
		copy_string(tr, 1, text, text_len);
	} else if (type >= 0 && sdo->type != NULL) {
		sdo_value_format((enum sdo_type)type, bits, text, text_len);
	} else if (type >= 0) {
		snprintf(text, text_len, "0x%0*" PRIx64 " %" PRIu64, (int)(2 * tr->answer_len),
			 bits, bits);
	} else {
		hex_format(tr->answer, tr->answer_len, text, text_len);
	}
	puts(text);
}

static void show_json(const struct sdo *sdo, int type, char *text, size_t text_len)
{
	const struct admin_transfer *tr = &sdo->transfer;
	struct json js;

	json_init(&js, stdout);
	json_object_begin(&js, NULL);
	json_u64(&js, "slave", sdo->request.slave_pos);
	json_u64(&js, "index", sdo->request.index);
	json_u64(&js, "subindex", sdo->request.subindex);
	hex_format(tr->answer, tr->answer_len, text, text_len);
	json_text(&js, "bytes", text);
	if (type == SDO_TYPES) {
		copy_string(tr, 0, text, text_len);
		json_text(&js, "value", text);
	} else if (type >= 0) {
		write_json_value(&js, type, bits_of(tr));
	} else {
		json_null(&js, "value");
	}
	json_object_end(&js);
	json_end_line(&js);
}

/* @type: an enum sdo_type, SDO_TYPES for a string, -1 for none. */
static enum exit_code show(const struct sdo *sdo, int type)
{
	size_t text_len = 3 * sdo->transfer.answer_len + 64;
	char *text = malloc(text_len);

	if (text == NULL) {
		return cli_fail(sdo->cli, EXIT_CODE_FAILED, "out of memory");
	}
	if (sdo->is_json) {
		show_json(sdo, type, text, text_len);
	} else {
		show_text(sdo, type, text, text_len);
	}
	free(text);
	return EXIT_CODE_OK;
}

static enum exit_code find_type(const struct sdo *sdo, int *ret_type)
{
	*ret_type = -1;
	if (sdo->type == NULL) {
		return EXIT_CODE_OK;
	}
	if (strcasecmp(sdo->type, "STRING") == 0) {
		*ret_type = SDO_TYPES;
		return EXIT_CODE_OK;
	}
	*ret_type = sdo_type_find(sdo->type);
	return *ret_type >= 0 ? EXIT_CODE_OK
			      : cli_fail(sdo->cli, EXIT_CODE_USAGE,
					 "--type: %s: expected one of " SDO_TYPE_WORDS "|STRING",
					 sdo->type);
}

static enum exit_code read_object(struct sdo *sdo, int type)
{
	enum exit_code result;

	sdo->request.verb = ADMIN_SDO_READ;
	result = ask(sdo);
	if (result != EXIT_CODE_OK) {
		return result;
	}
	if (type < 0) {
		type = type_by_length(sdo->transfer.answer_len);
	} else if (type != SDO_TYPES &&
		   sdo_type_bytes((enum sdo_type)type) != sdo->transfer.answer_len) {
		return cli_fail(sdo->cli, EXIT_CODE_FAILED,
				"--type: the object has %zu bytes, %s has %u",
				sdo->transfer.answer_len, sdo_type_to_str((enum sdo_type)type),
				sdo_type_bytes((enum sdo_type)type));
	}
	return show(sdo, type);
}

static enum exit_code write_object(struct sdo *sdo, int type, const char *value)
{
	uint8_t bytes[8];
	uint64_t bits;
	int r;

	if (type < 0 || type == SDO_TYPES) {
		return cli_fail(sdo->cli, EXIT_CODE_USAGE,
				"write: --type must be one of " SDO_TYPE_WORDS);
	}
	r = sdo_value_parse((enum sdo_type)type, value, &bits);
	if (r < 0) {
		return cli_fail(sdo->cli, EXIT_CODE_USAGE, "%s: %s %s", value,
				r == -ERANGE ? "does not fit into" : "is not a valid",
				sdo_type_to_str((enum sdo_type)type));
	}
	put_le64(bytes, bits);
	sdo->request.verb = ADMIN_SDO_WRITE;
	sdo->request.data_len = (uint16_t)sdo_type_bytes((enum sdo_type)type);
	memcpy(sdo->request.data, bytes, sdo->request.data_len);
	return ask(sdo);
}

static enum exit_code run(struct sdo *sdo, const struct args *args)
{
	int is_write = strcmp(args->operands[0], "write") == 0;
	enum exit_code result;
	int type;

	if (!is_write && strcmp(args->operands[0], "read") != 0) {
		return cli_fail(sdo->cli, EXIT_CODE_USAGE, "%s: expected read or write",
				args->operands[0]);
	}
	if (args->operand_count != (is_write ? 4 : 3)) {
		return cli_fail(sdo->cli, EXIT_CODE_USAGE,
				is_write ? "write: expected SLAVE INDEX:SUB VALUE"
					 : "read: expected SLAVE INDEX:SUB");
	}
	if (parse_object(args->operands[2], &sdo->request.index, &sdo->request.subindex) < 0) {
		return cli_fail(sdo->cli, EXIT_CODE_USAGE,
				"%s: expected INDEX:SUB such as 0x1018:1", args->operands[2]);
	}
	result = find_type(sdo, &type);
	if (result != EXIT_CODE_OK) {
		return result;
	}
	result = source_slave_pos(sdo->cli, args->operands[1], &sdo->request.slave_pos);
	if (result != EXIT_CODE_OK) {
		return result;
	}
	return is_write ? write_object(sdo, type, args->operands[3]) : read_object(sdo, type);
}

enum exit_code verb_sdo(struct cli *cli, int argc, char **argv)
{
	struct sdo sdo = { .cli = cli };
	const struct args_option options[] = {
		{ "type", 't', args_text, &sdo.type, "TYPE", "data type of the object" },
		{ "json", 0, args_flag, &sdo.is_json, NULL, "the value as a JSON object" },
	};
	struct args args = {
		.options = options, .option_count = 2, .operands_min = 3, .operands_max = 4
	};
	enum exit_code result;

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	sdo.transfer =
		(struct admin_transfer){ .request = &sdo.request, .progress = admin_show_progress };
	result = run(&sdo, &args);
	admin_transfer_done(&sdo.transfer);
	return result;
}
