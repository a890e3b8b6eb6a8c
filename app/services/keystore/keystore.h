/* SPDX-License-Identifier: MIT */
/*
 * The keys of DDS Security: create the store and its participants, check them
 * (keystore/store_layout.h has what is where). Context: blocking; start-up and command line only.
 */
#ifndef KEYSTORE_KEYSTORE_H
#define KEYSTORE_KEYSTORE_H

#include <stddef.h>
#include <stdint.h>

#include "keystore/store_layout.h"

/**
 * Create the store @dir, which must not exist or be empty, with the appliance's directory in it.
 * Keys and certificates of participants are valid for @days. 0, or -errno with one line in @error
 * (KEYSTORE_ERROR_BYTES); -EEXIST: a store exists.
 */
int keystore_init(const char *dir, unsigned days, char *error);

/**
 * Add the participant @name with its directory, which must not exist: to renew a participant,
 * remove it first. The appliance's name is "appliance". Same errors; -EINVAL: invalid name;
 * -ENOENT: no store in @dir.
 */
int keystore_add(const char *dir, const char *name, enum keystore_role role, unsigned days,
		 char *error);

struct keystore_identity {
	char name[KEYSTORE_NAME_BYTES + 24]; /* subject of the certificate, "CN=appliance" */
	int64_t expires_s;                   /* Unix; of certificate and permissions, the earlier */
};

/**
 * Check that the participant's directory @dir is complete and consistent, not accessible to others,
 * and valid at @now_s (Unix). 0 and @ret_identity; -errno with one line in @error that names the
 * file: -ENOENT, -EACCES, -EPERM accessible to others, -EKEYEXPIRED, -EKEYREJECTED.
 */
int keystore_check(const char *dir, int64_t now_s, struct keystore_identity *ret_identity,
		   char *error);

#endif
