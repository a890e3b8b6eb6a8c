/* SPDX-License-Identifier: MIT */
/* Answer of ADMIN_CONFIG_RELOAD (base/admin_protocol.h): an array of these, in the order of the
 * file. */
#ifndef BASE_CONFIG_CHANGE_H
#define BASE_CONFIG_CHANGE_H

#include <assert.h>
#include <stddef.h>
#include <stdint.h>

/* When another value of an option takes effect, after the file was read again. */
enum config_effect {
	CONFIG_EFFECT_RESCAN,  /* when the bus is brought up the next time: ecdaq rescan */
	CONFIG_EFFECT_NOW,     /* at once */
	CONFIG_EFFECT_RESTART, /* when ecdaqd is restarted */
	CONFIG_EFFECT_RECORD,  /* when the service that uses it is: ecdaq-record */
	CONFIG_EFFECT_DDS,     /* ecdaq-dds */
	CONFIG_EFFECT_SYNC0,   /* ecdaq-sync0 */
	CONFIG_EFFECT_WEB,     /* ecdaq-web */
	CONFIG_EFFECT_STREAM,  /* ecdaq-stream */
	CONFIG_EFFECT_UPLINK,  /* ecdaq-uplink */
	CONFIG_EFFECTS,
};

enum { CONFIG_CHANGE_VALUE_BYTES = 160 };

struct config_change {
	uint32_t effect;                           /* enum config_effect */
	char option[96];                           /* "outputs[0].max"; an item: "slaves[2]" */
	char old_value[CONFIG_CHANGE_VALUE_BYTES]; /* a long one is cut and ends with "..." */
	char new_value[CONFIG_CHANGE_VALUE_BYTES];
};

static_assert(sizeof(struct config_change) == 420, "both ends agree");

/** "at once", "rescan", "restart of ecdaqd", "restart of ecdaq-record" ... "?" for any other
 * number. */
const char *config_effect_to_str(uint32_t effect);

/** "outputs[0].max: 1 -> 0.5: in effect", "cycle.cpu: 3 -> 2: needs a restart of ecdaqd". Returns
 * the length as snprintf does. */
int config_change_format(const struct config_change *change, char *buf, size_t buf_len);

#endif
