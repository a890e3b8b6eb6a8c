/* SPDX-License-Identifier: MIT */
#include "daemon/failure.h"

#include <errno.h>

#include "harness/test.h"

TEST(daemon_failure, absence_is_transient_and_a_configuration_error_is_not)
{
	CHECK_EQ(failure_is_transient(EXIT_CODE_NO_SLAVE), 1);
	CHECK_EQ(failure_is_transient(EXIT_CODE_INTERFACE), 1);
	CHECK_EQ(failure_is_transient(EXIT_CODE_CONFIG), 0);
	CHECK_EQ(failure_is_transient(EXIT_CODE_PERMISSION), 0);
	CHECK_EQ(failure_is_transient(EXIT_CODE_BUSY), 0);
	CHECK_EQ(failure_is_transient(EXIT_CODE_OK), 0);
	CHECK_EQ(failure_is_transient((enum exit_code)1000), 0);
}

TEST(daemon_failure, each_error_of_the_bus_has_its_exit_code)
{
	CHECK_EQ(failure_code_of_bus(-ENODEV, EXIT_CODE_STATE), EXIT_CODE_NO_SLAVE);
	CHECK_EQ(failure_code_of_bus(-ENXIO, EXIT_CODE_STATE), EXIT_CODE_SLAVES);
	CHECK_EQ(failure_code_of_bus(-EPROTO, EXIT_CODE_STATE), EXIT_CODE_MAPPING);
	CHECK_EQ(failure_code_of_bus(-EIO, EXIT_CODE_STATE), EXIT_CODE_WIRE);
	CHECK_EQ(failure_code_of_bus(-ETIME, EXIT_CODE_STATE), EXIT_CODE_STATE);
	CHECK_EQ(failure_code_of_bus(-ETIME, EXIT_CODE_CLOCKS), EXIT_CODE_CLOCKS);
}

TEST(daemon_failure, a_failure_keeps_its_line_within_bounds)
{
	struct failure failure;
	char big[2 * FAILURE_TEXT_BYTES];

	memset(big, 'x', sizeof(big));
	big[sizeof(big) - 1] = '\0';
	CHECK_EQ(failure_set(&failure, EXIT_CODE_WIRE, -EIO, "%s", big), -EIO);
	CHECK_EQ(failure.code, EXIT_CODE_WIRE);
	CHECK_EQ(strlen(failure.text), FAILURE_TEXT_BYTES - 1);
}
