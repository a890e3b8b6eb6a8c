/* SPDX-License-Identifier: MIT */
/* What ecdaq foe and ecdaq firmware share. */
#ifndef CLI_FOE_H
#define CLI_FOE_H

#include "cli/admin_client.h"

/**
 * The name that the slave gets: @given, or the last part of @path if it is NULL. EXIT_CODE_OK, or
 * the code of a failure, which has been reported.
 */
enum exit_code foe_name(const struct cli *cli, const char *given, const char *path,
			struct admin_request *request);

#endif
