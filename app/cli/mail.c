/* SPDX-License-Identifier: MIT */
#include "cli/mail.h"

#include <ctype.h>
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "base/bytes.h"
#include "cli/hex.h"
#include "cli/source.h"
#include "config/sdo_value.h"

void mail_init(struct mail *mail, struct cli *cli)
{
	*mail = (struct mail){ .cli = cli };
	mail->transfer.request = &mail->request;
	/* The name of a file, or of nothing. */
	mail->transfer.what = mail->request.name;
}

void mail_done(struct mail *mail)
{
	admin_transfer_done(&mail->transfer);
	free(mail->data);
	mail->data = NULL;
}

enum exit_code mail_run(struct mail *mail, const struct mail_action *actions, size_t action_count,
			char **operands, int count)
{
	char words[64] = "";
	size_t n = 0;
	enum exit_code result;

	while (n < action_count && strcmp(operands[0], actions[n].word) != 0) {
		size_t used = strlen(words);

		snprintf(words + used, sizeof(words) - used, "%s%s",
			 n == 0                  ? ""
			 : n == action_count - 1 ? " or "
						 : ", ",
			 actions[n].word);
		n++;
	}
	if (n == action_count) {
		return cli_fail(mail->cli, EXIT_CODE_USAGE, "%s: expected %s", operands[0], words);
	}
	if (count < actions[n].operands_min || count > actions[n].operands_max) {
		return cli_fail(mail->cli, EXIT_CODE_USAGE, "%s", actions[n].usage);
	}
	result = actions[n].run(mail, operands, count);
	mail_done(mail);
	return result;
}

/* --- the request --- */

/* Reading a dictionary again changes nothing. */
static int is_of_dictionary(enum admin_verb verb)
{
	return verb == ADMIN_SDO_LIST || verb == ADMIN_SDO_OBJECT || verb == ADMIN_SDO_ENTRY;
}

enum exit_code mail_try(struct mail *mail, enum admin_verb verb, int *ret_refused)
{
	enum exit_code result;

	admin_transfer_done(&mail->transfer);
	mail->transfer.answer_len = 0;
	mail->request.verb = verb;
	result = is_of_dictionary(verb) ? admin_transfer_read(mail->cli, &mail->transfer)
					: admin_transfer(mail->cli, &mail->transfer);
	*ret_refused = result == EXIT_CODE_OK && mail->transfer.reply.result == -EREMOTEIO;
	return result == EXIT_CODE_OK && !*ret_refused
		       ? admin_judge(mail->cli, &mail->transfer.reply)
		       : result;
}

enum exit_code mail_ask(struct mail *mail, enum admin_verb verb)
{
	int is_refused;
	enum exit_code result = mail_try(mail, verb, &is_refused);

	return is_refused ? admin_judge(mail->cli, &mail->transfer.reply) : result;
}

enum exit_code mail_parse_object(struct mail *mail, const char *text)
{
	unsigned long index = 0;
	unsigned long subindex = 0;
	char *end = NULL;

	/* Both are hexadecimal with or without 0x, as every list shows them. */
	if (isxdigit((unsigned char)text[0])) {
		index = strtoul(text, &end, 16);
		if (*end == ':' && isxdigit((unsigned char)end[1])) {
			subindex = strtoul(end + 1, &end, 16);
		}
	}
	if (end == NULL || *end != '\0' || index == 0 || index > 0xffff || subindex > 0xff) {
		return cli_fail(mail->cli, EXIT_CODE_USAGE,
				"%s: expected INDEX:SUB such as 0x1018:1", text);
	}
	mail->request.index = (uint16_t)index;
	mail->request.subindex = (uint8_t)subindex;
	return EXIT_CODE_OK;
}

enum exit_code mail_parse_type(const struct mail *mail, int *ret_type)
{
	*ret_type = MAIL_NO_TYPE;
	if (mail->type == NULL) {
		return EXIT_CODE_OK;
	}
	if (strcasecmp(mail->type, "STRING") == 0) {
		*ret_type = MAIL_STRING;
		return EXIT_CODE_OK;
	}
	*ret_type = sdo_type_find(mail->type);
	return *ret_type >= 0 ? EXIT_CODE_OK
			      : cli_fail(mail->cli, EXIT_CODE_USAGE,
					 "--type: %s: expected one of " SDO_TYPE_WORDS "|STRING",
					 mail->type);
}

enum exit_code mail_parse_value(struct mail *mail, const char *text)
{
	int type;
	uint64_t bits;
	enum exit_code result = mail_parse_type(mail, &type);
	int r;

