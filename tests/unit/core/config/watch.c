/* SPDX-License-Identifier: MIT */
/* Every problem of a file, and every option in effect. */
#include <errno.h>
#include <stdlib.h>
#include <unistd.h>

#include "config/config.h"
#include "config/effective.h"
#include "harness/test.h"

static char path[64];
static char shown[16384];

static void write_file(const char *text)
{
	int fd;

	snprintf(path, sizeof(path), "/tmp/ecdaq-watch-XXXXXX");
	fd = mkstemp(path);
	CHECK(fd >= 0);
	CHECK_EQ(write(fd, text, strlen(text)), (ssize_t)strlen(text));
	close(fd);
	shown[0] = '\0';
}

/* A line, without the folder and the random part of the file's name. */
static void show_problem(void *ctx, const char *line)
{
	size_t used = strlen(shown);

	(void)ctx;
	if (strncmp(line, path, strlen(path)) == 0) {
		line += strlen(path);
	}
	snprintf(shown + used, sizeof(shown) - used, "%s\n", line);
}

static int check(const char *text, const char *const *set, size_t set_count)
{
	static struct config cfg;
	const struct config_source source = {
		.path = path, .set = set, .set_count = set_count, .problem = show_problem
	};
	char error[256] = "";
	int r;

	write_file(text);
	r = config_assemble_from(&source, &cfg, error, sizeof(error));
	unlink(path);
	return r;
}

TEST(config, every_problem_of_a_file_is_reported_with_its_line)
{
	CHECK_EQ(check("cycle:\n"
		       "  perid: 1ms\n"
		       "  period: 1furlong\n"
		       "  cpu: 2\n"
		       "slaves:\n"
		       "  - {name: a, vendor: x}\n"
		       "  - name: b\n"
		       "    sdo: [{value: 1}]\n"
		       "busses: {}\n",
		       NULL, 0),
		 -EINVAL);
	CHECK_STR(shown, ":2: cycle.perid: unknown option; did you mean cycle.period?\n"
			 ":3: cycle.period: unknown unit \"furlong\": ns, us, ms, s, min, h or d\n"
			 ":6: slaves[0].vendor: expected a whole number, not \"x\"\n"
			 ":8: slaves[1].sdo[0].index: is missing\n"
			 ":9: busses: unknown option\n");
}

TEST(config, every_pair_of_options_that_do_not_fit_is_reported)
{
	static const char *const set[] = { "control.options=a=1", "dc.slew=1ms" };

	CHECK_EQ(check("slaves:\n"
		       "  - {name: a}\n"
		       "  - {name: a, sync0_shift: 5ms}\n"
		       "outputs:\n"
		       "  - {channel: a.led, min: 2, max: 1}\n"
		       "  - {channel: a.led}\n",
		       set, 2),
		 -EINVAL);
	CHECK_STR(shown, "dc.slew: must not be above a quarter of cycle.period\n"
			 "control.options: requires control.program\n"
			 ":3: slaves[].sync0_shift: must be less than one cycle.period\n"
			 ":5: outputs[].max: is below min\n"
			 ":6: outputs[].channel: a.led is already in line 5\n");
}

TEST(config, a_good_file_has_no_problem)
{
	CHECK_EQ(check("cycle: {period: 2ms}\n", NULL, 0), 0);
	CHECK_STR(shown, "");
}

static void show_option(void *ctx, const struct config_item *item)
{
	const char *const *wanted = ctx;
	size_t used = strlen(shown);

	for (; *wanted != NULL; wanted++) {
		if (strncmp(item->option, *wanted, strlen(*wanted)) == 0) {
			snprintf(shown + used, sizeof(shown) - used, "%s=%s %s %d\n", item->option,
				 item->value, config_origin_to_str(item->origin), item->line);
			return;
		}
	}
}

TEST(config, every_option_in_effect_has_value_unit_and_origin)
{
	static const char *const set[] = { "cycle.period=0.5", "slaves[0].mode=oneshot" };
	static const char *wanted[] = {
		"cycle.period",      "cycle.phase",      "cycle.priority",   "bus.presence",
		"bus.scan_timeout",  "slaves[0].name",   "slaves[0].mode",   "slaves[0].sdo[0].",
		"slaves[1].sdo[0].", "slaves[1].op_tim", "outputs[0].owner", NULL
	};
	char error[256] = "";

	write_file("cycle:\n  period: 1ms\n  phase: 40\nslaves:\n"
		   "  - name: a\n    mode: periodic\n"
		   "  - sdo: [{index: 0x10, type: UINT, value: 5}]\n    op_timeout: 7\n"
		   "outputs:\n  - channel: a.led\n");
	CHECK_EQ(config_effective(
			 &(struct config_source){ .path = path, .set = set, .set_count = 2 },
			 show_option, wanted, error, sizeof(error)),
		 0);
	unlink(path);
	CHECK_STR(shown, "bus.scan_timeout=5s default 0\n"
			 "bus.presence=exact default 0\n"
			 "cycle.period=0.5ms command line 0\n"
			 "cycle.phase=40% file 3\n"
			 "cycle.priority=80 default 0\n"
			 "slaves[0].name=a file 5\n"
			 "slaves[0].mode=oneshot command line 0\n"
			 "slaves[1].op_timeout=7s file 8\n"
			 "slaves[1].sdo[0].transition=PS default 0\n"
			 "slaves[1].sdo[0].index=0x10 file 7\n"
			 "slaves[1].sdo[0].subindex=0 default 0\n"
			 "slaves[1].sdo[0].complete=false default 0\n"
			 "slaves[1].sdo[0].type=UINT file 7\n"
			 "slaves[1].sdo[0].value=5 file 7\n"
			 "slaves[1].sdo[0].comment= default 0\n"
			 "outputs[0].owner=local default 0\n");
}

TEST(config, without_a_file_all_is_default)
{
	static const char *wanted[] = { "cycle.", NULL };
	char error[256] = "";

	shown[0] = '\0';
	CHECK_EQ(config_effective(&(struct config_source){ .path = NULL }, show_option, wanted,
				  error, sizeof(error)),
		 0);
	CHECK(strstr(shown, "cycle.period=1ms default 0\n") != NULL);
	CHECK(strstr(shown, "file") == NULL);
	CHECK_EQ(config_effective(&(struct config_source){ .path = "/absent.yaml" }, show_option,
				  wanted, error, sizeof(error)),
		 -ENOENT);
	CHECK(strstr(error, "/absent.yaml: cannot read") != NULL);
}
