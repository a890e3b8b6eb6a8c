/* SPDX-License-Identifier: MIT */
#include "stream/live.h"

#include <errno.h>
#include <stdlib.h>

#include "base/platform.h"
#include "reader/reader.h"
#include "reader/utc.h"

struct live {
	enum config_record_values values;
	struct reader *reader;
	struct layout *layout;
	struct utc *utc;
	struct topics topics;
	int is_whole;
	int64_t utc_ns; /* of the newest sample */
	uint8_t *message;
	size_t message_bytes;
};

int live_create(const struct config *cfg, struct live **ret_live)
{
	char path[CONFIG_PATH_BYTES];
	struct live *l = calloc(1, sizeof(*l));
	int r = l == NULL ? -ENOMEM : config_run_path(cfg, CONFIG_RUN_SAMPLES, path, sizeof(path));

	if (r >= 0) {
		l->values = cfg->record_values;
		r = reader_create(path, READER_AT_OLDEST, &l->reader);
	}
	if (r < 0) {
		live_destroy(l);
		return r;
	}
	*ret_live = l;
	return 0;
}

static void end_session(struct live *l)
{
	utc_destroy(l->utc);
	layout_destroy(l->layout);
	topics_done(&l->topics);
	free(l->message);
	l->utc = NULL;
	l->layout = NULL;
	l->message = NULL;
}

void live_destroy(struct live *l)
{
	if (l != NULL) {
		end_session(l);
		reader_destroy(l->reader);
		free(l);
	}
}

static enum live_result begin_session(struct live *l)
{
	const struct channel_table *table = reader_table(l->reader);

	end_session(l);
	l->utc = utc_create(&table->meta);
	if (l->utc == NULL || layout_create(table, l->values, &l->layout) < 0 ||
	    topics_of_layout(&l->topics, l->layout) < 0) {
		return LIVE_FAILED;
	}
	l->message_bytes = layout_largest_bytes(l->layout);
	l->message = malloc(l->message_bytes > 0 ? l->message_bytes : 1);
	l->is_whole = reader_oldest(l->reader) == 0;
	reader_seek(l->reader, reader_oldest(l->reader));
	return l->message == NULL ? LIVE_FAILED : LIVE_BEGUN;
}

enum live_result live_next(struct live *l)
{
	uint64_t lost;

	switch (reader_next(l->reader, &lost)) {
	case READER_SAMPLE:
		return utc_feed(l->utc, reader_header(l->reader), &l->utc_ns) < 0 ? LIVE_FAILED
										  : LIVE_SAMPLE;
	case READER_LOST:
		return LIVE_LOST;
	case READER_EMPTY:
		return LIVE_EMPTY;
	case READER_BEGUN:
		return begin_session(l);
	case READER_ENDED:
		return LIVE_ENDED;
	case READER_WAITING:
		return LIVE_WAITING;
	}
	return LIVE_WAITING;
}

const struct topics *live_topics(const struct live *l)
{
	return &l->topics;
}

uint64_t live_cycle(const struct live *l)
{
	return reader_header(l->reader)->cycle;
}

int64_t live_utc_ns(const struct live *l)
{
	return l->utc_ns;
}

const uint8_t *live_message(struct live *l, size_t lane, size_t *ret_len)
{
	size_t count;
	const struct layout_topic *topic = layout_topics(l->layout, &count);

	*ret_len = layout_encode(&topic[lane], reader_header(l->reader), reader_image(l->reader),
				 (uint64_t)l->utc_ns, l->message, l->message_bytes);
	return l->message;
}

int live_is_whole(const struct live *l)
{
	return l->is_whole;
}

uint64_t live_lag(const struct live *l)
{
	return reader_newest(l->reader) - reader_cursor(l->reader);
}

void live_follow_clock(struct live *l)
{
	int32_t tai_offset_s;

	if (l->utc != NULL && platform_tai_offset_s(&tai_offset_s) == 0) {
		utc_note_tai_offset(l->utc, tai_offset_s);
	}
}

int64_t live_utc_of_tai(const struct live *l, int64_t tai_ns)
{
	return l->utc == NULL ? tai_ns : utc_of_tai(l->utc, tai_ns);
}

const char *live_problem(const struct live *l)
{
	return reader_problem(l->reader);
}
