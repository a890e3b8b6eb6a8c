/* SPDX-License-Identifier: MIT */
/* ecdaq-sync0: checks the SYNC0 pulses of the slaves on GPIO lines, until it is told to stop. */
#include <errno.h>
#include <getopt.h> /* IWYU pragma: keep */
#include <sched.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "config/config.h"
#include "program/exit_code.h"
#include "sync0/listen.h"
#include "sync0/replay.h"
#include "sync0/watch.h"

enum { ERROR_BYTES = 512, SETS = 256 };

struct arguments {
	const char *config_path;
	const char *run_dir;
	const char *edges;
	const char *replay;
	const char *dump;
	const char *dev_dir;
	const char *set[SETS];
	size_t set_count;
	int is_calibrate;
	int is_json;
	int is_help;
	int is_version;
};

static volatile sig_atomic_t has_stopped;

static void on_signal(int number)
{
	(void)number;
	has_stopped = 1;
}

static const char help_text[] =
	"usage: ecdaq-sync0 [OPTION...]\n"
	"\n"
	"Checks the SYNC0 pulses of the slaves, wired to GPIO lines (slaves[].sync0_line), "
	"against\n"
	"the cycles of ecdaqd. Waits for the master and follows it through restarts.\n"
	"\n"
	"  --config FILE        ecdaq.yaml (default: built-in defaults)\n"
	"  --set OPTION=VALUE   set one option over the file, as often as needed\n"
	"  --run-dir DIR        where ecdaqd has its rings (runtime.run_dir)\n"
	"  --edges FILE         follow the edge file of ecdaq-sim instead of lines (sync0.edges);\n"
	"                       results are marked \"simulated edges\"\n"
	"  --dump FILE          write every edge and cycle to FILE, for --replay\n"
	"  --replay FILE        analyse recorded edges, print what is found and end\n"
	"  --calibrate          the same signal is on the first two lines: measure the noise of "
	"this\n"
	"                       board, store it in sync0.calibration and end; with --replay, from\n"
	"                       the first two slaves of the file\n"
	"  --json               with --replay: one JSON object a line\n"
	"  --version            print the version\n"
	"  --help               this\n"
	"\n"
	"Exit codes: 0 stopped in order, or nothing bad in the file; 1 failed; 2 command line;\n"
	"3 configuration; 4 a right is missing; 5 a check failed in the file; 6 a line is in "
	"use,\n"
	"or another ecdaq-sync0 runs here.\n";

static int take_option(struct arguments *a, int c)
{
	switch (c) {
	case 'c':
		a->config_path = optarg;
		return 0;
	case 's':
		if (a->set_count == SETS) {
			fprintf(stderr, "ecdaq-sync0: --set: more than %d of them\n", SETS);
			return -EINVAL;
		}
		a->set[a->set_count++] = optarg;
		return 0;
	case 'r':
		a->run_dir = optarg;
		return 0;
	case 'e':
		a->edges = optarg;
		return 0;
	case 'd':
		a->dump = optarg;
		return 0;
	case 'p':
		a->replay = optarg;
		return 0;
	case 'D':
		a->dev_dir = optarg;
		return 0;
	case 'k':
		a->is_calibrate = 1;
		return 0;
	case 'j':
		a->is_json = 1;
		return 0;
	case 'v':
		a->is_version = 1;
		return 0;
	case 'h':
		a->is_help = 1;
		return 0;
	default:
		return -ENOENT;
	}
}

