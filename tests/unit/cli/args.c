/* SPDX-License-Identifier: MIT */
#include "cli/args.h"

#include <limits.h>

#include "harness/test.h"

static struct {
	int flag;
	const char *text;
	uint64_t count;
	double number;
	int64_t duration_ns;
	int64_t dc_ns;
} got;

static const struct args_option options[] = {
	{ "flag", 'f', ARGS_FLAG, &got.flag, NULL, "" },
	{ "text", 't', ARGS_TEXT, &got.text, "T", "" },
	{ "count", 0, ARGS_COUNT, &got.count, "N", "" },
	{ "number", 0, ARGS_NUMBER, &got.number, "X", "" },
	{ "in", 0, ARGS_DURATION, &got.duration_ns, "T", "" },
	{ "at", 0, ARGS_DC_TIME, &got.dc_ns, "NS", "" },
};

static const struct verb verb = { "verb", "WORD...", "", NULL, NULL };
static struct cli cli;
static struct args args;

static enum args_result parse(const char *const *line, enum exit_code *ret_exit)
{
	static char words[16][64];
	static char *argv[16];
	int argc = 0;

	for (; line[argc] != NULL; argc++) {
		CHECK(argc < 16);
		snprintf(words[argc], sizeof(words[argc]), "%s", line[argc]);
		argv[argc] = words[argc];
	}
	memset(&got, 0, sizeof(got));
	cli = (struct cli){ .verb = &verb };
	args = (struct args){
		.options = options, .option_count = 6, .operands_min = 1, .operands_max = 2
	};
	return args_parse(&cli, &args, argc, argv, ret_exit);
}

#define PARSE(...) parse((const char *[]){ __VA_ARGS__, NULL }, &result)

TEST(args, options_and_operands_may_stand_in_any_order)
{
	enum exit_code result;

	CHECK_EQ(PARSE("a", "--flag", "--text=x=y", "b", "--count", "7"), ARGS_GO);
	CHECK_EQ(got.flag, 1);
	CHECK_STR(got.text, "x=y");
	CHECK_EQ(got.count, 7);
	CHECK_EQ(args.operand_count, 2);
	CHECK_STR(args.operands[0], "a");
	CHECK_STR(args.operands[1], "b");
}

TEST(args, short_options_take_the_next_word)
{
	enum exit_code result;

	CHECK_EQ(PARSE("-f", "-t", "x", "a"), ARGS_GO);
	CHECK_EQ(got.flag, 1);
	CHECK_STR(got.text, "x");
}

TEST(args, values_carry_units_where_they_are_durations)
{
	enum exit_code result;

	CHECK_EQ(PARSE("a", "--in", "1.5ms", "--number", "2.5", "--at", "-3"), ARGS_GO);
	CHECK_EQ(got.duration_ns, 1500000);
	CHECK(got.number == 2.5);
	CHECK_EQ(got.dc_ns, -3);
	CHECK_EQ(PARSE("a", "--in", "2"), ARGS_GO);
	CHECK_EQ(got.duration_ns, INT64_C(2000000000));
}

TEST(args, global_options_are_taken_behind_the_verb_too)
{
	enum exit_code result;

	CHECK_EQ(PARSE("--run-dir", "/r", "a", "--config=/c"), ARGS_GO);
	CHECK_STR(cli.run_dir, "/r");
	CHECK_STR(cli.config, "/c");
}

TEST(args, negative_values_and_words_behind_two_dashes_are_operands)
{
	enum exit_code result;

	CHECK_EQ(PARSE("-5", "-.5"), ARGS_GO);
	CHECK_EQ(args.operand_count, 2);
	CHECK_EQ(PARSE("--", "--flag", "-x"), ARGS_GO);
	CHECK_STR(args.operands[0], "--flag");
	CHECK_EQ(got.flag, 0);
}

static void fails(const char *const *line)
{
	enum exit_code result = EXIT_CODE_OK;

	CHECK_EQ(parse(line, &result), ARGS_DONE);
	CHECK_EQ(result, EXIT_CODE_USAGE);
}

#define FAILS(...) fails((const char *[]){ __VA_ARGS__, NULL })

TEST(args, mistakes_are_refused)
{
	FAILS("a", "--flags");
	FAILS("a", "--fla");
	FAILS("a", "--flag=1");
	FAILS("a", "-x");
	FAILS("a", "--text");
	FAILS("a", "--run-dir");
	FAILS("a", "--count", "0");
	FAILS("a", "--count", "-1");
	FAILS("a", "--count", "1x");
	FAILS("a", "--count", "99999999999999999999");
	FAILS("a", "--number", "nan");
	FAILS("a", "--number", "inf");
	FAILS("a", "--number", "0");
	FAILS("a", "--in", "0s");
	FAILS("a", "--in", "-1s");
	FAILS("a", "--in", "1parsec");
	FAILS("a", "--at", "soon");
	FAILS("a", "--at", "99999999999999999999");
	FAILS("--flag");
	FAILS("a", "b", "c");
}
