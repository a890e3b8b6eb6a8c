/* SPDX-License-Identifier: MIT */
#include "cli/mapping.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cli/admin_client.h"
#include "wire/datagram.h"

enum exit_code datagrams_read(struct cli *cli, struct datagrams *ret)
{
	struct admin_request rq = { .verb = ADMIN_DATAGRAMS };
	struct admin_transfer tr = { .request = &rq };
	enum exit_code result = admin_transfer(cli, &tr);

	*ret = (struct datagrams){ .count = 0 };
	if (result == EXIT_CODE_OK && tr.reply.result < 0) {
		snprintf(ret->why, sizeof(ret->why), "%s", tr.reply.text);
	} else if (result == EXIT_CODE_OK && tr.answer_len > 0) {
		ret->count = tr.answer_len / sizeof(*ret->datagram);
		ret->datagram = malloc(tr.answer_len);
		if (ret->datagram == NULL) {
			result = cli_fail(cli, EXIT_CODE_FAILED, "out of memory");
		} else {
			memcpy(ret->datagram, tr.answer, ret->count * sizeof(*ret->datagram));
		}
	}
	admin_transfer_done(&tr);
	return result;
}

void datagrams_done(struct datagrams *list)
{
	free(list->datagram);
	list->datagram = NULL;
}

int datagram_is_logical(const struct admin_datagram *dg)
{
	return dg->command == ECAT_CMD_LRD || dg->command == ECAT_CMD_LWR ||
	       dg->command == ECAT_CMD_LRW;
}

enum exit_code registers_read(struct cli *cli, uint16_t pos, uint32_t reg, size_t len,
			      void *ret_bytes)
{
	struct admin_request rq = { .verb = ADMIN_REGISTER_READ,
				    .slave_pos = pos,
				    .address = reg,
				    .length = (uint32_t)len };
	struct admin_reply reply;
	enum exit_code result = len == 0 ? EXIT_CODE_OK : admin_do(cli, &rq, &reply);

	if (result == EXIT_CODE_OK && len > 0) {
		memcpy(ret_bytes, reply.data, len);
	}
	return result;
}

enum exit_code mapping_read(struct cli *cli, uint16_t pos, struct mapping *ret)
{
	uint8_t counts[2] = { 0 };
	enum exit_code result = registers_read(cli, pos, ESC_REG_FMMU_COUNT, 2, counts);

	static_assert(sizeof(ret->fmmu_raw) <= ADMIN_REGISTER_BYTES, "one access");
	*ret = (struct mapping){
		.fmmu_count = counts[0] < FMMU_COUNT_MAX ? counts[0] : FMMU_COUNT_MAX,
		.sm_count = counts[1] < SYNC_MANAGER_COUNT_MAX ? counts[1] : SYNC_MANAGER_COUNT_MAX,
	};
	if (result == EXIT_CODE_OK) {
		result = registers_read(cli, pos, ESC_REG_FMMU,
					(size_t)ret->fmmu_count * ESC_FMMU_BYTES, ret->fmmu_raw);
	}
	if (result == EXIT_CODE_OK) {
		result = registers_read(cli, pos, ESC_REG_SM, (size_t)ret->sm_count * ESC_SM_BYTES,
					ret->sm_raw);
	}
	for (unsigned i = 0; i < ret->fmmu_count; i++) {
		ret->fmmu[i] = fmmu_parse(ret->fmmu_raw[i]);
	}
	for (unsigned i = 0; i < ret->sm_count; i++) {
		ret->sm[i] = sync_manager_parse(ret->sm_raw[i]);
	}
	return result;
}
