/* SPDX-License-Identifier: MIT */
/* Parameters of the Foxglove protocol: what is known of the session and of each channel, to be
 * read. Requests are foreign input. Context: blocking. */
#ifndef WEB_PARAMETERS_H
#define WEB_PARAMETERS_H

#include <stddef.h>

#include "web/source.h"

/** The answer to the request "getParameters" in @text, for the session of @source; free()
 * *@ret_answer. 0; -EBADMSG: it is not valid; -E2BIG: more than FOXGLOVE_ITEMS names; -ENOMEM. */
int parameters_answer(const char *text, size_t len, const struct source *source, char **ret_answer);

#endif
