/* SPDX-License-Identifier: MIT */
/*
 * Bytes as an ESI file. Whatever they are: no crash, a refusal is one line FILE:LINE, what is
 * handed over is within its bounds, and written again it is read to the same.
 */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "../memory_file.h"
#include "esi/esi.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { KEPT = 4 };

struct kept {
	struct esi_device *device[KEPT];
	size_t count;
};

static void require(int condition, const char *what)
{
	if (!condition) {
		fprintf(stderr, "fuzz_esi: %s\n", what);
		abort();
	}
}

static int take(void *ctx, struct esi_device *device)
{
	struct kept *kept = ctx;

	if (kept->count == KEPT) {
		esi_device_free(device);
		return 0;
	}
	kept->device[kept->count++] = device;
	return 0;
}

static void release(struct kept *kept)
{
	for (size_t i = 0; i < kept->count; i++) {
		esi_device_free(kept->device[i]);
	}
	kept->count = 0;
}

static void judge_device(const struct esi_device *d)
{
	require(d->pdo_count <= ESI_LIMIT_PDOS && d->entry_count <= ESI_LIMIT_ENTRIES, "PDOs");
	require(d->sm_count <= ESI_LIMIT_SM && d->dc_count <= ESI_LIMIT_DC_MODES, "SMs");
	for (size_t i = 0; i < d->pdo_count; i++) {
		const struct esi_pdo *pdo = &d->pdo[i];
		uint32_t bits = 0;

		require(pdo->first + pdo->count <= d->entry_count, "entries of no PDO");
		for (size_t k = 0; k < pdo->count; k++) {
			bits += d->entry[pdo->first + k].bits;
		}
		require(bits == pdo->bits, "bits of a PDO");
	}
	require(d->object_count <= ESI_LIMIT_OBJECTS, "dictionary");
	for (size_t i = 0; i < d->object_count; i++) {
		require(memchr(d->object[i].unit, 0, sizeof(d->object[i].unit)) != NULL &&
				memchr(d->object[i].name, 0, ESI_NAME_BYTES) != NULL,
			"a text without an end");
	}
	for (size_t i = 0; i < d->command_count; i++) {
		require(d->command[i].len <= ESI_LIMIT_COMMAND_BYTES, "data of a command");
	}
}

/* A writer puts outputs first, and what has no meaning (type of padding) is lost: counts and sums
 * are left. */
static void judge_written(const struct kept *kept)
{
	struct kept again = { .count = 0 };
	const struct esi_visitor visitor = { .device = take, .ctx = &again };
	char error[256] = "";
	char *text = NULL;
	size_t len = 0;
	FILE *out = open_memstream(&text, &len);

	require(out != NULL, "memory");
	for (size_t i = 0; i < kept->count; i++) {
		if (kept->device[i]->id.kind != ESI_DEVICE) {
			fclose(out);
			free(text);
			return;
		}
	}
	esi_write(out, (const struct esi_device *const *)kept->device, kept->count);
	fclose(out);
	require(kept->count == 0 ||
			esi_read("w.xml", text, len, &visitor, error, sizeof(error)) == 0,
		error);
	require(again.count == kept->count, "devices are lost");
	for (size_t i = 0; i < again.count; i++) {
		require(again.device[i]->entry_count == kept->device[i]->entry_count &&
				again.device[i]->pdo_count == kept->device[i]->pdo_count &&
				again.device[i]->command_count == kept->device[i]->command_count &&
				again.device[i]->dc_count == kept->device[i]->dc_count &&
				again.device[i]->id.product == kept->device[i]->id.product &&
				strcmp(again.device[i]->type, kept->device[i]->type) == 0,
			"written and read back, it is another device");
	}
	release(&again);
	free(text);
}

/* A file says what its text says. */
static void judge_file(const uint8_t *data, size_t size, int result, size_t count)
{
	struct kept kept = { .count = 0 };
	const struct esi_visitor visitor = { .device = take, .ctx = &kept };
	char error[256] = "";
	char path[32];
	int fd = memory_file(data, size, path);

	require(esi_read_file(path, &visitor, error, sizeof(error)) == result &&
			kept.count == count,
		"a file is not what its text is");
	release(&kept);
	close(fd);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct kept kept = { .count = 0 };
	const struct esi_visitor visitor = { .device = take, .ctx = &kept };
	char error[256] = "";
	int r = esi_read("f.xml", (const char *)data, size, &visitor, error, sizeof(error));

	if (r < 0) {
		require(strncmp(error, "f.xml:", 6) == 0, "no FILE:LINE");
		require(strpbrk(error, "\n\r") == NULL, "more than one line");
	}
	judge_file(data, size, r, kept.count);
	for (size_t i = 0; i < kept.count; i++) {
		judge_device(kept.device[i]);
	}
	judge_written(&kept);
	release(&kept);
	return 0;
}
