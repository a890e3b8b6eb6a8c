/* SPDX-License-Identifier: MIT */
#include "keystore/pki.h"

#include <errno.h>
#include <openssl/bn.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/x509v3.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "keystore/files.h"

enum { SERIAL_BITS = 159, X509_V3 = 2 };

struct extension {
	int id;
	const char *value;
};

/* digitalSignature: the permissions CA signs documents as well. */
static const struct extension of_ca[] = {
	{ NID_basic_constraints, "critical,CA:TRUE" },
	{ NID_key_usage, "critical,keyCertSign,cRLSign,digitalSignature" },
	{ NID_subject_key_identifier, "hash" },
};
static const struct extension of_participant[] = {
	{ NID_basic_constraints, "critical,CA:FALSE" },
	{ NID_key_usage, "critical,digitalSignature,keyAgreement" },
	{ NID_subject_key_identifier, "hash" },
	{ NID_authority_key_identifier, "keyid" },
};

void pki_free(struct pki_pair *pair)
{
	EVP_PKEY_free(pair->key);
	X509_free(pair->cert);
	*pair = (struct pki_pair){ .key = NULL };
}

static int fail(const char *what, char *error)
{
	unsigned long code = ERR_get_error();
	const char *reason = code == 0 ? NULL : ERR_reason_error_string(code);

	ERR_clear_error();
	return files_fail(error, -EIO, "%s: %s", what,
			  reason != NULL ? reason : "libcrypto failed");
}

static int set_serial(X509 *cert)
{
	BIGNUM *number = BN_new();
	int is_done = number != NULL &&
		      BN_rand(number, SERIAL_BITS, BN_RAND_TOP_ANY, BN_RAND_BOTTOM_ANY) == 1 &&
		      BN_to_ASN1_INTEGER(number, X509_get_serialNumber(cert)) != NULL;

	BN_free(number);
	return is_done;
}

static int set_time(ASN1_TIME *field, int64_t unix_s)
{
	return ASN1_TIME_set(field, (time_t)unix_s) != NULL;
}

static int set_subject(X509 *cert, const char *name)
{
	X509_NAME *subject = X509_get_subject_name(cert);

	return X509_NAME_add_entry_by_txt(subject, "CN", MBSTRING_ASC, (const unsigned char *)name,
					  -1, -1, 0) == 1;
}

static int add_extensions(X509 *cert, X509 *issuer, const struct extension *all, size_t count)
{
	X509V3_CTX ctx;

	X509V3_set_ctx(&ctx, issuer, cert, NULL, NULL, 0);
	X509V3_set_ctx_nodb(&ctx);
	for (size_t i = 0; i < count; i++) {
		X509_EXTENSION *made = X509V3_EXT_conf_nid(NULL, &ctx, all[i].id, all[i].value);
		int is_added = made != NULL && X509_add_ext(cert, made, -1) == 1;

		X509_EXTENSION_free(made);
		if (!is_added) {
			return 0;
		}
	}
	return 1;
}

/* @ca NULL: self-signed. */
static int issue(struct pki_pair *pair, const char *name, const struct pki_pair *ca,
		 struct pki_validity validity)
{
	const struct pki_pair *issuer = ca != NULL ? ca : pair;
	const struct extension *all = ca != NULL ? of_participant : of_ca;
	size_t count =
		ca != NULL ? sizeof(of_participant) / sizeof(*all) : sizeof(of_ca) / sizeof(*all);

	return X509_set_version(pair->cert, X509_V3) == 1 && set_serial(pair->cert) &&
	       set_time(X509_getm_notBefore(pair->cert), validity.not_before_s) &&
	       set_time(X509_getm_notAfter(pair->cert), validity.not_after_s) &&
	       set_subject(pair->cert, name) &&
	       X509_set_issuer_name(pair->cert, X509_get_subject_name(issuer->cert)) == 1 &&
	       X509_set_pubkey(pair->cert, pair->key) == 1 &&
	       add_extensions(pair->cert, issuer->cert, all, count) &&
	       X509_sign(pair->cert, issuer->key, EVP_sha256()) > 0;
}

static int make(const char *name, const struct pki_pair *ca, struct pki_validity validity,
		struct pki_pair *ret, char *error)
{
	struct pki_pair pair = { .key = EVP_EC_gen("P-256"), .cert = X509_new() };

	if (pair.key == NULL || pair.cert == NULL || !issue(&pair, name, ca, validity)) {
		pki_free(&pair);
		return fail(name, error);
	}
	*ret = pair;
	return 0;
}

