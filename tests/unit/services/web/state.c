/* SPDX-License-Identifier: MIT */
#include "web/state.h"

#include <errno.h>
#include <string.h>

#include "harness/test.h"

static struct status_page page;
static struct state state;

static void begin(enum bus_state bus, const char *message)
{
	memset(&page, 0, sizeof(page));
	page.bus_state = bus;
	page.bus_target = BUS_OP;
	page.slave_count = 2;
	page.cycle.dc_state = DC_LOCKED;
	snprintf(page.message, sizeof(page.message), "%s", message);
}

static void is(int is_alive, const char *word, enum state_level level, const char *part)
{
	state_judge(&page, 0, is_alive, &state);
	CHECK_STR(state.word, word);
	CHECK_EQ(state.level, level);
	CHECK(strstr(state.sentence, part) != NULL);
}

TEST(web_state, a_bus_in_op_without_trouble_is_good)
{
	begin(BUS_OP, "");
	is(1, "OP", STATE_GOOD, "2 slaves exchange process data");
}

TEST(web_state, trouble_in_op_is_told_as_ecdaqd_reports_it)
{
	begin(BUS_OP, "recorder: disk full");
	is(1, "OP", STATE_WARNING, "recorder: disk full");
	begin(BUS_OP, "");
	page.cycle.is_fail_safe = 1;
	is(1, "OP", STATE_WARNING, "fail-safe");
	begin(BUS_OP, "");
	page.cycle.dc_state = DC_LOST;
	is(1, "OP", STATE_WARNING, "not locked");
	begin(BUS_OP, "");
	page.cycle.dc_state = DC_OFF;
	is(1, "OP", STATE_GOOD, "");
}

TEST(web_state, a_lost_slave_is_bad)
{
	begin(BUS_OP, "slave 1 is gone");
	page.slave[1].is_lost = 1;
	is(1, "OP", STATE_BAD, "1 of 2 slaves do not answer: slave 1 is gone: check");
	begin(BUS_RECOVERING, "");
	is(1, "RECOVERING", STATE_BAD, "led back");
}

TEST(web_state, a_bus_on_its_way_is_a_warning_and_one_that_waits_is_bad)
{
	begin(BUS_SCANNING, "");
	is(1, "SCANNING", STATE_WARNING, "brought up");
	begin(BUS_DOWN, "eth1: no link");
	page.is_waiting = 1;
	is(1, "DOWN", STATE_BAD, "eth1: no link");
	begin(BUS_PREOP, "");
	page.bus_target = BUS_PREOP;
	is(1, "PREOP", STATE_WARNING, "bus.target");
	begin(BUS_FAILED, "");
	is(1, "FAILED", STATE_BAD, "See the events");
}

TEST(web_state, without_ecdaqd_the_remedy_is_told)
{
	begin(BUS_OP, "");
	is(0, "OFF", STATE_BAD, "start it");
	begin(BUS_FAILED, "eth1: no slave answers");
	is(0, "OFF", STATE_BAD, "its last message: eth1: no slave answers");
	state_judge(&page, -ENOENT, 0, &state);
	CHECK_STR(state.word, "OFF");
	state_judge(&page, -EACCES, 0, &state);
	CHECK_STR(state.word, "UNKNOWN");
	CHECK(strstr(state.sentence, "Permission denied") != NULL);
}
