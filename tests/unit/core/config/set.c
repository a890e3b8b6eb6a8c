/* SPDX-License-Identifier: MIT */
#include <errno.h>
#include <unistd.h>

#include "config/config.h"
#include "harness/test.h"

static void set_fails(const char *assignment, const char *wanted)
{
	static struct config before;
	static struct config cfg;
	char error[256] = "no error text";

	config_defaults(&cfg);
	before = cfg;
	CHECK_EQ(config_set(&cfg, assignment, error, sizeof(error)), -EINVAL);
	CHECK_STR(error, wanted);
	CHECK_MEM(&cfg, &before, sizeof(cfg));
}

TEST(config, set_takes_what_the_file_takes)
{
	static struct config cfg;
	char error[256] = "";

	config_defaults(&cfg);
	CHECK_EQ(config_set(&cfg, "cycle.period=500us", error, sizeof(error)), 0);
	CHECK_EQ(cfg.cycle_period_ns, 500000);
	CHECK_EQ(config_set(&cfg, "record.dir=/a=b", error, sizeof(error)), 0);
	CHECK_STR(cfg.record_dir, "/a=b");
	CHECK_EQ(config_set(&cfg, "record.dir=", error, sizeof(error)), 0);
	CHECK_STR(cfg.record_dir, "");
	CHECK_EQ(config_set(&cfg, "slaves[0].mode=oneshot", error, sizeof(error)), 0);
	CHECK_EQ(config_set(&cfg, "slaves[1].mode=oneshot", error, sizeof(error)), 0);
	CHECK_EQ(cfg.slave_count, 2);
	CHECK_EQ(cfg.slave[1].mode, CONFIG_MODE_ONESHOT);
	CHECK_EQ(config_set(&cfg, "outputs[0].channel=piccolo0.led", error, sizeof(error)), 0);
	CHECK_EQ(cfg.output_count, 1);
	CHECK(cfg.output[0].max > 1e300);
}

TEST(config, set_rejects_with_one_line)
{
	set_fails("cycle.period", "cycle.period: expected OPTION=VALUE");
	set_fails("=1", "=1: expected OPTION=VALUE");
	set_fails("cycle.perid=1ms", "cycle.perid: unknown option; did you mean cycle.period?");
	set_fails("cycle.period=20ms", "cycle.period: 20ms is out of range: 250us to 10ms");
	set_fails("cycle=1", "cycle: unknown option; did you mean cycle?");
	set_fails("slaves[1].name=x", "slaves[1].name: item 1 skips an index or exceeds the limit");
	set_fails("slaves[].name=x", "slaves[].name: unknown option; did you mean slaves[].name?");
	set_fails("slaves[-1].name=x",
		  "slaves[-1].name: unknown option; did you mean slaves[].name?");
	set_fails("slaves[0].nmae=x",
		  "slaves[0].nmae: unknown option; did you mean slaves[].name?");
	set_fails("slaves[0].sdo[0].index=1",
		  "slaves[0].sdo[0].index: unknown option; did you mean slaves[].sdo[].index?");
	set_fails("a\nb=1", "a?b: unknown option");
}

TEST(config, set_does_not_check_options_against_each_other)
{
	static struct config cfg;
	char error[256] = "";

	config_defaults(&cfg);
	CHECK_EQ(config_set(&cfg, "dc.lock_limit=100us", error, sizeof(error)), 0);
	CHECK_EQ(config_check(&cfg, error, sizeof(error)), -EINVAL);
	CHECK_STR(error, "dc.unlock_limit: must not be below dc.lock_limit");
	CHECK_EQ(config_set(&cfg, "dc.unlock_limit=200us", error, sizeof(error)), 0);
	CHECK_EQ(config_check(&cfg, error, sizeof(error)), 0);
}

