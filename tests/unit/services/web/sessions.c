/* SPDX-License-Identifier: MIT */
#include "web/sessions.h"

#include <errno.h>
#include <string.h>

#include "harness/test.h"

#define T0 (1000 * NS_PER_S)
#define TEN_MINUTES (600 * NS_PER_S)

static uint8_t next_byte;
static int fill_result;

/* Different each time, and known. */
static int fill(void *buf, size_t bytes)
{
	memset(buf, ++next_byte, bytes);
	return fill_result;
}

static struct sessions *make(void)
{
	static struct sessions s;

	next_byte = 0;
	fill_result = 0;
	sessions_init(&s, fill);
	return &s;
}

static struct session *log_in(struct sessions *s, enum role role, int64_t now_ns)
{
	char token[WEB_SECRET_TEXT_BYTES];
	struct session *session = NULL;

	CHECK_EQ(sessions_make_token(s, role, now_ns, now_ns + TEN_MINUTES, token), 0);
	CHECK_EQ(sessions_log_in(s, token, now_ns, &session), 0);
	return session;
}

static int is_zero(const void *data, size_t bytes)
{
	const uint8_t *p = data;
	uint8_t all = 0;

	for (size_t i = 0; i < bytes; i++) {
		all |= p[i];
	}
	return all == 0;
}

TEST(sessions, a_token_is_good_once_and_is_wiped)
{
	struct sessions *s = make();
	char token[WEB_SECRET_TEXT_BYTES];
	struct session *session = NULL;

	CHECK_EQ(sessions_make_token(s, ROLE_OPERATOR, T0, T0 + TEN_MINUTES, token), 0);
	CHECK_EQ(strlen(token), 64);
	CHECK_EQ(sessions_log_in(s, token, T0 + TEN_MINUTES - 1, &session), 0);
	CHECK_EQ(session->role, ROLE_OPERATOR);
	CHECK_EQ(session->number, 1);
	CHECK_EQ(is_zero(s->token, sizeof(s->token)), 1);
	CHECK_EQ(sessions_log_in(s, token, T0 + TEN_MINUTES - 1, &session), -EACCES);
}

TEST(sessions, a_token_ends_with_its_time)
{
	struct sessions *s = make();
	char token[WEB_SECRET_TEXT_BYTES];
	struct session *session = NULL;

	CHECK_EQ(sessions_make_token(s, ROLE_VIEWER, T0, T0 + TEN_MINUTES, token), 0);
	CHECK_EQ(sessions_log_in(s, token, T0 + TEN_MINUTES, &session), -EACCES);
	CHECK_EQ(is_zero(s->token, sizeof(s->token)), 1);
}

TEST(sessions, what_is_no_token_is_refused)
{
	struct sessions *s = make();
	char token[WEB_SECRET_TEXT_BYTES];
	char zeros[WEB_SECRET_TEXT_BYTES];
	char longer[WEB_SECRET_TEXT_BYTES + 1];
	struct session *session = NULL;

	CHECK_EQ(sessions_make_token(s, ROLE_VIEWER, T0, T0 + TEN_MINUTES, token), 0);
	memset(zeros, '0', sizeof(zeros));
	zeros[sizeof(zeros) - 1] = '\0'; /* as a free place has it */
	CHECK_EQ(sessions_log_in(s, zeros, T0, &session), -EACCES);
	CHECK_EQ(sessions_find(s, zeros, T0) == NULL, 1);
	CHECK_EQ(sessions_log_in(s, "", T0, &session), -EACCES);
	CHECK_EQ(sessions_log_in(s, token + 1, T0, &session), -EACCES);
	memcpy(longer, token, sizeof(token));
	longer[64] = '0';
	longer[65] = '\0';
	CHECK_EQ(sessions_log_in(s, longer, T0, &session), -EACCES);
	token[63] = '2';
	CHECK_EQ(sessions_log_in(s, token, T0, &session), -EACCES);
	token[63] = 'g';
	CHECK_EQ(sessions_log_in(s, token, T0, &session), -EACCES);
	CHECK_EQ(session == NULL, 1);
	token[63] = '1';
	CHECK_EQ(sessions_log_in(s, token, T0, &session), 0);
}

