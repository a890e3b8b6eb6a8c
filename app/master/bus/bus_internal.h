/* SPDX-License-Identifier: MIT */
/*
 * What the files of bus/ share: the bus, its slaves, and the error functions. Positions
 * are 0-based everywhere but in SOEM's calls, which take soem_index(pos). Context: service thread.
 */
#ifndef BUS_INTERNAL_H
#define BUS_INTERNAL_H

#include <stddef.h>
#include <stdint.h>

#include "oshw.h"

#include "ethercatcoe.h"
#include "ethercatconfig.h"
#include "ethercatmain.h"

#include "base/startup_record.h"
#include "bus/bus.h"
#include "bus/dc_topology.h"
#include "bus/eeprom.h"
#include "bus/error_counters.h"
#include "bus/pdo.h"
#include "esi/device.h"
#include "mailbox/mailbox.h"
#include "wire/sii.h"

enum {
	PICCOLO_OBJECT_ADC = 0x6000,
	PICCOLO_SUBINDEX_ADC = 1,
	PICCOLO_SUBINDEX_COUNTER = 2,
	PICCOLO_OBJECT_MODE = 0x8000,
	PICCOLO_SUBINDEX_MODE = 1,
};

/* Way of a slave back to the bus (bus/recover.c); one step a call. */
enum recovery_step {
	RECOVERY_NONE,
	RECOVERY_BACK, /* it is lost, or answers and is not in OP: see what it has become */
	RECOVERY_INIT,
	RECOVERY_PREOP,
	RECOVERY_SETUP,  /* start-up SDOs, SM, FMMU, watchdog */
	RECOVERY_CLOCK,  /* offset, delay, filters */
	RECOVERY_SETTLE, /* wait for 0x092C */
	RECOVERY_SYNC0,
	RECOVERY_SAFEOP,
	RECOVERY_SAFEOP_SETUP, /* start-up SDOs of SO */
	RECOVERY_OP,
};

/* 0x0981 */
enum sync_activation {
	SYNC_ACTIVATE_UNIT = 0x01,
	SYNC_ACTIVATE_SYNC0 = 0x02,
	SYNC_ACTIVATE_SYNC1 = 0x04,
};

/* Contents of 0x1C32 or 0x1C33; 0: not given. */
struct sync_limits {
	uint16_t type; /* 0 free run, 1 SM event, 2 SYNC0, 3 SYNC1, 0x22 SM event of the other */
	uint32_t minimum_cycle_ns;
};

enum startup_state { STARTUP_IDLE, STARTUP_RUNNING, STARTUP_DONE, STARTUP_FAILED };

/* A start-up SDO, by position, in the order in which they are written (bus/startup_plan.c). */
struct startup_command {
	uint16_t slave_pos;
	enum config_transition transition;
	enum startup_origin origin;
	uint16_t index;
	uint8_t subindex;
	uint8_t is_complete;
	uint8_t type; /* as config_sdo.type */
	uint16_t len;
	uint64_t value;
	const uint8_t *octets;  /* NULL: value */
	const uint8_t *untyped; /* CONFIG_SDO_AUTO, or was it: the text of the configuration */
	const char *pdo;        /* STARTUP_OF_PDOS: as the configuration calls it; "" */
	int line;               /* of the configuration; 0: none */
};

enum { STARTUP_DESCRIPTION_BYTES = 192 };

/* The start-up SDOs of a slave in one transition, one after the other (bus/startup.c). */
struct bus_startup {
	enum startup_state state;
	enum config_transition transition;
	struct mailbox_request request;
	uint8_t data[8];
	uint8_t description[STARTUP_DESCRIPTION_BYTES];
	int is_asking;                   /* for the description, before it writes */
	size_t next;                     /* in bus->startup */
	struct startup_command *command; /* that runs, or failed */
	uint16_t found_type;             /* of the dictionary, where it does not fit */
	uint16_t found_bits;
	char untyped[96]; /* why there is no type for a value without one; "": there is */
	char trouble[BUS_ERROR_BYTES]; /* why it failed on the way back; "": it did not */
};

