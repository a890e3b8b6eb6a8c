/* SPDX-License-Identifier: MIT */
#include "cli/doctor/target.h"

#include <ctype.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Where the appliance's boot leaves what its ecdaqd is started with. */
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

static void take(const char *word, const char *next, struct target_words *words)
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
	if (value != NULL && words->set_count < TARGET_SETS) {
		words->set[words->set_count++] = value;
	}
}

void target_parse(char *text, size_t text_len, char separator, struct target_words *ret)
{
	struct target_words words = { .config = NULL };
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
	const struct sight *s;
	int64_t pid;
};

static void look_at_process(void *ctx, const char *name)
{
	struct search *search = ctx;
	char comm[SIGHT_TEXT_BYTES];

	if (isdigit((unsigned char)name[0]) &&
	    sight_text(search->s, comm, "/proc/%s/comm", name) >= 0 && strcmp(comm, DAEMON) == 0) {
		search->pid = strtoll(name, NULL, 10);
	}
}

int64_t target_find_daemon(const struct sight *s)
{
	struct search search = { .s = s };

	sight_each(s, "/proc", look_at_process, &search);
	return search.pid;
}

static size_t read_all(FILE *file, char text[TARGET_TEXT_BYTES])
{
	size_t len;

	if (file == NULL) {
		return 0;
	}
	len = fread(text, 1, TARGET_TEXT_BYTES - 1, file);
	fclose(file);
	return len;
}

/* The words that ecdaqd was started with, or would be. 0 if nothing tells. */
static int find_words(const struct sight *s, int64_t pid, char text[TARGET_TEXT_BYTES],
		      struct target_words *words)
{
	size_t len = pid == 0 ? 0 : read_all(sight_open(s, "/proc/%" PRId64 "/cmdline", pid), text);
	char *options;

	if (len > 0) {
		target_parse(text, len, '\0', words);
		return 1;
	}
	if (!sight_exists(s, APPLIANCE_CONFIG)) {
		return 0;
	}
	len = read_all(sight_open(s, APPLIANCE_ENVIRONMENT), text);
	text[len] = '\0';
	options = strstr(text, APPLIANCE_OPTIONS);
	options = options == NULL ? text + len : options + strlen(APPLIANCE_OPTIONS);
	target_parse(options, strcspn(options, "\n"), ' ', words);
	words->config = APPLIANCE_CONFIG;
	return 1;
}

/* Where the file of a command line is, for us. */
static int config_path(const struct sight *s, int64_t pid, const char *config,
		       char path[SIGHT_PATH_BYTES])
{
	return config[0] == '/' ? sight_path(s, path, "%s", config)
				: sight_path(s, path, "/proc/%" PRId64 "/cwd/%s", pid, config);
}

void target_load(const struct sight *s, int64_t pid, struct config *ret_cfg,
		 char ret_name[SIGHT_PATH_BYTES])
{
	struct target_words words = { .config = NULL };
	char text[TARGET_TEXT_BYTES];
	char path[SIGHT_PATH_BYTES] = "";
	char error[ERROR_BYTES];
	const char *from = NULL;

	config_defaults(ret_cfg);
	if (!find_words(s, pid, text, &words)) {
		snprintf(ret_name, SIGHT_PATH_BYTES, "defaults");
		return;
	}
	if (words.config != NULL && config_path(s, pid, words.config, path) == 0) {
		from = path;
	}
	snprintf(ret_name, SIGHT_PATH_BYTES, "%.200s%s", from == NULL ? "defaults" : words.config,
		 words.set_count > 0 ? " and its command line" : "");
	if (config_assemble(from, words.set, words.set_count, ret_cfg, error, sizeof(error)) < 0) {
		snprintf(ret_name, SIGHT_PATH_BYTES, "defaults, as far as set: %.300s", error);
		config_assemble(NULL, words.set, words.set_count, ret_cfg, error, sizeof(error));
	}
	if (words.interface != NULL) {
		snprintf(ret_cfg->interface, sizeof(ret_cfg->interface), "%.31s", words.interface);
	}
}
