/* SPDX-License-Identifier: MIT */
/*
 * The keys of DDS Security: a directory with two certificate authorities and one directory per
 * participant, which contains what the participant needs and nothing else. File names are those of
 * SROS 2.
 *
 *   ca/            identity_ca.key.pem, permissions_ca.key.pem: these admit participants
 *   appliance/     for ecdaq-dds (dds.security)
 *   NAME/          for one subscriber or commander
 *     identity_ca.cert.pem  permissions_ca.cert.pem  governance.p7s
 *     cert.pem  key.pem  permissions.p7s
 */
#ifndef KEYSTORE_STORE_LAYOUT_H
#define KEYSTORE_STORE_LAYOUT_H

enum keystore_role {
	KEYSTORE_APPLIANCE,  /* publishes, accepts commands */
	KEYSTORE_SUBSCRIBER, /* reads what is published, writes nothing */
	KEYSTORE_COMMANDER,  /* a subscriber that writes commands */
};

enum { KEYSTORE_NAME_BYTES = 41, KEYSTORE_ERROR_BYTES = 512 };

/* In each participant's directory. */
#define KEYSTORE_IDENTITY_CA "identity_ca.cert.pem"
#define KEYSTORE_PERMISSIONS_CA "permissions_ca.cert.pem"
#define KEYSTORE_GOVERNANCE "governance.p7s"
#define KEYSTORE_CERT "cert.pem"
#define KEYSTORE_KEY "key.pem"
#define KEYSTORE_PERMISSIONS "permissions.p7s"

#endif
