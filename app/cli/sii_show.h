/* SPDX-License-Identifier: MIT */
/* What an EEPROM says, in words. Context: any. */
#ifndef CLI_SII_SHOW_H
#define CLI_SII_SHOW_H

#include <stddef.h>
#include <stdint.h>

#include "cli/cli.h"

/**
 * Print identity, mailboxes, SyncManagers, FMMUs, PDOs and DC modes. An image that is damaged is
 * shown up to there, and fails. @len: at least SII_CATEGORIES_BYTE.
 */
enum exit_code sii_show(const struct cli *cli, const uint8_t *image, size_t len);
/** The same as a JSON object; @pos: of the slave. */
enum exit_code sii_show_json(const struct cli *cli, uint16_t pos, const uint8_t *image, size_t len);

#endif
