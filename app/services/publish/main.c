/* SPDX-License-Identifier: MIT */
/* ecdaq-dds: publishes what ecdaqd measures over DDS and takes commands, until it is told to stop.
 */
#include <errno.h>
#include <getopt.h> /* IWYU pragma: keep */
#include <signal.h>
#include <stdio.h>
#include <string.h>

#include "config/config.h"
#include "program/exit_code.h"
#include "publish/publisher.h"

enum { ERROR_BYTES = 512, SETS = 256 };

struct arguments {
	const char *config_path;
	const char *run_dir;
	const char *set[SETS];
	size_t set_count;
	int is_check;
	int is_help;
	int is_version;
};

static volatile sig_atomic_t has_stopped;

static void on_signal(int number)
{
	(void)number;
	has_stopped = 1;
}

static void help(FILE *out)
{
	fputs("usage: ecdaq-dds [OPTION...]\n"
	      "\n"
	      "Publishes every cycle of ecdaqd over DDS and passes commands on to it. Waits for "
	      "the\n"
	      "master and follows it through restarts. Needs dds.enable=on and dds.interface.\n"
	      "\n"
	      "  --config FILE        ecdaq.yaml (default: built-in defaults)\n"
	      "  --set OPTION=VALUE   set one option over the file, as often as needed:\n"
	      "                       --set dds.interface=eth1\n"
	      "  --run-dir DIR        where ecdaqd has its rings (runtime.run_dir)\n"
	      "  --check              only look whether it could start\n"
	      "  --version            print the version\n"
	      "  --help               this\n"
	      "\n"
	      "Exit codes: 0 ended in order, or dds.enable is off; 1 DDS failed; 2 command line;\n"
	      "3 configuration, the network interface among it; 4 --check, and dds.enable is "
	      "off.\n",
	      out);
}

static int take_option(int c, int was, char **argv, struct arguments *a)
{
	switch (c) {
	case 'c':
		a->config_path = optarg;
		return 0;
	case 's':
		if (a->set_count == SETS) {
			fprintf(stderr, "ecdaq-dds: --set: more than %d of them\n", SETS);
			return -EINVAL;
		}
		a->set[a->set_count++] = optarg;
		return 0;
	case 'r':
		a->run_dir = optarg;
		return 0;
	case 'k':
		a->is_check = 1;
		return 0;
	case 'v':
		a->is_version = 1;
		return 0;
	case 'h':
		a->is_help = 1;
		return 0;
	default:
		fprintf(stderr, "ecdaq-dds: %s: %s (see ecdaq-dds --help)\n", argv[was - 1],
			c == ':' ? "needs a value" : "no such option, or a value too many");
		return -EINVAL;
	}
}

static int parse_arguments(int argc, char **argv, struct arguments *a)
{
	static const struct option known[] = {
		{ "config", required_argument, NULL, 'c' },
		{ "set", required_argument, NULL, 's' },
		{ "run-dir", required_argument, NULL, 'r' },
		{ "check", no_argument, NULL, 'k' },
		{ "version", no_argument, NULL, 'v' },
		{ "help", no_argument, NULL, 'h' },
		{ NULL, 0, NULL, 0 },
	};
	int c;

	opterr = 0;
	while ((c = getopt_long(argc, argv, ":h", known, NULL)) != -1) {
		if (take_option(c, optind, argv, a) < 0) {
			return -EINVAL;
		}
	}
	if (optind < argc) {
		fprintf(stderr, "ecdaq-dds: %s: takes no operand (see ecdaq-dds --help)\n",
			argv[optind]);
		return -EINVAL;
	}
	return 0;
}

static int configure(const struct arguments *a, struct config *cfg)
{
	char error[ERROR_BYTES] = "";
	int r = config_assemble(a->config_path, a->set, a->set_count, cfg, error, sizeof(error));

	if (r == 0) {
		r = config_check(cfg, error, sizeof(error));
	}
	if (r == 0 && a->run_dir != NULL) {
		if (a->run_dir[0] == '\0' || strlen(a->run_dir) >= sizeof(cfg->run_dir)) {
			snprintf(error, sizeof(error), "--run-dir: empty or too long");
			r = -EINVAL;
		} else {
			memcpy(cfg->run_dir, a->run_dir, strlen(a->run_dir) + 1);
		}
	}
	if (r < 0) {
		fprintf(stderr, "ecdaq-dds: %s\n", error);
	}
	return r;
}

static int run(struct publisher *publisher)
{
	struct sigaction action = { .sa_handler = on_signal };
	char error[ERROR_BYTES];
	int r = 0;

	sigaction(SIGTERM, &action, NULL);
	sigaction(SIGINT, &action, NULL);
	while (!has_stopped && r == 0) {
		r = publisher_step(publisher, error, sizeof(error));
	}
	if (r < 0) {
		fprintf(stderr, "ecdaq-dds: %s\n", error);
	}
	return r;
}

static int exit_status(int error)
{
	return error == -EINVAL || error == -ENODEV || error == -ENAMETOOLONG ||
			       error == -EKEYREJECTED
		       ? EXIT_CODE_CONFIG
		       : EXIT_CODE_FAILED;
}

int main(int argc, char **argv)
{
	static struct config cfg;
	struct arguments arguments = { .config_path = NULL };
	struct publisher *publisher;
	char error[ERROR_BYTES];
	int r;

	if (parse_arguments(argc, argv, &arguments) < 0) {
		return EXIT_CODE_USAGE;
	}
	if (arguments.is_help || arguments.is_version) {
		arguments.is_help ? help(stdout) : (void)puts("ecdaq-dds " ECDAQ_VERSION);
		return EXIT_CODE_OK;
	}
	if (configure(&arguments, &cfg) < 0) {
		return EXIT_CODE_CONFIG;
	}
	if (!cfg.dds_enable) {
		fputs("ecdaq-dds: dds.enable is off: nothing to do\n", stderr);
		return arguments.is_check ? EXIT_CODE_DISABLED : EXIT_CODE_OK;
	}
	r = publisher_create(&cfg, &publisher, error, sizeof(error));
	if (r < 0) {
		fprintf(stderr, "ecdaq-dds: %s\n", error);
		return exit_status(r);
	}
	r = arguments.is_check ? 0 : run(publisher);
	publisher_destroy(publisher);
	return r < 0 ? exit_status(r) : EXIT_CODE_OK;
}
