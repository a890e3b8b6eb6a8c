/* SPDX-License-Identifier: MIT */
/*
 * Preloaded into a program (LD_PRELOAD), says what the kernel would of a clock that is disciplined:
 * ECDAQ_TEST_CLOCK="MAXERROR_US ESTERROR_US TAI_OFFSET_S", or "unset": by nothing.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/timex.h>

int adjtimex(struct timex *tx)
{
	const char *text = getenv("ECDAQ_TEST_CLOCK");
	long most_us = 16000000;
	long probably_us = 16000000;
	int tai_s = 0;
	int is_set =
		text != NULL && sscanf(text, "%ld %ld %d", &most_us, &probably_us, &tai_s) == 3;

	memset(tx, 0, sizeof(*tx));
	tx->status = is_set ? STA_PLL : STA_UNSYNC;
	tx->maxerror = most_us;
	tx->esterror = probably_us;
	tx->tai = tai_s;
	return is_set ? TIME_OK : TIME_ERROR;
}
