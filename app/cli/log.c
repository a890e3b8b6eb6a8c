/* SPDX-License-Identifier: MIT */
/* ecdaq log: handed on to the module that writes the recordings. */
#include "cli/cli.h"

#ifdef ECDAQ_HAVE_RECORD

#include "record/log.h"

enum cli_exit verb_log(struct cli *cli, int argc, char **argv)
{
	(void)cli;
	/* argv[-1] is the verb itself: log_main() takes it for the program's name. */
	return (enum cli_exit)log_main(argc + 1, argv - 1);
}

#else

enum cli_exit verb_log(struct cli *cli, int argc, char **argv)
{
	(void)argc;
	(void)argv;
	return cli_fail(cli, CLI_FAILED, "this ecdaq was built without the recorder");
}

#endif
