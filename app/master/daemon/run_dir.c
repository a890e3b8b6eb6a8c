/* SPDX-License-Identifier: MIT */
#include "daemon/run_dir.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/magic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/vfs.h>
#include <unistd.h>

#include "base/event.h"
#include "base/group.h"

enum { DIR_MODE = 0750, SHARED_MODE = 02750, FILE_MODE = 0640 };

int run_dir_path(const struct run_dir *run, const char *file, char *ret_path, size_t path_bytes)
{
	int len = snprintf(ret_path, path_bytes, "%s/%s", run->dir, file);

	return len < 0 || (size_t)len >= path_bytes ? -ENAMETOOLONG : 0;
}

static enum exit_code code_of(int err)
{
	switch (err) {
	case EACCES:
	case EPERM:
	case EROFS:
		return EXIT_CODE_PERMISSION;
	case ENOSPC:
	case ENOMEM:
	case EDQUOT:
	case EMFILE:
		return EXIT_CODE_RESOURCES;
	case ENOENT:
	case ENOTDIR:
	case ENAMETOOLONG:
		return EXIT_CODE_CONFIG;
	default:
		return EXIT_CODE_FAILED;
	}
}

static int fail(struct failure *failure, const char *what, int err)
{
	return failure_set(failure, code_of(err), -err, "%s: %s%s", what, strerror(err),
			   err == ENOSPC ? " (a smaller ring.depth needs less)" : "");
}

/* The group that is configured as @option has to be there; without one @usual is taken where it can
 * be. */
static int find_group(const char *option, const char *name, const char *usual, gid_t *ret_group,
		      struct failure *failure)
{
	if (group_find(name, usual, ret_group) < 0) {
		return failure_set(failure, EXIT_CODE_CONFIG, -ENOENT, "%s: %s: no such group",
				   option, name);
	}
	return 0;
}

static int find_groups(struct run_dir *run, const struct config *cfg, struct failure *failure)
{
	int r = find_group("runtime.group", cfg->group, "ecdaq-read", &run->group, failure);

	r = r < 0 ? r
		  : find_group("runtime.admin_group", cfg->admin_group, "ecdaq-admin",
			       &run->admin_group, failure);
	return r < 0 ? r
		     : find_group("runtime.remote_group", cfg->remote_group, "ecdaq-remote",
				  &run->remote_group, failure);
}

/* What is made in it belongs to the group as well (set-group-ID). A directory that is so already is
 * left alone: the service's sandbox forbids the bit. */
static int hand_to_group(const struct run_dir *run, const struct stat *st, struct failure *failure)
{
	if (run->group == (gid_t)-1 ||
	    (st->st_gid == run->group && (st->st_mode & 07777) == SHARED_MODE)) {
		return 0;
	}
	if (chown(run->dir, (uid_t)-1, run->group) < 0 || chmod(run->dir, SHARED_MODE) < 0) {
		return fail(failure, run->dir, errno);
	}
	return 0;
}

static int make_dir(struct run_dir *run, struct failure *failure)
{
	struct stat st;
	struct statfs fs;

	if (mkdir(run->dir, DIR_MODE) == 0) {
		/* Not what the umask leaves of it. */
		if (chmod(run->dir, DIR_MODE) < 0) {
			return fail(failure, run->dir, errno);
		}
	} else if (errno != EEXIST) {
		return fail(failure, run->dir, errno);
	}
	if (lstat(run->dir, &st) < 0 || statfs(run->dir, &fs) < 0) {
		return fail(failure, run->dir, errno);
	}
	if (!S_ISDIR(st.st_mode)) {
		return fail(failure, run->dir, ENOTDIR);
	}
	/* In another user's directory our files could be replaced (/dev/shm is writable for all).
	 */
	if (st.st_uid != geteuid() && st.st_uid != 0) {
		return failure_set(failure, EXIT_CODE_PERMISSION, -EPERM,
				   "%s: belongs to user %u, not to this one", run->dir, st.st_uid);
	}
	run->is_tmpfs = fs.f_type == TMPFS_MAGIC || fs.f_type == RAMFS_MAGIC;
	return hand_to_group(run, &st, failure);
}

static int busy(const struct run_dir *run, struct failure *failure)
{
	char pid[24] = "";
	ssize_t len = pread(run->lock, pid, sizeof(pid) - 1, 0);

	pid[len > 0 ? strcspn(pid, "\n") : 0] = '\0';
	return failure_set(failure, EXIT_CODE_BUSY, -EBUSY,
			   "%s: another ecdaqd is running here%s%s%s", run->dir,
			   pid[0] != '\0' ? " (pid " : "", pid, pid[0] != '\0' ? ")" : "");
}

static int lock_dir(struct run_dir *run, struct failure *failure)
{
	char path[CONFIG_PATH_BYTES + 16];
	char pid[24];
	int len;

	if (run_dir_path(run, "lock", path, sizeof(path)) < 0) {
		return fail(failure, run->dir, ENAMETOOLONG);
	}
	run->lock = open(path, O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, FILE_MODE);
	if (run->lock < 0) {
		return fail(failure, path, errno);
	}
	if (flock(run->lock, LOCK_EX | LOCK_NB) < 0) {
		return errno == EWOULDBLOCK ? busy(run, failure) : fail(failure, path, errno);
	}
	len = snprintf(pid, sizeof(pid), "%d\n", (int)getpid());
	if (ftruncate(run->lock, 0) < 0 || pwrite(run->lock, pid, (size_t)len, 0) != len) {
		return fail(failure, path, errno);
	}
	return 0;
}

