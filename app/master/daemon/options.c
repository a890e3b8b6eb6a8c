/* SPDX-License-Identifier: MIT */
#include "daemon/options.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

enum argument { ARG_NONE, ARG_VALUE };

static int bad(struct failure *failure, const char *option, const char *why)
{
	return failure_set(failure, EXIT_CODE_USAGE, -EINVAL, "%s: %s (see ecdaqd --help)", option,
			   why);
}

static int parse_count(const char *option, const char *text, uint64_t *ret_count,
		       struct failure *failure)
{
	char *end;
	unsigned long long value;

	errno = 0;
	value = strtoull(text, &end, 10);
	if (text[0] < '0' || text[0] > '9' || *end != '\0' || errno != 0 || value == 0 ||
	    value > INT64_MAX / 1000000000) {
		return bad(failure, option, "not a whole number above 0, or far too large");
	}
	*ret_count = value;
	return 0;
}

static int take_value(struct options *op, const char *name, const char *value,
		      struct failure *failure)
{
	if (strcmp(name, "--config") == 0) {
		op->config_path = value;
	} else if (strcmp(name, "--interface") == 0) {
		op->interface = value;
	} else if (strcmp(name, "--run-dir") == 0) {
		op->run_dir = value;
	} else if (strcmp(name, "--set") == 0) {
		if (op->set_count == OPTIONS_LIMIT_SETS) {
			return bad(failure, name, "more than OPTIONS_LIMIT_SETS = 256 of them");
		}
		op->set[op->set_count++] = value;
	} else if (strcmp(name, "--cycles") == 0) {
		return parse_count(name, value, &op->cycles, failure);
	} else {
		return parse_count(name, value, &op->seconds, failure);
	}
	return 0;
}

static void take_flag(struct options *op, const char *name)
{
	if (strcmp(name, "--check") == 0) {
		op->verb = OPTIONS_CHECK;
	} else if (strcmp(name, "--version") == 0) {
		op->verb = OPTIONS_VERSION;
	} else if (strcmp(name, "--help") == 0 || strcmp(name, "-h") == 0) {
		op->verb = OPTIONS_HELP;
	} else if (strcmp(name, "--wait") == 0) {
		op->can_wait = 1;
	} else {
		op->is_simulated = 1;
	}
}

static const struct {
	const char *name;
	enum argument argument;
} known[] = {
	{ "--config", ARG_VALUE }, { "--interface", ARG_VALUE }, { "--run-dir", ARG_VALUE },
	{ "--set", ARG_VALUE },    { "--cycles", ARG_VALUE },    { "--seconds", ARG_VALUE },
	{ "--check", ARG_NONE },   { "--version", ARG_NONE },    { "--help", ARG_NONE },
	{ "-h", ARG_NONE },        { "--wait", ARG_NONE },       { "--simulated", ARG_NONE },
};

/* Index into known[] of "--name" or "--name=value"; -ENOENT. */
static int find(const char *arg, const char **ret_value)
{
	const char *equals = strchr(arg, '=');
	size_t len = equals != NULL ? (size_t)(equals - arg) : strlen(arg);

	for (size_t i = 0; i < sizeof(known) / sizeof(known[0]); i++) {
		if (strlen(known[i].name) == len && strncmp(known[i].name, arg, len) == 0) {
			*ret_value = equals != NULL ? equals + 1 : NULL;
			return (int)i;
		}
	}
	return -ENOENT;
}

int options_parse(int argc, const char *const *argv, struct options *ret_options,
		  struct failure *failure)
{
	struct options op = { .verb = OPTIONS_RUN };

	for (int i = 1; i < argc; i++) {
		const char *value = NULL;
		int k = find(argv[i], &value);
		int r = 0;

		if (k < 0) {
			return bad(failure, argv[i], "no such option");
		}
		if (known[k].argument == ARG_NONE) {
			if (value != NULL) {
				return bad(failure, known[k].name, "takes no value");
			}
			take_flag(&op, known[k].name);
			continue;
		}
		if (value == NULL) {
			value = ++i < argc ? argv[i] : "";
		}
		if (value[0] == '\0') {
			return bad(failure, known[k].name, "needs a value");
		}
		r = take_value(&op, known[k].name, value, failure);
		if (r < 0) {
			return r;
		}
	}
	*ret_options = op;
	return 0;
}

static int refuse(struct failure *failure, int r, const char *error)
{
	return failure_set(failure, EXIT_CODE_CONFIG, r, "%s", error);
}

static int put_text(char *field, size_t field_bytes, const char *option, const char *value,
		    struct failure *failure)
{
	if (strlen(value) >= field_bytes) {
		return bad(failure, option, "too long");
	}
	memcpy(field, value, strlen(value) + 1);
	return 0;
}

int options_apply(const struct options *options, struct config *ret_cfg, struct failure *failure)
{
	static struct config cfg; /* large, and filled once at start */
	char error[FAILURE_TEXT_BYTES] = "";
	int r = config_assemble(options->config_path, options->set, options->set_count, &cfg, error,
				sizeof(error));

	if (r < 0) {
		return refuse(failure, r, error);
	}
	if (options->interface != NULL) {
		r = put_text(cfg.interface, sizeof(cfg.interface), "--interface",
			     options->interface, failure);
	}
	if (r == 0 && options->run_dir != NULL) {
		r = put_text(cfg.run_dir, sizeof(cfg.run_dir), "--run-dir", options->run_dir,
			     failure);
	}
	if (r < 0) {
		return r;
	}
	r = config_check(&cfg, error, sizeof(error));
	if (r < 0) {
		return refuse(failure, r, error);
	}
	*ret_cfg = cfg;
	return 0;
}

void options_help(FILE *out)
{
	fputs("usage: ecdaqd [OPTION...]\n"
	      "\n"
	      "The EtherCAT master: finds the slaves on one network interface, leads them to OP "
	      "and\n"
	      "exchanges process data in every cycle; samples go to a ring in the run directory.\n"
	      "\n"
	      "  --config FILE        ecdaq.yaml (default: built-in defaults)\n"
	      "  --set OPTION=VALUE   set one option over the file, as often as needed:\n"
	      "                       --set cycle.period=500us\n"
	      "  --interface NIC      network interface of the segment (bus.interface)\n"
	      "  --run-dir DIR        rings, status page, admin socket (runtime.run_dir)\n"
	      "  --cycles N           stop in order after N cycles in OP\n"
	      "  --seconds N          stop in order after N seconds in OP\n"
	      "  --wait               while there is no interface, link or slave yet, say so once "
	      "and\n"
	      "                       try again; READY=1 is sent when the waiting begins\n"
	      "  --simulated          say in the status page that the segment is a simulated one\n"
	      "  --check              read the configuration, say whether it is good, and end\n"
	      "  --version            print the version\n"
	      "  --help               this\n"
	      "\n"
	      "SIGTERM or SIGINT: outputs to fail-safe, slaves to INIT, a summary; a second one "
	      "ends at\n"
	      "once, and the slaves' watchdogs make the outputs safe.\n"
	      "\n"
	      "environment: ECDAQ_RUN_DIR (run directory where none is configured), NOTIFY_SOCKET "
	      "and\n"
	      "WATCHDOG_USEC (set by systemd for Type=notify)\n"
	      "\n",
	      out);
	exit_code_help(out, (EXIT_CODE_BIT(CONTROL) << 1) - 1);
}