/* Time-outs of an ESI description; 0: it has none. */
struct esi_timeouts {
	int64_t preop_ns;
	int64_t op_ns; /* PRE-OP to SAFE-OP, and to OP */
	int64_t back_to_init_ns;
	int64_t request_ns; /* until its mailbox takes a mail */
	int64_t response_ns;
};

/* A module of a modular device. */
struct bus_module {
	uint16_t slave_pos;
	uint16_t slot; /* from 0 */
	uint32_t ident;
};

struct bus_slave {
	struct slave_info info;
	struct dc_node clock; /* ports, receive times, parent, delay */
	uint16_t esc_features;
	uint8_t is_clock_64bit;
	uint8_t is_lrw_forbidden;
	uint16_t assign_activate; /* low byte 0x0980, high byte 0x0981; 0: no SYNC0 */
	int64_t sync0_cycle_ns;   /* multiple or fraction of the master's */
	int64_t sync0_shift_ns;   /* of its mode and as configured */
	uint32_t sync1_after_ns;  /* 0x09a4 */
	size_t pdo_first;         /* its entries in bus->pdo */
	size_t pdo_count;
	int is_mapped_by_coe; /* 0: by its SII */
	int mailbox_bit;      /* of the mailbox states in the cyclic frames; -1: it has none */
	enum config_mode mode;
	struct esi_timeouts esi;
	struct sync_limits output_sync;
	struct sync_limits input_sync;
	uint8_t *sii; /* its own, on the heap: bus/sii_read.c */
	size_t sii_len;
	uint16_t eeprom_status; /* 0x0502 when it was read */
	/* bus/watch.c */
	uint16_t al_status; /* as last seen */
	uint16_t al_code;
	unsigned misses; /* looks in a row without an answer */
	int is_lost;
	uint8_t closed_ports;    /* towards strangers (bus/places.c) */
	int is_clock_set;        /* offset and delay are in place since its last power-up */
	int64_t clock_offset_ns; /* as written to 0x0920 */
	unsigned good_looks;     /* at 0x092C, in a row */
	struct error_counters errors;
	struct bus_startup startup;
	struct mailbox_slave_spec boot; /* its mailboxes in BOOT; out_bytes 0: none */
	enum recovery_step step;
	enum al_state accepted; /* request that it has taken in this step */
	mono_t step_deadline;
	mono_t retry_at;
	unsigned attempts; /* that failed */
	int is_unstable;   /* fell back with an error, and has not been in OP for long since */
	int is_latched;    /* left alone until an operator clears it */
	enum recovery_step trouble_step;
	uint16_t trouble_code; /* AL status code of the newest failure; 0: it was late */
	mono_t op_since;
};

/* What a device is by its EEPROM (bus/identity.h). */
struct bus_identity {
	uint32_t vendor; /* never 0 once read */
	uint32_t product;
	uint32_t revision;
	uint32_t serial;
	uint16_t alias;
};

/* Reads it: a frame at a time (bus/identity.h). */
struct identity_reader {
	int result; /* 1: being read; 0: done, or not begun; -errno */
	struct bus_identity identity;
	struct eeprom_command command;
	uint8_t words[16]; /* vendor, product, revision, serial */
	size_t len;        /* of them */
};

enum { GUESTS_MAX = 16 };

enum guest_kind {
	GUEST_NONE,
	GUEST_NEW,        /* isolated, not identified yet */
	GUEST_STRANGER,   /* of no slave of this session */
	GUEST_WRONG,      /* in the place of a lost slave, with another identity */
	GUEST_UNREADABLE, /* its EEPROM is blank, damaged or does not answer */
	GUEST_WAITING,    /* a lost slave, but it is not certain which one */
};