int pki_make_ca(const char *name, struct pki_validity validity, struct pki_pair *ret, char *error)
{
	return make(name, NULL, validity, ret, error);
}

int pki_make(const char *name, const struct pki_pair *ca, struct pki_validity validity,
	     struct pki_pair *ret, char *error)
{
	return make(name, ca, validity, ret, error);
}

static int write_bio(BIO *bio, int is_filled, const char *dir, const char *name, char *error)
{
	char *data;
	long bytes;
	int r;

	if (bio == NULL || !is_filled) {
		BIO_free(bio);
		return fail(name, error);
	}
	bytes = BIO_get_mem_data(bio, &data);
	r = files_write(dir, name, data, (size_t)bytes, error);
	OPENSSL_cleanse(data, (size_t)bytes);
	BIO_free(bio);
	return r;
}

int pki_write_cert(const X509 *cert, const char *dir, const char *name, char *error)
{
	BIO *bio = BIO_new(BIO_s_mem());

	return write_bio(bio, bio != NULL && PEM_write_bio_X509(bio, cert) == 1, dir, name, error);
}

int pki_write_key(EVP_PKEY *key, const char *dir, const char *name, char *error)
{
	BIO *bio = BIO_new(BIO_s_mem());

	return write_bio(bio,
			 bio != NULL &&
				 PEM_write_bio_PrivateKey(bio, key, NULL, NULL, 0, NULL, NULL) == 1,
			 dir, name, error);
}

/* Keys with a passphrase are rejected: no user is present to enter it. */
/* NOLINTNEXTLINE(readability-non-const-parameter): libcrypto's type of it */
static int no_passphrase(char *buf, int size, int is_writing, void *arg)
{
	(void)buf;
	(void)size;
	(void)is_writing;
	(void)arg;
	return -1;
}

static BIO *read_bio(const char *dir, const char *name, char **ret_data, int *ret_r, char *error)
{
	size_t bytes;

	*ret_data = NULL;
	*ret_r = files_read(dir, name, ret_data, &bytes, error);
	return *ret_r < 0 ? NULL : BIO_new_mem_buf(*ret_data, (int)bytes);
}

int pki_read_cert(const char *dir, const char *name, X509 **ret_cert, char *error)
{
	char *data;
	int r;
	BIO *bio = read_bio(dir, name, &data, &r, error);
	X509 *cert = bio == NULL ? NULL : PEM_read_bio_X509(bio, NULL, no_passphrase, NULL);

	BIO_free(bio);
	free(data);
	ERR_clear_error();
	if (r == 0 && cert == NULL) {
		r = files_fail(error, -EKEYREJECTED, "%s/%s: not a certificate", dir, name);
	}
	if (r == 0) {
		*ret_cert = cert;
	}
	return r;
}

int pki_read_key(const char *dir, const char *name, EVP_PKEY **ret_key, char *error)
{
	char *data;
	int r;
	BIO *bio = read_bio(dir, name, &data, &r, error);
	EVP_PKEY *key =
		bio == NULL ? NULL : PEM_read_bio_PrivateKey(bio, NULL, no_passphrase, NULL);

	BIO_free(bio);
	if (data != NULL) {
		OPENSSL_cleanse(data, strlen(data));
	}
	free(data);
	ERR_clear_error();
	if (r == 0 && key == NULL) {
		r = files_fail(error, -EKEYREJECTED,
			       "%s/%s: not a private key, or protected by a passphrase", dir, name);
	}
	if (r == 0) {
		*ret_key = key;
	}
	return r;
}

void pki_subject(const X509 *cert, char *ret_text, size_t text_bytes)
{
	BIO *bio = BIO_new(BIO_s_mem());
	char *data = NULL;
	long bytes = 0;

	if (bio != NULL &&
	    X509_NAME_print_ex(bio, X509_get_subject_name(cert), 0, XN_FLAG_RFC2253) >= 0) {
		bytes = BIO_get_mem_data(bio, &data);
	}
	bytes = bytes < (long)text_bytes ? bytes : (long)text_bytes - 1;
	memcpy(ret_text, bytes > 0 ? data : "", (size_t)(bytes > 0 ? bytes : 0));
	ret_text[bytes > 0 ? bytes : 0] = '\0';
	BIO_free(bio);
}

int64_t pki_expires_s(const X509 *cert)
{
	struct tm parts;

	return ASN1_TIME_to_tm(X509_get0_notAfter(cert), &parts) == 1 ? (int64_t)timegm(&parts)
								      : INT64_MIN;
}
