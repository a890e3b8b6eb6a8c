/* SPDX-License-Identifier: MIT */
/* Keys, certificates and signed documents; a thin layer over libcrypto. Context: blocking. */
#ifndef KEYSTORE_PKI_H
#define KEYSTORE_PKI_H

#include <openssl/evp.h>
#include <openssl/x509.h>
#include <stdint.h>

struct pki_validity {
	int64_t not_before_s; /* Unix */
	int64_t not_after_s;
};

/* A certificate with its private key; @key NULL if it is not known. */
struct pki_pair {
	EVP_PKEY *key;
	X509 *cert;
};

void pki_free(struct pki_pair *pair);

/** Generate a key (EC, P-256) with a self-signed CA certificate for CN=@name. */
int pki_make_ca(const char *name, struct pki_validity validity, struct pki_pair *ret, char *error);
/** Generate a key with a certificate for CN=@name, issued by @ca. */
int pki_make(const char *name, const struct pki_pair *ca, struct pki_validity validity,
	     struct pki_pair *ret, char *error);

int pki_write_cert(const X509 *cert, const char *dir, const char *name, char *error);
int pki_write_key(EVP_PKEY *key, const char *dir, const char *name, char *error);
int pki_read_cert(const char *dir, const char *name, X509 **ret_cert, char *error);
int pki_read_key(const char *dir, const char *name, EVP_PKEY **ret_key, char *error);

/** "CN=appliance". */
void pki_subject(const X509 *cert, char *ret_text, size_t text_bytes);
int64_t pki_expires_s(const X509 *cert);

#endif
