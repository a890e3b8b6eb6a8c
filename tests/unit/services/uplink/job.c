/* SPDX-License-Identifier: MIT */
/* The whole way of a recording to a store that is made here: it fails the n-th request, before or
 * after it has done what it was asked for. */
#include "uplink/job.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "harness/test.h"
#include "record/upload_mark.h"
#include "uplink/plan.h"

enum { OBJECTS = 8, PARTS = 8, PATH_BYTES = 300, PART_BYTES = 1000, NEVER = 0 };

enum failing { FAIL_BEFORE, FAIL_AFTER };

struct blob {
	char data[PARTS * PART_BYTES];
	int is_there;
	size_t len;
	char etag[ANSWER_ETAG_BYTES];
};

struct stored {
	char key[UPLOAD_KEY_BYTES];
	char meta[UPLOAD_SHA256_CHARS + 1];
	struct blob blob;
	unsigned made; /* times */
};

struct bucket {
	struct stored object[OBJECTS];
	struct stored upload; /* the only one; its key "": none */
	struct blob part[PARTS];
	unsigned parts_sent;
	unsigned requests;
	unsigned fail_at;
	enum failing how;
	int has_odd_etags; /* they are no MD5 */
	char answer[4096];
};

static struct bucket store;
static char dir[PATH_BYTES];
static char marks[PATH_BYTES];
static char reported[512];

static const char name[] = "ecdaq-20260101T000000Z-0000000a-000001.mcap";

/* --- the store --- */

static struct stored *find(const char *key)
{
	for (size_t i = 0; i < OBJECTS; i++) {
		if (strcmp(store.object[i].key, key) == 0) {
			return &store.object[i];
		}
	}
	return NULL;
}

static void etag_of(const char *data, size_t len, const char *end, char etag[ANSWER_ETAG_BYTES])
{
	static const char digits[] =
		"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
	struct plan_sums sums;
	unsigned bits = 0;
	unsigned have = 0;
	size_t n = 0;

	CHECK_EQ(plan_sum_text(data, len, &sums), 0);
	for (const char *p = sums.md5_base64; *p != '='; p++) {
		bits = bits << 6 | (unsigned)(strchr(digits, *p) - digits);
		have += 6;
		if (have >= 8) {
			have -= 8;
			n += (size_t)snprintf(etag + n, 3, "%02x", bits >> have & 0xff);
		}
	}
	snprintf(etag + n, ANSWER_ETAG_BYTES - n, "%s%s", end, store.has_odd_etags ? "x" : "");
}

/* The content that is sent, whose checksum must be the one that is signed. */
static void receive(const struct bucket_request *rq, struct blob *b)
{
	struct plan_sums sums;

	CHECK(rq->len < sizeof(b->data));
	memset(b, 0, sizeof(*b));
	b->is_there = 1;
	b->len = rq->len;
	if (rq->text != NULL) {
		memcpy(b->data, rq->text, rq->len);
	} else {
		CHECK_EQ(pread(rq->fd, b->data, rq->len, (off_t)rq->offset), (ssize_t)rq->len);
	}
	CHECK_EQ(plan_sum_text(b->data, b->len, &sums), 0);
	CHECK_STR(rq->sha256, sums.sha256);
	if (rq->md5_base64 != NULL) {
		CHECK_STR(rq->md5_base64, sums.md5_base64);
	}
	etag_of(b->data, b->len, "", b->etag);
}

static void put(const char *key, const char *meta, const struct blob *blob)
{
	struct stored *s = find(key);

	s = s != NULL ? s : find("");
	CHECK(s != NULL);
	s->blob = *blob;
	s->made++;
	snprintf(s->key, sizeof(s->key), "%s", key);
	snprintf(s->meta, sizeof(s->meta), "%s", meta != NULL ? meta : "");
}

static int answer_text(struct bucket_answer *answer)
{
	answer->text = store.answer;
	answer->len = strlen(store.answer);
	return 0;
}

