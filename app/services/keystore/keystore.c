/* SPDX-License-Identifier: MIT */
#include "keystore/keystore.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "keystore/files.h"
#include "keystore/pki.h"
#include "keystore/policy.h"
#include "keystore/signed_text.h"

#define DAY_S INT64_C(86400)
#define CA_DAYS INT64_C(10950) /* 30 years: a new CA means new keys for every participant */
#define CA_DIR "ca"
#define APPLIANCE "appliance"
#define IDENTITY_KEY "identity_ca.key.pem"
#define PERMISSIONS_KEY "permissions_ca.key.pem"
#define NAME_CHARS "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-"

struct store {
	const char *dir;
	char ca_dir[FILES_PATH_BYTES];
	struct pki_pair identity;
	struct pki_pair permissions;
};

/* Valid since yesterday: the clocks of the participants differ. */
static struct pki_validity validity_of(int64_t days)
{
	int64_t now_s = (int64_t)time(NULL);

	return (struct pki_validity){ .not_before_s = now_s - DAY_S,
				      .not_after_s = now_s + days * DAY_S };
}

static void store_close(struct store *store)
{
	pki_free(&store->identity);
	pki_free(&store->permissions);
}

static int check_name(const char *name, enum keystore_role role, char *error)
{
	if (role == KEYSTORE_APPLIANCE && strcmp(name, APPLIANCE) == 0) {
		return 0;
	}
	if (name[0] == '\0' || name[0] == '-' || strlen(name) >= KEYSTORE_NAME_BYTES ||
	    name[strspn(name, NAME_CHARS)] != '\0') {
		return files_fail(error, -EINVAL,
				  "%s: invalid name: use 1 to %d letters, digits, _ and -, not "
				  "starting with -",
				  name, KEYSTORE_NAME_BYTES - 1);
	}
	if (strcmp(name, CA_DIR) == 0 || strcmp(name, APPLIANCE) == 0) {
		return files_fail(error, -EINVAL, "%s: reserved name", name);
	}
	return 0;
}

static int write_common(const struct store *store, const char *dir, char *error)
{
	char text[POLICY_TEXT_BYTES];
	size_t len = policy_governance(text);
	int r = pki_write_cert(store->identity.cert, dir, KEYSTORE_IDENTITY_CA, error);

	r = r < 0 ? r
		  : pki_write_cert(store->permissions.cert, dir, KEYSTORE_PERMISSIONS_CA, error);
	return r < 0 ? r
		     : signed_text_write(text, len, &store->permissions, dir, KEYSTORE_GOVERNANCE,
					 error);
}

static int write_own(const struct store *store, const char *dir, const struct policy_grant *grant,
		     char *error)
{
	struct pki_validity validity = { grant->not_before_s, grant->not_after_s };
	struct pki_pair pair = { .key = NULL };
	char text[POLICY_TEXT_BYTES];
	size_t len = policy_permissions(grant, text);
	int r = pki_make(grant->name, &store->identity, validity, &pair, error);

	r = r < 0 ? r : pki_write_key(pair.key, dir, KEYSTORE_KEY, error);
	r = r < 0 ? r : pki_write_cert(pair.cert, dir, KEYSTORE_CERT, error);
	r = r < 0 ? r
		  : signed_text_write(text, len, &store->permissions, dir, KEYSTORE_PERMISSIONS,
				      error);
	pki_free(&pair);
	return r;
}

static void remove_participant(const char *dir)
{
	static const char *const names[] = { KEYSTORE_IDENTITY_CA, KEYSTORE_PERMISSIONS_CA,
					     KEYSTORE_GOVERNANCE,  KEYSTORE_CERT,
					     KEYSTORE_KEY,         KEYSTORE_PERMISSIONS };
	char path[FILES_PATH_BYTES];
	char error[KEYSTORE_ERROR_BYTES];

	for (size_t i = 0; i < sizeof(names) / sizeof(names[0]); i++) {
		if (files_path(dir, names[i], path, error) == 0) {
			unlink(path);
		}
	}
	rmdir(dir);
}

