/* SPDX-License-Identifier: MIT */
/* How a line is found, asked for and refused: against a libgpiod of our own. */
#include "sync0/gpio.h"

#include <errno.h>
#include <gpiod.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "harness/test.h"
#include "sync0/calibrate_live.h"
#include "unit/services/sync0/fake_gpiod.h"

static char why[GPIO_WHY_BYTES];
static struct gpio *gpio;

/* A /dev with so many chips. */
static const char *dev_with(unsigned chips)
{
	static char dir[64];
	char path[96];

	snprintf(dir, sizeof(dir), "/tmp/ecdaq-unit-%d-dev%u", (int)getpid(), chips);
	mkdir(dir, 0700);
	for (unsigned i = 0; i < chips; i++) {
		FILE *f;

		snprintf(path, sizeof(path), "%s/gpiochip%u", dir, i);
		f = fopen(path, "we");
		CHECK(f != NULL);
		fclose(f);
	}
	return dir;
}

static void remove_dev(const char *dir, unsigned chips)
{
	for (unsigned i = 0; i < chips; i++) {
		char path[96];

		snprintf(path, sizeof(path), "%s/gpiochip%u", dir, i);
		unlink(path);
	}
	rmdir(dir);
}

static int open_with(const char *line, unsigned chips, enum config_edge_clock clock)
{
	const struct gpio_spec spec = {
		.line = line, .dev_dir = dev_with(chips), .buffer = 1024, .clock = clock
	};
	int r = gpio_open(&spec, &gpio, why);

	remove_dev(spec.dev_dir, chips);
	return r;
}

TEST(sync0_gpio, a_line_is_found_by_chip_label_and_asked_for_as_it_must_be)
{
	fake_gpiod_reset();
	CHECK_EQ(open_with("pinctrl-test:17", 1, CONFIG_EDGE_AUTO), 0);
	CHECK_EQ(fake_gpiod.asked_offset, 17);
	CHECK_EQ(fake_gpiod.asked_edge, GPIOD_LINE_EDGE_RISING);
	CHECK_EQ(fake_gpiod.asked_debounce_us, 0);
	CHECK_EQ(fake_gpiod.asked_buffer, 1024);
	CHECK_EQ(fake_gpiod.asked_clock, GPIOD_LINE_CLOCK_MONOTONIC);
	CHECK(!gpio_is_hte(gpio));
	gpio_close(gpio);
	CHECK_EQ(fake_gpiod.live, 0);
}

TEST(sync0_gpio, hardware_timestamps_are_taken_where_there_are_some)
{
	fake_gpiod_reset();
	fake_gpiod.has_hte = 1;
	CHECK_EQ(open_with("pinctrl-test:17", 1, CONFIG_EDGE_AUTO), 0);
	CHECK(gpio_is_hte(gpio));
	gpio_close(gpio);
	CHECK_EQ(open_with("pinctrl-test:17", 1, CONFIG_EDGE_MONOTONIC), 0);
	CHECK(!gpio_is_hte(gpio));
	gpio_close(gpio);
	fake_gpiod.has_hte = 0;
	CHECK_EQ(open_with("pinctrl-test:17", 1, CONFIG_EDGE_HTE), -EOPNOTSUPP);
	CHECK(strstr(why, "sync0.clock") != NULL);
	CHECK_EQ(fake_gpiod.live, 0);
}

TEST(sync0_gpio, a_line_is_found_by_its_name)
{
	fake_gpiod_reset();
	fake_gpiod.name_of_5 = "SYNC0_A";
	CHECK_EQ(open_with("SYNC0_A", 1, CONFIG_EDGE_AUTO), 0);
	CHECK_EQ(fake_gpiod.asked_offset, 5);
	gpio_close(gpio);
	CHECK_EQ(open_with("SYNC0_B", 1, CONFIG_EDGE_AUTO), -ENOENT);
	CHECK_STR(why, "no line of this name on: pinctrl-test");
	CHECK_EQ(open_with("SYNC0_A", 2, CONFIG_EDGE_AUTO), -ENOTUNIQ);
	CHECK_EQ(fake_gpiod.live, 0);
}

