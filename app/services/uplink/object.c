/* SPDX-License-Identifier: MIT */
#include "uplink/object.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PART_XML_BYTES = 64 + ANSWER_ETAG_BYTES, XML_BYTES = 256 };

static int fail(char *problem, const char *key, const char *what)
{
	snprintf(problem, BUCKET_PROBLEM_BYTES, "%s: %s", key, what);
	return -EIO;
}

static int take_into_hash(void *ctx, const void *data, size_t len)
{
	return plan_hash_add(ctx, data, len);
}

/* Where the ETag does not say it: read all of it. */
static int read_back(struct object *o)
{
	char sha256[UPLOAD_SHA256_CHARS + 1] = "";
	struct plan_hash *hash = plan_hash_create();
	const struct bucket_request get = {
		.method = BUCKET_GET, .key = o->key, .fd = -1, .take = take_into_hash, .ctx = hash
	};
	struct bucket_answer answer;
	int r = hash == NULL ? fail(o->problem, o->key, strerror(ENOMEM))
			     : bucket_request(o->bucket, &get, &answer, o->problem);

	plan_hash_end(hash, sha256);
	return r < 0 ? r : strcmp(sha256, o->plan->sha256) == 0;
}

int object_check(struct object *o)
{
	const struct bucket_request head = { .method = BUCKET_HEAD, .key = o->key, .fd = -1 };
	struct bucket_answer answer;
	int r = bucket_request(o->bucket, &head, &answer, o->problem);

	if (r < 0) {
		return r;
	}
	if (answer.bytes < 0 || (uint64_t)answer.bytes != o->plan->bytes ||
	    (answer.meta_sha256[0] != '\0' && strcmp(answer.meta_sha256, o->plan->sha256) != 0)) {
		return 0;
	}
	/* The MD5 of what is stored, unless the store encrypts by a key of its own. */
	return strcmp(answer.etag, o->plan->etag) == 0 ? 1 : read_back(o);
}

int object_put(struct object *o)
{
	char md5[PLAN_MD5_BASE64_BYTES];
	const struct bucket_request put = { .method = BUCKET_PUT,
					    .key = o->key,
					    .fd = o->fd,
					    .len = o->plan->bytes,
					    .sha256 = o->plan->sha256,
					    .md5_base64 = md5,
					    .meta_sha256 = o->plan->sha256 };
	struct bucket_answer answer;
	int r;

	plan_part_base64(o->plan, 0, md5);
	r = bucket_request(o->bucket, &put, &answer, o->problem);
	o->bytes_sent += r == 0 ? o->plan->bytes : 0;
	/* Not the object, hence the bucket. */
	return r == -ENOENT ? fail(o->problem, o->key, "rejected: HTTP status 404") : r;
}

int object_find_upload(struct object *o, char ret_id[UPLOAD_ID_BYTES])
{
	char query[BUCKET_QUERY_BYTES] = "prefix=";
	const struct bucket_request get = {
		.method = BUCKET_GET, .key = "", .query = query, .fd = -1
	};
	char problem[BUCKET_PROBLEM_BYTES];
	struct bucket_answer answer;
	int r;

	bucket_escape(o->key, query, sizeof(query) - sizeof("&uploads="));
	snprintf(query + strlen(query), sizeof("&uploads="), "&uploads=");
	r = bucket_request(o->bucket, &get, &answer, problem);
	r = r < 0 ? r : answer_find_upload(answer.text, answer.len, o->key, ret_id);
	/* Not all stores have the list, or permit it. */
	return r == -EINTR ? r : r > 0;
}

int object_begin_upload(struct object *o, char ret_id[UPLOAD_ID_BYTES])
{
	const struct bucket_request post = { .method = BUCKET_POST,
					     .key = o->key,
					     .query = "uploads=",
					     .fd = -1,
					     .meta_sha256 = o->plan->sha256 };
	struct bucket_answer answer;
	int r = bucket_request(o->bucket, &post, &answer, o->problem);

	if (r == 0 && answer_get_id(answer.text, answer.len, ret_id) < 0) {
		return fail(o->problem, o->key, "the store's answer has no id of an upload");
	}
	return r == -ENOENT ? fail(o->problem, o->key, "rejected: HTTP status 404") : r;
}

