/* SPDX-License-Identifier: MIT */
#include "record/names.h"

#include <stdio.h>
#include <string.h>

/* Words that some generator for IDL, C++ or Python would stumble over. */
static const char *const reserved[] = {
	"abstract",  "alignas",    "alignof",   "and",       "any",      "as",          "asm",
	"assert",    "attribute",  "auto",      "await",     "bitfield", "bitmask",     "bitset",
	"bool",      "boolean",    "break",     "case",      "catch",    "char",        "class",
	"component", "const",      "continue",  "context",   "custom",   "def",         "default",
	"del",       "delete",     "do",        "double",    "elif",     "else",        "enum",
	"event",     "except",     "exception", "explicit",  "export",   "extern",      "factory",
	"false",     "final",      "finally",   "finder",    "fixed",    "float",       "for",
	"friend",    "from",       "getraises", "global",    "goto",     "home",        "if",
	"import",    "in",         "inline",    "inout",     "int",      "interface",   "is",
	"lambda",    "local",      "long",      "manages",   "map",      "mirrorport",  "module",
	"mutable",   "namespace",  "native",    "new",       "none",     "nonlocal",    "not",
	"object",    "octet",      "oneway",    "operator",  "or",       "out",         "pass",
	"port",      "primarykey", "private",   "protected", "provides", "public",      "publishes",
	"raise",     "raises",     "readonly",  "register",  "return",   "sequence",    "setraises",
	"short",     "signed",     "sizeof",    "static",    "string",   "struct",      "supports",
	"switch",    "template",   "this",      "throw",     "true",     "truncatable", "try",
	"typedef",   "typeid",     "typename",  "union",     "unsigned", "uses",        "using",
	"virtual",   "void",       "volatile",  "wchar",     "while",    "with",        "wstring",
	"xor",       "yield",
};

static int is_letter(int c)
{
	return c >= 'a' && c <= 'z';
}

static int is_digit(int c)
{
	return c >= '0' && c <= '9';
}

static int to_lower(int c)
{
	return c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c;
}

void name_make_field(const char *name, char *buf, size_t buf_len)
{
	size_t n = 0;

	for (const char *p = name; *p != '\0' && n + 8 < buf_len; p++) {
		int c = to_lower(*p);

		if (is_digit(c) && n == 0) {
			buf[n++] = 'n';
			buf[n++] = '_';
		}
		if (is_letter(c) || is_digit(c)) {
			buf[n++] = (char)c;
		} else if (n > 0 && buf[n - 1] != '_') {
			buf[n++] = '_';
		}
	}
	while (n > 0 && buf[n - 1] == '_') {
		n--;
	}
	buf[n] = '\0';
	if (n == 0) {
		snprintf(buf, buf_len, "unnamed");
	}
	for (size_t i = 0; i < sizeof(reserved) / sizeof(reserved[0]); i++) {
		if (strcmp(buf, reserved[i]) == 0) {
			snprintf(buf + n, buf_len - n, "_value");
			break;
		}
	}
}

void name_make_type(const char *field_name, char *buf, size_t buf_len)
{
	size_t n = 0;
	int starts_word = 1;

	for (const char *p = field_name; *p != '\0' && n + 1 < buf_len; p++) {
		if (*p == '_') {
			starts_word = 1;
			continue;
		}
		buf[n++] = starts_word && is_letter(*p) ? (char)(*p - 'a' + 'A') : *p;
		starts_word = 0;
	}
	buf[n] = '\0';
}

void name_make_comment(const char *text, char *buf, size_t buf_len)
{
	size_t n = 0;

	for (const char *p = text; *p != '\0' && n + 1 < buf_len; p++) {
		int is_plain = *p >= ' ' && *p <= '~' && *p != '\\';

		buf[n++] = is_plain ? *p : '?';
	}
	buf[n] = '\0';
}
