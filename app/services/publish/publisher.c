/* SPDX-License-Identifier: MIT */
#include "publish/publisher.h"

#include <errno.h>
#include <inttypes.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/clock.h"
#include "base/host_clock.h"
#include "base/platform.h"
#include "base/status.h"
#include "publish/commands.h"
#include "publish/domain.h"
#include "publish/feeds.h"
#include "publish/own_status.h"
#include "publish/sample_writer.h"
#include "publish/state.h"
#include "publish/topics.h"
#include "reader/page.h"

#define FOLLOW_NS (NS_PER_S / 10) /* between checks for new rings and boards */
#define PAGE_NS (5 * NS_PER_MS)
#define PENDING_POLL_NS (200 * NS_PER_US)
enum { SAMPLES_PER_STEP = 64, FOLLOWS_PER_STATUS = 10 };

struct publisher {
	const struct config *cfg;
	struct topics topics;
	struct commands *commands;
	struct feed *events;
	struct feed *sync0_events; /* published on ecdaq/event as well */
	struct feed *sync0;
	struct own_status own;
	char ring_path[CONFIG_PATH_BYTES];
	char status_path[CONFIG_PATH_BYTES];
	struct status_page page_copy;
	const struct status_page *page; /* page_copy; NULL: none */
	int64_t page_read_ns;
	struct reader *reader;
	int reader_error;              /* reported last */
	struct sample_writer *samples; /* NULL: no session */
	struct sample_counts counts;
	int64_t followed_ns;
	unsigned follows;
	const char *time_quality; /* reported last; NULL: none */
};

static int open_feed(const struct publisher *p, enum feed_kind kind, const char *name,
		     struct feed **ret_feed)
{
	char path[CONFIG_PATH_BYTES];
	int r = config_run_path(p->cfg, name, path, sizeof(path));

	if (r < 0) {
		return r;
	}
	/* Older records are in the recording; those of later writers are published from the first.
	 */
	*ret_feed = feed_create(kind, path, FEED_AT_NEWEST);
	return *ret_feed == NULL ? -ENOMEM : 0;
}

static int open_sources(struct publisher *p)
{
	int r = config_run_path(p->cfg, CONFIG_RUN_SAMPLES, p->ring_path, sizeof(p->ring_path));

	r = r < 0 ? r : reader_create(p->ring_path, READER_AT_NEWEST, &p->reader);
	r = r < 0 ? r : open_feed(p, FEED_EVENTS, CONFIG_RUN_EVENTS, &p->events);
	r = r < 0 ? r : open_feed(p, FEED_EVENTS, CONFIG_RUN_SYNC0_EVENTS, &p->sync0_events);
	r = r < 0 ? r : open_feed(p, FEED_SYNC0, CONFIG_RUN_SYNC0, &p->sync0);
	r = r < 0 ? r
		  : config_run_path(p->cfg, CONFIG_RUN_DDS_STATUS, p->own.path,
				    sizeof(p->own.path));
	return r < 0 ? r
		     : config_run_path(p->cfg, CONFIG_RUN_STATUS, p->status_path,
				       sizeof(p->status_path));
}

static void read_page(struct publisher *p)
{
	p->page = page_read_status(p->status_path, &p->page_copy) == 0 ? &p->page_copy : NULL;
	p->page_read_ns = host_clock_ns(CLOCK_MONOTONIC);
}

static int check_interface(struct publisher *p, char *error, size_t error_bytes)
{
	char ethercat[sizeof(p->page->interface) + 1] = "";

	if (p->page != NULL) {
		snprintf(ethercat, sizeof(ethercat), "%.*s", (int)sizeof(p->page->interface),
			 p->page->interface);
	}
	return domain_check_interface(p->cfg, ethercat, error, error_bytes);
}

