/* SPDX-License-Identifier: MIT */
#include "cli/probe.h"

#include <arpa/inet.h>
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <ifaddrs.h>
#include <inttypes.h>
#include <linux/ethtool.h>
#include <linux/magic.h>
#include <linux/sockios.h>
#include <net/if.h>
#include <netinet/in.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/statfs.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/platform.h"

static int path_of(const struct probe *p, char path[PROBE_PATH_BYTES], const char *format,
		   va_list args) __attribute__((format(printf, 3, 0)));

static int path_of(const struct probe *p, char path[PROBE_PATH_BYTES], const char *format,
		   va_list args)
{
	int used = snprintf(path, PROBE_PATH_BYTES, "%s", p->root);
	int more;

	if (used < 0 || used >= PROBE_PATH_BYTES) {
		return -ENAMETOOLONG;
	}
	more = vsnprintf(path + used, (size_t)(PROBE_PATH_BYTES - used), format, args);
	return more < 0 || more >= PROBE_PATH_BYTES - used ? -ENAMETOOLONG : 0;
}

/* The path that a function with variable arguments was called for: @r is 0 or -errno. */
#define PATH_OF(r, p, path, format)                                                                \
	do {                                                                                       \
		va_list args;                                                                      \
		va_start(args, format);                                                            \
		(r) = path_of((p), path, format, args);                                            \
		va_end(args);                                                                      \
	} while (0)

static int open_path(const char *path)
{
	int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);

	return fd < 0 ? -errno : fd;
}

static int read_text(const char *path, char ret_text[PROBE_TEXT_BYTES])
{
	char text[PROBE_TEXT_BYTES];
	int fd = open_path(path);
	ssize_t len;

	if (fd < 0) {
		return fd;
	}
	len = read(fd, text, sizeof(text) - 1);
	if (len < 0) {
		int r = -errno;

		close(fd);
		return r;
	}
	close(fd);
	while (len > 0 && (unsigned char)text[len - 1] <= ' ') {
		len--;
	}
	text[len] = '\0';
	/* REMEDY separates the texts of a finding: no file may bring its own. */
	for (ssize_t i = 0; i < len; i++) {
		text[i] = text[i] == '\x1f' ? '?' : text[i];
	}
	memcpy(ret_text, text, (size_t)len + 1);
	return (int)len;
}

int probe_text(const struct probe *p, char ret_text[PROBE_TEXT_BYTES], const char *format, ...)
{
	char path[PROBE_PATH_BYTES];
	int r;

	PATH_OF(r, p, path, format);
	return r < 0 ? r : read_text(path, ret_text);
}

int probe_number(const struct probe *p, int64_t *ret, const char *format, ...)
{
	char text[PROBE_TEXT_BYTES];
	char path[PROBE_PATH_BYTES];
	int r;

	PATH_OF(r, p, path, format);
	if (r == 0) {
		r = read_text(path, text);
	}
	return r < 0 ? r : probe_parse(text, ret);
}

int probe_link(const struct probe *p, char ret_text[PROBE_TEXT_BYTES], const char *format, ...)
{
	char path[PROBE_PATH_BYTES];
	char target[PROBE_PATH_BYTES];
	const char *name;
	ssize_t len;
	int r;

	PATH_OF(r, p, path, format);
	if (r < 0) {
		return r;
	}
	len = readlink(path, target, sizeof(target) - 1);
	if (len < 0) {
		return -errno;
	}
	target[len] = '\0';
	name = strrchr(target, '/');
	return snprintf(ret_text, PROBE_TEXT_BYTES, "%s", name == NULL ? target : name + 1);
}

int probe_exists(const struct probe *p, const char *format, ...)
{
	char path[PROBE_PATH_BYTES];
	int r;

	PATH_OF(r, p, path, format);
	return r == 0 && access(path, F_OK) == 0;
}

FILE *probe_open(const struct probe *p, const char *format, ...)
{
	char path[PROBE_PATH_BYTES];
	FILE *file;
	int fd;
	int r;

	PATH_OF(r, p, path, format);
	fd = r < 0 ? r : open_path(path);
	if (fd < 0) {
		errno = -fd;
		return NULL;
	}
	file = fdopen(fd, "r");
	if (file == NULL) {
		close(fd);
	}
	return file;
}

int probe_path(const struct probe *p, char ret_path[PROBE_PATH_BYTES], const char *format, ...)
{
	char path[PROBE_PATH_BYTES];
	int r;

	PATH_OF(r, p, path, format);
	if (r == 0) {
		memcpy(ret_path, path, sizeof(path));
	}
	return r;
}