static int get(const struct bucket_request *rq, struct bucket_answer *answer)
{
	const struct stored *s = find(rq->key);

	if (s == NULL) {
		return -ENOENT;
	}
	answer->bytes = (int64_t)s->blob.len;
	memcpy(answer->etag, s->blob.etag, sizeof(answer->etag));
	memcpy(answer->meta_sha256, s->meta, sizeof(answer->meta_sha256));
	if (rq->method == BUCKET_GET && rq->take != NULL) {
		return rq->take(rq->ctx, s->blob.data, s->blob.len);
	}
	answer->text = s->blob.data;
	answer->len = s->blob.len;
	return 0;
}

static int list_uploads(struct bucket_answer *answer)
{
	snprintf(store.answer, sizeof(store.answer), "<ListMultipartUploadsResult>");
	if (store.upload.key[0] != '\0') {
		snprintf(store.answer + strlen(store.answer), 1000,
			 "<Upload><Key>%s</Key><UploadId>u</UploadId></Upload>", store.upload.key);
	}
	snprintf(store.answer + strlen(store.answer), 100, "</ListMultipartUploadsResult>");
	return answer_text(answer);
}

/* One part in an answer. */
static int list_parts(const struct bucket_request *rq, struct bucket_answer *answer)
{
	unsigned long marker = strtoul(strchr(rq->query, '=') + 1, NULL, 10);

	snprintf(store.answer, sizeof(store.answer), "<ListPartsResult>");
	for (size_t i = marker; i < PARTS; i++) {
		if (store.part[i].is_there) {
			snprintf(store.answer + strlen(store.answer), 400,
				 "<IsTruncated>true</IsTruncated>"
				 "<NextPartNumberMarker>%zu</NextPartNumberMarker>"
				 "<Part><PartNumber>%zu</PartNumber><Size>%zu</Size>"
				 "<ETag>\"%s\"</ETag></Part>",
				 i + 1, i + 1, store.part[i].len, store.part[i].etag);
			break;
		}
	}
	snprintf(store.answer + strlen(store.answer), 100, "</ListPartsResult>");
	return answer_text(answer);
}

static void forget_upload(void)
{
	store.upload.key[0] = '\0';
	for (size_t i = 0; i < PARTS; i++) {
		store.part[i].is_there = 0;
	}
}

static int complete(struct bucket_answer *answer)
{
	static struct blob whole;
	char md5s[PARTS * PLAN_MD5_BYTES];
	char end[16];
	size_t count = 0;

	whole = (struct blob){ .is_there = 1 };
	for (; count < PARTS && store.part[count].is_there; count++) {
		const struct blob *part = &store.part[count];

		memcpy(whole.data + whole.len, part->data, part->len);
		whole.len += part->len;
		for (size_t i = 0; i < PLAN_MD5_BYTES; i++) {
			char byte[3] = { part->etag[2 * i], part->etag[2 * i + 1], '\0' };

			md5s[count * PLAN_MD5_BYTES + i] = (char)strtoul(byte, NULL, 16);
		}
	}
	snprintf(end, sizeof(end), "-%zu", count);
	etag_of(md5s, count * PLAN_MD5_BYTES, end, whole.etag);
	put(store.upload.key, store.upload.meta, &whole);
	snprintf(store.answer, sizeof(store.answer),
		 "<CompleteMultipartUploadResult><ETag>\"%s\"</ETag>"
		 "</CompleteMultipartUploadResult>",
		 whole.etag);
	forget_upload();
	return answer_text(answer);
}

