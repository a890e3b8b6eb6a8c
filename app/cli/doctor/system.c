/* SPDX-License-Identifier: MIT */
/* The machine around the cycle: clocks, watchdog, disk, power. */
#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "cli/doctor/check.h"
#include "cli/text.h"

#define INODES_REMEDY REMEDY "delete small files on this file system"

enum {
	WATCHDOG_PI_MAX_S = 15, /* its counter has 20 bits of 16 us; longer is cut short */
	THROTTLED_NOW = 0x0000f,
	THROTTLED_SINCE = 0xf0000,
	THROTTLED_SINCE_SHIFT = 16,
};

/* --- watchdog --- */

struct watchdog {
	const struct target *t;
	int count;
	int is_active;
	int64_t timeout_s;
	char name[PROBE_TEXT_BYTES];
};

/* Keep the best one: an active one if there is any. */
static void choose_watchdog(void *ctx, const char *entry)
{
	struct watchdog *best = ctx;
	const struct probe *p = &best->t->probe;
	struct watchdog dog = { .t = best->t, .count = best->count + 1 };
	char state[PROBE_TEXT_BYTES] = "";

	snprintf(dog.name, sizeof(dog.name), "%.60s", entry);
	probe_text(p, dog.name, "/sys/class/watchdog/%s/identity", entry);
	probe_text(p, state, "/sys/class/watchdog/%s/state", entry);
	probe_number(p, &dog.timeout_s, "/sys/class/watchdog/%s/timeout", entry);
	dog.is_active = strcmp(state, "active") == 0;
	if (best->count == 0 || (dog.is_active && !best->is_active)) {
		*best = dog;
	} else {
		best->count = dog.count;
	}
}

static void judge_watchdog(const struct target *t, struct finding *f)
{
	struct watchdog dog = { .t = t };

	probe_each(&t->probe, "/sys/class/watchdog", choose_watchdog, &dog);
	if (dog.count == 0) {
		finding_set(f, FINDING_WARN,
			    "none: a hung machine is not reset" REMEDY
			    "load the driver of the board's watchdog (or softdog)");
	} else if (!dog.is_active) {
		finding_set(f, FINDING_WARN,
			    "%.60s: not started" REMEDY
			    "RuntimeWatchdogSec=15s in /etc/systemd/system.conf",
			    dog.name);
	} else if (strstr(dog.name, "Software") != NULL) {
		finding_set(f, FINDING_WARN,
			    "%.60s: stops with the kernel" REMEDY
			    "load the driver of the board's own watchdog",
			    dog.name);
	} else if (strstr(dog.name, "BCM2835") != NULL && dog.timeout_s > WATCHDOG_PI_MAX_S) {
		finding_set(f, FINDING_WARN,
			    "%.60s: timeout %" PRId64
			    " s, the hardware supports %d s at most" REMEDY
			    "RuntimeWatchdogSec=%ds in /etc/systemd/system.conf",
			    dog.name, dog.timeout_s, WATCHDOG_PI_MAX_S, WATCHDOG_PI_MAX_S);
	} else {
		finding_set(f, FINDING_OK, "%.60s, %" PRId64 " s", dog.name, dog.timeout_s);
	}
}

/* --- disk --- */

