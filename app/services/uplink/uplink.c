/* SPDX-License-Identifier: MIT */
#include "uplink/uplink.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>

#include "base/clock.h"
#include "base/host_clock.h"
#include "program/appliance.h"
#include "program/trouble.h"
#include "uplink/bucket.h"
#include "uplink/job.h"
#include "uplink/own_status.h"
#include "uplink/queue.h"

enum { DIR_MODE = 0750, LINE_BYTES = 512 };

#define FOLLOW_NS (200 * NS_PER_MS)
#define LOOK_NS NS_PER_S
#define STATUS_NS (500 * NS_PER_MS)
#define RETRY_FIRST_NS NS_PER_S
#define RETRY_LAST_NS (60 * NS_PER_S)
#define BAD_NS (60 * NS_PER_S) /* until a recording that cannot be read is tried again */

struct uplink {
	const struct config *cfg;
	void (*report)(const char *line);
	char appliance[APPLIANCE_BYTES];
	struct own_status own;
	struct trouble trouble;
	struct bucket *bucket;
	struct job_context context;
	struct queue queue;
	struct job *job; /* NULL: none is in hand */
	int64_t looked_ns;
	int64_t status_ns;
	uint64_t file_done; /* bytes of parts that are in the store */
	char bad[BUCKET_PROBLEM_BYTES];
	char look_problem[BUCKET_PROBLEM_BYTES];
};

static int64_t now_ns(void)
{
	return host_clock_ns(CLOCK_MONOTONIC);
}

static void add(_Atomic uint64_t *field, uint64_t value)
{
	atomic_fetch_add_explicit(field, value, memory_order_relaxed);
}

static void set(_Atomic uint64_t *field, uint64_t value)
{
	atomic_store_explicit(field, value, memory_order_relaxed);
}

static void set_state(struct uplink *u, enum uplink_state state)
{
	atomic_store_explicit(&u->own.now.state, state, memory_order_relaxed);
}

static void say(struct uplink *u, const char *problem)
{
	snprintf(u->own.now.message, sizeof(u->own.now.message), "%s", problem);
}

static void put_status(struct uplink *u)
{
	if (now_ns() - u->status_ns >= STATUS_NS) {
		u->status_ns = now_ns();
		own_status_put(&u->own);
	}
}

/* The store has taken something. */
static void mind_recovery(struct uplink *u)
{
	char line[LINE_BYTES];

	if (trouble_is_over(&u->trouble)) {
		snprintf(line, sizeof(line), "%s: bucket %s: uploading", u->cfg->uplink_endpoint,
			 u->cfg->uplink_bucket);
		u->report(line);
		say(u, "");
	}
}

static void watch_bytes(void *ctx, uint64_t bytes)
{
	struct uplink *u = ctx;

	set(&u->own.now.file_sent, u->file_done + bytes);
	put_status(u);
}

static void watch_parts(void *ctx, uint64_t bytes)
{
	struct uplink *u = ctx;

	u->file_done = bytes;
	mind_recovery(u);
	watch_bytes(u, 0);
}

int uplink_create(const struct config *cfg, void (*report)(const char *line),
		  struct uplink **ret_uplink, char *error, size_t error_bytes)
{
	struct uplink *u = calloc(1, sizeof(*u));
	char problem[BUCKET_PROBLEM_BYTES] = "";
	int r;

	if (u == NULL) {
		snprintf(error, error_bytes, "%s", strerror(ENOMEM));
		return -ENOMEM;
	}
	u->cfg = cfg;
	u->report = report;
	trouble_init(&u->trouble, report, RETRY_FIRST_NS, RETRY_LAST_NS);
	r = appliance_name(cfg->uplink_appliance, u->appliance);
	if (r < 0) {
		snprintf(problem, sizeof(problem),
			 "uplink.appliance: the host's name cannot be used: set it");
	}
	if (r == 0) {
		r = own_status_init(&u->own, cfg, u->appliance);
		snprintf(problem, sizeof(problem), "run directory: %s", strerror(-r));
	}
	r = r < 0 ? r
		  : bucket_create(cfg, (struct bucket_watch){ watch_bytes, u }, &u->bucket,
				  problem);
	if (r < 0) {
		snprintf(error, error_bytes, "%s", problem);
		uplink_destroy(u);
		return r;
	}
	u->context = (struct job_context){ .cfg = cfg,
					   .appliance = u->appliance,
					   .bucket = u->bucket,
					   .report = report,
					   .progress = watch_parts,
					   .ctx = u };
	u->looked_ns = now_ns() - LOOK_NS;
	*ret_uplink = u;
	return 0;
}

void uplink_destroy(struct uplink *u)
{
	if (u == NULL) {
		return;
	}
	job_destroy(u->job);
	bucket_destroy(u->bucket);
	queue_done(&u->queue);
	if (u->own.path[0] != '\0') {
		own_status_put(&u->own);
	}
	own_status_close(&u->own);
	free(u);
}

/* --- the queue --- */

static void lost(void *ctx, const struct queue_item *item)
{
	struct uplink *u = ctx;
	char line[LINE_BYTES];

	if (!item->is_uploaded) {
		snprintf(line, sizeof(line), "%s: deleted before it was uploaded",
			 item->entry.name);
		u->report(line);
		add(&u->own.now.deleted, 1);
	}
}

