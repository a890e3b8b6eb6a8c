/* SPDX-License-Identifier: MIT */
#include "keystore/signed_text.h"

#include <errno.h>
#include <openssl/err.h>
#include <openssl/pkcs7.h>
#include <openssl/x509_vfy.h>
#include <openssl/x509v3.h>
#include <stdlib.h>
#include <string.h>

#include "keystore/files.h"
#include "keystore/store_layout.h"

int signed_text_write(const char *text, size_t text_len, const struct pki_pair *ca, const char *dir,
		      const char *name, char *error)
{
	const int flags = PKCS7_DETACHED | PKCS7_STREAM | PKCS7_TEXT;
	BIO *in = BIO_new_mem_buf(text, (int)text_len);
	BIO *out = BIO_new(BIO_s_mem());
	PKCS7 *signature = in == NULL ? NULL : PKCS7_sign(ca->cert, ca->key, NULL, in, flags);
	char *data;
	int r;

	if (out == NULL || signature == NULL || SMIME_write_PKCS7(out, signature, in, flags) != 1) {
		ERR_clear_error();
		r = files_fail(error, -EIO, "%s: cannot sign", name);
	} else {
		long bytes = BIO_get_mem_data(out, &data);

		r = files_write(dir, name, data, (size_t)bytes, error);
	}
	PKCS7_free(signature);
	BIO_free(out);
	BIO_free(in);
	return r;
}

/* Not strndup(): @data is not terminated, which strict sanitizers report. NULL: no memory. */
static char *copy_text(const char *data, size_t bytes)
{
	char *text = malloc(bytes + 1);

	if (text != NULL) {
		memcpy(text, data, bytes);
		text[bytes] = '\0';
	}
	return text;
}

/* The text if @ca signed it, else NULL. The CA's own period of validity is not checked. */
static char *verify(PKCS7 *signature, BIO *content, X509 *ca)
{
	X509_STORE *store = X509_STORE_new();
	BIO *out = BIO_new(BIO_s_mem());
	char *text = NULL;
	char *data;

	if (store != NULL && out != NULL && X509_STORE_add_cert(store, ca) == 1) {
		X509_STORE_set_flags(store, X509_V_FLAG_NO_CHECK_TIME | X509_V_FLAG_PARTIAL_CHAIN);
		X509_STORE_set_purpose(store, X509_PURPOSE_ANY);
		if (PKCS7_verify(signature, NULL, store, content, out, PKCS7_TEXT) == 1) {
			long bytes = BIO_get_mem_data(out, &data);

			text = copy_text(data, (size_t)bytes);
		}
	}
	BIO_free(out);
	X509_STORE_free(store);
	ERR_clear_error();
	return text;
}

int signed_text_read(const char *dir, const char *name, X509 *ca, char **ret_text, char *error)
{
	char *data;
	size_t bytes;
	BIO *in;
	BIO *content = NULL;
	PKCS7 *signature;
	char *text;
	int r = files_read(dir, name, &data, &bytes, error);

	if (r < 0) {
		return r;
	}
	in = BIO_new_mem_buf(data, (int)bytes);
	signature = in == NULL ? NULL : SMIME_read_PKCS7(in, &content);
	text = signature == NULL ? NULL : verify(signature, content, ca);
	if (signature == NULL) {
		r = files_fail(error, -EKEYREJECTED, "%s/%s: not a signed document", dir, name);
	} else if (text == NULL) {
		r = files_fail(error, -EKEYREJECTED,
			       "%s/%s: modified, or not signed by " KEYSTORE_PERMISSIONS_CA, dir,
			       name);
	} else {
		*ret_text = text;
	}
	ERR_clear_error();
	PKCS7_free(signature);
	BIO_free(content);
	BIO_free(in);
	free(data);
	return r;
}
