/* SPDX-License-Identifier: MIT */
/* ecdaq-record: follows the sample ring of ecdaqd and records it, until it is told to stop. */
#include <errno.h>
#include <getopt.h> /* IWYU pragma: keep */
#include <inttypes.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "config/config.h"
#include "program/exit_code.h"
#include "record/recorder.h"

enum { IDLE_MS = 5, CONFIG_TEXT_BYTES = 1 << 20, ERROR_BYTES = 512, SETS = 256 };

struct arguments {
	const char *config_path;
	const char *run_dir;
	const char *dir;
	const char *set[SETS];
	size_t set_count;
	int is_once;
	int is_help;
	int is_version;
};

struct program {
	struct config cfg;
	char ring_path[CONFIG_PATH_BYTES];
	char events_path[CONFIG_PATH_BYTES];
	char sync0_path[CONFIG_PATH_BYTES];
	char sync0_events_path[CONFIG_PATH_BYTES];
	char status_path[CONFIG_PATH_BYTES];
	char *config_text;
};

static volatile sig_atomic_t has_stopped;

static void on_signal(int number)
{
	(void)number;
	has_stopped = 1;
}

static void help(FILE *out)
{
	fputs("usage: ecdaq-record [OPTION...]\n"
	      "\n"
	      "Records every cycle of ecdaqd to MCAP files. Waits for the master, follows it "
	      "through "
	      "restarts,\n"
	      "and goes on behind the last recorded cycle after it was killed itself.\n"
	      "\n"
	      "  --config FILE        ecdaq.yaml (default: built-in defaults)\n"
	      "  --set OPTION=VALUE   set one option over the file, as often as needed:\n"
	      "                       --set record.rotate_size=64MiB\n"
	      "  --run-dir DIR        where ecdaqd has its rings (runtime.run_dir)\n"
	      "  --dir DIR            where the recordings go (record.dir)\n"
	      "  --once               end after the master has ended\n"
	      "  --version            print the version\n"
	      "  --help               this\n"
	      "\n"
	      "Exit codes: 0 stopped in order; 1 recording failed; 2 command line; 3 "
	      "configuration;\n"
	      "4 a right is missing; 6 another ecdaq-record works in the directory.\n",
	      out);
}

static int parse_arguments(int argc, char **argv, struct arguments *a)
{
	static const struct option known[] = {
		{ "config", required_argument, NULL, 'c' },
		{ "set", required_argument, NULL, 's' },
		{ "run-dir", required_argument, NULL, 'r' },
		{ "dir", required_argument, NULL, 'd' },
		{ "once", no_argument, NULL, 'o' },
		{ "version", no_argument, NULL, 'v' },
		{ "help", no_argument, NULL, 'h' },
		{ NULL, 0, NULL, 0 },
	};
	int c;

	opterr = 0;
	while ((c = getopt_long(argc, argv, ":h", known, NULL)) != -1) {
		switch (c) {
		case 'c':
			a->config_path = optarg;
			break;
		case 's':
			if (a->set_count == SETS) {
				fprintf(stderr, "ecdaq-record: --set: more than %d of them\n",
					SETS);
				return -EINVAL;
			}
			a->set[a->set_count++] = optarg;
			break;
		case 'r':
			a->run_dir = optarg;
			break;
		case 'd':
			a->dir = optarg;
			break;
		case 'o':
			a->is_once = 1;
			break;
		case 'v':
			a->is_version = 1;
			break;
		case 'h':
			a->is_help = 1;
			break;
		default:
			fprintf(stderr, "ecdaq-record: %s: %s (see ecdaq-record --help)\n",
				argv[optind - 1],
				c == ':' ? "needs a value" : "no such option, or a value too many");
			return -EINVAL;
		}
	}
	if (optind < argc) {
		fprintf(stderr, "ecdaq-record: %s: takes no operand (see ecdaq-record --help)\n",
			argv[optind]);
		return -EINVAL;
	}
	return 0;
}

static int put_path(char *field, size_t field_bytes, const char *option, const char *value)
{
	if (value == NULL) {
		return 0;
	}
	if (value[0] == '\0' || strlen(value) >= field_bytes) {
		fprintf(stderr, "ecdaq-record: %s: empty or too long\n", option);
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
		fprintf(stderr, "ecdaq-record: %s\n", error);
		return r;
	}
	r = put_path(cfg->run_dir, sizeof(cfg->run_dir), "--run-dir", a->run_dir);
	return r < 0 ? r : put_path(cfg->record_dir, sizeof(cfg->record_dir), "--dir", a->dir);
}

/* The file as it is, for the recordings. */
static char *read_text(const char *path)
{
	char *text = calloc(1, CONFIG_TEXT_BYTES + 1);
	FILE *in = text != NULL && path[0] != '\0' ? fopen(path, "re") : NULL;

	if (in != NULL) {
		size_t n = fread(text, 1, CONFIG_TEXT_BYTES, in);

		text[n] = '\0';
		fclose(in);
	}
	return text;
}