int probe_each(const struct probe *p, const char *dir, void (*each)(void *ctx, const char *name),
	       void *ctx)
{
	char path[PROBE_PATH_BYTES];
	const struct dirent *entry;
	int r = probe_path(p, path, "%s", dir);
	DIR *open_dir;

	if (r < 0) {
		return r;
	}
	open_dir = opendir(path);
	if (open_dir == NULL) {
		return -errno;
	}
	while ((entry = readdir(open_dir)) != NULL) {
		if (entry->d_name[0] != '.') {
			each(ctx, entry->d_name);
		}
	}
	closedir(open_dir);
	return 0;
}

int probe_parse(const char *text, int64_t *ret)
{
	long long value;
	char *end;

	errno = 0;
	value = strtoll(text, &end, strncmp(text, "0x", 2) == 0 ? 16 : 10);
	if (errno != 0 || end == text || *end != '\0') {
		return -EBADMSG;
	}
	*ret = value;
	return 0;
}

/* --- calls: each writes the text that a file would hold --- */

/* ethtool's commands that read need no right. */
static int ethtool(const char *nic, void *command)
{
	int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
	struct ifreq ifr = { 0 };
	int r;

	if (fd < 0) {
		return -errno;
	}
	snprintf(ifr.ifr_name, sizeof(ifr.ifr_name), "%s", nic);
	ifr.ifr_data = command;
	r = ioctl(fd, SIOCETHTOOL, &ifr) < 0 ? -errno : 0;
	close(fd);
	return r;
}

static int call_eee(const char *nic, char text[PROBE_TEXT_BYTES])
{
	struct ethtool_eee command = { .cmd = ETHTOOL_GEEE };
	int r = ethtool(nic, &command);

	snprintf(text, PROBE_TEXT_BYTES, "enabled %d\nactive %d\n", command.eee_enabled != 0,
		 command.eee_active != 0);
	return r;
}

static int call_coalesce(const char *nic, char text[PROBE_TEXT_BYTES])
{
	struct ethtool_coalesce command = { .cmd = ETHTOOL_GCOALESCE };
	int r = ethtool(nic, &command);

	snprintf(text, PROBE_TEXT_BYTES, "rx_us %u\nrx_frames %u\nadaptive %d\n",
		 command.rx_coalesce_usecs, command.rx_max_coalesced_frames,
		 command.use_adaptive_rx_coalesce != 0);
	return r;
}

/* "192.0.2.9", "fe80::1"; NULL for an address that is none of IP. */
static const char *address_text(const struct sockaddr *address, char text[INET6_ADDRSTRLEN])
{
	struct sockaddr_in v4;
	struct sockaddr_in6 v6;

	switch (address->sa_family) {
	case AF_INET:
		memcpy(&v4, address, sizeof(v4));
		return inet_ntop(AF_INET, &v4.sin_addr, text, INET6_ADDRSTRLEN);
	case AF_INET6:
		memcpy(&v6, address, sizeof(v6));
		return inet_ntop(AF_INET6, &v6.sin6_addr, text, INET6_ADDRSTRLEN);
	default:
		return NULL;
	}
}

/* Those that do not fit into the text are left out. */
static int call_addresses(const char *nic, char text[PROBE_TEXT_BYTES])
{
	struct ifaddrs *all;

	text[0] = '\0';
	if (getifaddrs(&all) < 0) {
		return -errno;
	}
	for (const struct ifaddrs *i = all; i != NULL; i = i->ifa_next) {
		size_t used = strlen(text);
		char host[INET6_ADDRSTRLEN];

		if (i->ifa_addr != NULL && strcmp(i->ifa_name, nic) == 0 &&
		    address_text(i->ifa_addr, host) != NULL &&
		    used + strlen(host) + 2 <= PROBE_TEXT_BYTES) {
			snprintf(text + used, PROBE_TEXT_BYTES - used, "%s%s", used > 0 ? " " : "",
				 host);
		}
	}
	freeifaddrs(all);
	return 0;
}

static int call_clock(const char *object, char text[PROBE_TEXT_BYTES])
{
	const struct platform platform = platform_posix();
	struct clock_quality quality;
	int r = platform.clock_quality(platform.ctx, &quality);

	(void)object;
	if (r < 0) {
		return r;
	}
	snprintf(text, PROBE_TEXT_BYTES,
		 "synchronised %d\nerror_us %" PRId64 "\ntai_offset_s %d\nutc_s %" PRId64 "\n",
		 quality.is_disciplined, quality.error_ns / 1000, quality.tai_offset_s,
		 (platform.tai_ns(platform.ctx) - quality.tai_offset_s * NS_PER_S) / NS_PER_S);
	return 0;
}

