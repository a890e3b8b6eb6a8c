/* SPDX-License-Identifier: MIT */
#include "record/upload_mark.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "harness/test.h"

enum { PATH_BYTES = 256 };

static const char name[] = "ecdaq-20260101T000000Z-0000000a-000001.mcap";

static struct upload_mark some_mark(void)
{
	struct upload_mark mark = { .bytes = UINT64_MAX,
				    .mtime_ns = INT64_MAX,
				    .key = "fleet/rig1/a.mcap",
				    .id = "2~ab/c+d=" };

	memset(mark.sha256, '0', UPLOAD_SHA256_CHARS);
	return mark;
}

TEST(upload_mark, what_is_written_is_read_back)
{
	struct upload_mark mark = some_mark();
	struct upload_mark again = { .bytes = 7 };
	char text[UPLOAD_MARK_BYTES];
	int len;

	for (int has_id = 0; has_id < 2; has_id++) {
		if (!has_id) {
			mark.id[0] = '\0';
		}
		len = upload_mark_format(&mark, text, sizeof(text));
		CHECK(len > 0);
		CHECK_EQ(upload_mark_parse(text, (size_t)len, &again), 0);
		CHECK_EQ(again.bytes, mark.bytes);
		CHECK_EQ(again.mtime_ns, mark.mtime_ns);
		CHECK_STR(again.sha256, mark.sha256);
		CHECK_STR(again.key, mark.key);
		CHECK_STR(again.id, mark.id);
		/* No part of it is a mark. */
		for (int cut = 0; cut < len; cut++) {
			struct upload_mark untouched = { .bytes = 7 };

			CHECK_EQ(upload_mark_parse(text, (size_t)cut, &untouched), -EBADMSG);
			CHECK_EQ(untouched.bytes, 7);
		}
		CHECK_EQ(upload_mark_format(&mark, text, (size_t)len), -EINVAL);
		mark = some_mark();
	}
}

TEST(upload_mark, a_value_that_cannot_be_read_back_is_not_written)
{
	struct upload_mark mark = some_mark();
	char text[UPLOAD_MARK_BYTES];

	snprintf(mark.id, sizeof(mark.id), "a\nkey=b");
	CHECK_EQ(upload_mark_format(&mark, text, sizeof(text)), -EINVAL);
	mark = some_mark();
	mark.mtime_ns = -1;
	CHECK_EQ(upload_mark_format(&mark, text, sizeof(text)), -EINVAL);
	mark = some_mark();
	mark.sha256[3] = 'G';
	CHECK_EQ(upload_mark_format(&mark, text, sizeof(text)), -EINVAL);
	mark = some_mark();
	mark.key[0] = '\0';
	CHECK_EQ(upload_mark_format(&mark, text, sizeof(text)), -EINVAL);
}

TEST(upload_mark, one_that_is_done_replaces_the_one_that_is_begun)
{
	struct upload_mark mark = some_mark();
	struct upload_mark found;
	struct store_entry entry = { .bytes = 1000 };
	char dir[PATH_BYTES];
	char path[PATH_BYTES * 2];
	int fd;

	snprintf(dir, sizeof(dir), "%s/ecdaq-mark-XXXXXX",
		 getenv("TMPDIR") != NULL ? getenv("TMPDIR") : "/tmp");
	CHECK(mkdtemp(dir) != NULL);
	snprintf(entry.name, sizeof(entry.name), "%s", name);
	mark.bytes = 1000;
	CHECK_EQ(upload_mark_load(dir, name, UPLOAD_MARK_BEGUN, &found), -ENOENT);
	CHECK_EQ(upload_mark_save(dir, name, UPLOAD_MARK_BEGUN, &mark), 0);
	CHECK_EQ(upload_mark_load(dir, name, UPLOAD_MARK_BEGUN, &found), 0);
	CHECK(!upload_mark_is_done(dir, &entry));
	CHECK_EQ(upload_mark_save(dir, name, UPLOAD_MARK_DONE, &mark), 0);
	CHECK_EQ(upload_mark_load(dir, name, UPLOAD_MARK_BEGUN, &found), -ENOENT);
	CHECK(upload_mark_is_done(dir, &entry));
	entry.bytes = 1001;
	CHECK(!upload_mark_is_done(dir, &entry));
	/* Cut off, as by a disk that lies. */
	snprintf(path, sizeof(path), "%s/%s.uploaded", dir, name);
	fd = open(path, O_WRONLY | O_CLOEXEC);
	CHECK(fd >= 0);
	CHECK_EQ(ftruncate(fd, 30), 0);
	close(fd);
	entry.bytes = 1000;
	CHECK(!upload_mark_is_done(dir, &entry));
	CHECK_EQ(upload_mark_load(dir, name, UPLOAD_MARK_DONE, &found), -EBADMSG);
	CHECK_EQ(upload_mark_remove(dir, name, UPLOAD_MARK_DONE), 0);
	CHECK_EQ(upload_mark_remove(dir, name, UPLOAD_MARK_DONE), 0);
	CHECK_EQ(rmdir(dir), 0);
	CHECK_EQ(upload_mark_save(dir, name, UPLOAD_MARK_BEGUN, &mark), -ENOENT);
}

TEST(upload_mark, its_file_name_tells_the_recording)
{
	enum upload_mark_kind kind = UPLOAD_MARK_BEGUN;
	char found[STORE_NAME_BYTES];
	char file[256];

	snprintf(file, sizeof(file), "%s.uploaded", name);
	CHECK(upload_mark_name(file, found, &kind));
	CHECK_STR(found, name);
	CHECK_EQ(kind, UPLOAD_MARK_DONE);
	snprintf(file, sizeof(file), "%s.uploading", name);
	CHECK(upload_mark_name(file, found, &kind));
	CHECK_EQ(kind, UPLOAD_MARK_BEGUN);
	CHECK(!upload_mark_name("holiday.mcap.uploaded", found, &kind));
	CHECK(!upload_mark_name(".uploaded", found, &kind));
	CHECK(!upload_mark_name(name, found, &kind));
}
