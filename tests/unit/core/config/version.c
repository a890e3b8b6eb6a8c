/* SPDX-License-Identifier: MIT */
/* A configuration that is read again: what differs, and what is taken when. */
#include "config/version.h"

#include <errno.h>
#include <stdlib.h>
#include <unistd.h>

#include "base/limits.h"
#include "config/option.h"
#include "config/output.h"
#include "harness/test.h"

static struct config running_cfg;
static struct config wanted_cfg;
static struct config_version running = { .cfg = &running_cfg };
static struct config_version wanted = { .cfg = &wanted_cfg };
static char shown[65536];

static int read_text(struct config_version *version, const char *text)
{
	char path[] = "/tmp/ecdaq-version-XXXXXX";
	const struct config_source source = { .path = path };
	char error[256] = "";
	int fd = mkstemp(path);
	int r;

	CHECK(fd >= 0);
	CHECK_EQ(write(fd, text, strlen(text)), (ssize_t)strlen(text));
	close(fd);
	r = config_version_read(&source, version, error, sizeof(error));
	unlink(path);
	return r;
}

static void done(void)
{
	config_version_done(&running);
	config_version_done(&wanted);
}

/* The changes from @before to @after, a line each. */
static const char *changes(const char *before, const char *after)
{
	struct config_change *change;
	size_t count;
	size_t used = 0;

	done();
	CHECK_EQ(read_text(&running, before), 0);
	CHECK_EQ(read_text(&wanted, after), 0);
	CHECK_EQ(config_version_compare(&running, &wanted, &change, &count), 0);
	shown[0] = '\0';
	for (size_t i = 0; i < count; i++) {
		used += (size_t)config_change_format(&change[i], shown + used,
						     sizeof(shown) - used);
		used += (size_t)snprintf(shown + used, sizeof(shown) - used, "\n");
	}
	free(change);
	return shown;
}

TEST(config, a_changed_option_says_what_it_needs)
{
	CHECK_STR(changes("", "cycle:\n  period: 2ms\nbus:\n  op_timeout: 5s\n"
			      "record:\n  dir: /data\ndds:\n  domain: 3\nsync0:\n  window: 5s\n"),
		  "bus.op_timeout: 10s -> 5s: in effect\n"
		  "cycle.period: 1ms -> 2ms: needs a restart of ecdaqd\n"
		  "record.dir: /var/lib/ecdaq -> /data: needs a restart of ecdaq-record\n"
		  "dds.domain: 0 -> 3: needs a restart of ecdaq-dds\n"
		  "sync0.window: 10s -> 5s: needs a restart of ecdaq-sync0\n");
	done();
}

TEST(config, the_same_value_in_other_words_is_no_change)
{
	CHECK_STR(changes("cycle:\n  period: 1ms\nrecord:\n  enable: on\n",
			  "cycle:\n  period: 1000us\nrecord:\n  enable: yes\n"),
		  "");
	CHECK_STR(changes("slaves:\n  - {name: a, vendor: 2}\n",
			  "slaves:\n  - {name: a, vendor: 0x2}\n"),
		  "");
	done();
}

TEST(config, an_item_that_only_one_file_has_is_one_change)
{
	static const char two[] = "slaves:\n"
				  "  - name: a\n"
				  "  - name: b\n"
				  "    sdo:\n"
				  "      - {index: 0x8000, type: UINT, value: 1}\n"
				  "      - {index: 0x8001, type: UINT, value: 1}\n";

	CHECK_STR(changes("slaves:\n  - name: a\n", two),
		  "slaves[1]: none -> an item: needs a rescan\n");
	CHECK_STR(changes(two, "slaves:\n  - name: a\n  - name: b\n    sdo:\n"
			       "      - {index: 0x8000, type: UINT, value: 2}\n"),
		  "slaves[1].sdo[0].value: 1 -> 2: needs a rescan\n"
		  "slaves[1].sdo[1]: an item -> none: needs a rescan\n");
	done();
}

TEST(config, limits_of_an_output_are_taken_at_once_while_it_is_the_same_output)
{
	static const char before[] = "outputs:\n  - {channel: a.x, max: 1}\n"
				     "  - {channel: a.y, max: 1, owner: program}\n"
				     "  - {channel: a.z, max: 1}\n";

	CHECK_STR(changes(before, "outputs:\n  - {channel: a.x, max: 2, fail_safe: 1}\n"
				  "  - {channel: a.y, max: 2, owner: program}\n"
				  "  - {channel: a.q, max: 2}\n"),
		  "outputs[0].fail_safe: 0 -> 1: in effect\n"
		  "outputs[0].max: 1 -> 2: in effect\n"
		  "outputs[1].max: 1 -> 2: needs a rescan\n"
		  "outputs[2].channel: a.z -> a.q: needs a rescan\n"
		  "outputs[2].max: 1 -> 2: needs a rescan\n");
	CHECK_EQ(config_version_take_now(&running, &wanted), 0);
	CHECK(running_cfg.output[0].max == 2 && running_cfg.output[0].fail_safe == 1);
	CHECK(running_cfg.output[1].max == 1 && running_cfg.output[2].max == 1);
	CHECK_STR(running_cfg.output[2].channel, "a.z");
	done();
}

