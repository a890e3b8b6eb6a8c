/* SPDX-License-Identifier: MIT */
/* ecdaq log: handed on to the module that writes the recordings. */
#include "cli/cli.h"

#ifdef ECDAQ_HAVE_RECORD

#include <stdio.h>
#include <stdlib.h>

#include "record/log.h"

enum exit_code verb_log(struct cli *cli, int argc, char **argv)
{
	char config[CONFIG_PATH_BYTES + 16];
	char **words = calloc((size_t)argc + 3, sizeof(*words));
	int count = 0;
	int result;

	if (words == NULL) {
		return cli_fail(cli, EXIT_CODE_FAILED, "out of memory");
	}
	/* argv[-1] is the verb itself: log_main() takes it for the program's name. */
	for (int i = -1; i < argc; i++) {
		words[count++] = argv[i];
		/* A configuration named before the verb is meant for it, too. */
		if (i == 0 && cli->config != NULL) {
			snprintf(config, sizeof(config), "--config=%s", cli->config);
			words[count++] = config;
		}
	}
	result = log_main(count, words);
	free(words);
	return (enum exit_code)result;
}

#else

enum exit_code verb_log(struct cli *cli, int argc, char **argv)
{
	(void)argc;
	(void)argv;
	return cli_fail(cli, EXIT_CODE_FAILED, "this ecdaq was built without the recorder");
}

#endif