static void count_waiting(struct uplink *u)
{
	uint64_t bytes = 0;
	uint64_t count = 0;
	int64_t oldest_s = 0;

	for (size_t i = 0; i < u->queue.count; i++) {
		const struct queue_item *item = &u->queue.item[i];

		if (!item->is_uploaded) {
			int64_t begun_s = store_name_utc_s(item->entry.name);

			count++;
			bytes += item->entry.bytes;
			oldest_s = oldest_s == 0 || begun_s < oldest_s ? begun_s : oldest_s;
		}
	}
	set(&u->own.now.waiting_utc_s, oldest_s > 0 ? (uint64_t)oldest_s : 0);
	set(&u->own.now.waiting, count);
	set(&u->own.now.waiting_bytes, bytes);
}

static void look(struct uplink *u)
{
	const char *dir = u->cfg->uplink_dir;
	char problem[BUCKET_PROBLEM_BYTES] = "";
	int r;

	if (now_ns() - u->looked_ns < LOOK_NS) {
		return;
	}
	u->looked_ns = now_ns();
	if (mkdir(dir, DIR_MODE) < 0 && errno != EEXIST) {
		snprintf(problem, sizeof(problem), "uplink.dir: %.150s: %s", dir, strerror(errno));
	}
	r = queue_update(&u->queue, u->cfg->record_dir, dir, lost, u);
	if (r < 0 && r != -ENOENT) { /* not there yet: nothing was recorded */
		snprintf(problem, sizeof(problem), "record.dir: %.150s: %s", u->cfg->record_dir,
			 strerror(-r));
	}
	if (strcmp(problem, u->look_problem) != 0) {
		snprintf(u->look_problem, sizeof(u->look_problem), "%s", problem);
		say(u, problem);
		if (problem[0] != '\0') {
			u->report(problem);
		}
	}
	count_waiting(u);
}

/* --- one recording --- */

static void drop_job(struct uplink *u)
{
	job_destroy(u->job);
	u->job = NULL;
	u->own.now.file[0] = '\0';
	set(&u->own.now.file_bytes, 0);
	set(&u->own.now.file_sent, 0);
}

static int take_job(struct uplink *u)
{
	const struct queue_item *item;

	if (u->job != NULL) {
		return 1;
	}
	item = queue_next(&u->queue, now_ns());
	u->job = item == NULL ? NULL : job_create(&u->context, &item->entry);
	if (u->job == NULL) {
		return 0;
	}
	snprintf(u->own.now.file, sizeof(u->own.now.file), "%s", item->entry.name);
	set(&u->own.now.file_bytes, item->entry.bytes);
	return 1;
}

static void fail(struct uplink *u, const char *problem)
{
	add(&u->own.now.failures, 1);
	say(u, problem);
	trouble_found(&u->trouble, problem);
	set_state(u, UPLINK_RETRYING);
}

static void set_aside(struct uplink *u, const char *problem)
{
	struct queue_item *item = queue_find(&u->queue, job_name(u->job));

	say(u, problem);
	if (item != NULL) {
		item->not_before_ns = now_ns() + BAD_NS;
		if (!item->is_reported && strcmp(problem, u->bad) != 0) {
			u->report(problem);
		}
		item->is_reported = 1;
	}
	snprintf(u->bad, sizeof(u->bad), "%s", problem);
	drop_job(u);
}

static void finish_job(struct uplink *u)
{
	struct queue_item *item = queue_find(&u->queue, job_name(u->job));

	mind_recovery(u);
	add(&u->own.now.uploaded, 1);
	set(&u->own.now.uploaded_utc_s, (uint64_t)time(NULL));
	if (item != NULL) {
		item->is_uploaded = 1;
		add(&u->own.now.uploaded_bytes, item->entry.bytes);
	}
	drop_job(u);
	count_waiting(u);
}

static void run_job(struct uplink *u)
{
	char problem[BUCKET_PROBLEM_BYTES];

	u->file_done = 0;
	set_state(u, UPLINK_SENDING);
	switch (job_run(u->job, problem)) {
	case JOB_DONE:
		finish_job(u);
		break;
	case JOB_FAILED:
		fail(u, problem);
		break;
	case JOB_BAD:
		set_aside(u, problem);
		break;
	case JOB_GONE:
		drop_job(u);
		u->looked_ns = now_ns() - LOOK_NS;
		break;
	case JOB_STOPPED:
		break;
	}
}

/* Marks of recordings that are gone. Returns 1 if there was something to do. */
static int give_up_leftover(struct uplink *u)
{
	char problem[BUCKET_PROBLEM_BYTES] = "";
	char name[STORE_NAME_BYTES];

	if (!queue_find_leftover(&u->queue, u->cfg->uplink_dir, name)) {
		return 0;
	}
	switch (job_give_up(&u->context, name, problem)) {
	case JOB_FAILED:
	case JOB_BAD:
		fail(u, problem);
		break;
	case JOB_DONE:
	case JOB_GONE:
	case JOB_STOPPED:
		break;
	}
	return 1;
}

int uplink_is_idle(const struct uplink *u)
{
	return u->job == NULL &&
	       atomic_load_explicit(&u->own.now.waiting, memory_order_relaxed) == 0;
}

int64_t uplink_step(struct uplink *u)
{
	int64_t wait_ns = 0;

	look(u);
	if (!trouble_is_due(&u->trouble)) {
		wait_ns = FOLLOW_NS;
	} else if (u->job == NULL && u->queue.item != NULL && give_up_leftover(u)) {
		wait_ns = 0;
	} else if (take_job(u)) {
		run_job(u);
	} else {
		set_state(u, UPLINK_IDLE);
		wait_ns = FOLLOW_NS;
	}
	put_status(u);
	return wait_ns;
}
