/* SPDX-License-Identifier: MIT */
/* The datagrams of the cyclic frames, and the SyncManagers and FMMUs of a slave as its registers
 * have them now. Failures are reported (cli_fail). Context: blocking. */
#ifndef CLI_MAPPING_H
#define CLI_MAPPING_H

#include <stddef.h>
#include <stdint.h>

#include "base/admin_protocol.h"
#include "cli/cli.h"
#include "wire/fmmu.h"

struct datagrams {
	struct admin_datagram *datagram;
	size_t count;
	char why[ADMIN_TEXT_BYTES]; /* there are none */
};

/** Those of the running bus; a refusal is no failure: none, and why. Free with datagrams_done(). */
enum exit_code datagrams_read(struct cli *cli, struct datagrams *ret);
void datagrams_done(struct datagrams *list);
/** 1 if it has a logical address. */
int datagram_is_logical(const struct admin_datagram *dg);

struct mapping {
	unsigned sm_count;
	unsigned fmmu_count;
	struct sync_manager sm[SYNC_MANAGER_COUNT_MAX];
	struct fmmu fmmu[FMMU_COUNT_MAX];
	uint8_t sm_raw[SYNC_MANAGER_COUNT_MAX][ESC_SM_BYTES];
	uint8_t fmmu_raw[FMMU_COUNT_MAX][ESC_FMMU_BYTES];
};

enum exit_code mapping_read(struct cli *cli, uint16_t pos, struct mapping *ret);
/** @len bytes from register @reg on; up to ADMIN_REGISTER_BYTES. */
enum exit_code registers_read(struct cli *cli, uint16_t pos, uint32_t reg, size_t len,
			      void *ret_bytes);

#endif
