/* SPDX-License-Identifier: MIT */
#include "record/messages.h"

#include <assert.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/limits.h"
#include "base/slave_set.h"
#include "reader/table.h"
#include "record/cdr.h"

struct field {
	const char *ros_type;
	const char *idl_type;
	const char *name;
	const char *comment;
};

enum { FIELDS = 40, TEXT_BYTES = 512 };

static const struct {
	const char *topic;
	const char *type;
	const char *comment;
	struct field field[FIELDS];
} kinds[MESSAGE_KINDS] = {
	[MESSAGE_CYCLE] = { "/ecdaq/cycle",
			    "Cycle",
			    "One cycle of the master.",
			    {
				    { "uint64", "unsigned long long", "cycle",
				      "index of the SYNC0 edge, one more in every message" },
				    { "int64", "long long", "dc_time_ns",
				      "DC time of that edge, ns since 2000-01-01; 0 without DC" },
				    { "int64", "long long", "wake_mono_ns",
				      "CLOCK_MONOTONIC at the wake" },
				    { "int64", "long long", "wake_tai_ns",
				      "CLOCK_TAI at the wake, ns since 1970" },
				    { "int64", "long long", "frame_dc_ns",
				      "DC time at which the frame passed the reference clock; 0: "
				      "none" },
				    { "int32", "long", "wake_latency_ns", "wake minus deadline" },
				    { "int32", "long", "round_trip_ns",
				      "frame out to frame back; -1: lost" },
				    { "int32", "long", "phase_error_ns",
				      "frame against SYNC0 plus set point" },
				    { "int32", "long", "dc_diff_ns",
				      "largest system time difference (0x092C) of the slaves; -1: "
				      "not read" },
				    { "uint32", "unsigned long", "flags",
				      "1 lost, 2 late, 4 WKC low, 8 not OP, 16 fail-safe, 32 "
				      "skipped, 64 bad counter, "
				      "128 DC unlocked, 256 doubled, 512 unchecked" },
				    { "uint16", "unsigned short", "wkc",
				      "working counter of the process data" },
				    { "uint16", "unsigned short", "wkc_expected",
				      "what it should be" },
				    { "uint8[<=64]", "sequence<octet, 64>", "slaves_bad",
				      "bit n % 8 of octet n / 8: the sample of slave n is not "
				      "good" },
			    } },
	[MESSAGE_EVENT] = { "/ecdaq/event",
			    "Event",
			    "Something that happened.",
			    {
				    { "int64", "long long", "time_ns", "Unix time" },
				    { "int64", "long long", "mono_ns", "CLOCK_MONOTONIC" },
				    { "uint64", "unsigned long long", "sequence",
				      "in the event ring; 2^64-1: by the recorder itself" },
				    { "uint64", "unsigned long long", "cycle",
				      "in which it was noticed" },
				    { "int64", "long long", "value", "see text" },
				    { "int32", "long", "arg0", "see text" },
				    { "int32", "long", "arg1", "see text" },
				    { "int32", "long", "slave", "position; -1: none" },
				    { "uint16", "unsigned short", "id", "number of name" },
				    { "string", "string", "name", "for machines" },
				    { "string", "string", "severity",
				      "info, notice, warning, error" },
				    { "string", "string", "text", "for people" },
			    } },
	[MESSAGE_TIMEMAP] = { "/ecdaq/timemap",
			      "TimeMap",
			      "DC time to UTC: utc = utc_ns + (dc - dc_ns) * (1 + rate_ppb / 1e9).",
			      {
				      { "int64", "long long", "dc_ns",
					"DC time; without DC: cycle number times period" },
				      { "int64", "long long", "utc_ns", "Unix time at dc_ns" },
				      { "int64", "long long", "rate_ppb", "UTC against DC" },
				      { "int64", "long long", "uncertainty_ns",
					"of utc_ns against the host's clock" },
				      { "int64", "long long", "step_ns",
					"size of the newest step of the host's clock" },
				      { "uint64", "unsigned long long", "steps",
					"number of steps so far" },
				      { "int32", "long", "tai_offset_s",
					"TAI minus UTC; 0: unset, CLOCK_TAI is taken for UTC" },
				      { "int64", "long long", "clock_error_ns",
					"of the host's clock against UTC at most; -1: nothing "
					"disciplines it, or not known" },
				      { "int64", "long long", "clock_estimate_ns",
					"the same, probably" },
			      } },
	[MESSAGE_SYNC0] = { "/ecdaq/sync0",
			    "Sync0",
			    "SYNC0 of one slave as seen on a GPIO line, over a window; a figure "
			    "that is not "
			    "resolved is a bound.",
			    {
				    { "int64", "long long", "time_ns",
				      "Unix time of the end of the window, or at which a shot was "
				      "due" },
				    { "int64", "long long", "mono_ns", "CLOCK_MONOTONIC" },
				    { "uint64", "unsigned long long", "first_cycle",
				      "index of the first SYNC0 of the window" },
				    { "uint64", "unsigned long long", "cycles",
				      "pulses that had to come" },
				    { "uint64", "unsigned long long", "edges", "those that came" },
				    { "uint64", "unsigned long long", "missing",
				      "those that did not" },
				    { "uint64", "unsigned long long", "extra",
				      "edges of no cycle" },
				    { "uint64", "unsigned long long", "overflow",
				      "edges that a full queue dropped" },
				    { "uint64", "unsigned long long", "first_missing",
				      "cycle; 0: none" },
				    { "int64", "long long", "step_ns",
				      "phase or clock step; 0: none" },
				    { "float64", "double", "period_ns",
				      "mean, by the host's clock" },
				    { "float64", "double", "period_sd_ns",
				      "with the measurement's own noise" },
				    { "int64", "long long", "jitter_p99_ns",
				      "of the period's deviation, the same" },
				    { "int64", "long long", "jitter_max_ns", "the same" },
				    { "float64", "double", "drift_ppb",
				      "DC clock against the host's" },
				    { "float64", "double", "drift_error_ppb", "bound" },
				    { "float64", "double", "rate_ppb", "SYNC0 against DC time" },
				    { "float64", "double", "rate_error_ppb", "bound" },
				    { "int64", "long long", "phase_ns", "edge after its DC time" },
				    { "int64", "long long", "phase_error_ns", "bound" },
				    { "int64", "long long", "frame_ns",
				      "from the edge to the cycle's frame" },
				    { "int64", "long long", "skew_ns",
				      "edge after the first line's" },
				    { "int64", "long long", "skew_error_ns", "bound" },
				    { "int64", "long long", "dc_diff_ns",
				      "largest 0x092C in the window; -1: not read" },
				    { "int64", "long long", "shot_dc_ns",
				      "commanded DC time of a shot; 0: a window" },
				    { "int64", "long long", "shot_late_ns", "edge after it" },
				    { "uint32", "unsigned long", "has",
				      "1 period, 2 drift, 4 rate, 8 phase, 16 skew" },
				    { "uint32", "unsigned long", "resolved",
				      "the same bits, 32 jitter: above the noise" },
				    { "uint16", "unsigned short", "slave", "position" },
				    { "uint16", "unsigned short", "line", "from 0" },
				    { "string", "string", "source", "gpio, simulated edges" },
				    { "string", "string", "verdict", "OK, UNRESOLVED, WARN, FAIL" },
			    } },
};

