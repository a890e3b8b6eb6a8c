/* SPDX-License-Identifier: MIT */
#include "cli/doctor/finding.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

void finding_set(struct finding *f, enum finding_level level, const char *format, ...)
{
	va_list args;

	f->level = level;
	va_start(args, format);
	vsnprintf(f->value, sizeof(f->value), format, args);
	va_end(args);
}

void finding_mend(struct finding *f, const char *format, ...)
{
	va_list args;

	va_start(args, format);
	vsnprintf(f->mend, sizeof(f->mend), format, args);
	va_end(args);
}

void finding_unread(struct finding *f, const char *what, int err)
{
	switch (-err) {
	case EACCES:
	case EPERM:
		f->wants_root = 1;
		finding_set(f, FINDING_SKIP, "%s: closed to this user", what);
		finding_mend(f, "run ecdaq doctor as root");
		return;
	case ENOENT:
	case ENOTDIR:
		finding_set(f, FINDING_SKIP, "%s: not there", what);
		return;
	case EPROTO:
		finding_set(f, FINDING_SKIP, "%s: of another version of ecdaq", what);
		return;
	case EBADMSG:
		finding_set(f, FINDING_SKIP, "%s: not understood", what);
		return;
	default:
		finding_set(f, FINDING_SKIP, "%s: %s", what, strerror(-err));
		return;
	}
}

const char *finding_level_to_str(enum finding_level level)
{
	static const char *const names[FINDING_LEVELS] = { "OK", "WARN", "FAIL", "SKIP" };

	return names[level];
}