static int list_parts(struct object *o, const char *id, struct answer_parts *parts)
{
	struct bucket_answer answer;
	uint32_t marker = 0;
	int r;

	do {
		char query[BUCKET_QUERY_BYTES];
		const struct bucket_request get = {
			.method = BUCKET_GET, .key = o->key, .query = query, .fd = -1
		};

		snprintf(query, sizeof(query), "part-number-marker=%u&uploadId=", marker);
		bucket_escape(id, query, sizeof(query));
		r = bucket_request(o->bucket, &get, &answer, o->problem);
		if (r == 0 && answer_add_parts(answer.text, answer.len, parts) < 0) {
			r = fail(o->problem, o->key, "the store's answer is no list of parts");
		}
		if (r == 0 && parts->is_truncated && parts->next_marker <= marker) {
			r = fail(o->problem, o->key, "the store's list of parts has no end");
		}
		marker = parts->next_marker;
	} while (r == 0 && parts->is_truncated);
	return r;
}

static int put_part(struct object *o, const char *id, uint32_t index)
{
	char query[BUCKET_QUERY_BYTES];
	char md5[PLAN_MD5_BASE64_BYTES];
	const struct bucket_request put = { .method = BUCKET_PUT,
					    .key = o->key,
					    .query = query,
					    .fd = o->fd,
					    .offset = plan_offset(o->plan, index),
					    .len = plan_part_bytes(o->plan, index),
					    .sha256 = o->plan->part[index].sha256,
					    .md5_base64 = md5 };
	struct bucket_answer answer;
	int r;

	snprintf(query, sizeof(query), "partNumber=%u&uploadId=", index + 1);
	bucket_escape(id, query, sizeof(query));
	plan_part_base64(o->plan, index, md5);
	r = bucket_request(o->bucket, &put, &answer, o->problem);
	if (r == 0) {
		o->bytes_sent += put.len;
		memcpy(o->answered[index], answer.etag, sizeof(answer.etag));
	}
	return r;
}

/* The ETags of those that are there; "": not there, or something else. A store that encrypts by a
 * key of its own has no MD5: what came was checked when it came. */
static void match_parts(const struct object *o, const struct answer_parts *parts,
			char (*etag)[ANSWER_ETAG_BYTES])
{
	const struct plan *plan = o->plan;

	for (size_t i = 0; i < parts->count; i++) {
		const struct answer_part *part = &parts->part[i];
		char wanted[ANSWER_ETAG_BYTES];

		if (part->number > plan->count ||
		    part->bytes != plan_part_bytes(plan, part->number - 1)) {
			continue;
		}
		plan_part_etag(plan, part->number - 1, wanted);
		if (strcmp(part->etag, wanted) == 0 ||
		    strcmp(part->etag, o->answered[part->number - 1]) == 0) {
			memcpy(etag[part->number - 1], part->etag, ANSWER_ETAG_BYTES);
		}
	}
}

/* What the store has of the upload, by the index of the part. free() *@ret_etag. */
static int find_parts(struct object *o, const char *id, char (**ret_etag)[ANSWER_ETAG_BYTES])
{
	struct answer_parts parts = { .part = NULL };
	char (*etag)[ANSWER_ETAG_BYTES] = calloc(o->plan->count, sizeof(*etag));
	int r = etag == NULL ? fail(o->problem, o->key, strerror(ENOMEM))
			     : list_parts(o, id, &parts);

	if (r == 0) {
		match_parts(o, &parts, etag);
		*ret_etag = etag;
	} else {
		free(etag);
	}
	free(parts.part);
	return r;
}

int object_send_parts(struct object *o, const char *id, void (*sent)(void *ctx, uint64_t bytes),
		      void *ctx)
{
	char (*etag)[ANSWER_ETAG_BYTES] = NULL;
	uint64_t done = 0;
	int r = find_parts(o, id, &etag);

	for (uint32_t i = 0; i < o->plan->count && r == 0; i++) {
		if (etag[i][0] == '\0') {
			r = put_part(o, id, i);
		}
		done += plan_part_bytes(o->plan, i);
		sent(ctx, done);
	}
	free(etag);
	return r;
}

