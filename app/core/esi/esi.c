/* SPDX-License-Identifier: MIT */
#include "esi/esi.h"

#include <stdlib.h>
#include <string.h>

#include "esi/reader.h"
#include "xml/xml.h"

static int begin(void *ctx, struct xml *xml, const char *name, const char **attribute)
{
	struct esi_reader *rd = ctx;
	enum esi_node node = esi_node_find(rd->node[rd->depth], name);
	const char *language = xml_attribute(attribute, "LcId");

	rd->xml = xml;
	if (rd->depth == 0 && node == ESI_NODE_OTHER) {
		return xml_fail(xml, "no ESI: <%.40s> instead of <EtherCATInfo>", name);
	}
	rd->node[++rd->depth] = node;
	rd->is_name_preferred = language != NULL && strcmp(language, "1033") == 0;
	return esi_begin(rd, node, attribute);
}

static int end(void *ctx, struct xml *xml, const char *name, const char *text)
{
	struct esi_reader *rd = ctx;
	enum esi_node node = rd->node[rd->depth--];

	rd->xml = xml;
	return esi_end(rd, node, name, text);
}

static struct xml_handler begin_reading(struct esi_reader *rd, const struct esi_visitor *visitor)
{
	*rd = (struct esi_reader){ .visitor = visitor, .node = { ESI_NODE_ROOT } };
	return (struct xml_handler){ .begin = begin, .end = end, .ctx = rd };
}

static void end_reading(struct esi_reader *rd)
{
	esi_forget(rd);
	esi_dictionary_free(&rd->dictionary);
	free(rd->group);
}

int esi_read_file(const char *path, const struct esi_visitor *visitor, char *error,
		  size_t error_bytes)
{
	struct esi_reader rd;
	struct xml_handler handler = begin_reading(&rd, visitor);
	int r = xml_read_file(path, &handler, error, error_bytes);

	end_reading(&rd);
	return r;
}

int esi_read(const char *name, const char *text, size_t len, const struct esi_visitor *visitor,
	     char *error, size_t error_bytes)
{
	struct esi_reader rd;
	struct xml_handler handler = begin_reading(&rd, visitor);
	int r = xml_read(name, text, len, &handler, error, error_bytes);

	end_reading(&rd);
	return r;
}
