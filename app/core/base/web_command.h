/* SPDX-License-Identifier: MIT */
/*
 * The sockets of ecdaq-web-command (SOCK_SEQPACKET, mode 0660, in a folder of the run directory):
 * one request of fixed size for each connection, and one reply. "page" is for ecdaq-web, which
 * passes on what browsers post; "token" is for who may command, and gives one-time tokens.
 *
 * A body is lines of printable ASCII; the last one has no end. LOGIN: the token. LOGOUT and
 * COMMAND: the secret of the session, then for COMMAND the words of the command. TOKEN: role,
 * minutes. SESSION: ignored.
 */
#ifndef BASE_WEB_COMMAND_H
#define BASE_WEB_COMMAND_H

#include <stdint.h>

#define WEB_COMMAND_MAGIC UINT32_C(0x32574445) /* "EDW2": the digit is the version */

enum web_verb {
	WEB_NONE = 0,
	WEB_LOGIN = 1,   /* text: {"role":"...","secret":"..."}; session */
	WEB_LOGOUT = 2,  /* text: nothing of use; session "" */
	WEB_SESSION = 3, /* the same as LOGIN, of the session that there is */
	WEB_COMMAND = 4, /* text: what the tool printed */
	WEB_TOKEN = 5,   /* text: the token; on the socket "token" only */
};

enum {
	WEB_SECRET_BYTES = 32, /* of a token, of a session's name, of its secret */
	WEB_SECRET_TEXT_BYTES = 2 * WEB_SECRET_BYTES + 1, /* in hexadecimal */
	WEB_BODY_BYTES = 1024,
	WEB_TEXT_BYTES = 16384,
	WEB_ANSWER_S = 70, /* a reply comes within so much, or never */
	WEB_TOKEN_MINUTES = 10,
	WEB_TOKEN_MINUTES_MAX = 24 * 60,
};

struct web_request {
	uint32_t magic;
	uint32_t verb; /* enum web_verb */
	char session[WEB_SECRET_TEXT_BYTES];
	char body[WEB_BODY_BYTES];
};

struct web_reply {
	uint32_t magic;
	uint32_t status;                     /* of HTTP */
	char session[WEB_SECRET_TEXT_BYTES]; /* LOGIN */
	char text[WEB_TEXT_BYTES];           /* with another status than 200: one line, why */
};

#endif