static int serve_upload(const struct bucket_request *rq, struct bucket_answer *answer)
{
	if (rq->method == BUCKET_GET && rq->key[0] == '\0') {
		return list_uploads(answer);
	}
	if (strcmp(rq->query, "uploads=") == 0) {
		CHECK_STR(store.upload.key, ""); /* never two of them */
		snprintf(store.upload.key, sizeof(store.upload.key), "%s", rq->key);
		snprintf(store.upload.meta, sizeof(store.upload.meta), "%s", rq->meta_sha256);
		snprintf(store.answer, sizeof(store.answer),
			 "<InitiateMultipartUploadResult><UploadId>u</UploadId>"
			 "</InitiateMultipartUploadResult>");
		return answer_text(answer);
	}
	if (strcmp(store.upload.key, rq->key) != 0) {
		return -ENOENT;
	}
	if (rq->method == BUCKET_GET) {
		return list_parts(rq, answer);
	}
	if (rq->method == BUCKET_PUT) {
		unsigned long number = strtoul(strchr(rq->query, '=') + 1, NULL, 10);

		CHECK(number >= 1 && number <= PARTS);
		receive(rq, &store.part[number - 1]);
		memcpy(answer->etag, store.part[number - 1].etag, sizeof(answer->etag));
		store.parts_sent++;
		return 0;
	}
	if (rq->method == BUCKET_DELETE) {
		forget_upload();
		return 0;
	}
	return complete(answer);
}

static int serve(const struct bucket_request *rq, struct bucket_answer *answer)
{
	static struct blob blob;

	if (rq->query != NULL) {
		return serve_upload(rq, answer);
	}
	if (rq->method == BUCKET_PUT) {
		receive(rq, &blob);
		put(rq->key, rq->meta_sha256, &blob);
		return 0;
	}
	return get(rq, answer);
}

int bucket_create(const struct config *cfg, struct bucket_watch watch, struct bucket **ret_bucket,
		  char problem[BUCKET_PROBLEM_BYTES])
{
	(void)cfg;
	(void)watch;
	(void)problem;
	*ret_bucket = &store;
	return 0;
}

void bucket_destroy(struct bucket *b)
{
	(void)b;
}

void bucket_escape(const char *text, char *buf, size_t bytes)
{
	size_t n = strlen(buf);

	snprintf(buf + n, bytes - n, "%s", text);
}

int bucket_request(struct bucket *b, const struct bucket_request *request,
		   struct bucket_answer *ret_answer, char problem[BUCKET_PROBLEM_BYTES])
{
	int fails = ++b->requests == b->fail_at;
	int r = 0;

	*ret_answer = (struct bucket_answer){ .bytes = -1 };
	if (!fails || b->how == FAIL_AFTER) {
		r = serve(request, ret_answer);
	}
	if (fails) {
		snprintf(problem, BUCKET_PROBLEM_BYTES, "no answer");
		return -EIO;
	}
	return r;
}

/* --- a recording, and its way --- */

static void report(const char *line)
{
	snprintf(reported, sizeof(reported), "%s", line);
}

static void progress(void *ctx, uint64_t bytes)
{
	(void)ctx;
	(void)bytes;
}

static void make_file(const char *path, size_t len)
{
	/* What a reader of recordings takes for one: its magic, then nothing that it knows. */
	static const unsigned char magic[8] = { 0x89, 'M', 'C', 'A', 'P', '0', '\r', '\n' };
	static const unsigned char header[17] = { 1, 8 };
	int fd = open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);

	CHECK(fd >= 0);
	CHECK_EQ(write(fd, magic, sizeof(magic)), (ssize_t)sizeof(magic));
	CHECK_EQ(write(fd, header, sizeof(header)), (ssize_t)sizeof(header));
	CHECK_EQ(ftruncate(fd, (off_t)len), 0);
	close(fd);
}

static void path_of(const char *folder, const char *file, char path[2 * PATH_BYTES])
{
	snprintf(path, 2L * PATH_BYTES, "%s/%s", folder, file);
}