const char *messages_topic(enum messages_kind kind)
{
	return kinds[kind].topic;
}

const char *messages_type(enum messages_kind kind)
{
	return kinds[kind].type;
}

int messages_has_topic(const char *topic)
{
	for (size_t i = 0; i < MESSAGE_KINDS; i++) {
		if (strcmp(kinds[i].topic, topic) == 0) {
			return 1;
		}
	}
	return 0;
}

int messages_has_type(const char *type)
{
	for (size_t i = 0; i < MESSAGE_KINDS; i++) {
		if (strcmp(kinds[i].type, type) == 0) {
			return 1;
		}
	}
	return 0;
}

void messages_put_ros2msg(enum messages_kind kind, FILE *out)
{
	fprintf(out, "# %s\n", kinds[kind].comment);
	for (const struct field *f = kinds[kind].field; f->name != NULL; f++) {
		fprintf(out, "%s %s  # %s\n", f->ros_type, f->name, f->comment);
	}
}

char *messages_ros2msg(enum messages_kind kind)
{
	char *text = NULL;
	size_t len;
	FILE *out = open_memstream(&text, &len);

	if (out == NULL) {
		return NULL;
	}
	messages_put_ros2msg(kind, out);
	if (fclose(out) != 0) {
		free(text);
		return NULL;
	}
	return text;
}