static int find_paths(struct program *pg)
{
	int r = config_run_path(&pg->cfg, CONFIG_RUN_SAMPLES, pg->ring_path, sizeof(pg->ring_path));

	r = r < 0 ? r
		  : config_run_path(&pg->cfg, CONFIG_RUN_EVENTS, pg->events_path,
				    sizeof(pg->events_path));
	r = r < 0 ? r
		  : config_run_path(&pg->cfg, CONFIG_RUN_RECORD_STATUS, pg->status_path,
				    sizeof(pg->status_path));
	r = r < 0 ? r
		  : config_run_path(&pg->cfg, CONFIG_RUN_SYNC0, pg->sync0_path,
				    sizeof(pg->sync0_path));
	r = r < 0 ? r
		  : config_run_path(&pg->cfg, CONFIG_RUN_SYNC0_EVENTS, pg->sync0_events_path,
				    sizeof(pg->sync0_events_path));
	if (r < 0) {
		fprintf(stderr, "ecdaq-record: run directory: %s\n", strerror(-r));
	}
	return r;
}

static void report(void *ctx, const char *line)
{
	(void)ctx;
	fprintf(stderr, "ecdaq-record: %s\n", line);
}

static struct recorder_options recorder_options(const struct program *pg)
{
	const struct config *cfg = &pg->cfg;

	return (struct recorder_options){
		.ring_path = pg->ring_path,
		.events_path = pg->events_path,
		.status_path = pg->status_path,
		.sync0_path = pg->sync0_path,
		.sync0_events_path = pg->sync0_events_path,
		.dir = cfg->record_dir,
		.pid = getpid(),
		.chunk_period_ns = cfg->record_chunk_period_ns,
		.sync_period_ns = cfg->record_sync_period_ns,
		.rotate_period_ns = cfg->record_rotate_period_ns,
		.rotate_bytes = cfg->record_rotate_bytes,
		.budget_bytes = cfg->record_budget_bytes,
		.reserve_bytes = cfg->record_reserve_bytes,
		.zstd_level = cfg->record_compression,
		.config_path = cfg->path,
		.config_text = pg->config_text,
		.platform = platform_posix(),
		.report = report,
	};
}

static int run(struct recorder *rec, int is_once)
{
	struct sigaction action = { .sa_handler = on_signal };
	sigset_t stops;
	sigset_t others;
	int r;

	/* Blocked but for the wait below, so that none is missed between the question and the wait.
	 */
	sigemptyset(&stops);
	sigaddset(&stops, SIGTERM);
	sigaddset(&stops, SIGINT);
	sigprocmask(SIG_BLOCK, &stops, &others);
	sigaction(SIGTERM, &action, NULL);
	sigaction(SIGINT, &action, NULL);
	while (!has_stopped) {
		enum recorder_result result = recorder_step(rec);
		struct timespec wait = { .tv_nsec =
						 result == RECORDER_IDLE ? IDLE_MS * 1000000L : 0 };

		if (result == RECORDER_ENDED && is_once) {
			break;
		}
		ppoll(NULL, 0, &wait, &others);
	}
	r = recorder_finish(rec);
	if (r < 0) {
		fprintf(stderr, "ecdaq-record: %s: not finished: %s; the next start mends it\n",
			recorder_status(rec)->path, strerror(-r));
	}
	return r;
}

static int exit_status(int error)
{
	return error == -EBUSY                                          ? EXIT_CODE_BUSY
	       : error == -EACCES || error == -EPERM || error == -EROFS ? EXIT_CODE_PERMISSION
									: EXIT_CODE_FAILED;
}

int main(int argc, char **argv)
{
	static struct program pg;
	struct arguments arguments = { .config_path = NULL };
	struct recorder_options options;
	struct recorder *rec;
	char error[ERROR_BYTES];
	int r;

	if (parse_arguments(argc, argv, &arguments) < 0) {
		return EXIT_CODE_USAGE;
	}
	if (arguments.is_help || arguments.is_version) {
		arguments.is_help ? help(stdout) : (void)puts("ecdaq-record " ECDAQ_VERSION);
		return EXIT_CODE_OK;
	}
	if (configure(&arguments, &pg.cfg) < 0 || find_paths(&pg) < 0) {
		return EXIT_CODE_CONFIG;
	}
	if (!pg.cfg.record_enable) {
		fputs("ecdaq-record: record.enable is off, there is nothing to do\n", stderr);
		return EXIT_CODE_OK;
	}
	pg.config_text = read_text(pg.cfg.path);
	if (pg.config_text == NULL) {
		fprintf(stderr, "ecdaq-record: %s\n", strerror(ENOMEM));
		return EXIT_CODE_FAILED;
	}
	options = recorder_options(&pg);
	r = recorder_create(&options, &rec, error, sizeof(error));
	if (r < 0) {
		fprintf(stderr, "ecdaq-record: %s\n", error);
		free(pg.config_text);
		return exit_status(r);
	}
	r = run(rec, arguments.is_once);
	recorder_destroy(rec);
	free(pg.config_text);
	return r < 0 ? EXIT_CODE_FAILED : EXIT_CODE_OK;
}
