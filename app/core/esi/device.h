/* SPDX-License-Identifier: MIT */
/* A device, or a module of one, as an ESI file describes it. Context: any. */
#ifndef ESI_DEVICE_H
#define ESI_DEVICE_H

#include <stddef.h>
#include <stdint.h>

#include "wire/coe_unit.h"

enum esi_limits {
	ESI_NAME_BYTES = 96,
	ESI_LIMIT_SM = 16,
	ESI_LIMIT_FMMU = 16,
	ESI_LIMIT_DC_MODES = 16,
	ESI_LIMIT_EXCLUDES = 32, /* of one PDO */
	ESI_LIMIT_PDOS = 1024,   /* of one device */
	ESI_LIMIT_ENTRIES = 16384,
	ESI_LIMIT_COMMANDS = 1024,
	ESI_LIMIT_COMMAND_BYTES = 1024,
	ESI_LIMIT_SLOTS = 256,
	ESI_LIMIT_TYPES = 16384,   /* data types of one dictionary */
	ESI_LIMIT_OBJECTS = 65536, /* its entries, and all parts of the types */
	ESI_LIMIT_GROUPS = 512,    /* of one file */
	ESI_LIMIT_DEVICES = 65536, /* of one file, with the modules */
	ESI_NO_SM = -1,
};

enum esi_kind { ESI_DEVICE, ESI_MODULE };

/* What a device or module is known by. */
struct esi_identity {
	enum esi_kind kind;
	uint32_t vendor;
	uint32_t product;  /* of a module: its ModuleIdent */
	uint32_t revision; /* of a module: 0 */
};

struct esi_entry {
	uint16_t index; /* 0: padding */
	uint8_t subindex;
	uint8_t depends_on_slot; /* of a module: @index is that of the first slot */
	uint16_t bits;
	uint16_t type;      /* ETG.1020; 0: none, or one of the device's own */
	char type_name[32]; /* as the file has it */
	char name[ESI_NAME_BYTES];
};

struct esi_pdo {
	uint16_t index;
	int8_t sm;     /* assigned to by default; ESI_NO_SM */
	uint8_t is_tx; /* TxPDO: inputs of the master */
	uint8_t is_fixed;
	uint8_t is_mandatory;
	uint8_t depends_on_slot; /* as of an entry */
	char name[ESI_NAME_BYTES];
	uint16_t exclude[ESI_LIMIT_EXCLUDES]; /* PDOs that it cannot be assigned with */
	size_t exclude_count;
	size_t first; /* of its entries */
	size_t count;
	uint32_t bits;
};

/* An entry of the object dictionary. */
struct esi_object {
	uint16_t index;
	uint8_t subindex;
	uint8_t depends_on_slot;   /* as of an entry of a PDO */
	uint16_t type;             /* as of an entry of a PDO */
	char unit[COE_UNIT_BYTES]; /* "": none */
	char name[ESI_NAME_BYTES];
};

struct esi_sm {
	uint8_t type; /* as in an SII: 1 mailbox out, 2 mailbox in, 3 outputs, 4 inputs; 0: other */
	uint8_t control;
	uint8_t enable;
	uint16_t start;
	uint16_t bytes; /* by default */
};

/* <OpMode>; the first one is the default. Factors as in struct sii_dc_mode. */
struct esi_dc_mode {
	char name[ESI_NAME_BYTES];
	char text[ESI_NAME_BYTES];
	uint16_t assign_activate; /* 0x0980 in the low byte, 0x0981 in the high byte */
	uint32_t sync0_cycle_ns;  /* 0: from the master's cycle, by sync0_factor */
	int16_t sync0_factor;
	int32_t sync0_shift_ns;
	int16_t sync1_factor;
	int32_t sync1_shift_ns;
};

enum esi_transition {
	ESI_TRANSITION_IP = 1 << 0,
	ESI_TRANSITION_PS = 1 << 1,
	ESI_TRANSITION_SO = 1 << 2,
	ESI_TRANSITION_OS = 1 << 3,
	ESI_TRANSITION_SP = 1 << 4,
	ESI_TRANSITION_PI = 1 << 5,
	ESI_TRANSITION_OTHER = 1 << 6,
};

/* <InitCmd> of CoE: written by SDO in a transition. */
struct esi_command {
	uint8_t transitions; /* enum esi_transition */
	uint8_t is_complete_access;
	uint8_t is_fixed;
	uint8_t depends_on_slot; /* as of an entry of a PDO */
	uint16_t index;
	uint8_t subindex;
	uint16_t len;
	uint8_t *data;
	char comment[ESI_NAME_BYTES];
};

