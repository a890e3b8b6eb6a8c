/* SPDX-License-Identifier: MIT */
#include "eni/mapping.h"

#include <errno.h>
#include <string.h>

#include "eni/fields.h"
#include "wire/datagram.h"
#include "wire/esc_reg.h"

int eni_is_write(const struct eni_command *command)
{
	return command->cmd == ECAT_CMD_FPWR || command->cmd == ECAT_CMD_APWR ||
	       command->cmd == ECAT_CMD_BWR;
}

int eni_is_own_register(uint32_t reg)
{
	return (reg >= ESC_REG_STATION_ADDRESS && reg < ESC_REG_STATION_ALIAS) ||
	       (reg >= ESC_REG_DL_CONTROL && reg <= ESC_REG_AL_STATUS_CODE) ||
	       (reg >= ESC_REG_ECAT_EVENT_MASK && reg < ESC_REG_AL_EVENT_MASK) ||
	       (reg >= ESC_REG_RX_ERROR_COUNTER && reg <= ESC_REG_WATCHDOG_TIME_PD + 1) ||
	       (reg >= ESC_REG_EEPROM_CONFIG && reg < ESC_REG_MII_CONTROL) ||
	       (reg >= ESC_REG_FMMU && reg <= ESC_REG_DC_SYNC1_CYCLE + 3);
}

static void apply(const struct eni_command *command, struct eni_registers *ret)
{
	for (size_t i = 0; i < command->data.len && command->ado + i < ENI_REGISTER_BYTES; i++) {
		ret->value[command->ado + i] = command->data.data[i];
		ret->is_written[command->ado + i] = 1;
	}
}

void eni_registers_of(const struct eni *eni, uint32_t slave, struct eni_registers *ret)
{
	static const enum eni_transition up[] = { ENI_FROM_IP, ENI_FROM_PS, ENI_FROM_SO };
	const uint32_t owners[] = { ENI_MASTER, slave };

	memset(ret, 0, sizeof(*ret));
	for (size_t t = 0; t < sizeof(up) / sizeof(up[0]); t++) {
		for (size_t i = 0; i < 2 * eni->init_count; i++) {
			const struct eni_command *c = &eni->init[i % eni->init_count];

			if (c->owner == owners[i / eni->init_count] && eni_is_write(c) &&
			    (c->transitions & ENI_HAS(up[t])) != 0) {
				apply(c, ret);
			}
		}
	}
}

/* --- variables --- */

/* Where it is looked for, and how far that is. */
struct search {
	const struct eni *eni;
	uint32_t at; /* bit */
	uint32_t bits;
};

/* In one PDO; NULL: behind it. */
static const struct eni_entry *find_in(struct search *search, const struct eni_pdo *pdo)
{
	for (size_t e = 0; e < pdo->count; e++) {
		const struct eni_entry *entry = &search->eni->entry[pdo->first + e];

		if (search->bits == search->at) {
			return entry;
		}
		search->bits += entry->bits;
	}
	return NULL;
}

/* The entry at bit @at of the PDOs that are assigned in that direction. */
static const struct eni_entry *entry_at(const struct eni *eni, uint32_t slave, uint32_t is_output,
					uint32_t at)
{
	struct search search = { .eni = eni, .at = at };

	for (uint32_t sm = 0; sm < ENI_LIMIT_SM; sm++) {
		for (size_t i = 0; i < eni->pdo_count; i++) {
			const struct eni_pdo *pdo = &eni->pdo[i];
			const struct eni_entry *found = NULL;

			if (pdo->slave == slave && pdo->is_tx != is_output && pdo->sm == sm &&
			    (pdo->has & ENI_HAS(ENI_PDO_SM)) != 0) {
				found = find_in(&search, pdo);
			}
			if (found != NULL) {
				return found;
			}
		}
		search.bits = (search.bits + 7) & ~UINT32_C(7);
	}
	return NULL;
}

int eni_variable_entry(const struct eni *eni, const struct eni_variable *variable,
		       uint32_t *ret_slave, const struct eni_entry **ret_entry)
{
	for (uint32_t s = 0; s < eni->slave_count; s++) {
		const struct eni_slave *slave = &eni->slave[s];
		const struct eni_range *range = variable->is_output ? slave->send : slave->recv;
		size_t count = variable->is_output ? slave->send_count : slave->recv_count;
		uint32_t before = 0; /* bits of the ranges before */

		for (size_t i = 0; i < count; before += range[i].len, i++) {
			uint32_t at = variable->offset - range[i].start;
			const struct eni_entry *entry;

			if (variable->offset < range[i].start || at >= range[i].len) {
				continue;
			}
			entry = entry_at(eni, s, variable->is_output, before + at);
			if (entry == NULL || entry->index == 0) {
				return -ENOENT;
			}
			*ret_slave = s;
			*ret_entry = entry;
			return 0;
		}
	}
	return -ENOENT;
}
