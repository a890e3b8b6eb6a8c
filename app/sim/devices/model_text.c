/* SPDX-License-Identifier: MIT */
#include "devices/model_text.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int parse_fail(struct parse *p, const char *format, ...)
{
	va_list arguments;
	int n = snprintf(p->error, p->error_bytes, "%s.txt:%u: ", p->m->name, p->line);

	if (n >= 0 && (size_t)n < p->error_bytes) {
		va_start(arguments, format);
		vsnprintf(p->error + n, p->error_bytes - (size_t)n, format, arguments);
		va_end(arguments);
	}
	return -EBADMSG;
}

int is_line_end(char c)
{
	return c == '\0' || c == '\n' || c == '#';
}

void skip_spaces(struct parse *p)
{
	p->pos += strspn(p->pos, " \t");
}

int next_word(struct parse *p)
{
	size_t len;

	skip_spaces(p);
	if (is_line_end(*p->pos)) {
		return 0;
	}
	len = strcspn(p->pos, " \t\n#");
	if (len >= WORD_BYTES) {
		return parse_fail(p, "a word has more than %d bytes", WORD_BYTES - 1);
	}
	memcpy(p->word, p->pos, len);
	p->word[len] = '\0';
	p->pos += len;
	return 1;
}

int need_word(struct parse *p, const char *what)
{
	int r = next_word(p);

	return r == 0 ? parse_fail(p, "%s is missing", what) : r;
}

int number_of(struct parse *p, const char *text, const char *what, long long min, long long max,
	      long long *ret)
{
	char *end;
	long long value = strtoll(text, &end, 0);

	if (end != text && *end == '+' && p->repeat_pos != NULL) {
		const char *step = end + 1;
		long long more = strtoll(step, &end, 0);

		if (end == step || __builtin_mul_overflow(more, (long long)p->channel, &more) ||
		    __builtin_add_overflow(value, more, &value)) {
			end = (char *)text;
		}
	}
	if (end == text || *end != '\0' || value < min || value > max) {
		return parse_fail(p, "%s: '%s' is not a number from %lld to %lld", what, text, min,
				  max);
	}
	*ret = value;
	return 1;
}

int number(struct parse *p, const char *what, long long min, long long max, long long *ret)
{
	int r = need_word(p, what);

	return r < 0 ? r : number_of(p, p->word, what, min, max, ret);
}

int number16(struct parse *p, const char *what, uint16_t *ret)
{
	long long value = 0;
	int r = number(p, what, 0, UINT16_MAX, &value);

	*ret = r < 0 ? 0 : (uint16_t)value;
	return r;
}

int object_address(struct parse *p, uint16_t *ret_index, uint8_t *ret_subindex)
{
	long long index = 0;
	long long subindex = 0;
	char *colon;
	int r = need_word(p, "INDEX:SUBINDEX");

	if (r < 0) {
		return r;
	}
	colon = strchr(p->word, ':');
	if (colon == NULL) {
		return parse_fail(p, "'%s' is not INDEX:SUBINDEX", p->word);
	}
	*colon = '\0';
	r = number_of(p, p->word, "index", 1, UINT16_MAX, &index);
	r = r < 0 ? r : number_of(p, colon + 1, "subindex", 0, UINT8_MAX, &subindex);
	*ret_index = (uint16_t)index;
	*ret_subindex = (uint8_t)subindex;
	return r;
}

int text_number(struct parse *p, uint8_t *ret)
{
	struct slave_model *m = p->m;
	char text[SII_NAME_BYTES] = "";
	size_t len = 0;

	skip_spaces(p);
	if (*p->pos != '"') {
		return parse_fail(p, "a text in \"...\" is missing");
	}
	for (p->pos++; *p->pos != '"'; p->pos++) {
		int n = *p->pos == '%'
				? snprintf(text + len, sizeof(text) - len, "%ld", p->channel + 1)
				: 1;

		if (*p->pos < ' ' || *p->pos > '~') {
			return parse_fail(p, "a text ends in its line, and is of ASCII");
		}
		if (len + (size_t)n >= sizeof(text)) {
			return parse_fail(p, "a text has more than %d bytes", SII_NAME_BYTES - 1);
		}
		if (*p->pos != '%') {
			text[len] = *p->pos;
		}
		len += (size_t)n;
	}
	p->pos++;
	text[len] = '\0';
	for (size_t i = 0; i < m->text_count; i++) {
		if (strcmp(m->text[i], text) == 0) {
			*ret = (uint8_t)(i + 1);
			return 1;
		}
	}
	if (m->text_count == MODEL_TEXTS) {
		return parse_fail(p, "more than %d different texts", MODEL_TEXTS);
	}
	memcpy(m->text[m->text_count++], text, len + 1);
	*ret = (uint8_t)m->text_count;
	return 1;
}

int choose(struct parse *p, const struct word_value *table, size_t count, unsigned *ret)
{
	for (size_t i = 0; i < count; i++) {
		if (strcmp(table[i].word, p->word) == 0) {
			*ret = table[i].value;
			return 1;
		}
	}
	return parse_fail(p, "unknown word '%s'", p->word);
}

int choose_all(struct parse *p, const struct word_value *table, size_t count, unsigned *ret)
{
	unsigned value = 0;
	int r;

	*ret = 0;
	while ((r = next_word(p)) > 0) {
		r = choose(p, table, count, &value);
		if (r < 0) {
			return r;
		}
		*ret |= value;
	}
	return r;
}
