/* SPDX-License-Identifier: MIT */
/* ecdaq security: the keys of DDS Security, made and looked at. */
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "cli/cli.h"
#include "keystore/keystore.h"
#include "program/args.h"

enum { DAYS = 3650, DAYS_MAX = 36500 };

struct security {
	struct cli *cli;
	const char *dir;
	uint64_t days;
	const char *name; /* of a participant, or a folder; NULL: none given */
};

static enum exit_code exit_of(const struct security *s, int r, const char *error)
{
	enum exit_code code = r == -EACCES || r == -EPERM ? EXIT_CODE_PERMISSION
			      : r == -EINVAL              ? EXIT_CODE_USAGE
							  : EXIT_CODE_FAILED;

	return r < 0 ? cli_fail(s->cli, code, "%s", error) : EXIT_CODE_OK;
}

static void tell_appliance(const struct security *s)
{
	printf("%s/appliance: for the appliance, where only ecdaq-dds may read it: dds.security\n",
	       s->dir);
}

static enum exit_code init(const struct security *s)
{
	char error[KEYSTORE_ERROR_BYTES];
	enum exit_code result = exit_of(s, keystore_init(s->dir, (unsigned)s->days, error), error);

	if (result == EXIT_CODE_OK) {
		tell_appliance(s);
		printf("%s/ca: whoever has it lets people in: keep it away from both\n", s->dir);
	}
	return result;
}

/* To renew its keys or what they allow: with those of everybody else left as they are. */
static enum exit_code add_appliance(const struct security *s)
{
	char error[KEYSTORE_ERROR_BYTES];
	enum exit_code result = exit_of(
		s, keystore_add(s->dir, "appliance", KEYSTORE_APPLIANCE, (unsigned)s->days, error),
		error);

	if (result == EXIT_CODE_OK) {
		tell_appliance(s);
	}
	return result;
}

static enum exit_code add(const struct security *s, enum keystore_role role)
{
	char error[KEYSTORE_ERROR_BYTES];
	enum exit_code result =
		exit_of(s, keystore_add(s->dir, s->name, role, (unsigned)s->days, error), error);

	if (result == EXIT_CODE_OK) {
		printf("%s/%s: for this %s, and for nobody else\n", s->dir, s->name,
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
		exit_of(s, keystore_check(s->name, (int64_t)time(NULL), &identity, error), error);

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

static enum exit_code run(struct security *s, const struct args *args)
{
	for (size_t i = 0; i < sizeof(subjects) / sizeof(subjects[0]); i++) {
		const struct subject *subject = &subjects[i];

		if (strcmp(subject->verb, args->operands[0]) != 0) {
			continue;
		}
		if ((args->operand_count == 2) != (subject->operand != NULL)) {
			return cli_fail(s->cli, EXIT_CODE_USAGE, "%s: wants %s", subject->verb,
					subject->operand != NULL ? subject->operand : "no word");
		}
		s->name = args->operand_count == 2 ? args->operands[1] : NULL;
		return subject->run(s);
	}
	return cli_fail(s->cli, EXIT_CODE_USAGE,
			"%s: wants init, add-appliance, add-subscriber, "
			"add-commander or check",
			args->operands[0]);
}

enum exit_code verb_security(struct cli *cli, int argc, char **argv)
{
	struct security security = { .cli = cli, .dir = "security", .days = DAYS };
	const struct args_option options[] = {
		{ "dir", 0, args_text, &security.dir, "DIR", "the store (security)" },
		{ "days", 0, args_count, &security.days, "N",
		  "how long a participant's key holds (3650)" },
	};
	struct args args = {
		.options = options, .option_count = 2, .operands_min = 1, .operands_max = 2
	};
	enum exit_code result;

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	if (security.days > DAYS_MAX) {
		return cli_fail(cli, EXIT_CODE_USAGE, "--days: at most %d", DAYS_MAX);
	}
	return run(&security, &args);
}
