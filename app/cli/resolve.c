/* SPDX-License-Identifier: MIT */
#include "cli/resolve.h"

#include <ctype.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Files in which the appliance's boot leaves the options of ecdaqd. */
#define APPLIANCE_CONFIG "/run/ecdaq-boot/ecdaq.yaml"
#define APPLIANCE_ENVIRONMENT "/run/ecdaq-boot/environment"
#define APPLIANCE_OPTIONS "ECDAQ_OPTIONS="

#define DAEMON "ecdaqd"

enum { ERROR_BYTES = 512 };

/* The value of --@name, behind "=" or in the word after; NULL if @word is another option. */
static const char *value_of(const char *word, const char *next, const char *name)
{
	size_t len = strlen(name);

	if (strncmp(word, "--", 2) != 0 || strncmp(word + 2, name, len) != 0) {
		return NULL;
	}
	if (word[2 + len] == '=') {
		return word + 3 + len;
	}
	return word[2 + len] == '\0' ? next : NULL;
}

static void take(const char *word, const char *next, struct resolve_words *words)
{
	const char *value = value_of(word, next, "config");

	if (value != NULL) {
		words->config = value;
	}
	value = value_of(word, next, "interface");
	if (value != NULL) {
		words->interface = value;
	}
	value = value_of(word, next, "set");
	if (value != NULL && words->set_count < RESOLVE_SETS) {
		words->set[words->set_count++] = value;
	}
}

void resolve_parse(char *text, size_t text_len, char separator, struct resolve_words *ret)
{
	struct resolve_words words = { .config = NULL };
	const char *last = NULL;
	char *end = text + text_len;

	*end = '\0';
	for (char *word = text; word < end;) {
		char *behind = memchr(word, separator, (size_t)(end - word));

		if (behind == NULL) {
			behind = end;
		}
		*behind = '\0';
		if (last != NULL) {
			take(last, word, &words);
		}
		last = word;
		word = behind + 1;
	}
	if (last != NULL) {
		take(last, NULL, &words);
	}
	*ret = words;
}

struct search {
	const struct probe *probe;
	int64_t pid;
};

static void match_process(void *ctx, const char *name)
{
	struct search *search = ctx;
	char comm[PROBE_TEXT_BYTES];

	if (isdigit((unsigned char)name[0]) &&
	    probe_text(search->probe, comm, "/proc/%s/comm", name) >= 0 &&
	    strcmp(comm, DAEMON) == 0) {
		search->pid = strtoll(name, NULL, 10);
	}
}

int64_t resolve_find_daemon(const struct probe *p)
{
	struct search search = { .probe = p };

	probe_each(p, "/proc", match_process, &search);
	return search.pid;
}

static size_t read_all(FILE *file, char text[RESOLVE_TEXT_BYTES])
{
	size_t len;

	if (file == NULL) {
		return 0;
	}
	len = fread(text, 1, RESOLVE_TEXT_BYTES - 1, file);
	fclose(file);
	return len;
}

int resolve_words(const struct probe *p, int64_t pid, char *text, struct resolve_words *ret)
{
	size_t len = pid == 0 ? 0 : read_all(probe_open(p, "/proc/%" PRId64 "/cmdline", pid), text);
	char *options;

	if (len > 0) {
		resolve_parse(text, len, '\0', ret);
		return 1;
	}
	if (!probe_exists(p, APPLIANCE_CONFIG)) {
		return 0;
	}
	len = read_all(probe_open(p, APPLIANCE_ENVIRONMENT), text);
	text[len] = '\0';
	options = strstr(text, APPLIANCE_OPTIONS);
	options = options == NULL ? text + len : options + strlen(APPLIANCE_OPTIONS);
	resolve_parse(options, strcspn(options, "\n"), ' ', ret);
	ret->config = APPLIANCE_CONFIG;
	return 1;
}

int resolve_config_path(const struct probe *p, int64_t pid, const char *config,
			char ret_path[PROBE_PATH_BYTES])
{
	return config[0] == '/' ? probe_path(p, ret_path, "%s", config)
				: probe_path(p, ret_path, "/proc/%" PRId64 "/cwd/%s", pid, config);
}

void resolve_load(const struct probe *p, int64_t pid, struct config *ret_cfg,
		  char ret_name[PROBE_PATH_BYTES])
{
	struct resolve_words words = { .config = NULL };
	char text[RESOLVE_TEXT_BYTES];
	char path[PROBE_PATH_BYTES] = "";
	char error[ERROR_BYTES];
	const char *from = NULL;

	config_defaults(ret_cfg);
	if (!resolve_words(p, pid, text, &words)) {
		snprintf(ret_name, PROBE_PATH_BYTES, "defaults");
		return;
	}
	if (words.config != NULL && resolve_config_path(p, pid, words.config, path) == 0) {
		from = path;
	}
	snprintf(ret_name, PROBE_PATH_BYTES, "%.200s%s", from == NULL ? "defaults" : words.config,
		 words.set_count > 0 ? " and its command line" : "");
	if (config_assemble(from, words.set, words.set_count, ret_cfg, error, sizeof(error)) < 0) {
		snprintf(ret_name, PROBE_PATH_BYTES, "defaults, with overrides: %.300s", error);
		config_assemble(NULL, words.set, words.set_count, ret_cfg, error, sizeof(error));
	}
	if (words.interface != NULL) {
		snprintf(ret_cfg->interface, sizeof(ret_cfg->interface), "%.31s", words.interface);
	}
}
