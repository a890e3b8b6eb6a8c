/* SPDX-License-Identifier: MIT */
#include "base/admin_protocol.h"

#include <stddef.h>

#include "base/clock.h"

/* Where it is not ADMIN_TIMEOUT_S. */
static const uint16_t timeout_s[] = {
	[ADMIN_SET] = 1, /* the next cycle takes it */
	[ADMIN_ONESHOT] = 1,
	[ADMIN_RESCAN] = ADMIN_BRING_UP_TIMEOUT_S,
	[ADMIN_SII_READ] = 600, /* a whole EEPROM, word by word */
	[ADMIN_SII_WRITE] = 600,
	[ADMIN_FOE_READ] = 3600, /* a whole file: a slave that does not go on ends it earlier */
	[ADMIN_FOE_WRITE] = 3600,
};

int64_t admin_timeout_ns(const struct admin_request *request)
{
	size_t verb = request->verb;

	if (request->timeout_ms != 0) {
		return request->timeout_ms * NS_PER_MS;
	}
	if (verb == ADMIN_STATE && request->slave_pos == ADMIN_ALL_SLAVES) {
		return ADMIN_BRING_UP_TIMEOUT_S * NS_PER_S;
	}
	if (verb < sizeof(timeout_s) / sizeof(timeout_s[0]) && timeout_s[verb] != 0) {
		return timeout_s[verb] * NS_PER_S;
	}
	return ADMIN_TIMEOUT_S * NS_PER_S;
}
