/* SPDX-License-Identifier: MIT */
#include "cli/coe_type.h"

#include <stddef.h>
#include <stdio.h>

const char *coe_type_to_str(uint16_t type, char buf[TEXT_BYTES])
{
	static const struct {
		uint16_t type;
		const char *text;
	} texts[] = {
		{ 0x0001, "BOOL" },        { 0x0002, "SINT" },          { 0x0003, "INT" },
		{ 0x0004, "DINT" },        { 0x0005, "USINT" },         { 0x0006, "UINT" },
		{ 0x0007, "UDINT" },       { 0x0008, "REAL" },          { 0x0009, "STRING" },
		{ 0x000a, "BYTES" },       { 0x000b, "WORDS" },         { 0x000c, "TIME" },
		{ 0x000d, "TIMESPAN" },    { 0x0011, "LREAL" },         { 0x0015, "LINT" },
		{ 0x001b, "ULINT" },       { 0x001e, "BYTE" },          { 0x001f, "WORD" },
		{ 0x0020, "DWORD" },       { 0x0021, "PDO_MAPPING" },   { 0x0023, "IDENTITY" },
		{ 0x0025, "COMMAND_PAR" }, { 0x0027, "PDO_PARAMETER" }, { 0x0029, "SM_SYNC" },
		{ 0x0030, "BIT1" },        { 0x0031, "BIT2" },          { 0x0032, "BIT3" },
		{ 0x0033, "BIT4" },        { 0x0034, "BIT5" },          { 0x0035, "BIT6" },
		{ 0x0036, "BIT7" },        { 0x0037, "BIT8" },
	};

	for (size_t i = 0; i < sizeof(texts) / sizeof(texts[0]); i++) {
		if (texts[i].type == type) {
			return texts[i].text;
		}
	}
	snprintf(buf, TEXT_BYTES, "0x%04x", type);
	return buf;
}
