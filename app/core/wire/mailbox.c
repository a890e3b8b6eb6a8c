/* SPDX-License-Identifier: MIT */
#include "wire/mailbox.h"

const char *mailbox_type_to_str(unsigned type)
{
	static const char *const names[MAILBOX_TYPE_VOE + 1] = {
		[MAILBOX_TYPE_ERROR] = "error", [MAILBOX_TYPE_AOE] = "AoE",
		[MAILBOX_TYPE_EOE] = "EoE",     [MAILBOX_TYPE_COE] = "CoE",
		[MAILBOX_TYPE_FOE] = "FoE",     [MAILBOX_TYPE_SOE] = "SoE",
		[MAILBOX_TYPE_VOE] = "VoE",
	};

	return type <= MAILBOX_TYPE_VOE && names[type] != NULL ? names[type] : "unknown";
}

const char *mailbox_error_to_str(unsigned error)
{
	static const char *const texts[] = {
		[MAILBOX_ERROR_SYNTAX] = "syntax of the mailbox header is wrong",
		[MAILBOX_ERROR_UNSUPPORTED_PROTOCOL] = "protocol not supported",
		[MAILBOX_ERROR_INVALID_CHANNEL] = "invalid channel",
		[MAILBOX_ERROR_SERVICE_NOT_SUPPORTED] = "service not supported",
		[MAILBOX_ERROR_INVALID_HEADER] = "invalid protocol header",
		[MAILBOX_ERROR_SIZE_TOO_SHORT] = "message too short",
		[MAILBOX_ERROR_NO_MEMORY] = "no memory in the slave",
		[MAILBOX_ERROR_INVALID_SIZE] = "inconsistent length",
		[MAILBOX_ERROR_SERVICE_IN_WORK] = "service in work",
	};

	return error < sizeof(texts) / sizeof(texts[0]) && texts[error] != NULL ? texts[error]
										: "unknown";
}
