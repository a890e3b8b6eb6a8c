/* SPDX-License-Identifier: MIT */
/* The machine around the cycle: what it is, watchdog, disk, memory, power. */
#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "cli/doctor/patient.h"
#include "cli/text.h"

#define NO_CLAIM "figures of time are no claims about latency"
#define MEND_HARDWARE "measure on the hardware itself"

enum {
	CPUINFO_LINES = 64,
	WATCHDOG_PI_MAX_S = 15, /* its counter has 20 bits of 16 us; longer is cut short */
	FILES_MIN = 1000,
	THROTTLED_NOW = 0x0000f,
	THROTTLED_SINCE = 0xf0000,
	THROTTLED_SINCE_SHIFT = 16,
};

/* --- what it is --- */

static int is_container(const struct patient *p)
{
	static const char *const marks[] = { "/run/systemd/container", "/.dockerenv",
					     "/run/.containerenv" };

	for (size_t i = 0; i < sizeof(marks) / sizeof(marks[0]); i++) {
		if (sight_exists(&p->sight, "%s", marks[i])) {
			return 1;
		}
	}
	return 0;
}

/* The x86 way: a hypervisor shows itself in the flags of the core. */
static int has_hypervisor_flag(const struct patient *p)
{
	FILE *file = sight_open(&p->sight, "/proc/cpuinfo");
	char *line = NULL;
	size_t bytes = 0;
	int found = 0;

	for (int i = 0; file != NULL && i < CPUINFO_LINES && getline(&line, &bytes, file) > 0;
	     i++) {
		found |= strncmp(line, "flags", 5) == 0 && strstr(line, " hypervisor") != NULL;
	}
	free(line);
	if (file != NULL) {
		fclose(file);
	}
	return found;
}

/* The maker in the firmware's tables, or the device tree's first word. NULL: a real machine. */
static const char *hypervisor(const struct patient *p)
{
	static const char *const makers[] = { "QEMU",       "VMware",    "innotek",
					      "VirtualBox", "Xen",       "Amazon EC2",
					      "Google",     "Parallels", "Bochs" };
	char text[SIGHT_TEXT_BYTES] = "";

	if (sight_text(&p->sight, text, "/sys/class/dmi/id/sys_vendor") >= 0) {
		for (size_t i = 0; i < sizeof(makers) / sizeof(makers[0]); i++) {
			if (strstr(text, makers[i]) != NULL) {
				return makers[i];
			}
		}
	}
	if (sight_text(&p->sight, text, "/proc/device-tree/compatible") >= 0 &&
	    strcmp(text, "linux,dummy-virt") == 0) {
		return "QEMU's virt";
	}
	if (sight_exists(&p->sight, "/proc/device-tree/hypervisor") || has_hypervisor_flag(p)) {
		return "a hypervisor";
	}
	return NULL;
}

void check_machine(const struct patient *p, struct finding *f)
{
	const char *under = hypervisor(p);
	char model[SIGHT_TEXT_BYTES] = "";

	if (sight_text(&p->sight, model, "/proc/device-tree/model") < 0 || model[0] == '\0') {
		sight_text(&p->sight, model, "/sys/class/dmi/id/product_name");
	}
	if (is_container(p)) {
		finding_set(f, FINDING_WARN, "a container%s: " NO_CLAIM,
			    under == NULL ? "" : " in a virtual machine");
		finding_mend(f, MEND_HARDWARE);
	} else if (under != NULL) {
		finding_set(f, FINDING_WARN, "a virtual machine (%s): " NO_CLAIM, under);
		finding_mend(f, MEND_HARDWARE);
	} else {
		finding_set(f, FINDING_OK, "%.100s", model[0] == '\0' ? "hardware" : model);
	}
}

/* --- watchdog --- */

struct dog {
	const struct patient *p;
	int count;
	int is_active;
	int64_t timeout_s;
	char name[SIGHT_TEXT_BYTES];
};

/* Keeps the best one: one that is fed before one that sleeps. */
static void look_at_dog(void *ctx, const char *entry)
{
	struct dog *best = ctx;
	const struct sight *s = &best->p->sight;
	struct dog dog = { .p = best->p, .count = best->count + 1 };
	char state[SIGHT_TEXT_BYTES] = "";

	snprintf(dog.name, sizeof(dog.name), "%.60s", entry);
	sight_text(s, dog.name, "/sys/class/watchdog/%s/identity", entry);
	sight_text(s, state, "/sys/class/watchdog/%s/state", entry);
	sight_number(s, &dog.timeout_s, "/sys/class/watchdog/%s/timeout", entry);
	dog.is_active = strcmp(state, "active") == 0;
	if (best->count == 0 || (dog.is_active && !best->is_active)) {
		*best = dog;
	} else {
		best->count = dog.count;
	}
}

