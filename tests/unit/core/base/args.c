/* SPDX-License-Identifier: MIT */
#include "base/args.h"

#include "harness/test.h"

static struct {
	int flag;
	const char *text;
	uint64_t count;
	double number;
	int64_t dc_ns;
	uint64_t cycle;
	struct args_integer level;
	const char *run_dir;
	struct args_list set;
} got;

static const struct args_option options[] = {
	{ "flag", 'f', args_flag, &got.flag, NULL, "" },
	{ "text", 't', args_text, &got.text, "T", "" },
	{ "count", 0, args_count, &got.count, "N", "" },
	{ "number", 0, args_number, &got.number, "X", "" },
	{ "at", 0, args_dc_time, &got.dc_ns, "NS", "" },
	{ "from", 0, args_cycle, &got.cycle, "CYCLE", "" },
	{ "level", 0, args_integer, &got.level, "N", "" },
	{ "set", 0, args_list, &got.set, "X=Y", "" },
};

static const struct args_option shared[] = {
	{ "run-dir", 0, args_text, &got.run_dir, "DIR", "" },
};

static struct args args;
static char error[ARGS_ERROR_BYTES];

static enum args_result parse(const char *const *line, int ends_at_operand)
{
	static char words[ARGS_LIST_LIMIT + 8][64];
	static char *argv[ARGS_LIST_LIMIT + 8];
	int argc = 0;

	for (; line[argc] != NULL; argc++) {
		CHECK(argc < ARGS_LIST_LIMIT + 8);
		snprintf(words[argc], sizeof(words[argc]), "%s", line[argc]);
		argv[argc] = words[argc];
	}
	memset(&got, 0, sizeof(got));
	got.level = (struct args_integer){ .low = -2, .high = 7 };
	args = (struct args){ .options = options,
			      .option_count = sizeof(options) / sizeof(options[0]),
			      .shared = shared,
			      .shared_count = 1,
			      .operands_min = 1,
			      .operands_max = 2,
			      .operands_usage = "WORD...",
			      .ends_at_operand = ends_at_operand };
	return args_parse(&args, argc, argv, error);
}

#define PARSE(...) parse((const char *[]){ __VA_ARGS__, NULL }, 0)

TEST(args, options_and_operands_come_in_any_order)
{
	CHECK_EQ(PARSE("a", "--flag", "--text=x=y", "b", "--count", "7"), ARGS_OK);
	CHECK_EQ(got.flag, 1);
	CHECK_STR(got.text, "x=y");
	CHECK_EQ(got.count, 7);
	CHECK_EQ(args.operand_count, 2);
	CHECK_STR(args.operands[0], "a");
	CHECK_STR(args.operands[1], "b");
}

TEST(args, short_options_take_the_next_word)
{
	CHECK_EQ(PARSE("-f", "-t", "x", "a"), ARGS_OK);
	CHECK_EQ(got.flag, 1);
	CHECK_STR(got.text, "x");
}

TEST(args, a_value_may_follow_its_letter_without_a_blank)
{
	CHECK_EQ(PARSE("-tx", "a"), ARGS_OK);
	CHECK_STR(got.text, "x");
	CHECK_EQ(PARSE("-fx", "a"), ARGS_ERROR); /* a flag has no value */
	CHECK_STR(error, "-fx: unknown option");
}

TEST(args, numbers_and_times_are_taken_whole)
{
	CHECK_EQ(PARSE("a", "--number", "2.5", "--at", "-3"), ARGS_OK);
	CHECK(got.number == 2.5);
	CHECK_EQ(got.dc_ns, -3);
}

TEST(args, both_tables_are_looked_at)
{
	CHECK_EQ(PARSE("--run-dir", "/r", "a", "--from=0"), ARGS_OK);
	CHECK_STR(got.run_dir, "/r");
	CHECK_EQ(got.cycle, 0);
}

TEST(args, a_list_keeps_the_order_and_has_a_limit)
{
	const char *line[2 + ARGS_LIST_LIMIT + 2] = { "a", "--set=x=1" };

	CHECK_EQ(PARSE("a", "--set", "x=1", "--set=y=2"), ARGS_OK);
	CHECK_EQ(got.set.count, 2);
	CHECK_STR(got.set.item[0], "x=1");
	CHECK_STR(got.set.item[1], "y=2");
	for (int i = 1; i <= ARGS_LIST_LIMIT; i++) {
		line[i] = "--set=x=1";
	}
	CHECK_EQ(parse(line, 0), ARGS_OK);
	CHECK_EQ(got.set.count, ARGS_LIST_LIMIT);
	line[ARGS_LIST_LIMIT + 1] = "--set=x=1";
	CHECK_EQ(parse(line, 0), ARGS_ERROR);
	CHECK_STR(error, "--set: given more than ARGS_LIST_LIMIT = 256 times");
}

