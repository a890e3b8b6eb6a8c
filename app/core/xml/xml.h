/* SPDX-License-Identifier: MIT */
/*
 * XML from anywhere, element by element, by libexpat. Refused: a document type declaration (so
 * there are no entities but the five of XML), more than XML_LIMIT_DEPTH levels, a tag of more than
 * XML_LIMIT_TOKEN_BYTES, and whatever needs more than XML_LIMIT_MEMORY_BYTES to read. Context:
 * blocking; one parser a thread.
 */
#ifndef XML_XML_H
#define XML_XML_H

#include <stddef.h>

enum xml_limits {
	XML_LIMIT_DEPTH = 32,
	XML_LIMIT_TEXT_BYTES = 8192, /* of an element, as it is handed over; more is cut */
	XML_LIMIT_TOKEN_BYTES = 1 << 20,
	XML_LIMIT_MEMORY_BYTES = 32 << 20, /* of the parser itself */
	XML_LIMIT_FILE_BYTES = 256 << 20,
};

struct xml;

/* Either ends the reading with xml_fail(), or another -errno. */
struct xml_handler {
	/* @attribute: names and values in turn, then NULL. UTF-8. */
	int (*begin)(void *ctx, struct xml *xml, const char *name, const char **attribute);
	/* @text: what stands in the element beside others, without blanks at its ends. */
	int (*end)(void *ctx, struct xml *xml, const char *name, const char *text);
	void *ctx;
};

/** The value of attribute @name; NULL: it is not there. */
const char *xml_attribute(const char **attribute, const char *name);
/** Line of what is being read, from 1. */
int xml_line(const struct xml *xml);
/** "FILE:LINE: " and the text. Returns -EBADMSG. */
int xml_fail(struct xml *xml, const char *format, ...) __attribute__((format(printf, 2, 3)));

/**
 * Read @text; @name stands in front of an error. 0; -EBADMSG, -ENOMEM or what the handler gave,
 * with one line in @error.
 */
int xml_read(const char *name, const char *text, size_t len, const struct xml_handler *handler,
	     char *error, size_t error_bytes);
/** The same of a regular file. Also -errno of opening and reading it. */
int xml_read_file(const char *path, const struct xml_handler *handler, char *error,
		  size_t error_bytes);

#endif