void check_watchdog(const struct patient *p, struct finding *f)
{
	struct dog dog = { .p = p };

	sight_each(&p->sight, "/sys/class/watchdog", look_at_dog, &dog);
	if (dog.count == 0) {
		finding_set(f, FINDING_WARN, "none: a machine that hangs stays so");
		finding_mend(f, "load the driver of the board's watchdog (or softdog)");
	} else if (!dog.is_active) {
		finding_set(f, FINDING_WARN, "%.60s: nobody has started it", dog.name);
		finding_mend(f, "RuntimeWatchdogSec=15s in /etc/systemd/system.conf");
	} else if (strstr(dog.name, "Software") != NULL) {
		finding_set(f, FINDING_WARN, "%.60s: it hangs with the kernel", dog.name);
		finding_mend(f, "load the driver of the board's own watchdog");
	} else if (strstr(dog.name, "BCM2835") != NULL && dog.timeout_s > WATCHDOG_PI_MAX_S) {
		finding_set(f, FINDING_WARN, "%.60s: %" PRId64 " s, it counts to %d s only",
			    dog.name, dog.timeout_s, WATCHDOG_PI_MAX_S);
		finding_mend(f, "RuntimeWatchdogSec=%ds in /etc/systemd/system.conf",
			     WATCHDOG_PI_MAX_S);
	} else {
		finding_set(f, FINDING_OK, "%.60s, %" PRId64 " s", dog.name, dog.timeout_s);
	}
}

/* --- disk --- */

static int read_disk(const struct patient *p, struct sight_disk *disk, struct finding *f)
{
	int r;

	if (!p->cfg->record_enable) {
		finding_set(f, FINDING_SKIP, "recording is off (record.enable)");
		return 0;
	}
	r = sight_disk(&p->sight, p->cfg->record_dir, disk);
	if (r < 0) {
		finding_unread(f, p->cfg->record_dir, r);
		return 0;
	}
	return 1;
}

void check_disk(const struct patient *p, struct finding *f)
{
	int64_t reserve = (int64_t)p->cfg->record_reserve_bytes;
	const char *dir = p->cfg->record_dir;
	char free_text[TEXT_BYTES];
	char more[TEXT_BYTES];
	struct sight_disk disk;

	if (!read_disk(p, &disk, f)) {
		return;
	}
	text_bytes((uint64_t)disk.bytes_free, free_text);
	text_bytes((uint64_t)reserve, more);
	if (disk.is_read_only) {
		finding_set(f, FINDING_FAIL, "%.80s: the file system is read-only", dir);
		finding_mend(f, "mount it for writing, or set record.dir");
	} else if (disk.bytes_free <= reserve) {
		finding_set(f, FINDING_FAIL, "%.80s: %s free, recording stops below %s", dir,
			    free_text, more);
		finding_mend(f, "fetch and delete recordings, or lower record.budget");
	} else if (disk.is_memory) {
		finding_set(f, FINDING_WARN, "%.80s is memory: a power cut takes all of it", dir);
		finding_mend(f, "set record.dir to a disk");
	} else if (disk.bytes_free < 2 * reserve || disk.bytes_free < disk.bytes_total / 20) {
		finding_set(f, FINDING_WARN, "%.80s: %s free, recording stops below %s", dir,
			    free_text, more);
		finding_mend(f, "fetch and delete recordings, or lower record.budget");
	} else {
		finding_set(f, FINDING_OK, "%.80s: %s free", dir, free_text);
	}
}

void check_inodes(const struct patient *p, struct finding *f)
{
	struct sight_disk disk;

	if (!read_disk(p, &disk, f)) {
		return;
	}
	if (disk.inodes_total == 0) {
		finding_set(f, FINDING_OK, "this file system does not count files");
	} else if (disk.inodes_free >= FILES_MIN) {
		finding_set(f, FINDING_OK, "%" PRId64 " more files fit", disk.inodes_free);
	} else {
		finding_set(f, disk.inodes_free == 0 ? FINDING_FAIL : FINDING_WARN,
			    "%.80s: %" PRId64 " more files fit", p->cfg->record_dir,
			    disk.inodes_free);
		finding_mend(f, "delete small files there");
	}
}

/* --- memory --- */

