/* SPDX-License-Identifier: MIT */
/* One access to registers of a slave, as a datagram does it. bus/registers.h runs them. */
#ifndef BUS_ACCESS_H
#define BUS_ACCESS_H

#include <stdint.h>

#include "wire/datagram.h"

struct access {
	enum ecat_cmd cmd;
	uint16_t adp;
	uint16_t reg;
	uint16_t len;
	void *data;   /* written from and, where it was read, read into; NULL: zeros */
	uint16_t wkc; /* out; APRD and FPRD with another than 1 have read nothing: 0 nobody answers,
			 2 it is ambiguous */
};

#endif
