/* SPDX-License-Identifier: MIT */
#include "event.h"

#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "status.h"
#include "sync0.h"

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
	[EVENT_EMERGENCY] = { "emergency", EVENT_WARNING },
	[EVENT_STRANGER] = { "stranger", EVENT_WARNING },
	[EVENT_STRANGER_GONE] = { "stranger_gone", EVENT_NOTICE },
	[EVENT_SLAVE_WRONG] = { "slave_wrong", EVENT_ERROR },
	[EVENT_SLAVE_UNREADABLE] = { "slave_unreadable", EVENT_ERROR },
	[EVENT_SLAVE_ABSENT] = { "slave_absent", EVENT_WARNING },
	[EVENT_SM_LENGTH] = { "sm_length", EVENT_NOTICE },
	[EVENT_GATEWAY_LOST] = { "gateway_lost", EVENT_NOTICE },
	[EVENT_EOE_LOST] = { "eoe_lost", EVENT_NOTICE },
	[EVENT_STREAM_GAP] = { "stream_gap", EVENT_ERROR },
	[EVENT_SLAVE_ALARM] = { "slave_alarm", EVENT_ERROR },
	[EVENT_DC_DIFF_HIGH] = { "dc_diff_high", EVENT_WARNING },
	[EVENT_OP_LOST] = { "op_lost", EVENT_WARNING },
	[EVENT_SLAVE_COUNT] = { "slave_count", EVENT_WARNING },
	[EVENT_CONTROL_OVERRUN] = { "control_overrun", EVENT_WARNING },
	[EVENT_CONTROL_CRASHED] = { "control_crashed", EVENT_ERROR },
	[EVENT_SYNC0_LOST] = { "sync0_lost", EVENT_ERROR },
	[EVENT_SYNC0_BACK] = { "sync0_back", EVENT_NOTICE },
	[EVENT_SYNC0_MISSING] = { "sync0_missing", EVENT_ERROR },
	[EVENT_SYNC0_EXTRA] = { "sync0_extra", EVENT_WARNING },
	[EVENT_SYNC0_OVERFLOW] = { "sync0_overflow", EVENT_WARNING },
	[EVENT_SYNC0_PERIOD] = { "sync0_period", EVENT_ERROR },
	[EVENT_SYNC0_JITTER] = { "sync0_jitter", EVENT_ERROR },
	[EVENT_SYNC0_PHASE] = { "sync0_phase", EVENT_ERROR },
	[EVENT_SYNC0_SKEW] = { "sync0_skew", EVENT_ERROR },
	[EVENT_SYNC0_PHASE_STEP] = { "sync0_phase_step", EVENT_WARNING },
	[EVENT_SYNC0_CLOCK_STEP] = { "sync0_clock_step", EVENT_WARNING },
	[EVENT_SYNC0_CLEAR] = { "sync0_clear", EVENT_NOTICE },
	[EVENT_SYNC0_SHOT] = { "sync0_shot", EVENT_INFO },
	[EVENT_SYNC0_SHOT_LOST] = { "sync0_shot_lost", EVENT_ERROR },
};

const char *event_name(uint16_t id)
{
	return id < EVENT_COUNT ? kinds[id].name : "unknown";
}

enum event_severity event_severity(uint16_t id)
{
	return id < EVENT_COUNT ? kinds[id].severity : EVENT_ERROR;
}

const char *event_severity_to_str(enum event_severity severity)
{
	switch (severity) {
	case EVENT_INFO:
		return "info";
	case EVENT_NOTICE:
		return "notice";
	case EVENT_WARNING:
		return "warning";
	case EVENT_ERROR:
		break;
	}
	return "error";
}

int event_severity_parse(const char *name, enum event_severity *ret)
{
	for (int severity = EVENT_INFO; name != NULL && severity <= EVENT_ERROR; severity++) {
		if (strcmp(event_severity_to_str((enum event_severity)severity), name) == 0) {
			*ret = (enum event_severity)severity;
			return 0;
		}
	}
	return -EINVAL;
}

static const char *rt_to_str(uint32_t which)
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
	static const char *const names[] = { "none",
					     "ping",
					     "set",
					     "oneshot",
					     "SDO read",
					     "SDO write",
					     "stop",
					     "clear",
					     "cancel",
					     "data",
					     "rescan",
					     "AL state",
					     "register read",
					     "register write",
					     "SII read",
					     "SII write",
					     "SII alias",
					     "diagnosis",
					     "error counter reset",
					     "SDO list",
					     "SDO object",
					     "SDO entry",
					     "FoE read",
					     "FoE write",
					     "SoE read",
					     "SoE write",
					     "EoE IP read",
					     "EoE IP write",
					     "AoE read",
					     "AoE write",
					     "VoE",
					     [49] = "configuration reload" };

	return verb >= 0 && verb < (int32_t)(sizeof(names) / sizeof(names[0])) &&
			       names[verb] != NULL
		       ? names[verb]
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

