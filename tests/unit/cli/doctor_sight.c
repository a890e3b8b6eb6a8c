/* SPDX-License-Identifier: MIT */
/* What the doctor sees of a machine: files below a root, and calls. */
#include "cli/doctor/sight.h"

#include <errno.h>
#include <sys/stat.h>
#include <unistd.h>

#include "cli/doctor/finding.h"
#include "harness/test.h"

static char root[32];
static const struct sight made = { .root = root };
static const struct sight here = { .root = "" };

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

TEST(doctor_sight, texts_lose_the_blanks_at_their_end)
{
	char text[SIGHT_TEXT_BYTES] = "before";
	int64_t number = 77;

	begin();
	put("text", "ondemand \n\n");
	put("number", "-950000\n");
	CHECK_EQ(sight_text(&made, text, "/%s", "text"), 8);
	CHECK_STR(text, "ondemand");
	CHECK_EQ(sight_number(&made, &number, "/number"), 0);
	CHECK_EQ(number, -950000);
	end("text number");
}

TEST(doctor_sight, what_cannot_be_read_leaves_the_output_untouched)
{
	char text[SIGHT_TEXT_BYTES] = "before";
	char long_name[SIGHT_PATH_BYTES];
	int64_t number = 77;

	begin();
	put("text", "12 monkeys");
	put("large", "99999999999999999999");
	memset(long_name, 'a', sizeof(long_name));
	long_name[sizeof(long_name) - 1] = '\0';
	CHECK_EQ(sight_text(&made, text, "/absent"), -ENOENT);
	CHECK_EQ(sight_text(&made, text, "/calls"), -EISDIR);
	CHECK_EQ(sight_text(&made, text, "/%s", long_name), -ENAMETOOLONG);
	CHECK_EQ(sight_link(&made, text, "/text"), -EINVAL);
	CHECK_EQ(sight_number(&made, &number, "/text"), -EBADMSG);
	CHECK_EQ(sight_number(&made, &number, "/large"), -EBADMSG);
	CHECK_EQ(sight_number(&made, &number, "/absent"), -ENOENT);
	CHECK(sight_open(&made, "/absent") == NULL);
	CHECK_EQ(errno, ENOENT);
	CHECK(!sight_exists(&made, "/absent"));
	CHECK(sight_exists(&made, "/text"));
	CHECK_STR(text, "before");
	CHECK_EQ(number, 77);
	end("text large");
}

TEST(doctor_sight, a_call_of_another_machine_is_answered_by_a_file)
{
	struct sight_eee eee = { .is_enabled = 77 };

	begin();
	CHECK_EQ(sight_eee(&made, "ecat0", &eee), -ENOENT);
	put("calls/eee.ecat0", "enabled 1\n");
	CHECK_EQ(sight_eee(&made, "ecat0", &eee), -EBADMSG); /* one figure is missing */
	put("calls/eee.ecat0", "enabled 1\nactive many\n");
	CHECK_EQ(sight_eee(&made, "ecat0", &eee), -EBADMSG);
	put("calls/eee.ecat0", "enabled 1\nactive 0\nodd 1\n");
	CHECK_EQ(sight_eee(&made, "ecat0", &eee), -EBADMSG);
	put("calls/eee.ecat0", "unsupported\n");
	CHECK_EQ(sight_eee(&made, "ecat0", &eee), -EOPNOTSUPP);
	CHECK_EQ(eee.is_enabled, 77);
	put("calls/eee.ecat0", "active 0\nenabled 1\n");
	CHECK_EQ(sight_eee(&made, "ecat0", &eee), 0);
	CHECK_EQ(eee.is_enabled, 1);
	CHECK_EQ(eee.is_active, 0);
	end("calls/eee.ecat0");
}

TEST(doctor_sight, addresses_of_another_machine_are_counted)
{
	char text[SIGHT_TEXT_BYTES] = "before";

	begin();
	CHECK_EQ(sight_addresses(&made, "ecat0", text), -ENOENT);
	CHECK_STR(text, "before");
	put("calls/addresses.ecat0", "192.0.2.9  fe80::1\n192.0.2.10\n");
	CHECK_EQ(sight_addresses(&made, "ecat0", text), 3);
	CHECK_STR(text, "192.0.2.9 fe80::1 192.0.2.10");
	end("calls/addresses.ecat0");
}

TEST(doctor_sight, loopback_has_an_address_and_neither_eee_nor_coalescing)
{
	char text[SIGHT_TEXT_BYTES];
	struct sight_coalesce coalesce;
	struct sight_eee eee;

	CHECK_EQ(sight_eee(&here, "lo", &eee), -EOPNOTSUPP);
	CHECK_EQ(sight_coalesce(&here, "lo", &coalesce), -EOPNOTSUPP);
	CHECK_EQ(sight_eee(&here, "absent0", &eee), -ENODEV);
	CHECK_EQ(sight_coalesce(&here, "absent0", &coalesce), -ENODEV);
	CHECK_EQ(sight_addresses(&here, "absent0", text), 0);
	if (sight_addresses(&here, "lo", text) == 0) {
		SKIP("loopback has no address here");
	}
	CHECK(strstr(text, "127.0.0.1") != NULL || strstr(text, "::1") != NULL);
}

TEST(doctor_sight, the_disk_of_a_folder_that_is_not_there_yet_is_that_of_its_parent)
{
	struct sight_disk disk = { .bytes_total = 0 };
	struct sight_disk parent = { .bytes_total = 0 };

	CHECK_EQ(sight_disk(&here, "/tmp", &parent), 0);
	CHECK(parent.bytes_total > 0 && parent.bytes_free >= 0);
	CHECK_EQ(sight_disk(&here, "/tmp/absent-folder/of/recordings", &disk), 0);
	CHECK_EQ(disk.bytes_total, parent.bytes_total);
	CHECK_EQ(sight_disk(&here, "/proc/self/status/x", &disk), -ENOTDIR);
}

TEST(doctor_sight, the_kernel_s_clock_is_asked)
{
	struct sight_clock clock = { .error_us = -1 };

	CHECK_EQ(sight_clock(&here, &clock), 0);
	CHECK(clock.is_synchronised == 0 || clock.is_synchronised == 1);
	CHECK(clock.error_us >= 0);
	CHECK(clock.tai_offset_s >= 0);
}

TEST(doctor_finding, what_is_closed_to_a_user_says_so)
{
	struct finding f = { .level = FINDING_OK };

	finding_unread(&f, "/dev/x", -EACCES);
	CHECK_EQ(f.level, FINDING_SKIP);
	CHECK_EQ(f.wants_root, 1);
	CHECK_STR(f.value, "/dev/x: closed to this user");
	CHECK_STR(f.mend, "run ecdaq doctor as root");
	f = (struct finding){ .level = FINDING_OK };
	finding_unread(&f, "/dev/x", -ENOENT);
	CHECK_EQ(f.level, FINDING_SKIP);
	CHECK_EQ(f.wants_root, 0);
	CHECK_STR(f.value, "/dev/x: not there");
	CHECK_STR(f.mend, "");
	finding_unread(&f, "/dev/x", -EIO);
	CHECK_STR(f.value, "/dev/x: Input/output error");
}
