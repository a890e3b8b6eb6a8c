/* SPDX-License-Identifier: MIT */
/* ecdaq eni write, check, import */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/args.h"
#include "cli/cli.h"
#include "cli/eni_import.h"
#include "cli/eni_plan.h"
#include "cli/file.h"
#include "cli/text.h"
#include "eni/compare.h"
#include "program/json.h"

enum { ERROR_BYTES = 512 };

struct eni_verb {
	struct cli *cli;
	const char *path;   /* to write to; NULL: standard output */
	const char *source; /* to read */
	int is_json;
	int is_forced;
	struct json js;
	size_t different;
	size_t wrong_slaves; /* of them */
	size_t allowed;
};

static enum exit_code write_text(const struct eni_verb *v, const char *text, size_t len)
{
	if (v->path == NULL) {
		fwrite(text, 1, len, stdout);
		return EXIT_CODE_OK;
	}
	return v->is_forced ? file_write(v->cli, v->path, (const uint8_t *)text, len)
			    : file_write_new(v->cli, v->path, (const uint8_t *)text, len);
}

static enum exit_code read_source(const struct eni_verb *v, struct eni **ret_eni)
{
	char error[ERROR_BYTES];

	return eni_read_file(v->source, ret_eni, error, sizeof(error)) < 0
		       ? cli_fail(v->cli, EXIT_CODE_FAILED, "%s", error)
		       : EXIT_CODE_OK;
}

/* --- write --- */

static enum exit_code write_plan(struct eni_verb *v)
{
	struct eni *eni = NULL;
	enum exit_code result = eni_plan_read(v->cli, &eni);
	char *text = NULL;
	size_t len = 0;
	FILE *out;

	if (result != EXIT_CODE_OK) {
		return result;
	}
	out = open_memstream(&text, &len);
	if (out != NULL) {
		eni_write(out, eni);
	}
	if (out == NULL || fclose(out) != 0) {
		result = cli_fail(v->cli, EXIT_CODE_FAILED, "out of memory");
	} else {
		result = write_text(v, text, len);
	}
	free(text);
	eni_free(eni);
	return result;
}

/* --- check --- */

static void show_json(struct eni_verb *v, const struct eni_difference *d)
{
	json_object_begin(&v->js, NULL);
	if (d->slave == ENI_MASTER) {
		json_null(&v->js, "position");
	} else {
		json_u64(&v->js, "position", d->slave);
	}
	json_text(&v->js, "what", d->what);
	json_text(&v->js, "file", d->theirs);
	json_text(&v->js, "bus", d->ours);
	json_truth(&v->js, "allowed", d->weight == ENI_ALLOWED);
	json_object_end(&v->js);
}

static void show_difference(void *ctx, const struct eni_difference *d)
{
	struct eni_verb *v = ctx;
	char text[3][ENI_TEXT_BYTES];

	if (d->weight == ENI_ALLOWED) {
		v->allowed++;
	} else {
		v->different++;
		v->wrong_slaves += d->weight == ENI_WRONG_SLAVE;
	}
	if (v->is_json) {
		show_json(v, d);
		return;
	}
	if (d->slave == ENI_MASTER) {
		fputs("bus: ", stdout);
	} else {
		printf("slave %" PRIu32 ": ", d->slave);
	}
	printf("%s: file: %s, bus: %s%s\n", text_plain(d->what, text[0], sizeof(text[0])),
	       text_plain(d->theirs, text[1], sizeof(text[1])),
	       text_plain(d->ours, text[2], sizeof(text[2])),
	       d->weight == ENI_ALLOWED ? " (allowed)" : "");
}

static enum exit_code compare(struct eni_verb *v, const struct eni *theirs, const struct eni *ours)
{
	const struct eni_compare c = {
		.theirs = theirs, .ours = ours, .found = show_difference, .ctx = v
	};

	if (v->is_json) {
		json_array_begin(&v->js, NULL);
	}
	eni_compare_all(&c);
	if (v->is_json) {
		json_array_end(&v->js);
		json_end_line(&v->js);
	}
	if (v->different > 0) {
		return cli_fail(v->cli, v->wrong_slaves > 0 ? EXIT_CODE_SLAVES : EXIT_CODE_CONFIG,
				"%zu difference%s between %s and the bus", v->different,
				v->different == 1 ? "" : "s", v->source);
	}
	if (!v->is_json) {
		printf("%s and the bus agree, with %zu allowed difference%s\n", v->source,
		       v->allowed, v->allowed == 1 ? "" : "s");
	}
	return EXIT_CODE_OK;
}

static enum exit_code check(struct eni_verb *v)
{
	struct eni *theirs = NULL;
	struct eni *ours = NULL;
	enum exit_code result = read_source(v, &theirs);

	if (result == EXIT_CODE_OK) {
		result = eni_plan_read(v->cli, &ours);
	}
	if (result == EXIT_CODE_OK) {
		result = compare(v, theirs, ours);
	}
	eni_free(theirs);
	eni_free(ours);
	return result;
}

/* --- import --- */

static enum exit_code import(struct eni_verb *v)
{
	struct eni *eni = NULL;
	enum exit_code result = read_source(v, &eni);
	char *text = NULL;
	size_t len = 0;

	if (result == EXIT_CODE_OK) {
		result = eni_import(v->cli, v->source, eni, &text, &len);
	}
	if (result == EXIT_CODE_OK) {
		result = write_text(v, text, len);
	}
	free(text);
	eni_free(eni);
	return result;
}

/* --- all --- */

static enum exit_code run(struct eni_verb *v, const struct args *args)
{
	const char *word = args->operands[0];
	int is_write = strcmp(word, "write") == 0;
	int is_check = strcmp(word, "check") == 0;

	if (!is_write && !is_check && strcmp(word, "import") != 0) {
		return cli_fail(v->cli, EXIT_CODE_USAGE, "%s: expected write, check or import",
				word);
	}
	if (is_write != (args->operand_count == 1)) {
		return cli_fail(v->cli, EXIT_CODE_USAGE,
				is_write ? "%s: takes no file: --output" : "%s: expected a file",
				word);
	}
	if (is_check ? v->path != NULL : v->is_json) {
		return cli_fail(v->cli, EXIT_CODE_USAGE,
				is_check ? "--output is of write and import"
					 : "--json is of check");
	}
	if (v->is_forced && v->path == NULL) {
		return cli_fail(v->cli, EXIT_CODE_USAGE, "--force requires --output");
	}
	if (is_write) {
		return write_plan(v);
	}
	v->source = args->operands[1];
	return is_check ? check(v) : import(v);
}

enum exit_code verb_eni(struct cli *cli, int argc, char **argv)
{
	struct eni_verb v = { .cli = cli };
	const struct args_option options[] = {
		{ "output", 'o', args_text, &v.path, "FILE",
		  "write, import: write it to FILE, which must not exist" },
		{ "force", 0, args_flag, &v.is_forced, NULL, "replace FILE if it is there" },
		{ "json", 0, args_flag, &v.is_json, NULL, "check: a JSON array" },
	};
	struct args args = {
		.options = options, .option_count = 3, .operands_min = 1, .operands_max = 2
	};
	enum exit_code result;

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	json_init(&v.js, stdout);
	return run(&v, &args);
}