TEST(sessions, wrong_tokens_are_limited_for_a_minute_and_a_good_one_is_not)
{
	struct sessions *s = make();
	struct session *session;

	for (int i = 0; i < SESSION_WRONG_A_MINUTE; i++) {
		CHECK_EQ(sessions_log_in(s, "x", T0, &session), -EACCES);
	}
	CHECK_EQ(sessions_log_in(s, "x", T0 + 59 * NS_PER_S, &session), -EAGAIN);
	CHECK_EQ(log_in(s, ROLE_VIEWER, T0 + 59 * NS_PER_S) != NULL, 1);
	CHECK_EQ(sessions_log_in(s, "x", T0 + 60 * NS_PER_S, &session), -EACCES);
}

static int use(struct sessions *s, const char *id, int64_t now_ns)
{
	struct session *session = sessions_find(s, id, now_ns);

	if (session != NULL) {
		session_use(session, now_ns);
	}
	return session != NULL;
}

TEST(sessions, to_find_a_session_is_no_use_of_it)
{
	struct sessions *s = make();
	char id[WEB_SECRET_TEXT_BYTES];

	session_text(log_in(s, ROLE_VIEWER, T0)->id, id);
	CHECK_EQ(sessions_find(s, id, T0 + SESSION_IDLE_NS - 1) != NULL, 1);
	CHECK_EQ(sessions_find(s, id, T0 + SESSION_IDLE_NS) == NULL, 1);
}

TEST(sessions, a_session_ends_when_it_is_idle_and_after_its_life)
{
	struct sessions *s = make();
	char id[WEB_SECRET_TEXT_BYTES];
	int64_t now_ns = T0;

	session_text(log_in(s, ROLE_VIEWER, T0)->id, id);
	CHECK_EQ(use(s, id, T0 + SESSION_IDLE_NS - 1), 1);
	CHECK_EQ(use(s, id, T0 + 2 * SESSION_IDLE_NS - 2), 1);
	CHECK_EQ(use(s, id, T0 + 3 * SESSION_IDLE_NS - 2), 0);
	CHECK_EQ(is_zero(s->session, sizeof(s->session)), 1);

	session_text(log_in(s, ROLE_VIEWER, T0)->id, id);
	for (now_ns = T0; now_ns < T0 + SESSION_LIFE_NS; now_ns += SESSION_IDLE_NS / 2) {
		CHECK_EQ(use(s, id, now_ns), 1);
	}
	CHECK_EQ(sessions_find(s, id, T0 + SESSION_LIFE_NS) == NULL, 1);
}

TEST(sessions, the_secret_is_another_one_than_the_name)
{
	struct sessions *s = make();
	struct session *session = log_in(s, ROLE_ENGINEER, T0);
	char id[WEB_SECRET_TEXT_BYTES];
	char secret[WEB_SECRET_TEXT_BYTES];

	session_text(session->id, id);
	session_text(session->secret, secret);
	CHECK_EQ(session_has_secret(session, secret), 1);
	CHECK_EQ(session_has_secret(session, id), 0);
	CHECK_EQ(session_has_secret(session, ""), 0);
	CHECK_EQ(sessions_find(s, secret, T0) == NULL, 1);
	session_end(session);
	CHECK_EQ(sessions_find(s, id, T0) == NULL, 1);
}

TEST(sessions, without_random_bytes_there_is_neither_token_nor_session)
{
	struct sessions *s = make();
	char token[WEB_SECRET_TEXT_BYTES];
	struct session *session = NULL;

	CHECK_EQ(sessions_make_token(s, ROLE_VIEWER, T0, T0 + TEN_MINUTES, token), 0);
	fill_result = -EIO;
	CHECK_EQ(sessions_make_token(s, ROLE_VIEWER, T0, T0 + TEN_MINUTES, token), -EIO);
	CHECK_EQ(sessions_log_in(s, token, T0, &session), -EIO);
	CHECK_EQ(is_zero(s->session, sizeof(s->session)), 1);
	fill_result = 0;
	CHECK_EQ(sessions_log_in(s, token, T0, &session), 0);
}

TEST(sessions, the_kernels_random_bytes_differ)
{
	static struct sessions s;
	char token[2][WEB_SECRET_TEXT_BYTES];

	sessions_init(&s, NULL);
	for (int i = 0; i < 2; i++) {
		CHECK_EQ(sessions_make_token(&s, ROLE_VIEWER, T0, T0 + TEN_MINUTES, token[i]), 0);
	}
	CHECK_EQ(strcmp(token[0], token[1]) != 0, 1);
	sessions_wipe(&s);
	CHECK_EQ(is_zero(&s, sizeof(s)), 1);
}
