/* SPDX-License-Identifier: MIT */
#include "daemon/run_dir.h"

#include <errno.h>
#include <fcntl.h>
#include <ftw.h>
#include <grp.h>
#include <stddef.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "harness/test.h"

struct bench {
	char root[64];
	struct config cfg;
	struct platform platform;
};

static void bench_open(struct bench *b, const char *parent)
{
	snprintf(b->root, sizeof(b->root), "%s/ecdaqd-run-XXXXXX", parent);
	CHECK(mkdtemp(b->root) != NULL);
	config_defaults(&b->cfg);
	snprintf(b->cfg.run_dir, sizeof(b->cfg.run_dir), "%s/run", b->root);
	snprintf(b->cfg.interface, sizeof(b->cfg.interface), "eth9");
	b->platform = platform_posix();
}

static int forget(const char *path, const struct stat *st, int kind, struct FTW *ftw)
{
	(void)st;
	(void)kind;
	(void)ftw;
	return remove(path);
}

static void bench_close(const struct bench *b)
{
	CHECK_EQ(nftw(b->root, forget, 8, FTW_DEPTH | FTW_PHYS), 0);
}

static int open_home(struct bench *b, struct run_dir *run, struct failure *failure)
{
	return run_dir_open(run, &b->cfg, &b->platform, RUN_DIR_REAL, failure);
}

TEST(run_dir, it_makes_a_directory_for_owner_and_group_with_page_and_ring)
{
	static struct bench b;
	struct run_dir run;
	struct failure failure;
	struct stat st;
	char path[512];
	static struct status_page page;

	bench_open(&b, "/dev/shm");
	CHECK_EQ(open_home(&b, &run, &failure), 0);
	CHECK_EQ(stat(b.cfg.run_dir, &st), 0);
	CHECK_EQ(st.st_mode & 07777, 0750);
	CHECK_EQ(run.is_tmpfs, 1);
	CHECK_EQ(run_dir_path(&run, CONFIG_RUN_STATUS, path, sizeof(path)), 0);
	CHECK_EQ(stat(path, &st), 0);
	CHECK_EQ(st.st_mode & 07777, 0640);
	CHECK_EQ(status_read(path, STATUS_MAGIC, sizeof(page),
			     offsetof(struct status_page, text_sequence), &page),
		 0);
	CHECK_EQ(page.pid, getpid());
	CHECK_STR(page.interface, "eth9");
	CHECK_EQ(page.bus_state, BUS_DOWN);
	CHECK_EQ(run_dir_path(&run, CONFIG_RUN_EVENTS, path, sizeof(path)), 0);
	CHECK_EQ(access(path, R_OK), 0);
	run_dir_close(&run);
	bench_close(&b);
}

TEST(run_dir, a_second_instance_is_rejected_and_leaves_the_page_of_the_first_unchanged)
{
	static struct bench b;
	struct run_dir first;
	struct run_dir second;
	struct failure failure;
	char wanted[32];

	bench_open(&b, "/dev/shm");
	CHECK_EQ(open_home(&b, &first, &failure), 0);
	run_dir_set_message(&first, "the first");
	CHECK_EQ(open_home(&b, &second, &failure), -EBUSY);
	CHECK_EQ(failure.code, EXIT_CODE_BUSY);
	snprintf(wanted, sizeof(wanted), "running here (pid %d)", getpid());
	CHECK(strstr(failure.text, wanted) != NULL);
	run_dir_close(&second);
	CHECK_STR(first.page->message, "the first");
	run_dir_close(&first);
	CHECK_EQ(open_home(&b, &second, &failure), 0); /* the lock went with the first */
	run_dir_close(&second);
	bench_close(&b);
}

