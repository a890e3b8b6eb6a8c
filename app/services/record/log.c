/* SPDX-License-Identifier: MIT */
/* The command line of `ecdaq log`. */
#include "record/log.h"

#include <errno.h>
#include <getopt.h> /* IWYU pragma: keep */
#include <inttypes.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>

#include "config/config.h"
#include "record/log_common.h"

struct arguments {
	const char *dir;
	const char *config_path;
	const char *output;
	struct log_export_options export;
	enum log_format format;
	int is_help;
};

/* Options that a verb takes. */
enum {
	TAKES_DIR = 1 << 0,
	TAKES_OUTPUT = 1 << 1,
	TAKES_EXPORT = 1 << 2,
};

static const struct option known[] = {
	{ "dir", required_argument, NULL, 'd' },    { "config", required_argument, NULL, 'c' },
	{ "output", required_argument, NULL, 'o' }, { "channels", required_argument, NULL, 'n' },
	{ "from", required_argument, NULL, 'f' },   { "to", required_argument, NULL, 't' },
	{ "raw", no_argument, NULL, 'r' },          { "json", no_argument, NULL, 'j' },
	{ "help", no_argument, NULL, 'h' },         { NULL, 0, NULL, 0 },
};

static void help(FILE *out)
{
	fputs("usage: ecdaq log list [--dir DIR] [--json]\n"
	      "       ecdaq log info FILE [--json]\n"
	      "       ecdaq log check [--dir DIR | FILE-OR-DIR...] [--json]\n"
	      "       ecdaq log recover FILE [--output FILE] [--json]\n"
	      "       ecdaq log export [--dir DIR | FILE-OR-DIR...] [--channels NAME,...] [--from "
	      "CYCLE]\n"
	      "                        [--to CYCLE] [--raw] [--output FILE] [--json]\n"
	      "\n"
	      "  list     the recordings: start, duration, cycles, size, state\n"
	      "  info     topics with their fields, counts, metadata of one recording\n"
	      "  check    read all: CRC of each chunk, cycle numbers without a gap in and between "
	      "files\n"
	      "  recover  mend a recording that was not finished; --output copies what is whole\n"
	      "  export   a table with a row a cycle, as CSV (pandas.read_csv takes it as it is)\n"
	      "\n"
	      "  --dir DIR        the recordings' directory (default: record.dir)\n"
	      "  --config FILE    ecdaq.yaml, for record.dir\n"
	      "  --channels LIST  only these, as `ecdaq channels` names them\n"
	      "  --from, --to     first and last cycle\n"
	      "  --raw            values as on the wire (default: physical, raw * scale + offset)\n"
	      "  --output FILE    where to (export: default is standard output)\n"
	      "  --json           JSON (export: an object a line)\n"
	      "\n"
	      "Exit codes: 0 done, check: clean; 1 failed, check: gaps or damage; 2 command "
	      "line.\n",
	      out);
}

static int usage(const char *what, const char *why)
{
	fprintf(stderr, "ecdaq: log: %s: %s (see ecdaq log --help)\n", what, why);
	return LOG_USAGE;
}

static int parse_cycle(const char *name, const char *text, uint64_t *ret_cycle)
{
	unsigned long long value;
	char *end;

	errno = 0;
	value = strtoull(text, &end, 10);
	if (text[0] < '0' || text[0] > '9' || *end != '\0' || errno != 0) {
		return usage(name, "not a cycle number");
	}
	*ret_cycle = value;
	return LOG_OK;
}

static int take_option(struct arguments *a, int c)
{
	switch (c) {
	case 'd':
		a->dir = optarg;
		break;
	case 'c':
		a->config_path = optarg;
		break;
	case 'o':
		a->output = optarg;
		break;
	case 'n':
		a->export.channels = optarg;
		break;
	case 'f':
		return parse_cycle("--from", optarg, &a->export.from);
	case 't':
		return parse_cycle("--to", optarg, &a->export.to);
	case 'r':
		a->export.is_raw = 1;
		break;
	case 'j':
		a->format = LOG_JSON;
		break;
	default:
		a->is_help = 1;
		break;
	}
	return LOG_OK;
}

static unsigned needs(int c)
{
	return c == 'd' || c == 'c'                           ? TAKES_DIR
	       : c == 'o'                                     ? TAKES_OUTPUT
	       : c == 'n' || c == 'f' || c == 't' || c == 'r' ? TAKES_EXPORT
							      : 0;
}

