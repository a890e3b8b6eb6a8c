/* SPDX-License-Identifier: MIT */
#include "uplink/job.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/stop.h"
#include "record/upload_mark.h"
#include "uplink/manifest.h"
#include "uplink/object.h"
#include "uplink/plan.h"

#define MANIFEST_SUFFIX ".json"

enum { HASH_CHARS = 8, LINE_BYTES = 512 };

struct job {
	const struct job_context *context;
	char name[STORE_NAME_BYTES];
	int fd; /* open while job_run() works; the recorder may delete the file between */
	struct plan *plan;
	char (*answered)[ANSWER_ETAG_BYTES];
	struct contents contents;
	struct upload_mark mark;
	int has_key;  /* in the mark */
	int is_sent;  /* the store has taken all of it */
	int is_there; /* the object is, and was checked */
	char *problem;
};

struct job *job_create(const struct job_context *context, const struct store_entry *entry)
{
	struct job *j = calloc(1, sizeof(*j));

	if (j != NULL) {
		j->context = context;
		j->fd = -1;
		snprintf(j->name, sizeof(j->name), "%s", entry->name);
	}
	return j;
}

void job_destroy(struct job *j)
{
	if (j != NULL) {
		plan_destroy(j->plan);
		free(j->answered);
		free(j);
	}
}

const char *job_name(const struct job *j)
{
	return j->name;
}

static enum job_result result_of(int error)
{
	return error == 0 ? JOB_DONE : error == -EINTR ? JOB_STOPPED : JOB_FAILED;
}

/* Something on this machine. */
static enum job_result bad(char *problem, const char *name, int error)
{
	if (error == -EINTR) {
		return JOB_STOPPED;
	}
	snprintf(problem, BUCKET_PROBLEM_BYTES, "%.150s: %s", name,
		 error == -EPROTO || error == -ENODATA ? "not a recording" : strerror(-error));
	return JOB_BAD;
}

static struct object object_of(struct job *j)
{
	return (struct object){ .bucket = j->context->bucket,
				.key = j->mark.key,
				.plan = j->plan,
				.fd = j->fd,
				.answered = j->answered,
				.problem = j->problem };
}

static enum job_result open_file(struct job *j)
{
	char path[PATH_MAX];
	int r = store_path(j->context->cfg->record_dir, j->name, path, sizeof(path));

	if (r < 0) {
		return bad(j->problem, j->name, r);
	}
	j->fd = open(path, O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
	if (j->fd < 0) {
		return errno == ENOENT ? JOB_GONE : bad(j->problem, j->name, -errno);
	}
	return JOB_DONE;
}

/* What it is: read once, as long as the file is the same. */
static enum job_result read_file(struct job *j)
{
	int r = 0;

	if (j->plan != NULL && plan_is_of(j->plan, j->fd)) {
		return JOB_DONE;
	}
	plan_destroy(j->plan);
	free(j->answered);
	j->plan = NULL;
	j->answered = NULL;
	j->is_there = 0;
	j->is_sent = 0;
	j->has_key = 0;
	r = contents_read(j->fd, stop_flag(), &j->contents);
	r = r < 0 ? r
		  : plan_create(j->fd, j->context->cfg->uplink_part_bytes, stop_flag(), &j->plan);
	if (r < 0) {
		return bad(j->problem, j->name, r);
	}
	j->answered = calloc(j->plan->count, sizeof(*j->answered));
	return j->answered == NULL ? bad(j->problem, j->name, -ENOMEM) : JOB_DONE;
}

/* PREFIX/APPLIANCE/NAME; with a part of the hash where another recording has that. */
static int make_key(struct job *j, const char *hash)
{
	const char *prefix = j->context->cfg->uplink_prefix;
	const char *suffix = strrchr(j->name, '.');
	int stem = (int)(suffix - j->name);
	int n = snprintf(j->mark.key, sizeof(j->mark.key), "%s%s%s/%.*s%s%.*s%s", prefix,
			 prefix[0] != '\0' ? "/" : "", j->context->appliance, stem, j->name,
			 hash[0] != '\0' ? "-" : "", HASH_CHARS, hash, suffix);

	return n < 0 || (size_t)n + strlen(MANIFEST_SUFFIX) >= sizeof(j->mark.key) ? -ENAMETOOLONG
										   : 0;
}

static enum job_result save_mark(struct job *j, enum upload_mark_kind kind)
{
	const char *dir = j->context->cfg->uplink_dir;
	int r = upload_mark_save(dir, j->name, kind, &j->mark);

