/* SPDX-License-Identifier: MIT */
/* Process data: inputs into SM3, outputs out of SM2, the LED, and their watchdog. */
#ifndef FB1111_PICCOLO_PDO_H
#define FB1111_PICCOLO_PDO_H

#include "piccolo.h"

/* Octet offsets in the two process data images; a test holds them against the description. */
enum piccolo_pdo_offset {
	INPUT_ADC = 0,
	INPUT_COUNTER = 2,
	INPUT_SAMPLE_TIME = 4,
	INPUT_STATUS = 12,
	OUTPUT_LED = 0,
	OUTPUT_ONESHOT_TIME = 1
};

/** On entering PREOP: no conversions yet, outputs safe. */
void piccolo_pdo_reset(struct piccolo *p);
/** On entering SAFEOP: the master finds valid inputs in its first frame. */
void piccolo_pdo_start(struct piccolo *p);
/** LED off, one-shot disarmed. */
void piccolo_pdo_outputs_safe(struct piccolo *p);
octet_t piccolo_pdo_status(const struct piccolo *p);
/** Inputs into SM3. Context: interrupt, or interrupts off. */
void piccolo_pdo_write_inputs(struct piccolo *p);
/** Every refresh_ms in SAFEOP and OP: outputs, watchdog, inputs that no SYNC0 refreshes. */
void piccolo_pdo_refresh(struct piccolo *p);

#endif
