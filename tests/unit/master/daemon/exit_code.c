/* SPDX-License-Identifier: MIT */
#include "daemon/exit_code.h"

#include <errno.h>

#include "daemon/failure.h"
#include "harness/test.h"

TEST(daemon_exit_code, every_code_has_a_text_of_its_own)
{
	for (int a = 0; a < EXIT_CODE_COUNT; a++) {
		CHECK(exit_code_to_str((enum exit_code)a)[0] != '\0');
		for (int b = 0; b < a; b++) {
			CHECK(strcmp(exit_code_to_str((enum exit_code)a),
				     exit_code_to_str((enum exit_code)b)) != 0);
		}
	}
	CHECK_STR(exit_code_to_str((enum exit_code)EXIT_CODE_COUNT), "unknown");
	CHECK_STR(exit_code_to_str((enum exit_code) - 1), "unknown");
}

TEST(daemon_exit_code, waiting_helps_against_absence_and_not_against_mistakes)
{
	CHECK_EQ(exit_code_hope(EXIT_CODE_NO_SLAVE), EXIT_CODE_PASSING);
	CHECK_EQ(exit_code_hope(EXIT_CODE_INTERFACE), EXIT_CODE_PASSING);
	CHECK_EQ(exit_code_hope(EXIT_CODE_CONFIG), EXIT_CODE_LASTING);
	CHECK_EQ(exit_code_hope(EXIT_CODE_PERMISSION), EXIT_CODE_LASTING);
	CHECK_EQ(exit_code_hope(EXIT_CODE_BUSY), EXIT_CODE_LASTING);
	CHECK_EQ(exit_code_hope(EXIT_CODE_OK), EXIT_CODE_LASTING);
	CHECK_EQ(exit_code_hope((enum exit_code)1000), EXIT_CODE_LASTING);
}

TEST(daemon_exit_code, errors_of_the_bus_are_told_apart)
{
	CHECK_EQ(exit_code_of_bus(-ENODEV, EXIT_CODE_STATE), EXIT_CODE_NO_SLAVE);
	CHECK_EQ(exit_code_of_bus(-ENXIO, EXIT_CODE_STATE), EXIT_CODE_SLAVES);
	CHECK_EQ(exit_code_of_bus(-EPROTO, EXIT_CODE_STATE), EXIT_CODE_MAPPING);
	CHECK_EQ(exit_code_of_bus(-EIO, EXIT_CODE_STATE), EXIT_CODE_WIRE);
	CHECK_EQ(exit_code_of_bus(-ETIME, EXIT_CODE_STATE), EXIT_CODE_STATE);
	CHECK_EQ(exit_code_of_bus(-ETIME, EXIT_CODE_CLOCKS), EXIT_CODE_CLOCKS);
}

TEST(daemon_exit_code, a_failure_keeps_its_line_within_bounds)
{
	struct failure failure;
	char big[2 * FAILURE_TEXT_BYTES];

	memset(big, 'x', sizeof(big));
	big[sizeof(big) - 1] = '\0';
	CHECK_EQ(failure_set(&failure, EXIT_CODE_WIRE, -EIO, "%s", big), -EIO);
	CHECK_EQ(failure.code, EXIT_CODE_WIRE);
	CHECK_EQ(strlen(failure.text), FAILURE_TEXT_BYTES - 1);
}
