/* SPDX-License-Identifier: MIT */
/* AL states and status codes (ETG.1000.6, ETG.1020). Context: any, RT-safe. */
#ifndef WIRE_AL_H
#define WIRE_AL_H

#include <stddef.h>
#include <stdint.h>

/* Never OR states of several slaves together to compare them: INIT | PREOP looks like BOOT. */
enum al_state {
	AL_NONE = 0,
	AL_INIT = 1,
	AL_PREOP = 2,
	AL_BOOT = 3,
	AL_SAFEOP = 4,
	AL_OP = 8,
};

enum { AL_STATE_MASK = 0x0f, AL_ERROR = 0x10, AL_ID_REQUEST = 0x20 };

enum al_status_code {
	AL_CODE_NONE = 0x0000,
	AL_CODE_UNSPECIFIED = 0x0001,
	AL_CODE_NO_MEMORY = 0x0002,
	AL_CODE_INVALID_DEVICE_SETUP = 0x0003,
	AL_CODE_INVALID_STATE_CHANGE = 0x0011,
	AL_CODE_UNKNOWN_STATE = 0x0012,
	AL_CODE_BOOT_NOT_SUPPORTED = 0x0013,
	AL_CODE_INVALID_MAILBOX_CONFIG_BOOT = 0x0015,
	AL_CODE_INVALID_MAILBOX_CONFIG = 0x0016,
	AL_CODE_INVALID_SM_CONFIG = 0x0017,
	AL_CODE_NO_VALID_INPUTS = 0x0018,
	AL_CODE_NO_VALID_OUTPUTS = 0x0019,
	AL_CODE_SYNC_ERROR = 0x001a,
	AL_CODE_SM_WATCHDOG = 0x001b,
	AL_CODE_INVALID_SM_TYPES = 0x001c,
	AL_CODE_INVALID_OUTPUT_CONFIG = 0x001d,
	AL_CODE_INVALID_INPUT_CONFIG = 0x001e,
	AL_CODE_INVALID_WATCHDOG_CONFIG = 0x001f,
	AL_CODE_INVALID_INPUT_MAPPING = 0x0024,
	AL_CODE_INVALID_OUTPUT_MAPPING = 0x0025,
	AL_CODE_FATAL_SYNC_ERROR = 0x002c,
	AL_CODE_NO_SYNC_ERROR = 0x002d,
	AL_CODE_INVALID_DC_SYNC_CONFIG = 0x0030,
	AL_CODE_INVALID_DC_LATCH_CONFIG = 0x0031,
	AL_CODE_PLL_ERROR = 0x0032,
	AL_CODE_DC_SYNC_TIMEOUT = 0x0034,
	AL_CODE_DC_INVALID_SYNC_CYCLE = 0x0035,
	AL_CODE_EEPROM_NO_ACCESS = 0x0050,
	AL_CODE_EEPROM_ERROR = 0x0051,
	AL_CODE_RESTARTED_LOCALLY = 0x0060,
};

/** "INIT", "PRE-OP", "BOOT", "SAFE-OP", "OP", "none"; the error bit is ignored. */
const char *al_state_to_str(uint16_t al_status);
/** The same with "+ERROR" behind it where the error bit is set; "unknown" for no state: no frame
 * comes back. */
void al_status_format(uint32_t al_status, char *buf, size_t buf_len);
/** ETG.1020's text of an AL status code; "unknown" for one it does not list. */
const char *al_status_code_to_str(uint16_t code);
/** What mostly causes @code, where to look, and what to change: commands of ecdaq with SLAVE in the
 * slave's place, and options. "": nothing is known beyond the text. */
const char *al_status_code_hint(uint16_t code);

#endif
