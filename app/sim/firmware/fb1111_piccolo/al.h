/* SPDX-License-Identifier: MIT */
/*
 * The application layer state machine (ETG.1000.6, ETG.1020). INIT, PREOP, BOOT, SAFEOP and OP.
 * Requests come by AL event (seen at most PICCOLO_EVENT_POLL_US late) and, should an event
 * be lost, by reading AL control every PICCOLO_AL_POLL_US.
 */
#ifndef FB1111_PICCOLO_AL_H
#define FB1111_PICCOLO_AL_H

#include "piccolo.h"

/** After power-on: show INIT, no error. */
void piccolo_al_start(struct piccolo *p);
/** Take a request of the master, if there is one; finish a pending step to OP. */
void piccolo_al_step(struct piccolo *p);
/** Fall to @state by ourselves, with the error flag and @code. */
void piccolo_al_fail(struct piccolo *p, enum piccolo_state state, enum piccolo_al_code code);

#endif
