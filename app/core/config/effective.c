/* SPDX-License-Identifier: MIT */
#include "config/effective.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "config/number.h"
#include "config/option.h"

/* An option that was set. */
struct setting {
	char *text; /* of the option, zero, of the value, zero */
	const char *value;
	int line;
};

struct settings {
	struct setting *at;
	size_t count;
	size_t room;
	int result; /* 0 or -ENOMEM */
};

struct listing {
	const struct config *cfg;
	const struct settings *settings;
	void (*item)(void *ctx, const struct config_item *item);
	void *ctx;
};

static int grow(struct settings *settings)
{
	size_t room = settings->room == 0 ? 64 : 2 * settings->room;
	struct setting *at;

	if (settings->count < settings->room) {
		return 0;
	}
	at = realloc(settings->at, room * sizeof(*at));
	if (at == NULL) {
		return -ENOMEM;
	}
	settings->at = at;
	settings->room = room;
	return 0;
}

static void take(void *ctx, const char *option, const char *value, int line)
{
	struct settings *settings = ctx;
	size_t option_len = strlen(option) + 1;
	size_t value_len = strlen(value) + 1;
	char *text = malloc(option_len + value_len);

	if (text == NULL || grow(settings) < 0) {
		free(text);
		settings->result = -ENOMEM;
		return;
	}
	memcpy(text, option, option_len);
	memcpy(text + option_len, value, value_len);
	settings->at[settings->count++] =
		(struct setting){ .text = text, .value = text + option_len, .line = line };
}

static void release(struct settings *settings)
{
	for (size_t i = 0; i < settings->count; i++) {
		free(settings->at[i].text);
	}
	free(settings->at);
}

/* The newest one counts: --set comes after the file. */
static const struct setting *find(const struct settings *settings, const char *option)
{
	for (size_t i = settings->count; i-- > 0;) {
		if (strcmp(settings->at[i].text, option) == 0) {
			return &settings->at[i];
		}
	}
	return NULL;
}

/* The one default that depends on the file: a list of slaves is exact (walk.c). */
static const char *default_of(const struct config *cfg, const struct option *option)
{
	return strcmp(option->name, "bus.presence") == 0 && cfg->bus_presence == CONFIG_EXACT_SLAVES
		       ? "exact"
		       : option->default_value;
}

/* @option of the item or section @shown, "slaves[0]." */
static void list_one(const struct listing *listing, const struct option *option, const char *shown,
		     const char *name)
{
	char key[OPTION_KEY_BYTES];
	char value[CONFIG_OPTIONS_BYTES + sizeof(option->unit)];
	const struct setting *setting;
	const char *text;
	struct config_item item = { .option = key,
				    .value = value,
				    .unit = option->unit,
				    .default_value = option->default_value };

	snprintf(key, sizeof(key), "%s%s", shown, name);
	setting = find(listing->settings, key);
	text = setting != NULL ? setting->value : default_of(listing->cfg, option);
	if (text == NULL) {
		return; /* required, so set; config_set() knows no items inside slaves[] */
	}
	snprintf(value, sizeof(value), "%s%s", text,
		 number_lacks_unit(option, text) ? option->unit : "");
	if (setting != NULL) {
		item.origin = setting->line > 0 ? CONFIG_ORIGIN_FILE : CONFIG_ORIGIN_SET;
		item.line = setting->line;
	}
	listing->item(listing->ctx, &item);
}

/* All options whose name is @pattern and one word more. */
static void list_options(const struct listing *listing, const char *pattern, const char *shown)
{
	size_t len = strlen(pattern);

	for (size_t i = 0; i < option_count(); i++) {
		const struct option *option = option_at(i);

		if (strncmp(option->name, pattern, len) == 0 &&
		    strchr(option->name + len, '.') == NULL) {
			list_one(listing, option, shown, option->name + len);
		}
	}
}

static void list_slaves(const struct listing *listing)
{
	char shown[48];

	for (size_t i = 0; i < listing->cfg->slave_count; i++) {
		size_t sdos = 0;
		size_t channels = 0;

		snprintf(shown, sizeof(shown), "slaves[%zu].", i);
		list_options(listing, "slaves[].", shown);
		for (size_t j = 0; j < listing->cfg->sdo_count; j++) {
			if (listing->cfg->sdo[j].slave_pos == i) {
				snprintf(shown, sizeof(shown), "slaves[%zu].sdo[%zu].", i, sdos++);
				list_options(listing, "slaves[].sdo[].", shown);
			}
		}
		for (size_t j = 0; j < listing->cfg->channel_count; j++) {
			if (listing->cfg->channel[j].slave_pos == i) {
				snprintf(shown, sizeof(shown), "slaves[%zu].channels[%zu].", i,
					 channels++);
				list_options(listing, "slaves[].channels[].", shown);
			}
		}
	}
}

static void list_all(const struct listing *listing)
{
	char shown[48];

	for (size_t i = 0; i < option_section_count; i++) {
		snprintf(shown, sizeof(shown), "%s.", option_sections[i].name);
		list_options(listing, shown, shown);
	}
	list_slaves(listing);
	for (size_t i = 0; i < listing->cfg->output_count; i++) {
		snprintf(shown, sizeof(shown), "outputs[%zu].", i);
		list_options(listing, "outputs[].", shown);
	}
}

int config_effective(const struct config_source *source,
		     void (*item)(void *ctx, const struct config_item *item), void *ctx,
		     char *error, size_t error_bytes)
{
	struct settings settings = { .at = NULL };
	const struct config_source watched = { .path = source->path,
					       .set = source->set,
					       .set_count = source->set_count,
					       .seen = take,
					       .ctx = &settings };
	struct config *cfg = malloc(sizeof(*cfg));
	struct listing listing = { cfg, &settings, item, ctx };
	int r;

	if (cfg == NULL) {
		snprintf(error, error_bytes, "out of memory");
		return -ENOMEM;
	}
	r = config_assemble_from(&watched, cfg, error, error_bytes);
	if (r == 0 && settings.result < 0) {
		r = settings.result;
		snprintf(error, error_bytes, "out of memory");
	}
	if (r == 0) {
		list_all(&listing);
	}
	release(&settings);
	free(cfg);
	return r;
}

const char *config_origin_to_str(enum config_origin origin)
{
	switch (origin) {
	case CONFIG_ORIGIN_DEFAULT:
		return "default";
	case CONFIG_ORIGIN_FILE:
		return "file";
	case CONFIG_ORIGIN_SET:
		return "command line";
	}
	return "?";
}
