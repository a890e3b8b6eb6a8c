/* SPDX-License-Identifier: MIT */
/* ecdaq reg read, ecdaq reg write, ecdaq reg watch */
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "base/args.h"
#include "base/bytes.h"
#include "base/host_clock.h"
#include "cli/admin_client.h"
#include "cli/cli.h"
#include "cli/hex.h"
#include "cli/register.h"
#include "cli/screen.h"
#include "cli/source.h"
#include "cli/text.h"
#include "config/sdo_value.h"
#include "program/args_duration.h"
#include "program/json.h"

enum { DEFAULT_BYTES = 2 };
#define WATCH_INTERVAL_NS (100 * NS_PER_MS)

struct reg {
	struct cli *cli;
	const char *type; /* of the values written; NULL: bytes */
	int is_forced;
	int is_json;
	int is_watch;
	int is_named;                     /* its fields are shown as text, too */
	int64_t interval_ns;              /* 0: the usual */
	uint64_t count;                   /* of readings; 0: no end */
	const struct esc_register *known; /* whole, and its fields are known; NULL: not so */
	uint8_t before[ADMIN_REGISTER_BYTES];
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

/* Those of the register, up to one without a name. */
static const struct register_field *fields_of(const struct reg *reg)
{
	static const struct register_field none[] = { { NULL, 0, 0, 0 } };

	return reg->known != NULL && reg->known->fields != NULL ? reg->known->fields : none;
}

static void show_fields(const struct reg *reg)
{
	char text[REGISTER_TEXT_BYTES];

	for (const struct register_field *f = fields_of(reg); f->name != NULL; f++) {
		uint64_t value = register_field_value(f, reg->reply.data);

		register_field_text(f, value, text);
		printf("  %-24s %" PRIu64 "%s%s\n", f->name, value, text[0] != '\0' ? "  " : "",
		       text);
	}
}

static void write_fields(struct json *js, const struct reg *reg)
{
	char text[REGISTER_TEXT_BYTES];

	json_array_begin(js, "field");
	for (const struct register_field *f = fields_of(reg); f->name != NULL; f++) {
		uint64_t value = register_field_value(f, reg->reply.data);

		register_field_text(f, value, text);
		json_object_begin(js, NULL);
		json_text(js, "name", f->name);
		json_u64(js, "value", value);
		json_text(js, "text", text);
		json_object_end(js);
	}
	json_array_end(js);
}

static void show_json(const struct reg *reg, int64_t utc_ns)
{
	const struct admin_reply *reply = &reg->reply;
	char text[3 * ADMIN_REGISTER_BYTES];
	char name[REGISTER_NAME_BYTES];
	struct json js;

	hex_format(reply->data, reply->data_len, text, sizeof(text));
	json_init(&js, stdout);
	json_object_begin(&js, NULL);
	if (utc_ns != 0) {
		char utc[TEXT_BYTES];

		json_text(&js, "utc", text_utc(utc_ns, utc));
	}
	json_u64(&js, "slave", reg->request.slave_pos);
	json_u64(&js, "register", reg->request.address);
	if (reg->known != NULL) {
		register_name(reg->known, reg->request.address, name);
		json_text(&js, "name", name);
	} else {
		json_null(&js, "name");
	}
	json_text(&js, "bytes", text);
	if (is_number(reply->data_len)) {
		json_u64(&js, "value", number_of(reg));
	} else {
		json_null(&js, "value");
	}
	write_fields(&js, reg);
	json_object_end(&js);
	json_end_line(&js);
}

static void show(const struct reg *reg)
{
	const struct admin_reply *reply = &reg->reply;

	if (reg->is_json) {
		show_json(reg, 0);
		return;
	}
	if (is_number(reply->data_len)) {
		printf("0x%0*" PRIx64 " %" PRIu64 "\n", (int)(2 * reply->data_len), number_of(reg),
		       number_of(reg));
	} else {
		hex_dump(reply->data, reply->data_len, reg->request.address);
	}
	if (reg->is_named) {
		show_fields(reg);
	}
}

/* --- watch --- */

/* The time, the bytes, and of the fields those that are not as before; of the first reading those
 * that are not 0. */
static void show_change(const struct reg *reg, int64_t utc_ns)
{
	char bytes[3 * ADMIN_REGISTER_BYTES];
	char text[REGISTER_TEXT_BYTES];
	char utc[TEXT_BYTES];

	if (reg->is_json) {
		show_json(reg, utc_ns);
		fflush(stdout);
		return;
	}
	hex_format(reg->reply.data, reg->reply.data_len, bytes, sizeof(bytes));
	printf("%s  ", text_utc(utc_ns, utc));
	if (is_number(reg->reply.data_len)) {
		printf("0x%0*" PRIx64 " %" PRIu64, (int)(2 * reg->reply.data_len), number_of(reg),
		       number_of(reg));
	} else {
		fputs(bytes, stdout);
	}
	for (const struct register_field *f = fields_of(reg); f->name != NULL; f++) {
		uint64_t value = register_field_value(f, reg->reply.data);

		if (value != register_field_value(f, reg->before)) {
			register_field_text(f, value, text);
			printf("  %s %" PRIu64 "%s%s", f->name, value, text[0] != '\0' ? " " : "",
			       text);
		}
	}
	putchar('\n');
	fflush(stdout);
}

/* What comes back is of another process: as long as what was asked for, or it is not used. */
static enum exit_code read_register(struct reg *reg)
{
	enum exit_code result = admin_do(reg->cli, &reg->request, &reg->reply);