static int open_topics(struct publisher *p, char *error, size_t error_bytes)
{
	dds_listener_t *listener = commands_listener(p->commands);
	int r = listener == NULL ? -ENOMEM
				 : topics_open(&p->topics, p->cfg, listener, error, error_bytes);

	dds_delete_listener(listener);
	if (r < 0) {
		return r;
	}
	state_put_idl(&p->topics);
	return 0;
}

int publisher_create(const struct config *cfg, struct publisher **ret_publisher, char *error,
		     size_t error_bytes)
{
	struct publisher *p = calloc(1, sizeof(*p));
	char identity[DOMAIN_IDENTITY_BYTES];
	int r;

	snprintf(error, error_bytes, "%s", strerror(ENOMEM));
	if (p == NULL) {
		return -ENOMEM;
	}
	p->cfg = cfg;
	p->followed_ns = INT64_MIN / 2;
	r = open_sources(p);
	if (r < 0) {
		snprintf(error, error_bytes, "runtime.run_dir: %s", strerror(-r));
	} else {
		read_page(p);
		r = check_interface(p, error, error_bytes);
	}
	r = r < 0 ? r : domain_check_security(cfg, identity, error, error_bytes);
	r = r < 0 ? r : commands_create(cfg, &p->commands);
	r = r < 0 ? r : open_topics(p, error, error_bytes);
	if (r < 0) {
		publisher_destroy(p);
		return r;
	}
	if (identity[0] != '\0') {
		fprintf(stderr, "ecdaq-dds: %s\n", identity);
	}
	*ret_publisher = p;
	return 0;
}

static void write_status_page(struct publisher *p)
{
	own_status_put(&p->own, p->cfg, &p->topics,
		       p->samples == NULL ? 0 : sample_writer_table(p->samples)->meta.session,
		       &p->counts, commands_counts(p->commands));
}

static void end_session(struct publisher *p)
{
	if (p->samples != NULL) {
		write_status_page(p);
		fprintf(stderr, "ecdaq-dds: session %" PRIu64 " ended\n",
			sample_writer_table(p->samples)->meta.session);
		sample_writer_destroy(p->samples);
		p->samples = NULL;
	}
}

void publisher_destroy(struct publisher *p)
{
	if (p == NULL) {
		return;
	}
	end_session(p);
	own_status_close(&p->own);
	topics_close(&p->topics); /* no listener is called from here on */
	commands_destroy(p->commands);
	feed_destroy(p->events);
	feed_destroy(p->sync0_events);
	feed_destroy(p->sync0);
	reader_destroy(p->reader);
	free(p);
}

static void begin_session(struct publisher *p)
{
	int r = sample_writer_create(p->reader, p->cfg, &p->topics, &p->counts, &p->samples);

	r = r < 0 ? r : state_put_channels(&p->topics, p->cfg, sample_writer_table(p->samples));
	if (r < 0) {
		fprintf(stderr, "ecdaq-dds: %s: %s\n", p->ring_path, strerror(-r));
		reader_skip_session(p->reader);
		return;
	}
	fprintf(stderr, "ecdaq-dds: publishing session %" PRIu64 " in domain %u on %s\n",
		sample_writer_table(p->samples)->meta.session, p->cfg->dds_domain,
		p->cfg->dds_interface);
}

/* Report once why no session can be read. */
static void report_error(struct publisher *p)
{
	int error = reader_error(p->reader);

	if (error != p->reader_error && error < 0 && error != -ENOENT && error != -EPIPE) {
		fprintf(stderr, "ecdaq-dds: %s: %s\n", p->ring_path, reader_problem(p->reader));
	}
	p->reader_error = error;
}

static void follow_ring(struct publisher *p)
{
	uint64_t lost;

	if (p->samples == NULL && reader_next(p->reader, &lost) == READER_BEGUN) {
		begin_session(p);
	}
	report_error(p);
}

