/* SPDX-License-Identifier: MIT */
/* Errors of a program before its first cycle, each reported in one line. */
#include <errno.h>
#include <sys/stat.h>
#include <unistd.h>

#include "bench.h"

static void check_refused(const char *path, int r, const char *why)
{
	char wanted[320];

	bench_configure();
	snprintf(bench.cfg.control_program, sizeof(bench.cfg.control_program), "%s", path);
	CHECK_EQ(bench_load(), r);
	snprintf(wanted, sizeof(wanted), "control: %s: %s", path, why);
	CHECK_STR(bench.error, wanted);
	CHECK(bench.control == NULL);
}

TEST(control, a_missing_file_is_reported)
{
	check_refused("/nowhere/at/all.so", -ENOENT, "No such file or directory");
	check_refused("/tmp", -EINVAL, "is not a file");
	check_refused("blink", -EINVAL, "expected a path with a slash (control.program)");
}

TEST(control, a_file_that_is_no_shared_object_is_reported)
{
	char path[] = "/tmp/ecdaq-test-control-XXXXXX";
	int fd = mkstemp(path);

	CHECK(fd >= 0);
	CHECK_EQ(write(fd, "text", 4), 4);
	close(fd);
	check_refused(path, -ENOEXEC, "file too short");
	unlink(path);
}

TEST(control, a_file_that_anyone_may_write_is_not_loaded)
{
	char path[] = "/tmp/ecdaq-test-control-XXXXXX";
	int fd = mkstemp(path);

	CHECK(fd >= 0);
	CHECK_EQ(fchmod(fd, 0666), 0);
	close(fd);
	check_refused(path, -EPERM, "world-writable, not loaded (chmod o-w)");
	unlink(path);
}

TEST(control, an_object_without_the_symbol_is_reported)
{
	check_refused(ECDAQ_TEST_PROGRAMS "/no_symbol.so", -ENOEXEC,
		      "has no symbol ecdaq_program: no control program");
}

TEST(control, an_object_that_lacks_a_function_is_reported)
{
	check_refused(ECDAQ_TEST_PROGRAMS "/missing_symbol.so", -ENOEXEC,
		      "undefined symbol: function_that_is_nowhere");
}

TEST(control, another_version_of_the_header_is_reported)
{
	check_refused(ECDAQ_TEST_PROGRAMS "/other_abi.so", -ENOEXEC,
		      "was built for version 3 of ecdaq/control.h, this ecdaqd has 2: rebuild it");
	check_refused(ECDAQ_TEST_PROGRAMS "/other_bytes.so", -ENOEXEC,
		      "ecdaq_program.bytes is 8 instead of 40: use ECDAQ_PROGRAM_HEAD");
	check_refused(ECDAQ_TEST_PROGRAMS "/no_cycle.so", -ENOEXEC, "ecdaq_program has no cycle()");
}

static const char *wanted_channel;
static int wants_output;
static int found;

static int find_one(const struct ecdaq_init *in, void **ret_state)
{
	struct ecdaq_input input = { 77 };
	struct ecdaq_output output = { 77 };

	(void)ret_state;
	found = wants_output ? ecdaq_find_output(in, wanted_channel, &output)
			     : ecdaq_find_input(in, wanted_channel, &input);
	if (found < 0) {
		CHECK_EQ(wants_output ? output.index : input.index, 77);
	}
	return found;
}

static void check_find(const char *channel, int is_output, int r, const char *why)
{
	char wanted[320];

	bench_configure()->init = find_one;
	wanted_channel = channel;
	wants_output = is_output;
	CHECK_EQ(bench_begin(), r == 0 ? 0 : -EINVAL);
	CHECK_EQ(found, r);
	snprintf(wanted, sizeof(wanted), "control: " PROBE_PATH ": init() failed: %s: %s", channel,
		 why);
	CHECK_STR(bench.error, r == 0 ? "" : wanted);
	bench_done();
}

