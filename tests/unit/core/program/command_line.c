/* SPDX-License-Identifier: MIT */
#include "program/command_line.h"

#include <unistd.h>

#include "harness/test.h"

enum { WORDS = 16 };

static struct config cfg;
static const char *interface;
static struct command_line line;
static char said[1024]; /* on standard error and standard output */

/* Read the command line "ecdaqd @words" and keep what is written. */
static enum exit_code read_line(const char *const *words, enum command_line_result result)
{
	static const struct args_option options[] = {
		{ "interface", 0, args_text, &interface, "NIC", "NIC of the segment" },
	};
	static const struct command_line_override overrides[] = { { "bus.interface", &interface } };
	static char copies[WORDS][128];
	char *argv[WORDS] = { copies[0] };
	enum exit_code code = EXIT_CODE_COUNT;
	FILE *file = tmpfile();
	int out = dup(STDOUT_FILENO);
	int err = dup(STDERR_FILENO);
	int argc = 1;

	for (; words[argc - 1] != NULL; argc++) {
		snprintf(copies[argc], sizeof(copies[argc]), "%s", words[argc - 1]);
		argv[argc] = copies[argc];
	}
	interface = NULL;
	line = (struct command_line){ .program = "ecdaqd",
				      .summary = "A master.\n",
				      .options = options,
				      .option_count = 1,
				      .overrides = overrides,
				      .override_count = 1,
				      .notes = "notes\n",
				      .exit_codes = EXIT_CODE_COMMON };
	CHECK(file != NULL);
	fflush(stdout);
	dup2(fileno(file), STDOUT_FILENO);
	dup2(fileno(file), STDERR_FILENO);
	CHECK_EQ(command_line_read(&line, argc, argv, &cfg, &code), result);
	fflush(stdout);
	dup2(out, STDOUT_FILENO);
	dup2(err, STDERR_FILENO);
	close(out);
	close(err);
	rewind(file);
	said[fread(said, 1, sizeof(said) - 1, file)] = '\0';
	fclose(file);
	return code;
}

#define RUNS(...)                                                                                  \
	CHECK_EQ(read_line((const char *[]){ __VA_ARGS__, NULL }, COMMAND_LINE_RUN), EXIT_CODE_OK)
#define EXITS(...) read_line((const char *[]){ __VA_ARGS__, NULL }, COMMAND_LINE_EXIT)

static void write_file(char *path, const char *text)
{
	int fd = mkstemp(path);

	CHECK(fd >= 0);
	CHECK_EQ(write(fd, text, strlen(text)), (ssize_t)strlen(text));
	close(fd);
}

TEST(command_line, options_override_set_and_set_overrides_the_file)
{
	char path[] = "/tmp/ecdaq-command-line-XXXXXX";

	write_file(path, "bus:\n  interface: eth3\ncycle:\n  period: 2ms\n");
	RUNS("--config", path);
	CHECK_STR(cfg.interface, "eth3");
	CHECK_EQ(cfg.cycle_period_ns, 2000000);
	CHECK_STR(line.config_path, path);
	CHECK_EQ(line.is_check, 0);
	RUNS("--run-dir=/dev/shm/x", "--interface", "eth4", "--config", path, "--set",
	     "cycle.period=500us", "--set=bus.interface=eth5", "--set", "runtime.run_dir=/y",
	     "--check");
	CHECK_STR(cfg.interface, "eth4");
	CHECK_EQ(cfg.cycle_period_ns, 500000);
	CHECK_STR(cfg.run_dir, "/dev/shm/x");
	CHECK_EQ(line.is_check, 1);
	unlink(path);
}

TEST(command_line, overrides_come_before_the_check_of_the_file)
{
	char path[] = "/tmp/ecdaq-command-line-XXXXXX";

	write_file(path, "dds:\n  enable: on\n  interface: eth0\nbus:\n  interface: eth0\n");
	CHECK_EQ(EXITS("--config", path), EXIT_CODE_CONFIG);
	CHECK(strstr(said, ":3: dds.interface: is bus.interface") != NULL);
	RUNS("--config", path, "--interface", "eth1");
	RUNS("--config", path, "--set", "dds.interface=eth2");
	unlink(path);
}

