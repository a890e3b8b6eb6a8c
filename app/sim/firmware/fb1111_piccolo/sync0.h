/* SPDX-License-Identifier: MIT */
/*
 * SYNC0. Periodic: the master runs the SYNC unit; each edge gives one sample. One-shot: the SYNC
 * unit is ours; a changed oneshot_time in the future programs one single shot.
 */
#ifndef FB1111_PICCOLO_SYNC0_H
#define FB1111_PICCOLO_SYNC0_H

#include "piccolo.h"

/** Entering SAFEOP. */
void piccolo_sync0_start(struct piccolo *p);
/** Leaving SAFEOP downwards. */
void piccolo_sync0_stop(struct piccolo *p);
/**
 * The master's oneshot_time. A value looked at before does nothing. A changed one withdraws the
 * shot that is armed; then 0 and times less than PICCOLO_ONESHOT_LEAD_NS ahead arm nothing.
 */
void piccolo_sync0_oneshot(struct piccolo *p, uint64_t at_ns);
/** Withdraw an armed shot; the next oneshot_time counts as changed. */
void piccolo_sync0_disarm(struct piccolo *p);
/** Periodic, in OP: nonzero if SYNC0 has stopped. */
int piccolo_sync0_is_lost(struct piccolo *p);

#endif
