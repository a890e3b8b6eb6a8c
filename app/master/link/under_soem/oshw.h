/* SPDX-License-Identifier: MIT */
/*
 * SOEM's view of the network hardware: only a line (link/line.h). Written for ecdaq;
 * the names are those that SOEM's sources use.
 */
#ifndef LINK_UNDER_SOEM_OSHW_H
#define LINK_UNDER_SOEM_OSHW_H

#include "ethercattype.h"
#include "nicdrv.h"

#include "ethercatmain.h"

uint16 oshw_htons(uint16 host);
/** None: the NIC is chosen where the line's transport is made (link/packet_socket.h). */
ec_adaptert *oshw_find_adapters(void);
void oshw_free_adapters(ec_adaptert *adapter);

#endif
