/* SPDX-License-Identifier: MIT */
/* The object dictionary of a slave, by SDO information. Context: blocking. */
#ifndef CLI_SDO_LIST_H
#define CLI_SDO_LIST_H

#include "cli/mail.h"

/** Show all objects of the slave of the request, each with its entries. */
enum exit_code sdo_list(struct mail *mail);

#endif
