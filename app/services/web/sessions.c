/* SPDX-License-Identifier: MIT */
#include "web/sessions.h"

#include <errno.h>
#include <string.h>
#include <sys/random.h>

#define MINUTE_NS (60 * NS_PER_S)

static const char *const role_names[] = {
	[ROLE_VIEWER] = "viewer",
	[ROLE_OPERATOR] = "operator",
	[ROLE_ENGINEER] = "engineer",
};

static const char digits[] = "0123456789abcdef";

const char *role_to_str(enum role role)
{
	return role_names[role];
}

enum role role_of(const char *word)
{
	for (unsigned i = ROLE_VIEWER; i <= ROLE_ENGINEER; i++) {
		if (strcmp(word, role_names[i]) == 0) {
			return (enum role)i;
		}
	}
	return ROLE_NONE;
}

static int fill_from_kernel(void *buf, size_t bytes)
{
	ssize_t n = getrandom(buf, bytes, 0); /* up to 256 bytes are never cut short */

	return n == (ssize_t)bytes ? 0 : -(n < 0 ? errno : EIO);
}

void sessions_init(struct sessions *s, int (*fill)(void *buf, size_t bytes))
{
	memset(s, 0, sizeof(*s));
	s->fill = fill != NULL ? fill : fill_from_kernel;
}

void sessions_wipe(struct sessions *s)
{
	explicit_bzero(s, sizeof(*s));
}

void session_text(const uint8_t bytes[WEB_SECRET_BYTES], char ret[WEB_SECRET_TEXT_BYTES])
{
	for (size_t i = 0; i < WEB_SECRET_BYTES; i++) {
		ret[2 * i] = digits[bytes[i] >> 4];
		ret[2 * i + 1] = digits[bytes[i] & 15];
	}
	ret[WEB_SECRET_TEXT_BYTES - 1] = '\0';
}

/* 0; -EINVAL: not so many hexadecimal digits. */
static int read_text(const char *text, uint8_t ret[WEB_SECRET_BYTES])
{
	if (strnlen(text, WEB_SECRET_TEXT_BYTES) != WEB_SECRET_TEXT_BYTES - 1) {
		return -EINVAL;
	}
	for (size_t i = 0; i < WEB_SECRET_BYTES; i++) {
		const char *high = strchr(digits, text[2 * i]);
		const char *low = strchr(digits, text[2 * i + 1]);

		if (high == NULL || low == NULL) {
			return -EINVAL;
		}
		ret[i] = (uint8_t)((high - digits) << 4 | (low - digits));
	}
	return 0;
}

/* In a time that does not depend on where they differ. */
static int is_same(const uint8_t a[WEB_SECRET_BYTES], const uint8_t b[WEB_SECRET_BYTES])
{
	volatile uint8_t difference = 0;

	for (int i = 0; i < WEB_SECRET_BYTES; i++) {
		difference = (uint8_t)(difference | (a[i] ^ b[i]));
	}
	return difference == 0;
}

void session_end(struct session *session)
{
	explicit_bzero(session, sizeof(*session));
}

static void end_old_ones(struct sessions *s, int64_t now_ns)
{
	for (int i = 0; i < SESSION_TOKENS; i++) {
		if (s->token[i].role != ROLE_NONE && now_ns >= s->token[i].end_ns) {
			explicit_bzero(&s->token[i], sizeof(s->token[i]));
		}
	}
	for (int i = 0; i < SESSIONS; i++) {
		struct session *session = &s->session[i];

		if (session->number != 0 &&
		    (now_ns >= session->end_ns || now_ns >= session->idle_end_ns)) {
			session_end(session);
		}
	}
}

int sessions_make_token(struct sessions *s, enum role role, int64_t now_ns, int64_t end_ns,
			char ret[WEB_SECRET_TEXT_BYTES])
{
	end_old_ones(s, now_ns);
	for (int i = 0; i < SESSION_TOKENS; i++) {
		struct session_token *token = &s->token[i];

		if (token->role == ROLE_NONE) {
			int r = s->fill(token->secret, sizeof(token->secret));

			if (r < 0) {
				return r;
			}
			token->role = role;
			token->end_ns = end_ns;
			session_text(token->secret, ret);
			return 0;
		}
	}
	return -ENOSPC;
}

/* All are compared, whichever it is. */
static struct session_token *find_token(struct sessions *s, const char *text)
{
	struct session_token *found = NULL;
	uint8_t secret[WEB_SECRET_BYTES];

	if (read_text(text, secret) < 0) {
		return NULL;
	}
	for (int i = 0; i < SESSION_TOKENS; i++) {
		if (is_same(secret, s->token[i].secret) && s->token[i].role != ROLE_NONE) {
			found = &s->token[i];
		}
	}
	explicit_bzero(secret, sizeof(secret));
	return found;
}

static int count_wrong(struct sessions *s, int64_t now_ns)
{
	if (s->wrong == 0 || now_ns - s->wrong_since_ns >= MINUTE_NS) {
		s->wrong = 0;
		s->wrong_since_ns = now_ns;
	}
	if (s->wrong >= SESSION_WRONG_A_MINUTE) {
		return -EAGAIN;
	}
	s->wrong++;
	return -EACCES;
}

static struct session *find_free(struct sessions *s)
{
	for (int i = 0; i < SESSIONS; i++) {
		if (s->session[i].number == 0) {
			return &s->session[i];
		}
	}
	return NULL;
}

int sessions_log_in(struct sessions *s, const char *text, int64_t now_ns,
		    struct session **ret_session)
{
	struct session_token *token;
	struct session *session;
	int r;

	end_old_ones(s, now_ns);
	token = find_token(s, text);
	if (token == NULL) {
		return count_wrong(s, now_ns);
	}
	session = find_free(s);
	if (session == NULL) {
		return -ENOSPC;
	}
	r = s->fill(session->id, sizeof(session->id));
	r = r < 0 ? r : s->fill(session->secret, sizeof(session->secret));
	if (r < 0) {
		session_end(session);
		return r;
	}
	session->role = token->role;
	session->number = ++s->last_number;
	session->end_ns = now_ns + SESSION_LIFE_NS;
	session->idle_end_ns = now_ns + SESSION_IDLE_NS;
	explicit_bzero(token, sizeof(*token));
	*ret_session = session;
	return 0;
}

struct session *sessions_find(struct sessions *s, const char *text, int64_t now_ns)
{
	struct session *found = NULL;
	uint8_t id[WEB_SECRET_BYTES];

	end_old_ones(s, now_ns);
	if (read_text(text, id) < 0) {
		return NULL;
	}
	for (int i = 0; i < SESSIONS; i++) {
		if (is_same(id, s->session[i].id) && s->session[i].number != 0) {
			found = &s->session[i];
		}
	}
	return found;
}

void session_use(struct session *session, int64_t now_ns)
{
	session->idle_end_ns = now_ns + SESSION_IDLE_NS;
}

int session_has_secret(const struct session *session, const char *text)
{
	uint8_t secret[WEB_SECRET_BYTES];
	int r = read_text(text, secret) == 0 && is_same(secret, session->secret);

	explicit_bzero(secret, sizeof(secret));
	return r;
}
