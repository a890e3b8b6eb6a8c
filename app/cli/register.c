/* SPDX-License-Identifier: MIT */
#include "cli/register.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "wire/al.h"
#include "wire/esc_reg.h"

enum meaning { NUMBER, AL_STATE, AL_CODE, SM_MODE, SM_DIRECTION, LOOP, SYNC_OWNER, DIFF_SIGN };

static const struct register_field features[] = {
	{ "fmmu_whole_bytes_only", 0, 1, NUMBER },
	{ "dc", 2, 1, NUMBER },
	{ "dc_64_bit", 3, 1, NUMBER },
	{ "ebus_low_jitter", 4, 1, NUMBER },
	{ "ebus_enhanced_link", 5, 1, NUMBER },
	{ "mii_enhanced_link", 6, 1, NUMBER },
	{ "separate_fcs_errors", 7, 1, NUMBER },
	{ "dc_enhanced_activation", 8, 1, NUMBER },
	{ "no_lrw", 9, 1, NUMBER },
	{ "no_brw_aprw_fprw", 10, 1, NUMBER },
	{ "fixed_fmmu_and_sm", 11, 1, NUMBER },
	{ NULL, 0, 0, NUMBER },
};

static const struct register_field dl_control[] = {
	{ "drops_foreign_frames", 0, 1, NUMBER },
	{ "temporary", 1, 1, NUMBER },
	{ "loop_port0", 8, 2, LOOP },
	{ "loop_port1", 10, 2, LOOP },
	{ "loop_port2", 12, 2, LOOP },
	{ "loop_port3", 14, 2, LOOP },
	{ "rx_fifo", 16, 3, NUMBER },
	{ "ebus_low_jitter", 19, 1, NUMBER },
	{ "alias_enabled", 24, 1, NUMBER },
	{ NULL, 0, 0, NUMBER },
};

static const struct register_field dl_status[] = {
	{ "pdi_operational", 0, 1, NUMBER },      { "pdi_watchdog_good", 1, 1, NUMBER },
	{ "enhanced_link", 2, 1, NUMBER },        { "link_port0", 4, 1, NUMBER },
	{ "link_port1", 5, 1, NUMBER },           { "link_port2", 6, 1, NUMBER },
	{ "link_port3", 7, 1, NUMBER },           { "closed_port0", 8, 1, NUMBER },
	{ "communication_port0", 9, 1, NUMBER },  { "closed_port1", 10, 1, NUMBER },
	{ "communication_port1", 11, 1, NUMBER }, { "closed_port2", 12, 1, NUMBER },
	{ "communication_port2", 13, 1, NUMBER }, { "closed_port3", 14, 1, NUMBER },
	{ "communication_port3", 15, 1, NUMBER }, { NULL, 0, 0, NUMBER },
};

static const struct register_field al_control[] = {
	{ "state", 0, 4, AL_STATE },
	{ "acknowledge", 4, 1, NUMBER },
	{ "id_request", 5, 1, NUMBER },
	{ NULL, 0, 0, NUMBER },
};

static const struct register_field al_status[] = {
	{ "state", 0, 4, AL_STATE },
	{ "error", 4, 1, NUMBER },
	{ "id_loaded", 5, 1, NUMBER },
	{ NULL, 0, 0, NUMBER },
};

static const struct register_field al_status_code[] = {
	{ "code", 0, 16, AL_CODE },
	{ NULL, 0, 0, NUMBER },
};

static const struct register_field ecat_event[] = {
	{ "dc_latch", 0, 1, NUMBER }, { "dl_status", 2, 1, NUMBER }, { "al_status", 3, 1, NUMBER },
	{ "sm0", 4, 1, NUMBER },      { "sm1", 5, 1, NUMBER },       { "sm2", 6, 1, NUMBER },
	{ "sm3", 7, 1, NUMBER },      { "sm4", 8, 1, NUMBER },       { "sm5", 9, 1, NUMBER },
	{ "sm6", 10, 1, NUMBER },     { "sm7", 11, 1, NUMBER },      { NULL, 0, 0, NUMBER },
};

