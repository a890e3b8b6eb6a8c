/* SPDX-License-Identifier: MIT */
/* The clocks: what the cycle sleeps by, and how far samples can be dated in UTC. */
#include <inttypes.h>
#include <string.h>

#include "cli/doctor/patient.h"

/* TAI - UTC since 2017. Leap seconds are announced half a year ahead; it only grows. */
#define TAI_OFFSET_S 37

void check_clocksource(const struct patient *p, struct finding *f)
{
	static const char path[] =
		"/sys/devices/system/clocksource/clocksource0/current_clocksource";
	static const char *const slow[] = { "hpet", "acpi_pm", "jiffies", "refined-jiffies",
					    "pit" };
	char name[SIGHT_TEXT_BYTES];
	int r = sight_text(&p->sight, name, "%s", path);

	if (r < 0) {
		finding_unread(f, "clocksource0/current_clocksource", r);
		return;
	}
	for (size_t i = 0; i < sizeof(slow) / sizeof(slow[0]); i++) {
		if (strcmp(name, slow[i]) == 0) {
			finding_set(f, FINDING_WARN, "%s: slow or coarse", name);
			finding_mend(f,
				     "kernel log: why was the core's own counter (tsc) given up?");
			return;
		}
	}
	finding_set(f, FINDING_OK, "%.60s", name);
}

void check_ntp(const struct patient *p, struct finding *f)
{
	struct sight_clock clock;
	int r = sight_clock(&p->sight, &clock);

	if (r < 0) {
		finding_unread(f, "adjtimex", r);
	} else if (clock.is_synchronised) {
		finding_set(f, FINDING_OK, "synchronised, error below %" PRId64 " us",
			    clock.error_us);
	} else {
		finding_set(f, FINDING_WARN,
			    "not synchronised: UTC of samples is as good as guessed");
		finding_mend(f, "give chrony a time server it can reach (chronyc sources)");
	}
}

void check_tai(const struct patient *p, struct finding *f)
{
	struct sight_clock clock;
	int r = sight_clock(&p->sight, &clock);

	if (r < 0) {
		finding_unread(f, "adjtimex", r);
	} else if (clock.tai_offset_s >= TAI_OFFSET_S) {
		finding_set(f, FINDING_OK, "TAI - UTC is %" PRId64 " s", clock.tai_offset_s);
	} else {
		finding_set(f, FINDING_WARN,
			    "the kernel has TAI - UTC as %" PRId64 " s, it is %d s",
			    clock.tai_offset_s, TAI_OFFSET_S);
		finding_mend(f, "chrony sets it once a time server has answered, with leapseclist "
				"/usr/share/zoneinfo/leap-seconds.list in chrony.conf");
	}
}
