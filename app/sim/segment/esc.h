/* SPDX-License-Identifier: MIT */
/*
 * One EtherCAT slave controller: register file, process RAM, SyncManagers, FMMUs, AL handshake, SII
 * interface, watchdogs, distributed clock. It has two sides, as the chip has: datagrams from the
 * wire (esc_datagram) and the PDI (esc_pdi_read, esc_pdi_write). All times are true time in ns, on
 * one axis for the whole segment; the ESC's own clock runs off it by its ppm. What rests on the
 * data sheet, on captures, or is our model is listed in app/doc/reference/simulated-esc.md.
 */
#ifndef SIM_SEGMENT_ESC_H
#define SIM_SEGMENT_ESC_H

#include <stddef.h>
#include <stdint.h>

#include "wire/datagram.h"

enum esc_dc_kind {
	ESC_DC_NONE,
	ESC_DC_RECEIVE_TIMES, /* 0x0900 only: EL2828 */
	ESC_DC_32,
	ESC_DC_64,
};

/* What receive times hold that no frame has ever set, as captures of ET1100 and ET1200 show: "hoff"
 * and "Verl" in the two that this text reaches. */
#define ESC_RECEIVE_TIME_UNSET { 0, 0x66666f68u, 0, 0x6c726556u }

struct esc_features {
	uint8_t type;
	uint8_t revision;
	uint16_t build;
	uint8_t fmmu_count;
	uint8_t sm_count;
	uint8_t ram_kib;
	uint8_t port_descriptor;
	uint16_t features;
	enum esc_dc_kind dc;
	int has_sync_unit;   /* 0x0980 to 0x09a7 */
	int is_dc_by_eeprom; /* 0x0141 bits 2 and 3, if both 0, leave the receive times alone */
	int has_open_bits;   /* SyncManager status bits 6 and 7: a buffer is open */
	unsigned eeprom_bytes_a_read; /* 4 or 8 */
	int has_long_eeprom;          /* two address bytes: 0x0502 bit 7 */
	int is_eeprom_emulated;       /* the PDI answers: 0x0502 bit 5 */
	uint16_t eeprom_status;       /* bits of 0x0502 that read 1 and no data sheet names */
	/* What 0x0900 to 0x090f hold before a port has seen a frame. */
	uint32_t receive_time_at_power_on[4];
};

/* ET1100: 8 FMMUs, 8 SMs, 8 KiB, 64-bit DC, four ports. */
extern const struct esc_features esc_et1100;

enum {
	ESC_REGISTER_BYTES = 0x1000,
	ESC_RAM_BYTES = 0x2000,
	ESC_LIMIT_SM = 16,
	ESC_LIMIT_FMMU = 16,
};

/* AL event request bits (0x0220). SM and SYNC bits come only where 0x0804 and 0x0151 let them. */
enum esc_al_event {
	ESC_AL_EVENT_CONTROL = 1u << 0,
	ESC_AL_EVENT_SYNC0 = 1u << 2,
	ESC_AL_EVENT_SYNC1 = 1u << 3,
	ESC_AL_EVENT_SM_ACTIVATION = 1u << 4,
	ESC_AL_EVENT_EEPROM = 1u << 5, /* emulation: a command waits for the PDI */
	ESC_AL_EVENT_WATCHDOG = 1u << 6,
	ESC_AL_EVENT_SM0 = 1u << 8,
};

/* ECAT event request bits (0x0210), which with 0x0200 are put into each datagram's IRQ field. */
enum esc_ecat_event {
	ESC_ECAT_EVENT_DL_STATUS = 1u << 2,
	ESC_ECAT_EVENT_AL_STATUS = 1u << 3,
	ESC_ECAT_EVENT_SM0 = 1u << 4,
};

/* The buffers behind one SyncManager. */
struct esc_sm {
	unsigned completed; /* buffers or mails written to their last byte */
	uint16_t start;
	uint16_t len;
	uint8_t control;
	uint8_t is_active; /* by the master's activate and the PDI's control bit */
	uint8_t is_locked; /* the PDI has switched off what the master has activated */
	uint8_t is_mailbox;
	uint8_t is_ecat_write;  /* the master writes, the PDI reads */
	uint8_t is_reader_open; /* between the first and the last byte of the area */
	uint8_t is_writer_open;
	uint8_t is_full;  /* mailbox */
	uint8_t has_data; /* buffered: something was written since activation */
	uint8_t writer;   /* buffered: index of the writer's buffer, 0 to 2 */
	uint8_t newest;   /* buffered: last complete one */
	uint8_t reader;   /* buffered: the one the reader has */
	uint8_t activate; /* 0x0806 as last seen */
	uint8_t marks;    /* of its status: what was completed last */
};

