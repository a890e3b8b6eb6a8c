/* SPDX-License-Identifier: MIT */
/* Documents signed with S/MIME as DDS Security 1.1, clause 9.4.1 requires. Context: blocking. */
#ifndef KEYSTORE_SIGNED_TEXT_H
#define KEYSTORE_SIGNED_TEXT_H

#include <stddef.h>

#include "keystore/pki.h"

/** Sign @text by @ca into @dir/@name. 0 or -errno with @error. */
int signed_text_write(const char *text, size_t text_len, const struct pki_pair *ca, const char *dir,
		      const char *name, char *error);
/**
 * The text of @dir/@name if @ca signed it. 0; -EKEYREJECTED: not signed by @ca; -errno; with
 * @error. Free *@ret_text.
 */
int signed_text_read(const char *dir, const char *name, X509 *ca, char **ret_text, char *error);

#endif
