/* SPDX-License-Identifier: MIT */
#include <errno.h>
#include <unistd.h>

#include "config/config.h"
#include "harness/test.h"
#include "unit/core/config/parsing.h"

TEST(config, conflicting_options_are_reported_with_a_line_of_the_file)
{
	parse_fails("dc:\n  lock_limit: 60us\n",
		    "t.yaml:2: dc.unlock_limit: must not be below dc.lock_limit");
	parse_fails("dc:\n  lock_limit: 60us\n  unlock_limit: 55us\n",
		    "t.yaml:3: dc.unlock_limit: must not be below dc.lock_limit");
	parse_fails("dc:\n  unlock_limit: 501us\n",
		    "t.yaml:2: dc.unlock_limit: must not be above half of cycle.period");
	parse_fails("cycle:\n  period: 250us\ndc:\n  slew: 63us\n",
		    "t.yaml:4: dc.slew: must not be above a quarter of cycle.period");
	parse_fails("record:\n  chunk_period: 2s\n",
		    "t.yaml:2: record.sync_period: must not be below record.chunk_period");
	parse_fails("record:\n  sync_period: 20s\n  rotate_period: 10s\n",
		    "t.yaml:3: record.rotate_period: must not be below record.sync_period");
	parse_fails("record:\n  budget: 128MiB\n",
		    "t.yaml:2: record.budget: must be 0B or at least record.rotate_size");
	parse_fails("record:\n  dir: \"\"\n",
		    "t.yaml:2: record.dir: is required while record.enable is on");
	parse_fails("bus:\n  watchdog: 2ms\n",
		    "t.yaml:2: bus.watchdog: must be 0s or at least three times cycle.period");
	parse_fails("bus:\n  presence: exact\n",
		    "t.yaml:2: bus.presence: exact requires a slaves list");
	parse_fails("slaves:\n- name: a\n- name: a\n",
		    "t.yaml:3: slaves[].name: slaves 0 and 1 have the same name a");
	parse_fails("slaves:\n- sync0_line: GPIO17\n- {}\n- sync0_line: GPIO17\n",
		    "t.yaml:4: slaves[].sync0_line: is already used by slave 0");
	parse_fails("slaves:\n- sync0_shift: 1ms\n",
		    "t.yaml:2: slaves[].sync0_shift: must be less than one cycle.period");
	parse_fails("outputs:\n- { channel: a, min: 1, max: 0, fail_safe: 1 }\n",
		    "t.yaml:2: outputs[].max: is below min");
	parse_fails("outputs:\n- { channel: a, min: 1 }\n",
		    "t.yaml:2: outputs[].fail_safe: is not within min and max");
	parse_fails("outputs:\n- { channel: a, timeout: 1s }\n",
		    "t.yaml:2: outputs[].timeout: requires owner: remote");
	parse_fails("outputs:\n- channel: a\n- channel: a\n",
		    "t.yaml:3: outputs[].channel: a is already in line 2");
	parse_fails("outputs:\n- channel: \"\"\n", "t.yaml:2: outputs[].channel: is missing");
}

TEST(config, lists_longer_than_the_compiled_limit_name_it)
{
	static char text[262144];
	size_t len = (size_t)snprintf(text, sizeof(text), "slaves:\n");

	for (int i = 0; i < LIMIT_SLAVES; i++) {
		len += (size_t)snprintf(text + len, sizeof(text) - len, "- name: s%d\n", i);
	}
	static struct config cfg;

	parse_ok(text, &cfg);
	CHECK_EQ(cfg.slave_count, LIMIT_SLAVES);
	snprintf(text + len, sizeof(text) - len, "- name: more\n");
	parse_fails(text, "t.yaml:514: slaves: more than LIMIT_SLAVES = 512 items");

	len = (size_t)snprintf(text, sizeof(text), "slaves:\n- sdo:\n");
	for (int i = 0; i <= CONFIG_LIMIT_SDOS; i++) {
		len += (size_t)snprintf(text + len, sizeof(text) - len,
					"  - { index: 0x8000, type: UINT, value: %d }\n", i);
	}
	parse_fails(text, "t.yaml:2051: slaves[0].sdo: more than CONFIG_LIMIT_SDOS = 2048 items");
}

TEST(config, more_outputs_and_sync0_lines_than_the_limit_name_it)
{
	static char text[524288];
	static struct config cfg;
	size_t len = (size_t)snprintf(text, sizeof(text), "outputs:\n");

	for (int i = 0; i < LIMIT_OUTPUTS; i++) {
		len += (size_t)snprintf(text + len, sizeof(text) - len, "- channel: a.o%d\n", i);
	}
	parse_ok(text, &cfg);
	CHECK_EQ(cfg.output_count, LIMIT_OUTPUTS);
	snprintf(text + len, sizeof(text) - len, "- channel: a.more\n");
	parse_fails(text, "t.yaml:4098: outputs: more than CONFIG_LIMIT_OUTPUTS = 4096 items");

	len = (size_t)snprintf(text, sizeof(text), "slaves:\n");
	for (int i = 0; i <= LIMIT_SYNC0_LINES; i++) {
		len += (size_t)snprintf(text + len, sizeof(text) - len, "- sync0_line: chip:%d\n",
					i);
	}
	parse_fails(text, "t.yaml:66: slaves[].sync0_line: more than LIMIT_SYNC0_LINES = 64 lines");
}

TEST(config, aliases_and_anchors_work_and_cannot_recurse)
{
	static struct config cfg;

	parse_ok("slaves:\n- &s { vendor: 2 }\n- *s\n", &cfg);
	CHECK_EQ(cfg.slave_count, 2);
	CHECK_EQ(cfg.slave[1].vendor, 2);
	parse_fails("slaves: &a\n- sdo: *a\n",
		    "t.yaml:2: slaves[0].sdo[0].sdo: unknown option; did you "
		    "mean slaves[].sdo?");
}

TEST(config, file_that_cannot_be_read_is_named)
{
	static struct config cfg;
	char error[256];

	CHECK_EQ(config_load("/nonexistent/ecdaq.yaml", &cfg, error, sizeof(error)), -ENOENT);
	CHECK_STR(error, "/nonexistent/ecdaq.yaml: cannot read the configuration: No such file or "
			 "directory");
	CHECK_EQ(config_load("/", &cfg, error, sizeof(error)), -EISDIR);
	CHECK_STR(error, "/: cannot read the configuration: Is a directory");
}

TEST(config, file_larger_than_the_limit_is_refused)
{
	char path[] = "/tmp/ecdaq-config-XXXXXX";
	static struct config cfg;
	char wanted[128];
	char error[256];
	int fd = mkstemp(path);

	CHECK(fd >= 0);
	CHECK_EQ(ftruncate(fd, (1 << 20) + 1), 0);
	close(fd);
	CHECK_EQ(config_load(path, &cfg, error, sizeof(error)), -E2BIG);
	unlink(path);
	snprintf(wanted, sizeof(wanted), "%s:1: larger than 1 MiB", path);
	CHECK_STR(error, wanted);
}
