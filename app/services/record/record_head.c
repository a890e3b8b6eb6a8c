/* SPDX-License-Identifier: MIT */
#include "record/record_head.h"

#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "image/image.h"
#include "program/json.h"
#include "record/messages.h"

enum { PAIRS_PER_FIELD = 7, NUMBERS = 20, NUMBER_BYTES = 24 };

/* A small list of pairs whose values are numbers, made on the spot. */
struct numbers {
	struct mcap_pair pair[NUMBERS];
	char text[NUMBERS][NUMBER_BYTES];
	size_t count;
};

static void add_text(struct numbers *n, const char *key, const char *value)
{
	n->pair[n->count++] = (struct mcap_pair){ key, value };
}

static void add_unsigned(struct numbers *n, const char *key, uint64_t value)
{
	snprintf(n->text[n->count], NUMBER_BYTES, "%" PRIu64, value);
	add_text(n, key, n->text[n->count]);
}

static void add_signed(struct numbers *n, const char *key, int64_t value)
{
	snprintf(n->text[n->count], NUMBER_BYTES, "%" PRId64, value);
	add_text(n, key, n->text[n->count]);
}

static int put_fixed_channel(struct mcap_writer *w, enum messages_kind kind)
{
	static const struct mcap_pair pairs[] = { { "offered_qos_profiles", "" } };
	struct mcap_channel_spec channel = { .topic = messages_topic(kind),
					     .message_encoding = "cdr",
					     .pairs = pairs,
					     .pair_count = 1 };
	char type[LAYOUT_NAME_BYTES + 32];
	char *text = messages_ros2msg(kind);
	int r;

	if (text == NULL) {
		return -ENOMEM;
	}
	messages_schema_name(messages_type(kind), type, sizeof(type));
	r = mcap_writer_schema(w, type, "ros2msg", text);
	free(text);
	if (r < 0) {
		return r;
	}
	channel.schema_id = (uint16_t)r;
	return mcap_writer_channel(w, &channel);
}

/* Unit, scale and so on of each field, as "FIELD.unit": what a reader needs for physical values.
 * Those of a raw field are those of its channel; a physical one has scale 1, and "FIELD.raw" is the
 * raw field of the same channel, empty where there is none. */
struct field_pairs {
	struct mcap_pair *pair;
	size_t count;
	char (*text)[LAYOUT_NAME_BYTES + 16]; /* keys and numbers */
	size_t texts;
};

static char *next_text(struct field_pairs *p)
{
	return p->text[p->texts++];
}

static void add_key(struct field_pairs *p, const char *field, const char *what, const char *value)
{
	char *key = next_text(p);

	snprintf(key, sizeof(p->text[0]), "%s.%s", field, what);
	p->pair[p->count++] = (struct mcap_pair){ key, value };
}

static void add_field_pairs(struct field_pairs *p, const struct layout_field *f)
{
	int is_raw = f->raw_name == NULL;
	char *scale = next_text(p);
	char *offset = next_text(p);

	json_real_format(is_raw ? f->channel->scale : 1, scale, sizeof(p->text[0]));
	json_real_format(is_raw ? f->channel->offset : 0, offset, sizeof(p->text[0]));
	add_key(p, f->name, "channel", f->channel->name);
	add_key(p, f->name, "unit", f->channel->unit);
	add_key(p, f->name, "scale", scale);
	add_key(p, f->name, "offset", offset);
	if (!is_raw) {
		add_key(p, f->name, "raw", f->raw_name);
	}
	if (image_has_range(f->channel)) {
		char *min = next_text(p);
		char *max = next_text(p);

		json_real_format(f->channel->min, min, sizeof(p->text[0]));
		json_real_format(f->channel->max, max, sizeof(p->text[0]));
		add_key(p, f->name, "min", min);
		add_key(p, f->name, "max", max);
	}
}

static int put_topic_channel(struct mcap_writer *w, const struct layout_topic *topic, int schema_id)
{
	size_t pairs = topic->field_count * PAIRS_PER_FIELD + 3;
	struct field_pairs p = { .count = 0 };
	int r = -ENOMEM;

	p.pair = calloc(pairs, sizeof(p.pair[0]));
	p.text = calloc(pairs * 2, sizeof(p.text[0]));
	if (p.pair != NULL && p.text != NULL) {
		char *position = next_text(&p);

		snprintf(position, sizeof(p.text[0]), "%u", topic->slave->slave_pos);
		p.pair[p.count++] = (struct mcap_pair){ "offered_qos_profiles", "" };
		p.pair[p.count++] = (struct mcap_pair){ "slave", topic->slave->name };
		p.pair[p.count++] = (struct mcap_pair){ "position", position };
		for (size_t i = 0; i < topic->field_count; i++) {
			add_field_pairs(&p, &topic->field[i]);
		}
		r = mcap_writer_channel(
			w, &(struct mcap_channel_spec){ .schema_id = (uint16_t)schema_id,
							.topic = topic->topic,
							.message_encoding = "cdr",
							.pairs = p.pair,
							.pair_count = p.count });
	}
	free(p.pair);
	free(p.text);
	return r;
}

static int put_topic(struct mcap_writer *w, const struct layout_topic *topic)
{
	char type[LAYOUT_NAME_BYTES + 32];
	char *text = layout_ros2msg(topic);
	int r;

	if (text == NULL) {
		return -ENOMEM;
	}
	messages_schema_name(topic->type, type, sizeof(type));
	r = mcap_writer_schema(w, type, "ros2msg", text);
	free(text);
	return r < 0 ? r : put_topic_channel(w, topic, r);
}

