/* SPDX-License-Identifier: MIT */
#include "cli/sdo_list.h"

#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "cli/coe_type.h"
#include "cli/text.h"
#include "program/json.h"

enum { LIST_ALL = 1, COLUMNS = 80 };

/* SDO abort: this subindex, or object, is not there. */
enum { ABORT_NO_OBJECT = 0x06020000, ABORT_NO_SUBINDEX = 0x06090011 };

static const char *code_to_str(uint8_t code)
{
	static const char *const texts[] = { [2] = "domain",   [5] = "type",  [6] = "struct",
					     [7] = "variable", [8] = "array", [9] = "record" };

	return code < sizeof(texts) / sizeof(texts[0]) && texts[code] != NULL ? texts[code] : "?";
}

/* "rrrw--": read, then write, each in PRE-OP, SAFE-OP and OP. */
static const char *access_to_str(uint16_t access, char buf[TEXT_BYTES])
{
	for (unsigned i = 0; i < 6; i++) {
		buf[i] = "rrrwww"[i];
		if ((access >> i & 1) == 0) {
			buf[i] = '-';
		}
	}
	buf[6] = '\0';
	return buf;
}

/* Behind the @used columns of a line, cut at its end. */
static void put_name(const char *name, int used)
{
	char plain[ADMIN_NAME_BYTES];

	if (name[0] != '\0') {
		printf("  %.*s", COLUMNS - used - 2, text_plain(name, plain, sizeof(plain)));
	}
	putchar('\n');
}

static void show_entry(const struct admin_sdo_entry *entry)
{
	char type[TEXT_BYTES];
	char access[TEXT_BYTES];

	put_name(entry->name, printf("  :%02x    %-13s %5u  %s", entry->subindex,
				     coe_type_to_str(entry->data_type, type), entry->bit_len,
				     access_to_str(entry->access, access)));
}

static void write_entry(struct json *js, const struct admin_sdo_entry *entry)
{
	char text[TEXT_BYTES];

	json_object_begin(js, NULL);
	json_u64(js, "subindex", entry->subindex);
	json_text(js, "name", entry->name);
	json_text(js, "type", coe_type_to_str(entry->data_type, text));
	json_u64(js, "bits", entry->bit_len);
	json_text(js, "access", access_to_str(entry->access, text));
	json_truth(js, "rxpdo", entry->access >> 6 & 1);
	json_truth(js, "txpdo", entry->access >> 7 & 1);
	json_object_end(js);
}

/* An answer of @bytes, its text terminated. */
static enum exit_code take(struct mail *mail, enum admin_verb verb, void *ret, size_t bytes,
			   int *ret_refused)
{
	enum exit_code result = mail_try(mail, verb, ret_refused);

	if (result != EXIT_CODE_OK || *ret_refused) {
		return result;
	}
	if (mail->transfer.answer_len != bytes) {
		return cli_fail(mail->cli, EXIT_CODE_FAILED, "ecdaqd: an answer of %zu bytes",
				mail->transfer.answer_len);
	}
	memcpy(ret, mail->transfer.answer, bytes);
	return EXIT_CODE_OK;
}

/* Arrays and records may have gaps. */
static enum exit_code list_entries(struct mail *mail, const struct sdo_part *part, unsigned last,
				   struct json *js)
{
	enum exit_code result = EXIT_CODE_OK;

	if (part->count > 0 && part->count <= last && part->subindex + part->count - 1 < last) {
		last = part->subindex + (unsigned)part->count - 1;
	}
	for (unsigned sub = part->subindex; sub <= last && result == EXIT_CODE_OK; sub++) {
		struct admin_sdo_entry entry = { .index = 0 };
		int is_refused;

		mail->request.subindex = (uint8_t)sub;
		result = take(mail, ADMIN_SDO_ENTRY, &entry, sizeof(entry), &is_refused);
		if (is_refused) {
			uint32_t code = mail->transfer.reply.slave_code;

			if (code != ABORT_NO_SUBINDEX && code != ABORT_NO_OBJECT) {
				return admin_judge(mail->cli, &mail->transfer.reply);
			}
		} else if (result == EXIT_CODE_OK) {
			entry.name[sizeof(entry.name) - 1] = '\0';
			if (mail->is_json) {
				write_entry(js, &entry);
			} else {
				show_entry(&entry);
			}
		}
	}
	return result;
}

