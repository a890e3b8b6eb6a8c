/* SPDX-License-Identifier: MIT */
/* The file of uplink.credentials, in the form that tools of AWS read: sections, of which the first
 * or [default] counts, and "name = value". Context: blocking. */
#ifndef UPLINK_CREDENTIALS_H
#define UPLINK_CREDENTIALS_H

#include <stddef.h>

enum { CREDENTIALS_VALUE_BYTES = 256, CREDENTIALS_TOKEN_BYTES = 4096, CREDENTIALS_BYTES = 16384 };

struct credentials {
	char id[CREDENTIALS_VALUE_BYTES];
	char secret[CREDENTIALS_VALUE_BYTES];
	char token[CREDENTIALS_TOKEN_BYTES]; /* "": none */
};

/** 0; -EINVAL with what is missing in @problem (@ret untouched). */
int credentials_parse(const char *text, size_t len, struct credentials *ret, char *problem,
		      size_t problem_bytes);
/** The same of a file that others cannot read. 0; -EINVAL with a line in @problem. */
int credentials_read(const char *path, struct credentials *ret, char *problem,
		     size_t problem_bytes);

#endif
