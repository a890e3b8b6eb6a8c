/* SPDX-License-Identifier: MIT */
/* One request to ecdaqd and its answer. Context: blocking. */
#ifndef CLI_ADMIN_CLIENT_H
#define CLI_ADMIN_CLIENT_H

#include "base/admin_protocol.h"
#include "cli/cli.h"

/**
 * Send @request (its magic is filled in) and wait for the reply. EXIT_CODE_OK when there is one,
 * whatever it contains; else the code of a failure that was reported.
 */
enum exit_code admin_ask(struct cli *cli, struct admin_request *request,
			 struct admin_reply *ret_reply);

/** EXIT_CODE_OK if @reply grants the request; else report why not: EXIT_CODE_REFUSED. */
enum exit_code admin_judge(const struct cli *cli, const struct admin_reply *reply);

/** Both in one. */
enum exit_code admin_do(struct cli *cli, struct admin_request *request,
			struct admin_reply *ret_reply);

#endif
