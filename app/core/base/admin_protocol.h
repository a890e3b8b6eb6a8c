/* SPDX-License-Identifier: MIT */
/*
 * The admin socket of ecdaqd ("admin" in the run directory, SOCK_SEQPACKET, mode 0660, group from
 * configuration): requests and replies of fixed size. Little-endian hosts only; both ends are on
 * one machine. Reading needs no socket: it is done on the status page and the rings.
 *
 * A client may have several requests open; each reply carries the id of its request, and replies
 * come in any order. A request ends with one reply of kind ADMIN_REPLY_DONE; before it, replies of
 * kind ADMIN_REPLY_PROGRESS (how far it is) and ADMIN_REPLY_DATA (data that do not fit into one
 * message) may come. ADMIN_CANCEL, a timeout, or closing the socket ends a request early. PING,
 * STOP and CANCEL are answered at once, whatever else is open.
 *
 * A request with more data than ADMIN_DATA_BYTES announces them in data_total; the rest follows in
 * ADMIN_DATA messages of the same id, in order, and it is executed when all of it is there.
 */
#ifndef BASE_ADMIN_PROTOCOL_H
#define BASE_ADMIN_PROTOCOL_H

#include <assert.h>
#include <stdint.h>

#include "limits.h"

#define ADMIN_MAGIC UINT32_C(0x32614445) /* "EDa2": the digit is the version */

enum admin_verb {
	ADMIN_PING = 1,
	ADMIN_SET = 2,       /* output channels to raw values: count, item[] */
	ADMIN_ONESHOT = 3,   /* slave_pos or ADMIN_ALL_SLAVES, dc_time_ns (absolute) or relative if
				is_relative */
	ADMIN_SDO_READ = 4,  /* slave_pos, index, subindex; argument[0] 1: the whole object, from
				subindex 0 or 1 on (complete access) */
	ADMIN_SDO_WRITE = 5, /* the same, data */
	ADMIN_STOP = 6,      /* orderly stop of the bus and the daemon */
	ADMIN_CLEAR = 7,     /* histograms and counters to zero */
	ADMIN_CANCEL = 8,    /* end the open request of this id; no reply of its own unless there is
				none: -ENOENT */
	ADMIN_DATA = 9,      /* more data of the request of this id: data_offset, data */
	ADMIN_RESCAN = 10,   /* take the bus down and bring it up again; answered when that has
				ended; argument[1] 1: also in operation */
	ADMIN_STATE = 11,    /* slave_pos to argument[0], an enum al_state; data: the AL state it is
				in; ADMIN_ALL_SLAVES: the bus is led there, and stays there */
	ADMIN_REGISTER_READ = 12,  /* slave_pos, address, length: up to ADMIN_REGISTER_BYTES */
	ADMIN_REGISTER_WRITE = 13, /* slave_pos, address, data; argument[1] 1: also what the master
				      needs unchanged while the bus is in operation */
	ADMIN_SII_READ = 14,       /* slave_pos; data: the whole EEPROM; argument[0] 1: as it was
				      read at the start, which takes no frame: the categories that
				      the master uses, zeros between them */
	ADMIN_SII_WRITE = 15,      /* slave_pos, data: the image; argument[1] 1: also in SAFE-OP and
				      OP, and of another device; data: struct admin_sii_written */
	ADMIN_SII_ALIAS = 16,      /* slave_pos, argument[0]; argument[1] and answer as SII_WRITE */
	ADMIN_DIAGNOSIS = 17,      /* slave_pos; data: struct admin_diagnosis */
	ADMIN_ERRORS_RESET = 18,   /* slave_pos: its error counters to zero */
	/* --- mailboxes; with the two of SDOs above. A slave that refuses: reply.slave_code --- */
	ADMIN_SDO_LIST = 19,    /* slave_pos, argument[0]: 0 lengths of the lists, 1 all objects,
				   2 RxPDO, 3 TxPDO, 4 backup, 5 settings; data: words of 16 bits */
	ADMIN_SDO_OBJECT = 20,  /* slave_pos, index; data: struct admin_sdo_object */
	ADMIN_SDO_ENTRY = 21,   /* slave_pos, index, subindex; data: struct admin_sdo_entry */
	ADMIN_FOE_READ = 22,    /* slave_pos, name, argument[0]: password, 0 none; data: the file */
	ADMIN_FOE_WRITE = 23,   /* the same, data: the file; may be empty */
	ADMIN_SOE_READ = 24,    /* slave_pos, index: IDN, subindex: drive, argument[0]: elements
				   (enum soe_element of wire/soe.h); data: as soe.h has them */
	ADMIN_SOE_WRITE = 25,   /* the same, data: the one element */
	ADMIN_EOE_IP_READ = 26, /* slave_pos, argument[0]: port; data: as eoe_ip_get() of
				   wire/eoe.h takes them */
	ADMIN_EOE_IP_WRITE = 27, /* the same, data: as eoe_ip_put() writes them */
	ADMIN_AOE_READ = 28,     /* slave_pos, argument[0]: index group, [1]: index offset, [2]: AMS
				    port, name: AMS Net ID ("": zeros), length: bytes at most; data.
				    An SDO: AOE_GROUP_SDO and aoe_sdo_offset() of wire/aoe.h */
	ADMIN_AOE_WRITE = 29,    /* the same, data */
	ADMIN_VOE = 30, /* slave_pos, argument[0]: vendor, [1]: vendor's type, [2] 1: no answer is
			   waited for, data; data: the answer's type (2 bytes), then its data */
	/* --- the cyclic frames --- */
	ADMIN_DATAGRAMS = 31, /* data: struct admin_datagram, one each of the cyclic frames */
	ADMIN_CAPTURE = 32, /* frames go to the ring "frames" (base/frame_record.h); stays open, one
			       PROGRESS when they do, until it is cancelled or its client gone */
	ADMIN_COMPARE = 48, /* what is configured with what is found; text: the file, data: struct
			       difference of base/difference.h, none or more */
	ADMIN_CONFIG_RELOAD = 49, /* read the configuration again; text: the file, data: struct
				     config_change of base/config_change.h, none or more */
	ADMIN_STARTUP = 50, /* slave_pos; text: the configuration's file, data: start-up SDOs as
			       base/startup_record.h has them */
};

