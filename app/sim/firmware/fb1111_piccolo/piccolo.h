/* SPDX-License-Identifier: MIT */
/*
 * Firmware of the FB1111-0141 + TMS320F28069 "Piccolo" slave. The board calls piccolo_step() for
 * ever and piccolo_sync0_isr() on every SYNC0 edge; all state is in struct piccolo, all hardware
 * behind the HAL. C99, no allocation, no library beyond <stdint.h> and <string.h>.
 *
 * Who writes what: the ISR writes inputs, sync0.last_*, sync0.edges and sync0.armed; everybody else
 * touches those with interrupts off. All other fields belong to the main loop.
 */
#ifndef FB1111_PICCOLO_PICCOLO_H
#define FB1111_PICCOLO_PICCOLO_H

#include "description.h"
#include "hal.h"
#include "octet.h"

enum piccolo_state {
	PICCOLO_INIT = 1,
	PICCOLO_PREOP = 2,
	PICCOLO_BOOT = 3,
	PICCOLO_SAFEOP = 4,
	PICCOLO_OP = 8
};

/* AL status codes of ETG.1020 that the firmware gives. */
enum piccolo_al_code {
	AL_OK = 0x0000,
	AL_INVALID_STATE_CHANGE = 0x0011,
	AL_UNKNOWN_STATE = 0x0012,
	AL_INVALID_MAILBOX_CONFIG_BOOT = 0x0015,
	AL_INVALID_MAILBOX_CONFIG = 0x0016,
	AL_SM_WATCHDOG = 0x001b,
	AL_INVALID_OUTPUT_CONFIG = 0x001d,
	AL_INVALID_INPUT_CONFIG = 0x001e,
	AL_SYNC_LOST = 0x002c,         /* fatal sync error: SYNC0 stopped in OP */
	AL_SYNC_NOT_RECEIVED = 0x002d, /* no sync error: no SYNC0 on the way to OP */
	AL_INVALID_DC_SYNC_CONFIG = 0x0030,
	AL_INVALID_DC_CYCLE = 0x0035
};

enum piccolo_mode { PICCOLO_PERIODIC = 0, PICCOLO_ONESHOT = 1 };

enum piccolo_status_bit {
	PICCOLO_STATUS_ONESHOT = 0x01,
	PICCOLO_STATUS_ARMED = 0x02,
	PICCOLO_STATUS_OVERRUN = 0x04
};

enum piccolo_timing {
	PICCOLO_EVENT_POLL_US = 1200, /* AL events are never older than this */
	PICCOLO_AL_POLL_US = 50000,
	PICCOLO_REFRESH_DEFAULT_MS = 10,
	PICCOLO_REFRESH_MAX_MS = 1000,
	PICCOLO_OP_TIMEOUT_US = 1000000, /* SAFEOP to OP: outputs and SYNC0 must come */
	PICCOLO_SYNC_LOST_MIN_US = 20000,
	PICCOLO_SYNC_LOST_CYCLES = 20
};

/* A one-shot nearer than this cannot be programmed in time: 40 SPI octets and some reserve. */
#define PICCOLO_ONESHOT_LEAD_NS UINT64_C(100000)

struct piccolo_inputs {
	uint16_t adc;
	uint16_t counter;
	uint64_t sample_time_ns;
};

struct piccolo_outputs {
	octet_t led;
	uint64_t oneshot_time_ns;
};

struct piccolo_sync0 {
	int enabled;              /* SAFEOP and OP */
	int armed;                /* one-shot programmed and not yet fired */
	int overrun;              /* the sample in inputs came after a lost one */
	uint32_t cycle_ns;        /* periodic */
	uint64_t oneshot_ns;      /* the time that is armed */
	uint64_t oneshot_seen_ns; /* last oneshot_time looked at */
	uint64_t last_ns;         /* DC time of the last edge */
	uint32_t last_us;         /* board time of the last edge */
	uint32_t edges;           /* since SAFEOP */
	uint16_t overruns;        /* 0x1C33:0C */
};

struct piccolo_al {
	enum piccolo_state state;
	octet_t has_error;
	uint16_t code;
	uint16_t control;      /* last AL control that was handled */
	octet_t is_op_pending; /* waiting in SAFEOP for outputs and SYNC0 */
	uint32_t op_since_us;
	uint32_t polled_us;
};

enum piccolo_mailbox_phase {
	MAILBOX_IDLE,
	MAILBOX_READING,
	MAILBOX_RELEASING, /* last octet of SM0 still to be read */
	MAILBOX_WAITING,   /* an answer waits for a free SM1 */
	MAILBOX_WRITING
};

struct piccolo_mailbox {
	enum piccolo_mailbox_phase phase;
	octet_t rx[PICCOLO_MAILBOX_OCTETS];
	octet_t tx[PICCOLO_MAILBOX_OCTETS];
	uint16_t rx_len, rx_pos;
	uint16_t tx_len, tx_pos; /* tx_len 0: no answer to repeat */
	octet_t rx_counter;      /* of the last request executed; 0: none */
	octet_t tx_counter;
	octet_t is_repeat;        /* the answer in tx has been sent before */
	octet_t is_repeat_wanted; /* SM1 repeat request has toggled */
	octet_t activate_seen;    /* SM1 activate octet last seen */
	octet_t is_blocked;       /* SM1 was full at blocked_us */
	uint32_t blocked_us;
};

/* A firmware image on its way into the flash. */
struct piccolo_update {
	octet_t is_open;
	octet_t is_complete; /* whole and checked; started on leaving BOOT */
	uint32_t packet;     /* the last one taken */
	uint32_t received;   /* octets */
	uint32_t crc;        /* of those behind the header */
	octet_t header[PICCOLO_IMAGE_HEADER_OCTETS];
};

struct piccolo {
	struct piccolo_hal hal;
	int is_started; /* EEPROM_LOADED seen and the ET1100 answers */

	uint16_t al_event;    /* 0x0220 as the last SPI access returned it */
	uint32_t accessed_us; /* when that was */
	uint32_t refreshed_us;

	enum piccolo_mode mode;   /* 0x8000:01 */
	uint16_t refresh_ms;      /* 0x8000:02 */
	octet_t rx_assigned;      /* 0x1C12:00 */
	octet_t tx_assigned;      /* 0x1C13:00 */
	octet_t is_watchdog_used; /* SM2 triggers the watchdog */
	octet_t has_outputs;      /* outputs have come since SAFEOP */

	struct piccolo_al al;
	struct piccolo_inputs inputs;
	struct piccolo_outputs outputs;
	struct piccolo_sync0 sync0;
	struct piccolo_mailbox mailbox;
	struct piccolo_update update;
	char version[PICCOLO_VERSION_OCTETS + 1]; /* 0x100A */
};

/** Power-on: all state as after a reset. Touches the LED, never the SPI bus. */
void piccolo_init(struct piccolo *p, const struct piccolo_hal *hal);

/**
 * One pass of the main loop: at most one unit of work of each kind. Returns the microseconds until
 * something is due; the board may ignore it and call again at once.
 */
uint32_t piccolo_step(struct piccolo *p);

/** The SYNC0 interrupt. Context: interrupt, or main loop with interrupts off. */
void piccolo_sync0_isr(struct piccolo *p);

#endif
