/* SPDX-License-Identifier: MIT */
#include "bus/names.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>

enum { MODULES_FIRST = 0x6000, MODULES_LAST = 0x7fff }; /* inputs, outputs */

static int is_word(char c)
{
	return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
}

static char lower(char c)
{
	return c >= 'A' && c <= 'Z' ? (char)(c - 'A' + 'a') : c;
}

void name_sanitise(const char *text, char *ret_name, size_t name_bytes)
{
	size_t len = 0;
	int gap = 0;

	for (; *text != '\0' && len + 1 < name_bytes; text++) {
		if (!is_word(*text)) {
			gap = len > 0;
			continue;
		}
		if (gap && len + 2 < name_bytes) {
			ret_name[len++] = '_';
		}
		gap = 0;
		ret_name[len++] = lower(*text);
	}
	ret_name[len] = '\0';
}

void name_slave(const char *device, int is_piccolo, size_t pos, char *ret_name, size_t name_bytes)
{
	char base[24];
	char *cut;
	size_t len;

	if (is_piccolo) {
		snprintf(base, sizeof(base), "piccolo");
	} else {
		name_sanitise(device, base, sizeof(base));
		cut = strchr(base, '_');
		if (cut != NULL) {
			*cut = '\0';
		}
	}
	len = strlen(base);
	if (len == 0) {
		snprintf(base, sizeof(base), "slave");
		len = strlen(base);
	}
	snprintf(ret_name, name_bytes, "%s%s%zu", base,
		 base[len - 1] >= '0' && base[len - 1] <= '9' ? "_" : "", pos);
}

/* How often entry @i's name occurs among the entries that get a channel. */
static int is_shared(const struct pdo_entry *entry, size_t count, char (*name)[PDO_NAME_BYTES],
		     size_t i)
{
	for (size_t k = 0; k < count; k++) {
		if (k != i && entry[k].index != 0 && strcmp(name[k], name[i]) == 0) {
			return 1;
		}
	}
	return 0;
}

static void name_plain(const struct pdo_entry *e, char *ret_name, size_t name_bytes)
{
	name_sanitise(e->name, ret_name, name_bytes);
	if (ret_name[0] == '\0') {
		snprintf(ret_name, name_bytes, "x%04x_%02x", e->index, e->subindex);
	}
}

/* "FRONT_NAME", cut behind. */
static void name_with_prefix(char *name, const char *front, size_t name_bytes)
{
	char joined[2 * PDO_NAME_BYTES];

	snprintf(joined, sizeof(joined), "%s_%s", front, name);
	joined[name_bytes - 1] = '\0';
	memcpy(name, joined, strlen(joined) + 1);
}

static void name_with_pdo(const struct pdo_entry *e, char *name, size_t name_bytes)
{
	char pdo[PDO_NAME_BYTES];

	name_sanitise(e->pdo_name, pdo, sizeof(pdo));
	if (pdo[0] != '\0') {
		name_with_prefix(name, pdo, name_bytes);
	}
}

/*
 * Modular devices (ETG.5001) number their modules' objects in steps of 0x10 from 0x6000 and 0x7000,
 * and often give their PDOs no names: the place of the module is used instead.
 */
static void name_with_slot(const struct pdo_entry *e, char *name, size_t name_bytes)
{
	char slot[16];

	if (e->pdo_name[0] == '\0' && e->index >= MODULES_FIRST && e->index <= MODULES_LAST) {
		snprintf(slot, sizeof(slot), "slot%u", (e->index & 0xfffu) / 0x10 + 1);
		name_with_prefix(name, slot, name_bytes);
	}
}

static void name_with_suffix(char *name, const char *suffix, size_t name_bytes)
{
	size_t room = name_bytes - 1 - strlen(suffix);
	size_t len = strlen(name);

	if (len > room) {
		len = room;
	}
	memcpy(name + len, suffix, strlen(suffix) + 1);
}

static void name_with_index(const struct pdo_entry *e, char *name, size_t name_bytes)
{
	char suffix[16];

	snprintf(suffix, sizeof(suffix), "_%04x_%02x", e->index, e->subindex);
	name_with_suffix(name, suffix, name_bytes);
}

void name_entries(const struct pdo_entry *entry, size_t count, size_t name_bytes,
		  char (*ret_name)[PDO_NAME_BYTES])
{
	void (*const widen[])(const struct pdo_entry *, char *,
			      size_t) = { name_with_pdo, name_with_slot, name_with_index };
	uint8_t shared[PDO_LIMIT];

	assert(name_bytes >= 16 && name_bytes <= PDO_NAME_BYTES);
	for (size_t i = 0; i < count; i++) {
		name_plain(&entry[i], ret_name[i], name_bytes);
	}
	for (size_t w = 0; w < sizeof(widen) / sizeof(widen[0]); w++) {
		for (size_t i = 0; i < count; i++) {
			shared[i] = (uint8_t)is_shared(entry, count, ret_name, i);
		}
		for (size_t i = 0; i < count; i++) {
			if (shared[i]) {
				widen[w](&entry[i], ret_name[i], name_bytes);
			}
		}
	}
	for (size_t i = 0; i < count; i++) {
		for (unsigned n = 2; is_shared(entry, count, ret_name, i); n++) {
			char suffix[16];

			snprintf(suffix, sizeof(suffix), "_%u", n);
			name_plain(&entry[i], ret_name[i], name_bytes);
			name_with_suffix(ret_name[i], suffix, name_bytes);
		}
	}
}
