/* SPDX-License-Identifier: MIT */
#include "uplink/answer.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/grow.h"
#include "xml/xml.h"

enum { LEVELS = 3, NAME_BYTES = 40, ERROR_BYTES = 128 };

/* What is looked for: one of these is set. */
struct search {
	struct answer_error *error;
	char *id;
	struct answer_parts *parts;
	const char *key;
	char *upload;
	char *etag;

	int depth;
	char name[LEVELS][NAME_BYTES]; /* of the elements that are open */
	struct answer_part part;       /* being read */
	char part_key[UPLOAD_KEY_BYTES];
	char part_id[UPLOAD_ID_BYTES];
	int is_found;
};

static int begin(void *ctx, struct xml *xml, const char *name, const char **attribute)
{
	struct search *s = ctx;

	(void)xml;
	(void)attribute;
	if (s->depth < LEVELS) {
		snprintf(s->name[s->depth], NAME_BYTES, "%s", name);
	}
	if (s->depth == 1) {
		s->part = (struct answer_part){ .number = 0 };
		s->part_key[0] = '\0';
		s->part_id[0] = '\0';
	}
	s->depth++;
	return 0;
}

/* Stores differ in the end of the name: ListPartsResult, ListPartsResponse. */
static int is_root(const struct search *s, const char *root)
{
	return strncmp(s->name[0], root, strlen(root)) == 0;
}

/* 1 if the element that ends is @name in @parent in @root; @parent NULL: right in @root. */
static int is_at(const struct search *s, const char *root, const char *parent, const char *name)
{
	int level = parent == NULL ? 1 : 2;

	return s->depth == level && is_root(s, root) &&
	       (parent == NULL || strcmp(s->name[1], parent) == 0) &&
	       strcmp(s->name[level], name) == 0;
}

static int copy(char *to, size_t bytes, const char *text)
{
	size_t len = strlen(text);

	if (len >= bytes) {
		return -EBADMSG;
	}
	memcpy(to, text, len + 1);
	return 0;
}

static int number_of(const char *text, uint64_t limit, uint64_t *ret)
{
	uint64_t value;
	char *end;

	if (text[0] < '0' || text[0] > '9') {
		return -EBADMSG;
	}
	errno = 0;
	value = strtoull(text, &end, 10);
	if (*end != '\0' || errno != 0 || value > limit) {
		return -EBADMSG;
	}
	*ret = value;
	return 0;
}

static int add_part(struct search *s)
{
	struct answer_part *grown;

	if (s->part.number == 0 || s->part.etag[0] == '\0') {
		return -EBADMSG;
	}
	if (s->parts->count >= ANSWER_PARTS) {
		return -EBADMSG;
	}
	grown = array_grow(s->parts->part, &s->parts->count, sizeof(*grown));
	if (grown == NULL) {
		return -ENOMEM;
	}
	s->parts->part = grown;
	grown[s->parts->count - 1] = s->part;
	return 0;
}

static int end_of_parts(struct search *s, const char *text)
{
	static const char root[] = "ListParts";
	uint64_t number = 0;
	int r = 0;

	if (is_at(s, root, "Part", "PartNumber")) {
		r = number_of(text, ANSWER_PARTS, &number);
		s->part.number = (uint32_t)number;
	} else if (is_at(s, root, "Part", "Size")) {
		r = number_of(text, UINT64_MAX, &s->part.bytes);
	} else if (is_at(s, root, "Part", "ETag")) {
		answer_plain_etag(text, strlen(text), s->part.etag);
	} else if (is_at(s, root, NULL, "Part")) {
		r = add_part(s);
	} else if (is_at(s, root, NULL, "IsTruncated")) {
		s->parts->is_truncated = strcmp(text, "true") == 0;
	} else if (is_at(s, root, NULL, "NextPartNumberMarker") && text[0] != '\0') {
		r = number_of(text, ANSWER_PARTS, &number);
		s->parts->next_marker = (uint32_t)number;
	}
	return r;
}

