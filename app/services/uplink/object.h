/* SPDX-License-Identifier: MIT */
/*
 * One recording as an object of the store: whole, or in the parts of its plan. What the store has
 * is asked, never remembered. All results are those of bucket_request(). Context: blocking.
 */
#ifndef UPLINK_OBJECT_H
#define UPLINK_OBJECT_H

#include "uplink/bucket.h"
#include "uplink/plan.h"

struct object {
	struct bucket *bucket;
	const char *key;
	const struct plan *plan;
	int fd;                              /* of the recording; -1: it is not open */
	char (*answered)[ANSWER_ETAG_BYTES]; /* ETags of the parts that were sent; "": not yet */
	char *problem;
	uint64_t bytes_sent; /* of all requests that were answered */
};

/** Is what is there under the key what the plan has? 1; 0: it is something else; -ENOENT: nothing
 * is. */
int object_check(struct object *o);
/** Send it whole. */
int object_put(struct object *o);

/** An upload to the key that is unfinished in the store to @ret_id. 1, 0: none (or the store does
 * not tell). */
int object_find_upload(struct object *o, char ret_id[UPLOAD_ID_BYTES]);
int object_begin_upload(struct object *o, char ret_id[UPLOAD_ID_BYTES]);
/** Send what the store does not have of the upload @id; @sent is called after each part. -ENOENT:
 * there is no such upload. */
int object_send_parts(struct object *o, const char *id, void (*sent)(void *ctx, uint64_t bytes),
		      void *ctx);
/** Make the object of its parts. */
int object_complete_upload(struct object *o, const char *id);
/** Let the store forget the upload @id to @key. 0 also if it does not know it. */
int object_abort_upload(struct bucket *bucket, const char *key, const char *id,
			char problem[BUCKET_PROBLEM_BYTES]);

/** Put @text under @key, and read it back: 0, the store has it. */
int object_put_text(struct bucket *bucket, const char *key, const char *text,
		    char problem[BUCKET_PROBLEM_BYTES]);

#endif
