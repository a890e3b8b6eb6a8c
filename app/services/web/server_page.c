/* SPDX-License-Identifier: MIT */
/* Our own page: state, values and events four times a second, pictures when it asks for them. */
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "reader/page.h"
#include "web/bus_view.h"
#include "web/folds.h"
#include "web/page.h"
#include "web/past.h"
#include "web/recordings.h"
#include "web/server_private.h"
#include "web/text.h"

enum {
	TEXTS_PER_TURN = 8,
	REQUESTS_PER_SECOND = 200, /* more end the connection */
	/* After a picture that took so long no other one is drawn for a multiple of that: the
	 * clients together take a third of a processor at most. */
	DRAW_PAUSE = 2,
	RECORDED_SPARE_MS = 900,
};
#define REFRESH_NS (250 * NS_PER_MS)

/* What all pages are sent, made once for each refresh. */
struct server_pages {
	struct history *history;
	struct event_log *events;
	struct past *past;
	int64_t past_ns; /* when it began */
	struct recordings *recordings;
	uint32_t recordings_wanted; /* by so many pages */
	uint32_t bus_wanted;
	struct bus_view bus;
	struct text_kept bus_text;
	uint32_t folds_wanted;
	struct text_kept folds;
	char status_path[CONFIG_PATH_BYTES];
	char record_path[CONFIG_PATH_BYTES];
	struct status_page status;
	struct record_status record;
	struct history_picture picture;
	uint64_t event_cycle[EVENT_LOG_EVENTS];
	double *value;
	int64_t refreshed_ns;
	uint64_t refresh; /* number of refreshes */
	int64_t draw_after_ns;
	char *state;
	char *table;
	uint64_t session; /* of table; 0: none */
	uint64_t table_number;
	int64_t recorded_ms; /* after which a sample is in a recording */
	char *values;        /* NULL: no session */
};

struct page_client {
	struct server_client link; /* first: the server's list */
	uint64_t refresh;          /* that it has */
	uint64_t table_number;     /* that it has */
	uint64_t next_event;
	int has_state;  /* of its refresh */
	int has_values; /* of its refresh */
	int wants_values;
	int wants_recordings;
	uint64_t recordings_number; /* of the list that it has */
	int wants_folds;
	uint64_t folds_number; /* of the lines that it has */
	int wants_bus;
	uint64_t bus_number; /* of the tree that it has */
	int wants_slave;     /* and which */
	int has_slave;       /* of its refresh */
	uint32_t slave;
	int has_draw; /* draw is to be answered */
	struct page_request draw;
	int64_t second_ns;
	uint32_t requests; /* in that second */
	size_t bytes;
	char request[PAGE_REQUEST_BYTES];
};

size_t server_page_bytes(void)
{
	return sizeof(struct page_client);
}

int server_pages_create(struct server *s)
{
	struct server_pages *p = calloc(1, sizeof(*p));
	char path[CONFIG_PATH_BYTES];
	int r = p == NULL ? -ENOMEM
			  : config_run_path(s->cfg, CONFIG_RUN_SAMPLES, path, sizeof(path));

	s->pages = p;
	r = r < 0 ? r : history_create(path, &p->history);
	r = r < 0 ? r : config_run_path(s->cfg, CONFIG_RUN_EVENTS, path, sizeof(path));
	r = r < 0 ? r : event_log_create(path, &p->events);
	r = r < 0 ? r : past_create(s->cfg->record_dir, &p->past);
	r = r < 0 ? r : recordings_create(s->cfg->record_dir, &p->recordings);
	r = r < 0 ? r
		  : config_run_path(s->cfg, CONFIG_RUN_STATUS, p->status_path,
				    sizeof(p->status_path));
	r = r < 0 ? r
		  : config_run_path(s->cfg, CONFIG_RUN_RECORD_STATUS, p->record_path,
				    sizeof(p->record_path));
	if (r < 0) {
		return r;
	}
	p->value = calloc(LIMIT_CHANNELS, sizeof(p->value[0]));
	p->recorded_ms =
		(s->cfg->record_chunk_period_ns + s->cfg->record_sync_period_ns) / NS_PER_MS +
		RECORDED_SPARE_MS;
	p->table = page_table(NULL, p->recorded_ms);
	return p->value == NULL || p->table == NULL ? -ENOMEM : 0;
}

