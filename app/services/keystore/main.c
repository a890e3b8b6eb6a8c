/* SPDX-License-Identifier: MIT */
/* ecdaq-security: what `ecdaq security` runs. Creates and checks the keys of DDS Security. */
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "base/args.h"
#include "keystore/keystore.h"
#include "program/error.h"
#include "program/exit_code.h"

static const char program[] = "ecdaq: security";

enum { DAYS = 3650, DAYS_MAX = 36500 };

struct security {
	const char *dir;
	uint64_t days;
	const char *name; /* of a participant, or a folder; NULL: none given */
};

static enum exit_code exit_of(int r, const char *error)
{
	enum exit_code code = r == -EACCES || r == -EPERM ? EXIT_CODE_PERMISSION
			      : r == -EINVAL              ? EXIT_CODE_USAGE
							  : EXIT_CODE_FAILED;

	if (r == 0) {
		return EXIT_CODE_OK;
	}
	error_print(program, "%s", error);
	return code;
}

static void print_appliance(const struct security *s)
{
	printf("%s/appliance: for the appliance, where only ecdaq-dds may read it: dds.security\n",
	       s->dir);
}

static enum exit_code init(const struct security *s)
{
	char error[KEYSTORE_ERROR_BYTES];
	enum exit_code result = exit_of(keystore_init(s->dir, (unsigned)s->days, error), error);

	if (result == EXIT_CODE_OK) {
		print_appliance(s);
		printf("%s/ca: signs the keys of all participants: keep it offline\n", s->dir);
	}
	return result;
}

/* To renew its keys or what they allow: with those of everybody else left as they are. */
static enum exit_code add_appliance(const struct security *s)
{
	char error[KEYSTORE_ERROR_BYTES];
	enum exit_code result = exit_of(
		keystore_add(s->dir, "appliance", KEYSTORE_APPLIANCE, (unsigned)s->days, error),
		error);

	if (result == EXIT_CODE_OK) {
		print_appliance(s);
	}
	return result;
}

static enum exit_code add(const struct security *s, enum keystore_role role)
{
	char error[KEYSTORE_ERROR_BYTES];
	enum exit_code result =
		exit_of(keystore_add(s->dir, s->name, role, (unsigned)s->days, error), error);

	if (result == EXIT_CODE_OK) {
		printf("%s/%s: for this %s only\n", s->dir, s->name,
		       role == KEYSTORE_COMMANDER ? "commander" : "subscriber");
	}
	return result;
}

static enum exit_code add_subscriber(const struct security *s)
{
	return add(s, KEYSTORE_SUBSCRIBER);
}

static enum exit_code add_commander(const struct security *s)
{
	return add(s, KEYSTORE_COMMANDER);
}

static enum exit_code check(const struct security *s)
{
	struct keystore_identity identity;
	char error[KEYSTORE_ERROR_BYTES];
	char until[16];
	struct tm parts;
	time_t expires;
	enum exit_code result =
		exit_of(keystore_check(s->name, (int64_t)time(NULL), &identity, error), error);

	if (result == EXIT_CODE_OK) {
		expires = (time_t)identity.expires_s;
		gmtime_r(&expires, &parts);
		strftime(until, sizeof(until), "%Y-%m-%d", &parts);
		printf("%s: %s, until %s\n", s->name, identity.name, until);
	}
	return result;
}

static const struct subject {
	const char *verb;
	const char *operand; /* NULL: none */
	enum exit_code (*run)(const struct security *s);
} subjects[] = {
	{ "init", NULL, init },
	{ "add-appliance", NULL, add_appliance },
	{ "add-subscriber", "NAME", add_subscriber },
	{ "add-commander", "NAME", add_commander },
	{ "check", "DIR", check },
};

static enum exit_code usage(const char *message)
{
	error_print(program, "%s (see ecdaq security --help)", message);
	return EXIT_CODE_USAGE;
}

static enum exit_code run(struct security *s, const struct args *args)
{
	char error[ARGS_ERROR_BYTES];

	for (size_t i = 0; i < sizeof(subjects) / sizeof(subjects[0]); i++) {
		const struct subject *subject = &subjects[i];

		if (strcmp(subject->verb, args->operands[0]) != 0) {
			continue;
		}
		if ((args->operand_count == 2) != (subject->operand != NULL)) {
			snprintf(error, sizeof(error), "%s: %s", subject->verb,
				 subject->operand == NULL ? "takes no argument"
							  : "missing argument");
			return usage(error);
		}
		s->name = args->operand_count == 2 ? args->operands[1] : NULL;
		return subject->run(s);
	}
	snprintf(error, sizeof(error), "%.100s: unknown command", args->operands[0]);
	return usage(error);
}

static void help(const struct args *args)
{
	puts("usage: ecdaq security [OPTION...] "
	     "init|add-appliance|add-subscriber|add-commander|check "
	     "[NAME|DIR]\n"
	     "\n"
	     "The keys of DDS Security (app/doc/reference/dds.md).\n"
	     "\n"
	     "ecdaq security init creates a store with the appliance's keys, add-subscriber NAME "
	     "and\n"
	     "add-commander NAME those of a participant; check DIR verifies one participant's "
	     "folder.\n"
	     "add-appliance renews the appliance's keys, once its folder has been removed from the "
	     "store.\n");
	args_help(stdout, args->options, args->option_count);
	args_help_common(stdout);
	putchar('\n');
	exit_code_help(stdout, EXIT_CODE_COMMON | EXIT_CODE_BIT(PERMISSION));
}

int main(int argc, char **argv)
{
	struct security s = { .dir = "security", .days = DAYS };
	const char *unused; /* global options of ecdaq: accepted */
	const struct args_option options[] = {
		{ "dir", 0, args_text, &s.dir, "DIR", "the store (security)" },
		{ "days", 0, args_count, &s.days, "N",
		  "how long a participant's key is valid (3650)" },
		{ "run-dir", 0, args_text, &unused, "DIR", NULL },
		{ "config", 0, args_text, &unused, "FILE", NULL },
	};
	struct args args = {
		.options = options,
		.option_count = sizeof(options) / sizeof(options[0]),
		.operands_min = 1,
		.operands_max = 2,
		.operands_usage = "command: init, add-appliance, add-subscriber, add-commander or "
				  "check"
	};
	char error[ARGS_ERROR_BYTES];
	enum exit_code code;

	switch (args_parse(&args, argc - 1, argv + 1, error)) {
	case ARGS_OK:
		break;
	case ARGS_HELP:
		help(&args);
		return EXIT_CODE_OK;
	case ARGS_VERSION:
		puts("ecdaq-security " ECDAQ_VERSION);
		return EXIT_CODE_OK;
	case ARGS_ERROR:
		return (int)usage(error);
	}
	if (s.days > DAYS_MAX) {
		error_print(program, "--days: at most %d", DAYS_MAX);
		return EXIT_CODE_USAGE;
	}
	code = run(&s, &args);
	if (fflush(stdout) != 0 && code == EXIT_CODE_OK) {
		error_print(program, "standard output: %s", strerror(errno));
		code = EXIT_CODE_FAILED;
	}
	return (int)code;
}
