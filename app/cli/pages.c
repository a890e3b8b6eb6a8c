/* SPDX-License-Identifier: MIT */
/*
 * ecdaq completion, ecdaq manual: words for bash and pages for man, from the table of verbs and the
 * options that each verb gives to cli_parse().
 */
#include <ctype.h>
#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <string.h>

#include "base/args.h"
#include "cli/cli.h"

/* --- of one verb: its options come by the way that --help takes --- */

/* A verb that is a program of its own has its options there. */
static int has_options(const struct verb *verb)
{
	return strcmp(verb->operands, "...") != 0;
}

static void show_verb(const struct cli *cli, const struct verb *verb,
		      void (*show)(const struct verb *verb, const struct args *args))
{
	struct cli one = { .verb = verb, .verbs = cli->verbs, .verb_count = cli->verb_count };
	char word[] = "--help";
	char *words[] = { word, NULL };

	one.show_help = show;
	if (has_options(verb)) {
		(void)verb->run(&one, 1, words);
	} else {
		show(verb, &(struct args){ .options = NULL });
	}
}

static void each_option(const struct verb *verb, const struct args *args,
			void (*put)(const struct args_option *option))
{
	size_t count;
	const struct args_option *selecting = cli_selecting(verb, &count);

	for (size_t i = 0; i < args->option_count; i++) {
		if (args->options[i].help != NULL) {
			put(&args->options[i]);
		}
	}
	for (size_t i = 0; i < count; i++) {
		put(&selecting[i]);
	}
}

/* --- bash --- */

static void put_option_word(const struct args_option *option)
{
	printf(" --%s", option->name);
}

/* "read|write SLAVE": read and write, but no names in capitals. */
static void put_literals(const char *operands)
{
	size_t len = strcspn(operands, " ");
	const char *end = operands + len;

	for (const char *p = operands; p < end; p++) {
		if (isupper((unsigned char)*p)) {
			return;
		}
	}
	for (const char *p = operands; p < end; p++) {
		if (*p == '|') {
			putchar(' ');
		} else if (islower((unsigned char)*p) || *p == '-') {
			putchar(*p);
		}
	}
}

static void complete_verb(const struct verb *verb, const struct args *args)
{
	int is_list;

	printf("\t%s) words='", verb->name);
	put_literals(verb->operands);
	each_option(verb, args, put_option_word);
	printf("%s --help'%s ;;\n", has_options(verb) ? " --run-dir --config" : "",
	       cli_slave_at(verb, &is_list) > 0 ? "; slaves=1" : "");
}

enum exit_code verb_completion(struct cli *cli, int argc, char **argv)
{
	struct args args = { .options = NULL };
	enum exit_code result;

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	puts("# Completion of ecdaq for bash, by: ecdaq completion\n"
	     "_ecdaq()\n{\n"
	     "\tlocal cur=${COMP_WORDS[COMP_CWORD]} verb='' words='' slaves=0 i\n"
	     "\tfor ((i = 1; i < COMP_CWORD; i++)); do\n"
	     "\t\tcase ${COMP_WORDS[i]} in\n"
	     "\t\t--run-dir | --config) i=$((i + 1)) ;;\n"
	     "\t\t-*) ;;\n"
	     "\t\t*) verb=${COMP_WORDS[i]}; break ;;\n"
	     "\t\tesac\n\tdone\n"
	     "\tcase $verb in");
	fputs("\t'') words='--run-dir --config --help --version", stdout);
	for (size_t i = 0; i < cli->verb_count; i++) {
		printf(" %s", cli->verbs[i].name);
	}
	puts("' ;;");
	for (size_t i = 0; i < cli->verb_count; i++) {
		show_verb(cli, &cli->verbs[i], complete_verb);
	}
	puts("\tesac\n"
	     "\tif [ $slaves = 1 ] && [ \"${cur#-}\" = \"$cur\" ]; then\n"
	     /* Only plain names: compgen expands its words as the shell does. */
	     "\t\twords+=\" $(\"${COMP_WORDS[0]}\" slaves --json 2>/dev/null | tr ',' '\\n' |\n"
	     "\t\t\tsed -n 's/^ *\"name\": *\"\\([A-Za-z0-9_.-]*\\)\"$/\\1/p')\"\n"
	     "\tfi\n"
	     "\tmapfile -t COMPREPLY < <(compgen -W \"$words\" -- \"$cur\")\n"
	     "}\n"
	     "complete -o default -F _ecdaq ecdaq");
	return EXIT_CODE_OK;
}

/* --- man --- */

/* As it is: no escapes, no requests, no hyphens in place of dashes. */
static void put_roff(const char *text)
{
	int is_start = 1;

	for (; *text != '\0'; text++) {
		if (is_start && (*text == '.' || *text == '\'')) {
			fputs("\\&", stdout);
		}
		if (*text == '\\') {
			fputs("\\e", stdout);
		} else if (*text == '-') {
			fputs("\\-", stdout);
		} else {
			putchar(*text);
		}
		is_start = *text == '\n';
	}
}

