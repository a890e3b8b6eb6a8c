/* SPDX-License-Identifier: MIT */
/*
 * The master's service side: finds the slaves, compares them with what is expected, maps their
 * process data, sets up distributed clocks, leads them to OP while the cycle runs, watches them,
 * and stops them in order. Everything here blocks and belongs to the service thread; it reaches the
 * wire through a line (link/line.h) that is direct at first and rides along once the cycle runs.
 *
 * Every call that fails writes one line, what and why, with position, vendor, product, register or
 * AL status text, to @error (BUS_ERROR_BYTES) and returns -errno:
 *   -ECANCELED by line_set_cancel(), -ENODEV no slave, -ENXIO a slave too few or too many or the
 * wrong one, -EPROTO mapping does not fit, -ETIME a state or lock was not reached in time, -EIO the
 * wire, -ENOTSUP, -E2BIG a limit.
 */
#ifndef BUS_BUS_H
#define BUS_BUS_H

#include <stddef.h>
#include <stdint.h>

#include "base/event.h"
#include "base/sample.h"
#include "base/slave_set.h"
#include "base/status.h"
#include "bus/exchange.h"
#include "bus/schedule.h"
#include "config/config.h"
#include "link/line.h"
#include "wire/al.h"

enum { BUS_ERROR_BYTES = 256, BUS_TROUBLE_BYTES = 208 };

struct bus;
struct mailbox_engine;
struct mailbox_request;

/** @cfg and @line outlive the bus. Free with bus_destroy(). */
int bus_create(const struct config *cfg, struct line *line, struct bus **ret_bus);
void bus_destroy(struct bus *bus);

/** Set the receiver of SDO aborts and CoE emergencies from any call below; none at first. */
void bus_listen(struct bus *bus, void (*emit)(void *ctx, const struct event *ev), void *emit_ctx);

struct esi_identity;
struct esi_library;

/* Descriptions of devices by their vendors, besides what the devices say themselves. */
struct bus_esi {
	/* What there is of the devices @wanted; NULL: nothing. The bus uses it until the next call.
	 */
	const struct esi_library *(*load)(void *ctx, const struct esi_identity *wanted,
					  size_t count);
	void *ctx;
};

/** bus_scan() asks @esi once its slaves are known. */
void bus_use_esi(struct bus *bus, const struct bus_esi *esi);

/* --- bring-up, in this order --- */

/** Find the slaves, to PRE-OP, SYNC0 of an earlier run stopped first (T09); names them. */
int bus_scan(struct bus *bus, char *error);
/**
 * The configuration by position: optional slaves that are absent are left out, with their start-up
 * SDOs and outputs. After bus_scan(); the one given to bus_create() before, or if it does not fit.
 */
const struct config *bus_config(const struct bus *bus);
/** The configuration it was created with has changed in what takes effect at once. */
void bus_config_follow(struct bus *bus);
/** Found against configured slaves: order, identity, count. */
int bus_compare(const struct bus *bus, char *error);
/**
 * Start-up SDOs of @transition, IP in PRE-OP or SO in SAFE-OP, of all slaves; bus_map() does those
 * of PS itself. 0; -errno, the first one that failed.
 */
int bus_startup(struct bus *bus, enum config_transition transition, char *error);
/** 1 if there is a start-up SDO of @transition. */
int bus_has_startup(const struct bus *bus, enum config_transition transition);
/** Those of OS of the slaves that are in OP, before bus_stop_outputs(); at most
 * BUS_STARTUP_DOWN_NS. Goes on with the other slaves after a failure, and keeps the first one. */
int bus_startup_down(struct bus *bus, char *error);
#define BUS_STARTUP_DOWN_NS (250 * NS_PER_MS)
/** Start-up SDOs of PS, SM and FMMU, PDO mapping (CoE or SII) into the channel table, watchdog
 * (T08), exchange plan. */
int bus_map(struct bus *bus, char *error);
/** Filters, latch, delays, the schedule check (-EINVAL: cycle.period is too short), offsets, burst,
 * check of 0x092C. Without DC slaves only the schedule check. */