static void begin(struct config *cfg, size_t len)
{
	char path[2 * PATH_BYTES];

	snprintf(dir, sizeof(dir), "%s/ecdaq-uplink-XXXXXX",
		 getenv("TMPDIR") != NULL ? getenv("TMPDIR") : "/tmp");
	CHECK(mkdtemp(dir) != NULL);
	snprintf(marks, sizeof(marks), "%s", dir);
	*cfg = (struct config){ .uplink_part_bytes = PART_BYTES };
	snprintf(cfg->record_dir, sizeof(cfg->record_dir), "%.200s", dir);
	snprintf(cfg->uplink_dir, sizeof(cfg->uplink_dir), "%.200s", marks);
	snprintf(cfg->uplink_prefix, sizeof(cfg->uplink_prefix), "plant/a");
	path_of(dir, name, path);
	make_file(path, len);
	reported[0] = '\0';
}

static void end(void)
{
	char path[2 * PATH_BYTES];

	store = (struct bucket){ .requests = 0 };
	(void)upload_mark_remove(marks, name, UPLOAD_MARK_BEGUN);
	(void)upload_mark_remove(marks, name, UPLOAD_MARK_DONE);
	path_of(dir, name, path);
	unlink(path);
	CHECK_EQ(rmdir(dir), 0);
}

static struct job_context context_of(const struct config *cfg)
{
	return (struct job_context){ .cfg = cfg,
				     .appliance = "rig1",
				     .bucket = &store,
				     .report = report,
				     .progress = progress };
}

/* To its end; as if killed after each failure, if so asked for. */
static void run_to_end(const struct config *cfg, int is_killed)
{
	struct job_context context = context_of(cfg);
	struct store_entry entry = { .sequence = 1 };
	char problem[BUCKET_PROBLEM_BYTES];
	enum job_result result = JOB_FAILED;
	struct job *job = NULL;

	snprintf(entry.name, sizeof(entry.name), "%s", name);
	for (int tries = 0; tries < 8 && result == JOB_FAILED; tries++) {
		if (job == NULL || is_killed) {
			job_destroy(job);
			job = job_create(&context, &entry);
		}
		result = job_run(job, problem);
		CHECK(result == JOB_DONE || problem[0] != '\0');
	}
	job_destroy(job);
	CHECK_EQ(result, JOB_DONE);
}

static void expect_there(size_t len)
{
	const struct stored *object =
		find("plant/a/rig1/ecdaq-20260101T000000Z-0000000a-000001.mcap");
	const struct stored *manifest =
		find("plant/a/rig1/ecdaq-20260101T000000Z-0000000a-000001.mcap.json");
	struct store_entry entry = { .bytes = len };

	CHECK(object != NULL && manifest != NULL);
	CHECK_EQ(object->blob.len, len);
	CHECK(memcmp(object->blob.data, "\x89MCAP0\r\n", 8) == 0);
	CHECK(strstr(manifest->blob.data, "\"version\":1") != NULL);
	CHECK_STR(store.upload.key, "");
	CHECK(store.object[2].key[0] == '\0'); /* nothing else */
	snprintf(entry.name, sizeof(entry.name), "%s", name);
	CHECK(upload_mark_is_done(marks, &entry));
}

/* A failure at each request, one after the other, until there are none so many. */
static void fail_everywhere(size_t len, int has_odd_etags, int is_killed)
{
	for (int how = FAIL_BEFORE; how <= FAIL_AFTER; how++) {
		unsigned n = 1;

		for (int is_over = 0; !is_over; n++) {
			struct config cfg;

			begin(&cfg, len);
			store.fail_at = n;
			store.how = (enum failing)how;
			store.has_odd_etags = has_odd_etags;
			run_to_end(&cfg, is_killed);
			expect_there(len);
			is_over = store.requests < n;
			CHECK(find("")->made == 0);
			if (!has_odd_etags && len > PART_BYTES) {
				/* A part is sent twice only where its answer was lost. */
				CHECK(store.parts_sent <= (len + PART_BYTES - 1) / PART_BYTES + 1);
			}
			end();
		}
		CHECK(n > 5);
	}
}

