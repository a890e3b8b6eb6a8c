/* SPDX-License-Identifier: MIT */
/* Rows of the doctor's tables: which rule decides, what it says, and that the tables are sound. */
#include "cli/doctor/check.h"

#include <errno.h>
#include <sys/stat.h>
#include <unistd.h>

#include "harness/test.h"

static char root[32];
static struct config cfg;
static struct target target;
static struct finding finding;

static void begin(void)
{
	char path[64];

	snprintf(root, sizeof(root), "/tmp/ecdaq-doctor-XXXXXX");
	CHECK(mkdtemp(root) != NULL);
	snprintf(path, sizeof(path), "%s/calls", root);
	CHECK_EQ(mkdir(path, 0700), 0);
	config_defaults(&cfg);
	target = (struct target){ .probe.root = root, .cfg = &cfg, .nic = "ecat0", .cpu = 3 };
}

static void put(const char *name, const char *content)
{
	char path[128];
	FILE *file;

	snprintf(path, sizeof(path), "%s/%s", root, name);
	file = fopen(path, "w");
	CHECK(file != NULL);
	CHECK(fputs(content, file) >= 0);
	CHECK_EQ(fclose(file), 0);
}

static void end(void)
{
	static const char *const names[] = { "a3", "b", "calls/eee.ecat0", "calls/clock" };
	char path[128];

	for (size_t i = 0; i < sizeof(names) / sizeof(names[0]); i++) {
		snprintf(path, sizeof(path), "%s/%s", root, names[i]);
		unlink(path);
	}
	snprintf(path, sizeof(path), "%s/calls", root);
	CHECK_EQ(rmdir(path), 0);
	CHECK_EQ(rmdir(root), 0);
}

static void run(const struct check *check)
{
	finding = (struct finding){ .level = FINDING_LEVELS };
	check_run(check, &target, &finding);
}

static void expect(enum finding_level level, const char *value, const char *remedy)
{
	CHECK_EQ(finding.level, level);
	CHECK_STR(finding.value, value);
	CHECK_STR(finding.remedy, remedy);
}

TEST(doctor_check, the_first_rule_that_holds_decides)
{
	static const struct check check = {
		.name = "words",
		.fact = "/a{core}",
		.rules = { { FINDING_OK, "absent", IF_ABSENT, NULL, NULL },
			   { FINDING_FAIL, "{text} of {nic}" REMEDY "set {/b} on core {core}",
			     IF_IN, "slow slower", NULL },
			   { FINDING_WARN, "has it", IF_HAS, "[x]", NULL },
			   { .level = FINDING_OK, .text = "{text}" } },
	};

	begin();
	run(&check);
	expect(FINDING_OK, "absent", "");
	put("a3", "slow\n");
	run(&check);
	expect(FINDING_FAIL, "slow of ecat0", "set ? on core 3");
	put("b", "B");
	put("a3", "slower");
	run(&check);
	expect(FINDING_FAIL, "slower of ecat0", "set B on core 3");
	put("a3", "slo");
	run(&check);
	expect(FINDING_OK, "slo", "");
	put("a3", "lower");
	run(&check);
	expect(FINDING_OK, "lower", "");
	put("a3", "y [x]");
	run(&check);
	expect(FINDING_WARN, "has it", "");
	end();
}

TEST(doctor_check, numbers_are_compared_as_numbers_and_with_other_files)
{
	static const struct check check = {
		.name = "numbers",
		.fact = "/a{core}",
		.rules = { { FINDING_OK, "as large", IF_AT_LEAST, "/b", NULL },
			   { FINDING_WARN, "ten", IF_AT_LEAST, "10", NULL },
			   { .level = FINDING_FAIL, .text = "less" } },
	};

	begin();
	put("a3", "9");
	run(&check);
	expect(FINDING_FAIL, "less", "");
	put("a3", "10");
	run(&check);
	expect(FINDING_WARN, "ten", "");
	put("b", "9");
	run(&check);
	expect(FINDING_OK, "as large", "");
	put("a3", "many");
	run(&check);
	expect(FINDING_SKIP, "/a3: unexpected content", "");
	end();
}

TEST(doctor_check, a_row_that_cannot_be_read_is_skipped_even_if_another_file_would_decide)
{
	static const struct check check = {
		.name = "two",
		.fact = "/a{core}",
		.rules = { { FINDING_OK, "by b", IF_AT_LEAST, "1", "/b" },
			   { .level = FINDING_FAIL, .text = "not by b" } },
	};

	begin();
	put("b", "1");
	run(&check);
	expect(FINDING_SKIP, "/a3: not found", "");
	put("a3", "x");
	run(&check);
	expect(FINDING_OK, "by b", "");
	put("b", "no number");
	run(&check);
	expect(FINDING_FAIL, "not by b", "");
	end();
}