/* A device that a walk found and that is bound to no slave (bus/guests.h). */
struct bus_guest {
	enum guest_kind kind;
	uint16_t position;
	uint16_t came_with; /* station address */
	int owner;          /* the slave that has this address; -1: none */
	int expected;       /* the lost slave whose place it has; -1: none */
	int shut_by;        /* the slave whose port to it is closed; -1: it is on the wire */
	uint8_t shut_port;
	mono_t readable_by;
	struct bus_identity identity; /* vendor 0: not read yet */
	struct identity_reader reader;
};

struct bus_emit {
	void (*call)(void *ctx, const struct event *ev);
	void *ctx;
};

struct bus {
	const struct config *wanted; /* as configured */
	const struct config *cfg;    /* by position: @bound, after a scan */
	struct config bound;
	uint16_t identification[LIMIT_SLAVES]; /* explicit; 0: not asked for, or it has none */
	unsigned absent_count;                 /* optional slaves that were not found */
	int absent;                            /* the first of them, in @wanted */
	struct bus_emit listener;              /* of mailbox events */
	struct bus_esi esi;                    /* load NULL: none */
	const struct esi_library *library;     /* since the scan; NULL: none */
	struct bus_module *module;             /* that ESI describes, since PRE-OP */
	size_t module_count;
	struct line *line;
	struct mailbox_engine *mailbox;
	struct read_ahead *ahead; /* bus/read_ahead.c; NULL: not now */
	char *error;              /* of the public call that runs */
	uint8_t sequence;         /* index byte of our own frames */
	/* In bus_watch(), bus_map_check() or bus_lead_back(): what is lost is polled again soon, so
	 * fewer tries. */
	int is_looking;
	struct bus_slave slave[LIMIT_SLAVES];
	size_t slave_count;
	struct slave_info info[LIMIT_SLAVES]; /* what bus_slaves() shows */
	struct pdo_entry *pdo;                /* of all slaves, since the mapping */
	size_t pdo_count;
	struct channel *channel; /* since the mapping */
	size_t channel_count;
	struct startup_command *startup; /* since the scan */
	size_t startup_count;
	struct startup_command *assign; /* of slaves[].pdos[], since the mapping */
	size_t assign_count;
	struct exchange_plan plan;
	struct schedule schedule;
	int reference; /* position of the reference clock; -1: none */
	struct identity_reader reference_reader;
	int64_t reference_ns; /* its time as last read, and when */
	mono_t reference_at;
	int64_t sync0_start_ns; /* common grid; 0: SYNC0 was not started */
	enum al_state target;   /* state requested last */
	size_t next_recovery;   /* position served first */
	size_t next_detailed;   /* position whose counters are read first */
	size_t next_checked;    /* position that bus_map_check() begins with */
	struct bus_guest guest[GUESTS_MAX];
	/* SOEM */
	ecx_contextt context;
	ecx_portt port;
	ec_slavet soem_slave[LIMIT_SLAVES + 1];
	int soem_slave_count;
	ec_groupt group[EC_MAXGROUP];
	ec_eringt errors;
	ec_idxstackT index_stack;
	boolean has_error;
	int64_t dc_time;
	ec_SMcommtypet sm_comm_type;
	ec_PDOassignt pdo_assign;
	ec_PDOdesct pdo_description;
	ec_eepromSMt sii_sm;
	ec_eepromFMMUt sii_fmmu;
	struct sii parsed; /* the SII parsed last */
};

static inline uint16_t soem_index(size_t pos)
{
	return (uint16_t)(pos + 1);
}

/** What the configuration says of the slave at @pos; NULL: nothing. */
static inline const struct config_slave *bus_config_slave(const struct bus *bus, size_t pos)
{
	return pos < bus->cfg->slave_count ? &bus->cfg->slave[pos] : NULL;
}

mono_t bus_now(const struct bus *bus);
/** Free what bus_sii_load() read. */
void bus_sii_free(struct bus *bus);