static int end_of_uploads(struct search *s, const char *text)
{
	static const char root[] = "ListMultipartUploads";

	if (is_at(s, root, "Upload", "Key")) {
		(void)copy(s->part_key, sizeof(s->part_key), text); /* too long: none of ours */
	}
	if (is_at(s, root, "Upload", "UploadId")) {
		return copy(s->part_id, sizeof(s->part_id), text);
	}
	if (is_at(s, root, NULL, "Upload") && strcmp(s->part_key, s->key) == 0 &&
	    s->part_id[0] != '\0') {
		s->is_found = 1;
		return copy(s->upload, UPLOAD_ID_BYTES, s->part_id);
	}
	return 0;
}

static int end(void *ctx, struct xml *xml, const char *name, const char *text)
{
	struct search *s = ctx;

	(void)xml;
	(void)name;
	s->depth--;
	if (s->depth >= LEVELS) {
		return 0;
	}
	if (s->error != NULL && is_at(s, "Error", NULL, "Code")) {
		s->is_found = 1;
		snprintf(s->error->code, sizeof(s->error->code), "%s", text);
	} else if (s->id != NULL && is_at(s, "InitiateMultipartUpload", NULL, "UploadId")) {
		s->is_found = text[0] != '\0';
		return copy(s->id, UPLOAD_ID_BYTES, text);
	} else if (s->etag != NULL && is_at(s, "CompleteMultipartUpload", NULL, "ETag")) {
		answer_plain_etag(text, strlen(text), s->etag);
		s->is_found = s->etag[0] != '\0';
	} else if (s->parts != NULL) {
		s->is_found = s->is_found || (s->depth == 0 && is_root(s, "ListParts"));
		return end_of_parts(s, text);
	} else if (s->upload != NULL) {
		return end_of_uploads(s, text);
	}
	return 0;
}

static int run(const char *text, size_t len, struct search *s)
{
	const struct xml_handler handler = { begin, end, s };
	char error[ERROR_BYTES];

	return xml_read("answer", text, len, &handler, error, sizeof(error));
}

int answer_get_error(const char *text, size_t len, struct answer_error *ret_error)
{
	struct answer_error error = { .code = "" };
	struct search s = { .error = &error };

	if (run(text, len, &s) < 0 || !s.is_found || error.code[0] == '\0') {
		return 0;
	}
	*ret_error = error;
	return 1;
}

int answer_get_id(const char *text, size_t len, char ret_id[UPLOAD_ID_BYTES])
{
	char id[UPLOAD_ID_BYTES] = "";
	struct search s = { .id = id };
	int r = run(text, len, &s);

	if (r < 0 || !s.is_found) {
		return r < 0 ? r : -EBADMSG;
	}
	memcpy(ret_id, id, sizeof(id));
	return 0;
}

int answer_add_parts(const char *text, size_t len, struct answer_parts *parts)
{
	struct search s = { .parts = parts };
	int r;

	parts->is_truncated = 0;
	parts->next_marker = 0;
	r = run(text, len, &s);
	return r < 0 ? r : s.is_found ? 0 : -EBADMSG;
}

int answer_find_upload(const char *text, size_t len, const char *key, char ret_id[UPLOAD_ID_BYTES])
{
	char id[UPLOAD_ID_BYTES] = "";
	struct search s = { .key = key, .upload = id };
	int r = run(text, len, &s);

	if (r == 0 && s.is_found) {
		memcpy(ret_id, id, sizeof(id));
	}
	return r < 0 ? r : s.is_found;
}

int answer_get_etag(const char *text, size_t len, char ret_etag[ANSWER_ETAG_BYTES])
{
	char etag[ANSWER_ETAG_BYTES] = "";
	struct search s = { .etag = etag };
	int r = run(text, len, &s);

	if (r < 0 || !s.is_found) {
		return r < 0 ? r : -EBADMSG;
	}
	memcpy(ret_etag, etag, sizeof(etag));
	return 0;
}

void answer_plain_etag(const char *text, size_t len, char ret_etag[ANSWER_ETAG_BYTES])
{
	if (len >= 2 && text[0] == '"' && text[len - 1] == '"') {
		text++;
		len -= 2;
	}
	if (len >= ANSWER_ETAG_BYTES) {
		len = 0;
	}
	for (size_t i = 0; i < len; i++) {
		if (text[i] <= ' ' || text[i] > '~' || strchr("\"<>&", text[i]) != NULL) {
			len = 0; /* it goes back to the store in XML: nothing but plain text */
		}
	}
	memcpy(ret_etag, text, len);
	ret_etag[len] = '\0';
}