TEST(doctor_check, a_call_that_the_port_cannot_do_is_not_a_file_that_is_missing)
{
	static const struct check check = {
		.name = "eee",
		.fact = "eee enabled",
		.rules = { { FINDING_OK, "cannot", IF_UNSUPPORTED, NULL, NULL },
			   { .level = FINDING_WARN, .text = "{text}" } },
	};

	begin();
	run(&check);
	expect(FINDING_SKIP, "eee enabled: not found", "");
	put("calls/eee.ecat0", "unsupported");
	run(&check);
	expect(FINDING_OK, "cannot", "");
	put("calls/eee.ecat0", "active 1\n");
	run(&check);
	expect(FINDING_SKIP, "eee enabled: unexpected content", "");
	put("calls/eee.ecat0", "active 1\nenabled 2\n");
	run(&check);
	expect(FINDING_WARN, "2", "");
	end();
}

TEST(doctor_check, what_a_check_needs_is_looked_for_first)
{
	static const struct check core = { .name = "core",
					   .needs = NEEDS_CORE,
					   .rules = { { FINDING_OK, "on it", IF_LISTS_CORE, NULL,
							"/b" },
						      { .level = FINDING_WARN, .text = "off" } } };
	static const struct check all = {
		.name = "all",
		.needs = NEEDS_NIC,
		.rules = { { .level = FINDING_OK, .text = "here" } },
	};
	struct check check = all;

	begin();
	run(&core);
	expect(FINDING_WARN, "off", "");
	put("b", "0-1,3");
	run(&core);
	expect(FINDING_OK, "on it", "");
	target.cpu = -1;
	check.needs = 0;
	check.rules[0].text = "core {core}";
	run(&check);
	expect(FINDING_OK, "core 0", "");
	check = all;
	run(&core);
	expect(FINDING_SKIP, "the cycle has no core of its own (cycle.cpu)", "");
	run(&check);
	expect(FINDING_SKIP, "ecat0: no such port", "");
	target.nic = "";
	run(&check);
	expect(FINDING_SKIP, "no port is configured", "");
	check.needs = NEEDS_RECORDING;
	cfg.record_enable = 0;
	run(&check);
	expect(FINDING_SKIP, "recording is off (record.enable)", "");
	cfg.record_enable = 1;
	run(&check);
	expect(FINDING_OK, "here", "");
	check.needs = NEEDS_PAGE;
	run(&check);
	expect(FINDING_SKIP, "ecdaqd is not running", "start ecdaqd and repeat");
	target.page_err = -EACCES;
	run(&check);
	expect(FINDING_SKIP, "ecdaqd's status page: permission denied", "run ecdaq doctor as root");
	CHECK_EQ(finding.needs_root, 1);
	end();
}

TEST(doctor_check, long_texts_are_cut_and_never_overflow)
{
	static const struct check check = {
		.name = "long",
		.fact = "/a{core}",
		.rules = { { .level = FINDING_WARN,
			     .text = "{text}{text}{text}{text}{text}{text}{text}" REMEDY "fix" } },
	};
	char line[200];

	begin();
	memset(line, 'x', sizeof(line) - 1);
	line[sizeof(line) - 1] = '\0';
	put("a3", line);
	run(&check);
	CHECK_EQ(finding.level, FINDING_WARN);
	CHECK_EQ(strlen(finding.value), sizeof(finding.value) - 1);
	end();
}

static void check_rows(const struct check *table)
{
	for (const struct check *c = table; c->name != NULL; c++) {
		size_t last = 0;

		CHECK((c->judge == NULL) != (c->rules[0].text == NULL));
		for (size_t i = 0; i < CHECK_RULES && c->rules[i].text != NULL; i++) {
			const char *text = c->rules[i].text;

			/* What is not good has a remedy, and only that. */
			CHECK((c->rules[i].level == FINDING_OK ||
			       c->rules[i].level == FINDING_SKIP) ==
			      (strstr(text, REMEDY) == NULL));
			CHECK(c->rules[i].fact != NULL || c->fact != NULL ||
			      c->rules[i].compare == ALWAYS);
			last = i;
		}
		/* The last rule always holds: no row leaves a finding open. */
		CHECK(c->judge != NULL || c->rules[last].compare == ALWAYS);
	}
}

TEST(doctor_check, every_row_ends_with_a_rule_that_always_holds_and_names_remedies)
{
	check_rows(checks_of_kernel);
	check_rows(checks_of_threads);
	check_rows(checks_of_nic);
	check_rows(checks_of_irqs);
	check_rows(checks_of_system);
}

TEST(doctor_finding, what_this_user_cannot_read_says_so)
{
	finding = (struct finding){ .level = FINDING_OK };
	finding_unread(&finding, "/dev/x", -EACCES);
	expect(FINDING_SKIP, "/dev/x: permission denied", "run ecdaq doctor as root");
	CHECK_EQ(finding.needs_root, 1);
	finding = (struct finding){ .level = FINDING_OK };
	finding_unread(&finding, "/dev/x", -ENOENT);
	expect(FINDING_SKIP, "/dev/x: not found", "");
	CHECK_EQ(finding.needs_root, 0);
	finding_unread(&finding, "/dev/x", -EIO);
	expect(FINDING_SKIP, "/dev/x: Input/output error", "");
}