void server_pages_destroy(struct server *s)
{
	struct server_pages *p = s->pages;

	if (p != NULL) {
		history_destroy(p->history);
		past_destroy(p->past);
		event_log_destroy(p->events);
		recordings_destroy(p->recordings);
		free(p->value);
		free(p->state);
		free(p->table);
		free(p->values);
		free(p->bus_text.text);
		free(p->folds.text);
		free(p);
	}
}

static void refresh_table(struct server_pages *p)
{
	const struct channel_table *table = history_table(p->history);
	uint64_t session = table == NULL ? 0 : table->meta.session;
	uint64_t cycle;

	free(p->values);
	p->values = NULL;
	if (session != p->session) {
		free(p->table);
		p->table = page_table(table, p->recorded_ms);
		p->session = session;
		p->table_number++;
	}
	if (table != NULL && history_newest(p->history, p->value, &cycle) == 0) {
		p->values = page_values(p->value, table->meta.channel_count, cycle);
	}
}

static void refresh_views(struct server *s, const struct page_status *status)
{
	struct server_pages *p = s->pages;

	p->bus = (struct bus_view){ .page = status->page,
				    .page_error = status->page_error,
				    .is_alive = status->is_alive,
				    .cfg = s->cfg };
	text_keep(&p->bus_text, p->bus_wanted > 0 ? bus_view_tree(&p->bus) : NULL);
	if (p->folds_wanted > 0) {
		text_keep(&p->folds,
			  folds_text(p->events, status->page_error == 0 ? status->page : NULL,
				     source_utc_minus_tai(s->source)));
	}
}

int server_pages_refresh(struct server *s)
{
	struct server_pages *p = s->pages;
	struct page_status status = { .page = &p->status, .record = &p->record };

	if (s->now_ns - p->refreshed_ns < REFRESH_NS) {
		return 0;
	}
	p->refreshed_ns = s->now_ns;
	p->refresh++;
	event_log_poll(p->events);
	refresh_table(p);
	if (p->recordings_wanted > 0) {
		recordings_poll(p->recordings, s->now_ns);
	}
	status.page_error = page_read_status(p->status_path, &p->status);
	status.is_alive = status.page_error == 0 && page_is_alive(p->status.pid);
	status.record_error = page_read_record(p->record_path, &p->record);
	status.is_recorder_alive = status.record_error == 0 && page_is_alive(p->record.pid);
	free(p->state);
	p->state = page_state(&status);
	refresh_views(s, &status);
	return 1;
}

/* Switch the subscription @flag of a page on or off, and keep the @count of pages that have it. */
static void subscribe(int *flag, int is_on, uint32_t *count)
{
	if (is_on && !*flag) {
		(*count)++;
	} else if (!is_on && *flag) {
		(*count)--;
	}
	*flag = is_on;
}

static void take_request(struct server_pages *p, struct page_client *c)
{
	struct page_request request;

	if (page_parse(c->request, c->bytes, &request) < 0) {
		return; /* our own page makes none of these */
	}
	switch (request.op) {
	case PAGE_VALUES:
		c->wants_values = request.is_on;
		break;
	case PAGE_RECORDINGS:
		subscribe(&c->wants_recordings, request.is_on, &p->recordings_wanted);
		break;
	case PAGE_BUS:
		subscribe(&c->wants_bus, request.is_on, &p->bus_wanted);
		c->wants_slave = request.is_on && request.has_slave;
		c->slave = request.slave;
		c->has_slave = 0;
		break;
	case PAGE_FOLDS:
		subscribe(&c->wants_folds, request.is_on, &p->folds_wanted);
		break;
	case PAGE_DRAW:
		past_stop(p->past, c); /* one that was not answered yet is not needed any more */
		c->draw = request;
		c->has_draw = 1;
		break;
	}
	lws_callback_on_writable(c->link.wsi);
}

