/* SPDX-License-Identifier: MIT */
/* ecdaq config reload. Context: blocking. */
#ifndef CLI_CONFIG_RELOAD_H
#define CLI_CONFIG_RELOAD_H

#include "cli/cli.h"
#include "program/json.h"

/** Ask ecdaqd to read its configuration again, and show what differs; @js NULL: as text. */
enum exit_code config_reload(struct cli *cli, struct json *js);

#endif