static void put_option_page(const struct args_option *option)
{
	fputs(".TP\n\\fB", stdout);
	if (option->letter != 0) {
		printf("\\-%c\\fR, \\fB", option->letter);
	}
	put_roff("--");
	put_roff(option->name);
	fputs("\\fR", stdout);
	if (option->value != NULL) {
		printf(" \\fI%s\\fR", option->value);
	}
	putchar('\n');
	put_roff(option->help);
	putchar('\n');
}

static void put_head(const char *name, const char *verb, const char *summary)
{
	fputs(".TH \"", stdout);
	put_roff(name);
	fputs("\" 1 \"\" \"ecdaq " ECDAQ_VERSION "\"\n.SH NAME\n", stdout);
	put_roff(name);
	fputs(" \\- ", stdout);
	put_roff(summary);
	printf("\n.SH SYNOPSIS\n\\fBecdaq%s%s\\fR ", verb[0] != '\0' ? " " : "", verb);
}

static void show_page(const struct verb *verb, const struct args *args)
{
	char name[64];

	snprintf(name, sizeof(name), "ecdaq-%s", verb->name);
	put_head(name, verb->name, verb->summary);
	fputs("[OPTION...] ", stdout);
	put_roff(verb->operands);
	puts("\n.SH DESCRIPTION");
	put_roff(verb->summary);
	if (verb->detail != NULL) {
		puts("\n.PP\n.nf");
		put_roff(verb->detail);
		fputs(".fi", stdout);
	}
	puts("\n.SH OPTIONS");
	each_option(verb, args, put_option_page);
	puts(".TP\n\\fB\\-\\-help\\fR\nprint a summary\n.SH SEE ALSO\n\\fBecdaq\\fR(1)");
}

static void show_front(const struct cli *cli)
{
	put_head("ecdaq", "", "the operator's tool of ecdaqd, an EtherCAT master");
	puts("[\\-\\-run\\-dir DIR] [\\-\\-config FILE] VERB [OPTION...] [WORD...]\n"
	     ".SH DESCRIPTION\nShows the state of ecdaqd and its services and sends commands.\n"
	     ".SH VERBS");
	for (size_t i = 0; i < cli->verb_count; i++) {
		printf(".TP\n\\fB%s\\fR ", cli->verbs[i].name);
		put_roff(cli->verbs[i].operands);
		putchar('\n');
		put_roff(cli->verbs[i].summary);
		putchar('\n');
	}
	puts(".SH EXIT STATUS\n.nf");
	exit_code_help(stdout, CLI_EXIT_CODES);
	puts(".fi");
}

static void show_page_of(const struct cli *cli, const struct verb *verb)
{
	if (verb == NULL) {
		show_front(cli);
	} else {
		show_verb(cli, verb, show_page);
	}
}

/* --- pages as files --- */

/* The page of @verb (NULL: of ecdaq) as a file in @dir, in place of standard output. */
static enum exit_code write_page(const struct cli *cli, const char *dir, const struct verb *verb)
{
	char path[PATH_MAX];

	if (snprintf(path, sizeof(path), "%s/ecdaq%s%s.1", dir, verb == NULL ? "" : "-",
		     verb == NULL ? "" : verb->name) >= (int)sizeof(path)) {
		return cli_fail(cli, EXIT_CODE_USAGE, "--write: the path is too long");
	}
	errno = 0;
	if (freopen(path, "we", stdout) != NULL) {
		show_page_of(cli, verb);
		if (fflush(stdout) == 0 && !ferror(stdout)) {
			return EXIT_CODE_OK;
		}
	}
	return cli_fail(cli, errno == EACCES ? EXIT_CODE_PERMISSION : EXIT_CODE_FAILED, "%s: %s",
			path, strerror(errno != 0 ? errno : EIO));
}

/* Programs of their own have pages of their own. */
static enum exit_code write_pages(const struct cli *cli, const char *dir)
{
	enum exit_code result = write_page(cli, dir, NULL);

	for (size_t i = 0; i < cli->verb_count && result == EXIT_CODE_OK; i++) {
		if (has_options(&cli->verbs[i])) {
			result = write_page(cli, dir, &cli->verbs[i]);
		}
	}
	return result;
}

enum exit_code verb_manual(struct cli *cli, int argc, char **argv)
{
	const char *dir = NULL;
	const struct args_option options[] = {
		{ "write", 'w', args_text, &dir, "DIR",
		  "all pages as files in the folder DIR: ecdaq.1, ecdaq-VERB.1" },
	};
	struct args args = { .options = options, .option_count = 1, .operands_max = 1 };
	enum exit_code result;

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	if (dir != NULL) {
		return args.operand_count > 0 ? cli_fail(cli, EXIT_CODE_USAGE,
							 "--write and VERB exclude each other")
					      : write_pages(cli, dir);
	}
	if (args.operand_count == 0) {
		show_page_of(cli, NULL);
		return EXIT_CODE_OK;
	}
	for (size_t i = 0; i < cli->verb_count; i++) {
		if (strcmp(cli->verbs[i].name, args.operands[0]) == 0) {
			show_page_of(cli, &cli->verbs[i]);
			return EXIT_CODE_OK;
		}
	}
	return cli_fail(cli, EXIT_CODE_USAGE, "%s: unknown command (see ecdaq --help)",
			args.operands[0]);
}
