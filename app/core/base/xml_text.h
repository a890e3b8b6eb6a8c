/* SPDX-License-Identifier: MIT */
/* Text as the content of an XML element or of an attribute. */
#ifndef BASE_XML_TEXT_H
#define BASE_XML_TEXT_H

#include <stdio.h>

/** Print @text with the five predefined entities (XML 1.0, 4.6). A control character, which XML
 * cannot hold at all, becomes a blank. Context: any that may use stdio. */
void xml_text_put(FILE *out, const char *text);

#endif