/* Only LABEL:NUMBER is a chip and an offset. */
TEST(sync0_gpio, a_name_that_resembles_a_label_and_a_number_is_a_name)
{
	static const char *const names[] = { "pinctrl-test:17x", "pinctrl-test:65536",
					     "pinctrl-test:99999999999999999999" };

	for (size_t i = 0; i < sizeof(names) / sizeof(names[0]); i++) {
		fake_gpiod_reset();
		fake_gpiod.name_of_5 = names[i];
		CHECK_EQ(open_with(names[i], 1, CONFIG_EDGE_AUTO), 0);
		CHECK_EQ(fake_gpiod.asked_offset, 5);
		gpio_close(gpio);
		CHECK_EQ(fake_gpiod.live, 0);
	}
}

TEST(sync0_gpio, each_reason_for_refusal_is_one_clear_line)
{
	fake_gpiod_reset();
	CHECK_EQ(open_with("pinctrl-test:17", 0, CONFIG_EDGE_AUTO), -ENOENT);
	CHECK(strstr(why, "this machine has no GPIO chip") != NULL);
	CHECK_EQ(open_with("pinctrl-bcm2711:17", 1, CONFIG_EDGE_AUTO), -ENOENT);
	CHECK_STR(why, "no chip of this label; there are: pinctrl-test");
	CHECK_EQ(open_with("pinctrl-test:54", 1, CONFIG_EDGE_AUTO), -ERANGE);
	CHECK_STR(why, "chip pinctrl-test has lines 0 to 53 only");
	fake_gpiod.open_error = EACCES;
	CHECK_EQ(open_with("pinctrl-test:17", 1, CONFIG_EDGE_AUTO), -EACCES);
	CHECK(strstr(why, "no permission to open") != NULL);
	fake_gpiod.open_error = 0;
	fake_gpiod.request_error = EBUSY;
	fake_gpiod.consumer = "w1-gpio";
	CHECK_EQ(open_with("pinctrl-test:17", 1, CONFIG_EDGE_AUTO), -EBUSY);
	CHECK_STR(why, "already used by w1-gpio");
	fake_gpiod.consumer = NULL;
	CHECK_EQ(open_with("pinctrl-test:17", 1, CONFIG_EDGE_AUTO), -EBUSY);
	CHECK_STR(why, "already used by another program");
	fake_gpiod.request_error = EPERM;
	CHECK_EQ(open_with("pinctrl-test:17", 1, CONFIG_EDGE_AUTO), -EACCES);
	CHECK_STR(why, "no permission to use it");
	fake_gpiod.request_error = ENXIO;
	CHECK_EQ(open_with("pinctrl-test:17", 1, CONFIG_EDGE_AUTO), -ENXIO);
	CHECK(strstr(why, "no interrupt") != NULL);
	fake_gpiod.request_error = EIO;
	CHECK_EQ(open_with("pinctrl-test:17", 1, CONFIG_EDGE_AUTO), -EIO);
	CHECK_EQ(fake_gpiod.live, 0);
}

TEST(sync0_gpio, edges_come_with_time_and_number_and_nobody_waits_for_them)
{
	struct edge edges[4];

	fake_gpiod_reset();
	CHECK_EQ(open_with("pinctrl-test:17", 1, CONFIG_EDGE_AUTO), 0);
	CHECK_EQ(gpio_read(gpio, edges, 4), 0);
	fake_gpiod_edge(123456789, 7);
	CHECK_EQ(gpio_read(gpio, edges, 4), 1);
	CHECK_EQ(edges[0].mono_ns, 123456789);
	CHECK_EQ(edges[0].seqno, 7);
	CHECK_EQ(gpio_read(gpio, edges, 4), 0);
	fake_gpiod_unplug();
	CHECK_EQ(gpio_read(gpio, edges, 4), -ENODEV);
	gpio_close(gpio);
	CHECK_EQ(fake_gpiod.live, 0);
}

