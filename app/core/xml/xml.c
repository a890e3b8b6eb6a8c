/* SPDX-License-Identifier: MIT */
#include "xml/xml.h"

#include <errno.h>
#include <expat.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { CHUNK_BYTES = 1 << 16 };

struct xml {
	XML_Parser parser;
	const struct xml_handler *handler;
	const char *file;
	char *error;
	size_t error_bytes;
	int result; /* of the first failure */
	int depth;
	int64_t fed;
	int64_t seen; /* byte of the newest token */
	size_t text_len;
	char text[XML_LIMIT_TEXT_BYTES];
};

/* --- memory: expat keeps every name that it has met --- */

union block {
	size_t bytes;
	max_align_t align;
};

static _Thread_local size_t allocated;

static void *limited_realloc(void *old, size_t bytes)
{
	union block *block = old == NULL ? NULL : (union block *)old - 1;
	size_t before = block == NULL ? 0 : block->bytes;
	union block *grown;

	if (bytes > XML_LIMIT_MEMORY_BYTES || allocated - before + bytes > XML_LIMIT_MEMORY_BYTES) {
		return NULL;
	}
	grown = realloc(block, sizeof(*block) + bytes);
	if (grown == NULL) {
		return NULL;
	}
	allocated += bytes - before;
	grown->bytes = bytes;
	return grown + 1;
}

static void *limited_malloc(size_t bytes)
{
	return limited_realloc(NULL, bytes);
}

static void limited_free(void *old)
{
	if (old != NULL) {
		union block *block = (union block *)old - 1;

		allocated -= block->bytes;
		free(block);
	}
}

/* --- where it is --- */

/* Expat 2.9 has both functions under new names, and calls the old ones deprecated. */
#if XML_MAJOR_VERSION > 2 || XML_MINOR_VERSION >= 9
static int64_t line_of(XML_Parser parser)
{
	return (int64_t)XML_GetCurrentLineNumber64(parser);
}

static int64_t byte_of(XML_Parser parser)
{
	return XML_GetCurrentByteIndex64(parser);
}
#else
static int64_t line_of(XML_Parser parser)
{
	return (int64_t)XML_GetCurrentLineNumber(parser);
}

static int64_t byte_of(XML_Parser parser)
{
	return XML_GetCurrentByteIndex(parser);
}
#endif

/* --- failures --- */

int xml_line(const struct xml *xml)
{
	return (int)line_of(xml->parser);
}

int xml_fail(struct xml *xml, const char *format, ...)
{
	char text[256];
	va_list args;

	va_start(args, format);
	vsnprintf(text, sizeof(text), format, args);
	va_end(args);
	for (char *p = text; *p != '\0'; p++) {
		if ((unsigned char)*p < 0x20 || *p == 0x7f) {
			*p = '?';
		}
	}
	snprintf(xml->error, xml->error_bytes, "%s:%d: %s", xml->file, xml_line(xml), text);
	return -EBADMSG;
}

static void stop(struct xml *xml, int result)
{
	if (xml->result == 0 && result < 0) {
		xml->result = result;
		XML_StopParser(xml->parser, XML_FALSE);
	}
}

/* --- what expat calls --- */

static void note_token(struct xml *xml)
{
	xml->seen = byte_of(xml->parser);
}

static void XMLCALL on_begin(void *ctx, const XML_Char *name, const XML_Char **attribute)
{
	struct xml *xml = ctx;

	if (xml->result < 0) {
		return;
	}
	note_token(xml);
	xml->text_len = 0;
	if (++xml->depth > XML_LIMIT_DEPTH) {
		stop(xml, xml_fail(xml, "more than %d levels of elements", XML_LIMIT_DEPTH));
		return;
	}
	stop(xml, xml->handler->begin(xml->handler->ctx, xml, name, attribute));
}

static char *trim(struct xml *xml)
{
	char *text = xml->text;
	size_t len = xml->text_len;

	while (len > 0 && strchr(" \t\r\n", text[len - 1]) != NULL) {
		len--;
	}
	text[len] = '\0';
	return text + strspn(text, " \t\r\n");
}

static void XMLCALL on_end(void *ctx, const XML_Char *name)
{
	struct xml *xml = ctx;

	if (xml->result < 0) {
		return;
	}
	note_token(xml);
	xml->depth--;
	stop(xml, xml->handler->end(xml->handler->ctx, xml, name, trim(xml)));
	xml->text_len = 0;
}

static void XMLCALL on_text(void *ctx, const XML_Char *text, int len)
{
	struct xml *xml = ctx;
	size_t room = sizeof(xml->text) - 1 - xml->text_len;
	size_t taken = (size_t)len < room ? (size_t)len : room;

	note_token(xml);
	memcpy(xml->text + xml->text_len, text, taken);
	xml->text_len += taken;
}

/* Comments, processing instructions, the declaration. */
static void XMLCALL on_other(void *ctx, const XML_Char *text, int len)
{
	(void)text;
	(void)len;
	note_token(ctx);
}

static void XMLCALL on_doctype(void *ctx, const XML_Char *name, const XML_Char *system_id,
			       const XML_Char *public_id, int has_internal_subset)
{
	struct xml *xml = ctx;

	(void)name;
	(void)system_id;
	(void)public_id;
	(void)has_internal_subset;
	stop(xml, xml_fail(xml, "a document type declaration (<!DOCTYPE) is not accepted"));
}

