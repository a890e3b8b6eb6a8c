/* SPDX-License-Identifier: MIT */
#include "web/folds.h"

#include "base/event.h"
#include "program/event_text.h"
#include "web/text.h"

struct folds {
	struct text text;
	struct event_fold fold;
	const struct status_page *page;
	int64_t utc_minus_tai_ns;
};

struct line {
	const struct event *first;
	enum event_severity severity;
	uint64_t count;
	const char *text;
};

/* Up to the kinds, which follow. */
static void begin_line(struct folds *f, const struct line *line)
{
	struct json *js = &f->text.json;

	json_object_begin(js, NULL);
	json_fixed(js, "ms", (double)(line->first->tai_ns + f->utc_minus_tai_ns) / 1e6, 3);
	json_u64(js, "cycle", line->first->cycle);
	json_text(js, "severity", event_severity_to_str(line->severity));
	json_u64(js, "count", line->count);
	json_text(js, "text", line->text);
	if (line->first->slave_pos != EVENT_NO_SLAVE) {
		json_u64(js, "slave", line->first->slave_pos);
	}
	json_array_begin(js, "kinds");
}

static void end_line(struct folds *f)
{
	json_array_end(&f->text.json);
	json_object_end(&f->text.json);
}

static void put_fold(struct folds *f)
{
	char text[EVENT_TEXT_BYTES];

	if (f->fold.total == 0) {
		return;
	}
	event_fold_text(&f->fold, f->page, text);
	if (!f->fold.are_of_one_slave) {
		f->fold.first.slave_pos = EVENT_NO_SLAVE;
	}
	begin_line(f, &(struct line){ &f->fold.first, event_fold_severity(&f->fold), f->fold.total,
				      text });
	for (size_t n = 0; n < event_fold_kinds(&f->fold); n++) {
		json_text(&f->text.json, NULL, event_name((uint16_t)event_fold_kind(&f->fold, n)));
	}
	end_line(f);
	f->fold.total = 0;
}

static void put_event(struct folds *f, const struct event *ev)
{
	char text[EVENT_TEXT_BYTES];

	event_text(ev, f->page, text);
	begin_line(f, &(struct line){ ev, event_severity(ev->id), 1, text });
	json_text(&f->text.json, NULL, event_name(ev->id));
	end_line(f);
}

char *folds_text(const struct event_log *log, const struct status_page *page,
		 int64_t utc_minus_tai_ns)
{
	struct folds f = { .page = page, .utc_minus_tai_ns = utc_minus_tai_ns };
	uint64_t count = event_log_count(log);

	if (text_begin(&f.text, "folds") < 0) {
		return NULL;
	}
	json_array_begin(&f.text.json, "lines");
	for (uint64_t n = count < EVENT_LOG_EVENTS ? 0 : count - EVENT_LOG_EVENTS; n < count; n++) {
		const struct event *ev = event_log_at(log, n);

		if (!event_fold_is_for(ev)) {
			put_fold(&f);
			put_event(&f, ev);
		} else if (!event_fold_add(&f.fold, ev)) {
			put_fold(&f);
			event_fold_add(&f.fold, ev);
		}
	}
	put_fold(&f);
	json_array_end(&f.text.json);
	return text_end(&f.text);
}
