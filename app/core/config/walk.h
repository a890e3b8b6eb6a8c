/* SPDX-License-Identifier: MIT */
/* The walk over the nodes of one YAML document. Private to config/. */
#ifndef CONFIG_WALK_H
#define CONFIG_WALK_H

#include <stddef.h>

#include <yaml.h>

#include "config/option.h"

struct walk {
	const char *name; /* of the file, for messages */
	yaml_document_t *doc;
	struct config *cfg;
	struct option_lines lines;
	const char *const *set; /* assignments over the document */
	size_t set_count;
	const struct config_source *watch;
	size_t problems; /* so far */
	char *error;
	size_t error_bytes;
};

/** The document's options and what is set over them into @walk->cfg, checked. 0, or -EINVAL with
 * the line in @walk->error. */
int walk_document(struct walk *walk);

/** Put "NAME:LINE: key: reason" into @walk->error and report it; without a line, 0, no NAME.
 * Returns -EINVAL. */
int walk_fail(struct walk *walk, int line, const char *key, const char *reason);

/** What is set over the document, in order, and the check of the whole. 0, or -EINVAL with the line
 * in @walk->error. */
int walk_finish(struct walk *walk);

#endif
