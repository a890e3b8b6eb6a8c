/* SPDX-License-Identifier: MIT */
#include "cli/config_reload.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "base/config_change.h"
#include "cli/admin_client.h"
#include "cli/text.h"

enum { LINE_BYTES = 2 * CONFIG_CHANGE_VALUE_BYTES + 160 };

static void terminate(struct config_change *change)
{
	change->option[sizeof(change->option) - 1] = '\0';
	change->old_value[sizeof(change->old_value) - 1] = '\0';
	change->new_value[sizeof(change->new_value) - 1] = '\0';
}

static void show_json(struct json *js, const struct config_change *change)
{
	json_object_begin(js, NULL);
	json_text(js, "option", change->option);
	json_text(js, "old", change->old_value);
	json_text(js, "new", change->new_value);
	json_truth(js, "in_effect", change->effect == CONFIG_EFFECT_NOW);
	if (change->effect == CONFIG_EFFECT_NOW) {
		json_null(js, "needs");
	} else {
		json_text(js, "needs", config_effect_to_str(change->effect));
	}
	json_object_end(js);
}

static void show(struct json *js, const struct config_change *change)
{
	char line[LINE_BYTES];
	char plain[LINE_BYTES];

	if (js != NULL) {
		show_json(js, change);
		return;
	}
	config_change_format(change, line, sizeof(line));
	text_plain(line, plain, sizeof(plain));
	puts(plain);
}

static void show_all(struct json *js, const struct admin_transfer *tr)
{
	size_t count = tr->answer_len / sizeof(struct config_change);
	struct config_change change;

	if (js != NULL) {
		json_array_begin(js, NULL);
	}
	for (size_t i = 0; i < count; i++) {
		memcpy(&change, tr->answer + i * sizeof(change), sizeof(change));
		terminate(&change);
		show(js, &change);
	}
	if (js != NULL) {
		json_array_end(js);
		json_end_line(js);
	} else if (count == 0) {
		printf("%s: no option has another value\n",
		       tr->reply.text[0] != '\0' ? tr->reply.text : "configuration");
	}
}

/* A file with an error is that, and no refusal. */
static enum exit_code judge(const struct cli *cli, const struct admin_reply *reply)
{
	if (reply->result >= 0 || reply->result == -EBUSY || reply->result == -EOPNOTSUPP ||
	    reply->result == -ENOMEM) {
		return admin_judge(cli, reply);
	}
	return cli_fail(cli, EXIT_CODE_CONFIG, "%s (the running configuration stays)",
			reply->text[0] != '\0' ? reply->text : strerror(-reply->result));
}

enum exit_code config_reload(struct cli *cli, struct json *js)
{
	struct admin_request rq = { .verb = ADMIN_CONFIG_RELOAD };
	struct admin_transfer tr = { .request = &rq };
	enum exit_code result = admin_transfer(cli, &tr);

	if (result == EXIT_CODE_OK) {
		result = judge(cli, &tr.reply);
	}
	if (result == EXIT_CODE_OK && tr.answer_len % sizeof(struct config_change) != 0) {
		result = cli_fail(cli, EXIT_CODE_FAILED, "ecdaqd: a list of changes of %zu bytes",
				  tr.answer_len);
	}
	if (result == EXIT_CODE_OK) {
		show_all(js, &tr);
	}
	admin_transfer_done(&tr);
	return result;
}