	return r < 0 ? bad(j->problem, dir, r) : JOB_DONE;
}

/* The mark that is there, if it is of this very file. */
static int resume(struct job *j)
{
	struct upload_mark mark;

	if (upload_mark_load(j->context->cfg->uplink_dir, j->name, UPLOAD_MARK_BEGUN, &mark) < 0 ||
	    strcmp(mark.sha256, j->plan->sha256) != 0) {
		return 0;
	}
	j->mark = mark;
	return 1;
}

/* 1: the key is ours to write, or the object is there already; 0: another object has it. */
static int try_key(struct job *j, const char *hash)
{
	struct object o;
	int r = make_key(j, hash);

	if (r < 0) {
		snprintf(j->problem, BUCKET_PROBLEM_BYTES, "uplink.prefix: too long");
		return -EIO;
	}
	o = object_of(j);
	r = object_check(&o);
	/* Not to be looked at: whether it may be written is seen when it is. */
	if (r == -ENOENT || r == -EPERM) {
		return 1;
	}
	j->is_there = r == 1;
	return r;
}

static enum job_result choose_key(struct job *j)
{
	char line[LINE_BYTES];
	struct object o;
	int r;

	if (j->has_key) {
		return JOB_DONE;
	}
	j->mark = (struct upload_mark){ .bytes = j->plan->bytes, .mtime_ns = j->plan->mtime_ns };
	snprintf(j->mark.sha256, sizeof(j->mark.sha256), "%s", j->plan->sha256);
	if (resume(j)) {
		o = object_of(j);
		r = object_check(&o); /* sent already, but for the manifest? */
		j->is_there = r == 1;
		j->has_key = r >= 0 || r == -ENOENT || r == -EPERM;
		return j->has_key ? JOB_DONE : result_of(r);
	}
	r = try_key(j, "");
	if (r == 0) {
		r = try_key(j, j->plan->sha256);
		if (r > 0 && !j->is_there) {
			snprintf(line, sizeof(line),
				 "%s: the store has another recording of this name: uploaded as "
				 "%.300s",
				 j->name, j->mark.key);
			j->context->report(line);
		}
	}
	if (r <= 0) {
		if (r == 0) {
			snprintf(j->problem, BUCKET_PROBLEM_BYTES,
				 "%s: the store has other objects of both names for it", j->name);
		}
		return r == -EINTR ? JOB_STOPPED : JOB_FAILED;
	}
	j->has_key = 1;
	return save_mark(j, UPLOAD_MARK_BEGUN);
}

static enum job_result send_parts(struct job *j, struct object *o)
{
	enum job_result result = JOB_DONE;
	int r = 0;