/* How the application's mailbox misbehaves; it looks here itself (devices/mailbox.c). */
enum esc_mailbox_fault_kind {
	ESC_MAILBOX_GOOD,
	ESC_MAILBOX_LATE,    /* the answer comes after by_ns */
	ESC_MAILBOX_DOUBLE,  /* twice */
	ESC_MAILBOX_COUNTER, /* its counter jumps */
	ESC_MAILBOX_LENGTH,  /* its length is beyond the mailbox */
	ESC_MAILBOX_SILENT,  /* there is none */
	ESC_MAILBOX_EOE,     /* an EoE fragment comes before it */
	ESC_MAILBOX_ABORT,   /* it is an SDO abort */
	ESC_MAILBOX_BUSY,    /* requests are not read */
};

struct esc_mailbox_fault {
	enum esc_mailbox_fault_kind kind;
	unsigned count; /* answers that it is for; BUSY: passes of the main loop */
	int64_t by_ns;
};

struct esc_fmmu {
	int64_t first_bit; /* of the logical addresses */
	int32_t bits;
	uint16_t physical_start;
	uint8_t physical_start_bit;
	uint8_t type; /* 1 read, 2 write */
	uint8_t is_active;
	uint8_t is_bytewise;
};

/*
 * The clock: local(t) = base_local + (t - base_true) * (1 + rate). Rates are relative deviations in
 * units of 2^-48.
 */
struct esc_clock {
	int64_t crystal;    /* of the oscillator */
	int64_t correction; /* of the time loop control */
	int64_t rate;       /* both together */
	int64_t base_true_ns;
	uint64_t base_local_ns;
	uint64_t base_fraction; /* 2^-48 ns */
	uint64_t phase_ns;      /* where its ticks lie */
	uint64_t offset_ns;     /* 0x0920 */

	/* time loop control */
	double diff_filtered_ns;
	double integral;    /* frequency part of the correction */
	double interval_ns; /* between two comparisons, averaged */
	int64_t speed_diff; /* D, 0x0932 */
	uint64_t last_compare_ns;
	uint8_t has_compared;
	uint8_t time_filter; /* depth in force: 0x0934 as of the last write to 0x0930 */
	uint8_t speed_filter;
	uint16_t speed_start; /* S, 0x0930 */
	double loop_gain;     /* of these filters, */
	double rate_limit;    /* and of S */
};

struct esc_sync {
	uint8_t activation; /* 0x0981 in force */
	uint8_t is_running;
	uint8_t is_pending;     /* the first SYNC0 has not come yet */
	uint8_t is_sync0_high;  /* acknowledge mode: until the PDI reads 0x098e */
	uint32_t cycle_ns;      /* SYNC0; 0: once */
	uint32_t sync1_ns;      /* 0x09a4 */
	uint64_t next_local_ns; /* system time of the next SYNC0 */
	int64_t next_true_ns;   /* INT64_MAX: none */
	uint64_t next1_local_ns;
	int64_t next1_true_ns;
	uint64_t edges;
	uint64_t pulses_lost; /* fault: so many SYNC0 pulses do not come out */
};

/* Faults of the application's state machine. They survive a power cycle. */
struct esc_al_fault {
	uint8_t slow_state;    /* its AL status shows this state only slow_ns later; 0: none */
	uint8_t refused_state; /* it answers this one with an error; 0: none */
	uint16_t refused_code;
	int64_t slow_ns;
};

/* Called at each SYNC0 edge, at its true time and its system time. */
typedef void (*esc_sync0_sink)(void *ctx, int64_t t_ns, uint64_t system_time_ns);

struct esc {
	struct esc_features features;
	uint8_t reg[ESC_REGISTER_BYTES];
	uint8_t readable[ESC_REGISTER_BYTES / 8];
	uint8_t ecat_writable[ESC_REGISTER_BYTES / 8];
	uint8_t ram[ESC_RAM_BYTES];
	struct esc_sm sm[ESC_LIMIT_SM];
	struct esc_fmmu fmmu[ESC_LIMIT_FMMU];
	uint16_t sm_mapped;    /* bit n: SM n minds its area, active or locked */
	uint16_t sm_apart;     /* of those the ones whose areas are nobody else's */
	uint16_t fmmu_active;  /* bit n: FMMU n maps something, */
	uint16_t fmmu_writing; /* and writes */
	struct esc_clock clock;
	struct esc_sync sync;
	uint32_t al_event;
	uint32_t ecat_event;
	uint32_t sm_activations; /* bit n: 0x0806 + 8n changed and was not read by the PDI */
	uint8_t *sii;
	size_t sii_bytes;
	int is_eeprom_loaded;
	int was_eeprom_loaded;        /* the alias is taken once only */
	int64_t eeprom_busy_until_ns; /* 0: idle */
	uint16_t eeprom_command;
	int64_t eeprom_writing_until_ns; /* the memory chip does not acknowledge before that */
	int64_t eeprom_slow_ns;          /* a fault: each command takes this much longer */
	unsigned eeprom_writes_left;     /* a fault: the last of so many words is torn; 0: none */
	uint8_t is_eeprom_cut;
	uint8_t is_eeprom_deaf;       /* the command came while the memory chip programs a word */
	int64_t watchdog_deadline_ns; /* process data; INT64_MAX: not running */
	int64_t pdi_watchdog_deadline_ns; /* INT64_MAX: not running, or expired */
	uint8_t is_pdi_expired;
	int64_t mailbox_stuck_until_ns; /* a fault: the PDI's mailbox writes are lost */
	struct esc_mailbox_fault mailbox_fault;
	struct esc_al_fault al_fault;
	uint16_t identification; /* of its switch; 0: it has none */
	int64_t al_late_ns;      /* when al_late_status shows; 0: nothing is late */
	uint8_t al_late_status;
	uint8_t is_al_refused;    /* the error in AL status is al_fault's */
	uint8_t ports;            /* with a link */
	uint8_t is_write_enabled; /* 0x0020 or 0x0030 came in this frame */
	uint8_t reset_step[2];    /* of 'R' 'E' 'S', by the master, by the PDI */
	uint8_t is_reset_wanted;
	uint8_t is_loop_changed; /* 0x0101 was written: the segment looks */
	esc_sync0_sink sink;
	void *sink_ctx;
};