TEST(control, an_unusable_channel_is_named_with_the_reason)
{
	check_find("a.adc", 0, 0, "");
	check_find("a.led", 0, 0, ""); /* an output can be read */
	check_find("a.led", 1, 0, "");
	check_find("c.adc", 0, -ENOENT, "no such channel (see `ecdaq channels`)");
	check_find("c.led", 1, -ENOENT, "no such channel (see `ecdaq channels`)");
	check_find("a.adc", 1, -EROFS, "is an input and cannot be written");
	check_find("b.foreign", 1, -EACCES,
		   "does not belong to the program (outputs: owner: program)");
}

static int say_two_lines(const struct ecdaq_init *in, void **ret_state)
{
	(void)ret_state;
	ecdaq_say(in, "no oil\nin the \x1b[31mengine");
	return -EIO;
}

static int fail_silently(const struct ecdaq_init *in, void **ret_state)
{
	(void)in;
	(void)ret_state;
	return -EIO;
}

static int exits;

static void count_exit(void *state)
{
	(void)state;
	exits++;
}

TEST(control, the_reason_of_a_failing_init_is_one_printable_line)
{
	struct probe *probe = bench_configure();

	exits = 0;
	probe->init = say_two_lines;
	probe->exit = count_exit;
	CHECK_EQ(bench_begin(), -EINVAL);
	CHECK_STR(bench.error, "control: " PROBE_PATH ": init() failed: no oil in the  [31mengine");
	bench_done();
	CHECK_EQ(exits, 0);

	bench_configure()->init = fail_silently;
	CHECK_EQ(bench_begin(), -EINVAL);
	CHECK_STR(bench.error, "control: " PROBE_PATH ": init() failed: Input/output error");
	bench_done();
}

TEST(control, exit_is_called_once_after_a_good_init)
{
	static int value;
	struct probe *probe = bench_configure();

	(void)value;
	probe->exit = count_exit;
	exits = 0;
	CHECK_EQ(bench_begin(), 0);
	CHECK_EQ(bench.status.state, CONTROL_WAITING);
	CHECK_STR(bench.status.name, "probe");
	CHECK_STR(bench.status.path, PROBE_PATH);
	bench_done();
	CHECK_EQ(exits, 1);
}

static double kp = 1;
static char word[8] = "before";

static int read_options(const struct ecdaq_init *in, void **ret_state)
{
	int r = ecdaq_option_number(in, "kp", &kp);
	int r2 = ecdaq_option_text(in, "word", word, sizeof(word));

	(void)ret_state;
	if (r < 0 && r != -ENOENT) {
		return r;
	}
	return r2 == -ENOENT ? 0 : r2;
}

static int begin_with(const char *options)
{
	bench_configure()->init = read_options;
	snprintf(bench.cfg.control_options, sizeof(bench.cfg.control_options), "%s", options);
	return bench_begin();
}

static void check_options_refused(const char *options, const char *why)
{
	char wanted[320];

	CHECK_EQ(begin_with(options), -EINVAL);
	snprintf(wanted, sizeof(wanted), "control: " PROBE_PATH ": %s", why);
	CHECK_STR(bench.error, wanted);
	bench_done();
}

TEST(control, options_are_found_by_their_keys)
{
	CHECK_EQ(begin_with(""), 0);
	CHECK(kp == 1.0);
	CHECK_STR(word, "before");
	bench_done();
	CHECK_EQ(begin_with(" kp = 0.25 ,, word=a b "), 0);
	CHECK(kp == 0.25);
	CHECK_STR(word, "a b");
	bench_done();
}

TEST(control, malformed_and_unknown_options_are_rejected)
{
	check_options_refused("kp=1x",
			      "init() failed: kp: the value in control.options is not a number");
	check_options_refused("kp=inf",
			      "init() failed: kp: the value in control.options is not a number");
	check_options_refused("kp=",
			      "init() failed: kp: the value in control.options is not a number");
	check_options_refused("word=12345678",
			      "init() failed: word: the value in control.options is too long");
	check_options_refused("kb=2", "control.options: kb: unknown key");
	check_options_refused("kp", "control.options: \"kp\" is not KEY=VALUE");
	check_options_refused("=3", "control.options: \"=3\" has no key");
	check_options_refused("kp=1,kp=2", "control.options: kp: duplicate key");
}
