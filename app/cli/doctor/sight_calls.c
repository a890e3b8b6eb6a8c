/* SPDX-License-Identifier: MIT */
/* What only a system call tells of this machine; below another root, what its files say instead. */
#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <ifaddrs.h>
#include <linux/ethtool.h>
#include <linux/magic.h>
#include <linux/sockios.h>
#include <net/if.h>
#include <netinet/in.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/statfs.h>
#include <sys/statvfs.h>
#include <sys/timex.h>
#include <unistd.h>

#include "cli/doctor/sight.h"

struct figure {
	const char *key;
	int64_t *value;
};

static int is_this_machine(const struct sight *s)
{
	return s->root[0] == '\0';
}

/* One line "KEY VALUE" of a file that stands for a call. */
static int take_line(char *line, const struct figure *figures, size_t count, unsigned *seen)
{
	char *blank = strchr(line, ' ');
	long long value;
	char *end;

	if (strcmp(line, "unsupported\n") == 0) {
		return -EOPNOTSUPP;
	}
	if (blank == NULL) {
		return -EBADMSG;
	}
	*blank = '\0';
	errno = 0;
	value = strtoll(blank + 1, &end, 0);
	if (errno != 0 || end == blank + 1 || (*end != '\n' && *end != '\0')) {
		return -EBADMSG;
	}
	for (size_t i = 0; i < count; i++) {
		if (strcmp(figures[i].key, line) == 0) {
			*figures[i].value = value;
			*seen |= 1u << i;
			return 0;
		}
	}
	return -EBADMSG;
}

/* All figures must be there. */
static int from_file(const struct sight *s, const char *name, const struct figure *figures,
		     size_t count)
{
	FILE *file = sight_open(s, "/calls/%s", name);
	char line[SIGHT_TEXT_BYTES];
	unsigned seen = 0;
	int r = 0;

	if (file == NULL) {
		return -errno;
	}
	while (r == 0 && fgets(line, sizeof(line), file) != NULL) {
		r = take_line(line, figures, count, &seen);
	}
	fclose(file);
	return r == 0 && seen != (1u << count) - 1 ? -EBADMSG : r;
}

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

int sight_eee(const struct sight *s, const char *nic, struct sight_eee *ret)
{
	struct ethtool_eee command = { .cmd = ETHTOOL_GEEE };
	struct sight_eee eee = { 0 };
	char name[SIGHT_TEXT_BYTES];
	int r;

	if (is_this_machine(s)) {
		r = ethtool(nic, &command);
		eee.is_enabled = command.eee_enabled != 0;
		eee.is_active = command.eee_active != 0;
	} else {
		const struct figure figures[] = { { "enabled", &eee.is_enabled },
						  { "active", &eee.is_active } };

		snprintf(name, sizeof(name), "eee.%s", nic);
		r = from_file(s, name, figures, 2);
	}
	if (r == 0) {
		*ret = eee;
	}
	return r;
}