/* Leaves optind at the first operand. */
static int parse(int argc, char **argv, unsigned takes, struct arguments *a)
{
	int c;

	*a = (struct arguments){ .export = { .to = UINT64_MAX } };
	opterr = 0;
	optind = 0; /* begin anew: the caller may have used getopt itself */
	while ((c = getopt_long(argc, argv, ":h", known, NULL)) != -1) {
		int r;

		if (c == ':' || c == '?') {
			return usage(argv[optind - 1],
				     c == ':' ? "needs a value" : "no such option");
		}
		if ((needs(c) & ~takes) != 0) {
			return usage(argv[0], "does not take this option");
		}
		r = take_option(a, c);
		if (r != LOG_OK) {
			return r;
		}
	}
	if (a->export.from > a->export.to) {
		return usage("--from", "is after --to");
	}
	return LOG_OK;
}

/* The directory asked for, or record.dir. */
static int find_dir(const struct arguments *a, char *dir, size_t dir_bytes)
{
	static struct config cfg;
	char error[512];

	config_defaults(&cfg);
	if (a->dir == NULL && a->config_path != NULL &&
	    config_load(a->config_path, &cfg, error, sizeof(error)) < 0) {
		fprintf(stderr, "ecdaq: log: %s\n", error);
		return LOG_FAILED;
	}
	snprintf(dir, dir_bytes, "%s", a->dir != NULL ? a->dir : cfg.record_dir);
	return LOG_OK;
}

static int run_list(const struct arguments *a, char **operands, int count)
{
	char dir[PATH_MAX];
	int r = find_dir(a, dir, sizeof(dir));

	if (count > 0) {
		return usage(operands[0], "list takes no operand");
	}
	return r != LOG_OK ? r : log_list(dir, a->format, stdout, stderr);
}

static int run_info(const struct arguments *a, char **operands, int count)
{
	return count != 1 ? usage("info", "takes one file")
			  : log_info(operands[0], a->format, stdout, stderr);
}

static int run_check(const struct arguments *a, char **operands, int count)
{
	char dir[PATH_MAX];
	const char *paths[1] = { dir };
	int r;

	if (count > 0) {
		return log_check((const char *const *)operands, (size_t)count, a->format, stdout,
				 stderr);
	}
	r = find_dir(a, dir, sizeof(dir));
	return r != LOG_OK ? r : log_check(paths, 1, a->format, stdout, stderr);
}

static int run_recover(const struct arguments *a, char **operands, int count)
{
	return count != 1 ? usage("recover", "takes one file")
			  : log_recover(operands[0], a->output, a->format, stdout, stderr);
}

static int run_export(const struct arguments *a, char **operands, int count)
{
	struct log_export_options options = a->export;
	char dir[PATH_MAX];
	const char *paths[1] = { dir };
	FILE *out = stdout;
	int r = count > 0 ? LOG_OK : find_dir(a, dir, sizeof(dir));

	if (r != LOG_OK) {
		return r;
	}
	options.paths = count > 0 ? (const char *const *)operands : paths;
	options.path_count = count > 0 ? (size_t)count : 1;
	options.format = a->format;
	if (a->output != NULL) {
		out = fopen(a->output, "we");
		if (out == NULL) {
			return log_fail(stderr, a->output, strerror(errno));
		}
	}
	r = log_export(&options, out, stderr);
	if (out != stdout && fclose(out) != 0 && r == LOG_OK) {
		r = log_fail(stderr, a->output, strerror(errno));
	}
	return r;
}

static const struct {
	const char *name;
	unsigned takes;
	int (*run)(const struct arguments *a, char **operands, int count);
} verbs[] = {
	{ "list", TAKES_DIR, run_list },
	{ "info", 0, run_info },
	{ "check", TAKES_DIR, run_check },
	{ "recover", TAKES_OUTPUT, run_recover },
	{ "export", TAKES_DIR | TAKES_OUTPUT | TAKES_EXPORT, run_export },
};

int log_main(int argc, char **argv)
{
	struct arguments a;
	int r;

	if (argc < 2) {
		return usage("no verb", "list, info, check, recover or export");
	}
	if (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0) {
		help(stdout);
		return LOG_OK;
	}
	for (size_t i = 0; i < sizeof(verbs) / sizeof(verbs[0]); i++) {
		if (strcmp(verbs[i].name, argv[1]) != 0) {
			continue;
		}
		r = parse(argc - 1, argv + 1, verbs[i].takes, &a);
		if (r != LOG_OK) {
			return r;
		}
		if (a.is_help) {
			help(stdout);
			return LOG_OK;
		}
		return verbs[i].run(&a, argv + 1 + optind, argc - 1 - optind);
	}
	return usage(argv[1], "no such verb");
}
