/* SPDX-License-Identifier: MIT */
/*
 * A bus and an exchange that a test controls, in place of bus/ (the linker takes these first): one
 * slave with an LED and an ADC, a reference clock that runs 50 ppm fast, on a clock that the test
 * advances.
 */
#ifndef TESTS_UNIT_DAEMON_FAKE_BUS_H
#define TESTS_UNIT_DAEMON_FAKE_BUS_H

#include "base/platform.h"
#include "bus/bus.h"

enum fake_step {
	FAKE_NOTHING,
	FAKE_SCAN,
	FAKE_COMPARE,
	FAKE_MAP,
	FAKE_DC_SETUP,
	FAKE_SYNC0,
	FAKE_SAFEOP,
	FAKE_OP,
	FAKE_STOP,
	FAKE_STEPS,
};

struct fake_bus {
	int64_t mono_ns;
	int64_t tai_ns;
	enum fake_step fails_at;
	int result;             /* of the step that fails */
	unsigned lost_every;    /* every n-th frame is lost; 0: none */
	int is_doubled;         /* every frame comes back twice */
	int is_dc_running_away; /* the reference is 5 % fast */
	struct bus_watch_report report;
	uint8_t led;         /* last value on the wire */
	char steps[512];     /* what was called, in order, with a blank behind each */
	unsigned transports; /* open ones */
	int is_link_up;
	unsigned link_queries;
	uint64_t exchanges;
	void (*led_back)(void *ctx); /* called by bus_lead_back(); NULL: none */
	void *led_back_ctx;
};

extern struct fake_bus fake_bus;

void fake_bus_init(void);
struct platform fake_platform(void);
struct transport fake_transport(void);

#endif
