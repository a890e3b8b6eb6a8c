/* SPDX-License-Identifier: MIT */
/* ecdaq soe: parameters of a drive (SoE). */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/args.h"
#include "base/bytes.h"
#include "cli/mail.h"
#include "cli/soe_value.h"
#include "cli/source.h"
#include "cli/text.h"
#include "wire/soe.h"

enum { IDN_ALL = 17, TEXT_CAPACITY = 256, COLUMNS = 80, LABEL_COLUMNS = 11 };

/* An element that was read; len 0: the drive has none. */
struct element {
	uint8_t *bytes;
	size_t len;
};

/* All of one parameter. */
struct parameter {
	uint32_t attribute;
	char name[TEXT_CAPACITY];
	char unit[TEXT_CAPACITY];
	int has_unit;
	struct element min;
	struct element max;
	struct element value;
};

static enum exit_code ask_element(struct mail *mail, enum soe_element element)
{
	mail->request.argument[0] = element;
	return mail_ask(mail, ADMIN_SOE_READ);
}

/* The same of one that a parameter need not have. */
static enum exit_code try_element(struct mail *mail, enum soe_element element, int *ret_refused)
{
	mail->request.argument[0] = element;
	return mail_try(mail, ADMIN_SOE_READ, ret_refused);
}

static enum exit_code read_text(struct mail *mail, enum soe_element element,
				char ret_text[TEXT_CAPACITY], int *ret_refused)
{
	enum exit_code result = try_element(mail, element, ret_refused);
	const uint8_t *text;
	size_t len = 0;

	ret_text[0] = '\0';
	if (result == EXIT_CODE_OK && !*ret_refused && mail->transfer.answer_len > 0) {
		text = soe_list_data(mail->transfer.answer, mail->transfer.answer_len, &len);
		snprintf(ret_text, TEXT_CAPACITY, "%.*s", (int)strnlen((const char *)text, len),
			 (const char *)text);
	}
	return result;
}

/* A minimum or maximum. */
static enum exit_code read_limit(struct mail *mail, enum soe_element element,
				 struct parameter *parameter, struct element *ret_limit)
{
	int is_refused;
	enum exit_code result;

	if (soe_is_list(parameter->attribute)) {
		return EXIT_CODE_OK;
	}
	result = try_element(mail, element, &is_refused);
	if (result == EXIT_CODE_OK && !is_refused &&
	    mail->transfer.answer_len == soe_value_bytes(parameter->attribute)) {
		*ret_limit = (struct element){ mail->transfer.answer, mail->transfer.answer_len };
		mail->transfer.answer = NULL;
	}
	return result;
}

static enum exit_code read_attribute(struct mail *mail, uint32_t *ret_attribute)
{
	enum exit_code result = ask_element(mail, SOE_ELEMENT_ATTRIBUTE);

	if (result != EXIT_CODE_OK) {
		return result;
	}
	if (mail->transfer.answer_len != 4) {
		return cli_fail(mail->cli, EXIT_CODE_FAILED,
				"slave %u: attribute of %zu bytes, expected 4",
				mail->request.slave_pos, mail->transfer.answer_len);
	}
	*ret_attribute = get_le32(mail->transfer.answer);
	return EXIT_CODE_OK;
}

static enum exit_code read_all(struct mail *mail, struct parameter *parameter)
{
	int is_refused;
	enum exit_code result = read_attribute(mail, &parameter->attribute);

	if (result == EXIT_CODE_OK) {
		result = read_text(mail, SOE_ELEMENT_NAME, parameter->name, &is_refused);
	}
	if (result == EXIT_CODE_OK) {
		result = read_text(mail, SOE_ELEMENT_UNIT, parameter->unit, &is_refused);
		parameter->has_unit = !is_refused && parameter->unit[0] != '\0';
	}
	if (result == EXIT_CODE_OK) {
		result = read_limit(mail, SOE_ELEMENT_MIN, parameter, &parameter->min);
	}
	if (result == EXIT_CODE_OK) {
		result = read_limit(mail, SOE_ELEMENT_MAX, parameter, &parameter->max);
	}
	if (result == EXIT_CODE_OK) {
		result = ask_element(mail, SOE_ELEMENT_VALUE);
		parameter->value =
			(struct element){ mail->transfer.answer, mail->transfer.answer_len };
		mail->transfer.answer = NULL;
	}
	return result;
}

static void release(struct parameter *parameter)
{
	free(parameter->min.bytes);
	free(parameter->max.bytes);
	free(parameter->value.bytes);
}

/* --- read --- */

/* The numbers of a value: their bytes, how many. */
static const uint8_t *items_of(const struct parameter *p, size_t *ret_count)
{
	size_t item_bytes = soe_value_bytes(p->attribute);
	const uint8_t *bytes = p->value.bytes;
	size_t len = p->value.len;

	if (soe_is_list(p->attribute)) {
		bytes = soe_list_data(p->value.bytes, p->value.len, &len);
	}
	*ret_count = item_bytes == 0 ? 0 : len / item_bytes;
	return bytes;
}