/* -1: end the connection. */
static int receive(struct lws *wsi, struct page_client *c, const void *in, size_t len)
{
	struct server *s = server_of(wsi);

	if (s->now_ns - c->second_ns >= NS_PER_S) {
		c->second_ns = s->now_ns;
		c->requests = 0;
	}
	if (++c->requests > REQUESTS_PER_SECOND || len > sizeof(c->request) - c->bytes) {
		lws_close_reason(wsi, LWS_CLOSE_STATUS_POLICY_VIOLATION, NULL, 0);
		return -1;
	}
	if (len > 0) {
		memcpy(c->request + c->bytes, in, len);
		c->bytes += len;
	}
	if (lws_is_final_fragment(wsi) && lws_remaining_packet_payload(wsi) == 0) {
		take_request(s->pages, c);
		c->bytes = 0;
	}
	return 0;
}

/* 1: sent; 0: there is none; -1: end the connection. */
static int send_made(struct lws *wsi, char *text)
{
	int r = text == NULL ? 0 : server_send_text(wsi, text);

	free(text);
	return r;
}

/* For a while nothing is drawn after something that took since @start_ns. */
static void pause_drawing(struct server *s, int64_t start_ns)
{
	int64_t now_ns = s->platform.now(s->platform.ctx).ns;

	s->pages->draw_after_ns = now_ns + DRAW_PAUSE * (now_ns - start_ns);
}

/* What the client asked for from the ring, and whether it begins before that. 0 or -errno of
 * history_draw(). */
static int draw_ring(struct server *s, struct page_client *c, int *ret_is_older)
{
	struct server_pages *p = s->pages;
	struct history_request request;
	uint64_t oldest;
	uint64_t newest;
	int64_t start_ns = s->platform.now(s->platform.ctx).ns;
	int r = history_range(p->history, &oldest, &newest);

	if (r < 0) {
		return r;
	}
	page_add_events(&c->draw, p->events, p->event_cycle);
	request = c->draw.draw;
	request.end = past_end(&request, newest, newest - oldest + 1);
	r = history_draw(p->history, &request, &p->picture);
	*ret_is_older = r == 0 && request.count > 0 && p->picture.first < oldest;
	pause_drawing(s, start_ns);
	return r;
}

/* 1: @picture is complete; 0: later. */
static int draw_past(struct server *s, struct page_client *c)
{
	struct server_pages *p = s->pages;
	int is_running = past_is_for(p->past, c);
	const struct channel_table *table = history_table(p->history);
	uint64_t oldest;
	uint64_t newest;

	if (table == NULL || history_range(p->history, &oldest, &newest) < 0) {
		past_stop(p->past, c);
		return 1;
	}
	if (!is_running) {
		p->past_ns = s->platform.now(s->platform.ctx).ns;
	}
	if (past_complete(p->past, c, &c->draw.draw, table, oldest, &p->picture) < 0) {
		return 0;
	}
	if (is_running) {
		pause_drawing(s, p->past_ns);
	}
	return 1;
}

static int send_picture(struct server *s, struct page_client *c)
{
	struct server_pages *p = s->pages;
	const struct history_picture *picture = &p->picture;
	int is_older = past_is_for(p->past, c);
	size_t bytes;
	int r = 0;

	if (!is_older) {
		if (s->platform.now(s->platform.ctx).ns < p->draw_after_ns) {
			c->link.is_waiting = 1;
			return 0;
		}
		r = draw_ring(s, c, &is_older);
	}
	if (r == 0 && is_older) {
		if (!draw_past(s, c)) {
			c->link.is_waiting = 1;
			return 0;
		}
		picture = past_picture(p->past);
	}
	c->has_draw = 0;
	if (r < 0) {
		return send_made(c->link.wsi, page_no_picture(c->draw.id, r));
	}
	bytes = page_picture(&c->draw.draw, picture, c->draw.id, s->scratch + LWS_PRE,
			     SOURCE_LARGEST_BYTES);
	if (bytes == 0) {
		return -1;
	}
	return lws_write(c->link.wsi, s->scratch + LWS_PRE, bytes, LWS_WRITE_BINARY) < (int)bytes
		       ? -1
		       : 1;
}

