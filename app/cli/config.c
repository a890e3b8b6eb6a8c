/* SPDX-License-Identifier: MIT */
/* ecdaq config show, check, diff, reload, schema */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "base/args.h"
#include "base/difference.h"
#include "cli/admin_client.h"
#include "cli/cli.h"
#include "cli/config_file.h"
#include "cli/config_reload.h"
#include "cli/schema.h"
#include "cli/text.h"
#include "config/effective.h"
#include "program/json.h"

enum { ERROR_BYTES = 512, COMMENT_COLUMN = 40 };

struct config_command {
	struct cli *cli;
	struct config_file file;
	struct args_list set;
	int is_json;
	struct json js;
	char place[96]; /* show: of the option before, "slaves[0]." */
	size_t problems;
};

static struct config_source source_of(const struct config_command *cmd)
{
	return (struct config_source){ .path = cmd->file.path,
				       .set = cmd->file.set.item,
				       .set_count = cmd->file.set.count };
}

/* --- show --- */

/* As YAML: plain where that is read back as the same text. Returns the columns. */
static int put_yaml(const char *value)
{
	static const char plain[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
				    "0123456789_./%+-:";
	size_t len = strlen(value);

	int is_number = value[0] == '-' && value[1] >= '0' && value[1] <= '9';

	if (len > 0 && strspn(value, plain) == len &&
	    (is_number || strchr("-:%", value[0]) == NULL) && value[len - 1] != ':' &&
	    strcasecmp(value, "null") != 0) {
		fputs(value, stdout);
		return (int)len;
	}
	json_put_text(stdout, value);
	return (int)len + 2;
}

/* The lines above the first option of a section or an item, and what is before its name. */
static const char *open_place(struct config_command *cmd, const char *place, size_t len)
{
	int is_same = strncmp(cmd->place, place, len) == 0 && cmd->place[len] == '\0';
	size_t word = strcspn(place, "[.");
	const char *inner = strstr(place, "]."); /* a list in an item: slaves[0].sdo[1]. */
	size_t inner_len = inner != NULL ? strcspn(inner + 2, "[.") : 0;
	int is_inner = inner != NULL && inner[2 + inner_len] == '[';

	if (!is_same) {
		snprintf(cmd->place, sizeof(cmd->place), "%.*s", (int)len, place);
		if (is_inner && strncmp(inner + 2 + inner_len, "[0]", 3) == 0) {
			printf("    %.*s:\n", (int)inner_len, inner + 2);
		} else if (!is_inner &&
			   (place[word] == '.' || strncmp(place + word, "[0]", 3) == 0)) {
			printf("\n%.*s:\n", (int)word, place);
		}
	}
	if (place[word] == '.') {
		return "  ";
	}
	if (is_inner) {
		return is_same ? "        " : "      - ";
	}
	return is_same ? "    " : "  - ";
}

static void show_text(struct config_command *cmd, const struct config_item *item)
{
	const char *name = strrchr(item->option, '.') + 1;
	const char *lead = open_place(cmd, item->option, (size_t)(name - item->option));
	size_t unit_len = strlen(item->unit);
	size_t len = strlen(item->value);
	int has_unit = len >= unit_len && strcmp(item->value + len - unit_len, item->unit) == 0;
	int column = printf("%s%s: ", lead, name);

	column += put_yaml(item->value);
	printf("%*s # ", column < COMMENT_COLUMN ? COMMENT_COLUMN - column : 0, "");
	if (!has_unit && strcmp(item->unit, "") != 0 &&
	    (item->value[0] == '-' || (item->value[0] >= '0' && item->value[0] <= '9')) &&
	    strpbrk(item->value, "nusmhdBkKMGT%") == NULL) {
		printf("%s; ", item->unit);
	}
	if (item->origin == CONFIG_ORIGIN_FILE) {
		printf("line %d", item->line);
	} else {
		fputs(config_origin_to_str(item->origin), stdout);
	}
	if (item->origin != CONFIG_ORIGIN_DEFAULT && item->default_value != NULL) {
		printf("; default %s",
		       item->default_value[0] == '\0' ? "empty" : item->default_value);
	}
	putchar('\n');
}

static void show_json(struct config_command *cmd, const struct config_item *item)
{
	struct json *js = &cmd->js;

	json_object_begin(js, NULL);
	json_text(js, "option", item->option);
	json_text(js, "value", item->value);
	json_text(js, "unit", item->unit);
	json_text(js, "origin", config_origin_to_str(item->origin));
	json_text(js, "takes_effect", config_effect_to_str((uint32_t)item->effect));
	if (item->origin == CONFIG_ORIGIN_FILE) {
		json_text(js, "file", cmd->file.name);
		json_i64(js, "line", item->line);
	} else {
		json_null(js, "file");
		json_null(js, "line");
	}
	if (item->default_value != NULL) {
		json_text(js, "default", item->default_value);
	} else {
		json_null(js, "default");
	}
	json_object_end(js);
	json_end_line(js);
}

static void show_item(void *ctx, const struct config_item *item)
{
	struct config_command *cmd = ctx;

	if (cmd->is_json) {
		show_json(cmd, item);
	} else {
		show_text(cmd, item);
	}
}

static enum exit_code show(struct config_command *cmd)
{
	const struct config_source source = source_of(cmd);
	char error[ERROR_BYTES] = "";

	if (!cmd->is_json) {
		printf("# %s\n", cmd->file.name);
	}
	return config_effective(&source, show_item, cmd, error, sizeof(error)) == 0
		       ? EXIT_CODE_OK
		       : cli_fail(cmd->cli, EXIT_CODE_CONFIG, "%s", error);
}

/* --- check --- */

/* "FILE:LINE: what": the line; 0: there is none. */
static long line_of(const struct config_command *cmd, const char *text, const char **ret_what)
{
	size_t len = cmd->file.path == NULL ? 0 : strlen(cmd->file.path);
	char *end;
	long line;

	*ret_what = text;
	if (len == 0 || strncmp(text, cmd->file.path, len) != 0 || text[len] != ':') {
		return 0;
	}
	line = strtol(text + len + 1, &end, 10);
	if (strncmp(end, ": ", 2) != 0) {
		return 0;
	}
	*ret_what = end + 2;
	return line;
}

static void show_problem(void *ctx, const char *text)
{
	struct config_command *cmd = ctx;
	struct json *js = &cmd->js;
	const char *what;
	long line = line_of(cmd, text, &what);

	cmd->problems++;
	if (!cmd->is_json) {
		puts(text);
		return;
	}
	json_object_begin(js, NULL);
	json_text(js, "file", cmd->file.name);
	if (line > 0) {
		json_i64(js, "line", line);
	} else {
		json_null(js, "line");
	}
	json_text(js, "problem", what);
	json_object_end(js);
	json_end_line(js);
}

static enum exit_code check(struct config_command *cmd)
{
	struct config_source source = source_of(cmd);
	struct config *cfg = malloc(sizeof(*cfg));
	char error[ERROR_BYTES] = "";
	int r;

	if (cfg == NULL) {
		return cli_fail(cmd->cli, EXIT_CODE_FAILED, "out of memory");
	}
	source.problem = show_problem;
	source.ctx = cmd;
	r = config_assemble_from(&source, cfg, error, sizeof(error));
	free(cfg);
	if (r < 0 && cmd->problems == 0) {
		return cli_fail(cmd->cli, EXIT_CODE_CONFIG, "%s", error);
	}
	if (r < 0) {
		return cli_fail(cmd->cli, EXIT_CODE_CONFIG, "%s: %zu problem%s", cmd->file.name,
				cmd->problems, cmd->problems == 1 ? "" : "s");
	}
	if (!cmd->is_json) {
		printf("%s: valid\n", cmd->file.name);
	}
	return EXIT_CODE_OK;
}

/* --- diff --- */

static const char *kind_of(const struct difference *diff)
{
	switch ((enum difference_kind)diff->kind) {
	case DIFFERENCE_MISSING:
		return "missing";
	case DIFFERENCE_OPTIONAL:
		return "absent, optional";
	case DIFFERENCE_UNEXPECTED:
		return "not configured";
	case DIFFERENCE_IDENTITY:
		return diff->property;
	case DIFFERENCE_PLACE:
		return "wrong place";
	case DIFFERENCE_LOST:
		return "lost";
	case DIFFERENCE_CHANNEL:
		return "no such output";
	case DIFFERENCE_UNCHECKED:
		return "not compared";
	case DIFFERENCE_NO_CHANNEL:
		return "no such channel";
	case DIFFERENCE_PDOS:
		return "other PDOs assigned";
	}
	return "?";
}

/* "slave 1 rear", "position 2 EL2828", "output rear.led" */
static void subject_of(const struct difference *diff, char *buf, size_t bytes)
{
	char name[LIMIT_NAME_BYTES];
	const char *blank = diff->name[0] != '\0' ? " " : "";

	text_plain(diff->name, name, sizeof(name));
	if (diff->kind == DIFFERENCE_CHANNEL) {
		snprintf(buf, bytes, "output %s", name);
	} else if (diff->kind == DIFFERENCE_UNCHECKED) {
		snprintf(buf, bytes, "%s", name);
	} else if (diff->item != DIFFERENCE_NOWHERE) {
		snprintf(buf, bytes, "slave %u%s%s", diff->item, blank, name);
	} else if (diff->position != DIFFERENCE_NOWHERE) {
		snprintf(buf, bytes, "position %u%s%s", diff->position, blank, name);
	} else {
		snprintf(buf, bytes, "new device");
	}
}

static void show_difference(const struct difference *diff, const char *path)
{
	char subject[LIMIT_NAME_BYTES + 32];
	char found[sizeof(diff->found)];
	char group[sizeof(diff->group)];

	subject_of(diff, subject, sizeof(subject));
	text_plain(diff->found, found, sizeof(found));
	if (path[0] != '\0' && diff->line > 0) {
		printf("%s:%u: ", path, diff->line);
	}
	printf("%s", subject);
	if (diff->group[0] != '\0') {
		printf(" (group %s)", text_plain(diff->group, group, sizeof(group)));
	}
	printf(": %s", kind_of(diff));
	if (diff->kind == DIFFERENCE_PLACE) {
		printf(": expected behind slave %d, found at position %u", diff->item - 1,
		       diff->position);
	} else if (diff->expected[0] != '\0') {
		printf(": expected %s", diff->expected);
	}
	if (found[0] != '\0') {
		printf("%s %s", diff->expected[0] != '\0' ? ", found" : ":", found);
	}
	if (diff->kind == DIFFERENCE_IDENTITY || diff->kind == DIFFERENCE_LOST) {
		printf(" (position %u)", diff->position);
	}
	putchar('\n');
}

static void put_place(struct json *js, const char *key, uint16_t place)
{
	if (place == DIFFERENCE_NOWHERE) {
		json_null(js, key);
	} else {
		json_u64(js, key, place);
	}
}

static void put_text(struct json *js, const char *key, const char *text)
{
	if (text[0] == '\0') {
		json_null(js, key);
	} else {
		json_text(js, key, text);
	}
}

static void diff_json(struct json *js, const struct difference *diff, const char *path)
{
	static const char *const kinds[] = {
		[DIFFERENCE_MISSING] = "missing",       [DIFFERENCE_OPTIONAL] = "optional",
		[DIFFERENCE_UNEXPECTED] = "unexpected", [DIFFERENCE_IDENTITY] = "identity",
		[DIFFERENCE_PLACE] = "place",           [DIFFERENCE_LOST] = "lost",
		[DIFFERENCE_CHANNEL] = "output",        [DIFFERENCE_UNCHECKED] = "unchecked",
		[DIFFERENCE_NO_CHANNEL] = "channel",    [DIFFERENCE_PDOS] = "pdos",
	};

	json_object_begin(js, NULL);
	json_text(js, "kind",
		  diff->kind <= DIFFERENCE_PDOS && diff->kind > 0 ? kinds[diff->kind] : "unknown");
	json_truth(js, "note", difference_is_note(diff));
	put_text(js, "name", diff->name);
	put_text(js, "group", diff->group);
	put_place(js, "item", diff->item);
	put_place(js, "position", diff->position);
	put_text(js, "property", diff->property);
	put_text(js, "expected", diff->expected);
	put_text(js, "found", diff->found);
	put_text(js, "file", path);
	if (diff->line > 0) {
		json_u64(js, "line", diff->line);
	} else {
		json_null(js, "line");
	}
	json_object_end(js);
}

/* Slaves before outputs: what is missing on the bus may be why there is no channel. */
static enum exit_code judge(const struct config_command *cmd, const struct difference *diff,
			    size_t count)
{
	enum exit_code code = EXIT_CODE_CONFIG;
	size_t real = 0;

	for (size_t i = 0; i < count; i++) {
		real += !difference_is_note(&diff[i]);
		if (!difference_is_note(&diff[i]) && diff[i].kind != DIFFERENCE_CHANNEL &&
		    diff[i].kind != DIFFERENCE_NO_CHANNEL) {
			code = EXIT_CODE_SLAVES;
		}
	}
	if (real > 0) {
		return cli_fail(cmd->cli, code, "%zu difference%s between configuration and bus",
				real, real == 1 ? "" : "s");
	}
	if (!cmd->is_json) {
		puts("configuration and bus agree");
	}
	return EXIT_CODE_OK;
}

static void terminate(struct difference *diff)
{
	diff->name[sizeof(diff->name) - 1] = '\0';
	diff->property[sizeof(diff->property) - 1] = '\0';
	diff->group[sizeof(diff->group) - 1] = '\0';
	diff->expected[sizeof(diff->expected) - 1] = '\0';
	diff->found[sizeof(diff->found) - 1] = '\0';
}

static enum exit_code show_all(struct config_command *cmd, const struct admin_transfer *tr)
{
	size_t count = tr->answer_len / sizeof(struct difference);
	struct difference *diff = calloc(count + 1, sizeof(*diff));
	char path[ADMIN_TEXT_BYTES];
	enum exit_code result;

	if (diff == NULL) {
		return cli_fail(cmd->cli, EXIT_CODE_FAILED, "out of memory");
	}
	snprintf(path, sizeof(path), "%.*s", (int)sizeof(tr->reply.text) - 1, tr->reply.text);
	if (count > 0) {
		memcpy(diff, tr->answer, count * sizeof(*diff));
	}
	if (cmd->is_json) {
		json_array_begin(&cmd->js, NULL);
	}
	for (size_t i = 0; i < count; i++) {
		terminate(&diff[i]);
		if (cmd->is_json) {
			diff_json(&cmd->js, &diff[i], path);
		} else {
			show_difference(&diff[i], path);
		}
	}
	if (cmd->is_json) {
		json_array_end(&cmd->js);
		json_end_line(&cmd->js);
	}
	result = judge(cmd, diff, count);
	free(diff);
	return result;
}

static enum exit_code compare(struct config_command *cmd)
{
	struct admin_request rq = { .verb = ADMIN_COMPARE };
	struct admin_transfer tr = { .request = &rq };
	enum exit_code result = admin_transfer_do(cmd->cli, &tr);

	if (result == EXIT_CODE_OK && tr.answer_len % sizeof(struct difference) != 0) {
		result = cli_fail(cmd->cli, EXIT_CODE_FAILED,
				  "ecdaqd: a list of differences of %zu bytes", tr.answer_len);
	}
	if (result == EXIT_CODE_OK) {
		result = show_all(cmd, &tr);
	}
	admin_transfer_done(&tr);
	return result;
}

/* --- all --- */

static enum exit_code write_schema(struct config_command *cmd)
{
	json_init(&cmd->js, stdout);
	schema_write(&cmd->js);
	return EXIT_CODE_OK;
}

static enum exit_code run(struct config_command *cmd, const struct args *args)
{
	const char *word = args->operands[0];
	int is_show = strcmp(word, "show") == 0;
	int is_diff = strcmp(word, "diff") == 0;
	int is_reload = strcmp(word, "reload") == 0;
	enum exit_code result;

	if (is_diff || is_reload || strcmp(word, "schema") == 0) {
		if (args->operand_count > 1 || cmd->set.count > 0) {
			return cli_fail(
				cmd->cli, EXIT_CODE_USAGE, "%s: takes no file and no --set%s", word,
				is_diff || is_reload ? ": it uses what ecdaqd was started with"
						     : "");
		}
		if (is_reload) {
			return config_reload(cmd->cli, cmd->is_json ? &cmd->js : NULL);
		}
		return is_diff ? compare(cmd) : write_schema(cmd);
	}
	if (!is_show && strcmp(word, "check") != 0) {
		return cli_fail(cmd->cli, EXIT_CODE_USAGE,
				"%s: expected show, check, diff, reload or schema", word);
	}
	result = config_file_find(cmd->cli, args->operand_count > 1 ? args->operands[1] : NULL,
				  &cmd->set, &cmd->file);
	if (result != EXIT_CODE_OK) {
		return result;
	}
	return is_show ? show(cmd) : check(cmd);
}

enum exit_code verb_config(struct cli *cli, int argc, char **argv)
{
	static struct config_command cmd; /* large */
	const struct args_option options[] = {
		{ "set", 0, args_list, &cmd.set, "OPTION=VALUE",
		  "show, check: set one option over the file; may be repeated" },
		{ "json", 0, args_flag, &cmd.is_json, NULL,
		  "show, check: a JSON object per line; diff, reload: an array" },
	};
	struct args args = {
		.options = options, .option_count = 2, .operands_min = 1, .operands_max = 2
	};
	enum exit_code result;

	cmd.cli = cli;
	json_init(&cmd.js, stdout);
	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	return run(&cmd, &args);
}