static void publish_state(struct publisher *p)
{
	struct state_view view = {
		.page = p->page,
		.table = p->samples == NULL ? NULL : sample_writer_table(p->samples),
		.samples = p->counts,
		.commands = commands_counts(p->commands),
	};
	int32_t tai_offset_s;

	state_put_status(&p->topics, &view);
	write_status_page(p);
	if (p->samples != NULL && platform_tai_offset_s(&tai_offset_s) == 0) {
		sample_writer_note_tai_offset(p->samples, tai_offset_s);
	}
}

static int follow(struct publisher *p, int64_t now, char *error, size_t error_bytes)
{
	p->followed_ns = now;
	follow_ring(p);
	(void)feed_open(p->events, NULL);
	(void)feed_open(p->sync0_events, NULL);
	(void)feed_open(p->sync0, NULL);
	commands_follow(p->commands);
	if (p->follows++ % FOLLOWS_PER_STATUS == 0) {
		publish_state(p);
	}
	return p->page == NULL                                     ? 0
	       : check_interface(p, error, error_bytes) == -EINVAL ? -EINVAL
								   : 0;
}

static int is_op(const struct publisher *p, const struct channel_table *table)
{
	return p->page != NULL && table != NULL && p->page->session == table->meta.session &&
	       atomic_load_explicit(&p->page->bus_state, memory_order_relaxed) == BUS_OP;
}

/* Report the quality of UTC in the samples when it changes. */
static void report_time_quality(struct publisher *p, const struct timemap_state *map)
{
	const char *quality = utc_quality(map);

	if (p->time_quality != NULL && strcmp(p->time_quality, quality) == 0) {
		return;
	}
	p->time_quality = quality;
	fprintf(stderr, "ecdaq-dds: time: %s: %s\n", quality, utc_explain(map));
}

static int publish(struct publisher *p)
{
	enum sample_writer_result result = SAMPLE_WRITER_EMPTY;
	struct timemap_state map;

	if (p->samples == NULL) {
		return 0;
	}
	result = sample_writer_step(p->samples, SAMPLES_PER_STEP);
	if (sample_writer_utc_changed(p->samples, &map) != UTC_UNCHANGED) {
		state_put_timemap(&p->topics, sample_writer_table(p->samples)->meta.session, &map);
		report_time_quality(p, &map);
	}
	if (result == SAMPLE_WRITER_ENDED) {
		end_session(p);
	}
	return result == SAMPLE_WRITER_MORE;
}

static void wait_for_work(const struct publisher *p, int is_pending)
{
	/* Commands that are queued behind the pending one would end topics_wait() at once. */
	struct timespec pause = { .tv_nsec = PENDING_POLL_NS };

	if (is_pending) {
		ppoll(NULL, 0, &pause, NULL);
	} else {
		topics_wait(&p->topics, p->cfg->cycle_period_ns / 2);
	}
}

int publisher_step(struct publisher *publisher, char *error, size_t error_bytes)
{
	struct publisher *p = publisher;
	int64_t now = host_clock_ns(CLOCK_MONOTONIC);
	struct gate_view view = { .now_ns = now };
	int has_more;
	int is_pending;
	int r = now - p->followed_ns >= FOLLOW_NS ? follow(p, now, error, error_bytes) : 0;

	if (r < 0) {
		return r;
	}
	/* Commands are accepted in OP only. */
	if (now - p->page_read_ns >= PAGE_NS) {
		read_page(p);
	}
	has_more = publish(p);
	if (p->samples != NULL) {
		view.table = sample_writer_table(p->samples);
		view.cycle = sample_writer_cycle(p->samples);
		view.is_op = is_op(p, view.table);
	}
	is_pending = commands_step(p->commands, &p->topics, &view);
	feeds_put_events(p->events, &p->topics, p->samples);
	feeds_put_events(p->sync0_events, &p->topics, p->samples);
	feeds_put_sync0(p->sync0, &p->topics, p->samples);
	if (!has_more) {
		wait_for_work(p, is_pending);
	}
	return 0;
}