static void show_items(const struct parameter *p, const uint8_t *bytes, size_t count)
{
	int column = printf("%-*s", LABEL_COLUMNS, "value");
	char text[SOE_ITEM_BYTES];

	for (size_t i = 0; i < count; i++) {
		soe_item_format(p->attribute, bytes + i * soe_value_bytes(p->attribute), text);
		if (i > 0 && column + 1 + (int)strlen(text) > COLUMNS) {
			column = printf("\n%*s", LABEL_COLUMNS, "") - 1;
		} else if (i > 0) {
			column += printf(" ");
		}
		column += printf("%s", text);
	}
	putchar('\n');
}

static void show_limit(const char *label, const struct parameter *p, const struct element *limit)
{
	char text[SOE_ITEM_BYTES];

	if (limit->len > 0) {
		soe_item_format(p->attribute, limit->bytes, text);
		printf("%-*s%s\n", LABEL_COLUMNS, label, text);
	}
}

static void show_parameter(const struct mail *mail, const struct parameter *p)
{
	char idn[SOE_IDN_TEXT_BYTES];
	char text[TEXT_CAPACITY];
	size_t count;
	const uint8_t *items = items_of(p, &count);

	soe_idn_format(mail->request.index, idn);
	printf("%-*s%.*s\n", LABEL_COLUMNS, idn, COLUMNS - LABEL_COLUMNS,
	       text_plain(p->name, text, sizeof(text)));
	soe_attribute_format(p->attribute, text, sizeof(text));
	printf("%-*s0x%08x: %s\n", LABEL_COLUMNS, "attribute", p->attribute, text);
	if (p->has_unit) {
		printf("%-*s%.*s\n", LABEL_COLUMNS, "unit", COLUMNS - LABEL_COLUMNS,
		       text_plain(p->unit, text, sizeof(text)));
	}
	show_limit("minimum", p, &p->min);
	show_limit("maximum", p, &p->max);
	if (soe_is_text(p->attribute)) {
		printf("%-*s", LABEL_COLUMNS, "value");
		for (size_t i = 0; i < count; i++) {
			putchar(items[i] < 0x20 || items[i] > 0x7e ? '?' : items[i]);
		}
		putchar('\n');
	} else {
		show_items(p, items, count);
	}
}

static void write_keys(struct json *js, const struct mail *mail)
{
	char idn[SOE_IDN_TEXT_BYTES];

	soe_idn_format(mail->request.index, idn);
	json_u64(js, "slave", mail->request.slave_pos);
	json_u64(js, "drive", mail->request.subindex);
	json_text(js, "idn", idn);
	json_u64(js, "number", mail->request.index);
}

static void write_limit(struct json *js, const char *key, const struct parameter *p,
			const struct element *limit)
{
	if (limit->len > 0) {
		soe_item_json(js, key, p->attribute, limit->bytes);
	} else {
		json_null(js, key);
	}
}

static void write_value(struct json *js, const struct parameter *p)
{
	size_t count;
	const uint8_t *items = items_of(p, &count);
	char *text;

	if (soe_is_text(p->attribute)) {
		text = strndup((const char *)items, count);
		json_text(js, "value", text != NULL ? text : "");
		free(text);
		return;
	}
	if (!soe_is_list(p->attribute)) {
		if (count == 1) {
			soe_item_json(js, "value", p->attribute, items);
		} else {
			json_null(js, "value");
		}
		return;
	}
	json_array_begin(js, "value");
	for (size_t i = 0; i < count; i++) {
		soe_item_json(js, NULL, p->attribute, items + i * soe_value_bytes(p->attribute));
	}
	json_array_end(js);
}

static void write_parameter(const struct mail *mail, const struct parameter *p)
{
	struct json js;

	json_init(&js, stdout);
	json_object_begin(&js, NULL);
	write_keys(&js, mail);
	json_text(&js, "name", p->name);
	json_u64(&js, "attribute", p->attribute);
	if (p->has_unit) {
		json_text(&js, "unit", p->unit);
	} else {
		json_null(&js, "unit");
	}
	write_limit(&js, "minimum", p, &p->min);
	write_limit(&js, "maximum", p, &p->max);
	write_value(&js, p);
	json_object_end(&js);
	json_end_line(&js);
}

/* --- the verb --- */

static enum exit_code take_idn(struct mail *mail, char **operands, int count)
{
	if (count > 2 && soe_idn_parse(operands[2], &mail->request.index) < 0) {
		return cli_fail(mail->cli, EXIT_CODE_USAGE,
				"%s: expected an IDN such as S-0-0017, P-0-0001 or 17",
				operands[2]);
	}
	return source_slave_pos(mail->cli, operands[1], &mail->request.slave_pos);
}

static enum exit_code read_idn(struct mail *mail, char **operands, int count)
{
	struct parameter parameter = { .attribute = 0 };
	enum exit_code result = take_idn(mail, operands, count);

