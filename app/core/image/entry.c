/* SPDX-License-Identifier: MIT */
#include "image/entry.h"

#include <stddef.h>
#include <string.h>

static const struct {
	const char *entry;
	uint16_t index;
	uint8_t subindex;
} piccolo[] = {
	{ "adc", 0x6000, 1 },
	{ "counter", 0x6000, 2 },
	{ "sample_time", 0x6000, 3 },
	{ "oneshot_time", 0x7000, 2 },
};

int channel_is_entry(const struct slave_info *slave, const struct channel *ch, const char *entry)
{
	const char *dot = strrchr(ch->name, '.');

	for (size_t i = 0; slave_is_piccolo(slave) && i < sizeof(piccolo) / sizeof(piccolo[0]);
	     i++) {
		if (strcmp(piccolo[i].entry, entry) == 0) {
			return ch->index == piccolo[i].index && ch->subindex == piccolo[i].subindex;
		}
	}
	return dot != NULL && strcmp(dot + 1, entry) == 0;
}