static void judge_disk(const struct target *t, struct finding *f)
{
	static const char *const keys[] = { "bytes_total", "bytes_free", "read_only", "memory" };
	enum { TOTAL, FREE, READ_ONLY, MEMORY, KEYS };
	int64_t reserve = (int64_t)t->cfg->record_reserve_bytes;
	const char *dir = t->cfg->record_dir;
	char text[PROBE_TEXT_BYTES];
	char free_text[TEXT_BYTES];
	char least_text[TEXT_BYTES];
	int64_t disk[KEYS] = { 0 };
	int r = probe_call(&t->probe, "disk", dir, text);

	for (size_t i = 0; i < KEYS && r >= 0; i++) {
		r = probe_figure(text, keys[i], &disk[i]);
	}
	text_bytes((uint64_t)disk[FREE], free_text);
	text_bytes((uint64_t)reserve, least_text);
	if (r < 0) {
		finding_unread(f, dir, r);
	} else if (disk[READ_ONLY] != 0) {
		finding_set(f, FINDING_FAIL,
			    "%.80s: the file system is read-only" REMEDY
			    "mount it read-write, or set record.dir",
			    dir);
	} else if (disk[FREE] > reserve && disk[MEMORY] != 0) {
		finding_set(f, FINDING_WARN,
			    "%.80s is in RAM: recordings are lost at power-off" REMEDY
			    "set record.dir to a disk",
			    dir);
	} else if (disk[FREE] < 2 * reserve || disk[FREE] < disk[TOTAL] / 20) {
		finding_set(f, disk[FREE] <= reserve ? FINDING_FAIL : FINDING_WARN,
			    "%.80s: %s free, recording stops below %s" REMEDY
			    "copy and delete recordings, or lower record.budget",
			    dir, free_text, least_text);
	} else {
		finding_set(f, FINDING_OK, "%.80s: %s free", dir, free_text);
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
	finding_set(f, is_now ? FINDING_FAIL : FINDING_WARN,
		    "%s: %s" REMEDY
		    "use a better power supply or cable, improve cooling; then reboot",
		    is_now ? "now" : "since boot, now over", text);
}

struct volt {
	const struct target *t;
	int64_t alarm;
	int r;
};

static void read_hwmon(void *ctx, const char *entry)
{
	struct volt *volt = ctx;
	char name[PROBE_TEXT_BYTES];

	if (probe_text(&volt->t->probe, name, "/sys/class/hwmon/%s/name", entry) >= 0 &&
	    strcmp(name, "rpi_volt") == 0) {
		volt->r = probe_number(&volt->t->probe, &volt->alarm,
				       "/sys/class/hwmon/%s/in0_lcrit_alarm", entry);
	}
}

/* The firmware's flags, by mailbox or sysfs (Raspberry Pi kernels); else mainline's alarm. */
static void judge_power(const struct target *t, struct finding *f)
{
	struct volt volt = { .t = t, .r = -ENOENT };
	char text[PROBE_TEXT_BYTES] = "";
	int64_t flags;
	int r;

	probe_text(&t->probe, text, "/proc/device-tree/model");
	if (strncmp(text, "Raspberry Pi", 12) != 0) {
		finding_set(f, FINDING_SKIP, "not a Raspberry Pi");
		return;
	}
	r = probe_call(&t->probe, "throttled", "", text);
	r = r < 0 ? r : probe_figure(text, "flags", &flags);
	if (r == 0) {
		judge_throttled(flags, f);
		return;
	}
	if (probe_text(&t->probe, text, "/sys/devices/platform/soc/soc:firmware/get_throttled") >
	    0) {
		judge_throttled(strtoll(text, NULL, 16), f);
		return;
	}
	probe_each(&t->probe, "/sys/class/hwmon", read_hwmon, &volt);
	if (volt.r < 0) {
		finding_unread(f, "the firmware's flags", r == -EACCES ? r : volt.r);
	} else if (volt.alarm != 0) {
		judge_throttled(1, f);
	} else {
		finding_set(f, FINDING_OK,
			    "no under-voltage; this kernel does not report throttling");
	}
}

static void judge_sync0(const struct target *t, struct finding *f)
{
	char text[FINDING_TEXT_BYTES / 2];

	if (t->sync0 == NULL) {
		finding_set(f, FINDING_SKIP, "ecdaq-sync0 is not running");
	} else if (sync0_beyond_format(t->sync0, text, sizeof(text)) > 0) {
		finding_set(f, FINDING_WARN, "%s" REMEDY "check those with an oscilloscope", text);
	} else {
		finding_set(f, FINDING_OK, "every slave with SYNC0 has a line that is checked");
	}
}

/* TAI - UTC is 37 s since 2017. Leap seconds are announced half a year ahead; it only grows. */
const struct check checks_of_system[] = {
	{ .name = "clocksource",
	  .fact = "/sys/devices/system/clocksource/clocksource0/current_clocksource",
	  .rules = { { FINDING_WARN,
		       "{text}: slow or coarse" REMEDY
		       "see the kernel log for why the CPU's own counter (tsc) was rejected",
		       IF_IN, "hpet acpi_pm jiffies refined-jiffies pit", NULL },
		     { .level = FINDING_OK, .text = "{text}" } } },
	{ .name = "ntp",
	  .fact = "clock error_us",
	  .rules = { { FINDING_OK, "synchronised, error below {text} us", IF_AT_LEAST, "1",
		       "clock synchronised" },
		     { .level = FINDING_WARN,
		       .text = "not synchronised: UTC timestamps of samples are unreliable" REMEDY
			       "configure a reachable time server in chrony (chronyc "
			       "sources)" } } },
	{ .name = "tai",
	  .fact = "clock tai_offset_s",
	  .rules = { { FINDING_OK, "TAI - UTC is {text} s", IF_AT_LEAST, "37", NULL },
		     { .level = FINDING_WARN,
		       .text = "the kernel's TAI - UTC is {text} s instead of 37 s" REMEDY
			       "chrony sets it once a time server has answered, with leapseclist "
			       "/usr/share/zoneinfo/leap-seconds.list in chrony.conf" } } },
	{ .name = "watchdog", .judge = judge_watchdog },
	{ .name = "disk", .needs = NEEDS_RECORDING, .judge = judge_disk },
	{ .name = "inodes",
	  .needs = NEEDS_RECORDING,
	  .fact = "disk inodes_free",
	  .rules = { { FINDING_OK, "this file system has no inode limit", IF_IN, "0",
		       "disk inodes_total" },
		     { FINDING_OK, "{text} inodes free", IF_AT_LEAST, "1000", NULL },
		     { FINDING_WARN, "{dir}: {text} inodes free" INODES_REMEDY, IF_AT_LEAST, "1",
		       NULL },
		     { .level = FINDING_FAIL,
		       .text = "{dir}: {text} inodes free" INODES_REMEDY } } },
	{ .name = "power", .judge = judge_power },
	{ .name = "sync0", .judge = judge_sync0 },
	{ .name = NULL },
};
