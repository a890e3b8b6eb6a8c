/* SPDX-License-Identifier: MIT */
/* ecdaq-options: writes the reference page or the sample file from the option table. */
#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "config/pages.h"

static const char usage[] = "usage: ecdaq-options --reference | --sample\n"
			    "\n"
			    "Writes the page of all options (Markdown) or a sample ecdaq.yaml to\n"
			    "standard output, from the option table that the programs use.\n"
			    "\n"
			    "Exit codes: 0 ok, 1 cannot write, 2 usage.\n";

int main(int argc, char **argv)
{
	if (argc == 2 && strcmp(argv[1], "--help") == 0) {
		fputs(usage, stdout);
	} else if (argc == 2 && strcmp(argv[1], "--reference") == 0) {
		pages_write_reference(stdout);
	} else if (argc == 2 && strcmp(argv[1], "--sample") == 0) {
		pages_write_sample(stdout);
	} else {
		fprintf(stderr, "ecdaq-options: expected --reference or --sample\n");
		return 2;
	}
	if (fflush(stdout) != 0) {
		fprintf(stderr, "ecdaq-options: cannot write: %s\n", strerror(errno));
		return 1;
	}
	return 0;
}