static const struct register_field al_event[] = {
	{ "al_control", 0, 1, NUMBER },
	{ "dc_latch", 1, 1, NUMBER },
	{ "sync0", 2, 1, NUMBER },
	{ "sync1", 3, 1, NUMBER },
	{ "sm_activation", 4, 1, NUMBER },
	{ "eeprom_command", 5, 1, NUMBER },
	{ "watchdog_process_data", 6, 1, NUMBER },
	{ "sm0", 8, 1, NUMBER },
	{ "sm1", 9, 1, NUMBER },
	{ "sm2", 10, 1, NUMBER },
	{ "sm3", 11, 1, NUMBER },
	{ NULL, 0, 0, NUMBER },
};

static const struct register_field rx_errors[] = {
	{ "invalid_frames_port0", 0, 8, NUMBER },
	{ "rx_errors_port0", 8, 8, NUMBER },
	{ "invalid_frames_port1", 16, 8, NUMBER },
	{ "rx_errors_port1", 24, 8, NUMBER },
	{ "invalid_frames_port2", 32, 8, NUMBER },
	{ "rx_errors_port2", 40, 8, NUMBER },
	{ "invalid_frames_port3", 48, 8, NUMBER },
	{ "rx_errors_port3", 56, 8, NUMBER },
	{ NULL, 0, 0, NUMBER },
};

static const struct register_field octet_a_port[] = {
	{ "port0", 0, 8, NUMBER },  { "port1", 8, 8, NUMBER }, { "port2", 16, 8, NUMBER },
	{ "port3", 24, 8, NUMBER }, { NULL, 0, 0, NUMBER },
};

static const struct register_field watchdog_status[] = {
	{ "running", 0, 1, NUMBER },
	{ NULL, 0, 0, NUMBER },
};

static const struct register_field eeprom_config[] = {
	{ "pdi_may_own", 0, 1, NUMBER },
	{ "taken_from_pdi", 1, 1, NUMBER },
	{ NULL, 0, 0, NUMBER },
};

static const struct register_field eeprom_control[] = {
	{ "write_enable", 0, 1, NUMBER },
	{ "emulated", 5, 1, NUMBER },
	{ "reads_8_bytes", 6, 1, NUMBER },
	{ "address_2_bytes", 7, 1, NUMBER },
	{ "command", 8, 3, NUMBER },
	{ "checksum_error", 11, 1, NUMBER },
	{ "not_loaded", 12, 1, NUMBER },
	{ "no_acknowledge", 13, 1, NUMBER },
	{ "no_write_enable", 14, 1, NUMBER },
	{ "busy", 15, 1, NUMBER },
	{ NULL, 0, 0, NUMBER },
};

static const struct register_field fmmu[] = {
	{ "logical_start", 0, 32, NUMBER },
	{ "bytes", 32, 16, NUMBER },
	{ "logical_first_bit", 48, 3, NUMBER },
	{ "logical_last_bit", 56, 3, NUMBER },
	{ "physical_start", 64, 16, NUMBER },
	{ "physical_first_bit", 80, 3, NUMBER },
	{ "read", 88, 1, NUMBER },
	{ "write", 89, 1, NUMBER },
	{ "active", 96, 1, NUMBER },
	{ NULL, 0, 0, NUMBER },
};

static const struct register_field sm[] = {
	{ "start", 0, 16, NUMBER },
	{ "bytes", 16, 16, NUMBER },
	{ "mode", 32, 2, SM_MODE },
	{ "direction", 34, 2, SM_DIRECTION },
	{ "ecat_event", 36, 1, NUMBER },
	{ "pdi_event", 37, 1, NUMBER },
	{ "watchdog", 38, 1, NUMBER },
	{ "written", 40, 1, NUMBER },
	{ "read", 41, 1, NUMBER },
	{ "mailbox_full", 43, 1, NUMBER },
	{ "newest_buffer", 44, 2, NUMBER },
	{ "active", 48, 1, NUMBER },
	{ "repeat_request", 49, 1, NUMBER },
	{ "deactivated_by_pdi", 56, 1, NUMBER },
	{ "repeat_acknowledge", 57, 1, NUMBER },
	{ NULL, 0, 0, NUMBER },
};