/* A test formats every event, so the default cannot hide a missing one. */
static void format_sync0_figures(const struct event *ev, char *buf, size_t buf_len)
{
	const int32_t *a = ev->arg;

	switch (ev->id) {
	case EVENT_SYNC0_PERIOD:
		snprintf(buf, buf_len, "SYNC0 period off by %" PRId32 " ppb, limit %" PRId32 " ppb",
			 a[0], a[1]);
		break;
	case EVENT_SYNC0_JITTER:
		snprintf(buf, buf_len, "SYNC0 jitter p99 %" PRId32 " ns, limit %" PRId32 " ns",
			 a[0], a[1]);
		break;
	case EVENT_SYNC0_PHASE:
		snprintf(buf, buf_len,
			 "SYNC0 %" PRId32 " ns after its DC time, limit %" PRId32 " ns", a[0],
			 a[1]);
		break;
	case EVENT_SYNC0_SKEW:
		snprintf(buf, buf_len,
			 "SYNC0 %" PRId32 " ns after the first line's, limit %" PRId32 " ns", a[0],
			 a[1]);
		break;
	case EVENT_SYNC0_CLEAR:
		snprintf(buf, buf_len, "SYNC0 %s is good again",
			 sync0_check_to_str((uint32_t)a[0]));
		break;
	case EVENT_SYNC0_OVERFLOW:
		snprintf(buf, buf_len, "%" PRId32 " edges dropped from a full queue", a[0]);
		break;
	default:
		snprintf(buf, buf_len, "event %u", ev->id);
		break;
	}
}

static void format_sync0_pulses(const struct event *ev, char *buf, size_t buf_len)
{
	const int32_t *a = ev->arg;

	switch (ev->id) {
	case EVENT_SYNC0_LOST:
		snprintf(buf, buf_len, "SYNC0 lost, %" PRId32 " cycles without an edge", a[0]);
		break;
	case EVENT_SYNC0_BACK:
		snprintf(buf, buf_len, "SYNC0 back after %" PRId32 " cycles without an edge", a[0]);
		break;
	case EVENT_SYNC0_MISSING:
		snprintf(buf, buf_len, "SYNC0 missing, %" PRId32 " in a row", a[0]);
		break;
	case EVENT_SYNC0_EXTRA:
		snprintf(buf, buf_len, "SYNC0 extra, %" PRId32 " in this window", a[0]);
		break;
	case EVENT_SYNC0_PHASE_STEP:
		snprintf(buf, buf_len, "SYNC0 stepped by %" PRId32 " ns", a[0]);
		break;
	case EVENT_SYNC0_CLOCK_STEP:
		snprintf(buf, buf_len, "host clock stepped against DC time by %" PRId32 " ns",
			 a[0]);
		break;
	default:
		format_sync0_figures(ev, buf, buf_len);
		break;
	}
}

/* Within its error, all that is known of the distance is a bound. */
static int format_shot(const struct event *ev, const char *where, char *buf, size_t buf_len)
{
	int32_t late_ns = ev->arg[0];
	int32_t error_ns = ev->arg[1];

	if (llabs(late_ns) <= error_ns) {
		return snprintf(buf, buf_len,
				"%sone-shot for DC time %" PRId64 " came; distance below %" PRId32
				" ns (unresolved)",
				where, ev->value, error_ns);
	}
	return snprintf(buf, buf_len,
			"%sone-shot for DC time %" PRId64 " came %lld ns %s it, +-%" PRId32 " ns",
			where, ev->value, llabs(late_ns), late_ns < 0 ? "before" : "after",
			error_ns);
}

/* What ecdaq-sync0 saw; each begins with slave and line, where it has one. */
static int format_sync0(const struct event *ev, char *buf, size_t buf_len)
{
	char text[128];
	char where[48] = "";

	if (ev->slave_pos != EVENT_NO_SLAVE) {
		snprintf(where, sizeof(where), "slave %u, line %" PRIu32 ": ", ev->slave_pos,
			 ev->line);
	}
	if (ev->id == EVENT_SYNC0_SHOT) {
		return format_shot(ev, where, buf, buf_len);
	}
	if (ev->id == EVENT_SYNC0_SHOT_LOST) {
		return snprintf(buf, buf_len, "%sone-shot for DC time %" PRId64 " did not come",
				where, ev->value);
	}
	format_sync0_pulses(ev, text, sizeof(text));
	return snprintf(buf, buf_len, "%scycle %" PRId64 ": %s", where, ev->value, text);
}

