/* SPDX-License-Identifier: MIT */
/* Vendor specific protocol over EtherCAT (VoE, ETG.1000.6 part 5.10). Context: any, RT-safe. */
#ifndef WIRE_VOE_H
#define WIRE_VOE_H

/* Vendor ID (as in the SII), vendor's type; then data of the vendor's own. */
enum voe_layout { VOE_VENDOR = 0, VOE_TYPE = 4, VOE_HEADER_BYTES = 6 };

#endif
