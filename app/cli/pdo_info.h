/* SPDX-License-Identifier: MIT */
/*
 * The process data of one slave: its SyncManagers, the PDOs that its SII has, and which of them are
 * assigned, by CoE (0x1C10 and on, with the present mapping) or else as the SII assigns them. Names
 * that both lack are those of ESI files (bus.esi_dir).
 * Context: blocking.
 */
#ifndef CLI_PDO_INFO_H
#define CLI_PDO_INFO_H

#include <stddef.h>
#include <stdint.h>

#include "cli/cli.h"
#include "wire/sii.h"

enum { PDO_INFO_PDOS = 256, PDO_INFO_ENTRIES = 4096, PDO_INFO_NO_SM = -1 };

struct pdo_info_entry {
	uint16_t index; /* 0: padding */
	uint8_t subindex;
	uint8_t bits;
	uint16_t type; /* ETG.1020; 0: not known */
	char name[SII_NAME_BYTES];
};

struct pdo_info_pdo {
	uint16_t index;
	int16_t sm;          /* assigned to, or by default; PDO_INFO_NO_SM */
	uint8_t is_tx;       /* TxPDO: inputs of the master */
	uint8_t is_assigned; /* now */
	uint8_t times;       /* assigned, as CoE has it; more than once is a mistake */
	char name[SII_NAME_BYTES];
	size_t first; /* of its entries */
	size_t count;
	uint32_t bits;
};

struct pdo_info {
	uint8_t *image; /* SII: the categories that the master uses, the rest is zero */
	size_t image_bytes;
	struct sii sii;
	char damage[128]; /* of the SII: what follows it is missing; "": none */
	int is_by_coe;    /* assignment and mapping are those of the object dictionary */
	char why[256];    /* not by CoE although the slave has it */
	struct pdo_info_pdo pdo[PDO_INFO_PDOS]; /* assigned ones first, in their order */
	size_t pdo_count;
	struct pdo_info_entry entry[PDO_INFO_ENTRIES];
	size_t entry_count;
};

/** Read those of the slave at @pos. EXIT_CODE_OK with @ret_info, freed with pdo_info_free(); or the
 * code of a failure, which has been reported. */
enum exit_code pdo_info_read(struct cli *cli, uint16_t pos, struct pdo_info **ret_info);
void pdo_info_free(struct pdo_info *info);
/** One line on standard error if they are not by CoE although the slave has it. */
void pdo_info_warn(const struct cli *cli, uint16_t pos, const struct pdo_info *info);

/** The type of SyncManager @sm as sii.h has it: what the SII says, else by its number. */
unsigned pdo_info_sm_type(const struct pdo_info *info, unsigned sm);
/** SyncManagers to look at: those of the SII, at least four. */
unsigned pdo_info_sm_count(const struct pdo_info *info);

enum { PDO_INFO_PORTS_BYTES = 5 };
/** A letter a port, as ESI and ENI files have it; blank: not there. "": the SII does not say. */
void pdo_info_ports(const struct pdo_info *info, char ret_text[PDO_INFO_PORTS_BYTES]);

#endif
