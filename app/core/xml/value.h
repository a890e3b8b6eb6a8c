/* SPDX-License-Identifier: MIT */
/* What the XML files of EtherCAT (ESI, ENI) have as text of an element: numbers, octets, names.
 * Context: any. */
#ifndef XML_VALUE_H
#define XML_VALUE_H

#include <stddef.h>
#include <stdint.h>

#include "xml/xml.h"

struct xml_range {
	int64_t min;
	int64_t max;
};

/** HexDecValue of ETG.2000: "#x1F" ("0x1f" as well), or decimal. 0; -EBADMSG with a line that names
 * @what. */
int xml_number(struct xml *xml, const char *what, const char *text, struct xml_range range,
	       int64_t *ret_value);
/** @text in one line, cut to fit, without blanks at its ends. */
void xml_plain(const char *text, char *ret_text, size_t text_bytes);
/**
 * Hexadecimal digits in pairs as octets, at most @limit. *@data is replaced: free() it. 0; -EBADMSG
 * with a line.
 */
int xml_octets(struct xml *xml, const char *text, size_t limit, uint8_t **data, size_t *ret_len);

struct xml_limit {
	size_t rows;
	const char *what;
};

/**
 * @array with one more than @count rows of @bytes, which is zeroed; NULL: refused, with a
 * line unless @xml is NULL. It has room for the next power of two.
 */
void *xml_grow(struct xml *xml, void *array, size_t *count, size_t bytes, struct xml_limit limit);

#endif
