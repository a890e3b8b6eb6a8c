/* SPDX-License-Identifier: MIT */
#include "daemon/failure.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>

int failure_set(struct failure *failure, enum exit_code code, int result, const char *format, ...)
{
	va_list args;

	failure->code = code;
	va_start(args, format);
	vsnprintf(failure->text, sizeof(failure->text), format, args);
	va_end(args);
	return result;
}

int failure_is_transient(enum exit_code code)
{
	return code == EXIT_CODE_INTERFACE || code == EXIT_CODE_NO_SLAVE ||
	       code == EXIT_CODE_SLAVES || code == EXIT_CODE_CLOCKS || code == EXIT_CODE_STATE ||
	       code == EXIT_CODE_WIRE;
}

enum exit_code failure_code_of_bus(int r, enum exit_code otherwise)
{
	switch (-r) {
	case ENODEV:
		return EXIT_CODE_NO_SLAVE;
	case ENXIO:
		return EXIT_CODE_SLAVES;
	case EPROTO:
	case E2BIG:
	case ENOTSUP:
		return EXIT_CODE_MAPPING;
	case EIO:
	case ENETDOWN:
		return EXIT_CODE_WIRE;
	case ENOMEM:
	case ENOSPC:
		return EXIT_CODE_RESOURCES;
	case EINVAL:
		return EXIT_CODE_CONFIG;
	default:
		return otherwise;
	}
}