/* The file system that @dir is on, or will be on once it has been made. */
static int call_disk(const char *dir, char text[PROBE_TEXT_BYTES])
{
	char path[PROBE_PATH_BYTES];
	struct statvfs vfs;
	struct statfs fs;
	char *slash;

	if (snprintf(path, sizeof(path), "%s", dir) >= (int)sizeof(path)) {
		return -ENAMETOOLONG;
	}
	while (statvfs(path, &vfs) < 0) {
		slash = strrchr(path, '/');
		if (errno != ENOENT || slash == NULL) {
			return -errno;
		}
		slash[slash == path] = '\0';
	}
	if (statfs(path, &fs) < 0) {
		return -errno;
	}
	snprintf(text, PROBE_TEXT_BYTES,
		 "bytes_total %" PRIu64 "\nbytes_free %" PRIu64 "\ninodes_total %" PRIu64
		 "\ninodes_free %" PRIu64 "\nread_only %d\nmemory %d\n",
		 (uint64_t)(vfs.f_blocks * vfs.f_frsize), (uint64_t)(vfs.f_bavail * vfs.f_frsize),
		 (uint64_t)vfs.f_files, (uint64_t)vfs.f_favail, (vfs.f_flag & ST_RDONLY) != 0,
		 fs.f_type == TMPFS_MAGIC || fs.f_type == RAMFS_MAGIC);
	return 0;
}

/* Mailbox property interface: GET_THROTTLED; the value sent selects the sticky bits to clear. */
static int call_throttled(const char *object, char text[PROBE_TEXT_BYTES])
{
	enum { TAG = 0x00030046, TAG_VALUE = 5, WORDS = 7 };
	uint32_t message[WORDS] = { sizeof(message), 0, TAG, sizeof(uint32_t), 0, 0, 0 };
	int fd = open("/dev/vcio", O_RDONLY | O_CLOEXEC);
	int r;

	(void)object;
	if (fd < 0) {
		return -errno;
	}
	r = ioctl(fd, _IOWR(100, 0, char *), message) < 0 ? -errno : 0;
	close(fd);
	if (r == 0 && message[1] != UINT32_C(0x80000000)) {
		r = -EIO;
	}
	snprintf(text, PROBE_TEXT_BYTES, "flags %" PRIu32, message[TAG_VALUE]);
	return r;
}

int probe_call(const struct probe *p, const char *name, const char *object,
	       char ret_text[PROBE_TEXT_BYTES])
{
	static const struct {
		const char *name;
		int (*call)(const char *object, char text[PROBE_TEXT_BYTES]);
		int is_of_port;
	} calls[] = {
		{ "eee", call_eee, 1 },     { "coalesce", call_coalesce, 1 },
		{ "clock", call_clock, 0 }, { "addresses", call_addresses, 1 },
		{ "disk", call_disk, 0 },   { "throttled", call_throttled, 0 },
	};
	char text[PROBE_TEXT_BYTES];
	int r = -EINVAL;

	for (size_t i = 0; i < sizeof(calls) / sizeof(calls[0]); i++) {
		if (strcmp(calls[i].name, name) == 0 && p->root[0] == '\0') {
			r = calls[i].call(object, text);
		} else if (strcmp(calls[i].name, name) == 0) {
			r = probe_text(p, text, "/calls/%s%s%s", name,
				       calls[i].is_of_port ? "." : "",
				       calls[i].is_of_port ? object : "");
		}
	}
	if (r >= 0 && strcmp(text, "unsupported") == 0) {
		r = -EOPNOTSUPP;
	}
	return r < 0 ? r : snprintf(ret_text, PROBE_TEXT_BYTES, "%s", text);
}

int probe_figure(const char *text, const char *key, int64_t *ret)
{
	size_t key_len = strlen(key);
	char value[32];

	for (const char *line = text; *line != '\0'; line += line[0] == '\n') {
		size_t len = strcspn(line, "\n");

		if (len > key_len && strncmp(line, key, key_len) == 0 && line[key_len] == ' ') {
			snprintf(value, sizeof(value), "%.*s", (int)(len - key_len - 1),
				 line + key_len + 1);
			return probe_parse(value, ret);
		}
		line += len;
	}
	return -EBADMSG;
}