TEST(command_line, an_error_in_an_assignment_names_no_line_of_the_file)
{
	char path[] = "/tmp/ecdaq-command-line-XXXXXX";

	write_file(path, "dds:\n  enable: on\n  interface: eth1\nbus:\n  interface: eth0\n");
	CHECK_EQ(EXITS("--config", path, "--set", "dds.interface=eth0"), EXIT_CODE_CONFIG);
	CHECK(strstr(said, "ecdaqd: dds.interface: is bus.interface") == said);
	unlink(path);
}

TEST(command_line, each_error_is_one_line_with_its_exit_code)
{
	CHECK_EQ(EXITS("--frobnicate"), EXIT_CODE_USAGE);
	CHECK_STR(said, "ecdaqd: --frobnicate: unknown option (see ecdaqd --help)\n");
	CHECK_EQ(EXITS("eth0"), EXIT_CODE_USAGE);
	CHECK_STR(said, "ecdaqd: eth0: unexpected argument (see ecdaqd --help)\n");
	CHECK_EQ(EXITS("--config"), EXIT_CODE_USAGE);
	CHECK_STR(said, "ecdaqd: --config: missing value (see ecdaqd --help)\n");
	CHECK_EQ(EXITS("--check=yes"), EXIT_CODE_USAGE);
	CHECK_STR(said, "ecdaqd: --check: takes no value (see ecdaqd --help)\n");
	CHECK_EQ(EXITS("--config", "/nowhere.yaml"), EXIT_CODE_CONFIG);
	CHECK(strstr(said, "/nowhere.yaml") != NULL);
	CHECK_EQ(EXITS("--set", "cycle.period=1h"), EXIT_CODE_CONFIG);
	CHECK(strstr(said, "ecdaqd: cycle.period: ") == said);
	CHECK_EQ(EXITS("--set", "cycle.perid=1ms"), EXIT_CODE_CONFIG);
	CHECK(strstr(said, "did you mean cycle.period?") != NULL);
	CHECK_EQ(EXITS("--interface", "a-name-longer-than-any-interface-has"), EXIT_CODE_CONFIG);
	CHECK(strstr(said, "ecdaqd: bus.interface: ") == said);
	CHECK_EQ(EXITS("--set", "a\nb=1"), EXIT_CODE_CONFIG);
	CHECK(strchr(said, '\n') == said + strlen(said) - 1);
}

TEST(command_line, an_error_leaves_the_configuration_untouched)
{
	char path[] = "/tmp/ecdaq-command-line-XXXXXX";

	write_file(path, "cycle:\n  period: 2ms\n");
	cfg.cycle_period_ns = 77;
	CHECK_EQ(EXITS("--config", path, "--set", "cycle.perid=1ms"), EXIT_CODE_CONFIG);
	CHECK_EQ(cfg.cycle_period_ns, 77);
	unlink(path);
}

TEST(command_line, help_and_version_are_those_of_the_program)
{
	CHECK_EQ(EXITS("--version"), EXIT_CODE_OK);
	CHECK_STR(said, "ecdaqd " ECDAQ_VERSION "\n");
	CHECK_EQ(EXITS("-h"), EXIT_CODE_OK);
	CHECK(strstr(said, "usage: ecdaqd [OPTION...]\n\nA master.\n\n  --config FILE") == said);
	CHECK(strstr(said, "\n  --set OPTION=VALUE") != NULL);
	CHECK(strstr(said, "\n  --interface NIC      NIC of the segment\n") != NULL);
	CHECK(strstr(said, "\nnotes\n\nexit codes:\n   0  success") != NULL);
}

TEST(command_line, a_disabled_program_fails_the_check_only)
{
	line = (struct command_line){ .program = "ecdaqd" };
	CHECK_EQ(command_line_disabled(&line, "x.enable"), EXIT_CODE_OK);
	line.is_check = 1;
	CHECK_EQ(command_line_disabled(&line, "x.enable"), EXIT_CODE_DISABLED);
	CHECK_EQ(command_line_valid(&line), EXIT_CODE_OK);
}
