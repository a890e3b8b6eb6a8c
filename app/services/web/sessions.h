/* SPDX-License-Identifier: MIT */
/*
 * Who may command through the page: one-time tokens, and the sessions that they begin. A token is
 * good once, and for some minutes; a session ends after a time without use, and after a day's work
 * in any case. Names and secrets are random, compared in constant time, and overwritten after use.
 * Context: one thread.
 */
#ifndef WEB_SESSIONS_H
#define WEB_SESSIONS_H

#include <stddef.h>
#include <stdint.h>

#include "base/clock.h"
#include "base/web_command.h"

/* Each may what those before it may. */
enum role { ROLE_NONE, ROLE_VIEWER, ROLE_OPERATOR, ROLE_ENGINEER };

enum {
	SESSIONS = 32,
	SESSION_TOKENS = 16,
	SESSION_WRONG_A_MINUTE = 10, /* wrong tokens; more get HTTP status 429 */
};
#define SESSION_IDLE_NS (INT64_C(1800) * NS_PER_S)
#define SESSION_LIFE_NS (INT64_C(43200) * NS_PER_S)

struct session {
	enum role role;
	uint32_t number; /* from 1 on; 0: free */
	int64_t end_ns;
	int64_t idle_end_ns;
	uint8_t id[WEB_SECRET_BYTES];
	uint8_t secret[WEB_SECRET_BYTES];
};

struct sessions {
	/** Fill @buf with random bytes. 0 or -errno. */
	int (*fill)(void *buf, size_t bytes);
	uint32_t last_number;
	uint32_t wrong;
	int64_t wrong_since_ns;
	struct session session[SESSIONS];
	struct session_token {
		enum role role; /* ROLE_NONE: free */
		int64_t end_ns;
		uint8_t secret[WEB_SECRET_BYTES];
	} token[SESSION_TOKENS];
};

/** "operator"; and back: ROLE_NONE for another word. */
const char *role_to_str(enum role role);
enum role role_of(const char *word);

/** All zero but @fill, which is the kernel's getrandom() when NULL. */
void sessions_init(struct sessions *s, int (*fill)(void *buf, size_t bytes));
void sessions_wipe(struct sessions *s);

/** A token for @role, good until @end_ns, as text to @ret. 0; -ENOSPC: too many are open; -errno of
 * the random bytes. */
int sessions_make_token(struct sessions *s, enum role role, int64_t now_ns, int64_t end_ns,
			char ret[WEB_SECRET_TEXT_BYTES]);
/**
 * Begin a session with the token @text, which is used up. 0; -EACCES: it is not, or no longer,
 * good; -EAGAIN: the same, and there were too many of them; -ENOSPC: too many sessions, the token
 * stays good; -errno of the random bytes.
 */
int sessions_log_in(struct sessions *s, const char *text, int64_t now_ns,
		    struct session **ret_session);
/** The session of the name @text, NULL: none. */
struct session *sessions_find(struct sessions *s, const char *text, int64_t now_ns);
/** Somebody uses it: its time without use begins anew. */
void session_use(struct session *session, int64_t now_ns);
/** Is @text the secret of the session? */
int session_has_secret(const struct session *session, const char *text);
void session_end(struct session *session);
/** Random bytes as hexadecimal text. */
void session_text(const uint8_t bytes[WEB_SECRET_BYTES], char ret[WEB_SECRET_TEXT_BYTES]);

#endif
