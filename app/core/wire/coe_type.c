/* SPDX-License-Identifier: MIT */
#include "wire/coe_type.h"

#include <stddef.h>
#include <string.h>

struct coe_type {
	uint16_t type;
	const char *name; /* the first one of a type is the one it is written with */
};

static const struct coe_type types[] = {
	{ 0x0001, "BOOL" },           { 0x0002, "SINT" },         { 0x0003, "INT" },
	{ 0x0004, "DINT" },           { 0x0005, "USINT" },        { 0x0006, "UINT" },
	{ 0x0007, "UDINT" },          { 0x0008, "REAL" },         { 0x0009, "STRING" },
	{ 0x000a, "BYTES" },          { 0x000b, "WORDS" },        { 0x000c, "TIME" },
	{ 0x000d, "TIMESPAN" },       { 0x0010, "INT24" },        { 0x0011, "LREAL" },
	{ 0x0012, "INT40" },          { 0x0013, "INT48" },        { 0x0014, "INT56" },
	{ 0x0015, "LINT" },           { 0x0016, "UINT24" },       { 0x0018, "UINT40" },
	{ 0x0019, "UINT48" },         { 0x001a, "UINT56" },       { 0x001b, "ULINT" },
	{ 0x001e, "BYTE" },           { 0x001f, "WORD" },         { 0x0020, "DWORD" },
	{ 0x0021, "PDO_MAPPING" },    { 0x0023, "IDENTITY" },     { 0x0025, "COMMAND_PAR" },
	{ 0x0027, "PDO_PARAMETER" },  { 0x0029, "SM_SYNC" },      { 0x002d, "BITARR8" },
	{ 0x002e, "BITARR16" },       { 0x002f, "BITARR32" },     { 0x0030, "BIT1" },
	{ 0x0031, "BIT2" },           { 0x0032, "BIT3" },         { 0x0033, "BIT4" },
	{ 0x0034, "BIT5" },           { 0x0035, "BIT6" },         { 0x0036, "BIT7" },
	{ 0x0037, "BIT8" },           { 0x0001, "BIT" },          { 0x0001, "SWITCH" },
	{ 0x0009, "VISIBLE_STRING" }, { 0x000a, "OCTET_STRING" }, { 0x000b, "UNICODE_STRING" },
};

enum { TYPE_COUNT = sizeof(types) / sizeof(types[0]) };

const char *coe_type_name(uint16_t type)
{
	for (size_t i = 0; i < TYPE_COUNT; i++) {
		if (types[i].type == type) {
			return types[i].name;
		}
	}
	return NULL;
}

uint16_t coe_type_of_name(const char *name)
{
	size_t len = strcspn(name, "(");

	for (size_t i = 0; i < TYPE_COUNT; i++) {
		if (strlen(types[i].name) == len && memcmp(types[i].name, name, len) == 0) {
			return types[i].type;
		}
	}
	return 0;
}
