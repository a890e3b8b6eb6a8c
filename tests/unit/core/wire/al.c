/* SPDX-License-Identifier: MIT */
#include "wire/al.h"

#include <ctype.h>
#include <string.h>

#include "harness/test.h"

TEST(al, states_have_the_fields_names_and_the_error_bit_does_not_matter)
{
	CHECK_STR(al_state_to_str(AL_INIT), "INIT");
	CHECK_STR(al_state_to_str(AL_PREOP | AL_ERROR), "PRE-OP");
	CHECK_STR(al_state_to_str(AL_BOOT), "BOOT");
	CHECK_STR(al_state_to_str(AL_SAFEOP | AL_ERROR | AL_ID_REQUEST), "SAFE-OP");
	CHECK_STR(al_state_to_str(AL_OP), "OP");
	CHECK_STR(al_state_to_str(0), "none");
	CHECK_STR(al_state_to_str(AL_INIT | AL_SAFEOP), "none");
	CHECK_STR(al_state_to_str(0xffff), "none");
}

TEST(al, a_state_as_text_has_its_error_and_no_state_is_unknown)
{
	static const struct {
		uint32_t status;
		const char *text;
	} cases[] = {
		{ AL_OP, "OP" },
		{ AL_SAFEOP | AL_ERROR, "SAFE-OP+ERROR" },
		{ AL_NONE, "unknown" },
		{ AL_ERROR, "unknown" },
	};
	char text[24];

	for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
		al_status_format(cases[i].status, text, sizeof(text));
		CHECK_STR(text, cases[i].text);
	}
}

TEST(al, known_codes_have_their_text_and_others_are_unknown)
{
	CHECK_STR(al_status_code_to_str(AL_CODE_NONE), "no error");
	CHECK_STR(al_status_code_to_str(AL_CODE_INVALID_MAILBOX_CONFIG),
		  "invalid mailbox configuration (PRE-OP)");
	CHECK_STR(al_status_code_to_str(AL_CODE_SM_WATCHDOG), "SyncManager watchdog");
	CHECK_STR(al_status_code_to_str(AL_CODE_FATAL_SYNC_ERROR), "fatal synchronisation error");
	CHECK_STR(al_status_code_to_str(AL_CODE_INVALID_DC_SYNC_CONFIG),
		  "invalid DC SYNC configuration");
	CHECK_STR(al_status_code_to_str(0x0099), "unknown");
	CHECK_STR(al_status_code_to_str(0xffff), "unknown");
}

TEST(al, codes_that_keep_a_slave_from_op_have_a_hint_with_a_place_to_look_and_one_to_change)
{
	static const uint16_t refusals[] = { 0x17, 0x1b, 0x1d, 0x1e, 0x24, 0x25,
					     0x27, 0x2d, 0x30, 0x35, 0x70 };

	for (size_t i = 0; i < sizeof(refusals) / sizeof(refusals[0]); i++) {
		const char *hint = al_status_code_hint(refusals[i]);

		CHECK(strstr(hint, "look: ecdaq ") != NULL);
		CHECK(strstr(hint, "change: ") != NULL);
	}
	CHECK_STR(al_status_code_hint(0), "");
	CHECK_STR(al_status_code_hint(0x1234), "");
}

TEST(al, every_code_of_the_enum_has_a_text_and_every_text_is_printable)
{
	static const uint16_t named[] = {
		AL_CODE_UNSPECIFIED,
		AL_CODE_NO_MEMORY,
		AL_CODE_INVALID_DEVICE_SETUP,
		AL_CODE_INVALID_STATE_CHANGE,
		AL_CODE_UNKNOWN_STATE,
		AL_CODE_BOOT_NOT_SUPPORTED,
		AL_CODE_INVALID_SM_CONFIG,
		AL_CODE_NO_VALID_INPUTS,
		AL_CODE_NO_VALID_OUTPUTS,
		AL_CODE_SYNC_ERROR,
		AL_CODE_INVALID_SM_TYPES,
		AL_CODE_INVALID_OUTPUT_CONFIG,
		AL_CODE_INVALID_INPUT_CONFIG,
		AL_CODE_INVALID_WATCHDOG_CONFIG,
		AL_CODE_NO_SYNC_ERROR,
		AL_CODE_INVALID_DC_LATCH_CONFIG,
		AL_CODE_PLL_ERROR,
		AL_CODE_DC_SYNC_TIMEOUT,
		AL_CODE_DC_INVALID_SYNC_CYCLE,
		AL_CODE_EEPROM_NO_ACCESS,
		AL_CODE_EEPROM_ERROR,
		AL_CODE_RESTARTED_LOCALLY,
		AL_CODE_INVALID_MAILBOX_CONFIG_BOOT,
	};

	for (size_t i = 0; i < sizeof(named) / sizeof(named[0]); i++) {
		CHECK(strcmp(al_status_code_to_str(named[i]), "unknown") != 0);
	}
	for (unsigned code = 0; code <= UINT16_MAX; code++) {
		const char *text = al_status_code_to_str((uint16_t)code);

		CHECK(text[0] != '\0');
		for (; *text != '\0'; text++) {
			CHECK(isprint((unsigned char)*text));
		}
	}
}