static enum exit_code list_object(struct mail *mail, const struct sdo_part *part, uint16_t index)
{
	struct admin_sdo_object object = { .index = 0 };
	struct json js;
	int is_refused;
	enum exit_code result;

	mail->request.index = index;
	mail->request.subindex = 0;
	result = take(mail, ADMIN_SDO_OBJECT, &object, sizeof(object), &is_refused);
	if (is_refused) {
		return admin_judge(mail->cli, &mail->transfer.reply);
	}
	if (result != EXIT_CODE_OK) {
		return result;
	}
	object.name[sizeof(object.name) - 1] = '\0';
	json_init(&js, stdout);
	if (!mail->is_json) {
		put_name(object.name,
			 printf("0x%04x %s", object.index, code_to_str(object.object_code)));
		return list_entries(mail, part, object.subindex_max, &js);
	}
	json_object_begin(&js, NULL);
	json_u64(&js, "slave", mail->request.slave_pos);
	json_u64(&js, "index", object.index);
	json_text(&js, "name", object.name);
	json_text(&js, "code", code_to_str(object.object_code));
	json_u64(&js, "last", object.subindex_max);
	json_array_begin(&js, "entry");
	result = list_entries(mail, part, object.subindex_max, &js);
	json_array_end(&js);
	json_object_end(&js);
	json_end_line(&js);
	return result;
}

static enum exit_code read_indices(struct mail *mail, uint16_t **ret_indices, size_t *ret_count)
{
	int is_refused;
	enum exit_code result;
	size_t count;

	mail->request.argument[0] = LIST_ALL;
	result = mail_try(mail, ADMIN_SDO_LIST, &is_refused);
	mail->request.argument[0] = 0;
	if (is_refused) {
		return cli_fail(mail->cli, EXIT_CODE_REFUSED,
				"refused: %s: the slave has no SDO information",
				mail->transfer.reply.text);
	}
	if (result != EXIT_CODE_OK) {
		return result;
	}
	count = mail->transfer.answer_len / 2;
	*ret_indices = calloc(count + 1, sizeof(**ret_indices));
	if (*ret_indices == NULL) {
		return cli_fail(mail->cli, EXIT_CODE_FAILED, "out of memory");
	}
	for (size_t i = 0; i < count; i++) {
		(*ret_indices)[i] = get_le16(mail->transfer.answer + 2 * i);
	}
	*ret_count = count;
	return EXIT_CODE_OK;
}

static int compare_indices(const void *a, const void *b)
{
	return *(const uint16_t *)a - *(const uint16_t *)b;
}

/* In ascending order, so that the part behind any index can be asked for. */
static void show_indices(const struct mail *mail, const struct sdo_part *part, uint16_t *indices,
			 size_t count)
{
	size_t at = 0;
	size_t end = count;
	struct json js;

	qsort(indices, count, sizeof(*indices), compare_indices);
	while (at < count && indices[at] < part->index) {
		at++;
	}
	if (part->count > 0 && part->count < count - at) {
		end = at + (size_t)part->count;
	}
	if (!mail->is_json) {
		for (; at < end; at++) {
			printf("0x%04x\n", indices[at]);
		}
		return;
	}
	json_init(&js, stdout);
	json_object_begin(&js, NULL);
	json_u64(&js, "slave", mail->request.slave_pos);
	json_array_begin(&js, "indices");
	for (; at < end; at++) {
		json_u64(&js, NULL, indices[at]);
	}
	json_array_end(&js);
	json_u64(&js, "left", count - end);
	json_object_end(&js);
	json_end_line(&js);
}

enum exit_code sdo_list(struct mail *mail, const struct sdo_part *part)
{
	uint16_t *indices = NULL;
	size_t count = 0;
	enum exit_code result;

	if (part->is_one) {
		return list_object(mail, part, part->index);
	}
	result = read_indices(mail, &indices, &count);
	if (indices == NULL) {
		return result;
	}
	if (part->is_indices) {
		show_indices(mail, part, indices, count);
		count = 0;
	}
	for (size_t i = 0; i < count && result == EXIT_CODE_OK; i++) {
		result = list_object(mail, part, indices[i]);
	}
	free(indices);
	return result;
}
