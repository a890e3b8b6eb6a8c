/* SPDX-License-Identifier: MIT */
/* What the files of esi/ that read share. Context: blocking. */
#ifndef ESI_READER_H
#define ESI_READER_H

#include <stddef.h>
#include <stdint.h>

#include "esi/device.h"
#include "esi/dictionary.h"
#include "esi/nodes.h"
#include "xml/xml.h"

struct esi_group {
	char type[ESI_NAME_BYTES];
	char name[ESI_NAME_BYTES];
};

struct esi_reader {
	const struct esi_visitor *visitor;
	struct xml *xml;
	int depth;
	enum esi_node node[XML_LIMIT_DEPTH + 1]; /* [0]: the document */
	int device_depth;
	int is_name_preferred; /* language of the name that is being read */
	uint32_t vendor;
	char vendor_name[ESI_NAME_BYTES];
	struct esi_group *group;
	size_t group_count;
	size_t device_count;
	struct esi_device *device; /* that is being read; NULL */
	struct esi_dictionary dictionary;
};

/** An element begins: @node, with what it makes of the device. 0 or -errno with a line. */
int esi_begin(struct esi_reader *rd, enum esi_node node, const char **attribute);
/** It ends. */
int esi_end(struct esi_reader *rd, enum esi_node node, const char *name, const char *text);
/** Free the device that is being read. */
void esi_forget(struct esi_reader *rd);

#endif