/** Stamp @ev with the time now and hand it over. */
void bus_emit_event(struct bus *bus, const struct bus_emit *emit, struct event ev);
/** Write one line to the caller's error buffer. Returns @code. */
int bus_fail(struct bus *bus, int code, const char *format, ...)
	__attribute__((format(printf, 3, 4)));
/** "slave 1 (piccolo1): " and the line. Returns @code. */
int bus_fail_slave(struct bus *bus, size_t pos, int code, const char *format, ...)
	__attribute__((format(printf, 4, 5)));

/* --- enumerate.c --- */

/**
 * Count the slaves; all in INIT with defaults and station addresses; identity, alias and ports in
 * bus->slave. Returns how many, 0 for none, -E2BIG, -EIO with a line, or -errno of the line.
 */
int bus_enumerate(struct bus *bus);

/* --- sii_read.c --- */

/**
 * Read the SII of all slaves, at the same time, to their sii, sii_len, eeprom_status: the
 * categories that matter, the rest zero. 0 or -errno with a line. Where words 0 to 63 are blank or
 * damaged, only these.
 */
int bus_sii_load(struct bus *bus);

/* --- sii_entries.c --- */

/** Mapped entries of a slave by its SII, outputs first; how many, or -errno with a line. */
int bus_sii_entries(struct bus *bus, size_t pos, struct pdo_entry *ret, size_t capacity);
/** Name of the PDO of @e, and name and type of @e where it has no name, by bus->parsed, which is of
 * the slave at @pos: also of PDOs that are not assigned by default. */
void bus_sii_complete(const struct bus *bus, size_t pos, struct pdo_entry *e);

/* --- esi.c --- */

/** Ask for the descriptions of the slaves, whose identities are known. 0; -ENOMEM with a line. */
int bus_esi_load(struct bus *bus);
/** Name of the device; "": not known. */
const char *bus_esi_device_name(const struct bus *bus, size_t pos);
/** DC modes to bus->parsed, where the SII has none. */
void bus_esi_modes(struct bus *bus, size_t pos);
/** Time-outs to its slave. */
void bus_esi_timeouts(struct bus *bus, size_t pos);
/** The vendor's description of the slave; NULL: none. */
const struct esi_device *bus_esi_device(const struct bus *bus, size_t pos);
/** The description of a module, and its slot in that of its slave; NULL: none. */
const struct esi_device *bus_esi_module(const struct bus *bus, const struct bus_module *module,
					const struct esi_slot **ret_slot);
/** Names, types and units of entries that have none. */
void bus_esi_names(const struct bus *bus, size_t pos, struct pdo_entry *entry, size_t count);

/* --- modules.c --- */

/** Ask modular slaves in PRE-OP for their modules; those that the configuration says stay. The
 * modules' descriptions are loaded, and bus->startup has their commands. 0; -errno with a line. */
int bus_modules_load(struct bus *bus);

/* --- soem_slave.c --- */

/** SOEM's entry of a slave from bus->parsed. */
void bus_soem_describe(struct bus *bus, size_t pos);
/** Program the mailbox SyncManagers of all slaves and give them their EEPROMs. */
int bus_mailboxes_open(struct bus *bus);
/** The same of one slave in INIT, with the mailboxes of @state, AL_PREOP or AL_BOOT; one frame. 0;
 * -EIO; -ENXIO the slave did not take it. */
int bus_mailbox_program(struct bus *bus, size_t pos, uint16_t state);

/* --- scan.c --- */

/** What bus_slaves() shows becomes what is known now. */
void bus_publish_slaves(struct bus *bus);

/* --- read_ahead.c --- */

/**
 * Ask all slaves at the same time for the SDOs that @read reads of one slave with bus_sdo_value()
 * and bus_sdo_entry(). These give -EAGAIN where there is no answer yet, which @read passes on; what
 * else it does must bear being repeated, and nothing can be written meanwhile (-ECANCELED).
 * Afterwards both take their answers from there. 0; -errno with a line.
 */
