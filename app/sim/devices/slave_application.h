/* SPDX-License-Identifier: MIT */
/*
 * What every slave application with a state machine of its own does, whatever its terminals are: AL
 * states with the checks that ETG.1000.6 asks of a simple slave, BOOT if its SII has mailboxes for
 * it, the mailbox with the protocols of its SII, the fall to SAFE-OP when its watchdog is down.
 */
#ifndef SIM_DEVICES_SLAVE_APPLICATION_H
#define SIM_DEVICES_SLAVE_APPLICATION_H

#include <stddef.h>
#include <stdint.h>

#include "devices/coe_server.h"
#include "devices/eoe_server.h"
#include "devices/foe_server.h"
#include "devices/mailbox.h"
#include "devices/soe_server.h"
#include "segment/esc.h"
#include "wire/sii.h"

enum { SLAVE_APPLICATION_PASS_NS = 500000 }; /* its main loop */

/* An SM's type in the SII and in 0x1C00. */
enum slave_sm_type {
	SLAVE_SM_MAILBOX_OUT = 1,
	SLAVE_SM_MAILBOX_IN = 2,
	SLAVE_SM_OUTPUTS = 3,
	SLAVE_SM_INPUTS = 4,
};

struct slave_application {
	const struct sii *sii; /* not taken over */
	struct esc *esc;       /* as of the last power-on */
	struct coe_server coe;
	struct foe_server foe;
	struct soe_server soe;
	struct eoe_server eoe;
	struct mailbox mailbox;
};

/** Before the first power-on; @name is what 0x1008 says. */
void slave_application_init(struct slave_application *app, const struct sii *sii, const char *name);
/** Free what the servers stored. */
void slave_application_done(struct slave_application *app);
void slave_application_power_on(struct slave_application *app, struct esc *esc);
/** One pass of the main loop; the EEPROM is loaded. */
void slave_application_run(struct slave_application *app, int64_t t_ns);

/** A property "PROTOCOL.KEY" of a protocol's server, as "foe.busy". 0; -EINVAL: no such property or
 * value. */
int slave_application_set(struct slave_application *app, const char *key, const char *value);

/** AL state, without the error bit. */
uint8_t slave_application_state(struct slave_application *app, int64_t t_ns);
/** 1 and the area of SyncManager @n; 0: it is off or empty, outputs untouched. */
int slave_application_sm(struct slave_application *app, int64_t t_ns, size_t n, uint16_t *ret_start,
			 uint16_t *ret_len);

#endif
