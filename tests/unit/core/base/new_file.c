/* SPDX-License-Identifier: MIT */
#include "base/new_file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/run_path.h"
#include "harness/test.h"

enum { BYTES = 5000 };

static char dir[64];

static const char *in_dir(const char *name)
{
	static char path[128];

	snprintf(path, sizeof(path), "%s/%s", dir, name);
	return path;
}

static void begin(void)
{
	snprintf(dir, sizeof(dir), "/dev/shm/ecdaq-new-file-XXXXXX");
	CHECK(mkdtemp(dir) != NULL);
}

static void end(void)
{
	unlink(in_dir("page"));
	unlink(in_dir("victim"));
	CHECK_EQ(rmdir(dir), 0); /* no temporary file is left */
}

static void write_text(const char *name, const char *text)
{
	int fd = open(in_dir(name), O_WRONLY | O_CREAT | O_TRUNC, 0644);

	CHECK_EQ(write(fd, text, strlen(text)), (ssize_t)strlen(text));
	close(fd);
}

static void expect_text(const char *name, const char *text)
{
	char found[64] = "";
	int fd = open(in_dir(name), O_RDONLY);

	CHECK_EQ(read(fd, found, sizeof(found) - 1), (ssize_t)strlen(text));
	CHECK_STR(found, text);
	close(fd);
}

TEST(new_file, it_has_its_name_only_when_it_is_published)
{
	struct new_file file;
	struct stat st;
	char found[6] = "";
	int fd;

	begin();
	CHECK_EQ(new_file_create(in_dir("page"), 0640, BYTES, &file), 0);
	CHECK(access(in_dir("page"), F_OK) < 0);
	memcpy(file.map, "hello", 6);
	CHECK_EQ(new_file_publish(&file, in_dir("page")), 0);
	memcpy((char *)file.map, "j", 1); /* still the same memory */
	fd = open(in_dir("page"), O_RDONLY);
	CHECK_EQ(fstat(fd, &st), 0);
	CHECK_EQ(st.st_size, BYTES);
	CHECK_EQ(st.st_mode & 07777, 0640);
	CHECK_EQ(read(fd, found, 6), 6);
	CHECK_STR(found, "jello");
	close(fd);
	munmap(file.map, file.bytes);
	end();
}

TEST(new_file, a_file_or_link_of_the_temporary_name_is_replaced_and_not_written_into)
{
	struct new_file file;

	begin();
	write_text("victim", "untouched");
	CHECK_EQ(symlink("victim", in_dir("page.new")), 0);
	CHECK_EQ(new_file_create(in_dir("page"), 0640, BYTES, &file), 0);
	memcpy(file.map, "over", 4);
	CHECK_EQ(new_file_publish(&file, in_dir("page")), 0);
	munmap(file.map, file.bytes);
	expect_text("victim", "untouched");
	end();
}

TEST(new_file, a_directory_of_the_temporary_name_is_an_error)
{
	struct new_file file;

	begin();
	CHECK_EQ(mkdir(in_dir("page.new"), 0700), 0);
	CHECK_EQ(new_file_create(in_dir("page"), 0640, BYTES, &file), -EEXIST);
	CHECK_EQ(rmdir(in_dir("page.new")), 0);
	end();
}

TEST(new_file, a_failed_publication_leaves_nothing)
{
	struct new_file file;

	begin();
	CHECK_EQ(mkdir(in_dir("page"), 0700), 0);
	CHECK_EQ(new_file_create(in_dir("page"), 0640, BYTES, &file), 0);
	CHECK_EQ(new_file_publish(&file, in_dir("page")), -EISDIR);
	CHECK_EQ(rmdir(in_dir("page")), 0);
	end();
}

TEST(new_file, more_than_the_memory_is_refused_before_the_first_write)
{
	struct new_file file;

	begin();
	CHECK_EQ(new_file_create(in_dir("page"), 0640, UINT64_C(1) << 50, &file), -ENOSPC);
	end();
}

TEST(run_path, the_folder_of_a_file_is_made_once_and_for_its_group)
{
	struct stat above;
	struct stat st;

	begin();
	CHECK_EQ(chmod(dir, 02750), 0);
	CHECK_EQ(run_path_own_folder(in_dir("dds/status")), 0);
	CHECK_EQ(run_path_own_folder(in_dir("dds/status")), 0);
	CHECK_EQ(stat(dir, &above), 0);
	CHECK_EQ(stat(in_dir("dds"), &st), 0);
	CHECK_EQ(st.st_mode & 07777, 02750);
	CHECK_EQ(st.st_gid, above.st_gid);
	CHECK_EQ(rmdir(in_dir("dds")), 0);
	CHECK_EQ(run_path_own_folder(in_dir("none/dds/status")), -ENOENT);
	CHECK_EQ(run_path_own_folder("status"), -EINVAL);
	end();
}