void check_swap(const struct patient *p, struct finding *f)
{
	FILE *file = sight_open(&p->sight, "/proc/swaps");
	char line[SIGHT_TEXT_BYTES];
	char first[SIGHT_TEXT_BYTES] = "";

	if (file == NULL && errno == ENOENT) {
		finding_set(f, FINDING_OK, "this kernel has none");
		return;
	}
	if (file == NULL) {
		finding_unread(f, "/proc/swaps", -errno);
		return;
	}
	while (first[0] == '\0' && fgets(line, sizeof(line), file) != NULL) {
		if (strncmp(line, "Filename", 8) != 0) {
			snprintf(first, sizeof(first), "%.*s", (int)strcspn(line, " \t\n"), line);
		}
	}
	fclose(file);
	if (first[0] == '\0') {
		finding_set(f, FINDING_OK, "none");
		return;
	}
	finding_set(f, FINDING_WARN, "%.100s: what is not locked may be paged out", first);
	finding_mend(f, "swapoff --all, and take it out of /etc/fstab");
}

void check_huge_pages(const struct patient *p, struct finding *f)
{
	static const char path[] = "/sys/kernel/mm/transparent_hugepage/enabled";
	char text[SIGHT_TEXT_BYTES];
	int r = sight_text(&p->sight, text, "%s", path);

	if (r == -ENOENT) {
		finding_set(f, FINDING_OK, "this kernel makes none by itself");
	} else if (r < 0) {
		finding_unread(f, path, r);
	} else if (strstr(text, "[always]") != NULL) {
		finding_set(f, FINDING_WARN,
			    "always: memory is moved about behind the cycle's back");
		finding_mend(f, "echo madvise > %s", path);
	} else {
		finding_set(f, FINDING_OK, "%.60s", text);
	}
}

/* --- power --- */

static void judge_throttled(int64_t flags, struct finding *f)
{
	static const char *const names[] = { "under-voltage", "frequency capped", "throttled",
					     "hot" };
	int is_now = (flags & THROTTLED_NOW) != 0;
	int64_t bits = is_now ? flags : flags >> THROTTLED_SINCE_SHIFT;
	char text[FINDING_TEXT_BYTES / 2] = "";

	if ((flags & (THROTTLED_NOW | THROTTLED_SINCE)) == 0) {
		finding_set(f, FINDING_OK, "neither under-voltage nor throttling since boot");
		return;
	}
	for (unsigned i = 0; i < 4; i++) {
		size_t used = strlen(text);

		if ((bits >> i & 1) != 0) {
			snprintf(text + used, sizeof(text) - used, "%s%s", used > 0 ? ", " : "",
				 names[i]);
		}
	}
	finding_set(f, is_now ? FINDING_FAIL : FINDING_WARN, "%s: %s",
		    is_now ? "now" : "since boot, now over", text);
	finding_mend(f, "a better power supply or cable, cooling; then reboot");
}

struct volt {
	const struct patient *p;
	int64_t alarm;
	int r;
};

static void look_at_hwmon(void *ctx, const char *entry)
{
	struct volt *volt = ctx;
	char name[SIGHT_TEXT_BYTES];

	if (sight_text(&volt->p->sight, name, "/sys/class/hwmon/%s/name", entry) >= 0 &&
	    strcmp(name, "rpi_volt") == 0) {
		volt->r = sight_number(&volt->p->sight, &volt->alarm,
				       "/sys/class/hwmon/%s/in0_lcrit_alarm", entry);
	}
}

/* The firmware's own flags, by mailbox or sysfs (Raspberry Pi's kernels); else mainline's alarm. */
void check_power(const struct patient *p, struct finding *f)
{
	struct volt volt = { .p = p, .r = -ENOENT };
	char text[SIGHT_TEXT_BYTES] = "";
	int64_t flags;
	int r;

	sight_text(&p->sight, text, "/proc/device-tree/model");
	if (strncmp(text, "Raspberry Pi", 12) != 0) {
		finding_set(f, FINDING_SKIP, "not a Raspberry Pi");
		return;
	}
	r = sight_throttled(&p->sight, &flags);
	if (r == 0) {
		judge_throttled(flags, f);
		return;
	}
	if (sight_text(&p->sight, text, "/sys/devices/platform/soc/soc:firmware/get_throttled") >
	    0) {
		judge_throttled(strtoll(text, NULL, 16), f);
		return;
	}
	sight_each(&p->sight, "/sys/class/hwmon", look_at_hwmon, &volt);
	if (volt.r < 0) {
		finding_unread(f, "the firmware's flags", r == -EACCES ? r : volt.r);
	} else if (volt.alarm != 0) {
		judge_throttled(1, f);
	} else {
		finding_set(f, FINDING_OK,
			    "no under-voltage; throttling this kernel does not show");
	}
}