static int send_events(struct server *s, struct page_client *c)
{
	struct server_pages *p = s->pages;
	uint64_t first = c->next_event;

	c->next_event = event_log_count(p->events);
	return first == c->next_event
		       ? 0
		       : send_made(c->link.wsi,
				   page_events(p->events, first, source_utc_minus_tai(s->source)));
}

/* 1: something was sent; 0: all was; -1: end the connection. */
static int send_next(struct server *s, struct page_client *c)
{
	struct server_pages *p = s->pages;

	if (c->refresh != p->refresh) {
		c->refresh = p->refresh;
		c->has_state = 0;
		c->has_values = 0;
		c->has_slave = 0;
	}
	if (c->table_number != p->table_number && p->table != NULL) {
		c->table_number = p->table_number;
		return server_send_text(c->link.wsi, p->table);
	}
	if (!c->has_state && p->state != NULL) {
		c->has_state = 1;
		return server_send_text(c->link.wsi, p->state);
	}
	if (!c->has_values && c->wants_values && p->values != NULL) {
		c->has_values = 1;
		return server_send_text(c->link.wsi, p->values);
	}
	if (c->wants_bus && c->bus_number != p->bus_text.number) {
		c->bus_number = p->bus_text.number;
		return server_send_text(c->link.wsi, p->bus_text.text);
	}
	if (c->wants_folds && c->folds_number != p->folds.number) {
		c->folds_number = p->folds.number;
		return server_send_text(c->link.wsi, p->folds.text);
	}
	if (c->wants_slave && !c->has_slave && p->refresh > 0) {
		c->has_slave = 1;
		return send_made(c->link.wsi, bus_view_slave(&p->bus, c->slave));
	}
	if (c->wants_recordings && c->recordings_number != recordings_number(p->recordings)) {
		c->recordings_number = recordings_number(p->recordings);
		return server_send_text(c->link.wsi, recordings_text(p->recordings));
	}
	if (c->next_event != event_log_count(p->events)) {
		return send_events(s, c);
	}
	return c->has_draw ? send_picture(s, c) : 0;
}

static int send_turn(struct lws *wsi, struct page_client *c)
{
	struct server *s = server_of(wsi);

	c->link.is_waiting = 0;
	for (int n = 0; n < TEXTS_PER_TURN && !lws_send_pipe_choked(wsi); n++) {
		int r = send_next(s, c);

		if (r <= 0) {
			return r;
		}
	}
	lws_callback_on_writable(wsi);
	return 0;
}

static void opened(struct lws *wsi, struct page_client *c)
{
	struct server *s = server_of(wsi);

	memset(c, 0, sizeof(*c));
	c->table_number = UINT64_MAX; /* none */
	server_client_opened(s, &c->link, wsi);
	lws_callback_on_writable(wsi);
}

static void closed(struct server_pages *p, struct page_client *c)
{
	subscribe(&c->wants_recordings, 0, &p->recordings_wanted);
	subscribe(&c->wants_bus, 0, &p->bus_wanted);
	subscribe(&c->wants_folds, 0, &p->folds_wanted);
	past_stop(p->past, c);
}

int server_page(struct lws *wsi, enum lws_callback_reasons reason, void *user, void *in, size_t len)
{
	int r = 0;

	/* A long table of reasons; those that are not here are not ours. */
	if (reason == LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION) {
		r = server_filter(wsi);
	} else if (reason == LWS_CALLBACK_ESTABLISHED) {
		opened(wsi, user);
	} else if (reason == LWS_CALLBACK_RECEIVE) {
		r = receive(wsi, user, in, len);
	} else if (reason == LWS_CALLBACK_SERVER_WRITEABLE) {
		r = send_turn(wsi, user);
	} else if (reason == LWS_CALLBACK_CLOSED) {
		closed(server_of(wsi)->pages, user);
		server_client_closed(server_of(wsi), user);
	}
	return r;
}