/* When the start of a frame passed this slave. */
struct esc_frame {
	int64_t pu_ns;      /* the processing unit */
	int64_t port_ns[4]; /* each port on the way in; unused ports 0 */
	uint8_t ports_used; /* bit n: port n has a link */
};

/**
 * Power on with SII contents @sii (kept by reference, writable: the EEPROM). The clock starts at 0.
 */
void esc_init(struct esc *esc, const struct esc_features *features, uint8_t *sii, size_t sii_bytes,
	      int64_t t_ns);
void esc_clock_start(struct esc *esc, int64_t t_ns, uint64_t local_ns, double ppm);
/** Change the crystal's rate from @t_ns on. */
void esc_clock_drift(struct esc *esc, int64_t t_ns, double ppm);
void esc_sync0_to(struct esc *esc, esc_sync0_sink sink, void *ctx);

/** Cut the EEPROM's power in its @words-th next write of a word (1: the next one): that word is
 * torn and later ones are lost, until the next power-on. */
void esc_eeprom_cut(struct esc *esc, unsigned words);

/** A new frame starts here; call before its first datagram. */
void esc_frame_begin(struct esc *esc);
/** Take part in one datagram of a frame; changes its address, IRQ, data and working counter. */
void esc_datagram(struct esc *esc, const struct esc_frame *frame, struct ecat_datagram *dg);

/** True time of the ESC's next own event (SYNC edge, watchdog, EEPROM done); INT64_MAX: none. */
int64_t esc_next_event_ns(const struct esc *esc);
/** Run all own events up to and including @t_ns. */
void esc_advance(struct esc *esc, int64_t t_ns);

/** Copy of the system time at true time @t_ns (what the PDI reads from 0x0910). */
uint64_t esc_system_time(const struct esc *esc, int64_t t_ns);

/**
 * PDI access. The first byte of a SyncManager's area opens its buffer, the last one closes it;
 * bytes between are refused unless it is open. Nothing works before the EEPROM is loaded.
 */
void esc_pdi_read(struct esc *esc, int64_t t_ns, uint16_t addr, void *buf, size_t len);
void esc_pdi_write(struct esc *esc, int64_t t_ns, uint16_t addr, const void *buf, size_t len);
/** The lower three octets of 0x0220, which come with the address of each SPI access. */
void esc_pdi_read_al_event(struct esc *esc, int64_t t_ns, uint8_t ret_octets[3]);
int esc_eeprom_loaded(const struct esc *esc);
/** 1 if the EEPROM makes the SYNC0 pin an output (0x0151 bit 2). */
int esc_has_sync0_pin(const struct esc *esc);
/** 1 once after the reset sequence was written to 0x0040 or 0x0041: start the slave anew. */
int esc_take_reset(struct esc *esc);

enum esc_error {
	ESC_ERROR_INVALID_FRAME, /* 0x0300 */
	ESC_ERROR_RX,            /* 0x0301 */
	ESC_ERROR_FORWARDED,     /* 0x0308 */
	ESC_ERROR_LOST_LINK,     /* 0x0310 */
	ESC_ERROR_UNIT,          /* 0x030c; has no port */
};
void esc_count_error(struct esc *esc, unsigned port, enum esc_error error);
/** Which ports have a link, into DL status (0x0110); and which the master has closed (0x0101). */
void esc_set_links(struct esc *esc, uint8_t ports);
int esc_is_port_closed(const struct esc *esc, unsigned port);
/** AL status and code as a fault sets them, whoever the application is. */
void esc_force_al_status(struct esc *esc, uint8_t status, uint16_t code);
/** What a slow or refusing application has in its AL status at @t_ns. */
void esc_show_late_status(struct esc *esc, int64_t t_ns);
/** The process data watchdog expires now, whatever was written. */
void esc_force_watchdog(struct esc *esc);

#endif