	if (result != EXIT_CODE_OK) {
		return result;
	}
	if (type < 0) {
		return cli_fail(mail->cli, EXIT_CODE_USAGE,
				"write: --type must be one of " SDO_TYPE_WORDS);
	}
	r = sdo_value_parse((enum sdo_type)type, text, &bits);
	if (r < 0) {
		return cli_fail(mail->cli, EXIT_CODE_USAGE, "%s: %s %s", text,
				r == -ERANGE ? "does not fit into" : "is not a valid",
				sdo_type_to_str((enum sdo_type)type));
	}
	put_le64(mail->request.data, bits);
	mail->request.data_len = sdo_type_bytes((enum sdo_type)type);
	return EXIT_CODE_OK;
}

enum exit_code mail_parse_bytes(struct mail *mail, const char *text)
{
	size_t capacity = strlen(text) / 2;
	ssize_t len;

	free(mail->data);
	mail->data = malloc(capacity + 1);
	if (mail->data == NULL) {
		return cli_fail(mail->cli, EXIT_CODE_FAILED, "out of memory");
	}
	len = hex_parse(text, mail->data, capacity);
	if (len < 0) {
		return cli_fail(mail->cli, EXIT_CODE_USAGE,
				"%s: expected bytes in hex, two digits each", text);
	}
	mail->transfer.data = mail->data;
	mail->transfer.data_len = (size_t)len;
	return EXIT_CODE_OK;
}

/* --- the answer --- */

/* The type that data of @len bytes are shown in when none was given. */
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
		return MAIL_NO_TYPE;
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

static void copy_string(const struct admin_transfer *tr, char *buf, size_t buf_len)
{
	const char *text = tr->answer_len > 0 ? (const char *)tr->answer : "";

	snprintf(buf, buf_len, "%.*s", (int)strnlen(text, tr->answer_len), text);
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

/* @type: as it is shown; @text has room for all bytes in hex. */
static void show_text(const struct mail *mail, int type, char *text, size_t text_len)
{
	const struct admin_transfer *tr = &mail->transfer;
	uint64_t bits = bits_of(tr);

	if (type == MAIL_STRING) {
		copy_string(tr, text, text_len);
		for (char *p = text; *p != '\0'; p++) {
			*p = (unsigned char)*p < 0x20 || *p == 0x7f ? '?' : *p;
		}
	} else if (type >= 0 && mail->type != NULL) {
		sdo_value_format((enum sdo_type)type, bits, text, text_len);
	} else if (type >= 0) {
		snprintf(text, text_len, "0x%0*" PRIx64 " %" PRIu64, (int)(2 * tr->answer_len),
			 bits, bits);
	} else {
		hex_format(tr->answer, tr->answer_len, text, text_len);
	}
	puts(text);
}

static void show_json(const struct mail *mail, int type, char *text, size_t text_len,
		      void (*write_keys)(struct json *js, const struct mail *mail))
{
	const struct admin_transfer *tr = &mail->transfer;
	struct json js;

	json_init(&js, stdout);
	json_object_begin(&js, NULL);
	write_keys(&js, mail);
	hex_format(tr->answer, tr->answer_len, text, text_len);
	json_text(&js, "bytes", text);
	if (type == MAIL_STRING) {
		copy_string(tr, text, text_len);
		json_text(&js, "value", text);
	} else if (type >= 0) {
		write_json_value(&js, type, bits_of(tr));
	} else {
		json_null(&js, "value");
	}
	json_object_end(&js);
	json_end_line(&js);
}

static enum exit_code show(const struct mail *mail, mail_keys_writer write_keys)
{
	size_t len = mail->transfer.answer_len;
	size_t text_len = 3 * len + 64;
	char *text;
	int type;
	enum exit_code result = mail_parse_type(mail, &type);

	if (result != EXIT_CODE_OK) {
		return result;
	}
	if (type == MAIL_NO_TYPE) {
		type = type_by_length(len);
	} else if (type >= 0 && sdo_type_bytes((enum sdo_type)type) != len) {
		return cli_fail(mail->cli, EXIT_CODE_FAILED,
				"--type: the object has %zu bytes, %s has %u", len,
				sdo_type_to_str((enum sdo_type)type),
				sdo_type_bytes((enum sdo_type)type));
	}
	text = malloc(text_len);
	if (text == NULL) {
		return cli_fail(mail->cli, EXIT_CODE_FAILED, "out of memory");
	}
	if (mail->is_json) {
		show_json(mail, type, text, text_len, write_keys);
	} else {
		show_text(mail, type, text, text_len);
	}
	free(text);
	return EXIT_CODE_OK;
}

enum exit_code mail_write(struct mail *mail, enum admin_verb verb, const char *word)
{
	enum exit_code result = source_slave_pos(mail->cli, word, &mail->request.slave_pos);

	return result == EXIT_CODE_OK ? mail_ask(mail, verb) : result;
}

enum exit_code mail_read(struct mail *mail, enum admin_verb verb, const char *word,
			 mail_keys_writer write_keys)
{
	int type;
	enum exit_code result = mail_parse_type(mail, &type);

	result = result == EXIT_CODE_OK ? mail_write(mail, verb, word) : result;
	return result == EXIT_CODE_OK ? show(mail, write_keys) : result;
}