static int make_page(struct run_dir *run, const struct config *cfg, const struct platform *platform,
		     enum run_dir_segment segment, struct failure *failure)
{
	char path[CONFIG_PATH_BYTES + 16];
	struct status_page *page;

	if (run_dir_path(run, CONFIG_RUN_STATUS, path, sizeof(path)) < 0) {
		return fail(failure, run->dir, ENAMETOOLONG);
	}
	page = status_create(path, STATUS_MAGIC, sizeof(*page), FILE_MODE);
	if (page == NULL) {
		return fail(failure, path, errno);
	}
	run->page = page;
	page->is_simulated = segment == RUN_DIR_SIMULATED;
	page->pid = getpid();
	page->start_tai_ns = platform->tai_ns(platform->ctx);
	page->period_ns = (uint64_t)cfg->cycle_period_ns;
	snprintf(page->version, sizeof(page->version), "%s", ECDAQ_VERSION);
	snprintf(page->interface, sizeof(page->interface), "%s", cfg->interface);
	atomic_store_explicit(&page->slaves_expected, (uint32_t)cfg->slave_count,
			      memory_order_relaxed);
	atomic_store_explicit(&page->cycle_cpu, ~UINT32_C(0), memory_order_relaxed);
	return 0;
}

static int make_events(struct run_dir *run, const struct config *cfg, struct failure *failure)
{
	char path[CONFIG_PATH_BYTES + 16];
	int r;

	if (run_dir_path(run, CONFIG_RUN_EVENTS, path, sizeof(path)) < 0) {
		return fail(failure, run->dir, ENAMETOOLONG);
	}
	r = ring_create(&(struct ring_spec){ .path = path,
					     .kind = "event",
					     .payload_bytes = sizeof(struct event),
					     .slot_count = cfg->event_depth,
					     .meta = NULL,
					     .meta_bytes = 0,
					     .period_ns = 0,
					     .file_mode = FILE_MODE },
			&run->events);
	return r < 0 ? fail(failure, path, -r) : 0;
}

static int make_remote(struct run_dir *run, struct failure *failure)
{
	run->remote = board_create_shared(&run->remote_fd);
	return run->remote == NULL ? fail(failure, "remote command board", errno) : 0;
}

int run_dir_open(struct run_dir *run, const struct config *cfg, const struct platform *platform,
		 enum run_dir_segment segment, struct failure *failure)
{
	int r;

	memset(run, 0, sizeof(*run));
	run->lock = -1;
	run->remote_fd = -1;
	if (config_run_path(cfg, "", run->dir, sizeof(run->dir)) < 0) {
		return failure_set(failure, EXIT_CODE_CONFIG, -ENAMETOOLONG,
				   "runtime.run_dir: the path is too long");
	}
	for (size_t len = strlen(run->dir); len > 1 && run->dir[len - 1] == '/'; len--) {
		run->dir[len - 1] = '\0';
	}
	r = find_groups(run, cfg, failure);
	if (r == 0) {
		r = make_dir(run, failure);
	}
	if (r == 0) {
		r = lock_dir(run, failure);
	}
	if (r == 0) {
		r = make_page(run, cfg, platform, segment, failure);
	}
	if (r == 0) {
		r = make_events(run, cfg, failure);
	}
	if (r == 0) {
		r = make_remote(run, failure);
	}
	return r;
}

void run_dir_close(struct run_dir *run)
{
	if (run->events != NULL) {
		ring_close(run->events);
		ring_destroy(run->events);
		run->events = NULL;
	}
	if (run->remote != NULL) {
		board_unmap(run->remote);
		run->remote = NULL;
	}
	if (run->remote_fd >= 0) {
		close(run->remote_fd);
		run->remote_fd = -1;
	}
	if (run->page != NULL) {
		status_unmap(run->page, sizeof(*run->page));
		run->page = NULL;
	}
	if (run->lock >= 0) {
		close(run->lock);
		run->lock = -1;
	}
}

void run_dir_set_message(struct run_dir *run, const char *text)
{
	status_text_set(&run->page->text_sequence, run->page->message, sizeof(run->page->message),
			text);
}

int run_dir_claim_interface(const char *name, struct failure *failure)
{
	/* The abstract socket namespace belongs to the network namespace, as the names of NICs do.
	 */
	struct sockaddr_un address = { .sun_family = AF_UNIX };
	int len =
		snprintf(address.sun_path + 1, sizeof(address.sun_path) - 1, "ecdaq/nic/%s", name);
	int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);

	if (fd < 0) {
		return fail(failure, name, errno);
	}
	if (bind(fd, (const struct sockaddr *)&address,
		 (socklen_t)(offsetof(struct sockaddr_un, sun_path) + 1 + (size_t)len)) < 0) {
		int err = errno;

		close(fd);
		if (err == EADDRINUSE) {
			return failure_set(failure, EXIT_CODE_BUSY, -EBUSY,
					   "%s: another ecdaqd is running on this interface", name);
		}
		return fail(failure, name, err);
	}
	return fd;
}
