/* SPDX-License-Identifier: MIT */
/* The machine as the doctor reads it: files below a root, and calls. */
#include "cli/probe.h"

#include <errno.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <sys/timex.h>
#include <unistd.h>

#include "harness/test.h"

static char root[32];
static const struct probe made = { .root = root };
static const struct probe here = { .root = "" };

static void begin(void)
{
	char path[64];

	snprintf(root, sizeof(root), "/tmp/ecdaq-doctor-XXXXXX");
	CHECK(mkdtemp(root) != NULL);
	snprintf(path, sizeof(path), "%s/calls", root);
	CHECK_EQ(mkdir(path, 0700), 0);
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

static void end(const char *names)
{
	char path[128];
	size_t len;

	for (; *names != '\0'; names += len + (names[len] == ' ')) {
		len = strcspn(names, " ");
		snprintf(path, sizeof(path), "%s/%.*s", root, (int)len, names);
		CHECK_EQ(unlink(path), 0);
	}
	snprintf(path, sizeof(path), "%s/calls", root);
	CHECK_EQ(rmdir(path), 0);
	CHECK_EQ(rmdir(root), 0);
}

TEST(doctor_probe, texts_lose_the_blanks_at_their_end)
{
	char text[PROBE_TEXT_BYTES] = "before";
	int64_t number = 77;

	begin();
	put("text", "ondemand \n\n");
	put("number", "-950000\n");
	CHECK_EQ(probe_text(&made, text, "/%s", "text"), 8);
	CHECK_STR(text, "ondemand");
	CHECK_EQ(probe_number(&made, &number, "/number"), 0);
	CHECK_EQ(number, -950000);
	end("text number");
}

TEST(doctor_probe, what_cannot_be_read_leaves_the_output_untouched)
{
	char text[PROBE_TEXT_BYTES] = "before";
	char long_name[PROBE_PATH_BYTES];
	int64_t number = 77;

	begin();
	put("text", "12 monkeys");
	put("large", "99999999999999999999");
	memset(long_name, 'a', sizeof(long_name));
	long_name[sizeof(long_name) - 1] = '\0';
	CHECK_EQ(probe_text(&made, text, "/absent"), -ENOENT);
	CHECK_EQ(probe_text(&made, text, "/calls"), -EISDIR);
	CHECK_EQ(probe_text(&made, text, "/%s", long_name), -ENAMETOOLONG);
	CHECK_EQ(probe_link(&made, text, "/text"), -EINVAL);
	CHECK_EQ(probe_number(&made, &number, "/text"), -EBADMSG);
	CHECK_EQ(probe_number(&made, &number, "/large"), -EBADMSG);
	CHECK_EQ(probe_number(&made, &number, "/absent"), -ENOENT);
	CHECK(probe_open(&made, "/absent") == NULL);
	CHECK_EQ(errno, ENOENT);
	CHECK(!probe_exists(&made, "/absent"));
	CHECK(probe_exists(&made, "/text"));
	CHECK_STR(text, "before");
	CHECK_EQ(number, 77);
	end("text large");
}

TEST(doctor_probe, a_call_of_another_machine_is_answered_by_a_file)
{
	char text[PROBE_TEXT_BYTES] = "before";
	int64_t value = 77;

	begin();
	CHECK_EQ(probe_call(&made, "eee", "ecat0", text), -ENOENT);
	put("calls/eee.ecat0", "unsupported\n");
	CHECK_EQ(probe_call(&made, "eee", "ecat0", text), -EOPNOTSUPP);
	CHECK_EQ(probe_call(&made, "no_such_call", "ecat0", text), -EINVAL);
	CHECK_STR(text, "before");
	put("calls/eee.ecat0", "active 0\nenabled 1\n");
	CHECK_EQ(probe_call(&made, "eee", "ecat0", text), 18);
	CHECK_EQ(probe_figure(text, "enabled", &value), 0);
	CHECK_EQ(value, 1);
	CHECK_EQ(probe_figure(text, "active", &value), 0);
	CHECK_EQ(value, 0);
	end("calls/eee.ecat0");
}

TEST(doctor_probe, a_figure_that_is_missing_or_no_number_leaves_the_output_untouched)
{
	static const char text[] = "rx_us 50\nrx many\nframes \nadaptive 1 2\nlast -7";
	int64_t value = 77;

	CHECK_EQ(probe_figure(text, "us", &value), -EBADMSG);
	CHECK_EQ(probe_figure(text, "rx", &value), -EBADMSG);
	CHECK_EQ(probe_figure(text, "rx_", &value), -EBADMSG);
	CHECK_EQ(probe_figure(text, "frames", &value), -EBADMSG);
	CHECK_EQ(probe_figure(text, "adaptive", &value), -EBADMSG);
	CHECK_EQ(probe_figure("", "rx", &value), -EBADMSG);
	CHECK_EQ(value, 77);
	CHECK_EQ(probe_figure(text, "rx_us", &value), 0);
	CHECK_EQ(value, 50);
	CHECK_EQ(probe_figure(text, "last", &value), 0);
	CHECK_EQ(value, -7);
	CHECK_EQ(probe_parse("0x50005", &value), 0);
	CHECK_EQ(value, 0x50005);
}

TEST(doctor_probe, no_file_can_bring_the_separator_of_a_finding)
{
	char text[PROBE_TEXT_BYTES];

	begin();
	put("text", "ondemand\x1f"
		    "rm -rf /");
	CHECK_EQ(probe_text(&made, text, "/text"), 17);
	CHECK_STR(text, "ondemand?rm -rf /");
	end("text");
}

TEST(doctor_probe, loopback_has_an_address_and_neither_eee_nor_coalescing)
{
	char text[PROBE_TEXT_BYTES] = "before";

	CHECK_EQ(probe_call(&here, "eee", "lo", text), -EOPNOTSUPP);
	CHECK_EQ(probe_call(&here, "coalesce", "lo", text), -EOPNOTSUPP);
	CHECK_EQ(probe_call(&here, "eee", "absent0", text), -ENODEV);
	CHECK_EQ(probe_call(&here, "coalesce", "absent0", text), -ENODEV);
	CHECK_STR(text, "before");
	CHECK_EQ(probe_call(&here, "addresses", "absent0", text), 0);
	if (probe_call(&here, "addresses", "lo", text) == 0) {
		SKIP("loopback has no address here");
	}
	CHECK(strstr(text, "127.0.0.1") != NULL || strstr(text, "::1") != NULL);
}

static int64_t figure_of(const char *name, const char *object, const char *key)
{
	char text[PROBE_TEXT_BYTES];
	int64_t value = 0;

	CHECK(probe_call(&here, name, object, text) > 0);
	CHECK_EQ(probe_figure(text, key, &value), 0);
	return value;
}

TEST(doctor_probe, the_disk_of_a_folder_that_is_not_there_yet_is_that_of_its_parent)
{
	static const char absent[] = "/tmp/absent-folder/of/recordings";
	char text[PROBE_TEXT_BYTES];
	struct statvfs vfs;

	CHECK_EQ(statvfs("/tmp", &vfs), 0);
	CHECK_EQ(figure_of("disk", absent, "bytes_total"), vfs.f_blocks * vfs.f_frsize);
	CHECK_EQ(figure_of("disk", absent, "inodes_total"), vfs.f_files);
	CHECK_EQ(figure_of("disk", absent, "read_only"), (vfs.f_flag & ST_RDONLY) != 0);
	CHECK(figure_of("disk", absent, "bytes_free") <= figure_of("disk", absent, "bytes_total"));
	CHECK_EQ(probe_call(&here, "disk", "/proc/self/status/x", text), -ENOTDIR);
	CHECK_EQ(figure_of("disk", "/proc", "bytes_total"), 0);
}

TEST(doctor_probe, the_clock_is_that_of_adjtimex)
{
	struct timex before = { .modes = 0 };
	struct timex after = { .modes = 0 };
	int64_t tai_s;
	int64_t is_synchronised;
	int64_t error_us;

	/* The kernel's bound grows with time, or is set anew when the clock is steered. */
	do {
		CHECK(adjtimex(&before) >= 0);
		tai_s = figure_of("clock", "", "tai_offset_s");
		is_synchronised = figure_of("clock", "", "synchronised");
		error_us = figure_of("clock", "", "error_us");
		CHECK(adjtimex(&after) >= 0);
	} while (after.maxerror < before.maxerror || after.status != before.status);
	CHECK_EQ(tai_s, after.tai);
	CHECK_EQ(is_synchronised, (after.status & STA_UNSYNC) == 0);
	CHECK(error_us >= before.maxerror && error_us <= after.maxerror);
}
