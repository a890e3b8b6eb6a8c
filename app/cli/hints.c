/* SPDX-License-Identifier: MIT */
#include "cli/hints.h"

#include <stdlib.h>
#include <string.h>

#include "cli/fit.h"
#include "cli/source.h"
#include "cli/text.h"
#include "wire/al.h"

#define GET(field) atomic_load_explicit(&(field), memory_order_relaxed)

enum { INDENT = 11, HINTS_MAX = 8 };

/* @hint with the name of the slave. */
static void put(FILE *out, const char *hint, const char *slave)
{
	static const char word[] = "SLAVE";
	const char *at;

	while ((at = strstr(hint, word)) != NULL) {
		fprintf(out, "%.*s%s", (int)(at - hint), hint, slave);
		hint = at + strlen(word);
	}
	fputs(hint, out);
}

static void write_one(const struct status_page *page, uint32_t pos, uint16_t code, int columns,
		      FILE *out)
{
	char name[LIMIT_NAME_BYTES];
	char *line = NULL;
	size_t len = 0;
	FILE *text = open_memstream(&line, &len);

	if (text == NULL) {
		return;
	}
	fprintf(text, "hint       0x%04x %s: ", code, al_status_code_to_str(code));
	put(text, al_status_code_hint(code),
	    text_plain(source_slave(page, pos).name, name, sizeof(name)));
	fputc('\n', text);
	if (fclose(text) == 0) {
		fit_write(line, columns, INDENT, out);
	}
	free(line);
}

void hints_write(const struct status_page *page, int columns, FILE *out)
{
	uint16_t said[HINTS_MAX];
	size_t count = 0;

	for (uint32_t i = 0; i < source_slave_count(page) && count < HINTS_MAX; i++) {
		uint16_t code = (uint16_t)GET(page->slave[i].al_status_code);
		size_t known = 0;

		while (known < count && said[known] != code) {
			known++;
		}
		if (known == count && (GET(page->slave[i].al_state) & AL_ERROR) != 0 &&
		    al_status_code_hint(code)[0] != '\0') {
			said[count++] = code;
			write_one(page, i, code, columns, out);
		}
	}
}
