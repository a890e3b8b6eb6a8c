/* SPDX-License-Identifier: MIT */
/* Bytes as the answer of an object store, as a file of credentials, and as a mark. Whatever they
 * are: no crash, and what is taken from them is within its bounds and can be sent again. */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "record/upload_mark.h"
#include "uplink/answer.h"
#include "uplink/credentials.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void require(int holds)
{
	if (!holds) {
		abort();
	}
}

static int is_plain(const char *text)
{
	return text[strcspn(text, " \t\r\n\"<>&")] == '\0';
}

static void take_answers(const char *text, size_t len)
{
	struct answer_parts parts = { .part = NULL };
	struct answer_error error = { .code = "" };
	char id[UPLOAD_ID_BYTES] = "";
	char etag[ANSWER_ETAG_BYTES] = "";

	require(!answer_get_error(text, len, &error) || error.code[0] != '\0');
	require(answer_get_id(text, len, id) < 0 || id[0] != '\0');
	require(answer_find_upload(text, len, "a/b.mcap", id) <= 0 || id[0] != '\0');
	require(answer_get_etag(text, len, etag) < 0 || (etag[0] != '\0' && is_plain(etag)));
	(void)answer_add_parts(text, len, &parts);
	require(parts.count <= ANSWER_PARTS && parts.next_marker <= ANSWER_PARTS);
	for (size_t i = 0; i < parts.count; i++) {
		require(parts.part[i].number >= 1 && parts.part[i].number <= ANSWER_PARTS);
		require(parts.part[i].etag[0] != '\0' && is_plain(parts.part[i].etag));
	}
	free(parts.part);
}

static void take_mark(const char *text, size_t len)
{
	char again[UPLOAD_MARK_BYTES];
	struct upload_mark mark;

	if (len < sizeof(again) && upload_mark_parse(text, len, &mark) == 0) {
		/* Numbers with zeros before them are shorter then. */
		int n = upload_mark_format(&mark, again, sizeof(again));

		require(n > 0 && (size_t)n <= len);
	}
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	static struct credentials credentials;
	const char *text = (const char *)data;
	char problem[128] = "";

	take_answers(text, size);
	take_mark(text, size);
	if (credentials_parse(text, size, &credentials, problem, sizeof(problem)) == 0) {
		require(credentials.id[0] != '\0' && credentials.secret[0] != '\0');
		require(is_plain(credentials.id) || strpbrk(credentials.id, " \t\r\n") == NULL);
	} else {
		require(problem[0] != '\0');
	}
	return 0;
}
