/* SPDX-License-Identifier: MIT */
/* The type of a start-up SDO, and what the slave's object dictionary has to say about it. */
#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "bus/bus_internal.h"
#include "config/sdo_value.h"
#include "wire/coe_type.h"

static int is_text(uint16_t type)
{
	const char *name = type == 0 ? NULL : coe_type_name(type);

	return name != NULL && strstr(name, "STRING") != NULL;
}

static int is_float(uint16_t type)
{
	const char *name = type == 0 ? NULL : coe_type_name(type);

	return name != NULL && (strcmp(name, "REAL") == 0 || strcmp(name, "LREAL") == 0);
}

/* A type of the device's own is judged by its length alone. */
int startup_fits(const struct startup_command *command, const struct coe_entry *entry)
{
	uint16_t bits = entry->bit_len;

	if (command->is_complete || command->type == CONFIG_SDO_OCTETS || bits == 0) {
		return 1;
	}
	if (command->type == CONFIG_SDO_STRING) {
		return coe_type_name(entry->data_type) == NULL ||
		       (is_text(entry->data_type) && command->len * 8u <= bits);
	}
	return (unsigned)(bits + 7) / 8 == command->len && !is_text(entry->data_type) &&
	       is_float(entry->data_type) ==
		       (command->type == SDO_REAL || command->type == SDO_LREAL);
}

/* The type of the table, or, for one that is not in it (WORD, BIT4, the device's own), an unsigned
 * number of its length. -ENOTSUP: there is none. */
static int number_type(const struct coe_entry *entry)
{
	static const enum sdo_type of_bytes[9] = {
		[1] = SDO_USINT, [2] = SDO_UINT, [4] = SDO_UDINT, [8] = SDO_ULINT
	};
	const char *name = coe_type_name(entry->data_type);
	int type = name == NULL ? -ENOENT : sdo_type_find(name);
	unsigned bytes = (entry->bit_len + 7u) / 8;

	if (type >= 0) {
		return type;
	}
	if (bytes >= sizeof(of_bytes) / sizeof(of_bytes[0]) || of_bytes[bytes] == SDO_BOOL) {
		return -ENOTSUP;
	}
	return (int)of_bytes[bytes];
}

int startup_resolve(struct startup_command *command, const struct coe_entry *entry, char *why,
		    size_t why_bytes)
{
	char text[CONFIG_OPTIONS_BYTES];
	char named[16];
	const char *name = coe_type_name(entry->data_type);
	uint64_t value;
	int type;

	if (is_text(entry->data_type)) {
		command->type = CONFIG_SDO_STRING;
		return 0;
	}
	snprintf(named, sizeof(named), "type 0x%04x", entry->data_type);
	name = name != NULL ? name : named;
	type = number_type(entry);
	if (type < 0) {
		snprintf(why, why_bytes, "%s of %u bits is no number and no text", name,
			 entry->bit_len);
		return -ENOTSUP;
	}
	snprintf(text, sizeof(text), "%.*s", (int)command->len, (const char *)command->octets);
	if (sdo_value_parse((enum sdo_type)type, text, &value) < 0) {
		snprintf(why, why_bytes, "\"%.40s\" is not a valid %s", text, name);
		return -EINVAL;
	}
	command->type = (uint8_t)type;
	command->len = (uint16_t)sdo_type_bytes((enum sdo_type)type);
	command->value = value;
	command->octets = NULL;
	return 0;
}
