/* SPDX-License-Identifier: MIT */
/*
 * The keys of DDS Security: a folder with two certificate authorities and one folder for each
 * participant, which holds all that the participant needs and nothing else. File names are those of
 * SROS 2. Context: blocking; start-up and command line only.
 *
 *   ca/            identity_ca.key.pem, permissions_ca.key.pem: whoever has these lets people in
 *   appliance/     for ecdaq-dds (dds.security)
 *   NAME/          for one subscriber or commander
 *     identity_ca.cert.pem  permissions_ca.cert.pem  governance.p7s
 *     cert.pem  key.pem  permissions.p7s
 */
#ifndef KEYSTORE_KEYSTORE_H
#define KEYSTORE_KEYSTORE_H

#include <stddef.h>
#include <stdint.h>

enum keystore_role {
	KEYSTORE_APPLIANCE,  /* publishes all, takes commands */
	KEYSTORE_SUBSCRIBER, /* reads what is published, writes nothing */
	KEYSTORE_COMMANDER,  /* and writes commands */
};

enum { KEYSTORE_NAME_BYTES = 41, KEYSTORE_ERROR_BYTES = 512 };

/* Of each participant's folder. */
#define KEYSTORE_IDENTITY_CA "identity_ca.cert.pem"
#define KEYSTORE_PERMISSIONS_CA "permissions_ca.cert.pem"
#define KEYSTORE_GOVERNANCE "governance.p7s"
#define KEYSTORE_CERT "cert.pem"
#define KEYSTORE_KEY "key.pem"
#define KEYSTORE_PERMISSIONS "permissions.p7s"

/**
 * Make the store @dir, which must not be there or be empty, with the appliance's folder in it. Keys
 * and certificates of participants hold for @days. 0, or -errno with one line in @error
 * (KEYSTORE_ERROR_BYTES); -EEXIST: there is a store.
 */
int keystore_init(const char *dir, unsigned days, char *error);

/**
 * Add the participant @name with a folder of its own, which must not be there: to renew one, remove
 * it first. The appliance's name is "appliance". Same errors; -EINVAL: the name is none; -ENOENT:
 * no store in @dir.
 */
int keystore_add(const char *dir, const char *name, enum keystore_role role, unsigned days,
		 char *error);

struct keystore_identity {
	char name[KEYSTORE_NAME_BYTES + 24]; /* subject of the certificate, "CN=appliance" */
	int64_t expires_s;                   /* Unix; certificate or permissions, what ends first */
};

/**
 * Is the participant's folder @dir whole, does everything in it belong together, is it for our eyes
 * only, and valid at @now_s (Unix)? 0 and @ret_identity; -errno with one line in @error that names
 * the file: -ENOENT, -EACCES, -EPERM others may read the key, -EKEYEXPIRED, -EKEYREJECTED.
 */
int keystore_check(const char *dir, int64_t now_s, struct keystore_identity *ret_identity,
		   char *error);

#endif
