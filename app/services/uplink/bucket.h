/* SPDX-License-Identifier: MIT */
/*
 * Requests to one bucket of an object store with the interface of S3, signed by libcurl. Context:
 * one thread; blocks as long as the store answers, and ends at stop_requested().
 */
#ifndef UPLINK_BUCKET_H
#define UPLINK_BUCKET_H

#include <stddef.h>
#include <stdint.h>

#include "config/config.h"
#include "record/upload_mark.h"
#include "uplink/answer.h"

struct bucket;

enum { BUCKET_PROBLEM_BYTES = 256, BUCKET_BODY_BYTES = 4 << 20, BUCKET_QUERY_BYTES = 4096 };

enum bucket_method { BUCKET_GET, BUCKET_HEAD, BUCKET_PUT, BUCKET_POST, BUCKET_DELETE };

struct bucket_request {
	enum bucket_method method;
	const char *key;   /* "": the bucket itself */
	const char *query; /* "uploads=", parameters in the order of their names; NULL: none */
	/* What is sent: @len bytes of @text, or of the file @fd from @offset. */
	const char *text;
	int fd;
	uint64_t offset;
	uint64_t len;
	const char *sha256;      /* of these, hexadecimal; NULL: nothing is sent */
	const char *md5_base64;  /* of these; NULL: no header */
	const char *meta_sha256; /* of the whole object, kept beside it; NULL: no header */
	/* Where the content goes: NULL: into the answer. 0, or negative to end it. */
	int (*take)(void *ctx, const void *data, size_t len);
	void *ctx;
};

struct bucket_answer {
	long status;                  /* of HTTP */
	char etag[ANSWER_ETAG_BYTES]; /* without quotes; "": none */
	char meta_sha256[UPLOAD_SHA256_CHARS + 1];
	char encryption[32]; /* x-amz-server-side-encryption */
	int64_t bytes;       /* Content-Length; -1: none */
	const char *text;    /* valid until the next request */
	size_t len;
};

/* Called during a request, every now and then: so many bytes of it were sent. */
struct bucket_watch {
	void (*sent)(void *ctx, uint64_t bytes);
	void *ctx;
};

/** @cfg and what @watch has are kept. 0; -EINVAL with a line in @problem: an option is unusable. */
int bucket_create(const struct config *cfg, struct bucket_watch watch, struct bucket **ret_bucket,
		  char problem[BUCKET_PROBLEM_BYTES]);
void bucket_destroy(struct bucket *b);

/**
 * 0: done; -ENOENT: there is no such object or upload; -EPERM: the store does not permit it, with a
 * line in @problem; -EIO: failed, with a line; -EINTR: to be stopped. The line is the same as long
 * as the reason is.
 */
int bucket_request(struct bucket *b, const struct bucket_request *request,
		   struct bucket_answer *ret_answer, char problem[BUCKET_PROBLEM_BYTES]);

/** Append @text to a query, escaped. */
void bucket_escape(const char *text, char *buf, size_t bytes);

#endif
