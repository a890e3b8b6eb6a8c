/* SPDX-License-Identifier: MIT */
/* ecdaq-log: what `ecdaq log` runs. */
#include "record/log.h"

int main(int argc, char **argv)
{
	return log_main(argc, argv);
}