/* The list of parts that the object is made of, as the store has them. */
static char *format_parts(const struct plan *plan, char (*etag)[ANSWER_ETAG_BYTES], size_t *ret_len)
{
	size_t bytes = XML_BYTES + (size_t)plan->count * PART_XML_BYTES;
	char *text = malloc(bytes);
	size_t n;

	if (text == NULL) {
		return NULL;
	}
	n = (size_t)snprintf(text, bytes,
			     "<CompleteMultipartUpload "
			     "xmlns=\"http://s3.amazonaws.com/doc/2006-03-01/\">");
	for (uint32_t i = 0; i < plan->count; i++) {
		n += (size_t)snprintf(text + n, bytes - n,
				      "<Part><PartNumber>%u</PartNumber><ETag>\"%s\"</ETag></Part>",
				      i + 1, etag[i]);
	}
	n += (size_t)snprintf(text + n, bytes - n, "</CompleteMultipartUpload>");
	*ret_len = n;
	return text;
}

static int post_parts(struct object *o, const char *id, const char *text, size_t len)
{
	char query[BUCKET_QUERY_BYTES] = "uploadId=";
	char etag[ANSWER_ETAG_BYTES];
	struct plan_sums sums;
	const struct bucket_request post = { .method = BUCKET_POST,
					     .key = o->key,
					     .query = query,
					     .text = text,
					     .fd = -1,
					     .len = len,
					     .sha256 = sums.sha256 };
	struct answer_error error;
	struct bucket_answer answer;
	int r;

	bucket_escape(id, query, sizeof(query));
	if (plan_sum_text(text, len, &sums) < 0) {
		return fail(o->problem, o->key, strerror(ENOMEM));
	}
	r = bucket_request(o->bucket, &post, &answer, o->problem);
	/* It begins with status 200 while it still works, and may end with an error. */
	if (r == 0 && answer_get_etag(answer.text, answer.len, etag) < 0) {
		r = answer_get_error(answer.text, answer.len, &error)
			    ? fail(o->problem, o->key, error.code)
			    : fail(o->problem, o->key, "the upload was not completed");
	}
	return r;
}

int object_complete_upload(struct object *o, const char *id)
{
	char (*etag)[ANSWER_ETAG_BYTES] = NULL;
	char *text = NULL;
	size_t len = 0;
	int r = find_parts(o, id, &etag);

	for (uint32_t i = 0; i < o->plan->count && r == 0; i++) {
		if (etag[i][0] == '\0') {
			r = fail(o->problem, o->key, "a part that was sent is not in the store");
		}
	}
	if (r == 0) {
		text = format_parts(o->plan, etag, &len);
		r = text == NULL ? fail(o->problem, o->key, strerror(ENOMEM))
				 : post_parts(o, id, text, len);
	}
	free(text);
	free(etag);
	return r;
}

int object_abort_upload(struct bucket *bucket, const char *key, const char *id,
			char problem[BUCKET_PROBLEM_BYTES])
{
	char query[BUCKET_QUERY_BYTES] = "uploadId=";
	const struct bucket_request del = {
		.method = BUCKET_DELETE, .key = key, .query = query, .fd = -1
	};
	struct bucket_answer answer;
	int r;

	bucket_escape(id, query, sizeof(query));
	r = bucket_request(bucket, &del, &answer, problem);
	return r == -ENOENT ? 0 : r;
}

int object_put_text(struct bucket *bucket, const char *key, const char *text,
		    char problem[BUCKET_PROBLEM_BYTES])
{
	struct plan_sums sums;
	const struct bucket_request get = { .method = BUCKET_GET, .key = key, .fd = -1 };
	const struct bucket_request put = { .method = BUCKET_PUT,
					    .key = key,
					    .text = text,
					    .fd = -1,
					    .len = strlen(text),
					    .sha256 = sums.sha256,
					    .md5_base64 = sums.md5_base64 };
	struct bucket_answer answer;
	int r = plan_sum_text(text, put.len, &sums);

	if (r < 0) {
		return fail(problem, key, strerror(ENOMEM));
	}
	r = bucket_request(bucket, &put, &answer, problem);
	r = r < 0 ? r : bucket_request(bucket, &get, &answer, problem);
	if (r == -ENOENT) {
		return fail(problem, key, "not in the store after it was sent");
	}
	if (r == 0 && (answer.len != put.len || memcmp(answer.text, text, put.len) != 0)) {
		return fail(problem, key, "what the store has is not what was sent");
	}
	return r;
}