int bus_read_ahead(struct bus *bus, int (*read)(struct bus *bus, size_t pos));
void bus_read_ahead_end(struct bus *bus);
/** For bus/mailbox.c: the answer to @rq; -EAGAIN: it is being asked for; -ENOENT: it was not. */
int bus_read_ahead_take(struct bus *bus, struct mailbox_request *rq);
/** 1 while nothing may be written. */
int bus_read_ahead_forbids(const struct bus *bus);
/** The slave was written to: what it answered before does not count. */
void bus_read_ahead_forget(struct bus *bus, size_t pos);

/* --- coe_map.c --- */

/** Read SM types, PDO assignment and mapping by CoE. Entries found, 0 if there are no such objects,
 * -EAGAIN (bus_read_ahead()), other -errno with a line. */
int bus_coe_entries(struct bus *bus, size_t pos, struct pdo_entry *ret, size_t capacity);
/** Complete entries without name, type or unit from the object dictionary (SDO information).
 * 0; -EAGAIN (bus_read_ahead()). */
int bus_coe_names(struct bus *bus, size_t pos, struct pdo_entry *entry, size_t count);

/* --- mailbox.c --- */

int bus_has_coe(const struct bus *bus, size_t pos);
/** A little-endian value of 1 to 8 bytes; @ret_abort as bus_sdo_read(). */
int bus_sdo_value(struct bus *bus, size_t pos, uint16_t index, uint8_t subindex,
		  uint64_t *ret_value, uint32_t *ret_abort);
/** Description of an entry by SDO information. 0; -errno. */
int bus_sdo_entry(struct bus *bus, size_t pos, uint16_t index, uint8_t subindex,
		  struct coe_entry *ret_entry);

/** The slave's mailbox SyncManagers were programmed, as SOEM has them. */
void bus_mailbox_set(struct bus *bus, size_t pos);

/** The event of an SDO that the slave aborted. */
void bus_tell_abort(struct bus *bus, size_t pos, uint16_t index, uint8_t subindex, uint32_t abort);

/* --- startup_plan.c --- */

/** bus->startup from the configuration by position. 0, or -errno with a line. */
int bus_startup_plan(struct bus *bus);

/* --- pdos.c --- */

/** slaves[].pdos[] of the slaves from position @from to before @end: check them against the slaves
 * in PRE-OP, and what has to be written for them into bus->startup. 0, or -errno with a line. */
int bus_pdos_plan(struct bus *bus, size_t from, size_t end);

/* --- startup_type.c --- */

/** Does the dictionary's entry take what @command writes? */
int startup_fits(const struct startup_command *command, const struct coe_entry *entry);
/**
 * Give @command of CONFIG_SDO_AUTO the type of @entry, and its text the value. 0, or -errno with
 * @why.
 */
int startup_resolve(struct startup_command *command, const struct coe_entry *entry, char *why,
		    size_t why_bytes);

/* --- startup.c --- */

/**
 * Start-up SDOs of one slave in @transition: begun, and polled until they are done, while the
 * engine is stepped. poll() begins them if begin() was not called. 1 they run; 0; -errno with a
 * line.
 */
void bus_startup_begin(struct bus *bus, size_t pos, enum config_transition transition);
int bus_startup_poll(struct bus *bus, size_t pos, enum config_transition transition);
void bus_startup_cancel(struct bus *bus, size_t pos);
/** Those of all slaves at the same time; blocking. */
int bus_startup_all(struct bus *bus, enum config_transition transition);

/* --- mailbox_state.c --- */

/** FMMUs of the mailbox states, from @logical_start on: @ret_count bits. 0, or -errno without a
 * line. */
int bus_mailbox_state_map(struct bus *bus, uint32_t logical_start, unsigned *ret_count);
/** The states of the newest frames of @ex, NULL: there are none, go to the mailboxes. */
void bus_mailbox_state_follow(struct bus *bus, const struct exchange *ex);

/* --- map_sm.c --- */

/** Set SOEM's SyncManagers and bit counts from a slave's entries; *total_bytes counts the image. 0
 * or -errno with a line. */
