/* SPDX-License-Identifier: MIT */
#include "esi/library.h"

#include <dirent.h>
#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "esi/esi.h"

struct place {
	struct esi_identity wanted;
	struct esi_device *device; /* NULL: none yet */
};

struct esi_library {
	const struct esi_library_report *report;
	size_t place_count;
	struct place place[];
};

/* --- which one fits best --- */

/* Whether revision @other describes a device of revision @wanted better than @now does. */
static int is_better(uint32_t wanted, uint32_t now, uint32_t other)
{
	if (now <= wanted) {
		return other <= wanted && other > now;
	}
	return other < now;
}

static int is_improved(const struct place *place, const struct esi_identity *id)
{
	return place->wanted.kind == id->kind && place->wanted.vendor == id->vendor &&
	       place->wanted.product == id->product &&
	       (place->device == NULL ||
		is_better(place->wanted.revision, place->device->id.revision, id->revision));
}

static int is_wanted(void *ctx, const struct esi_identity *id)
{
	const struct esi_library *library = ctx;

	for (size_t i = 0; i < library->place_count; i++) {
		if (is_improved(&library->place[i], id)) {
			return 1;
		}
	}
	return 0;
}

/* Revisions of one product may share a description. */
static void drop(struct esi_library *library, size_t i)
{
	struct esi_device *device = library->place[i].device;

	library->place[i].device = NULL;
	for (size_t k = 0; k < library->place_count && device != NULL; k++) {
		if (library->place[k].device == device) {
			return;
		}
	}
	esi_device_free(device);
}

static int take(void *ctx, struct esi_device *device)
{
	struct esi_library *library = ctx;
	int is_taken = 0;

	for (size_t i = 0; i < library->place_count; i++) {
		if (is_improved(&library->place[i], &device->id)) {
			drop(library, i);
			library->place[i].device = device;
			is_taken = 1;
		}
	}
	if (!is_taken) {
		esi_device_free(device);
	}
	return 0;
}

/* --- files --- */

static int is_xml(const struct dirent *entry)
{
	const char *end = strrchr(entry->d_name, '.');

	return end != NULL && end != entry->d_name && strcasecmp(end, ".xml") == 0;
}

static int by_name(const struct dirent **a, const struct dirent **b)
{
	return strcmp((*a)->d_name, (*b)->d_name);
}

int esi_library_each_file(const char *dir, int (*each)(void *ctx, const char *path), void *ctx)
{
	struct dirent **entry;
	int count = scandir(dir, &entry, is_xml, by_name);
	int r = count > ESI_LIMIT_FILES ? -E2BIG : 0;

	if (count < 0) {
		return -errno;
	}
	for (int i = 0; i < count; i++) {
		char path[PATH_MAX];

		if (r == 0 && snprintf(path, sizeof(path), "%s/%s", dir, entry[i]->d_name) <
				      (int)sizeof(path)) {
			r = each(ctx, path);
		}
		free(entry[i]);
	}
	free(entry);
	return r;
}

static void pass_on(const struct esi_library *library, const char *text)
{
	if (library->report != NULL && library->report->bad != NULL) {
		library->report->bad(library->report->ctx, text);
	}
}

static int read_one(void *ctx, const char *path)
{
	struct esi_library *library = ctx;
	const struct esi_visitor visitor = { .select = is_wanted, .device = take, .ctx = library };
	char error[512];

	if (esi_read_file(path, &visitor, error, sizeof(error)) < 0) {
		pass_on(library, error);
	}
	return 0;
}

/* --- public --- */

static const struct place *find(const struct esi_library *library, const struct esi_identity *id)
{
	for (size_t i = 0; library != NULL && i < library->place_count; i++) {
		const struct esi_identity *other = &library->place[i].wanted;

		if (other->kind == id->kind && other->vendor == id->vendor &&
		    other->product == id->product && other->revision == id->revision) {
			return &library->place[i];
		}
	}
	return NULL;
}

struct esi_library *esi_library_read(const char *dir, const struct esi_identity *wanted,
				     size_t wanted_count, const struct esi_library_report *report)
{
	struct esi_library *library =
		calloc(1, sizeof(*library) + wanted_count * sizeof(library->place[0]));
	int r;

	if (library == NULL) {
		return NULL;
	}
	library->report = report;
	for (size_t i = 0; i < wanted_count; i++) {
		if (find(library, &wanted[i]) == NULL) {
			library->place[library->place_count++].wanted = wanted[i];
		}
	}
	r = esi_library_each_file(dir, read_one, library);
	if (r < 0) {
		char text[512];

		snprintf(text, sizeof(text), "%.400s: %s", dir,
			 r == -E2BIG ? "more ESI files than ESI_LIMIT_FILES (4096)" : strerror(-r));
		pass_on(library, text);
	}
	library->report = NULL;
	return library;
}

void esi_library_free(struct esi_library *library)
{
	for (size_t i = 0; library != NULL && i < library->place_count; i++) {
		drop(library, i);
	}
	free(library);
}

const struct esi_device *esi_library_find(const struct esi_library *library, uint32_t vendor,
					  uint32_t product, uint32_t revision)
{
	const struct esi_identity id = { ESI_DEVICE, vendor, product, revision };
	const struct place *place = find(library, &id);

	return place == NULL ? NULL : place->device;
}

const struct esi_device *esi_library_find_module(const struct esi_library *library, uint32_t vendor,
						 uint32_t ident)
{
	const struct esi_identity id = { ESI_MODULE, vendor, ident, 0 };
	const struct place *place = find(library, &id);

	return place == NULL ? NULL : place->device;
}
