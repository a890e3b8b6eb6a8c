/* SPDX-License-Identifier: MIT */
#include "daemon/home.h"

#include <errno.h>
#include <fcntl.h>
#include <grp.h>
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

enum { DIR_MODE = 0750, SHARED_MODE = 03770, FILE_MODE = 0640, GROUP_BYTES = 4096 };

int home_path(const struct home *home, const char *file, char *ret_path, size_t path_bytes)
{
	int len = snprintf(ret_path, path_bytes, "%s/%s", home->dir, file);

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

static int find_group(struct home *home, const char *name, struct failure *failure)
{
	struct group entry;
	struct group *found = NULL;
	char buf[GROUP_BYTES];

	home->group = (gid_t)-1;
	if (name[0] == '\0') {
		return 0;
	}
	getgrnam_r(name, &entry, buf, sizeof(buf), &found);
	if (found == NULL) {
		return failure_set(failure, EXIT_CODE_CONFIG, -ENOENT,
				   "runtime.group: no group is named %s", name);
	}
	home->group = found->gr_gid;
	return 0;
}

/* The recorder and the publisher, other users of the group, lay pages of their own beside ours: the
 * group may make files. Each belongs to the group (set-group-ID), and only its maker takes it away
 * (sticky). */
static int hand_to_group(const struct home *home, struct failure *failure)
{
	if (home->group == (gid_t)-1) {
		return 0;
	}
	if (chown(home->dir, (uid_t)-1, home->group) < 0 || chmod(home->dir, SHARED_MODE) < 0) {
		return fail(failure, home->dir, errno);
	}
	return 0;
}

static int make_dir(struct home *home, struct failure *failure)
{
	struct stat st;
	struct statfs fs;

	if (mkdir(home->dir, DIR_MODE) == 0) {
		/* Not what the umask leaves of it. */
		if (chmod(home->dir, DIR_MODE) < 0) {
			return fail(failure, home->dir, errno);
		}
	} else if (errno != EEXIST) {
		return fail(failure, home->dir, errno);
	}
	if (lstat(home->dir, &st) < 0 || statfs(home->dir, &fs) < 0) {
		return fail(failure, home->dir, errno);
	}
	if (!S_ISDIR(st.st_mode)) {
		return fail(failure, home->dir, ENOTDIR);
	}
	/* In a directory of somebody else, our files could be swapped under us (/dev/shm is open to
	 * all). */
	if (st.st_uid != geteuid() && st.st_uid != 0) {
		return failure_set(failure, EXIT_CODE_PERMISSION, -EPERM,
				   "%s: belongs to user %u, not to this one", home->dir, st.st_uid);
	}
	home->is_tmpfs = fs.f_type == TMPFS_MAGIC || fs.f_type == RAMFS_MAGIC;
	return hand_to_group(home, failure);
}

static int busy(const struct home *home, struct failure *failure)
{
	char pid[24] = "";
	ssize_t len = pread(home->lock, pid, sizeof(pid) - 1, 0);

	pid[len > 0 ? strcspn(pid, "\n") : 0] = '\0';
	return failure_set(failure, EXIT_CODE_BUSY, -EBUSY,
			   "%s: another ecdaqd is running here%s%s%s", home->dir,
			   pid[0] != '\0' ? " (pid " : "", pid, pid[0] != '\0' ? ")" : "");
}

static int lock_dir(struct home *home, struct failure *failure)
{
	char path[CONFIG_PATH_BYTES + 16];
	char pid[24];
	int len;

	if (home_path(home, "lock", path, sizeof(path)) < 0) {
		return fail(failure, home->dir, ENAMETOOLONG);
	}
	home->lock = open(path, O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, FILE_MODE);
	if (home->lock < 0) {
		return fail(failure, path, errno);
	}
	if (flock(home->lock, LOCK_EX | LOCK_NB) < 0) {
		return errno == EWOULDBLOCK ? busy(home, failure) : fail(failure, path, errno);
	}
	len = snprintf(pid, sizeof(pid), "%d\n", (int)getpid());
	if (ftruncate(home->lock, 0) < 0 || pwrite(home->lock, pid, (size_t)len, 0) != len) {
		return fail(failure, path, errno);
	}
	return 0;
}

static int make_page(struct home *home, const struct config *cfg, const struct platform *platform,
		     enum home_segment segment, struct failure *failure)
{
	char path[CONFIG_PATH_BYTES + 16];
	struct status_page *page;

	if (home_path(home, CONFIG_RUN_STATUS, path, sizeof(path)) < 0) {
		return fail(failure, home->dir, ENAMETOOLONG);
	}
	page = status_create(path, STATUS_MAGIC, sizeof(*page), FILE_MODE);
	if (page == NULL) {
		return fail(failure, path, errno);
	}
	home->page = page;
	page->is_simulated = segment == HOME_SIMULATED;
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

static int make_events(struct home *home, const struct config *cfg, struct failure *failure)
{
	char path[CONFIG_PATH_BYTES + 16];
	int r;

	if (home_path(home, CONFIG_RUN_EVENTS, path, sizeof(path)) < 0) {
		return fail(failure, home->dir, ENAMETOOLONG);
	}
	r = ring_create(&(struct ring_spec){ .path = path,
					     .kind = "event",
					     .payload_bytes = sizeof(struct event),
					     .slot_count = cfg->event_depth,
					     .meta = NULL,
					     .meta_bytes = 0,
					     .period_ns = 0,
					     .file_mode = FILE_MODE },
			&home->events);
	return r < 0 ? fail(failure, path, -r) : 0;
}

static int make_remote(struct home *home, struct failure *failure)
{
	home->remote = board_create_shared(&home->remote_fd);
	return home->remote == NULL ? fail(failure, "remote command board", errno) : 0;
}

int home_open(struct home *home, const struct config *cfg, const struct platform *platform,
	      enum home_segment segment, struct failure *failure)
{
	int r;

	memset(home, 0, sizeof(*home));
	home->lock = -1;
	home->remote_fd = -1;
	if (config_run_path(cfg, "", home->dir, sizeof(home->dir)) < 0) {
		return failure_set(failure, EXIT_CODE_CONFIG, -ENAMETOOLONG,
				   "runtime.run_dir: the path is too long");
	}
	for (size_t len = strlen(home->dir); len > 1 && home->dir[len - 1] == '/'; len--) {
		home->dir[len - 1] = '\0';
	}
	r = find_group(home, cfg->group, failure);
	if (r == 0) {
		r = make_dir(home, failure);
	}
	if (r == 0) {
		r = lock_dir(home, failure);
	}
	if (r == 0) {
		r = make_page(home, cfg, platform, segment, failure);
	}
	if (r == 0) {
		r = make_events(home, cfg, failure);
	}
	if (r == 0) {
		r = make_remote(home, failure);
	}
	return r;
}

void home_close(struct home *home)
{
	if (home->events != NULL) {
		ring_close(home->events);
		ring_destroy(home->events);
		home->events = NULL;
	}
	if (home->remote != NULL) {
		board_unmap(home->remote);
		home->remote = NULL;
	}
	if (home->remote_fd >= 0) {
		close(home->remote_fd);
		home->remote_fd = -1;
	}
	if (home->page != NULL) {
		status_unmap(home->page, sizeof(*home->page));
		home->page = NULL;
	}
	if (home->lock >= 0) {
		close(home->lock);
		home->lock = -1;
	}
}

void home_say(struct home *home, const char *text)
{
	status_text_set(&home->page->text_sequence, home->page->message,
			sizeof(home->page->message), text);
}

int home_claim_interface(const char *name, struct failure *failure)
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
