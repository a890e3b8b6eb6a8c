/* SPDX-License-Identifier: MIT */
/*
 * What SOEM's sources expect of the system's compiler, for gcc and clang on Linux. Written for
 * ecdaq; the names are those that these sources use.
 */
#ifndef LINK_UNDER_SOEM_OSAL_DEFS_H
#define LINK_UNDER_SOEM_OSAL_DEFS_H

#if defined(__BYTE_ORDER__) && __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__
#define EC_BIG_ENDIAN
#endif

/* SOEM's own progress texts; bus/ reports errors itself. */
#define EC_PRINT(...)                                                                              \
	do {                                                                                       \
	} while (0)

#define PACKED_BEGIN
#define PACKED __attribute__((__packed__))
#define PACKED_END

#endif
