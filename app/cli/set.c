/* SPDX-License-Identifier: MIT */
/* ecdaq set */
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/args.h"
#include "cli/admin_client.h"
#include "cli/choose.h"
#include "cli/cli.h"
#include "cli/source.h"
#include "image/image.h"
#include "program/json.h"

struct setting {
	struct cli *cli;
	struct samples samples;
	struct admin_request request;
	int is_raw;
	int is_json;
};

static int parse_physical(const struct channel *ch, const char *text, uint64_t *ret_raw)
{
	char *end;
	double value = strtod(text, &end);

	if (end == text || *end != '\0') {
		return -EINVAL;
	}
	return image_physical_to_raw(ch, value, ret_raw);
}

/* "piccolo0.led=1" into @item. */
static enum exit_code take_word(struct setting *setting, const char *word, struct admin_item *item)
{
	const struct cli *cli = setting->cli;
	const char *equals = strchr(word, '=');
	const struct channel *ch;
	char name[LIMIT_NAME_BYTES];
	char type[16];
	int index;
	int r;

	if (equals == NULL || equals == word || equals[1] == '\0' ||
	    equals - word >= (ptrdiff_t)sizeof(name)) {
		return cli_fail(cli, EXIT_CODE_USAGE, "%s: expected OUTPUT=VALUE", word);
	}
	snprintf(name, sizeof(name), "%.*s", (int)(equals - word), word);
	index = image_channel_find(setting->samples.channels, setting->samples.meta->channel_count,
				   name);
	if (index < 0) {
		return choose_fail(cli, &setting->samples, name);
	}
	ch = &setting->samples.channels[index];
	if (ch->direction != CHANNEL_OUTPUT) {
		return cli_fail(cli, EXIT_CODE_FAILED, "%s: is an input", name);
	}
	r = image_is_scaled(ch) && !setting->is_raw ? parse_physical(ch, equals + 1, &item->raw)
						    : image_raw_parse(ch, equals + 1, &item->raw);
	if (r < 0) {
		image_type_format(ch, type, sizeof(type));
		return cli_fail(cli, EXIT_CODE_FAILED, "%s: %s %s %s", name, equals + 1,
				r == -ERANGE ? "does not fit into" : "is not a value of type",
				type);
	}
	memcpy(item->channel, ch->name, sizeof(item->channel));
	return EXIT_CODE_OK;
}

static void print_text(const struct setting *setting, uint64_t cycle)
{
	for (uint32_t i = 0; i < setting->request.count; i++) {
		const struct admin_item *item = &setting->request.item[i];
		int index = image_channel_find(setting->samples.channels,
					       setting->samples.meta->channel_count, item->channel);
		char value[32];

		image_raw_format(&setting->samples.channels[index], item->raw, value,
				 sizeof(value));
		printf("%s = %s from cycle %" PRIu64 " on\n", item->channel, value, cycle);
	}
}

static void print_json(const struct setting *setting, uint64_t cycle)
{
	struct json js;

	json_init(&js, stdout);
	json_object_begin(&js, NULL);
	json_u64(&js, "cycle", cycle);
	json_object_begin(&js, "raw");
	for (uint32_t i = 0; i < setting->request.count; i++) {
		json_u64(&js, setting->request.item[i].channel, setting->request.item[i].raw);
	}
	json_object_end(&js);
	json_object_end(&js);
	json_end_line(&js);
}

static enum exit_code run(struct setting *setting, const struct args *args)
{
	struct admin_reply reply;
	enum exit_code result;

	if (args->operand_count > ADMIN_ITEMS) {
		return cli_fail(setting->cli, EXIT_CODE_USAGE,
				"%d outputs: one command sets up to %d, all in the same cycle; "
				"use several commands, each takes effect in a cycle of its own",
				args->operand_count, ADMIN_ITEMS);
	}
	for (int i = 0; i < args->operand_count; i++) {
		result = take_word(setting, args->operands[i], &setting->request.item[i]);
		if (result != EXIT_CODE_OK) {
			return result;
		}
	}
	setting->request.count = (uint32_t)args->operand_count;
	result = admin_do(setting->cli, &setting->request, &reply);
	if (result != EXIT_CODE_OK) {
		return result;
	}
	if (setting->is_json) {
		print_json(setting, reply.cycle);
	} else {
		print_text(setting, reply.cycle);
	}
	return EXIT_CODE_OK;
}

enum exit_code verb_set(struct cli *cli, int argc, char **argv)
{
	struct setting setting = { .cli = cli, .request = { .verb = ADMIN_SET } };
	const struct args_option options[] = {
		{ "raw", 0, args_flag, &setting.is_raw, NULL, "VALUE is in raw counts" },
		{ "json", 0, args_flag, &setting.is_json, NULL, "answer as a JSON object" },
	};
	struct args args = {
		.options = options, .option_count = 2, .operands_min = 1, .operands_max = 4096
	};
	enum exit_code result;

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	result = samples_open(cli, &setting.samples);
	if (result == EXIT_CODE_OK) {
		result = run(&setting, &args);
		samples_close(&setting.samples);
	}
	return result;
}
