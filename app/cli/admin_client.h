/* SPDX-License-Identifier: MIT */
/* One request to ecdaqd and its answer. Context: blocking. */
#ifndef CLI_ADMIN_CLIENT_H
#define CLI_ADMIN_CLIENT_H

#include <stddef.h>
#include <stdint.h>

#include "base/admin_protocol.h"
#include "cli/cli.h"

/**
 * Send @request (its magic is filled in) and wait for the reply. EXIT_CODE_OK when there is one,
 * whatever it contains; else the code of a failure that was reported.
 */
enum exit_code admin_ask(struct cli *cli, struct admin_request *request,
			 struct admin_reply *ret_reply);

/* A request with more data, or a longer answer, than one message has. */
struct admin_transfer {
	struct admin_request *request;
	const uint8_t *data; /* to send, in place of request->data; NULL: none */
	size_t data_len;
	int can_cancel;           /* when stop_requested() (base/stop.h) */
	const char *what;         /* for its progress (program/progress.h); NULL: none is shown */
	const char *unit;         /* that it is counted in; NULL: bytes */
	struct admin_reply reply; /* the last message */
	uint8_t *answer;          /* all data of the answer; NULL: none */
	size_t answer_len;
};

/** admin_ask() with them. Free the answer with admin_transfer_done(), after a failure, too. */
enum exit_code admin_transfer(struct cli *cli, struct admin_transfer *tr);
/**
 * The same, a few times where a slave's mailbox gives no answer (-ETIMEDOUT): one of hundreds may
 * be lost with a frame. Only for what changes nothing when it is read again.
 */
enum exit_code admin_transfer_read(struct cli *cli, struct admin_transfer *tr);
/** admin_transfer() with admin_judge(). */
enum exit_code admin_transfer_do(struct cli *cli, struct admin_transfer *tr);
void admin_transfer_done(struct admin_transfer *tr);

/**
 * Send a request that stays open, and wait until ecdaqd reports that it has begun. EXIT_CODE_OK,
 * and @ret_fd is for the next two; or the code of a failure or refusal that was reported.
 */
enum exit_code admin_hold(struct cli *cli, struct admin_request *request, int *ret_fd);
/** 1 if ecdaqd has ended the request, or itself. */
int admin_hold_has_ended(int fd);
/** End the request; -1 is fine. */
void admin_hold_end(int fd);

/** EXIT_CODE_OK if @reply grants the request; else report why not: EXIT_CODE_REFUSED. */
enum exit_code admin_judge(const struct cli *cli, const struct admin_reply *reply);

/** Both in one. */
enum exit_code admin_do(struct cli *cli, struct admin_request *request,
			struct admin_reply *ret_reply);

#endif
