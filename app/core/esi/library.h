/* SPDX-License-Identifier: MIT */
/* A folder of ESI files: what it says of the devices that are looked for. Context: blocking. */
#ifndef ESI_LIBRARY_H
#define ESI_LIBRARY_H

#include <stddef.h>
#include <stdint.h>

#include "esi/device.h"

enum { ESI_LIMIT_FILES = 4096 };

struct esi_library;

struct esi_library_report {
	/* A file, or the folder, that could not be read in full: one line. May be NULL. */
	void (*bad)(void *ctx, const char *text);
	void *ctx;
};

/**
 * Read the files *.xml of folder @dir (not of those in it), by name, for the devices and modules
 * @wanted; of each the description of its revision, or of the newest before it, or of the oldest of
 * all. Where several files have it, the first. What cannot be read is reported and passed over.
 * NULL: out of memory. Free with esi_library_free().
 */
struct esi_library *esi_library_read(const char *dir, const struct esi_identity *wanted,
				     size_t wanted_count, const struct esi_library_report *report);
/** NULL is fine. */
void esi_library_free(struct esi_library *library);

/** The description of one of the devices that were wanted; NULL: none. */
const struct esi_device *esi_library_find(const struct esi_library *library, uint32_t vendor,
					  uint32_t product, uint32_t revision);
/** The same of one of the modules. */
const struct esi_device *esi_library_find_module(const struct esi_library *library, uint32_t vendor,
						 uint32_t ident);

/**
 * Call @each with the path of each *.xml of folder @dir, by name, until it returns an error. 0; its
 * error; -errno of the folder; -E2BIG: more than ESI_LIMIT_FILES.
 */
int esi_library_each_file(const char *dir, int (*each)(void *ctx, const char *path), void *ctx);

#endif