TEST(config, limits_of_an_output_beside_its_slave_are_taken_at_once_too)
{
	static const char before[] = "outputs:\n  - {channel: b.x, max: 1}\n"
				     "slaves:\n  - name: a\n    outputs:\n"
				     "      - {channel: x, max: 1}\n      - {channel: y, max: 1}\n"
				     "  - name: b\n";

	/* The lists in the other order: its items are the same. */
	CHECK_STR(changes(before, "slaves:\n  - name: a\n    outputs:\n"
				  "      - {channel: x, max: 2}\n      - {channel: q, max: 2}\n"
				  "  - name: b\noutputs:\n  - {channel: b.x, max: 3}\n"),
		  "slaves[0].outputs[0].max: 1 -> 2: in effect\n"
		  "slaves[0].outputs[1].channel: y -> q: needs a rescan\n"
		  "slaves[0].outputs[1].max: 1 -> 2: needs a rescan\n"
		  "outputs[0].max: 1 -> 3: in effect\n");
	CHECK_EQ(config_version_take_now(&running, &wanted), 0);
	CHECK(config_output_find(&running_cfg, "a.x")->max == 2);
	CHECK(config_output_find(&running_cfg, "a.y")->max == 1);
	CHECK(config_output_find(&running_cfg, "b.x")->max == 3);
	CHECK_STR(changes(before,
			  "outputs:\n  - {channel: b.x, max: 1}\n  - {channel: a.x, max: 1}\n"
			  "slaves:\n  - name: a\n    outputs:\n      - {channel: y, max: 1}\n"
			  "  - name: b\n"),
		  "slaves[0].outputs[0].channel: x -> y: needs a rescan\n"
		  "slaves[0].outputs[1]: an item -> none: needs a rescan\n"
		  "outputs[1]: none -> an item: needs a rescan\n");
	done();
}

static size_t count_changes(void)
{
	struct config_change *change;
	size_t count;

	CHECK_EQ(config_version_compare(&running, &wanted, &change, &count), 0);
	free(change);
	return count;
}

TEST(config, what_was_taken_is_no_longer_a_change)
{
	changes("", "cycle:\n  period: 2ms\nbus:\n  op_timeout: 5s\n  watchdog: 50ms\n"
		    "record:\n  dir: /data\nslaves:\n  - name: a\n");
	CHECK_EQ(count_changes(), 6); /* bus.presence, too */
	CHECK_EQ(config_version_take_now(&running, &wanted), 0);
	CHECK_EQ(running_cfg.bus_op_timeout_ns, INT64_C(5000000000));
	CHECK_EQ(running_cfg.bus_watchdog_ns, 100000000);
	CHECK_EQ(running_cfg.slave_count, 0);
	CHECK_EQ(count_changes(), 4);
	CHECK_EQ(config_version_take_rescan(&running, &wanted), 0);
	CHECK_EQ(running_cfg.bus_watchdog_ns, 50000000);
	CHECK_EQ(running_cfg.slave_count, 1);
	CHECK_EQ(running_cfg.cycle_period_ns, 1000000);
	CHECK_EQ(count_changes(), 1);
	done();
}

TEST(config, what_takes_effect_at_once_reaches_the_configuration_by_position)
{
	static struct config bound;

	CHECK_EQ(read_text(&running, "outputs:\n  - {channel: a.x, max: 1}\n"
				     "  - {channel: b.y, max: 5}\n"),
		 0);
	bound = running_cfg;
	bound.output[0] = running_cfg.output[1]; /* a is absent */
	bound.output_count = 1;
	running_cfg.output[1].max = 6;
	running_cfg.bus_recovery_attempts = 77;
	running_cfg.cycle_period_ns = 5;
	config_follow(&bound, &running_cfg);
	CHECK(bound.output[0].max == 6);
	CHECK_EQ(bound.bus_recovery_attempts, 77);
	CHECK_EQ(bound.cycle_period_ns, 1000000);
	done();
}

TEST(config, a_file_with_an_error_leaves_what_was_read_before)
{
	CHECK_EQ(read_text(&wanted, "cycle:\n  period: 2ms\n"), 0);
	CHECK_EQ(read_text(&wanted, "cycle:\n  perid: 3ms\n"), -EINVAL);
	CHECK_EQ(wanted_cfg.cycle_period_ns, 2000000);
	CHECK(wanted.texts != NULL);
	done();
}

TEST(config, a_long_value_is_cut_visibly)
{
	char text[400] = "record:\n  dir: \"/";
	size_t len = strlen(text);

	memset(text + len, 'x', 200);
	snprintf(text + len + 200, sizeof(text) - len - 200, "\"\n");
	CHECK(strstr(changes("", text), "x...: needs a restart of ecdaq-record\n") != NULL);
	done();
}

/* Of lists nothing needs a restart: the copy of a list is whole. */
TEST(config, an_item_of_a_list_never_needs_a_restart_of_the_master)
{
	for (size_t i = 0; i < option_count(); i++) {
		const struct option *option = option_at(i);

		if (strchr(option->name, '[') != NULL) {
			CHECK(option->effect != CONFIG_EFFECT_RESTART);
		}
	}
}

TEST(config, as_many_slaves_as_there_may_be_are_compared)
{
	char *text = NULL;
	size_t len = 0;
	FILE *out = open_memstream(&text, &len);

	CHECK(out != NULL);
	fputs("slaves:\n", out);
	for (int i = 0; i < LIMIT_SLAVES; i++) {
		fprintf(out, "  - {name: s%d, vendor: 2}\n", i);
	}
	fclose(out);
	CHECK_STR(changes(text, text), "");
	CHECK(strstr(changes("", text), "slaves[99]: none -> an item: needs a rescan\n") != NULL);
	free(text);
	done();
}
