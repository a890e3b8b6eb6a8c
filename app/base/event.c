/* SPDX-License-Identifier: MIT */
#include "event.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "status.h"

static const struct {
	const char *name;
	enum event_severity severity;
} kinds[EVENT_COUNT] = {
	[EVENT_NONE] = { "none", EVENT_INFO },
	[EVENT_STARTED] = { "started", EVENT_INFO },
	[EVENT_STOPPED] = { "stopped", EVENT_INFO },
	[EVENT_BUS_STATE] = { "bus_state", EVENT_INFO },
	[EVENT_FRAME_LOST] = { "frame_lost", EVENT_WARNING },
	[EVENT_FRAME_LATE] = { "frame_late", EVENT_WARNING },
	[EVENT_FRAME_DOUBLED] = { "frame_doubled", EVENT_WARNING },
	[EVENT_WKC_LOW] = { "wkc_low", EVENT_WARNING },
	[EVENT_WKC_OK] = { "wkc_ok", EVENT_NOTICE },
	[EVENT_OVERRUN] = { "overrun", EVENT_WARNING },
	[EVENT_NUMBERING_JUMP] = { "numbering_jump", EVENT_ERROR },
	[EVENT_DC_LOCKED] = { "dc_locked", EVENT_INFO },
	[EVENT_DC_UNLOCKED] = { "dc_unlocked", EVENT_WARNING },
	[EVENT_COUNTER_BAD] = { "counter_bad", EVENT_WARNING },
	[EVENT_SLAVE_STATE] = { "slave_state", EVENT_NOTICE },
	[EVENT_SLAVE_LOST] = { "slave_lost", EVENT_ERROR },
	[EVENT_SLAVE_BACK] = { "slave_back", EVENT_NOTICE },
	[EVENT_OUTPUT_SET] = { "output_set", EVENT_INFO },
	[EVENT_OUTPUT_FAIL_SAFE] = { "output_fail_safe", EVENT_WARNING },
	[EVENT_COMMAND_REFUSED] = { "command_refused", EVENT_NOTICE },
	[EVENT_RT_DEGRADED] = { "rt_degraded", EVENT_WARNING },
	[EVENT_SDO_ABORT] = { "sdo_abort", EVENT_NOTICE },
	[EVENT_LINK] = { "link", EVENT_WARNING },
	[EVENT_RECORD_STARTED] = { "record_started", EVENT_INFO },
	[EVENT_RECORD_GAP] = { "record_gap", EVENT_ERROR },
	[EVENT_RECORD_DISK_FULL] = { "record_disk_full", EVENT_ERROR },
	[EVENT_RECORD_RESUMED] = { "record_resumed", EVENT_NOTICE },
	[EVENT_COMMAND] = { "command", EVENT_NOTICE },
};

const char *event_name(uint16_t id)
{
	return id < EVENT_COUNT ? kinds[id].name : "unknown";
}

enum event_severity event_severity(uint16_t id)
{
	return id < EVENT_COUNT ? kinds[id].severity : EVENT_ERROR;
}

const char *event_rt_to_str(uint32_t which)
{
	static const char *const names[EVENT_RT_COUNT] = {
		[EVENT_RT_PRIORITY] = "real-time priority",
		[EVENT_RT_CPU] = "core of the cycle thread",
		[EVENT_RT_MEMORY] = "memory lock",
		[EVENT_RT_DMA_LATENCY] = "CPU sleep limit",
		[EVENT_RT_RING_DISK] = "ring in memory",
	};

	return which < EVENT_RT_COUNT ? names[which] : "unknown";
}

static const char *al_name(int32_t state)
{
	switch (state & 0x0f) {
	case 1:
		return "INIT";
	case 2:
		return "PRE-OP";
	case 3:
		return "BOOT";
	case 4:
		return "SAFE-OP";
	case 8:
		return "OP";
	default:
		return "none";
	}
}

/* enum admin_verb, which base does not see. */
static const char *command_name(int32_t verb)
{
	static const char *const names[] = { "none",     "ping",      "set",  "oneshot",
					     "SDO read", "SDO write", "stop", "clear" };

	return verb >= 0 && verb < (int32_t)(sizeof(names) / sizeof(names[0])) ? names[verb]
									       : "unknown";
}

/* An errno of either sign in words. */
static const char *reason(int32_t error)
{
	const char *text = strerrordesc_np(error < 0 ? -error : error);

	return text != NULL ? text : "unknown reason";
}

static int format_refusal(const struct event *ev, char *buf, size_t buf_len)
{
	char slave[24] = "";
	char channel[40] = "";

	if (ev->slave_pos != EVENT_NO_SLAVE) {
		snprintf(slave, sizeof(slave), "slave %u: ", ev->slave_pos);
	}
	if (ev->value >= 0) {
		snprintf(channel, sizeof(channel), " for channel %" PRId64, ev->value);
	}
	return snprintf(buf, buf_len, "%scommand of user %" PRId32 "%s refused: %s", slave,
			ev->arg[1], channel, reason(ev->arg[0]));
}