	if (result == EXIT_CODE_OK && reg->reply.data_len != reg->request.length) {
		return cli_fail(reg->cli, EXIT_CODE_FAILED,
				"ecdaqd: %u bytes in answer to %u: the answer is from another "
				"version of ecdaq",
				reg->reply.data_len, reg->request.length);
	}
	return result;
}

/* A line for each change, until so many readings were made, the user ends it, or one fails. */
static enum exit_code watch(struct reg *reg)
{
	int64_t interval_ns = reg->interval_ns > 0 ? reg->interval_ns : WATCH_INTERVAL_NS;
	enum exit_code result = EXIT_CODE_OK;

	screen_catch_signals();
	for (uint64_t n = 1; !screen_is_over(); n++) {
		result = read_register(reg);
		if (result != EXIT_CODE_OK) {
			return result;
		}
		if (n == 1 || memcmp(reg->before, reg->reply.data, reg->reply.data_len) != 0) {
			show_change(reg, host_clock_ns(CLOCK_REALTIME));
			memcpy(reg->before, reg->reply.data, reg->reply.data_len);
		}
		if (n == reg->count) {
			break;
		}
		screen_wait(interval_ns);
	}
	return result;
}

/* --- the command line --- */

static enum exit_code parse_register(struct reg *reg, const char *word)
{
	const struct esc_register *found = register_find(word, &reg->request.address);

	if (found != NULL) {
		reg->is_named = 1;
		reg->known = found;
		return EXIT_CODE_OK;
	}
	if (hex_number(word, UINT16_MAX, &reg->request.address) < 0) {
		return cli_fail(reg->cli, EXIT_CODE_USAGE,
				"%s: expected a register, 0x0000 to 0xffff or a name (ecdaq reg "
				"list)",
				word);
	}
	reg->known = register_at(reg->request.address);
	return EXIT_CODE_OK;
}

/* How much is read: what is asked for, the whole of a register by name, or a word. */
static enum exit_code parse_length(struct reg *reg, const struct args *args)
{
	reg->request.length = reg->is_named ? reg->known->bytes : DEFAULT_BYTES;
	if (args->operand_count == 4 &&
	    (hex_number(args->operands[3], ADMIN_REGISTER_BYTES, &reg->request.length) < 0 ||
	     reg->request.length == 0)) {
		return cli_fail(reg->cli, EXIT_CODE_USAGE, "%s: expected a length of 1 to %d bytes",
				args->operands[3], ADMIN_REGISTER_BYTES);
	}
	if (reg->known != NULL && reg->request.length != reg->known->bytes) {
		reg->known = NULL; /* a part of it, or more */
	}
	return EXIT_CODE_OK;
}

static enum exit_code fail_words(const struct reg *reg, const char *text)
{
	return cli_fail(reg->cli, EXIT_CODE_USAGE, "%s", text);
}

/* Everything but the slave. */
static enum exit_code parse(struct reg *reg, const struct args *args)
{
	int is_write = strcmp(args->operands[0], "write") == 0;
	enum exit_code result;

