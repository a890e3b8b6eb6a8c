/* SPDX-License-Identifier: MIT */
#include "network/mac_table.h"

#include <string.h>

#define AGE_NS (300 * NS_PER_S)

static unsigned bucket_of(const uint8_t *mac)
{
	unsigned hash = 0;

	for (unsigned i = 0; i < MAC_BYTES; i++) {
		hash = hash * 31 + mac[i];
	}
	return hash % MAC_BUCKETS;
}

static int is_entry(const struct mac_entry *entry, const uint8_t *mac)
{
	return entry->seen.ns != 0 && memcmp(entry->mac, mac, MAC_BYTES) == 0;
}

void mac_table_learn(struct mac_table *table, const uint8_t *mac, uint16_t port, mono_t now)
{
	struct mac_entry *bucket = table->entry[bucket_of(mac)];
	struct mac_entry *place = &bucket[0];

	if (mac_is_group(mac)) {
		return;
	}
	for (unsigned i = 0; i < MAC_WAYS; i++) {
		if (is_entry(&bucket[i], mac)) {
			place = &bucket[i];
			break;
		}
		if (bucket[i].seen.ns < place->seen.ns) {
			place = &bucket[i];
		}
	}
	memcpy(place->mac, mac, MAC_BYTES);
	place->port = port;
	place->seen = now;
}

uint16_t mac_table_find(const struct mac_table *table, const uint8_t *mac, mono_t now)
{
	const struct mac_entry *bucket = table->entry[bucket_of(mac)];

	for (unsigned i = 0; i < MAC_WAYS && !mac_is_group(mac); i++) {
		if (is_entry(&bucket[i], mac)) {
			return mono_sub(now, bucket[i].seen).ns < AGE_NS ? bucket[i].port
									 : MAC_NO_PORT;
		}
	}
	return MAC_NO_PORT;
}
