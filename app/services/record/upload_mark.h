/* SPDX-License-Identifier: MIT */
/*
 * What ecdaq-uplink knows of a recording, a file beside none of the recordings but in uplink.dir:
 * NAME.uploading from before the first byte is sent, NAME.uploaded once the store has all of it and
 * the manifest. Both survive power cuts: written beside their place, synced, renamed. The recorder
 * reads them, too. Context: blocking.
 */
#ifndef RECORD_UPLOAD_MARK_H
#define RECORD_UPLOAD_MARK_H

#include <stddef.h>
#include <stdint.h>

#include "record/store.h"

enum upload_mark_kind { UPLOAD_MARK_BEGUN, UPLOAD_MARK_DONE };

enum {
	UPLOAD_SHA256_CHARS = 64,
	UPLOAD_KEY_BYTES = 512,
	UPLOAD_ID_BYTES = 1280,
	UPLOAD_MARK_BYTES = 4096, /* of the file, at most */
};

struct upload_mark {
	uint64_t bytes; /* of the recording */
	int64_t mtime_ns;
	char sha256[UPLOAD_SHA256_CHARS + 1];
	char key[UPLOAD_KEY_BYTES]; /* of the object */
	char id[UPLOAD_ID_BYTES];   /* of the multipart upload; "": none */
};

/** Bytes of such a file. 0; -EBADMSG: not one (@ret_mark untouched). */
int upload_mark_parse(const char *text, size_t len, struct upload_mark *ret_mark);
/** The file's text. Its length; -EINVAL: a value that cannot be read back. */
int upload_mark_format(const struct upload_mark *mark, char *buf, size_t buf_len);

/** The mark of recording @name in @dir. 0; -ENOENT, -EBADMSG, -errno (@ret_mark untouched). */
int upload_mark_load(const char *dir, const char *name, enum upload_mark_kind kind,
		     struct upload_mark *ret_mark);
/** Durable when it returns 0; -errno. Done: replaces the one that is begun. */
int upload_mark_save(const char *dir, const char *name, enum upload_mark_kind kind,
		     const struct upload_mark *mark);
/** 0, also where there is none; -errno. */
int upload_mark_remove(const char *dir, const char *name, enum upload_mark_kind kind);

/** 1 if the recording of an entry is in the store, by the mark in @dir. */
int upload_mark_is_done(const char *dir, const struct store_entry *entry);
/** Take what @file, a file name in uplink.dir, is the mark of. 1; 0: it is none. */
int upload_mark_name(const char *file, char ret_name[STORE_NAME_BYTES],
		     enum upload_mark_kind *ret_kind);

#endif
