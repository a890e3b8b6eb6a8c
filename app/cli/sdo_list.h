/* SPDX-License-Identifier: MIT */
/* The object dictionary of a slave, by SDO information. Context: blocking. */
#ifndef CLI_SDO_LIST_H
#define CLI_SDO_LIST_H

#include "cli/mail.h"

/* Which part of it. */
struct sdo_part {
	uint16_t index;   /* from this object on; 0: from the first */
	uint8_t subindex; /* and of one object: from this entry on */
	int is_one;       /* that object alone */
	int is_indices;   /* no more than the indices of the objects */
	uint64_t count;   /* objects of indices, else entries of one object; 0: all */
};

/** Show objects of the slave of the request, each with its entries. */
enum exit_code sdo_list(struct mail *mail, const struct sdo_part *part);

#endif
