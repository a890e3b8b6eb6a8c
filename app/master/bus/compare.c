/* SPDX-License-Identifier: MIT */
#include "bus/compare.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

struct text {
	char *buf;
	size_t bytes;
	size_t used;
};

static void append(struct text *text, const char *format, ...)
	__attribute__((format(printf, 2, 3)));

static void append(struct text *text, const char *format, ...)
{
	va_list args;
	int r;

	va_start(args, format);
	r = vsnprintf(text->buf + text->used, text->bytes - text->used, format, args);
	va_end(args);
	if (r > 0) {
		text->used += (size_t)r < text->bytes - text->used ? (size_t)r
								   : text->bytes - text->used - 1;
	}
}

/* "vendor 0x00000002 product 0x04570862 revision any" */
static void append_wanted(struct text *text, const struct config_slave *want)
{
	const struct {
		const char *name;
		uint32_t value;
	} part[] = { { "vendor", want->vendor },
		     { "product", want->product },
		     { "revision", want->revision } };

	for (size_t i = 0; i < sizeof(part) / sizeof(part[0]); i++) {
		if (part[i].value != 0) {
			append(text, "%s%s 0x%08x", i > 0 ? " " : "", part[i].name, part[i].value);
		} else {
			append(text, "%s%s any", i > 0 ? " " : "", part[i].name);
		}
	}
	if (want->alias != 0) {
		append(text, " alias %u", want->alias);
	}
}

static void append_found(struct text *text, const struct slave_info *found, int is_alias_wanted)
{
	append(text, "vendor 0x%08x product 0x%08x revision 0x%08x", found->vendor, found->product,
	       found->revision);
	if (is_alias_wanted) {
		append(text, " alias %u", found->alias);
	}
	if (found->device[0] != '\0') {
		append(text, " (%s)", found->device);
	}
}

static int is_wanted(const struct config_slave *want, const struct slave_info *found)
{
	return (want->vendor == 0 || want->vendor == found->vendor) &&
	       (want->product == 0 || want->product == found->product) &&
	       (want->revision == 0 || want->revision == found->revision) &&
	       (want->alias == 0 || want->alias == found->alias);
}

int compare_slaves(const struct config *cfg, const struct slave_info *found, size_t found_count,
		   char *error, size_t error_bytes)
{
	struct text text = { .buf = error, .bytes = error_bytes };

	for (size_t i = 0; i < cfg->slave_count; i++) {
		const struct config_slave *want = &cfg->slave[i];

		if (i >= found_count) {
			append(&text,
			       "slave %zu%s%s is missing: %zu found, %zu expected; expected ", i,
			       want->name[0] != '\0' ? " " : "", want->name, found_count,
			       cfg->slave_count);
			append_wanted(&text, want);
			return -ENXIO;
		}
		if (!is_wanted(want, &found[i])) {
			append(&text, "slave %zu: wrong identity: expected ", i);
			append_wanted(&text, want);
			append(&text, ", found ");
			append_found(&text, &found[i], want->alias != 0);
			return -ENXIO;
		}
	}
	if (cfg->bus_presence == CONFIG_EXACT_SLAVES && found_count > cfg->slave_count) {
		append(&text, "slave %zu is unexpected: %zu found, %zu expected; found ",
		       cfg->slave_count, found_count, cfg->slave_count);
		append_found(&text, &found[cfg->slave_count], 0);
		return -ENXIO;
	}
	return 0;
}
