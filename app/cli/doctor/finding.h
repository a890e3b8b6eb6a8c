/* SPDX-License-Identifier: MIT */
/* What a check found: how bad it is, the value, and what mends it. Context: any. */
#ifndef CLI_DOCTOR_FINDING_H
#define CLI_DOCTOR_FINDING_H

enum finding_level {
	FINDING_OK,
	FINDING_WARN, /* costs latency or safety, or will under load */
	FINDING_FAIL, /* the measurement cannot be relied on like this */
	FINDING_SKIP, /* does not apply here, or cannot be read */
	FINDING_LEVELS,
};

enum { FINDING_TEXT_BYTES = 256 };

struct finding {
	enum finding_level level;
	char value[FINDING_TEXT_BYTES];
	char mend[FINDING_TEXT_BYTES]; /* "": nothing to mend */
	int wants_root;                /* a file was closed to this user */
};

void finding_set(struct finding *f, enum finding_level level, const char *format, ...)
	__attribute__((format(printf, 3, 4)));
void finding_mend(struct finding *f, const char *format, ...) __attribute__((format(printf, 2, 3)));
/** SKIP, because reading @what ended with @err (negative errno). */
void finding_unread(struct finding *f, const char *what, int err);

/** "OK", "WARN", "FAIL", "SKIP". */
const char *finding_level_to_str(enum finding_level level);

#endif