static const struct register_field dc_difference[] = {
	{ "ns", 0, 31, NUMBER },
	{ "own_time", 31, 1, DIFF_SIGN },
	{ NULL, 0, 0, NUMBER },
};

static const struct register_field dc_cyclic_control[] = {
	{ "sync_of", 0, 1, SYNC_OWNER },
	{ "latch0_of", 4, 1, SYNC_OWNER },
	{ "latch1_of", 5, 1, SYNC_OWNER },
	{ NULL, 0, 0, NUMBER },
};

static const struct register_field dc_activation[] = {
	{ "cyclic", 0, 1, NUMBER },
	{ "sync0", 1, 1, NUMBER },
	{ "sync1", 2, 1, NUMBER },
	{ NULL, 0, 0, NUMBER },
};

static const struct register_field dc_activation_status[] = {
	{ "sync0_waits", 0, 1, NUMBER },
	{ "sync1_waits", 1, 1, NUMBER },
	{ "start_time_implausible", 2, 1, NUMBER },
	{ NULL, 0, 0, NUMBER },
};

static const struct esc_register registers[] = {
	{ "type", ESC_REG_TYPE, 1, 1, 0, NULL },
	{ "revision", ESC_REG_REVISION, 1, 1, 0, NULL },
	{ "build", ESC_REG_BUILD, 2, 1, 0, NULL },
	{ "fmmu_count", ESC_REG_FMMU_COUNT, 1, 1, 0, NULL },
	{ "sm_count", ESC_REG_SM_COUNT, 1, 1, 0, NULL },
	{ "ram_size", ESC_REG_RAM_SIZE, 1, 1, 0, NULL },
	{ "port_descriptor", ESC_REG_PORT_DESCRIPTOR, 1, 1, 0, NULL },
	{ "features", ESC_REG_FEATURES, 2, 1, 0, features },
	{ "station_address", ESC_REG_STATION_ADDRESS, 2, 1, 0, NULL },
	{ "station_alias", ESC_REG_STATION_ALIAS, 2, 1, 0, NULL },
	{ "dl_control", ESC_REG_DL_CONTROL, 4, 1, 0, dl_control },
	{ "dl_status", ESC_REG_DL_STATUS, 2, 1, 0, dl_status },
	{ "al_control", ESC_REG_AL_CONTROL, 2, 1, 0, al_control },
	{ "al_status", ESC_REG_AL_STATUS, 2, 1, 0, al_status },
	{ "al_status_code", ESC_REG_AL_STATUS_CODE, 2, 1, 0, al_status_code },
	{ "pdi_control", ESC_REG_PDI_CONTROL, 1, 1, 0, NULL },
	{ "esc_config", ESC_REG_ESC_CONFIG, 1, 1, 0, NULL },
	{ "pdi_config", ESC_REG_PDI_CONFIG, 4, 1, 0, NULL },
	{ "ecat_event_mask", ESC_REG_ECAT_EVENT_MASK, 2, 1, 0, ecat_event },
	{ "al_event_mask", ESC_REG_AL_EVENT_MASK, 4, 1, 0, al_event },
	{ "ecat_event", ESC_REG_ECAT_EVENT_REQUEST, 2, 1, 0, ecat_event },
	{ "al_event", ESC_REG_AL_EVENT_REQUEST, 4, 1, 0, al_event },
	{ "rx_errors", ESC_REG_RX_ERROR_COUNTER, 8, 1, 0, rx_errors },
	{ "forwarded_errors", ESC_REG_FORWARDED_RX_ERROR, 4, 1, 0, octet_a_port },
	{ "processing_errors", ESC_REG_ECAT_PU_ERROR, 1, 1, 0, NULL },
	{ "pdi_errors", ESC_REG_PDI_ERROR, 1, 1, 0, NULL },
	{ "lost_links", ESC_REG_LOST_LINK_COUNTER, 4, 1, 0, octet_a_port },
	{ "watchdog_divider", ESC_REG_WATCHDOG_DIVIDER, 2, 1, 0, NULL },
	{ "watchdog_time_pdi", ESC_REG_WATCHDOG_TIME_PDI, 2, 1, 0, NULL },
	{ "watchdog_time", ESC_REG_WATCHDOG_TIME_PD, 2, 1, 0, NULL },
	{ "watchdog_status", ESC_REG_WATCHDOG_STATUS_PD, 2, 1, 0, watchdog_status },
	{ "watchdog_expirations", ESC_REG_WATCHDOG_COUNTER_PD, 1, 1, 0, NULL },
	{ "watchdog_expirations_pdi", ESC_REG_WATCHDOG_COUNTER_PDI, 1, 1, 0, NULL },
	{ "eeprom_config", ESC_REG_EEPROM_CONFIG, 1, 1, 0, eeprom_config },
	{ "eeprom_pdi_access", ESC_REG_EEPROM_PDI_ACCESS, 1, 1, 0, NULL },
	{ "eeprom_control", ESC_REG_EEPROM_CONTROL, 2, 1, 0, eeprom_control },
	{ "eeprom_address", ESC_REG_EEPROM_ADDRESS, 4, 1, 0, NULL },
	{ "eeprom_data", ESC_REG_EEPROM_DATA, 8, 1, 0, NULL },
	{ "mii_control", ESC_REG_MII_CONTROL, 2, 1, 0, NULL },
	{ "fmmu", ESC_REG_FMMU, 16, 16, 16, fmmu },
	{ "sm", ESC_REG_SM, 8, 16, 8, sm },
	{ "dc_receive_time_port", ESC_REG_DC_RECEIVE_TIME_PORT, 4, 4, 4, NULL },
	{ "dc_system_time", ESC_REG_DC_SYSTEM_TIME, 8, 1, 0, NULL },
	{ "dc_receive_time", ESC_REG_DC_RECEIVE_TIME_PU, 8, 1, 0, NULL },
	{ "dc_offset", ESC_REG_DC_SYSTEM_TIME_OFFSET, 8, 1, 0, NULL },
	{ "dc_delay", ESC_REG_DC_SYSTEM_TIME_DELAY, 4, 1, 0, NULL },
	{ "dc_difference", ESC_REG_DC_SYSTEM_TIME_DIFF, 4, 1, 0, dc_difference },
	{ "dc_speed_start", ESC_REG_DC_SPEED_COUNTER_START, 2, 1, 0, NULL },
	{ "dc_speed_difference", ESC_REG_DC_SPEED_COUNTER_DIFF, 2, 1, 0, NULL },
	{ "dc_time_filter", ESC_REG_DC_TIME_FILTER, 1, 1, 0, NULL },
	{ "dc_speed_filter", ESC_REG_DC_SPEED_FILTER, 1, 1, 0, NULL },
	{ "dc_cyclic_control", ESC_REG_DC_CYCLIC_CONTROL, 1, 1, 0, dc_cyclic_control },
	{ "dc_activation", ESC_REG_DC_ACTIVATION, 1, 1, 0, dc_activation },
	{ "dc_pulse_length", ESC_REG_DC_PULSE_LENGTH, 2, 1, 0, NULL },
	{ "dc_activation_status", ESC_REG_DC_ACTIVATION_STATUS, 1, 1, 0, dc_activation_status },
	{ "dc_sync0_status", ESC_REG_DC_SYNC0_STATUS, 1, 1, 0, NULL },
	{ "dc_sync1_status", ESC_REG_DC_SYNC1_STATUS, 1, 1, 0, NULL },
	{ "dc_start_time", ESC_REG_DC_START_TIME, 8, 1, 0, NULL },
	{ "dc_next_sync1", ESC_REG_DC_NEXT_SYNC1, 8, 1, 0, NULL },
	{ "dc_sync0_cycle", ESC_REG_DC_SYNC0_CYCLE, 4, 1, 0, NULL },
	{ "dc_sync1_cycle", ESC_REG_DC_SYNC1_CYCLE, 4, 1, 0, NULL },
};