	if (j->mark.id[0] == '\0') {
		r = object_find_upload(o, j->mark.id);
		r = r != 0 ? r : object_begin_upload(o, j->mark.id);
		result = r < 0 ? result_of(r) : save_mark(j, UPLOAD_MARK_BEGUN);
	}
	if (result != JOB_DONE) {
		return result;
	}
	r = object_send_parts(o, j->mark.id, j->context->progress, j->context->ctx);
	r = r < 0 ? r : object_complete_upload(o, j->mark.id);
	if (r == -ENOENT) {
		/* Completed, and the answer was lost; or given up by the store: begin again. */
		j->mark.id[0] = '\0';
		r = object_check(o);
		if (r <= 0 && r != -EINTR) {
			snprintf(j->problem, BUCKET_PROBLEM_BYTES,
				 "%.150s: the store has forgotten the upload: begun again",
				 j->mark.key);
		}
		return r > 0 ? JOB_DONE : r == -EINTR ? JOB_STOPPED : JOB_FAILED;
	}
	return result_of(r);
}

static enum job_result send_object(struct job *j)
{
	struct object o = object_of(j);
	enum job_result result = JOB_DONE;
	int r;

	if (j->is_there) {
		return JOB_DONE;
	}
	if (!j->is_sent) {
		result = j->plan->count > 1 ? send_parts(j, &o) : result_of(object_put(&o));
	}
	if (result != JOB_DONE) {
		return result;
	}
	j->is_sent = 1; /* what fails below is asked again, not sent again */
	r = object_check(&o);
	if (r == 1) {
		j->is_there = 1;
		return JOB_DONE;
	}
	if (r == 0 || r == -ENOENT) {
		j->is_sent = 0;
		j->mark.id[0] = '\0';
		snprintf(j->problem, BUCKET_PROBLEM_BYTES,
			 "%.150s: what the store has is not what was sent: sent again",
			 j->mark.key);
	}
	return r == -EINTR ? JOB_STOPPED : JOB_FAILED;
}

static enum job_result send_manifest(struct job *j)
{
	const struct manifest manifest = { .appliance = j->context->appliance,
					   .name = j->name,
					   .key = j->mark.key,
					   .plan = j->plan,
					   .contents = &j->contents };
	char key[UPLOAD_KEY_BYTES + sizeof(MANIFEST_SUFFIX)];
	char *text = manifest_format(&manifest);
	int r;

	if (text == NULL) {
		return bad(j->problem, j->name, -ENOMEM);
	}
	snprintf(key, sizeof(key), "%s" MANIFEST_SUFFIX, j->mark.key);
	r = object_put_text(j->context->bucket, key, text, j->problem);
	free(text);
	return result_of(r);
}

static enum job_result do_steps(struct job *j)
{
	enum job_result (*const steps[])(struct job *) = { open_file, read_file, choose_key,
							   send_object, send_manifest };
	enum job_result result = JOB_DONE;

	for (size_t i = 0; i < sizeof(steps) / sizeof(steps[0]) && result == JOB_DONE; i++) {
		result = steps[i](j);
	}
	return result == JOB_DONE ? save_mark(j, UPLOAD_MARK_DONE) : result;
}

enum job_result job_run(struct job *j, char problem[BUCKET_PROBLEM_BYTES])
{
	enum job_result result;
	struct stat st;

	problem[0] = '\0';
	j->problem = problem;
	result = do_steps(j);
	if (j->fd >= 0) {
		if (result == JOB_FAILED && (fstat(j->fd, &st) < 0 || st.st_nlink == 0)) {
			result = JOB_GONE;
		}
		close(j->fd);
		j->fd = -1;
	}
	return result;
}

enum job_result job_give_up(const struct job_context *context, const char *name,
			    char problem[BUCKET_PROBLEM_BYTES])
{
	const char *dir = context->cfg->uplink_dir;
	struct upload_mark mark;
	int r = upload_mark_load(dir, name, UPLOAD_MARK_BEGUN, &mark);

	if (r == 0 && mark.id[0] != '\0') {
		r = object_abort_upload(context->bucket, mark.key, mark.id, problem);
		if (r < 0) {
			return result_of(r);
		}
	}
	r = upload_mark_remove(dir, name, UPLOAD_MARK_BEGUN);
	r = r < 0 ? r : upload_mark_remove(dir, name, UPLOAD_MARK_DONE);
	return r < 0 ? bad(problem, dir, r) : JOB_DONE;
}