/* One <Slot>: up to @max slots, one after the other. */
struct esi_slot {
	char name[ESI_NAME_BYTES];
	uint32_t min;
	uint32_t max;
	uint16_t pdo_increment;   /* from a slot to the next one */
	uint16_t index_increment; /* the same, of other objects */
	uint32_t module;          /* first ModuleIdent that fits it; 0: none is named */
	uint32_t module_count;
};

enum esi_coe_flag {
	ESI_COE_SDO_INFO = 1 << 0,
	ESI_COE_PDO_ASSIGN = 1 << 1,
	ESI_COE_PDO_CONFIG = 1 << 2,
	ESI_COE_PDO_UPLOAD = 1 << 3,
	ESI_COE_COMPLETE_ACCESS = 1 << 4,
};

struct esi_device {
	struct esi_identity id;
	int line; /* of the file */
	char vendor_name[ESI_NAME_BYTES];
	char type[ESI_NAME_BYTES]; /* order number, "EL1008" */
	char name[ESI_NAME_BYTES];
	char group[ESI_NAME_BYTES]; /* type of the group */
	char group_name[ESI_NAME_BYTES];
	char physics[8];           /* a letter a port: Y MII, K LVDS, H, or blank */
	uint32_t preop_timeout_ms; /* these six: 0, not given */
	uint32_t safeop_op_timeout_ms;
	uint32_t back_to_init_timeout_ms;
	uint32_t back_to_safeop_timeout_ms;
	uint32_t request_timeout_ms; /* of the mailbox */
	uint32_t response_timeout_ms;
	uint32_t eeprom_bytes;
	uint8_t has_mailbox;
	uint8_t protocols;            /* enum sii_mailbox_protocol */
	uint8_t coe;                  /* enum esi_coe_flag */
	uint8_t fmmu[ESI_LIMIT_FMMU]; /* 1 outputs, 2 inputs, 3 mailbox state; 0 other */
	size_t fmmu_count;
	struct esi_sm sm[ESI_LIMIT_SM];
	size_t sm_count;
	struct esi_dc_mode dc[ESI_LIMIT_DC_MODES];
	size_t dc_count;
	struct esi_pdo *pdo; /* in the order of the file */
	size_t pdo_count;
	struct esi_entry *entry;
	size_t entry_count;
	struct esi_object *object;
	size_t object_count;
	struct esi_command *command;
	size_t command_count;
	uint16_t slot_pdo_increment;
	uint16_t slot_index_increment;
	struct esi_slot *slot;
	size_t slot_count;
};

/* The caller of esi_read(). */
struct esi_visitor {
	/* 1: read it in full; 0: pass over it. NULL: all are wanted. */
	int (*select)(void *ctx, const struct esi_identity *id);
	/* A whole one; @device belongs to it now: esi_device_free(). 0 or -errno, which ends the
	 * reading. */
	int (*device)(void *ctx, struct esi_device *device);
	void *ctx;
};

/** NULL is fine. */
void esi_device_free(struct esi_device *device);

/** The PDO of that index; NULL. */
const struct esi_pdo *esi_find_pdo(const struct esi_device *device, uint16_t index);
/* By how much the indexes of a module are further up in its slot than in the first one; of a
 * device: 0. */
struct esi_shift {
	uint16_t pdos;
	uint16_t objects;
};

/* What a description says of a mapped entry; "" and 0: nothing. */
struct esi_known {
	const char *pdo_name;
	const char *name;
	const char *unit;
	uint16_t type;
};

/** Of the entry @index:@subindex in PDO @pdo of the slave: by the PDOs, then by the dictionary. */
struct esi_known esi_find_known(const struct esi_device *device, struct esi_shift shift,
				uint16_t pdo, uint16_t index, uint8_t subindex);
/** What describes slot @number, from 0; NULL: it has fewer. */
const struct esi_slot *esi_find_slot(const struct esi_device *device, unsigned number);
/** An entry of the object dictionary; NULL. */
const struct esi_object *esi_find_object(const struct esi_device *device, uint16_t index,
					 uint8_t subindex);
/** An entry of any PDO, of @pdo first (0: of none); NULL. */
const struct esi_entry *esi_find_entry(const struct esi_device *device, uint16_t pdo,
				       uint16_t index, uint8_t subindex);

#endif