	result = result == EXIT_CODE_OK ? read_all(mail, &parameter) : result;
	if (result == EXIT_CODE_OK && mail->is_json) {
		write_parameter(mail, &parameter);
	} else if (result == EXIT_CODE_OK) {
		show_parameter(mail, &parameter);
	}
	release(&parameter);
	return result;
}

static enum exit_code write_idn(struct mail *mail, char **operands, int count)
{
	size_t capacity = SOE_LIST_HEADER_BYTES + 8 * (strlen(operands[3]) + 1);
	uint32_t attribute = 0;
	enum exit_code result = take_idn(mail, operands, count);
	char expected[TEXT_CAPACITY];
	int len;

	result = result == EXIT_CODE_OK ? read_attribute(mail, &attribute) : result;
	if (result != EXIT_CODE_OK) {
		return result;
	}
	mail->data = malloc(capacity);
	if (mail->data == NULL) {
		return cli_fail(mail->cli, EXIT_CODE_FAILED, "out of memory");
	}
	len = soe_value_parse(attribute, operands[3], mail->data, capacity);
	if (len < 0) {
		soe_attribute_format(attribute, expected, sizeof(expected));
		return cli_fail(mail->cli, EXIT_CODE_USAGE, "%s: %s: expected %s", operands[3],
				len == -ERANGE ? "does not fit" : "is not a value", expected);
	}
	mail->transfer.data = mail->data;
	mail->transfer.data_len = (size_t)len;
	mail->request.argument[0] = SOE_ELEMENT_VALUE;
	return mail_ask(mail, ADMIN_SOE_WRITE);
}

static enum exit_code list_one(struct mail *mail)
{
	char name[TEXT_CAPACITY];
	char unit[TEXT_CAPACITY];
	char line[2 * TEXT_CAPACITY + 4];
	char plain[sizeof(line)];
	char idn[SOE_IDN_TEXT_BYTES];
	struct json js;
	int is_refused;
	enum exit_code result = read_text(mail, SOE_ELEMENT_NAME, name, &is_refused);

	if (result == EXIT_CODE_OK) {
		result = read_text(mail, SOE_ELEMENT_UNIT, unit, &is_refused);
	}
	if (result != EXIT_CODE_OK) {
		return result;
	}
	if (mail->is_json) {
		json_init(&js, stdout);
		json_object_begin(&js, NULL);
		write_keys(&js, mail);
		json_text(&js, "name", name);
		json_text(&js, "unit", unit);
		json_object_end(&js);
		json_end_line(&js);
		return EXIT_CODE_OK;
	}
	soe_idn_format(mail->request.index, idn);
	snprintf(line, sizeof(line), "%s%s%s%s", name, unit[0] != '\0' ? " (" : "", unit,
		 unit[0] != '\0' ? ")" : "");
	printf("%s  %.*s\n", idn, COLUMNS - LABEL_COLUMNS, text_plain(line, plain, sizeof(plain)));
	return EXIT_CODE_OK;
}

static enum exit_code list_idns(struct mail *mail, char **operands, int count)
{
	uint8_t *answer;
	const uint8_t *idns;
	size_t bytes;
	enum exit_code result;

	mail->request.index = IDN_ALL;
	result = take_idn(mail, operands, count);
	result = result == EXIT_CODE_OK ? ask_element(mail, SOE_ELEMENT_VALUE) : result;
	if (result != EXIT_CODE_OK) {
		return result;
	}
	answer = mail->transfer.answer;
	idns = soe_list_data(answer, mail->transfer.answer_len, &bytes);
	mail->transfer.answer = NULL;
	for (size_t i = 0; i + 1 < bytes && result == EXIT_CODE_OK; i += 2) {
		mail->request.index = get_le16(idns + i);
		result = list_one(mail);
	}
	free(answer);
	return result;
}

enum exit_code verb_soe(struct cli *cli, int argc, char **argv)
{
	static const struct mail_action actions[] = {
		{ "read", 3, 3, "read: expected SLAVE IDN", read_idn },
		{ "write", 4, 4, "write: expected SLAVE IDN VALUE", write_idn },
		{ "list", 2, 3, "list: expected SLAVE [IDN]", list_idns },
	};
	struct mail mail;
	struct args_integer drive = { .low = 0, .high = SOE_DRIVES - 1 };
	const struct args_option options[] = {
		{ "drive", 0, args_integer, &drive, "N", "drive of the slave, 0 to 7 (0)" },
		{ "json", 0, args_flag, &mail.is_json, NULL,
		  "the parameter as a JSON object; of a list one for each" },
	};
	struct args args = {
		.options = options, .option_count = 2, .operands_min = 2, .operands_max = 4
	};
	enum exit_code result;

	mail_init(&mail, cli);
	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	mail.request.subindex = (uint8_t)drive.value;
	return mail_run(&mail, actions, sizeof(actions) / sizeof(actions[0]), args.operands,
			args.operand_count);
}