static int put_channels(struct mcap_writer *w, const struct layout *layout)
{
	size_t count;
	const struct layout_topic *topic = layout_topics(layout, &count);

	for (int kind = 0; kind < MESSAGE_KINDS; kind++) {
		int r = put_fixed_channel(w, (enum messages_kind)kind);

		if (r < 0) {
			return r;
		}
	}
	for (size_t i = 0; i < count; i++) {
		int r = put_topic(w, &topic[i]);

		if (r < 0) {
			return r;
		}
	}
	return 0;
}

static int put_session(struct mcap_writer *w, const struct record_file_spec *spec)
{
	const struct sample_meta *meta = layout_meta(spec->layout);
	const struct store_state *before = spec->before;
	struct numbers n = { .count = 0 };

	add_text(&n, "program", "ecdaq-record " ECDAQ_VERSION);
	add_unsigned(&n, "session", meta->session);
	add_unsigned(&n, "file_sequence", spec->file_sequence);
	add_unsigned(&n, "period_ns", meta->period_ns);
	add_unsigned(&n, "next_cycle", before->next_cycle);
	add_unsigned(&n, "first_cycle", before->first_cycle);
	add_unsigned(&n, "cycles_before", before->cycles);
	add_unsigned(&n, "gaps_before", before->gaps);
	add_unsigned(&n, "cycles_missing_before", before->missing);
	add_unsigned(&n, "event_next", before->event_next);
	add_signed(&n, "event_mono_ns", before->event_mono_ns);
	add_unsigned(&n, "image_bytes", meta->image_bytes);
	add_unsigned(&n, "slaves", meta->slave_count);
	add_unsigned(&n, "channels", meta->channel_count);
	add_signed(&n, "tai_offset_s", meta->tai_offset_s);
	add_text(&n, "time_scale",
		 meta->tai_offset_s == 0
			 ? "the kernel's TAI offset is unset: CLOCK_TAI was taken for UTC"
			 : "UTC from CLOCK_TAI and the kernel's TAI offset");
	return mcap_writer_metadata(w, "ecdaq.session", n.pair, n.count);
}

static int put_timemap(struct mcap_writer *w, const char *name, const struct timemap_state *s)
{
	struct numbers n = { .count = 0 };

	add_signed(&n, "dc_ns", s->dc_ns);
	add_signed(&n, "utc_ns", s->utc_ns);
	add_signed(&n, "rate_ppb", s->rate_ppb);
	add_signed(&n, "uncertainty_ns", s->uncertainty_ns);
	add_signed(&n, "step_ns", s->step_ns);
	add_unsigned(&n, "steps", s->steps);
	add_signed(&n, "tai_offset_s", s->tai_offset_s);
	add_signed(&n, "clock_error_ns", s->clock_error_ns);
	add_signed(&n, "clock_estimate_ns", s->clock_estimate_ns);
	add_text(&n, "clock",
		 s->clock_error_ns < 0
			 ? "nothing disciplines the host's clock: its error is not known"
			 : "disciplined (chrony, linuxptp): at most clock_error_ns off UTC");
	return mcap_writer_metadata(w, name, n.pair, n.count);
}

static int put_config(struct mcap_writer *w, const struct record_file_spec *spec)
{
	const struct mcap_pair pairs[] = { { "path", spec->config_path },
					   { "yaml", spec->config_text } };

	return mcap_writer_metadata(w, "ecdaq.config", pairs, 2);
}

static int put_json(struct mcap_writer *w, const struct layout *layout)
{
	char *json = layout_json(layout);
	const struct mcap_pair pairs[] = { { "json", json } };
	int r = json == NULL ? -ENOMEM : mcap_writer_metadata(w, "ecdaq.channels", pairs, 1);

	free(json);
	return r;
}

static int put_idl(struct mcap_writer *w, const struct record_file_spec *spec)
{
	char *idl = layout_idl(spec->layout);
	int64_t utc_ns = spec->timemap->utc_ns;
	int r = idl == NULL ? -ENOMEM
			    : mcap_writer_attachment(w, "ecdaq.idl", "text/x-omg-idl",
						     utc_ns > 0 ? (uint64_t)utc_ns : 0, idl,
						     strlen(idl));

	free(idl);
	return r;
}

int record_head_put(struct mcap_writer *w, const struct record_file_spec *spec)
{
	int r = mcap_writer_begin(w, "ros2", "ecdaq " ECDAQ_VERSION);

	r = r < 0 ? r : put_channels(w, spec->layout);
	r = r < 0 ? r : put_session(w, spec);
	r = r < 0 ? r : put_config(w, spec);
	r = r < 0 ? r : put_json(w, spec->layout);
	r = r < 0 ? r : put_timemap(w, "ecdaq.timemap", spec->timemap);
	return r < 0 ? r : put_idl(w, spec);
}

int record_head_put_end(struct mcap_writer *w, const struct record_head_counts *counts,
			const struct record_file_end *end)
{
	struct numbers n = { .count = 0 };
	int r = put_timemap(w, "ecdaq.timemap_end", end->timemap);

	add_text(&n, "reason", end->reason);
	add_unsigned(&n, "cycles", counts->cycles);
	add_unsigned(&n, "first_cycle", counts->first_cycle);
	add_unsigned(&n, "last_cycle", counts->last_cycle);
	add_unsigned(&n, "session_cycles", end->after->cycles);
	add_unsigned(&n, "session_gaps", end->after->gaps);
	add_unsigned(&n, "session_cycles_missing", end->after->missing);
	add_unsigned(&n, "session_events_lost", end->events_lost);
	return r < 0 ? r : mcap_writer_metadata(w, "ecdaq.end", n.pair, n.count);
}
