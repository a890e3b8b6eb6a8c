/* SPDX-License-Identifier: MIT */
#include "program/error.h"

#include <unistd.h>

#include "harness/test.h"

TEST(error, a_message_is_one_printable_line)
{
	char text[128] = "";
	FILE *file = tmpfile();
	int err = dup(STDERR_FILENO);

	CHECK(file != NULL);
	dup2(fileno(file), STDERR_FILENO);
	error_print("ecdaqd", "%s: no such channel", "a\nb\x7f\x1b");
	dup2(err, STDERR_FILENO);
	close(err);
	rewind(file);
	CHECK(fgets(text, sizeof(text), file) != NULL);
	fclose(file);
	CHECK_STR(text, "ecdaqd: a?b??: no such channel\n");
}
