/* SPDX-License-Identifier: MIT */
/* A session as the admin commands see it: four channels on two slaves, and the requests it got. */
#ifndef TESTS_UNIT_ADMIN_TARGET_H
#define TESTS_UNIT_ADMIN_TARGET_H

#include "admin/command.h"

enum { FAKE_PERIOD_NS = 1000000, FAKE_NOW_NS = 1000000000, FAKE_EVENTS = 16 };
enum fake_channel { FAKE_ADC, FAKE_LED, FAKE_LEVEL, FAKE_ONESHOT, FAKE_CHANNELS };

struct fake {
	struct config cfg;
	struct channel channels[FAKE_CHANNELS];
	struct slave_info slaves[2];
	struct board board;
	int stops;
	int clears;
	int has_dc;
	int sdo_result;
	uint32_t sdo_abort;
	int is_sdo_slow;    /* an SDO stays open */
	int is_cancel_slow; /* also after it was cancelled */
	int cancels;
	struct admin_pending *pending; /* of the last SDO */
	unsigned frames;               /* that requests to the bus have taken */
	struct event event[FAKE_EVENTS];
	unsigned events;
};

/** "a" with adc (input), led (BOOL) and level (INT8 with limits); "b" with oneshot_time, in that
 * mode. */
void fake_init(struct fake *fake);
struct admin_target fake_target(struct fake *fake);
/** The cycle takes what is on the board and answers with @cycle. */
void fake_cycle(struct fake *fake, uint64_t cycle);
/** A request with @verb. */
struct admin_request fake_request(enum admin_verb verb);
void fake_item(struct admin_request *request, const char *channel, uint64_t raw);

#endif