void messages_schema_name(const char *type, char *buf, size_t buf_len)
{
	snprintf(buf, buf_len, MESSAGES_PACKAGE "/msg/%s", type);
}

void messages_put_idl(enum messages_kind kind, FILE *out)
{
	fprintf(out, "  // %s\n  @final\n  struct %s {\n", kinds[kind].comment, kinds[kind].type);
	for (const struct field *f = kinds[kind].field; f->name != NULL; f++) {
		fprintf(out, "    %s %s; // %s\n", f->idl_type, f->name, f->comment);
	}
	fprintf(out, "  };\n");
}

static_assert(LIMIT_SLAVES <= 64 * 8, "the bound of slaves_bad above");

/* Only the octets that @slave_count slaves need. */
static void put_slaves(struct cdr *c, const struct slave_set *set, uint32_t slave_count)
{
	uint32_t octets = (slave_count + 7) / 8;

	cdr_put(c, octets, 4);
	for (uint32_t i = 0; i < octets; i++) {
		cdr_put(c, set->word[i / 8] >> i % 8 * 8 & 0xff, 1);
	}
}

size_t messages_encode_cycle(const struct sample_header *h, uint32_t slave_count, uint8_t *buf)
{
	struct cdr c = cdr_begin(buf, MESSAGES_LARGEST_BYTES);

	cdr_put(&c, h->cycle, 8);
	cdr_put(&c, (uint64_t)h->dc_time_ns, 8);
	cdr_put(&c, (uint64_t)h->wake_mono_ns, 8);
	cdr_put(&c, (uint64_t)h->wake_tai_ns, 8);
	cdr_put(&c, (uint64_t)h->frame_dc_ns, 8);
	cdr_put(&c, (uint32_t)h->wake_latency_ns, 4);
	cdr_put(&c, (uint32_t)h->round_trip_ns, 4);
	cdr_put(&c, (uint32_t)h->phase_error_ns, 4);
	cdr_put(&c, (uint32_t)h->dc_diff_ns, 4);
	cdr_put(&c, h->flags, 4);
	cdr_put(&c, h->wkc, 2);
	cdr_put(&c, h->wkc_expected, 2);
	put_slaves(&c, sample_bad_slaves(h), slave_count);
	return c.len;
}

size_t messages_encode_event(const struct messages_event *ev, uint8_t *buf)
{
	const struct event *e = &ev->event;
	struct cdr c = cdr_begin(buf, MESSAGES_LARGEST_BYTES);
	int32_t slave = e->slave_pos == EVENT_NO_SLAVE ? -1 : e->slave_pos;
	char text[TEXT_BYTES];

	snprintf(text, sizeof(text), "%s", ev->text);
	cdr_put(&c, (uint64_t)ev->utc_ns, 8);
	cdr_put(&c, (uint64_t)e->mono_ns, 8);
	cdr_put(&c, ev->sequence, 8);
	cdr_put(&c, e->cycle, 8);
	cdr_put(&c, (uint64_t)e->value, 8);
	cdr_put(&c, (uint32_t)e->arg[0], 4);
	cdr_put(&c, (uint32_t)e->arg[1], 4);
	cdr_put(&c, (uint32_t)slave, 4);
	cdr_put(&c, e->id, 2);
	cdr_put_string(&c, event_name(e->id));
	cdr_put_string(&c, event_severity_to_str(event_severity(e->id)));
	cdr_put_string(&c, text);
	return c.len;
}

size_t messages_encode_timemap(const struct timemap_state *s, uint8_t *buf)
{
	struct cdr c = cdr_begin(buf, MESSAGES_LARGEST_BYTES);

	cdr_put(&c, (uint64_t)s->dc_ns, 8);
	cdr_put(&c, (uint64_t)s->utc_ns, 8);
	cdr_put(&c, (uint64_t)s->rate_ppb, 8);
	cdr_put(&c, (uint64_t)s->uncertainty_ns, 8);
	cdr_put(&c, (uint64_t)s->step_ns, 8);
	cdr_put(&c, s->steps, 8);
	cdr_put(&c, (uint32_t)s->tai_offset_s, 4);
	cdr_put(&c, (uint64_t)s->clock_error_ns, 8);
	cdr_put(&c, (uint64_t)s->clock_estimate_ns, 8);
	return c.len;
}

