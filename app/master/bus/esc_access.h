/* SPDX-License-Identifier: MIT */
/*
 * The ESC of one slave, by registers only and in any AL state: what `ecdaq reg` and `ecdaq sii`
 * need. Nothing here waits longer than one frame (line_transact()), so a caller can serve the
 * supervision between two calls. Context: service thread.
 *
 * Every call that fails writes one line to @error (BUS_ERROR_BYTES) and returns -errno: -ENODEV no
 * slave at that position, -EINVAL the arguments, -EPERM refused by a guard (the line names it),
 * -ENXIO the slave or the register does not answer, -EBADMSG more than one slave answered, -EIO the
 * frame was lost.
 */
#ifndef BUS_ESC_ACCESS_H
#define BUS_ESC_ACCESS_H

#include <stddef.h>
#include <stdint.h>

#include "bus/bus.h"
#include "bus/eeprom.h"
#include "wire/esc_reg.h"
#include "wire/sii.h"

enum { ESC_ACCESS_BYTES = 256 }; /* of one register access */

enum esc_guard {
	ESC_GUARDED, /* what the master needs unchanged is refused */
	ESC_FORCED,
};

/* --- registers (esc_access.c) --- */

/** Read 1 to ESC_ACCESS_BYTES bytes from register @reg of the slave at @pos. */
int esc_access_read(struct bus *bus, size_t pos, uint16_t reg, uint8_t *ret_data, size_t len,
		    char *error);

/**
 * Write them. While the bus is asked to be in SAFE-OP or OP, what the master itself sets is refused
 * with -EPERM unless @guard is ESC_FORCED: station address and alias, DL control, AL control,
 * reset, EEPROM interface, FMMUs, SyncManagers, DC and SYNC unit, watchdogs, process RAM.
 */
int esc_access_write(struct bus *bus, size_t pos, uint16_t reg, const uint8_t *data, size_t len,
		     enum esc_guard guard, char *error);

/** The name of the group of registers that a write of @len bytes at @reg is refused for while the
 * bus is in operation; NULL: none. */
const char *esc_access_guarded(uint16_t reg, size_t len);

/* --- diagnosis (esc_diagnosis.c) --- */

struct esc_port_diagnosis {
	uint8_t is_link;          /* physical link, DL status bit 4 + port */
	uint8_t is_loop_closed;   /* bit 8 + 2 * port */
	uint8_t is_communicating; /* bit 9 + 2 * port */
	uint8_t is_ebus;          /* 0x0007, bit 2 * port: 2, not MII */
	uint8_t invalid_frames;   /* 0x0300 + 2 * port; counters stop at 255 */
	uint8_t rx_errors;        /* 0x0301 + 2 * port */
	uint8_t forwarded_errors; /* 0x0308 + port */
	uint8_t lost_links;       /* 0x0310 + port */
};

struct esc_diagnosis {
	uint8_t type; /* 0x0000: 0x11 ET1100, 0x12 ET1200, 0x04 IP core ... */
	uint8_t revision;
	uint16_t build;
	uint16_t features;
	uint16_t dl_status; /* 0x0110, raw */
	uint16_t al_status; /* 0x0130 */
	uint16_t al_status_code;
	uint8_t is_pdi_operational;    /* DL status bit 0: EEPROM loaded, PDI ready */
	uint8_t is_pdi_watchdog_alive; /* DL status bit 1 */
	uint8_t is_enhanced_link;      /* DL status bit 2 */
	struct esc_port_diagnosis port[ESC_PORTS];
	uint8_t has_processing_errors; /* 0x030c and 0x030d exist */
	uint8_t processing_errors;     /* 0x030c */
	uint8_t pdi_errors;            /* 0x030d */
	uint8_t has_watchdog;
	uint8_t is_watchdog_alive;  /* 0x0440 bit 0: process data came in time, or it is off */
	int64_t watchdog_pd_ns;     /* 0: off */
	int64_t watchdog_pdi_ns;    /* 0: off */
	uint8_t has_expirations;    /* 0x0442 and 0x0443 exist */
	uint8_t expirations_pd;     /* 0x0442; stops at 255 */
	uint8_t expirations_pdi;    /* 0x0443 */
	uint8_t has_eeprom;         /* 0x0502 answered */
	uint16_t eeprom_status;     /* 0x0502 raw; eeprom.h has its bits */
	uint8_t is_eeprom_emulated; /* its firmware answers for the EEPROM */
};