enum { REGISTERS = sizeof(registers) / sizeof(registers[0]) };

const struct esc_register *register_number(size_t number)
{
	return number < REGISTERS ? &registers[number] : NULL;
}

/* The number behind the name; -1: there is none, or it is too large. */
static int number_behind(const char *text, unsigned count)
{
	char *end;
	unsigned long number;

	if (!isdigit((unsigned char)text[0])) {
		return -1;
	}
	number = strtoul(text, &end, 10);
	return *end == '\0' && number < count ? (int)number : -1;
}

const struct esc_register *register_find(const char *name, uint32_t *ret_address)
{
	for (size_t i = 0; i < REGISTERS; i++) {
		const struct esc_register *reg = &registers[i];
		size_t len = strlen(reg->name);
		int number = 0;

		if (strncasecmp(name, reg->name, len) != 0) {
			continue;
		}
		if (reg->count > 1) {
			number = number_behind(name + len, reg->count);
		} else if (name[len] != '\0') {
			continue;
		}
		if (number >= 0) {
			*ret_address = reg->address + (uint32_t)number * reg->stride;
			return reg;
		}
	}
	return NULL;
}

const struct esc_register *register_at(uint32_t address)
{
	for (size_t i = 0; i < REGISTERS; i++) {
		const struct esc_register *reg = &registers[i];

		for (unsigned n = 0; n < reg->count; n++) {
			if (address == reg->address + n * reg->stride) {
				return reg;
			}
		}
	}
	return NULL;
}

