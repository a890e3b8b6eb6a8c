/* SPDX-License-Identifier: MIT */
#include "web/page.h"

#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "web/state.h"
#include "web/text.h"

#define GET(field) atomic_load_explicit(&(field), memory_order_relaxed)

enum { ROW_BYTES = 400, EVENT_BYTES = 256 };

static void put_channel(struct json *js, const struct channel *ch)
{
	json_object_begin(js, NULL);
	json_text(js, "name", ch->name);
	json_text(js, "unit", ch->unit);
	json_u64(js, "slave", ch->slave_pos);
	json_truth(js, "output", ch->direction == CHANNEL_OUTPUT);
	json_truth(js, "binary", ch->type == CHANNEL_BOOL);
	json_object_end(js);
}

char *page_table(const struct channel_table *table, int64_t recorded_ms)
{
	char session[24] = "";
	struct text t;

	if (text_begin(&t, "table") < 0) {
		return NULL;
	}
	if (table != NULL) {
		snprintf(session, sizeof(session), "%" PRIu64, table->meta.session);
	}
	json_text(&t.json, "session", session);
	json_u64(&t.json, "period_ns", table == NULL ? 0 : table->meta.period_ns);
	json_i64(&t.json, "recorded_ms", recorded_ms);
	json_array_begin(&t.json, "slaves");
	for (uint32_t i = 0; table != NULL && i < table->meta.slave_count; i++) {
		json_text(&t.json, NULL, table->slaves[i].name);
	}
	json_array_end(&t.json);
	json_array_begin(&t.json, "channels");
	for (uint32_t i = 0; table != NULL && i < table->meta.channel_count; i++) {
		put_channel(&t.json, &table->channels[i]);
	}
	json_array_end(&t.json);
	return text_end(&t);
}

static void put_row(struct json *js, const char *name, enum state_level level, const char *value)
{
	json_object_begin(js, NULL);
	json_text(js, "name", name);
	json_text(js, "level", state_level_to_str(level));
	json_text(js, "value", value);
	json_object_end(js);
}

static void put_daemon_rows(struct json *js, const struct status_page *page)
{
	uint32_t link = GET(page->link);
	uint32_t dc = GET(page->cycle.dc_state);
	uint32_t expected = GET(page->slaves_expected); /* 0: whatever is there */
	uint64_t lost = GET(page->cycle.frames_lost);
	enum state_level level = STATE_GOOD;
	char text[ROW_BYTES];

	snprintf(text, sizeof(text), "%s %s%s", page->interface,
		 link == STATUS_LINK_UP     ? "up"
		 : link == STATUS_LINK_DOWN ? "down"
					    : "unknown",
		 page->is_simulated ? ", simulated segment" : "");
	put_row(js, "Link", link == STATUS_LINK_DOWN ? STATE_BAD : STATE_GOOD, text);
	snprintf(text, sizeof(text),
		 "%" PRIu64 " of %" PRIu64 " us, %" PRIu64 " frames lost, %" PRIu64 " overruns",
		 GET(page->cycle.cycles), page->period_ns / 1000, lost, GET(page->cycle.overruns));
	put_row(js, "Cycles", lost > 0 ? STATE_WARNING : STATE_GOOD, text);
	snprintf(text, sizeof(text), "%" PRIu64 " good, %" PRIu64 " bad",
		 GET(page->cycle.samples_good), GET(page->cycle.samples_bad));
	put_row(js, "Samples", GET(page->cycle.samples_bad) > 0 ? STATE_WARNING : STATE_GOOD, text);
	put_row(js, "Distributed clocks",
		dc == DC_LOST || dc == DC_ACQUIRING ? STATE_WARNING : STATE_GOOD,
		dc_state_to_str(dc));
	snprintf(text, sizeof(text), "%u", GET(page->slave_count));
	if (expected != 0 && expected != GET(page->slave_count)) {
		snprintf(text, sizeof(text), "%u, expected %u", GET(page->slave_count), expected);
		level = STATE_BAD;
	}
	put_row(js, "Slaves", level, text);
}

static void put_recorder_row(struct json *js, const struct page_status *status)
{
	const struct record_status *record = status->record;
	char text[ROW_BYTES];

	if (status->record_error < 0 || !status->is_recorder_alive) {
		put_row(js, "Recorder", STATE_WARNING, "not running");
		return;
	}
	snprintf(text, sizeof(text),
		 "%s, %" PRIu64 " cycles, %" PRIu64 " gaps, %" PRIu64 " MiB free%s%s",
		 record_state_to_str(GET(record->state)), GET(record->recorded_cycles),
		 GET(record->recorded_gaps), GET(record->bytes_free) >> 20,
		 record->message[0] != '\0' ? ": " : "", record->message);
	put_row(js, "Recorder",
		GET(record->recorded_gaps) > 0 || record->message[0] != '\0' ? STATE_WARNING
									     : STATE_GOOD,
		text);
}

