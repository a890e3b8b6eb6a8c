/* SPDX-License-Identifier: MIT */
/* The two documents of DDS Security 1.1, clauses 9.4.1.2 and 9.4.1.3, as text. Context: any. */
#ifndef KEYSTORE_POLICY_H
#define KEYSTORE_POLICY_H

#include <stddef.h>
#include <stdint.h>

#include "keystore/store_layout.h"

enum { POLICY_TEXT_BYTES = 8192 };

struct policy_grant {
	const char *name; /* the certificate's subject is CN=name */
	enum keystore_role role;
	int64_t not_before_s; /* Unix */
	int64_t not_after_s;
};

/** The governance: authenticated participants only, everything encrypted. Returns its length. */
size_t policy_governance(char *ret_text);
/** The permissions of one participant; default deny. Returns their length. */
size_t policy_permissions(const struct policy_grant *grant, char *ret_text);

/** The text between <@tag> and </@tag>, first one. 0, or -ENOENT. */
int policy_find(const char *text, const char *tag, char *ret_value, size_t value_bytes);
/** "2026-11-21T14:00:00", UTC, with or without a Z. Unix s, or -EINVAL. */
int policy_time(const char *text, int64_t *ret_s);

#endif
