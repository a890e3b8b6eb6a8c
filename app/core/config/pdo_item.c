/* SPDX-License-Identifier: MIT */
/* What an item of slaves[].pdos[] means. */
#include <ctype.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "config/option.h"

enum { ENTRY_BITS_MAX = 255, PDO_ENTRIES_MAX = 254 };

/* A number from @min to @max at *@at, in hexadecimal or decimal; moves *@at behind it. */
static int take_number(const char **at, int base, unsigned long max, unsigned long *ret)
{
	char *end;

	if (!isxdigit((unsigned char)**at)) {
		return -EINVAL;
	}
	errno = 0;
	*ret = strtoul(*at, &end, base);
	if (end == *at || errno != 0 || *ret > max) {
		return -EINVAL;
	}
	*at = end;
	return 0;
}

/* "0x6040:00 16" or "gap 8" at *@at. */
static int take_entry(const char **at, uint32_t *ret_word)
{
	unsigned long index = 0;
	unsigned long subindex = 0;
	unsigned long bits;

	if (strncmp(*at, "gap", 3) == 0) {
		*at += 3;
	} else {
		if (strncmp(*at, "0x", 2) != 0 || take_number(at, 16, 0xffff, &index) < 0 ||
		    index == 0 || **at != ':') {
			return -EINVAL;
		}
		++*at;
		if (take_number(at, 16, 0xff, &subindex) < 0) {
			return -EINVAL;
		}
	}
	if (**at != ' ') {
		return -EINVAL;
	}
	*at += strspn(*at, " ");
	if (take_number(at, 10, ENTRY_BITS_MAX, &bits) < 0 || bits == 0) {
		return -EINVAL;
	}
	*ret_word = (uint32_t)(index << 16 | subindex << 8 | bits);
	return 0;
}

static int take_entries(const char *text, struct config *cfg, struct config_pdo *pdo, char *reason)
{
	const char *at = text + strspn(text, " ");

	pdo->entry_first = (uint16_t)cfg->pdo_entry_count;
	while (*at != '\0') {
		uint32_t word;

		if (take_entry(&at, &word) < 0) {
			snprintf(reason, OPTION_WHY_BYTES,
				 "expected entries such as \"0x6040:00 16, gap 8\", not \"%.64s\"",
				 text);
			return -EINVAL;
		}
		if (cfg->pdo_entry_count >= CONFIG_LIMIT_PDO_ENTRIES) {
			snprintf(reason, OPTION_WHY_BYTES,
				 "more than CONFIG_LIMIT_PDO_ENTRIES = %d entries",
				 CONFIG_LIMIT_PDO_ENTRIES);
			return -ERANGE;
		}
		if (pdo->entry_count == PDO_ENTRIES_MAX) {
			snprintf(reason, OPTION_WHY_BYTES, "more than %d entries", PDO_ENTRIES_MAX);
			return -ERANGE;
		}
		cfg->pdo_entry[cfg->pdo_entry_count++] = word;
		pdo->entry_count++;
		at += strspn(at, " ");
		if (*at == ',') {
			at++;
			at += strspn(at, " ");
		} else if (*at != '\0') {
			snprintf(reason, OPTION_WHY_BYTES, "expected a comma before \"%.32s\"", at);
			return -EINVAL;
		}
	}
	return 0;
}

int option_pdo_finish(const struct option_pdo *item, struct config *cfg, struct config_pdo *ret_pdo,
		      const char **ret_key, char *reason)
{
	struct config_pdo pdo = *ret_pdo;
	int r;

	*ret_key = "pdo";
	if (item->pdo[0] == '\0') {
		snprintf(reason, OPTION_WHY_BYTES, "is empty");
		return -EINVAL;
	}
	if (strncmp(item->pdo, "0x", 2) == 0) {
		const char *at = item->pdo;
		unsigned long index;

		if (take_number(&at, 16, 0xffff, &index) < 0 || *at != '\0' || index < 0x1600 ||
		    index >= 0x1c00) {
			snprintf(reason, OPTION_WHY_BYTES,
				 "%.32s is no PDO: 0x1600 to 0x17ff are RxPDOs, 0x1a00 to 0x1bff "
				 "TxPDOs",
				 item->pdo);
			return -EINVAL;
		}
		pdo.index = (uint16_t)index;
	}
	memcpy(pdo.pdo, item->pdo, sizeof(pdo.pdo));
	*ret_key = "entries";
	r = take_entries(item->entries, cfg, &pdo, reason);
	if (r == 0) {
		*ret_pdo = pdo;
	}
	return r;
}
