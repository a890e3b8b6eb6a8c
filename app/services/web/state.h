/* SPDX-License-Identifier: MIT */
/* The state of the measurement for people: one word, one colour, one sentence. Context: any. */
#ifndef WEB_STATE_H
#define WEB_STATE_H

#include "base/status.h"

enum state_level { STATE_GOOD, STATE_WARNING, STATE_BAD };

enum { STATE_SENTENCE_BYTES = 400 };

struct state {
	const char *word;
	enum state_level level;
	char sentence[STATE_SENTENCE_BYTES]; /* the problem and its remedy */
};

/** "good", "warning", "bad". */
const char *state_level_to_str(enum state_level level);

/**
 * Of ecdaqd's status page; @error is the errno of reading it (then @page is not looked at), or 0.
 * @is_alive: the process that wrote it is still there.
 */
void state_judge(const struct status_page *page, int error, int is_alive, struct state *ret);

#endif
