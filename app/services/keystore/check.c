/* SPDX-License-Identifier: MIT */
#include <errno.h>
#include <openssl/err.h>
#include <openssl/x509_vfy.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>

#include "keystore/files.h"
#include "keystore/keystore.h"
#include "keystore/pki.h"
#include "keystore/policy.h"
#include "keystore/signed_text.h"

enum { VALUE_BYTES = 128 };

/* The contents of a participant's directory. */
struct folder {
	const char *dir;
	int64_t now_s;
	struct pki_pair own;
	X509 *identity_ca;
	X509 *permissions_ca;
	char *governance;
	char *permissions;
};

static int check_mode(const struct folder *f, char *error)
{
	char path[FILES_PATH_BYTES];
	struct stat st;
	int r = files_path(f->dir, KEYSTORE_KEY, path, error);

	if (r < 0) {
		return r;
	}
	if (stat(path, &st) < 0) {
		return files_fail(error, -errno, "%s: %s", path, strerror(errno));
	}
	if ((st.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
		return files_fail(error, -EPERM, "%s: accessible to others (mode %04o): chmod 600",
				  path, st.st_mode & 07777u);
	}
	return 0;
}

static int read_all(struct folder *f, char *error)
{
	int r = check_mode(f, error);

	r = r < 0 ? r : pki_read_key(f->dir, KEYSTORE_KEY, &f->own.key, error);
	r = r < 0 ? r : pki_read_cert(f->dir, KEYSTORE_CERT, &f->own.cert, error);
	r = r < 0 ? r : pki_read_cert(f->dir, KEYSTORE_IDENTITY_CA, &f->identity_ca, error);
	r = r < 0 ? r : pki_read_cert(f->dir, KEYSTORE_PERMISSIONS_CA, &f->permissions_ca, error);
	r = r < 0 ? r
		  : signed_text_read(f->dir, KEYSTORE_GOVERNANCE, f->permissions_ca, &f->governance,
				     error);
	return r < 0 ? r
		     : signed_text_read(f->dir, KEYSTORE_PERMISSIONS, f->permissions_ca,
					&f->permissions, error);
}

static int fail_chain(const struct folder *f, int code, char *error)
{
	const char *clock = "is the clock right?";

	switch (code) {
	case X509_V_ERR_CERT_HAS_EXPIRED:
		return files_fail(error, -EKEYEXPIRED, "%s/" KEYSTORE_CERT ": expired: %s", f->dir,
				  clock);
	case X509_V_ERR_CERT_NOT_YET_VALID:
		return files_fail(error, -EKEYEXPIRED, "%s/" KEYSTORE_CERT ": not valid yet: %s",
				  f->dir, clock);
	case X509_V_ERR_UNABLE_TO_GET_ISSUER_CERT_LOCALLY:
	case X509_V_ERR_UNABLE_TO_VERIFY_LEAF_SIGNATURE:
	case X509_V_ERR_DEPTH_ZERO_SELF_SIGNED_CERT:
	case X509_V_ERR_CERT_SIGNATURE_FAILURE:
		return files_fail(error, -EKEYREJECTED,
				  "%s/" KEYSTORE_CERT ": not issued by " KEYSTORE_IDENTITY_CA,
				  f->dir);
	default:
		return files_fail(error, -EKEYREJECTED, "%s/" KEYSTORE_CERT ": %s", f->dir,
				  X509_verify_cert_error_string(code));
	}
}

static int check_chain(const struct folder *f, char *error)
{
	X509_STORE *store = X509_STORE_new();
	X509_STORE_CTX *ctx = X509_STORE_CTX_new();
	int code = X509_V_ERR_OUT_OF_MEM;

	if (store != NULL && ctx != NULL && X509_STORE_add_cert(store, f->identity_ca) == 1 &&
	    X509_STORE_CTX_init(ctx, store, f->own.cert, NULL) == 1) {
		X509_STORE_CTX_set_time(ctx, 0, (time_t)f->now_s);
		code = X509_verify_cert(ctx) == 1 ? X509_V_OK : X509_STORE_CTX_get_error(ctx);
	}
	X509_STORE_CTX_free(ctx);
	X509_STORE_free(store);
	ERR_clear_error();
	return code == X509_V_OK ? 0 : fail_chain(f, code, error);
}

static int reject(const struct folder *f, const char *file, const char *why, char *error)
{
	return files_fail(error, -EKEYREJECTED, "%s/%s: %s", f->dir, file, why);
}

static int check_permissions(const struct folder *f, struct keystore_identity *identity,
			     char *error)
{
	char subject[VALUE_BYTES];
	char from[VALUE_BYTES];
	char until[VALUE_BYTES];
	int64_t from_s;
	int64_t until_s;

	if (strstr(f->governance, "<domain_rule>") == NULL) {
		return reject(f, KEYSTORE_GOVERNANCE, "contains no domain rule", error);
	}
	if (policy_find(f->permissions, "subject_name", subject, sizeof(subject)) < 0 ||
	    policy_find(f->permissions, "not_before", from, sizeof(from)) < 0 ||
	    policy_find(f->permissions, "not_after", until, sizeof(until)) < 0 ||
	    policy_time(from, &from_s) < 0 || policy_time(until, &until_s) < 0) {
		return reject(f, KEYSTORE_PERMISSIONS, "contains no complete grant", error);
	}
	if (strcmp(subject, identity->name) != 0) {
		return files_fail(error, -EKEYREJECTED,
				  "%s/" KEYSTORE_PERMISSIONS
				  ": is for %s, but the certificate is for %s",
				  f->dir, subject, identity->name);
	}
	if (f->now_s < from_s || f->now_s > until_s) {
		return files_fail(error, -EKEYEXPIRED,
				  "%s/" KEYSTORE_PERMISSIONS
				  ": valid from %s to %s: is the clock right?",
				  f->dir, from, until);
	}
	identity->expires_s = until_s < identity->expires_s ? until_s : identity->expires_s;
	return 0;
}

static int check_all(struct folder *f, struct keystore_identity *identity, char *error)
{
	int r = read_all(f, error);

	if (r < 0) {
		return r;
	}
	if (X509_check_private_key(f->own.cert, f->own.key) != 1) {
		ERR_clear_error();
		return reject(f, KEYSTORE_KEY, "does not belong to " KEYSTORE_CERT, error);
	}
	r = check_chain(f, error);
	if (r < 0) {
		return r;
	}
	pki_subject(f->own.cert, identity->name, sizeof(identity->name));
	identity->expires_s = pki_expires_s(f->own.cert);
	return check_permissions(f, identity, error);
}

int keystore_check(const char *dir, int64_t now_s, struct keystore_identity *ret_identity,
		   char *error)
{
	struct folder folder = { .dir = dir, .now_s = now_s };
	struct keystore_identity identity = { .expires_s = 0 };
	int r = check_all(&folder, &identity, error);

	pki_free(&folder.own);
	X509_free(folder.identity_ca);
	X509_free(folder.permissions_ca);
	free(folder.governance);
	free(folder.permissions);
	if (r == 0) {
		*ret_identity = identity;
	}
	return r;
}
