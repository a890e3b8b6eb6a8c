/* SPDX-License-Identifier: MIT */
#include "stream/history.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "record/file_io.h"
#include "record/mcap_reader.h"
#include "record/messages.h"
#include "record/store.h"
#include "record/track.h"

enum { NO_LANE = -1, IDS = MCAP_CHANNEL_IDS, NUMBER_BYTES = 24 };

enum progress {
	HEAD_READ, /* its first message is in item, for the next call */
	IN_HEAD,
	IN_MESSAGES
};

/* A schema of the file being read; its channels follow. */
struct schema {
	char name[LAYOUT_NAME_BYTES];
	char *text;
};

struct history {
	const char *dir;
	struct store_entry *entry;
	size_t count;
	size_t next; /* file to be opened next */
	int fd;
	struct mcap_source source;
	struct mcap_reader *reader; /* NULL: no file is open */
	struct topics topics;
	struct schema *schema; /* by their ids */
	size_t schemas;
	int16_t lane[IDS]; /* of each channel; NO_LANE */
	int cycle_channel;
	int event_channel;
	enum progress progress; /* of the open file */
	int is_event;           /* item is one */
	uint64_t cycle;
	struct history_item item;
};

static void close_file(struct history *h)
{
	mcap_reader_destroy(h->reader);
	h->reader = NULL;
	if (h->fd >= 0) {
		close(h->fd);
		h->fd = -1;
	}
	for (size_t i = 0; i < h->schemas; i++) {
		free(h->schema[i].text);
	}
	free(h->schema);
	h->schema = NULL;
	h->schemas = 0;
	topics_done(&h->topics);
}