/* Every slave with a one-shot output, all in one cycle or none. */
#define ADMIN_ALL_SLAVES UINT16_C(0xffff)

enum {
	ADMIN_ITEMS = 64,
	ADMIN_DATA_BYTES = 1024, /* in one message */
	ADMIN_TEXT_BYTES = 256,
	ADMIN_NAME_BYTES = 64,
	ADMIN_ARGUMENTS = 4,
	ADMIN_PORTS = 4,                 /* of a slave */
	ADMIN_REGISTER_BYTES = 256,      /* in one access */
	ADMIN_TRANSFER_BYTES = 16 << 20, /* in one request or answer: a firmware image */
	ADMIN_TIMEOUT_MS_MAX = 3600 * 1000,
	ADMIN_TIMEOUT_S = 20,           /* of most verbs, see admin_timeout_ns() */
	ADMIN_BRING_UP_TIMEOUT_S = 600, /* its own time-outs together may be longer */
};

struct admin_item {
	char channel[LIMIT_NAME_BYTES];
	uint64_t raw;
};

struct admin_request {
	uint32_t magic;
	uint32_t verb;       /* enum admin_verb */
	uint32_t id;         /* chosen by the client, different among its open requests */
	uint32_t timeout_ms; /* 0: the verb's own, admin_timeout_ns() */
	uint32_t count;      /* of item[] */
	uint16_t slave_pos;
	uint16_t index;
	uint8_t subindex;
	uint8_t is_relative;
	uint16_t reserved;    /* 0 */
	uint32_t address;     /* register, or byte of the SII */
	uint32_t length;      /* bytes to read */
	uint32_t data_len;    /* bytes in data[] */
	uint32_t data_total;  /* bytes in all; 0: data_len */
	uint32_t data_offset; /* ADMIN_DATA: place of data[] among them */
	int64_t dc_time_ns;
	uint32_t argument[ADMIN_ARGUMENTS]; /* as the verb says; 0 else */
	char name[ADMIN_NAME_BYTES];        /* as the verb says; "" else */
	struct admin_item item[ADMIN_ITEMS];
	uint8_t data[ADMIN_DATA_BYTES];
};

enum admin_reply_kind {
	ADMIN_REPLY_DONE = 0,     /* the last one; with the last data */
	ADMIN_REPLY_DATA = 1,     /* data_offset, data_len, data; more follow */
	ADMIN_REPLY_PROGRESS = 2, /* done of total */
};

