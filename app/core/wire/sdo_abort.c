/* SPDX-License-Identifier: MIT */
#include "wire/sdo_abort.h"

#include <stddef.h>

static const struct {
	uint32_t code;
	const char *text;
} aborts[] = {
	{ 0x05030000, "toggle bit did not change" },
	{ 0x05040000, "SDO protocol time-out" },
	{ 0x05040001, "command specifier not valid or unknown" },
	{ 0x05040005, "out of memory" },
	{ 0x06010000, "access to this object is not supported" },
	{ 0x06010001, "object can only be written" },
	{ 0x06010002, "object can only be read" },
	{ 0x06010003, "subindex cannot be written, subindex 0 must be 0 for that" },
	{ 0x06010004, "complete access is not supported for this object" },
	{ 0x06010005, "object is longer than the mailbox" },
	{ 0x06010006, "object is mapped, it cannot be written by SDO" },
	{ 0x06020000, "object does not exist" },
	{ 0x06040041, "object cannot be mapped into a PDO" },
	{ 0x06040042, "number or length of the objects exceeds the PDO" },
	{ 0x06040043, "parameters are not compatible" },
	{ 0x06040047, "internal incompatibility of the device" },
	{ 0x06060000, "access failed because of a hardware fault" },
	{ 0x06070010, "data type or length does not match" },
	{ 0x06070012, "data too long" },
	{ 0x06070013, "data too short" },
	{ 0x06090011, "subindex does not exist" },
	{ 0x06090030, "value out of range" },
	{ 0x06090031, "value too high" },
	{ 0x06090032, "value too low" },
	{ 0x06090033, "list of modules does not match" },
	{ 0x06090036, "maximum is below minimum" },
	{ 0x08000000, "general error" },
	{ 0x08000020, "data cannot be transferred or stored" },
	{ 0x08000021, "data cannot be transferred or stored: local control" },
	{ 0x08000022, "data cannot be transferred or stored in this state" },
	{ 0x08000023, "no object dictionary is present" },
};

const char *sdo_abort_to_str(uint32_t code)
{
	for (size_t i = 0; i < sizeof(aborts) / sizeof(aborts[0]); i++) {
		if (aborts[i].code == code) {
			return aborts[i].text;
		}
	}
	return "unknown";
}