static int add(const struct store *store, const char *name, enum keystore_role role, unsigned days,
	       char *error)
{
	struct pki_validity validity = validity_of(days);
	struct policy_grant grant = { .name = name,
				      .role = role,
				      .not_before_s = validity.not_before_s,
				      .not_after_s = validity.not_after_s };
	char dir[FILES_PATH_BYTES];
	int r = files_path(store->dir, name, dir, error);

	r = r < 0 ? r : files_make_dir(dir, error);
	if (r < 0) {
		return r;
	}
	r = write_common(store, dir, error);
	r = r < 0 ? r : write_own(store, dir, &grant, error);
	if (r < 0) {
		remove_participant(dir);
	}
	return r;
}

static int make_ca(struct store *store, char *error)
{
	struct pki_validity validity = validity_of(CA_DAYS);
	int r = files_path(store->dir, CA_DIR, store->ca_dir, error);

	r = r < 0 ? r : files_make_dir(store->ca_dir, error);
	r = r < 0 ? r : pki_make_ca("ecdaq identity CA", validity, &store->identity, error);
	r = r < 0 ? r : pki_make_ca("ecdaq permissions CA", validity, &store->permissions, error);
	r = r < 0 ? r : pki_write_key(store->identity.key, store->ca_dir, IDENTITY_KEY, error);
	r = r < 0 ? r
		  : pki_write_key(store->permissions.key, store->ca_dir, PERMISSIONS_KEY, error);
	r = r < 0 ? r
		  : pki_write_cert(store->identity.cert, store->ca_dir, KEYSTORE_IDENTITY_CA,
				   error);
	return r < 0 ? r
		     : pki_write_cert(store->permissions.cert, store->ca_dir,
				      KEYSTORE_PERMISSIONS_CA, error);
}

static int open_ca(struct store *store, char *error)
{
	char key[FILES_PATH_BYTES];
	int r = files_path(store->dir, CA_DIR, store->ca_dir, error);

	r = r < 0 ? r : files_path(store->ca_dir, IDENTITY_KEY, key, error);
	if (r == 0 && access(key, F_OK) < 0 && errno == ENOENT) {
		return files_fail(
			error, -ENOENT,
			"%s: no key store with its CA keys: create one with ecdaq security init",
			store->dir);
	}
	r = r < 0 ? r : pki_read_key(store->ca_dir, IDENTITY_KEY, &store->identity.key, error);
	r = r < 0 ? r
		  : pki_read_key(store->ca_dir, PERMISSIONS_KEY, &store->permissions.key, error);
	r = r < 0 ? r
		  : pki_read_cert(store->ca_dir, KEYSTORE_IDENTITY_CA, &store->identity.cert,
				  error);
	return r < 0 ? r
		     : pki_read_cert(store->ca_dir, KEYSTORE_PERMISSIONS_CA,
				     &store->permissions.cert, error);
}

int keystore_init(const char *dir, unsigned days, char *error)
{
	struct store store = { .dir = dir };
	int r = files_make_dir(dir, error);

	if (r < 0 && r != -EEXIST) {
		return r;
	}
	r = make_ca(&store, error);
	if (r == -EEXIST) {
		files_fail(error, r, "%s: already contains a key store", dir);
	}
	r = r < 0 ? r : add(&store, APPLIANCE, KEYSTORE_APPLIANCE, days, error);
	store_close(&store);
	return r;
}

int keystore_add(const char *dir, const char *name, enum keystore_role role, unsigned days,
		 char *error)
{
	struct store store = { .dir = dir };
	int r = check_name(name, role, error);

	r = r < 0 ? r : open_ca(&store, error);
	r = r < 0 ? r : add(&store, name, role, days, error);
	if (r == -EEXIST) {
		files_fail(error, r, "%s/%s: already exists: remove it first to renew it", dir,
			   name);
	}
	store_close(&store);
	return r;
}