/* Error code 0 takes an emergency back (ETG.1000.6). */
static int format_emergency(const struct event *ev, char *buf, size_t buf_len)
{
	uint64_t data = (uint64_t)ev->value;

	return snprintf(buf, buf_len,
			"slave %u: emergency %s0x%04" PRIx32 ", error register 0x%02" PRIx32
			", data %02x %02x %02x %02x %02x",
			ev->slave_pos, ev->arg[0] == 0 ? "over, " : "", (uint32_t)ev->arg[0],
			(uint32_t)ev->arg[1], (unsigned)(data & 0xff), (unsigned)(data >> 8 & 0xff),
			(unsigned)(data >> 16 & 0xff), (unsigned)(data >> 24 & 0xff),
			(unsigned)(data >> 32 & 0xff));
}

/* A device that is none of the slaves, by vendor and product where they are known. */
static int format_stranger(const struct event *ev, char *buf, size_t buf_len)
{
	uint64_t identity = (uint64_t)ev->value;
	char what[56] = "";
	char whose[48] = "";

	if (identity != 0) {
		snprintf(what, sizeof(what), ", vendor 0x%08" PRIx64 " product 0x%08" PRIx64,
			 identity >> 32, identity & 0xffffffff);
	}
	if (ev->slave_pos != EVENT_NO_SLAVE && ev->id != EVENT_SLAVE_WRONG) {
		snprintf(whose, sizeof(whose),
			 ev->id == EVENT_SLAVE_UNREADABLE ? " in the place of slave %u"
							  : ", had the address of slave %u",
			 ev->slave_pos);
	}
	switch (ev->id) {
	case EVENT_STRANGER:
		return snprintf(buf, buf_len,
				"position %" PRId32
				": a device that is not configured%s%s; isolated",
				ev->arg[0], what, whose);
	case EVENT_STRANGER_GONE:
		return snprintf(buf, buf_len,
				"position %" PRId32 ": the device that is not configured is gone%s",
				ev->arg[0], what);
	case EVENT_SLAVE_WRONG:
		return snprintf(buf, buf_len,
				"slave %u: wrong device in its place, position %" PRId32 "%s",
				ev->slave_pos, ev->arg[0], what);
	default:
		return snprintf(buf, buf_len,
				"position %" PRId32 ": EEPROM blank, damaged or unreadable%s",
				ev->arg[0], whose);
	}
}

static int format_alarm(const struct event *ev, char *buf, size_t buf_len)
{
	return snprintf(buf, buf_len,
			"slave %u: stays in %s%s after %" PRId32
			" attempts, AL status code 0x%04" PRIx64 "; not tried again until cleared",
			ev->slave_pos, al_name(ev->arg[0]), ev->arg[0] & 0x10 ? "+ERROR" : "",
			ev->arg[1], (uint64_t)ev->value & 0xffff);
}