TEST(run_dir, group_members_can_read_and_cannot_add_files)
{
	static struct bench b;
	struct run_dir run;
	struct failure failure;
	struct stat st;
	struct group *group = getgrgid(getegid());

	CHECK(group != NULL);
	bench_open(&b, "/dev/shm");
	snprintf(b.cfg.group, sizeof(b.cfg.group), "%s", group->gr_name);
	CHECK_EQ(open_home(&b, &run, &failure), 0);
	CHECK_EQ(stat(b.cfg.run_dir, &st), 0);
	CHECK_EQ(st.st_mode & 07777, 02750);
	CHECK_EQ(st.st_gid, getegid());
	run_dir_close(&run);
	bench_close(&b);
}

/* What another member of the directory's group gets who makes @path. */
static int made_by_a_member(const char *path, gid_t group)
{
	int status = 0;
	pid_t pid = fork();

	CHECK(pid >= 0);
	if (pid == 0) {
		if (setgroups(0, NULL) < 0 || setgid(group) < 0 || setuid(12345) < 0) {
			_exit(255);
		}
		_exit(open(path, O_WRONLY | O_CREAT, 0600) < 0 ? errno : 0);
	}
	CHECK_EQ(waitpid(pid, &status, 0), pid);
	CHECK(WIFEXITED(status));
	return WEXITSTATUS(status);
}

TEST(run_dir, a_member_of_the_group_cannot_take_the_name_of_a_page_to_come)
{
	static struct bench b;
	struct run_dir run;
	struct failure failure;
	char path[512];

	if (geteuid() != 0) {
		SKIP("needs root to be two users");
	}
	bench_open(&b, "/dev/shm");
	CHECK_EQ(chmod(b.root, 0755), 0);
	snprintf(b.cfg.group, sizeof(b.cfg.group), "daemon");
	CHECK_EQ(open_home(&b, &run, &failure), 0);
	CHECK_EQ(run_dir_path(&run, CONFIG_RUN_STATUS, path, sizeof(path)), 0);
	CHECK_EQ(made_by_a_member(path, run.group), EACCES); /* it may read it only */
	CHECK_EQ(run_dir_path(&run, CONFIG_RUN_SAMPLES ".new", path, sizeof(path)), 0);
	CHECK_EQ(made_by_a_member(path, run.group), EACCES);
	run_dir_close(&run);
	bench_close(&b);
}

TEST(run_dir, who_reads_who_commands_and_who_sets_outputs_are_three_groups)
{
	static struct bench b;
	struct run_dir run;
	struct failure failure;

	if (geteuid() != 0) {
		SKIP("needs root to give files to another group");
	}
	bench_open(&b, "/dev/shm");
	snprintf(b.cfg.group, sizeof(b.cfg.group), "daemon");
	snprintf(b.cfg.admin_group, sizeof(b.cfg.admin_group), "adm");
	snprintf(b.cfg.remote_group, sizeof(b.cfg.remote_group), "mail");
	CHECK_EQ(open_home(&b, &run, &failure), 0);
	CHECK_EQ(run.group, getgrnam("daemon")->gr_gid);
	CHECK_EQ(run.admin_group, getgrnam("adm")->gr_gid);
	CHECK_EQ(run.remote_group, getgrnam("mail")->gr_gid);
	run_dir_close(&run);
	snprintf(b.cfg.remote_group, sizeof(b.cfg.remote_group), "no-such-group-9");
	CHECK_EQ(open_home(&b, &run, &failure), -ENOENT);
	CHECK_STR(failure.text, "runtime.remote_group: no-such-group-9: no such group");
	run_dir_close(&run);
	bench_close(&b);
}

TEST(run_dir, an_unknown_group_is_a_configuration_error)
{
	static struct bench b;
	struct run_dir run;
	struct failure failure;

	bench_open(&b, "/dev/shm");
	snprintf(b.cfg.group, sizeof(b.cfg.group), "no-such-group-9");
	CHECK_EQ(open_home(&b, &run, &failure), -ENOENT);
	CHECK_EQ(failure.code, EXIT_CODE_CONFIG);
	CHECK_STR(failure.text, "runtime.group: no-such-group-9: no such group");
	run_dir_close(&run);
	bench_close(&b);
}

