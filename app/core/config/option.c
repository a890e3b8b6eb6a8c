/* SPDX-License-Identifier: MIT */
#include "config/option.h"

#include <assert.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "config/output.h"

const struct option *option_find(const char *name)
{
	for (size_t i = 0; i < option_count(); i++) {
		if (strcmp(option_at(i)->name, name) == 0) {
			return option_at(i);
		}
	}
	return NULL;
}

/* Is @option a field of the item that @prefix ("slaves[].") names, and not of a list inside it? */
static int is_under(const struct option *option, const char *prefix)
{
	size_t len = strlen(prefix);

	return strncmp(option->name, prefix, len) == 0 && strstr(option->name + len, "[]") == NULL;
}

void option_fill_defaults(const char *prefix, void *base)
{
	char reason[OPTION_WHY_BYTES];

	for (size_t i = 0; i < option_count(); i++) {
		const struct option *option = option_at(i);

		if (is_under(option, prefix) && option->default_value != NULL) {
			int r = option_parse(option, option->default_value, base, reason);

			assert(r == 0);
			(void)r;
		}
	}
}

void config_defaults(struct config *cfg)
{
	memset(cfg, 0, sizeof(*cfg));
	option_fill_defaults("", cfg);
}

/* "slaves[2].mode": the pattern "slaves[].mode" and the 2. -EINVAL if the brackets are not right.
 */
static int split_index(const char *name, char *ret_pattern, size_t *ret_index)
{
	const char *open = strchr(name, '[');
	char *end;
	unsigned long index;

	if (strlen(name) >= OPTION_KEY_BYTES || open == NULL || open[1] < '0' || open[1] > '9') {
		return -EINVAL;
	}
	errno = 0;
	index = strtoul(open + 1, &end, 10);
	if (errno != 0 || *end != ']' || strchr(end, '[') != NULL) {
		return -EINVAL;
	}
	snprintf(ret_pattern, OPTION_KEY_BYTES, "%.*s[%s", (int)(open - name), name, end);
	*ret_index = index;
	return 0;
}

/* Item @index of outputs[], or a fresh one behind the last; NULL. */
static struct config_output *output_at(struct config *cfg, size_t index)
{
	const struct config_output *old = config_output_at(cfg, CONFIG_NO_SLAVE, index);
	struct config_output *output = &cfg->output[cfg->output_count];

	if (old != NULL) {
		return &cfg->output[old - cfg->output];
	}
	if (cfg->output_count == CONFIG_LIMIT_OUTPUTS ||
	    (index > 0 && config_output_at(cfg, CONFIG_NO_SLAVE, index - 1) == NULL)) {
		return NULL;
	}
	memset(output, 0, sizeof(*output));
	option_fill_defaults("outputs[].", output);
	output->slave_pos = CONFIG_NO_SLAVE;
	output->item = (uint16_t)index;
	cfg->output_count++;
	return output;
}

/* A place for item @index of the list at @count: an old item, or a fresh one behind the last. */
static void *item_at(struct config *cfg, const char *pattern, size_t index)
{
	if (strncmp(pattern, "slaves[].", 9) == 0) {
		if (index > cfg->slave_count || index >= LIMIT_SLAVES) {
			return NULL;
		}
		if (index == cfg->slave_count) {
			memset(&cfg->slave[index], 0, sizeof(cfg->slave[index]));
			option_fill_defaults("slaves[].", &cfg->slave[index]);
			cfg->slave_count++;
		}
		return &cfg->slave[index];
	}
	return output_at(cfg, index);
}

static int set_value(struct config *cfg, const char *name, const char *value, char *reason)
{
	char pattern[OPTION_KEY_BYTES];
	const struct option *option = option_find(name);
	const char *guess;
	size_t index;
	void *base = cfg;

	if (option == NULL && split_index(name, pattern, &index) == 0) {
		option = option_find(pattern);
		base = option == NULL ? NULL : item_at(cfg, pattern, index);
		if (base == NULL && option != NULL) {
			snprintf(reason, OPTION_WHY_BYTES,
				 "item %zu skips an index or exceeds the limit", index);
			return -EINVAL;
		}
	} else if (option != NULL && strchr(name, '[') != NULL) {
		option = NULL;
	}
	if (option == NULL) {
		guess = option_suggest(name);
		snprintf(reason, OPTION_WHY_BYTES, "unknown option%s%s%s",
			 guess == NULL ? "" : "; did you mean ", guess == NULL ? "" : guess,
			 guess == NULL ? "" : "?");
		return -EINVAL;
	}
	return option_parse(option, value, base, reason);
}

int config_set(struct config *cfg, const char *assignment, char *error, size_t error_bytes)
{
	const char *equals = strchr(assignment, '=');
	char reason[OPTION_WHY_BYTES] = "";
	char name[OPTION_KEY_BYTES];
	struct config work = *cfg;
	int r;

	if (equals == NULL || equals == assignment ||
	    (size_t)(equals - assignment) >= sizeof(name)) {
		snprintf(error, error_bytes, "%.64s: expected OPTION=VALUE", assignment);
		option_make_plain(error);
		return -EINVAL;
	}
	snprintf(name, sizeof(name), "%.*s", (int)(equals - assignment), assignment);
	r = set_value(&work, name, equals + 1, reason);
	if (r < 0) {
		snprintf(error, error_bytes, "%s: %s", name, reason);
		option_make_plain(error);
		return -EINVAL;
	}
	*cfg = work;
	return 0;
}

int config_parse_duration(const char *text, int64_t *ret_ns, char *reason)
{
	static const struct option duration = {
		.name = "",
		.type = OPTION_DURATION,
		.offset = 0,
		.bytes = sizeof(int64_t),
		.min = "-36500d",
		.max = "36500d",
		.unit = "s",
	};

	return option_parse(&duration, text, ret_ns, reason);
}

/* Where the first fault is reported. */
struct report {
	const struct config *cfg;
	char *error;
	size_t error_bytes;
};

static int report_first(void *ctx, const char *key, int line, const char *reason)
{
	struct report *report = ctx;

	if (line > 0 && report->cfg->path[0] != '\0') {
		snprintf(report->error, report->error_bytes, "%s:%d: %s: %s", report->cfg->path,
			 line, key, reason);
	} else {
		snprintf(report->error, report->error_bytes, "%s: %s", key, reason);
	}
	return 1;
}

int config_check(const struct config *cfg, char *error, size_t error_bytes)
{
	struct report report = { .cfg = cfg, .error = error, .error_bytes = error_bytes };

	return option_cross_check(cfg, NULL,
				  &(struct option_faults){ .add = report_first, .ctx = &report });
}
