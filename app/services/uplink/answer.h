/* SPDX-License-Identifier: MIT */
/* The XML that an object store answers with, whatever its bytes are. Context: blocking. */
#ifndef UPLINK_ANSWER_H
#define UPLINK_ANSWER_H

#include <stddef.h>
#include <stdint.h>

#include "record/upload_mark.h"

enum { ANSWER_TEXT_BYTES = 96, ANSWER_ETAG_BYTES = 80, ANSWER_PARTS = 10000 };

struct answer_error {
	char code[ANSWER_TEXT_BYTES]; /* "NoSuchBucket" */
};

/* A part of a multipart upload that the store has. */
struct answer_part {
	uint32_t number; /* from 1 */
	uint64_t bytes;
	char etag[ANSWER_ETAG_BYTES]; /* without quotes */
};

struct answer_parts {
	struct answer_part *part; /* free() it */
	size_t count;
	int is_truncated;
	uint32_t next_marker; /* where the next answer shall begin */
};

/** 1: the answer is an error; 0: it is something else, or no XML. */
int answer_get_error(const char *text, size_t len, struct answer_error *ret_error);
/** Id of an upload that was begun. 0; -EBADMSG. */
int answer_get_id(const char *text, size_t len, char ret_id[UPLOAD_ID_BYTES]);
/** Append the parts of a list to @parts. 0; -EBADMSG, -ENOMEM. */
int answer_add_parts(const char *text, size_t len, struct answer_parts *parts);
/** Find an unfinished upload to exactly @key, the last one listed. 1; 0: there is none; -EBADMSG.
 */
int answer_find_upload(const char *text, size_t len, const char *key, char ret_id[UPLOAD_ID_BYTES]);
/** ETag of an object that was completed. 0; -EBADMSG. */
int answer_get_etag(const char *text, size_t len, char ret_etag[ANSWER_ETAG_BYTES]);

/** An ETag as it stands in a header or an answer, without its quotes; "": it is too long. */
void answer_plain_etag(const char *text, size_t len, char ret_etag[ANSWER_ETAG_BYTES]);

#endif
