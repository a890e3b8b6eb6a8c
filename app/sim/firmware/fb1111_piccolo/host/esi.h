/* SPDX-License-Identifier: MIT */
/* The slave's ESI file (ETG.2000), made from description.c and objects.c. */
#ifndef FB1111_PICCOLO_HOST_ESI_H
#define FB1111_PICCOLO_HOST_ESI_H

#include <stdio.h>

/** Write the XML; errors show in ferror(@out). Context: blocking. */
void fb1111_piccolo_esi(FILE *out);

/** The <Dictionary> element of it. */
void fb1111_piccolo_esi_dictionary(FILE *out);

/** "UINT" and so on; "" for padding. */
const char *fb1111_piccolo_esi_type(unsigned type);

#endif