struct admin_reply {
	uint32_t magic;
	uint32_t id;                 /* of its request */
	uint32_t kind;               /* enum admin_reply_kind */
	int32_t result;              /* 0 or -errno */
	uint32_t slave_code;         /* the slave refused: SDO abort code, FoE, SoE or ADS error,
					EoE result, as the verb has it; 0: it did not */
	uint32_t data_len;           /* bytes in data[] */
	uint32_t data_offset;        /* their place among data_total */
	uint32_t data_total;         /* bytes of the whole answer */
	uint32_t done;               /* PROGRESS: in the unit of total */
	uint32_t total;              /* 0: not known */
	uint64_t cycle;              /* in which it took effect; SET, ONESHOT */
	int64_t dc_time_ns;          /* ONESHOT: the absolute time armed */
	char text[ADMIN_TEXT_BYTES]; /* one line: why it failed; else as the verb says */
	uint8_t data[ADMIN_DATA_BYTES];
};

/* Answer of ADMIN_SII_WRITE and ADMIN_SII_ALIAS, in words of 16 bits. */
struct admin_sii_written {
	uint32_t compared;
	uint32_t written; /* that differed; 0: the EEPROM is unchanged */
};

/* Answer of ADMIN_SDO_OBJECT. */
struct admin_sdo_object {
	uint16_t index;
	uint16_t data_type; /* ETG.1020 */
	uint8_t subindex_max;
	uint8_t object_code;         /* 7 variable, 8 array, 9 record */
	char name[ADMIN_NAME_BYTES]; /* as the slave sent it, ends with 0 */
};

/* Answer of ADMIN_SDO_ENTRY. */
struct admin_sdo_entry {
	uint16_t index;
	uint16_t data_type; /* ETG.1020 */
	uint16_t bit_len;
	uint16_t access; /* bits 0 to 2 read in PRE-OP, SAFE-OP, OP; 3 to 5 write; 6 RxPDO, 7 TxPDO
			  */
	uint8_t subindex;
	uint8_t reserved;
	char name[ADMIN_NAME_BYTES];
};

/* Link and error counters of a port; a counter stops at 255. */
struct admin_port {
	uint8_t is_link;
	uint8_t is_communicating;
	uint8_t is_ebus; /* contacts between modules, no cable */
	uint8_t invalid_frames;
	uint8_t rx_errors;
	uint8_t forwarded_errors;
	uint8_t lost_links;
};

/* Answer of ADMIN_DIAGNOSIS: the error counters in a slave's registers. */
struct admin_diagnosis {
	struct admin_port port[ADMIN_PORTS];
	uint8_t has_processing_errors; /* the slave has the next two */
	uint8_t processing_errors;
	uint8_t pdi_errors;
	uint8_t has_expirations; /* the slave has the next two */
	uint8_t expirations_pd;  /* of the process data watchdog */
	uint8_t expirations_pdi;
};

#define ADMIN_WKC_UNKNOWN UINT16_C(0xffff)

/* Answer of ADMIN_DATAGRAMS: one of them for each, in the order in which they are sent. */
struct admin_datagram {
	uint8_t command; /* enum ecat_cmd of wire/datagram.h */
	uint8_t frame;
	uint16_t bytes;
	uint32_t address;      /* logical; else the register << 16 and the station address */
	uint16_t wkc_expected; /* with all slaves in OP; ADMIN_WKC_UNKNOWN: any */
	uint16_t wkc;          /* as it came back last; ADMIN_WKC_UNKNOWN: it did not */
};

static_assert(sizeof(struct admin_datagram) == 12, "both ends agree");
static_assert(sizeof(struct admin_diagnosis) <= ADMIN_DATA_BYTES, "it is one message");
static_assert(sizeof(struct admin_sdo_object) == 70, "both ends agree");
static_assert(sizeof(struct admin_sdo_entry) == 74, "both ends agree");
static_assert(sizeof(struct admin_request) == 136 + 64 * 72 + 1024, "both ends agree");
static_assert(sizeof(struct admin_reply) == 56 + 256 + 1024, "both ends agree");

/**
 * Time after which ecdaqd ends @request with -ETIMEDOUT. A client waits some seconds longer for
 * each message of the answer. Context: any.
 */
int64_t admin_timeout_ns(const struct admin_request *request);

#endif
