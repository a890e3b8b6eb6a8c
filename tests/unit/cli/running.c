/* SPDX-License-Identifier: MIT */
#include "cli/running.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/status.h"
#include "harness/test.h"

enum { FOUND = 3, PATH_BYTES = 128 };

static char parent[PATH_BYTES];
static char system_dir[PATH_BYTES + 16];
static struct running found[FOUND];

static void make_parent(void)
{
	snprintf(parent, sizeof(parent), "/tmp/ecdaq-running-XXXXXX");
	CHECK(mkdtemp(parent) != NULL);
	snprintf(system_dir, sizeof(system_dir), "%s/system", parent);
}

static void remove_parent(void)
{
	char *const words[] = { (char *)"rm", (char *)"-r", parent, NULL };
	int status = -1;
	pid_t child = fork();

	if (child == 0) {
		execvp("rm", words);
		_exit(1);
	}
	CHECK_EQ(waitpid(child, &status, 0), child);
	CHECK_EQ(status, 0);
}

/* A run directory @name with the status page of process @pid. */
static void make_run_dir(const char *name, int64_t pid)
{
	char path[2 * PATH_BYTES];
	struct status_page *page;

	snprintf(path, sizeof(path), "%s/%s", parent, name);
	CHECK_EQ(mkdir(path, 0755), 0);
	snprintf(path, sizeof(path), "%s/%s/%s", parent, name, CONFIG_RUN_STATUS);
	page = status_create(path, STATUS_MAGIC, sizeof(*page), 0644);
	CHECK(page != NULL);
	page->pid = pid;
	snprintf(page->interface, sizeof(page->interface), "nic-%.20s", name);
}

/* A process that is no more. */
static pid_t dead_pid(void)
{
	pid_t child = fork();

	if (child == 0) {
		_exit(0);
	}
	CHECK_EQ(waitpid(child, NULL, 0), child);
	return child;
}

TEST(running, none_is_found_where_there_is_no_directory)
{
	CHECK_EQ(running_find("/nonexistent/a", "/nonexistent/b", found, FOUND), 0);
}

TEST(running, the_one_whose_process_lives_is_found)
{
	char expected[PATH_BYTES + 16];

	make_parent();
	make_run_dir("ecdaq-0", dead_pid());
	make_run_dir("ecdaq-run-abc", getpid());
	make_run_dir("other", getpid());
	CHECK_EQ(running_find(system_dir, parent, found, FOUND), 1);
	snprintf(expected, sizeof(expected), "%s/ecdaq-run-abc/", parent);
	CHECK_STR(found[0].dir, expected);
	CHECK_STR(found[0].interface, "nic-ecdaq-run-abc");
	CHECK_EQ(found[0].pid, getpid());
	CHECK_EQ(found[0].is_simulated, 0);
	remove_parent();
}

TEST(running, several_come_in_order_up_to_the_limit)
{
	make_parent();
	make_run_dir("ecdaq-b", getpid());
	make_run_dir("system", getpid());
	make_run_dir("ecdaq-a", getpid());
	CHECK_EQ(running_find(system_dir, parent, found, FOUND), 3);
	CHECK_STR(found[0].interface, "nic-system");
	CHECK_STR(found[1].interface, "nic-ecdaq-a");
	CHECK_STR(found[2].interface, "nic-ecdaq-b");
	CHECK_EQ(running_find(system_dir, parent, found, 2), 2);
	remove_parent();
}

TEST(running, what_is_no_status_page_of_ours_is_passed_over)
{
	char path[2 * PATH_BYTES];
	char target[2 * PATH_BYTES];
	int fd;

	make_parent();
	make_run_dir("target", getpid());
	snprintf(target, sizeof(target), "%s/target", parent);
	snprintf(path, sizeof(path), "%s/ecdaq-link", parent);
	CHECK_EQ(symlink(target, path), 0); /* somebody could have put it there */
	snprintf(path, sizeof(path), "%s/ecdaq-broken", parent);
	CHECK_EQ(mkdir(path, 0755), 0);
	snprintf(path, sizeof(path), "%s/ecdaq-broken/%s", parent, CONFIG_RUN_STATUS);
	fd = open(path, O_CREAT | O_WRONLY, 0644);
	CHECK(fd >= 0);
	CHECK_EQ(write(fd, "no page", 7), 7);
	close(fd);
	CHECK_EQ(running_find(system_dir, parent, found, FOUND), 0);
	remove_parent();
}