int bus_dc_setup(struct bus *bus, char *error);

/* The cycle runs from here on (line_ride_begin), FRMW and LRW go every period. */

/**
 * One common SYNC0 start for all slaves with cyclic SYNC0, at a multiple of the period after
 * @dc_now_ns with margin; verified by 0x0984 and read back (T10), retried if it was missed.
 * One-shot slaves get 0x0980 = PDI. Call when the servo is locked.
 */
int bus_sync0_start(struct bus *bus, int64_t dc_now_ns, char *error);
/** All slaves to @state (SAFE-OP, OP, PRE-OP, INIT), with AL errors named by slave, code and text.
 */
int bus_request_state(struct bus *bus, enum al_state state, span_t timeout, char *error);
/**
 * Ask one slave for @request, an enum al_state, with AL_ERROR to acknowledge its error in that
 * state; one frame. Without an error the bit must not be there: a device emulation (0x0141 bit 0)
 * shows it as an error of its own. The bus must not be in operation: its supervision would lead the
 * slave back.
 */
int bus_slave_al_request(struct bus *bus, size_t pos, uint16_t request, char *error);
/** AL status and code of one slave, 0x0130 to 0x0135; one frame. */
int bus_slave_al_read(struct bus *bus, size_t pos, uint8_t ret_al[6], char *error);
/**
 * Before a slave in INIT is asked for @state, AL_PREOP or AL_BOOT: its mailbox SyncManagers get the
 * boxes of that state from its SII; one frame. Until bus_slave_mailbox_follow() it has no mailbox.
 */
int bus_slave_mailbox_program(struct bus *bus, size_t pos, uint16_t state, char *error);
/** 1 if its SII gives mailboxes for BOOT: it has that state. */
int bus_slave_has_boot(const struct bus *bus, size_t pos);
/**
 * Before a slave of a bus that is not in operation is asked for @state, AL_SAFEOP or AL_OP: its
 * start-up SDOs, and for SAFE-OP its SyncManagers and FMMUs. To be called until it is not 1, while
 * mailboxes are served: 1 SDOs are being written; 0; -errno with a line in @error.
 */
int bus_slave_set_up(struct bus *bus, size_t pos, uint16_t state, char *error);
/** The slave is in @state, an enum al_state: requests to its mailbox are possible, or, in INIT, no
 * more. */
void bus_slave_mailbox_follow(struct bus *bus, size_t pos, uint16_t state);
/** The first step of an ordered stop, while the cycle runs: all that answer to SAFE-OP, in 150 ms.
 */
int bus_stop_outputs(struct bus *bus, char *error);
/**
 * SYNC0 off, all that answer to INIT; continues after errors, and takes 150 ms per state at most.
 * Also after a scan that was cancelled. The cycle must have set the outputs to fail-safe.
 */
int bus_stop(struct bus *bus, char *error);

/* --- in OP, a few times a second --- */

struct bus_watch_report {
	unsigned slaves_op;
	unsigned slaves_lost;
	struct slave_set in_op;
	unsigned strangers;  /* devices on the wire that are none of the slaves */
	int is_reference_op; /* or there is none */
	int is_all_op;
	char trouble[BUS_TROUBLE_BYTES]; /* the first thing that is wrong, in one line; "": nothing
					  */
	char notice[BUS_TROUBLE_BYTES];  /* what is not wrong, but is to be known: absent slaves */
};

/**
 * Read AL state, error counters, DC difference of every slave into @page (its slave[] entries),
 * emit events through @emit, and fill @ret_report. It writes to devices that are none of the
 * slaves, and to those that have come back, only (bus/places.h): their addresses.
 */
int bus_watch(struct bus *bus, struct status_page *page,
	      void (*emit)(void *ctx, const struct event *ev), void *emit_ctx,
	      struct bus_watch_report *ret_report);

