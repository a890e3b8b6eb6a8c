/* SPDX-License-Identifier: MIT */
#include "program/exit_code.h"

#include "harness/test.h"

TEST(exit_code, every_code_has_a_text_of_its_own)
{
	for (int a = 0; a < EXIT_CODE_COUNT; a++) {
		CHECK(exit_code_to_str((enum exit_code)a)[0] != '\0');
		for (int b = 0; b < a; b++) {
			CHECK(strcmp(exit_code_to_str((enum exit_code)a),
				     exit_code_to_str((enum exit_code)b)) != 0);
		}
	}
	CHECK_STR(exit_code_to_str(EXIT_CODE_COUNT), "unknown");
	CHECK_STR(exit_code_to_str((enum exit_code) - 1), "unknown");
}

TEST(exit_code, help_lists_the_codes_of_the_set_and_no_other)
{
	char text[512];
	FILE *out = fmemopen(text, sizeof(text), "w");

	CHECK(out != NULL);
	exit_code_help(out, EXIT_CODE_BIT(OK) | EXIT_CODE_BIT(DISABLED));
	fclose(out);
	CHECK(strstr(text, "   0  success") != NULL);
	CHECK(strstr(text, "  19  --check") != NULL);
	CHECK(strstr(text, "   1  ") == NULL);
}