TEST(uplink_job, a_small_recording_is_there_whatever_request_fails)
{
	for (int odd = 0; odd < 2; odd++) {
		fail_everywhere(PART_BYTES, odd, 0);
		fail_everywhere(PART_BYTES, odd, 1);
	}
}

TEST(uplink_job, a_large_recording_is_there_whatever_request_fails)
{
	for (int odd = 0; odd < 2; odd++) {
		fail_everywhere(3 * PART_BYTES + 1, odd, 0);
		fail_everywhere(3 * PART_BYTES + 1, odd, 1);
	}
}

TEST(uplink_job, without_failures_nothing_is_sent_twice)
{
	struct config cfg;

	begin(&cfg, 4 * PART_BYTES);
	run_to_end(&cfg, 0);
	CHECK_EQ(store.parts_sent, 4);
	CHECK_EQ(store.requests, 9 + 4 + 4); /* a page of the list has one part here */
	CHECK_EQ(store.object[0].made, 1);
	/* Also where the marks are lost. */
	CHECK_EQ(upload_mark_remove(marks, name, UPLOAD_MARK_DONE), 0);
	run_to_end(&cfg, 0);
	CHECK_EQ(store.parts_sent, 4);
	CHECK_EQ(store.object[0].made, 1);
	expect_there(4 * PART_BYTES);
	end();
	begin(&cfg, PART_BYTES);
	run_to_end(&cfg, 0);
	CHECK_EQ(store.requests, 5);
	end();
}

TEST(uplink_job, another_object_under_the_key_is_never_touched)
{
	struct config cfg;
	static const struct blob blob = { .data = "another one", .len = 11 };

	begin(&cfg, PART_BYTES);
	put("plant/a/rig1/ecdaq-20260101T000000Z-0000000a-000001.mcap", NULL, &blob);
	run_to_end(&cfg, 0);
	CHECK_EQ(store.object[0].blob.len, 11);
	CHECK(strstr(reported, "another recording of this name") != NULL);
	CHECK_EQ(store.object[1].blob.len, PART_BYTES);
	CHECK(strncmp(store.object[1].key, "plant/a/rig1/ecdaq-20260101T000000Z-0000000a-000001-",
		      52) == 0);
	end();
}

TEST(uplink_job, a_recording_that_is_gone_leaves_no_upload_and_no_mark)
{
	struct config cfg;
	struct job_context context = context_of(&cfg);
	struct store_entry entry = { .sequence = 1 };
	char problem[BUCKET_PROBLEM_BYTES];
	char path[2 * PATH_BYTES];
	struct upload_mark mark;
	struct job *job;

	begin(&cfg, 3 * PART_BYTES);
	snprintf(entry.name, sizeof(entry.name), "%s", name);
	store.fail_at = 6; /* HEAD, uploads, begin, parts, the first one; the second */
	job = job_create(&context, &entry);
	CHECK_EQ(job_run(job, problem), JOB_FAILED);
	CHECK_EQ(store.parts_sent, 1);
	path_of(dir, name, path);
	CHECK_EQ(unlink(path), 0);
	CHECK_EQ(job_run(job, problem), JOB_GONE);
	job_destroy(job);
	CHECK(store.upload.key[0] != '\0');
	store.fail_at = store.requests + 1;
	CHECK_EQ(job_give_up(&context, name, problem), JOB_FAILED);
	CHECK_EQ(upload_mark_load(marks, name, UPLOAD_MARK_BEGUN, &mark), 0);
	CHECK_EQ(job_give_up(&context, name, problem), JOB_DONE);
	CHECK_STR(store.upload.key, "");
	CHECK_EQ(upload_mark_load(marks, name, UPLOAD_MARK_BEGUN, &mark), -ENOENT);
	end();
}