void register_name(const struct esc_register *reg, uint32_t address,
		   char ret_name[REGISTER_NAME_BYTES])
{
	if (reg->count > 1) {
		snprintf(ret_name, REGISTER_NAME_BYTES, "%s%u", reg->name,
			 (address - reg->address) / reg->stride);
	} else {
		snprintf(ret_name, REGISTER_NAME_BYTES, "%s", reg->name);
	}
}

uint64_t register_field_value(const struct register_field *field, const uint8_t *bytes)
{
	uint64_t value = 0;

	for (unsigned i = 0; i < field->bits; i++) {
		unsigned bit = field->first_bit + i;

		value |= (uint64_t)(bytes[bit / 8] >> bit % 8 & 1) << i;
	}
	return value;
}

static const char *word_of(enum meaning meaning, uint64_t value)
{
	static const struct {
		enum meaning meaning;
		const char *word[4];
	} all[] = {
		{ SM_MODE, { "3 buffers", NULL, "mailbox", NULL } },
		{ SM_DIRECTION, { "slave to master", "master to slave", NULL, NULL } },
		{ LOOP, { "auto", "auto close", "open", "closed" } },
		{ SYNC_OWNER, { "EtherCAT", "PDI", NULL, NULL } },
		{ DIFF_SIGN, { "ahead or equal", "behind", NULL, NULL } },
	};

	if (meaning == AL_STATE) {
		return al_state_to_str((uint16_t)value);
	}
	if (meaning == AL_CODE) {
		return al_status_code_to_str((uint16_t)value);
	}
	for (size_t i = 0; i < sizeof(all) / sizeof(all[0]) && value < 4; i++) {
		if (all[i].meaning == meaning && all[i].word[value] != NULL) {
			return all[i].word[value];
		}
	}
	return "";
}

void register_field_text(const struct register_field *field, uint64_t value,
			 char ret_text[REGISTER_TEXT_BYTES])
{
	snprintf(ret_text, REGISTER_TEXT_BYTES, "%s", word_of((enum meaning)field->meaning, value));
}
