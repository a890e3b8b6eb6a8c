/* SPDX-License-Identifier: MIT */
/*
 * Which port of a switch a MAC address was last seen at. Of fixed size: where there is no room, the
 * entry that was used longest ago goes, and frames to it are flooded. Context: any.
 */
#ifndef NETWORK_MAC_TABLE_H
#define NETWORK_MAC_TABLE_H

#include <stdint.h>

#include "base/clock.h"

enum { MAC_BYTES = 6, MAC_BUCKETS = 128, MAC_WAYS = 8, MAC_NO_PORT = 0xffff };

struct mac_entry {
	uint8_t mac[MAC_BYTES];
	uint16_t port;
	mono_t seen; /* 0: free */
};

struct mac_table {
	struct mac_entry entry[MAC_BUCKETS][MAC_WAYS];
};

/** A frame of @mac came in at @port; group addresses are not learned. */
void mac_table_learn(struct mac_table *table, const uint8_t *mac, uint16_t port, mono_t now);
/** The port, or MAC_NO_PORT: a group address, or not seen for 300 s. */
uint16_t mac_table_find(const struct mac_table *table, const uint8_t *mac, mono_t now);
/** 1: broadcast or multicast. */
static inline int mac_is_group(const uint8_t *mac)
{
	return mac[0] & 1;
}

#endif
