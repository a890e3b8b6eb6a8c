/* SPDX-License-Identifier: MIT */
#include "daemon/options.h"

#include <errno.h>
#include <unistd.h>

#include "harness/test.h"

#define PARSE(options, failure, ...)                                                               \
	options_parse((int)(sizeof((const char *[]){ "ecdaqd", __VA_ARGS__ }) / sizeof(char *)),   \
		      (const char *[]){ "ecdaqd", __VA_ARGS__ }, (options), (failure))

TEST(daemon_options, every_option_is_taken_with_its_value_in_both_spellings)
{
	struct options op;
	struct failure failure;

	CHECK_EQ(PARSE(&op, &failure, "--config", "a.yaml", "--interface=eth1", "--run-dir",
		       "/dev/shm/x", "--set", "cycle.period=500us", "--set=dc.kp=0.1", "--cycles",
		       "100", "--seconds=5", "--wait", "--simulated"),
		 0);
	CHECK_EQ(op.verb, OPTIONS_RUN);
	CHECK_STR(op.config_path, "a.yaml");
	CHECK_STR(op.interface, "eth1");
	CHECK_STR(op.run_dir, "/dev/shm/x");
	CHECK_EQ(op.set_count, 2);
	CHECK_STR(op.set[0], "cycle.period=500us");
	CHECK_STR(op.set[1], "dc.kp=0.1");
	CHECK_EQ(op.cycles, 100);
	CHECK_EQ(op.seconds, 5);
	CHECK_EQ(op.can_wait, 1);
	CHECK_EQ(op.is_simulated, 1);
}

TEST(daemon_options, wrong_ones_are_one_line_and_leave_the_options_untouched)
{
	struct options op = { .cycles = 77 };
	struct failure failure;

	CHECK_EQ(PARSE(&op, &failure, "--frobnicate"), -EINVAL);
	CHECK_EQ(failure.code, EXIT_CODE_USAGE);
	CHECK_STR(failure.text, "--frobnicate: no such option (see ecdaqd --help)");
	CHECK_EQ(PARSE(&op, &failure, "eth0"), -EINVAL);
	CHECK_EQ(PARSE(&op, &failure, "--config"), -EINVAL);
	CHECK_STR(failure.text, "--config: needs a value (see ecdaqd --help)");
	CHECK_EQ(PARSE(&op, &failure, "--config="), -EINVAL);
	CHECK_EQ(PARSE(&op, &failure, "--check=yes"), -EINVAL);
	CHECK_EQ(PARSE(&op, &failure, "--cycles", "0"), -EINVAL);
	CHECK_EQ(PARSE(&op, &failure, "--cycles", "-1"), -EINVAL);
	CHECK_EQ(PARSE(&op, &failure, "--cycles", "1k"), -EINVAL);
	CHECK_EQ(PARSE(&op, &failure, "--seconds", " 5"), -EINVAL);
	CHECK_EQ(PARSE(&op, &failure, "--seconds", "99999999999999999999"), -EINVAL);
	CHECK_EQ(op.cycles, 77);
}

TEST(daemon_options, verbs_are_told_apart)
{
	struct options op;
	struct failure failure;

	CHECK_EQ(PARSE(&op, &failure, "--check"), 0);
	CHECK_EQ(op.verb, OPTIONS_CHECK);
	CHECK_EQ(PARSE(&op, &failure, "--version"), 0);
	CHECK_EQ(op.verb, OPTIONS_VERSION);
	CHECK_EQ(PARSE(&op, &failure, "-h"), 0);
	CHECK_EQ(op.verb, OPTIONS_HELP);
}

TEST(daemon_options, the_command_line_stands_over_the_file)
{
	struct options op;
	struct failure failure;
	static struct config cfg;
	char path[] = "/tmp/ecdaqd-options-XXXXXX";
	int fd = mkstemp(path);
	static const char text[] = "bus:\n  interface: eth3\ncycle:\n  period: 2ms\n";

	CHECK(fd >= 0);
	CHECK_EQ(write(fd, text, sizeof(text) - 1), sizeof(text) - 1);
	close(fd);
	CHECK_EQ(PARSE(&op, &failure, "--config", path), 0);
	CHECK_EQ(options_apply(&op, &cfg, &failure), 0);
	CHECK_STR(cfg.interface, "eth3");
	CHECK_EQ(cfg.cycle_period_ns, 2000000);
	CHECK_EQ(PARSE(&op, &failure, "--config", path, "--set", "cycle.period=500us",
		       "--interface", "eth4"),
		 0);
	CHECK_EQ(options_apply(&op, &cfg, &failure), 0);
	CHECK_STR(cfg.interface, "eth4");
	CHECK_EQ(cfg.cycle_period_ns, 500000);
	unlink(path);
}

TEST(daemon_options, what_the_configuration_refuses_leaves_it_untouched)
{
	struct options op;
	struct failure failure;
	static struct config cfg;

	cfg.cycle_period_ns = 77;
	CHECK_EQ(PARSE(&op, &failure, "--set", "cycle.period=1h"), 0);
	CHECK(options_apply(&op, &cfg, &failure) < 0);
	CHECK_EQ(failure.code, EXIT_CODE_CONFIG);
	CHECK(strstr(failure.text, "cycle.period") != NULL);
	CHECK_EQ(PARSE(&op, &failure, "--config", "/nowhere.yaml"), 0);
	CHECK(options_apply(&op, &cfg, &failure) < 0);
	CHECK(strstr(failure.text, "/nowhere.yaml") != NULL);
	CHECK_EQ(PARSE(&op, &failure, "--interface", "a-name-longer-than-any-interface-has"), 0);
	CHECK(options_apply(&op, &cfg, &failure) < 0);
	CHECK_EQ(failure.code, EXIT_CODE_USAGE);
	CHECK_EQ(cfg.cycle_period_ns, 77);
}

TEST(daemon_options, help_names_every_exit_code)
{
	char text[8192];
	FILE *out = fmemopen(text, sizeof(text), "w");

	CHECK(out != NULL);
	options_help(out);
	fclose(out);
	for (int code = 0; code <= EXIT_CODE_CONTROL; code++) {
		CHECK(strstr(text, exit_code_to_str((enum exit_code)code)) != NULL);
	}
}
