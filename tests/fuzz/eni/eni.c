/* SPDX-License-Identifier: MIT */
/*
 * Bytes as an ENI file, and behind a zero byte as another one. Whatever they are: no crash, a
 * refusal is one line FILE:LINE, what is handed over is within its bounds, written and read back it
 * is the same, compared with itself it has no difference, and each difference from the other one is
 * of something.
 */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "../memory_file.h"
#include "eni/compare.h"
#include "eni/eni.h"
#include "eni/mapping.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void require(int condition, const char *what)
{
	if (!condition) {
		fprintf(stderr, "fuzz_eni: %s\n", what);
		abort();
	}
}

static void judge(const struct eni *eni)
{
	size_t entries = 0;

	require(eni->slave_count <= ENI_LIMIT_SLAVES && eni->note_count <= ENI_LIMIT_NOTES, "rows");
	for (size_t i = 0; i < eni->pdo_count; i++) {
		require(eni->pdo[i].slave < eni->slave_count, "a PDO of no slave");
		require(eni->pdo[i].first == entries, "entries of no PDO");
		entries += eni->pdo[i].count;
	}
	require(entries == eni->entry_count, "entries of no PDO");
	for (size_t i = 0; i < eni->init_count; i++) {
		require(eni->init[i].owner == ENI_MASTER || eni->init[i].owner < eni->slave_count,
			"a command of no slave");
		require(eni->init[i].data.len <= ENI_LIMIT_OCTETS, "data of a command");
	}
	for (size_t i = 0; i < eni->cmd_count; i++) {
		require(eni->cmd[i].owner < eni->frame_count, "a datagram of no frame");
	}
	for (size_t i = 0; i < eni->variable_count; i++) {
		const struct eni_entry *entry = NULL;
		uint32_t slave = 0;

		if (eni_variable_entry(eni, &eni->variable[i], &slave, &entry) == 0) {
			require(slave < eni->slave_count && entry->index != 0, "a variable");
		}
	}
}

static char *written(const struct eni *eni, size_t *ret_len)
{
	char *text = NULL;
	FILE *out = open_memstream(&text, ret_len);

	require(out != NULL, "memory");
	eni_write(out, eni);
	require(fclose(out) == 0, "memory");
	return text;
}

/* Frames without a cyclic task, and lists in another order, are in another place when written: it
 * is the second writing that must be the first one's. */
static void judge_written(const struct eni *eni)
{
	char error[256] = "";
	struct eni *again = NULL;
	size_t len = 0;
	size_t second_len = 0;
	char *first = written(eni, &len);
	char *second;

	require(eni_read("w.xml", first, len, &again, error, sizeof(error)) == 0, error);
	second = written(again, &second_len);
	require(len == second_len && memcmp(first, second, len) == 0,
		"written and read back, it is another plan");
	eni_free(again);
	free(first);
	free(second);
}

/* --- compared --- */

static void refuse(void *ctx, const struct eni_difference *difference)
{
	(void)ctx;
	require(0, difference->what);
}

static void look(void *ctx, const struct eni_difference *difference)
{
	const size_t *slaves = ctx;

	require(difference->slave == ENI_MASTER || difference->slave < *slaves,
		"a difference of no slave");
	require(difference->what[0] != '\0', "a difference of nothing");
	require(strnlen(difference->theirs, ENI_TEXT_BYTES) < ENI_TEXT_BYTES &&
			strnlen(difference->ours, ENI_TEXT_BYTES) < ENI_TEXT_BYTES,
		"a text without an end");
}

static void compare(const struct eni *theirs, const struct eni *ours)
{
	size_t slaves =
		theirs->slave_count > ours->slave_count ? theirs->slave_count : ours->slave_count;
	const struct eni_compare c = {
		.theirs = theirs, .ours = ours, .found = look, .ctx = &slaves
	};

	eni_compare_all(&c);
}

static struct eni *read_one(const uint8_t *data, size_t size)
{
	char error[256] = "";
	struct eni *eni = NULL;

	if (eni_read("f.xml", (const char *)data, size, &eni, error, sizeof(error)) < 0) {
		require(strncmp(error, "f.xml:", 6) == 0, "no FILE:LINE");
		require(strpbrk(error, "\n\r") == NULL, "more than one line");
		return NULL;
	}
	return eni;
}

/* A file says what its text says. */
static void judge_file(const uint8_t *data, size_t size, const struct eni *eni)
{
	char path[32];
	char error[256] = "";
	struct eni *again = NULL;
	int fd = memory_file(data, size, path);
	int r = eni_read_file(path, &again, error, sizeof(error));

	require((r == 0) == (eni != NULL), "a file is not what its text is");
	if (r < 0) {
		require(strncmp(error, path, strlen(path)) == 0, "no FILE:LINE");
	} else {
		const struct eni_compare c = { .theirs = again, .ours = eni, .found = refuse };

		eni_compare_all(&c);
	}
	eni_free(again);
	close(fd);
}

static void judge_all(const uint8_t *data, size_t size, const struct eni *eni)
{
	judge_file(data, size, eni);
	if (eni != NULL) {
		const struct eni_compare c = { .theirs = eni, .ours = eni, .found = refuse };

		judge(eni);
		judge_written(eni);
		eni_compare_all(&c);
	}
}

/* Behind a zero byte there is a second plan, with which the first one is compared. */
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	const uint8_t *zero = size == 0 ? NULL : memchr(data, 0, size);
	size_t first = zero == NULL ? size : (size_t)(zero - data);
	struct eni *eni = read_one(data, first);

	judge_all(data, first, eni);
	if (zero != NULL && eni != NULL) {
		struct eni *second = read_one(zero + 1, size - first - 1);

		if (second != NULL) {
			compare(eni, second);
			compare(second, eni);
		}
		eni_free(second);
	}
	eni_free(eni);
	return 0;
}