char *page_state(const struct page_status *status)
{
	struct state state;
	struct text t;

	if (text_begin(&t, "state") < 0) {
		return NULL;
	}
	state_judge(status->page, status->page_error, status->is_alive, &state);
	json_text(&t.json, "word", state.word);
	json_text(&t.json, "level", state_level_to_str(state.level));
	json_text(&t.json, "sentence", state.sentence);
	json_array_begin(&t.json, "rows");
	if (status->page_error == 0 && status->is_alive) {
		put_daemon_rows(&t.json, status->page);
	}
	put_recorder_row(&t.json, status);
	json_array_end(&t.json);
	return text_end(&t);
}

char *page_values(const double *value, uint32_t count, uint64_t cycle)
{
	struct text t;

	if (text_begin(&t, "values") < 0) {
		return NULL;
	}
	json_u64(&t.json, "cycle", cycle);
	json_array_begin(&t.json, "values");
	for (uint32_t i = 0; i < count; i++) {
		json_double(&t.json, NULL, value[i]);
	}
	json_array_end(&t.json);
	return text_end(&t);
}

char *page_events(const struct event_log *log, uint64_t first, int64_t utc_minus_tai_ns)
{
	struct text t;

	if (text_begin(&t, "events") < 0) {
		return NULL;
	}
	json_array_begin(&t.json, "events");
	for (uint64_t n = first; n < event_log_count(log); n++) {
		const struct event *ev = event_log_at(log, n);
		char text[EVENT_BYTES];

		if (ev != NULL) {
			event_format(ev, text, sizeof(text));
			json_object_begin(&t.json, NULL);
			json_fixed(&t.json, "ms", (double)(ev->tai_ns + utc_minus_tai_ns) / 1e6, 3);
			json_u64(&t.json, "cycle", ev->cycle);
			json_text(&t.json, "name", event_name(ev->id));
			json_text(&t.json, "severity",
				  event_severity_to_str(event_severity(ev->id)));
			json_text(&t.json, "text", text);
			if (ev->slave_pos != EVENT_NO_SLAVE) {
				json_u64(&t.json, "slave", ev->slave_pos);
			}
			json_object_end(&t.json);
		}
	}
	json_array_end(&t.json);
	return text_end(&t);
}

char *page_no_picture(uint32_t id, int error)
{
	struct text t;

	if (text_begin(&t, "nopicture") < 0) {
		return NULL;
	}
	json_u64(&t.json, "id", id);
	json_text(&t.json, "why",
		  error == -EAGAIN    ? "no trigger"
		  : error == -ENODATA ? "no samples"
				      : "no such channel");
	return text_end(&t);
}

static void put_sum(struct json *js, const struct history_sum *sum)
{
	json_object_begin(js, NULL);
	json_u64(js, "count", sum->count);
	json_double(js, "min", sum->min);
	json_double(js, "max", sum->max);
	json_double(js, "mean", sum->mean);
	json_double(js, "rms", sum->rms);
	json_double(js, "period", sum->period);
	json_object_end(js);
}

static char *picture_text(const struct history_request *request,
			  const struct history_picture *picture, uint32_t id)
{
	struct text t;

	if (text_begin(&t, "picture") < 0) {
		return NULL;
	}
	json_u64(&t.json, "id", id);
	json_u64(&t.json, "first", picture->first);
	json_u64(&t.json, "cycles", picture->cycles);
	json_u64(&t.json, "pixels", picture->pixels);
	if (picture->has_trigger) {
		json_u64(&t.json, "trigger", picture->trigger);
	}
	json_array_begin(&t.json, "channels");
	for (uint32_t i = 0; i < request->count; i++) {
		json_u64(&t.json, NULL, request->channel[i]);
	}
	json_array_end(&t.json);
	json_array_begin(&t.json, "sums");
	for (uint32_t i = 0; i < request->count; i++) {
		put_sum(&t.json, &picture->sum[i]);
	}
	json_array_end(&t.json);
	return text_end(&t);
}

static uint8_t *put_float(uint8_t *at, float value)
{
	uint32_t bits;

	memcpy(&bits, &value, sizeof(bits));
	put_le32(at, bits);
	return at + sizeof(bits);
}

size_t page_picture(const struct history_request *request, const struct history_picture *picture,
		    uint32_t id, uint8_t *buf, size_t buf_len)
{
	char *text = picture_text(request, picture, id);
	size_t len = text == NULL ? 0 : strlen(text);
	size_t filled = (len + 3) / 4 * 4;
	size_t bytes = 4 + filled + (size_t)request->count * picture->pixels * 8 + picture->pixels;
	uint8_t *at = buf + 4 + filled;

	if (text == NULL || bytes > buf_len) {
		free(text);
		return 0;
	}
	put_le32(buf, (uint32_t)filled);
	memcpy(buf + 4, text, len + 1);
	memset(buf + 4 + len, ' ', filled - len); /* the zero may be where the columns begin */
	free(text);
	for (uint32_t i = 0; i < request->count; i++) {
		for (uint32_t k = 0; k < picture->pixels; k++) {
			at = put_float(at, picture->column[i][k].min);
		}
		for (uint32_t k = 0; k < picture->pixels; k++) {
			at = put_float(at, picture->column[i][k].max);
		}
	}
	memcpy(at, picture->mark, picture->pixels);
	return bytes;
}
