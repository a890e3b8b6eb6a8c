/* SPDX-License-Identifier: MIT */
#include "base/xml_text.h"

static const char *entity(char c)
{
	switch (c) {
	case '&':
		return "&amp;";
	case '<':
		return "&lt;";
	case '>':
		return "&gt;";
	case '"':
		return "&quot;";
	case '\'':
		return "&apos;";
	default:
		return NULL;
	}
}

void xml_text_put(FILE *out, const char *text)
{
	for (; *text != '\0'; text++) {
		const char *name = entity(*text);

		if (name != NULL) {
			fputs(name, out);
		} else {
			fputc((unsigned char)*text < 0x20 || *text == 0x7f ? ' ' : *text, out);
		}
	}
}
