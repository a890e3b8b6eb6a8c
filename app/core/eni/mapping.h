/* SPDX-License-Identifier: MIT */
/* What the commands of an ENI file leave in the registers of a slave in OP. Context: any. */
#ifndef ENI_MAPPING_H
#define ENI_MAPPING_H

#include <stdint.h>

#include "eni/eni.h"

enum { ENI_REGISTER_BYTES = 0x1000 };

struct eni_registers {
	uint8_t value[ENI_REGISTER_BYTES];
	uint8_t is_written[ENI_REGISTER_BYTES];
};

/** By the register writes of transitions IP, PS and SO, broadcasts of the master included. */
void eni_registers_of(const struct eni *eni, uint32_t slave, struct eni_registers *ret);

/** 1 if @command writes registers of a slave. */
int eni_is_write(const struct eni_command *command);

/** 1 for addresses, states, error counters, watchdogs, EEPROM access, FMMUs, SyncManagers and
 * clocks: compared elsewhere, or what every master does in its own way. */
int eni_is_own_register(uint32_t reg);

/** The object that the variable is mapped to. 0; -ENOENT: it is no entry of a PDO. */
int eni_variable_entry(const struct eni *eni, const struct eni_variable *variable,
		       uint32_t *ret_slave, const struct eni_entry **ret_entry);

#endif