static int format_eoe(const struct event *ev, char *buf, size_t buf_len)
{
	char of[32] = "";

	if (ev->slave_pos != EVENT_NO_SLAVE) {
		snprintf(of, sizeof(of), ", the newest of slave %u", ev->slave_pos);
	}
	return snprintf(buf, buf_len,
			"EoE: %" PRId32 " frames lost, %" PRId32 " fragments or frames rejected%s",
			ev->arg[0], ev->arg[1], of);
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
				"cycle %" PRId64 ": frame came %" PRId32 " cycles late, discarded",
				ev->value, a[0]);
	case EVENT_FRAME_DOUBLED:
		return snprintf(buf, buf_len, "cycle %" PRId64 ": duplicate frame", ev->value);
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
				"cycle numbers continue at %" PRId64 ", %" PRId32
				" without a sample",
				ev->value, a[0]);
	case EVENT_DC_LOCKED:
		return snprintf(buf, buf_len, "DC locked, phase error %" PRId32 " ns", a[0]);
	case EVENT_DC_UNLOCKED:
		return snprintf(buf, buf_len, "DC lock lost, phase error %" PRId32 " ns", a[0]);
	case EVENT_DC_DIFF_HIGH:
		return snprintf(buf, buf_len,
				"cycle %" PRId64
				": system time difference of a slave up to %" PRId32
				" ns, limit %" PRId32 " ns",
				ev->value, a[0], a[1]);
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
	case EVENT_CONTROL_OVERRUN:
		return snprintf(buf, buf_len,
				"cycle %" PRId64 ": control program took %" PRId32 " ns of %" PRId32
				" ns",
				ev->value, a[0], a[1]);
	case EVENT_CONTROL_CRASHED:
		return snprintf(buf, buf_len,
				"control program crashed: signal %" PRId32 " (%s) at 0x%" PRIx64,
				a[0], sigabbrev_np(a[0]) != NULL ? sigabbrev_np(a[0]) : "unknown",
				(uint64_t)ev->value);
	case EVENT_RT_DEGRADED:
		return snprintf(buf, buf_len, "degraded: no %s: %s", rt_to_str((uint32_t)a[0]),
				reason(a[1]));
	case EVENT_OP_LOST:
		return snprintf(buf, buf_len,
				"cycle %" PRId64
				": a slave has left OP: AL status of all ORed 0x%02" PRIx32
				", %" PRId32 " answered",
				ev->value, (uint32_t)a[0], a[1]);
	case EVENT_SLAVE_COUNT:
		return snprintf(buf, buf_len,
				"cycle %" PRId64 ": %" PRId32
				" slaves on the wire, expected %" PRId32,
				ev->value, a[0], a[1]);
	case EVENT_EMERGENCY:
		return format_emergency(ev, buf, buf_len);
	case EVENT_STRANGER:
	case EVENT_STRANGER_GONE:
	case EVENT_SLAVE_WRONG:
	case EVENT_SLAVE_UNREADABLE:
		return format_stranger(ev, buf, buf_len);
	case EVENT_SLAVE_ABSENT:
		return snprintf(buf, buf_len, "slaves[%" PRId32 "] is optional and absent", a[0]);
	case EVENT_SM_LENGTH:
		return snprintf(buf, buf_len,
				"slave %u: %" PRId32 " bytes are mapped to SM%" PRId32
				" by CoE, %" PRId64 " by its SII: CoE is used",
				slave, a[1], a[0], ev->value);
	case EVENT_GATEWAY_LOST:
		return snprintf(buf, buf_len,
				"mailbox gateway: %" PRId32
				" mails not answered by the slave, %" PRId32
				" mails dropped, %" PRId64 " connections closed",
				a[0], a[1], ev->value);
	case EVENT_EOE_LOST:
		return format_eoe(ev, buf, buf_len);
	case EVENT_SLAVE_ALARM:
		return format_alarm(ev, buf, buf_len);
	case EVENT_SDO_ABORT:
		return snprintf(buf, buf_len,
				"slave %u: SDO 0x%04" PRIx32 ":%02" PRIx32 " abort 0x%08" PRIx64,
				slave, (uint32_t)a[0] >> 8, (uint32_t)a[0] & 0xff,
				(uint64_t)ev->value & 0xffffffff);
	case EVENT_SYNC0_LOST:
	case EVENT_SYNC0_BACK:
	case EVENT_SYNC0_MISSING:
	case EVENT_SYNC0_EXTRA:
	case EVENT_SYNC0_OVERFLOW:
	case EVENT_SYNC0_PERIOD:
	case EVENT_SYNC0_JITTER:
	case EVENT_SYNC0_PHASE:
	case EVENT_SYNC0_SKEW:
	case EVENT_SYNC0_PHASE_STEP:
	case EVENT_SYNC0_CLOCK_STEP:
	case EVENT_SYNC0_CLEAR:
	case EVENT_SYNC0_SHOT:
	case EVENT_SYNC0_SHOT_LOST:
		return format_sync0(ev, buf, buf_len);
	case EVENT_LINK:
		return snprintf(buf, buf_len, "link %s", a[0] ? "up" : "down");
	case EVENT_RECORD_STARTED:
		return snprintf(buf, buf_len, "recording from cycle %" PRId64, ev->value);
	case EVENT_RECORD_GAP:
		return snprintf(buf, buf_len,
				"recording has a gap: %" PRId32 " cycles from %" PRId64, a[0],
				ev->value);
	case EVENT_STREAM_GAP:
		return snprintf(buf, buf_len, "stream has a gap: %" PRId32 " cycles from %" PRId64,
				a[0], ev->value);
	case EVENT_RECORD_DISK_FULL:
		return snprintf(buf, buf_len,
				"recording stopped: disk full, %" PRId64 " bytes free", ev->value);
	case EVENT_RECORD_RESUMED:
		return snprintf(buf, buf_len, "recording again from cycle %" PRId64, ev->value);
	}
	return snprintf(buf, buf_len, "event %u", ev->id);
}