	reg->is_watch = strcmp(args->operands[0], "watch") == 0;
	if (!is_write && !reg->is_watch && strcmp(args->operands[0], "read") != 0) {
		return cli_fail(reg->cli, EXIT_CODE_USAGE,
				"%s: expected read, write, watch or list", args->operands[0]);
	}
	if (is_write ? args->operand_count < 4
		     : args->operand_count < 3 || args->operand_count > 4) {
		return fail_words(reg, is_write        ? "write: expected SLAVE REGISTER VALUE..."
				       : reg->is_watch ? "watch: expected SLAVE REGISTER [LENGTH]"
						       : "read: expected SLAVE REGISTER [LENGTH]");
	}
	if (!reg->is_watch && (reg->interval_ns > 0 || reg->count > 0)) {
		return fail_words(reg, "--interval and --count are options of watch");
	}
	result = parse_register(reg, args->operands[2]);
	if (result != EXIT_CODE_OK) {
		return result;
	}
	reg->request.verb = is_write ? ADMIN_REGISTER_WRITE : ADMIN_REGISTER_READ;
	if (is_write) {
		reg->request.argument[1] = (uint32_t)reg->is_forced;
		return parse_values(reg, args->operands + 3, args->operand_count - 3);
	}
	if (reg->is_forced || reg->type != NULL) {
		return cli_fail(reg->cli, EXIT_CODE_USAGE, "%s: %s: is an option of write",
				args->operands[0], reg->is_forced ? "--force" : "--type");
	}
	return parse_length(reg, args);
}

/* The registers that have names. */
static enum exit_code list(const struct reg *reg)
{
	const struct esc_register *known;
	struct json js;

	json_init(&js, stdout);
	if (reg->is_json) {
		json_array_begin(&js, NULL);
	}
	for (size_t i = 0; (known = register_number(i)) != NULL; i++) {
		if (reg->is_json) {
			json_object_begin(&js, NULL);
			json_text(&js, "name", known->name);
			json_u64(&js, "register", known->address);
			json_u64(&js, "bytes", known->bytes);
			json_u64(&js, "count", known->count);
			json_object_end(&js);
		} else {
			printf("0x%04x  %2u  %s%s\n", known->address, known->bytes, known->name,
			       known->count > 1 ? "N" : "");
		}
	}
	if (reg->is_json) {
		json_array_end(&js);
		json_end_line(&js);
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
		{ "interval", 'i', args_duration, &reg.interval_ns, "T",
		  "watch: time between two readings, default 100ms" },
		{ "count", 'n', args_count, &reg.count, "N", "watch: end after N readings" },
		{ "json", 0, args_flag, &reg.is_json, NULL, "what was read as a JSON object" },
	};
	struct args args = { .options = options,
			     .option_count = 5,
			     .operands_min = 1,
			     .operands_max = 3 + ADMIN_REGISTER_BYTES };
	enum exit_code result;

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	if (args.operand_count == 1 && strcmp(args.operands[0], "list") == 0) {
		return list(&reg);
	}
	result = parse(&reg, &args);
	if (result == EXIT_CODE_OK) {
		result = source_slave_pos(cli, args.operands[1], &reg.request.slave_pos);
	}
	if (result != EXIT_CODE_OK) {
		return result;
	}
	if (reg.is_watch) {
		return watch(&reg);
	}
	if (reg.request.verb == ADMIN_REGISTER_WRITE) {
		return admin_do(cli, &reg.request, &reg.reply);
	}
	result = read_register(&reg);
	if (result == EXIT_CODE_OK) {
		show(&reg);
	}
	return result;
}
