/* SPDX-License-Identifier: MIT */
#include "cli/fit.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

enum { INDENT_MAX = 60 };

/* Bytes of the colour at the start of @text; 0: there is none. */
static size_t colour_len(const char *text, size_t len)
{
	size_t i = 2;

	if (len < 3 || text[0] != '\033' || text[1] != '[') {
		return 0;
	}
	while (i < len && ((text[i] >= '0' && text[i] <= '9') || text[i] == ';')) {
		i++;
	}
	return i < len && text[i] == 'm' ? i + 1 : 0;
}

size_t fit_cut(const char *line, size_t len, int columns)
{
	size_t i = 0;
	int used = 0;

	while (i < len) {
		size_t colour = colour_len(line + i, len - i);
		int is_start = ((unsigned char)line[i] & 0xc0) != 0x80;

		if (colour > 0) {
			i += colour;
			continue;
		}
		if (is_start && used == columns) {
			break;
		}
		used += is_start;
		i++;
	}
	return i;
}

int fit_width(const char *line)
{
	size_t len = strcspn(line, "\n");
	int width = 0;

	for (size_t i = 0; i < len;) {
		size_t colour = colour_len(line + i, len - i);

		width += colour == 0 && ((unsigned char)line[i] & 0xc0) != 0x80;
		i += colour > 0 ? colour : 1;
	}
	return width;
}

/*
 * Where to break @line, of which @fits bytes fit: behind what is shown (ret_next: where the rest
 * begins). Not in the blanks that it begins with.
 */
static size_t find_break(const char *line, size_t len, size_t fits, size_t *ret_next)
{
	size_t lead = strspn(line, " ");
	size_t field = 0;
	size_t word = 0;
	size_t end;

	for (size_t i = lead; i < len && i <= fits; i++) {
		if (line[i] == ' ') {
			word = line[i - 1] != ' ' ? i : word;
			field = i + 1 < len && line[i + 1] == ' ' && line[i - 1] != ' ' ? i : field;
		}
	}
	/* A label and its first field belong together, unless there is only this separation. */
	end = field > lead + fits / 3 ? field : word > lead ? word : fits;
	*ret_next = end + strspn(line + end, " ");
	*ret_next = *ret_next > len ? len : *ret_next;
	return end;
}

void fit_write_line(const char *line, size_t len, int columns, const char *prefix, FILE *out)
{
	int lead = (int)strlen(prefix);
	size_t fits = columns <= 0 ? len : fit_cut(line, len, columns);

	while (fits < len) {
		size_t next;
		size_t end = find_break(line, len, fits, &next);

		fwrite(line, 1, end, out);
		fputc('\n', out);
		line += next;
		len -= next;
		if (len == 0) {
			return;
		}
		fputs(prefix, out);
		fits = fit_cut(line, len, columns > lead ? columns - lead : 1);
	}
	fwrite(line, 1, len, out);
	fputc('\n', out);
}

void fit_write(const char *text, int columns, int indent, FILE *out)
{
	char blanks[INDENT_MAX + 1];

	if (columns <= 0) {
		fputs(text, out);
		return;
	}
	indent = indent > columns / 2 ? columns / 2 : indent;
	indent = indent > INDENT_MAX ? INDENT_MAX : indent;
	memset(blanks, ' ', (size_t)indent);
	blanks[indent] = '\0';
	while (*text != '\0') {
		size_t len = strcspn(text, "\n");

		fit_write_line(text, len, columns, blanks, out);
		text += len + (text[len] == '\n');
	}
}

FILE *fit_begin(struct fit *fit, int columns, FILE *to)
{
	*fit = (struct fit){ .columns = columns, .to = to };
	fit->text_out = columns <= 0 ? NULL : open_memstream(&fit->text, &fit->len);
	return fit->text_out != NULL ? fit->text_out : to;
}

void fit_end(struct fit *fit, int indent)
{
	if (fit->text_out != NULL && fclose(fit->text_out) == 0) {
		fit_write(fit->text, fit->columns, indent, fit->to);
	}
	free(fit->text);
}

const char *fit_name(const char *name, int columns, char *buf, size_t buf_len)
{
	int len = (int)strlen(name);
	int head = columns / 2;
	int tail = columns - head - 1;

	if (len <= columns) {
		snprintf(buf, buf_len, "%s", name);
	} else {
		snprintf(buf, buf_len, "%.*s~%s", head, name, name + len - (tail < 0 ? 0 : tail));
	}
	return buf;
}

const char *fit_count(uint64_t count, int columns, char *buf, size_t buf_len)
{
	static const char prefixes[] = "kMGTPE";
	double value = (double)count / 1000;
	size_t prefix = 0;

	if (snprintf(buf, buf_len, "%" PRIu64, count) <= columns || count < 1000) {
		return buf;
	}
	while (value >= 999.5) {
		value /= 1000;
		prefix++;
	}
	snprintf(buf, buf_len, "%.*f%c",
		 value < 9.995   ? 2
		 : value < 99.95 ? 1
				 : 0,
		 value, prefixes[prefix]);
	return buf;
}