/**
 * For a working counter that stays low while all slaves are in OP: one frame or two that compare
 * SyncManagers and FMMUs of some slaves, others at the next call, with what bus_map() programmed.
 * 1: @ret_text names the slave and what is switched off or changed; 0: nothing was found in these,
 * and it is empty. 128 bytes are always enough.
 */
int bus_map_check(struct bus *bus, char *ret_text, size_t text_bytes);

/**
 * Acknowledge errors and restore slaves that fell back to SAFE-OP or PRE-OP or were power-cycled to
 * OP (with DC redone for a returned slave, T18), a step per call. After bus_watch(), when its
 * report has been acted on: a slave on its way through INIT takes the working counter from all.
 */
void bus_lead_back(struct bus *bus, void (*emit)(void *ctx, const struct event *ev),
		   void *emit_ctx);

/**
 * Is the one device that answers to the reference clock's address the reference clock: by its
 * clock's offset and its identity? 1; 0; -EAGAIN: its EEPROM is still being read, it does not
 * answer, or two do: call again. Takes at most two frames, the EEPROM is read by bus_step(). For
 * exchange_doubts_reference().
 */
int bus_reference_is_itself(struct bus *bus);

/** An operator has seen the alarms: slaves that were given up are tried again. */
void bus_clear_alarms(struct bus *bus);

/* --- what was found; valid after bus_map() (slaves: after bus_scan()) --- */

const struct slave_info *bus_slaves(const struct bus *bus, size_t *ret_count);
/** Write to @page (its slave[] entries) where each slave is in the tree of ports, and the delays of
 * the cables once bus_dc_setup() has measured them. */
void bus_show_places(const struct bus *bus, struct status_page *page);
/** The SII of the slave at @pos as bus_scan() read it: the categories that matter, the rest zero.
 */
const uint8_t *bus_slave_sii(const struct bus *bus, size_t pos, size_t *ret_bytes);
/**
 * The start-up SDOs of the slave at @pos (base/startup_record.h) to @buf, as many as fit whole.
 * Returns the bytes of all. Nothing before bus_scan().
 */
size_t bus_startup_list(const struct bus *bus, size_t pos, uint8_t *buf, size_t buf_len);
const struct channel *bus_channels(const struct bus *bus, size_t *ret_count);
const struct exchange_plan *bus_plan(const struct bus *bus);
/** What the cyclic frames need of the period; valid after bus_dc_setup(). */
const struct schedule *bus_schedule(const struct bus *bus);

/* --- mailbox and registers, in any state from PRE-OP on --- */

/** The mailboxes of all slaves: requests that do not block (mailbox/mailbox.h). */
struct mailbox_engine *bus_mailbox(struct bus *bus);
/**
 * One pass of what goes on between the polls: the mailboxes, and one frame for all EEPROMs that are
 * being read to identify returned slaves and new devices. @ex: the exchange that runs, which shows
 * which mailboxes are full; NULL: none, they are polled. In OP once a cycle or so while the bus is
 * busy, else a few times a second.
 */
void bus_step(struct bus *bus, const struct exchange *ex);
int bus_is_busy(const struct bus *bus);

/**
 * Begin a request to a mailbox: @rq has protocol, slave, parameters, buffer and done(); its result
 * comes from bus_step(). 0; -ENODEV, -ENOTSUP, -EIO the slave is lost, -EINVAL, and done() is not
 * called.
 */
int bus_mailbox_submit(struct bus *bus, struct mailbox_request *rq);
void bus_mailbox_cancel(struct bus *bus, struct mailbox_request *rq);
/**
 * One SDO transfer; blocking, at most bus.mailbox_timeout for each mail. A download is never
 * executed twice. @ret_abort is the SDO abort code or 0. Size in @len is updated by read.
 */
int bus_sdo_read(struct bus *bus, uint16_t slave_pos, uint16_t index, uint8_t subindex,
		 uint8_t *ret_data, size_t *len, uint32_t *ret_abort);
int bus_sdo_write(struct bus *bus, uint16_t slave_pos, uint16_t index, uint8_t subindex,
		  const uint8_t *data, size_t len, uint32_t *ret_abort);

#endif