/* NOLINTNEXTLINE(readability-function-size): a table, one text an event */
int event_format(const struct event *ev, char *buf, size_t buf_len)
{
	const int32_t *a = ev->arg;
	unsigned slave = ev->slave_pos;

	switch ((enum event_id)ev->id) {
	case EVENT_NONE:
	case EVENT_COUNT:
		break;
	case EVENT_STARTED:
		return snprintf(buf, buf_len, "started: %" PRId32 " slaves, period %" PRId64 " ns",
				a[0], ev->value);
	case EVENT_STOPPED:
		return snprintf(buf, buf_len, "stopped after %" PRId64 " cycles", ev->value);
	case EVENT_BUS_STATE:
		return snprintf(buf, buf_len, "bus: %s -> %s", bus_state_to_str((uint32_t)a[0]),
				bus_state_to_str((uint32_t)a[1]));
	case EVENT_FRAME_LOST:
		return snprintf(buf, buf_len,
				"cycle %" PRId64 ": frame lost (%" PRId32 " in a row)", ev->value,
				a[0]);
	case EVENT_FRAME_LATE:
		return snprintf(buf, buf_len,
				"cycle %" PRId64 ": frame came %" PRId32
				" cycles late, thrown away",
				ev->value, a[0]);
	case EVENT_FRAME_DOUBLED:
		return snprintf(buf, buf_len, "cycle %" PRId64 ": frame came twice", ev->value);
	case EVENT_WKC_LOW:
		return snprintf(buf, buf_len,
				"cycle %" PRId64 ": WKC %" PRId32 ", expected %" PRId32, ev->value,
				a[0], a[1]);
	case EVENT_WKC_OK:
		return snprintf(buf, buf_len,
				"cycle %" PRId64 ": WKC %" PRId32 " again after %" PRId32 " cycles",
				ev->value, a[0], a[1]);
	case EVENT_OVERRUN:
		return snprintf(buf, buf_len,
				"cycle %" PRId64 ": overrun, %" PRId32 " cycles skipped, %" PRId32
				" ns late",
				ev->value, a[0], a[1]);
	case EVENT_NUMBERING_JUMP:
		return snprintf(buf, buf_len,
				"cycle numbers go on at %" PRId64 ", %" PRId32 " have no sample",
				ev->value, a[0]);
	case EVENT_DC_LOCKED:
		return snprintf(buf, buf_len, "DC locked, phase error %" PRId32 " ns", a[0]);
	case EVENT_DC_UNLOCKED:
		return snprintf(buf, buf_len, "DC lock lost, phase error %" PRId32 " ns", a[0]);
	case EVENT_COUNTER_BAD:
		return snprintf(buf, buf_len,
				"slave %u: cycle %" PRId64 ": counter %" PRId32
				", expected %" PRId32,
				slave, ev->value, a[0], a[1]);
	case EVENT_SLAVE_STATE:
		return snprintf(buf, buf_len, "slave %u: %s%s -> %s%s, AL status code 0x%04" PRIx64,
				slave, al_name(a[0]), a[0] & 0x10 ? "+ERROR" : "", al_name(a[1]),
				a[1] & 0x10 ? "+ERROR" : "", (uint64_t)ev->value & 0xffff);
	case EVENT_SLAVE_LOST:
		return snprintf(buf, buf_len, "slave %u: lost", slave);
	case EVENT_SLAVE_BACK:
		return snprintf(buf, buf_len, "slave %u: back", slave);
	case EVENT_OUTPUT_SET:
		return snprintf(buf, buf_len,
				"slave %u: output channel %" PRId64 " set by user %" PRId32, slave,
				ev->value, a[1]);
	case EVENT_OUTPUT_FAIL_SAFE:
		return snprintf(buf, buf_len, "outputs go to fail-safe");
	case EVENT_COMMAND_REFUSED:
		return format_refusal(ev, buf, buf_len);
	case EVENT_COMMAND:
		if (ev->slave_pos == EVENT_NO_SLAVE) {
			return snprintf(buf, buf_len, "%s by user %" PRId32, command_name(a[0]),
					a[1]);
		}
		return snprintf(buf, buf_len, "slave %u: %s by user %" PRId32 ", 0x%" PRIx64, slave,
				command_name(a[0]), a[1], (uint64_t)ev->value);
	case EVENT_RT_DEGRADED:
		return snprintf(buf, buf_len, "degraded: no %s: %s",
				event_rt_to_str((uint32_t)a[0]), reason(a[1]));
	case EVENT_SDO_ABORT:
		return snprintf(buf, buf_len,
				"slave %u: SDO 0x%04" PRIx32 ":%02" PRIx32 " abort 0x%08" PRIx64,
				slave, (uint32_t)a[0] >> 8, (uint32_t)a[0] & 0xff,
				(uint64_t)ev->value & 0xffffffff);
	case EVENT_LINK:
		return snprintf(buf, buf_len, "link %s", a[0] ? "up" : "down");
	case EVENT_RECORD_STARTED:
		return snprintf(buf, buf_len, "recording from cycle %" PRId64, ev->value);
	case EVENT_RECORD_GAP:
		return snprintf(buf, buf_len,
				"recording has a gap: %" PRId32 " cycles from %" PRId64, a[0],
				ev->value);
	case EVENT_RECORD_DISK_FULL:
		return snprintf(buf, buf_len,
				"recording stopped: disk full, %" PRId64 " bytes free", ev->value);
	case EVENT_RECORD_RESUMED:
		return snprintf(buf, buf_len, "recording again from cycle %" PRId64, ev->value);
	}
	return snprintf(buf, buf_len, "event %u", ev->id);
}