static void put_double(struct cdr *c, double value)
{
	uint64_t bits;

	memcpy(&bits, &value, sizeof(bits));
	cdr_put(c, bits, sizeof(bits));
}

size_t messages_encode_sync0(const struct sync0_result *r, int64_t utc_ns, uint8_t *buf)
{
	struct cdr c = cdr_begin(buf, MESSAGES_LARGEST_BYTES);

	cdr_put(&c, (uint64_t)utc_ns, 8);
	cdr_put(&c, (uint64_t)r->mono_ns, 8);
	cdr_put(&c, (uint64_t)r->first_cycle, 8);
	cdr_put(&c, (uint64_t)r->cycles, 8);
	cdr_put(&c, (uint64_t)r->edges, 8);
	cdr_put(&c, (uint64_t)r->missing, 8);
	cdr_put(&c, (uint64_t)r->extra, 8);
	cdr_put(&c, (uint64_t)r->overflow, 8);
	cdr_put(&c, (uint64_t)r->first_missing, 8);
	cdr_put(&c, (uint64_t)r->step_ns, 8);
	put_double(&c, r->period_ns);
	put_double(&c, r->period_sd_ns);
	cdr_put(&c, (uint64_t)r->jitter_p99_ns, 8);
	cdr_put(&c, (uint64_t)r->jitter_max_ns, 8);
	put_double(&c, r->drift_ppb);
	put_double(&c, r->drift_error_ppb);
	put_double(&c, r->rate_ppb);
	put_double(&c, r->rate_error_ppb);
	cdr_put(&c, (uint64_t)r->phase_ns, 8);
	cdr_put(&c, (uint64_t)r->phase_error_ns, 8);
	cdr_put(&c, (uint64_t)r->frame_ns, 8);
	cdr_put(&c, (uint64_t)r->skew_ns, 8);
	cdr_put(&c, (uint64_t)r->skew_error_ns, 8);
	cdr_put(&c, (uint64_t)r->dc_diff_ns, 8);
	cdr_put(&c, (uint64_t)r->shot_dc_ns, 8);
	cdr_put(&c, (uint64_t)r->shot_late_ns, 8);
	cdr_put(&c, (uint64_t)r->has, 4);
	cdr_put(&c, (uint64_t)r->is_resolved, 4);
	cdr_put(&c, (uint64_t)r->slave_pos, 2);
	cdr_put(&c, (uint64_t)r->line, 2);
	cdr_put_string(&c, sync0_source_to_str(r->source));
	cdr_put_string(&c, sync0_verdict_to_str(r->verdict));
	return c.len;
}

int messages_decode_cycle(const uint8_t *data, size_t data_len, uint64_t *ret_cycle)
{
	if (data_len < CDR_HEADER_BYTES + 8 || data[0] != 0 || data[1] != 1) {
		return -EBADMSG;
	}
	*ret_cycle = get_le64(data + CDR_HEADER_BYTES);
	return 0;
}

int messages_decode_event(const uint8_t *data, size_t data_len, uint64_t *ret_sequence,
			  int64_t *ret_mono_ns)
{
	if (data_len < CDR_HEADER_BYTES + 24 || data[0] != 0 || data[1] != 1) {
		return -EBADMSG;
	}
	*ret_mono_ns = (int64_t)get_le64(data + CDR_HEADER_BYTES + 8);
	*ret_sequence = get_le64(data + CDR_HEADER_BYTES + 16);
	return 0;
}

int messages_decode_event_cycle(const uint8_t *data, size_t data_len, uint64_t *ret_cycle)
{
	if (data_len < CDR_HEADER_BYTES + 32 || data[0] != 0 || data[1] != 1) {
		return -EBADMSG;
	}
	*ret_cycle = get_le64(data + CDR_HEADER_BYTES + 24);
	return 0;
}
