/* SPDX-License-Identifier: MIT */
/* ecdaq sdo startup */
#include "cli/startup_list.h"

#include <stdio.h>
#include <string.h>

#include "cli/hex.h"
#include "config/config.h"

enum { SHOWN_BYTES = 16 };

enum exit_code startup_list_read(struct cli *cli, uint16_t pos, struct startup_list *ret_list)
{
	*ret_list = (struct startup_list){
		.request = { .verb = ADMIN_STARTUP, .slave_pos = pos },
	};
	ret_list->transfer.request = &ret_list->request;
	return admin_transfer_do(cli, &ret_list->transfer);
}

int startup_list_next(struct startup_list *list, struct startup_record *ret_record,
		      const uint8_t **ret_data)
{
	size_t left = list->transfer.answer_len - list->next;

	if (left < sizeof(*ret_record)) {
		return 0;
	}
	memcpy(ret_record, list->transfer.answer + list->next, sizeof(*ret_record));
	if (startup_record_bytes(ret_record->len) > left ||
	    ret_record->transition >= CONFIG_TRANSITIONS) {
		return 0;
	}
	*ret_data = list->transfer.answer + list->next + sizeof(*ret_record);
	list->next += startup_record_bytes(ret_record->len);
	return 1;
}

void startup_list_done(struct startup_list *list)
{
	admin_transfer_done(&list->transfer);
}

const char *startup_origin_to_str(uint8_t origin)
{
	switch ((enum startup_origin)origin) {
	case STARTUP_OF_MODE:
		return "slaves[].mode";
	case STARTUP_OF_ESI:
		return "ESI";
	case STARTUP_OF_PDOS:
		return "slaves[].pdos";
	case STARTUP_OF_CONFIG:
		return "slaves[].sdo";
	}
	return "?";
}

/* "slaves[].sdo, /etc/ecdaq/ecdaq.yaml:12", "ESI" */
static void format_origin(const struct startup_list *list, const struct startup_record *record,
			  char *buf, size_t buf_len)
{
	const char *origin = startup_origin_to_str(record->origin);

	if (record->line == 0) {
		snprintf(buf, buf_len, "%s", origin);
	} else {
		snprintf(buf, buf_len, "%s, %s:%u", origin, list->transfer.reply.text,
			 record->line);
	}
}

static const char *transition_to_str(const struct startup_record *record)
{
	return config_transition_to_str((enum config_transition)record->transition);
}

static void show_text(const struct startup_list *list, const struct startup_record *record,
		      const uint8_t *data)
{
	char hex[3 * SHOWN_BYTES + 1];
	char origin[ADMIN_TEXT_BYTES + 32];
	size_t len = record->len < SHOWN_BYTES ? record->len : SHOWN_BYTES;

	hex_format(data, len, hex, sizeof(hex));
	format_origin(list, record, origin, sizeof(origin));
	printf("%s  0x%04x:%02x%s  %s%s  %s\n", transition_to_str(record), record->index,
	       record->subindex, record->is_complete ? " complete" : "", hex,
	       record->len > len ? " ..." : "", origin);
}

static void show_json(const struct startup_list *list, const struct startup_record *record,
		      const uint8_t *data, struct json *js)
{
	static char hex[3 * UINT16_MAX + 1];

	hex_format(data, record->len, hex, sizeof(hex));
	json_object_begin(js, NULL);
	json_text(js, "transition", transition_to_str(record));
	json_u64(js, "index", record->index);
	json_u64(js, "subindex", record->subindex);
	json_truth(js, "complete", record->is_complete);
	json_text(js, "bytes", hex);
	json_text(js, "origin", startup_origin_to_str(record->origin));
	if (record->line == 0) {
		json_null(js, "file");
		json_null(js, "line");
	} else {
		json_text(js, "file", list->transfer.reply.text);
		json_u64(js, "line", record->line);
	}
	json_object_end(js);
}

enum exit_code startup_list_show(struct cli *cli, uint16_t pos, struct json *js)
{
	struct startup_list list;
	struct startup_record record;
	const uint8_t *data;
	enum exit_code result = startup_list_read(cli, pos, &list);

	if (result == EXIT_CODE_OK && js != NULL) {
		json_init(js, stdout);
		json_array_begin(js, NULL);
	}
	while (result == EXIT_CODE_OK && startup_list_next(&list, &record, &data)) {
		if (js != NULL) {
			show_json(&list, &record, data, js);
		} else {
			show_text(&list, &record, data);
		}
	}
	if (result == EXIT_CODE_OK && js != NULL) {
		json_array_end(js);
		json_end_line(js);
	}
	if (result == EXIT_CODE_OK && list.next != list.transfer.answer_len) {
		result = cli_fail(cli, EXIT_CODE_FAILED, "the answer of ecdaqd is not whole");
	}
	startup_list_done(&list);
	return result;
}