static int parse_arguments(int argc, char **argv, struct arguments *a)
{
	static const struct option known[] = {
		{ "config", required_argument, NULL, 'c' },
		{ "set", required_argument, NULL, 's' },
		{ "run-dir", required_argument, NULL, 'r' },
		{ "edges", required_argument, NULL, 'e' },
		{ "dump", required_argument, NULL, 'd' },
		{ "replay", required_argument, NULL, 'p' },
		{ "dev-dir", required_argument, NULL, 'D' }, /* for tests */
		{ "calibrate", no_argument, NULL, 'k' },
		{ "json", no_argument, NULL, 'j' },
		{ "version", no_argument, NULL, 'v' },
		{ "help", no_argument, NULL, 'h' },
		{ NULL, 0, NULL, 0 },
	};
	int c;

	opterr = 0;
	while ((c = getopt_long(argc, argv, ":h", known, NULL)) != -1) {
		int r = take_option(a, c);

		if (r == -ENOENT) {
			fprintf(stderr, "ecdaq-sync0: %s: %s (see ecdaq-sync0 --help)\n",
				argv[optind - 1],
				c == ':' ? "needs a value" : "no such option, or a value too many");
		}
		if (r < 0) {
			return r;
		}
	}
	if (optind < argc) {
		fprintf(stderr, "ecdaq-sync0: %s: takes no operand (see ecdaq-sync0 --help)\n",
			argv[optind]);
		return -EINVAL;
	}
	return 0;
}

static int do_fit(const struct arguments *a)
{
	const char *said = NULL;

	if (a->is_json && a->replay == NULL) {
		said = "--json is for --replay (else: ecdaq sync0 --json)";
	} else if (a->dump != NULL && (a->replay != NULL || a->is_calibrate)) {
		said = "--dump does not go with --replay or --calibrate";
	} else if (a->edges != NULL && (a->replay != NULL || a->is_calibrate)) {
		said = "--edges does not go with --replay or --calibrate";
	}
	if (said != NULL) {
		fprintf(stderr, "ecdaq-sync0: %s\n", said);
	}
	return said == NULL;
}

static int put_path(char *field, size_t field_bytes, const char *option, const char *value)
{
	if (value == NULL) {
		return 0;
	}
	if (value[0] == '\0' || strlen(value) >= field_bytes) {
		fprintf(stderr, "ecdaq-sync0: %s: empty or too long\n", option);
		return -EINVAL;
	}
	memcpy(field, value, strlen(value) + 1);
	return 0;
}

static int configure(const struct arguments *a, struct config *cfg)
{
	char error[ERROR_BYTES] = "";
	int r = config_assemble(a->config_path, a->set, a->set_count, cfg, error, sizeof(error));

	if (r == 0) {
		r = config_check(cfg, error, sizeof(error));
	}
	if (r < 0) {
		fprintf(stderr, "ecdaq-sync0: %s\n", error);
		return r;
	}
	r = put_path(cfg->run_dir, sizeof(cfg->run_dir), "--run-dir", a->run_dir);
	return r < 0 ? r
		     : put_path(cfg->sync0_edges, sizeof(cfg->sync0_edges), "--edges", a->edges);
}

/* Its own core, or any but the cycle's: the check must never be in the way of what it checks. */
static void choose_core(const struct config *cfg)
{
	cpu_set_t set;

	if (sched_getaffinity(0, sizeof(set), &set) < 0) {
		return;
	}
	if (cfg->sync0_cpu >= 0) {
		CPU_ZERO(&set);
		CPU_SET((unsigned)cfg->sync0_cpu, &set);
	} else if (cfg->cycle_cpu >= 0 && CPU_COUNT(&set) > 1) {
		CPU_CLR((unsigned)cfg->cycle_cpu, &set);
	} else {
		return;
	}
	if (sched_setaffinity(0, sizeof(set), &set) < 0) {
		fprintf(stderr, "ecdaq-sync0: sync0.cpu: %s\n", strerror(errno));
	}
}

static int exit_status(int error)
{
	return error == -EACCES || error == -EPERM ? EXIT_CODE_PERMISSION
	       : error == -EBUSY                   ? EXIT_CODE_BUSY
						   : EXIT_CODE_FAILED;
}