int sight_coalesce(const struct sight *s, const char *nic, struct sight_coalesce *ret)
{
	struct ethtool_coalesce command = { .cmd = ETHTOOL_GCOALESCE };
	struct sight_coalesce coalesce = { 0 };
	char name[SIGHT_TEXT_BYTES];
	int r;

	if (is_this_machine(s)) {
		r = ethtool(nic, &command);
		coalesce.rx_us = command.rx_coalesce_usecs;
		coalesce.rx_frames = command.rx_max_coalesced_frames;
		coalesce.is_adaptive = command.use_adaptive_rx_coalesce != 0;
	} else {
		const struct figure figures[] = { { "rx_us", &coalesce.rx_us },
						  { "rx_frames", &coalesce.rx_frames },
						  { "adaptive", &coalesce.is_adaptive } };

		snprintf(name, sizeof(name), "coalesce.%s", nic);
		r = from_file(s, name, figures, 3);
	}
	if (r == 0) {
		*ret = coalesce;
	}
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

/* What does not fit any more is counted by the caller only. */
static void add_word(char text[SIGHT_TEXT_BYTES], const char *word)
{
	size_t used = strlen(text);

	if (used + strlen(word) + 2 <= SIGHT_TEXT_BYTES) {
		snprintf(text + used, SIGHT_TEXT_BYTES - used, "%s%s", used > 0 ? " " : "", word);
	}
}

static int real_addresses(const char *nic, char text[SIGHT_TEXT_BYTES])
{
	struct ifaddrs *all;
	int count = 0;

	if (getifaddrs(&all) < 0) {
		return -errno;
	}
	for (const struct ifaddrs *i = all; i != NULL; i = i->ifa_next) {
		char host[INET6_ADDRSTRLEN];

		if (i->ifa_addr != NULL && strcmp(i->ifa_name, nic) == 0 &&
		    address_text(i->ifa_addr, host) != NULL) {
			add_word(text, host);
			count++;
		}
	}
	freeifaddrs(all);
	return count;
}

int sight_addresses(const struct sight *s, const char *nic, char ret_text[SIGHT_TEXT_BYTES])
{
	char text[SIGHT_TEXT_BYTES] = "";
	int count = 0;

	if (is_this_machine(s)) {
		count = real_addresses(nic, text);
	} else {
		char words[SIGHT_TEXT_BYTES];
		char *left = words;
		const char *word;
		int r = sight_text(s, words, "/calls/addresses.%s", nic);

		if (r < 0) {
			return r;
		}
		while ((word = strsep(&left, " \n")) != NULL) {
			if (word[0] != '\0') {
				add_word(text, word);
				count++;
			}
		}
	}
	if (count >= 0) {
		memcpy(ret_text, text, sizeof(text));
	}
	return count;
}

int sight_clock(const struct sight *s, struct sight_clock *ret)
{
	struct timex tx = { .modes = 0 };
	struct sight_clock clock = { 0 };
	int r = 0;

	if (is_this_machine(s)) {
		if (adjtimex(&tx) < 0) {
			return -errno;
		}
		clock.is_synchronised = (tx.status & STA_UNSYNC) == 0;
		clock.error_us = tx.maxerror;
		clock.tai_offset_s = tx.tai;
	} else {
		const struct figure figures[] = { { "synchronised", &clock.is_synchronised },
						  { "error_us", &clock.error_us },
						  { "tai_offset_s", &clock.tai_offset_s } };

		r = from_file(s, "clock", figures, 3);
	}
	if (r == 0) {
		*ret = clock;
	}
	return r;
}

/* The file system that @dir is on, or will be on once it has been made. */
static int real_disk(const char *dir, struct sight_disk *disk)
{
	char path[SIGHT_PATH_BYTES];
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
	*disk = (struct sight_disk){
		.bytes_total = (int64_t)(vfs.f_blocks * vfs.f_frsize),
		.bytes_free = (int64_t)(vfs.f_bavail * vfs.f_frsize),
		.inodes_total = (int64_t)vfs.f_files,
		.inodes_free = (int64_t)vfs.f_favail,
		.is_read_only = (vfs.f_flag & ST_RDONLY) != 0,
		.is_memory = fs.f_type == TMPFS_MAGIC || fs.f_type == RAMFS_MAGIC,
	};
	return 0;
}

int sight_disk(const struct sight *s, const char *dir, struct sight_disk *ret)
{
	struct sight_disk disk = { 0 };
	int r;

	if (is_this_machine(s)) {
		r = real_disk(dir, &disk);
	} else {
		const struct figure figures[] = { { "bytes_total", &disk.bytes_total },
						  { "bytes_free", &disk.bytes_free },
						  { "inodes_total", &disk.inodes_total },
						  { "inodes_free", &disk.inodes_free },
						  { "read_only", &disk.is_read_only },
						  { "memory", &disk.is_memory } };

		r = from_file(s, "disk", figures, 6);
	}
	if (r == 0) {
		*ret = disk;
	}
	return r;
}

/* Mailbox property interface: GET_THROTTLED; the value sent says which sticky bits to clear. */
static int real_throttled(int64_t *ret)
{
	enum { TAG = 0x00030046, TAG_VALUE = 5, WORDS = 7 };
	uint32_t message[WORDS] = { sizeof(message), 0, TAG, sizeof(uint32_t), 0, 0, 0 };
	int fd = open("/dev/vcio", O_RDONLY | O_CLOEXEC);
	int r;

	if (fd < 0) {
		return -errno;
	}
	r = ioctl(fd, _IOWR(100, 0, char *), message) < 0 ? -errno : 0;
	close(fd);
	if (r == 0 && message[1] != UINT32_C(0x80000000)) {
		r = -EIO;
	}
	if (r == 0) {
		*ret = message[TAG_VALUE];
	}
	return r;
}

int sight_throttled(const struct sight *s, int64_t *ret)
{
	int64_t flags = 0;
	const struct figure figures[] = { { "flags", &flags } };
	int r = is_this_machine(s) ? real_throttled(&flags) : from_file(s, "throttled", figures, 1);

	if (r == 0) {
		*ret = flags;
	}
	return r;
}