/* --- reading --- */

static int begin_reading(struct xml *xml)
{
	const XML_Memory_Handling_Suite memory = { limited_malloc, limited_realloc, limited_free };

	xml->parser = XML_ParserCreate_MM(NULL, &memory, NULL);
	if (xml->parser == NULL) {
		snprintf(xml->error, xml->error_bytes, "%s: out of memory", xml->file);
		return -ENOMEM;
	}
	XML_SetUserData(xml->parser, xml);
	XML_SetElementHandler(xml->parser, on_begin, on_end);
	XML_SetCharacterDataHandler(xml->parser, on_text);
	XML_SetDefaultHandler(xml->parser, on_other);
	XML_SetStartDoctypeDeclHandler(xml->parser, on_doctype);
	return 0;
}

static int explain(struct xml *xml)
{
	enum XML_Error code = XML_GetErrorCode(xml->parser);

	if (xml->result < 0) {
		if (xml->error[0] == '\0') {
			xml_fail(xml, "%s", strerror(-xml->result));
		}
		return xml->result;
	}
	if (code == XML_ERROR_NO_MEMORY) {
		xml_fail(xml, "needs more than %d MiB to be read", XML_LIMIT_MEMORY_BYTES >> 20);
		return -ENOMEM;
	}
	return xml_fail(xml, "no XML: %s", XML_ErrorString(code));
}

/* An unfinished token is looked at again with each piece: it is not allowed to grow for long. */
static int feed(struct xml *xml, const char *text, size_t len, int is_last)
{
	if (XML_Parse(xml->parser, text, (int)len, is_last) != XML_STATUS_OK) {
		return explain(xml);
	}
	xml->fed += (int64_t)len;
	if (xml->fed - xml->seen > XML_LIMIT_TOKEN_BYTES + CHUNK_BYTES) {
		return xml_fail(xml, "a tag or comment of more than %d bytes",
				XML_LIMIT_TOKEN_BYTES);
	}
	return 0;
}

static void end_reading(struct xml *xml)
{
	XML_ParserFree(xml->parser);
	free(xml);
}

static struct xml *create(const char *file, const struct xml_handler *handler, char *error,
			  size_t error_bytes)
{
	struct xml *xml = calloc(1, sizeof(*xml));

	error[0] = '\0';
	if (xml != NULL) {
		xml->handler = handler;
		xml->file = file;
		xml->error = error;
		xml->error_bytes = error_bytes;
		if (begin_reading(xml) == 0) {
			return xml;
		}
	}
	snprintf(error, error_bytes, "%s: out of memory", file);
	free(xml);
	return NULL;
}

int xml_read(const char *name, const char *text, size_t len, const struct xml_handler *handler,
	     char *error, size_t error_bytes)
{
	struct xml *xml = create(name, handler, error, error_bytes);
	size_t at = 0;
	int r = 0;

	if (xml == NULL) {
		return -ENOMEM;
	}
	do {
		size_t piece = len - at < CHUNK_BYTES ? len - at : CHUNK_BYTES;

		r = feed(xml, text + at, piece, at + piece == len);
		at += piece;
	} while (r == 0 && at < len);
	end_reading(xml);
	return r;
}

static int read_descriptor(struct xml *xml, int fd)
{
	char chunk[CHUNK_BYTES];
	int r = 0;

	while (r == 0) {
		ssize_t len = read(fd, chunk, sizeof(chunk));

		if (len < 0 && errno == EINTR) {
			continue;
		}
		if (len < 0) {
			r = -errno;
			snprintf(xml->error, xml->error_bytes, "%s: %s", xml->file, strerror(-r));
			return r;
		}
		if (xml->fed + len > XML_LIMIT_FILE_BYTES) {
			return xml_fail(xml, "more than %d MiB", XML_LIMIT_FILE_BYTES >> 20);
		}
		r = feed(xml, chunk, (size_t)len, len == 0);
		if (len == 0) {
			break;
		}
	}
	return r;
}

/* Not blocked by a pipe of that name. */
static int open_regular(const char *path, int *ret_fd)
{
	int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
	struct stat st;

	if (fd < 0) {
		return -errno;
	}
	if (fstat(fd, &st) < 0 || !S_ISREG(st.st_mode)) {
		close(fd);
		return -EINVAL;
	}
	*ret_fd = fd;
	return 0;
}

int xml_read_file(const char *path, const struct xml_handler *handler, char *error,
		  size_t error_bytes)
{
	struct xml *xml;
	int fd = -1;
	int r = open_regular(path, &fd);

	if (r < 0) {
		snprintf(error, error_bytes, "%s: %s", path,
			 r == -EINVAL ? "not a regular file" : strerror(-r));
		return r;
	}
	xml = create(path, handler, error, error_bytes);
	if (xml == NULL) {
		close(fd);
		return -ENOMEM;
	}
	r = read_descriptor(xml, fd);
	close(fd);
	end_reading(xml);
	return r;
}

const char *xml_attribute(const char **attribute, const char *name)
{
	for (size_t i = 0; attribute[i] != NULL; i += 2) {
		if (strcmp(attribute[i], name) == 0) {
			return attribute[i + 1];
		}
	}
	return NULL;
}