TEST(run_dir, files_belong_to_the_configured_group)
{
	static struct bench b;
	struct run_dir run;
	struct failure failure;
	struct stat st;
	char path[512];

	if (geteuid() != 0) {
		SKIP("needs root to give files to another group");
	}
	bench_open(&b, "/dev/shm");
	snprintf(b.cfg.group, sizeof(b.cfg.group), "daemon");
	CHECK_EQ(open_home(&b, &run, &failure), 0);
	CHECK(run.group != (gid_t)-1 && run.group != 0);
	CHECK_EQ(stat(b.cfg.run_dir, &st), 0);
	CHECK_EQ(st.st_gid, run.group);
	CHECK_EQ(run_dir_path(&run, CONFIG_RUN_STATUS, path, sizeof(path)), 0);
	CHECK_EQ(stat(path, &st), 0);
	CHECK_EQ(st.st_gid, run.group);
	run_dir_close(&run);
	bench_close(&b);
}

TEST(run_dir, a_directory_of_another_user_is_not_trusted)
{
	static struct bench b;
	struct run_dir run;
	struct failure failure;

	if (geteuid() != 0) {
		SKIP("needs root to make another user's directory");
	}
	bench_open(&b, "/dev/shm");
	CHECK_EQ(mkdir(b.cfg.run_dir, 0777), 0);
	CHECK_EQ(chown(b.cfg.run_dir, 12345, 12345), 0);
	CHECK_EQ(open_home(&b, &run, &failure), -EPERM);
	CHECK_EQ(failure.code, EXIT_CODE_PERMISSION);
	CHECK(strstr(failure.text, "belongs to user 12345") != NULL);
	run_dir_close(&run);
	bench_close(&b);
}

TEST(run_dir, a_path_that_cannot_be_created_is_named)
{
	static struct bench b;
	struct run_dir run;
	struct failure failure;
	char path[512];
	int fd;

	bench_open(&b, "/dev/shm");
	snprintf(b.cfg.run_dir, sizeof(b.cfg.run_dir), "%s/not/there", b.root);
	CHECK_EQ(open_home(&b, &run, &failure), -ENOENT);
	CHECK_EQ(failure.code, EXIT_CODE_CONFIG);
	CHECK(strstr(failure.text, "/not/there") != NULL);
	run_dir_close(&run);
	snprintf(path, sizeof(path), "%s/file", b.root);
	fd = open(path, O_CREAT | O_WRONLY, 0600);
	CHECK(fd >= 0);
	close(fd);
	snprintf(b.cfg.run_dir, sizeof(b.cfg.run_dir), "%s/file", b.root);
	CHECK_EQ(open_home(&b, &run, &failure), -ENOTDIR);
	run_dir_close(&run);
	bench_close(&b);
}

TEST(run_dir, a_directory_that_is_not_in_memory_is_noticed)
{
	static struct bench b;
	struct run_dir run;
	struct failure failure;

	bench_open(&b, "/var/tmp");
	CHECK_EQ(open_home(&b, &run, &failure), 0);
	if (run.is_tmpfs) {
		SKIP("/var/tmp is a tmpfs here");
	}
	run_dir_close(&run);
	bench_close(&b);
}

TEST(run_dir, an_interface_is_claimed_once)
{
	struct failure failure;
	int first = run_dir_claim_interface("test-nic-0", &failure);
	int other;

	CHECK(first >= 0);
	CHECK_EQ(run_dir_claim_interface("test-nic-0", &failure), -EBUSY);
	CHECK_EQ(failure.code, EXIT_CODE_BUSY);
	CHECK_STR(failure.text, "test-nic-0: another ecdaqd is running on this interface");
	other = run_dir_claim_interface("test-nic-1", &failure);
	CHECK(other >= 0);
	close(other);
	close(first);
	first = run_dir_claim_interface("test-nic-0", &failure);
	CHECK(first >= 0);
	close(first);
}
