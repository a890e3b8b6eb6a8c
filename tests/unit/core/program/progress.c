/* SPDX-License-Identifier: MIT */
#include "program/progress.h"

#include <fcntl.h>
#include <stdlib.h>
#include <unistd.h>

#include "base/host_clock.h"
#include "harness/test.h"

static char shown[4096];

/* Standard error goes to a file from begin() to end(). */
static int kept = -1;
static char path[32];

static void begin(void)
{
	int fd;

	snprintf(path, sizeof(path), "/tmp/ecdaq-progress-XXXXXX");
	fd = mkstemp(path);
	CHECK(fd >= 0);
	fflush(stderr);
	kept = dup(STDERR_FILENO);
	CHECK(dup2(fd, STDERR_FILENO) >= 0);
	close(fd);
	progress_always();
}

static const char *end(void)
{
	int fd = open(path, O_RDONLY);
	ssize_t len;

	fflush(stderr);
	CHECK(dup2(kept, STDERR_FILENO) >= 0);
	close(kept);
	len = read(fd, shown, sizeof(shown) - 1);
	CHECK(len >= 0);
	shown[len] = '\0';
	close(fd);
	unlink(path);
	return shown;
}

/* Until so much time has passed that a picture is due. */
static void show(uint64_t done)
{
	int64_t start_ns = host_clock_ns(CLOCK_MONOTONIC);

	while (host_clock_ns(CLOCK_MONOTONIC) - start_ns < NS_PER_MS) {
	}
	progress_at(done);
}

TEST(progress, work_counted_in_words_has_per_cent_rate_and_time_left)
{
	int was_shown;

	begin();
	progress_begin_of("EEPROM", 1000, "words");
	show(250);
	was_shown = progress_end();
	CHECK(strstr(end(), "EEPROM:  25 %  ") == shown);
	CHECK(strstr(shown, " words/s  0:00 left\n") != NULL);
	CHECK_EQ(was_shown, 1);
}

TEST(progress, work_of_unknown_length_has_what_is_done_and_the_rate)
{
	begin();
	progress_begin_of("/a/long/way/firmware.bin", 0, NULL);
	show(3 << 20);
	progress_end();
	CHECK(strstr(end(), "firmware.bin: 3.0 MiB  ") == shown);
	CHECK(strstr(shown, " MiB/s\n") != NULL);
	CHECK(strstr(shown, "left") == NULL);
}

TEST(progress, work_that_never_showed_anything_leaves_no_line)
{
	int was_shown;

	begin();
	progress_begin("file", 100);
	was_shown = progress_end();
	CHECK_STR(end(), "");
	CHECK_EQ(was_shown, 0);
}