TEST(args, help_and_version_come_before_later_mistakes)
{
	CHECK_EQ(PARSE("--help", "--nonsense"), ARGS_HELP);
	CHECK_EQ(PARSE("-h"), ARGS_HELP);
	CHECK_EQ(PARSE("--version"), ARGS_VERSION);
	CHECK_EQ(PARSE("--nonsense", "--help"), ARGS_ERROR);
	CHECK_EQ(PARSE("--text", "--help", "a"), ARGS_OK);
	CHECK_STR(got.text, "--help");
}

TEST(args, a_command_keeps_its_own_options)
{
	CHECK_EQ(parse((const char *[]){ "--flag", "verb", "--nonsense", "--", "x", NULL }, 1),
		 ARGS_OK);
	CHECK_EQ(got.flag, 1);
	CHECK_EQ(args.operand_count, 4);
	CHECK_STR(args.operands[0], "verb");
	CHECK_STR(args.operands[1], "--nonsense");
	CHECK_EQ(parse((const char *[]){ "--flag", NULL }, 1), ARGS_ERROR);
	CHECK_STR(error, "missing WORD...");
}

TEST(args, negative_values_and_words_after_two_dashes_are_operands)
{
	CHECK_EQ(PARSE("-5", "-.5"), ARGS_OK);
	CHECK_EQ(args.operand_count, 2);
	CHECK_EQ(PARSE("--", "--flag", "-x"), ARGS_OK);
	CHECK_STR(args.operands[0], "--flag");
	CHECK_EQ(got.flag, 0);
}

static void fails(const char *message, const char *const *line)
{
	CHECK_EQ(parse(line, 0), ARGS_ERROR);
	CHECK_STR(error, message);
}

#define FAILS(message, ...) fails(message, (const char *[]){ __VA_ARGS__, NULL })

TEST(args, an_integer_is_taken_within_its_range_in_any_base)
{
	CHECK_EQ(PARSE("a", "--level", "-2"), ARGS_OK);
	CHECK_EQ(got.level.value, -2);
	CHECK_EQ(PARSE("a", "--level", "0x7"), ARGS_OK);
	CHECK_EQ(got.level.value, 7);
	FAILS("--level: \"8\": expected a whole number from -2 to 7", "a", "--level", "8");
	FAILS("--level: \"-3\": expected a whole number from -2 to 7", "a", "--level", "-3");
	FAILS("--level: \"7x\": expected a whole number from -2 to 7", "a", "--level", "7x");
	FAILS("--level: \"99999999999999999999\": expected a whole number from -2 to 7", "a",
	      "--level", "99999999999999999999");
}

TEST(args, each_mistake_is_named)
{
	FAILS("--flags: unknown option", "a", "--flags");
	FAILS("--fla: unknown option", "a", "--fla");
	FAILS("-x: unknown option", "a", "-x");
	FAILS("--flag: takes no value", "a", "--flag=1");
	FAILS("--text: missing value", "a", "--text");
	FAILS("--text: missing value", "a", "--text=");
	FAILS("--run-dir: missing value", "a", "--run-dir", "");
	FAILS("--count: \"0\": expected a whole number above 0", "a", "--count", "0");
	FAILS("--count: \"-1\": expected a whole number above 0", "a", "--count", "-1");
	FAILS("--count: \"1x\": expected a whole number above 0", "a", "--count", "1x");
	FAILS("--count: \" 5\": expected a whole number above 0", "a", "--count", " 5");
	FAILS("--count: \"99999999999999999999\": expected a whole number above 0", "a", "--count",
	      "99999999999999999999");
	FAILS("--from: \"-1\": expected a cycle number", "a", "--from", "-1");
	FAILS("--number: \"nan\": expected a number above 0", "a", "--number", "nan");
	FAILS("--number: \"inf\": expected a number above 0", "a", "--number", "inf");
	FAILS("--number: \"0\": expected a number above 0", "a", "--number", "0");
	FAILS("--at: \"soon\": expected a DC time in ns", "a", "--at", "soon");
	FAILS("--at: \"99999999999999999999\": expected a DC time in ns", "a", "--at",
	      "99999999999999999999");
	FAILS("missing WORD...", "--flag");
	FAILS("c: unexpected argument", "a", "b", "c");
}

TEST(args, a_refused_value_leaves_its_target_untouched)
{
	CHECK_EQ(PARSE("a", "--count", "7", "--count", "x"), ARGS_ERROR);
	CHECK_EQ(got.count, 7);
}

TEST(args, help_is_wrapped_under_its_column)
{
	static const struct args_option long_one[] = {
		{ "wait", 'w', args_flag, NULL, NULL,
		  "while there is no interface, link or slave yet: report it once and retry" },
		{ "a-very-long-option", 0, args_text, NULL, "DIRECTORY", "short" },
		{ "hidden", 0, args_flag, NULL, NULL, NULL },
	};
	char text[512];
	FILE *out = fmemopen(text, sizeof(text), "w");

	CHECK(out != NULL);
	args_help(out, long_one, 3);
	fclose(out);
	CHECK_STR(
		text,
		"  -w, --wait           while there is no interface, link or slave yet: report it\n"
		"                       once and retry\n"
		"  --a-very-long-option DIRECTORY\n"
		"                       short\n");
}