int bus_map_sm(struct bus *bus, size_t pos, uint32_t *total_bytes);

/* --- sync_mode.c --- */

/**
 * AssignActivate word, SYNC cycles and shifts of a slave from its settings and bus->parsed.
 * @damage: why the SII could not be parsed to its end, "". 0 or -errno with a line.
 */
int bus_sync_mode(struct bus *bus, size_t pos, const char *damage);

/* --- sync_limits.c --- */

/** Read 0x1C32 of a slave with outputs and 0x1C33 of one with inputs, if it has CoE; a cycle it
 * cannot follow is -EPROTO. Exactly 0, with neither too, or -errno with a line. */
int bus_sync_limits(struct bus *bus, size_t pos);

/* --- map.c --- */

/** SM, FMMU and watchdog of one slave, again, as bus_map() left them. */
int bus_restore_mapping(struct bus *bus, size_t pos);
/** The SyncManagers of one slave in PRE-OP, of a bus that bus_map() has not mapped. Blocking. 0, or
 * -errno with a line. */
int bus_map_one(struct bus *bus, size_t pos);

/* --- dc_restore.c, dc.c --- */

enum {
	CLOCK_TIME_FILTER = 0x00,  /* 0x0934: none */
	CLOCK_SPEED_FILTER = 0x0c, /* 0x0935: the ET1100's own default */
	CLOCK_SPEED_COUNTER_START = 0x1000,
};

/** Offset, delay (0 on the reference) and filters of one slave. 0 or -errno, without a line. */
int bus_clock_write(struct bus *bus, size_t pos, int64_t offset_ns);

/** Time of the reference clock now, by FPRD. */
int bus_reference_time(struct bus *bus, int64_t *ret_ns);
/** Offset, delay and filters of a slave that lost them, from the clocks that run. */
int bus_clock_restore(struct bus *bus, size_t pos);
/** |0x092C| of one slave; -errno. */
int64_t bus_clock_diff(struct bus *bus, size_t pos);

/* --- sync0.c --- */

/** Of the SYNC0 that the master starts in the slave; 0: it starts none. */
uint32_t bus_sync0_cycle_ns(const struct bus *bus, size_t pos);
/** 1 if the slave takes part in the common SYNC0, and it was started. */
int bus_sync0_is_wanted(const struct bus *bus, size_t pos);
/** SYNC unit of a slave that lost it: into the grid of the others, or back to its own controller.
 */
int bus_sync0_restore(struct bus *bus, size_t pos);
/** 1 if SYNC0 of the slave fires on the grid; 0 if not; -errno. */
int bus_sync0_is_running(struct bus *bus, size_t pos);
void bus_sync0_stop(struct bus *bus);

/* --- states.c --- */

/** "refuses SAFE-OP and is in PRE-OP: AL status code 0x0018, no valid inputs available" */
void bus_describe_refusal(uint16_t al_status, uint16_t code, enum al_state wanted, char *ret_text,
			  size_t text_bytes);
/** The state in words, also of a number that is no AL state. */
const char *bus_al_name(uint16_t al_status);

/* --- recover.c --- */

/** One step towards OP for a slave that is not there. */
void bus_recover(struct bus *bus, size_t pos, const struct bus_emit *emit);
/** A lost slave is there again: its way back begins. */
void bus_recover_begin(struct bus *bus, size_t pos, const struct bus_emit *emit);
/** The slave is in OP: after a while its failures are forgotten. */
void bus_recover_settled(struct bus *bus, size_t pos);
/** Forget them now: an operator says so. */
void bus_recover_forget(struct bus_slave *sl);
/** It was power-cycled: all of its way, without the failures of before. */
void bus_recover_restart(struct bus *bus, size_t pos);
/** What is wrong with a slave that is not in OP, in one line with its name. */
void bus_recover_describe(const struct bus *bus, size_t pos, char *ret_text, size_t text_bytes);

#endif