static int open_file(struct history *h, size_t index)
{
	char path[PATH_MAX];
	int r = store_path(h->dir, h->entry[index].name, path, sizeof(path));

	close_file(h);
	memset(h->lane, 0xff, sizeof(h->lane)); /* NO_LANE */
	h->cycle_channel = -1;
	h->event_channel = -1;
	h->progress = IN_HEAD;
	if (r < 0) {
		return r;
	}
	h->fd = open(path, O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
	r = h->fd < 0 ? -errno : file_source(&h->fd, &h->source);
	r = r < 0 ? r : mcap_reader_create(&h->source, &h->reader);
	if (r < 0) {
		close_file(h);
	}
	return r;
}

/* What the head of the file says was recorded before it. 0, or -errno. */
static int read_head(struct history *h, size_t index, struct store_state *ret_before)
{
	struct track track;
	struct mcap_item item;
	int r = open_file(h, index);

	if (r < 0) {
		return r;
	}
	track_init(&track);
	while (!track.has_session && mcap_reader_next(h->reader, &item) > 0 &&
	       item.kind != MCAP_ITEM_MESSAGE) {
		track_item(&track, &item);
	}
	close_file(h);
	if (!track.has_session) {
		return -ENODATA;
	}
	*ret_before = track.before;
	return 0;
}

/*
 * The first file of which something may be needed: of the session, that which has the cycle. Where
 * the session has no file, the first behind those of earlier sessions.
 */
static size_t find_start(struct history *h, uint64_t session, uint64_t cycle)
{
	struct store_state before;
	size_t later = h->count;
	size_t start = h->count;

	for (size_t i = h->count; i > 0; i--) {
		if (read_head(h, i - 1, &before) < 0) {
			later = later == i ? i - 1 : later;
			continue;
		}
		if (before.session == session) {
			start = i - 1;
			if (before.next_cycle <= cycle) {
				return start;
			}
		} else if (start < h->count) {
			return start;
		} else if (before.session > session && later == i) {
			later = i - 1;
		}
	}
	return start < h->count ? start : later;
}

int history_create(const char *dir, uint64_t session, uint64_t cycle, struct history **ret_history)
{
	struct history *h = calloc(1, sizeof(*h));
	int r;

	if (h == NULL) {
		return -ENOMEM;
	}
	h->dir = dir;
	h->fd = -1;
	r = store_list(dir, &h->entry, &h->count);
	if (r < 0) {
		history_destroy(h);
		return r;
	}
	h->next = find_start(h, session, cycle);
	*ret_history = h;
	return 0;
}

void history_destroy(struct history *h)
{
	if (h != NULL) {
		close_file(h);
		free(h->entry);
		free(h);
	}
}

/* Not strndup(): the text in a record has no zero behind it, which strict sanitizers report. */
static char *copy_text(const void *data, size_t len)
{
	char *copy = malloc(len + 1);

	if (copy != NULL) {
		memcpy(copy, data, len);
		copy[len] = '\0';
	}
	return copy;
}

static void take_schema(struct history *h, const struct mcap_item *item)
{
	size_t wanted = (size_t)item->id + 1;

	if (wanted > h->schemas) {
		struct schema *more = realloc(h->schema, wanted * sizeof(*more));

		if (more == NULL) {
			return;
		}
		memset(more + h->schemas, 0, (wanted - h->schemas) * sizeof(*more));
		h->schema = more;
		h->schemas = wanted;
	}
	if (h->schema[item->id].text == NULL && item->name.len < sizeof(h->schema->name)) {
		memcpy(h->schema[item->id].name, item->name.at, item->name.len);
		h->schema[item->id].text = copy_text(item->data, item->data_len);
	}
}

static void take_channel(struct history *h, const struct mcap_item *item)
{
	char name[LAYOUT_NAME_BYTES];
	const char *token;
	const struct schema *schema =
		item->schema_id < h->schemas ? &h->schema[item->schema_id] : NULL;

	if (item->name.len >= sizeof(name)) {
		return;
	}
	memcpy(name, item->name.at, item->name.len);
	name[item->name.len] = '\0';
	token = topics_token(name);
	if (mcap_text_is(item->name, messages_topic(MESSAGE_CYCLE))) {
		h->cycle_channel = item->id;
	} else if (mcap_text_is(item->name, messages_topic(MESSAGE_EVENT))) {
		h->event_channel = item->id;
	} else if (token != NULL && schema != NULL && schema->text != NULL &&
		   h->lane[item->id] == NO_LANE) {
		h->lane[item->id] =
			(int16_t)topics_add(&h->topics, token, schema->name, schema->text);
	}
}

static void take_metadata(struct history *h, const struct mcap_item *item)
{
	char text[NUMBER_BYTES];
	size_t offset = 0;
	struct mcap_text key;
	struct mcap_text value;

	if (mcap_text_is(item->name, "ecdaq.session") &&
	    mcap_pairs_get(item, "session", text, sizeof(text)) == 0) {
		h->topics.session = strtoull(text, NULL, 10);
	} else if (mcap_text_is(item->name, "ecdaq.channels") && h->topics.layout_json == NULL &&
		   mcap_pairs_next(item->data, item->data_len, &offset, &key, &value) > 0 &&
		   mcap_text_is(key, "json")) {
		h->topics.layout_json = copy_text(value.at, value.len);
	}
}

/* 1 if there is something for the caller in h->item. */
static int take_message(struct history *h, const struct mcap_item *item)
{
	if (item->id == h->cycle_channel) {
		(void)messages_decode_cycle(item->data, item->data_len, &h->cycle);
		return 0;
	}
	if (item->id != h->event_channel && h->lane[item->id] < 0) {
		return 0;
	}
	h->is_event = item->id == h->event_channel;
	h->item = (struct history_item){ .lane = (size_t)h->lane[item->id],
					 .cycle = h->cycle,
					 .data = item->data,
					 .len = item->data_len,
					 .time_ns = item->log_time_ns };
	return 1;
}

/* The next message of the open file; 0: it has no more. */
static int read_file(struct history *h)
{
	struct mcap_item item;

	while (mcap_reader_next(h->reader, &item) > 0) {
		if (item.kind == MCAP_ITEM_SCHEMA) {
			take_schema(h, &item);
		} else if (item.kind == MCAP_ITEM_CHANNEL) {
			take_channel(h, &item);
		} else if (item.kind == MCAP_ITEM_METADATA) {
			take_metadata(h, &item);
		} else if (item.kind == MCAP_ITEM_MESSAGE && take_message(h, &item)) {
			return 1;
		}
	}
	return 0;
}

/* To the next message, in whatever file it is. 0: there is none. */
static int advance(struct history *h)
{
	while (h->reader == NULL || !read_file(h)) {
		close_file(h);
		if (h->next >= h->count) {
			return 0;
		}
		(void)open_file(h, h->next++);
	}
	return 1;
}

enum history_result history_next(struct history *h)
{
	if (h->progress != HEAD_READ) {
		if (!advance(h)) {
			return HISTORY_END;
		}
		if (h->progress == IN_HEAD) {
			h->progress = HEAD_READ;
			return HISTORY_BEGUN;
		}
	}
	h->progress = IN_MESSAGES;
	return h->is_event ? HISTORY_EVENT : HISTORY_MESSAGE;
}

const struct topics *history_topics(const struct history *h)
{
	return &h->topics;
}

const struct history_item *history_item(const struct history *h)
{
	return &h->item;
}