static int run_replay(const struct arguments *a, const struct config *cfg)
{
	const struct replay_spec spec = {
		.cfg = cfg,
		.path = a->replay,
		.form = a->is_json ? REPLAY_JSON : REPLAY_TEXT,
		.out = stdout,
	};
	enum replay_outcome outcome = REPLAY_GOOD;
	char why[ERROR_BYTES] = "";
	int r = a->is_calibrate ? replay_calibrate(a->replay, cfg->sync0_calibration, stdout, why)
				: replay(&spec, &outcome, why);

	if (r == 0 && fflush(stdout) != 0) {
		r = -errno;
		snprintf(why, sizeof(why), "standard output: %s", strerror(-r));
	}
	if (r < 0) {
		fprintf(stderr, "ecdaq-sync0: %s\n", why);
		return exit_status(r);
	}
	return outcome == REPLAY_BAD ? EXIT_CODE_CHECK_FAILED : EXIT_CODE_OK;
}

static void take_signals(void)
{
	struct sigaction action = { .sa_handler = on_signal };

	sigaction(SIGTERM, &action, NULL);
	sigaction(SIGINT, &action, NULL);
}

static int run_calibration(const struct config *cfg, const char *dev_dir)
{
	char why[ERROR_BYTES] = "";
	int r = listen_calibrate(cfg, dev_dir, &has_stopped, stdout, why);

	if (r < 0) {
		fprintf(stderr, "ecdaq-sync0: %s\n", why);
		return exit_status(r);
	}
	return EXIT_CODE_OK;
}

static int run_watch(const struct arguments *a, const struct config *cfg, const char *dev_dir)
{
	struct watch_spec spec = { .cfg = cfg, .dev_dir = dev_dir, .platform = platform_posix() };
	char why[WATCH_WHY_BYTES] = "";
	struct watch *watch;
	int r;

	if (a->dump != NULL) {
		spec.dump = fopen(a->dump, "we");
		if (spec.dump == NULL) {
			fprintf(stderr, "ecdaq-sync0: --dump: %s: %s\n", a->dump, strerror(errno));
			return exit_status(-errno);
		}
	}
	r = watch_create(&spec, &watch, why);
	if (r < 0) {
		fprintf(stderr, "ecdaq-sync0: %s\n", why);
		return r == -ENOENT ? EXIT_CODE_CONFIG : exit_status(r);
	}
	while (!has_stopped) {
		watch_step(watch);
	}
	watch_finish(watch);
	watch_destroy(watch);
	if (spec.dump != NULL && fclose(spec.dump) != 0) {
		fprintf(stderr, "ecdaq-sync0: --dump: %s: %s\n", a->dump, strerror(errno));
		return EXIT_CODE_FAILED;
	}
	return EXIT_CODE_OK;
}

int main(int argc, char **argv)
{
	static struct config cfg;
	struct arguments arguments = { .dev_dir = "/dev" };

	if (parse_arguments(argc, argv, &arguments) < 0) {
		return EXIT_CODE_USAGE;
	}
	if (!do_fit(&arguments)) {
		return EXIT_CODE_USAGE;
	}
	if (arguments.is_help || arguments.is_version) {
		fputs(arguments.is_help ? help_text : "ecdaq-sync0 " ECDAQ_VERSION "\n", stdout);
		return EXIT_CODE_OK;
	}
	if (configure(&arguments, &cfg) < 0) {
		return EXIT_CODE_CONFIG;
	}
	if (arguments.replay != NULL) {
		return run_replay(&arguments, &cfg);
	}
	take_signals();
	choose_core(&cfg);
	if (arguments.is_calibrate) {
		return run_calibration(&cfg, arguments.dev_dir);
	}
	if (!cfg.sync0_enable && arguments.edges == NULL) {
		fputs("ecdaq-sync0: sync0.enable is off, there is nothing to do\n", stderr);
		return EXIT_CODE_OK;
	}
	return run_watch(&arguments, &cfg, arguments.dev_dir);
}