TEST(config, run_path_takes_the_option_then_the_environment_then_the_standard_place)
{
	static struct config cfg;
	char path[64] = "untouched";
	char standard[64] = "/run/ecdaq/status";

	config_defaults(&cfg);
	setenv("ECDAQ_RUN_DIR", "/tmp/here", 1);
	CHECK_EQ(config_run_path(&cfg, CONFIG_RUN_STATUS, path, 5), -ENAMETOOLONG);
	CHECK_STR(path, "untouched");
	CHECK_EQ(config_run_path(&cfg, CONFIG_RUN_STATUS, path, sizeof(path)), 0);
	CHECK_STR(path, "/tmp/here/status");
	snprintf(cfg.run_dir, sizeof(cfg.run_dir), "/tmp/there");
	CHECK_EQ(config_run_path(&cfg, CONFIG_RUN_ADMIN, path, sizeof(path)), 0);
	CHECK_STR(path, "/tmp/there/admin");
	cfg.run_dir[0] = '\0';
	unsetenv("ECDAQ_RUN_DIR");
	if (geteuid() != 0) {
		snprintf(standard, sizeof(standard), "/dev/shm/ecdaq-%u/status",
			 (unsigned)geteuid());
	}
	CHECK_EQ(config_run_path(&cfg, CONFIG_RUN_STATUS, path, sizeof(path)), 0);
	CHECK_STR(path, standard);
}

TEST(config, dds_requires_an_interface_of_its_own)
{
	static struct config cfg;
	char error[256];

	config_defaults(&cfg);
	CHECK_EQ(config_set(&cfg, "dds.enable=on", error, sizeof(error)), 0);
	CHECK_EQ(config_check(&cfg, error, sizeof(error)), -EINVAL);
	CHECK_STR(error, "dds.interface: is required while dds.enable is on");
	CHECK_EQ(config_set(&cfg, "dds.interface=eth0", error, sizeof(error)), 0);
	CHECK_EQ(config_set(&cfg, "bus.interface=eth0", error, sizeof(error)), 0);
	CHECK_EQ(config_check(&cfg, error, sizeof(error)), -EINVAL);
	CHECK_STR(error, "dds.interface: is bus.interface, which is for EtherCAT alone");
	CHECK_EQ(config_set(&cfg, "dds.interface=eth0.5", error, sizeof(error)), 0);
	CHECK_EQ(config_check(&cfg, error, sizeof(error)), 0);
	CHECK_EQ(config_set(&cfg, "dds.peers=10.0.0.1,<pc>", error, sizeof(error)), 0);
	CHECK_EQ(config_check(&cfg, error, sizeof(error)), -EINVAL);
	CHECK_STR(error, "dds.peers: must be addresses or host names with commas between");
}

TEST(config, a_command_line_is_the_defaults_then_the_file_then_what_is_set_in_order)
{
	static const char *const set[] = { "cycle.priority=70", "cycle.period=2ms",
					   "cycle.priority=71" };
	static const char text[] = "cycle:\n  priority: 60\n  cpu: 2\n";
	static struct config cfg;
	char path[] = "/tmp/ecdaq-assemble-XXXXXX";
	int fd = mkstemp(path);
	char error[256] = "";

	CHECK(fd >= 0);
	CHECK_EQ(write(fd, text, sizeof(text) - 1), sizeof(text) - 1);
	CHECK_EQ(close(fd), 0);
	CHECK_EQ(config_assemble(path, set, 3, &cfg, error, sizeof(error)), 0);
	CHECK_EQ(unlink(path), 0);
	CHECK_EQ(cfg.cycle_priority, 71);
	CHECK_EQ(cfg.cycle_cpu, 2);
	CHECK_EQ(cfg.cycle_period_ns, 2000000);
	CHECK_EQ(config_assemble(NULL, set, 1, &cfg, error, sizeof(error)), 0);
	CHECK_EQ(cfg.cycle_priority, 70);
	CHECK_EQ(cfg.cycle_cpu, -1);
	CHECK_STR(error, "");
}

TEST(config, a_command_line_ends_at_its_first_mistake)
{
	static const char *const set[] = { "cycle.priority=many", "cycle.perid=1ms" };
	static struct config cfg;
	char error[256] = "";

	CHECK_EQ(config_assemble("/absent.yaml", set, 2, &cfg, error, sizeof(error)), -ENOENT);
	CHECK(strstr(error, "/absent.yaml") != NULL);
	CHECK_EQ(config_assemble(NULL, set, 2, &cfg, error, sizeof(error)), -EINVAL);
	CHECK(strstr(error, "cycle.priority: ") == error);
}