/** All of it in one frame. What the slave's chip does not have stays 0. */
int esc_diagnosis_read(struct bus *bus, size_t pos, struct esc_diagnosis *ret, char *error);
/** Set its error counters (0x0300 to 0x0313) and watchdog counters to zero. The sums that
 * `ecdaq slaves` shows go on. */
int esc_errors_reset(struct bus *bus, size_t pos, char *error);

/* --- SII (sii_job.c) --- */

enum { SII_HEADER_WORDS = 8 };

enum sii_job_kind { SII_JOB_READ, SII_JOB_WRITE, SII_JOB_ALIAS };

/*
 * One read or write of an EEPROM, in steps of one frame. The caller owns it and its image, calls
 * begin, then step until it does not return 1, and may stop calling at any time: a write then
 * leaves what a power loss leaves. Fields are read only.
 *
 * Power loss during a write. The order is: word 7 gets a value that is the checksum of neither the
 * old nor the new words 0 to 6 nor of any mixture on the way; words from 8 on; words 0 to 6; word 7
 * with the new checksum. Words that do not differ are not written, each written word is read back.
 * So after a cut the EEPROM is one of: all old, all new, or marked as incomplete: its checksum is
 * wrong, the chip starts without its PDI (0x0502 bits 11 and 12), the slave stays in INIT, and
 * ecdaq reports "its EEPROM is damaged: checksum". Its EEPROM can be written from the bus in that
 * state; writing the same image again completes it.
 */
struct sii_job {
	enum sii_job_kind kind;
	size_t pos;
	uint16_t alias;
	enum esc_guard guard;
	uint8_t *image;          /* of the caller, read into */
	const uint8_t *contents; /* of the caller, written from */
	size_t capacity;         /* of image */
	size_t len_bytes;        /* of the EEPROM (read) or of the image (write) */
	size_t done_words;
	size_t total_words;   /* for progress; grows once the size is known */
	size_t written_words; /* that differed */
	char error[BUS_ERROR_BYTES];
	/* sii_job.c */
	struct bus *bus;
	struct eeprom_command command;
	int phase;
	uint32_t word;
	uint16_t header[SII_HEADER_WORDS]; /* as it was in the EEPROM */
	uint16_t wanted_header[SII_HEADER_WORDS];
	uint16_t words[12]; /* header and identity, while they are read */
	uint16_t pending;   /* value being written */
	uint8_t tries;
	uint8_t is_changed; /* a word differed: word 7 is marked */
};

/** Read the whole EEPROM, as far as its size word (0x3e) says, into @image. -ENOSPC from a step: it
 * is longer than @capacity (len_bytes says how long). */
int sii_job_read(struct sii_job *job, struct bus *bus, size_t pos, uint8_t *image, size_t capacity);

/**
 * Write @image. Checked first, -EINVAL with the reason: even length, checksum of words 0 to 7, a
 * walk through the categories that ends inside it, not longer than its own size word says, vendor
 * and product those of the slave (unless @guard is ESC_FORCED). Refused with -EPERM in SAFE-OP and
 * OP unless forced. Takes effect with the slave's next power-on.
 */
int sii_job_write(struct sii_job *job, struct bus *bus, size_t pos, const uint8_t *image,
		  size_t len_bytes, enum esc_guard guard);

/** Set the alias (word 4) and the checksum. Refused where the present checksum is wrong. */
int sii_job_alias(struct sii_job *job, struct bus *bus, size_t pos, uint16_t alias,
		  enum esc_guard guard);

/** One frame. 1: go on; 0: done; -errno with a line in job->error. */
int sii_job_step(struct sii_job *job);

/** Check an image as sii_job_write() does, without a slave. 0 or -EINVAL with a line in @error. */
int sii_image_check(const uint8_t *image, size_t len_bytes, char *error, size_t error_bytes);

#endif