static int64_t mono_ns(void)
{
	struct timespec ts;

	clock_gettime(CLOCK_MONOTONIC, &ts);
	return (int64_t)ts.tv_sec * 1000000000 + ts.tv_nsec;
}

TEST(sync0_gpio, a_hardware_timestamp_is_converted_to_the_monotonic_clock)
{
	struct edge edges[4];
	int64_t first_ns;

	fake_gpiod_reset();
	fake_gpiod.has_hte = 1;
	CHECK_EQ(open_with("pinctrl-test:17", 1, CONFIG_EDGE_AUTO), 0);
	first_ns = mono_ns();
	fake_gpiod_edge(1000, 1); /* the engine was started long after the machine */
	CHECK_EQ(gpio_read(gpio, edges, 4), 1);
	CHECK(edges[0].mono_ns >= first_ns);
	CHECK(edges[0].mono_ns <= mono_ns());
	first_ns = edges[0].mono_ns;
	/* Of two edges the distance counts that the engine saw, not when they were read. */
	fake_gpiod_edge(1001, 2);
	CHECK_EQ(gpio_read(gpio, edges, 4), 1);
	CHECK_EQ(edges[0].mono_ns - first_ns, 1);
	gpio_close(gpio);
	CHECK_EQ(fake_gpiod.live, 0);
}

TEST(sync0_gpio, a_chip_that_fails_to_be_read_is_told)
{
	struct edge edges[4];

	fake_gpiod_reset();
	CHECK_EQ(open_with("pinctrl-test:17", 1, CONFIG_EDGE_AUTO), 0);
	fake_gpiod_edge(1, 1);
	fake_gpiod.read_error = ENODEV;
	CHECK_EQ(gpio_read(gpio, edges, 4), -ENODEV);
	gpio_close(gpio);
}

TEST(sync0_gpio, a_calibration_that_is_stopped_or_has_no_line_stores_nothing)
{
	static struct config cfg;
	static char said[512];
	static const volatile sig_atomic_t stopped = 1;
	char error[256];
	char dev[64];

	fake_gpiod_reset();
	config_defaults(&cfg);
	CHECK_EQ(config_set(&cfg, "sync0.calibration=/nonexistent/c", error, sizeof(error)), 0);
	CHECK_EQ(calibrate_live(&cfg, "/dev", &stopped, stdout, said), -ENOENT);
	CHECK_STR(said, "no slave has a line: set slaves[].sync0_line");
	CHECK_EQ(config_set(&cfg, "slaves[0].sync0_line=pinctrl-test:1", error, sizeof(error)), 0);
	CHECK_EQ(calibrate_live(&cfg, "/dev", &stopped, stdout, said), -EINVAL);
	CHECK(strstr(said, "requires the same signal on two lines") != NULL);
	CHECK_EQ(config_set(&cfg, "slaves[1].sync0_line=pinctrl-test:2", error, sizeof(error)), 0);
	snprintf(dev, sizeof(dev), "%s", dev_with(1));
	CHECK_EQ(calibrate_live(&cfg, dev, &stopped, stdout, said), -EINTR);
	CHECK_STR(said, "stopped after 0 and 0 of 10000 edges: nothing is stored");
	fake_gpiod.request_error = EBUSY;
	fake_gpiod.consumer = "w1-gpio";
	CHECK_EQ(calibrate_live(&cfg, dev, &stopped, stdout, said), -EBUSY);
	CHECK_STR(said, "line 'pinctrl-test:1' of slave 0: already used by w1-gpio");
	fake_gpiod.request_error = EPERM;
	CHECK_EQ(calibrate_live(&cfg, dev, &stopped, stdout, said), -EACCES);
	remove_dev(dev, 1);
	CHECK_EQ(calibrate_live(&cfg, dev, &stopped, stdout, said), -ENOENT);
	CHECK_EQ(fake_gpiod.live, 0);
}
