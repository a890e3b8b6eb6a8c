/* SPDX-License-Identifier: MIT */
/* How a recording is sent: its parts and their checksums, found in one reading. Context: blocking.
 */
#ifndef UPLINK_PLAN_H
#define UPLINK_PLAN_H

#include <signal.h>
#include <stddef.h>
#include <stdint.h>

#include "record/upload_mark.h"
#include "uplink/answer.h"

enum { PLAN_MD5_BYTES = 16, PLAN_MD5_BASE64_BYTES = 25, PLAN_MD5_CHARS = 32 };

struct plan_part {
	char sha256[UPLOAD_SHA256_CHARS + 1];
	unsigned char md5[PLAN_MD5_BYTES];
};

struct plan {
	uint64_t bytes;
	int64_t mtime_ns;
	uint64_t part_bytes; /* all but the last one */
	uint32_t count;      /* 1: sent whole, not as a multipart upload */
	struct plan_part *part;
	char sha256[UPLOAD_SHA256_CHARS + 1];
	char etag[ANSWER_ETAG_BYTES]; /* that a store gives it, unless it encrypts by KMS */
};

/** Of the file @fd, in parts of @part_bytes, or larger ones where there would be too many. *@stop
 * ends the reading. 0; -EINTR, -ENOMEM, -errno. Free with plan_destroy(). */
int plan_create(int fd, uint64_t part_bytes, const volatile sig_atomic_t *stop,
		struct plan **ret_plan);
void plan_destroy(struct plan *p);

/** Where part @index, from 0, begins, and its bytes. */
uint64_t plan_offset(const struct plan *p, uint32_t index);
uint64_t plan_part_bytes(const struct plan *p, uint32_t index);
/** MD5 of a part as an ETag, and as the header Content-MD5 has it. */
void plan_part_etag(const struct plan *p, uint32_t index, char ret_etag[ANSWER_ETAG_BYTES]);
void plan_part_base64(const struct plan *p, uint32_t index, char ret_text[PLAN_MD5_BASE64_BYTES]);
/** 1 if the file @fd is, by size and time, the one that was read. */
int plan_is_of(const struct plan *p, int fd);

/* The same checksums of text. */
struct plan_sums {
	char sha256[UPLOAD_SHA256_CHARS + 1];
	char md5_base64[PLAN_MD5_BASE64_BYTES];
};

/** 0, -ENOMEM. */
int plan_sum_text(const void *text, size_t len, struct plan_sums *ret_sums);

/* SHA-256 of what comes piece by piece. */
struct plan_hash;

struct plan_hash *plan_hash_create(void);
/** 0, -EIO. */
int plan_hash_add(struct plan_hash *h, const void *data, size_t len);
/** Frees @h, NULL is fine. @ret_sha256 NULL: only that. */
void plan_hash_end(struct plan_hash *h, char *ret_sha256);

#endif
