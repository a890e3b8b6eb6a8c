/* SPDX-License-Identifier: MIT */
#include "config/effective.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/grow.h"
#include "config/number.h"
#include "config/option.h"

/* An option that was set. */
struct setting {
	char *text; /* of the option, zero, of the value, zero */
	const char *value;
	int line;
	size_t order;
};

struct settings {
	struct setting *at;
	size_t count;
	int result; /* 0 or -ENOMEM */
};

struct listing {
	const struct config *cfg;
	const struct settings *settings;
	void (*item)(void *ctx, const struct config_item *item);
	void *ctx;
};

static void take(void *ctx, const char *option, const char *value, int line)
{
	struct settings *settings = ctx;
	size_t option_len = strlen(option) + 1;
	size_t value_len = strlen(value) + 1;
	size_t order = settings->count;
	char *text = malloc(option_len + value_len);
	struct setting *at =
		text == NULL ? NULL : array_grow(settings->at, &settings->count, sizeof(*at));

	if (at == NULL) {
		free(text);
		settings->result = -ENOMEM;
		return;
	}
	memcpy(text, option, option_len);
	memcpy(text + option_len, value, value_len);
	settings->at = at;
	at[order] = (struct setting){
		.text = text, .value = text + option_len, .line = line, .order = order
	};
}

static int by_text(const void *a, const void *b)
{
	const struct setting *one = a;
	const struct setting *other = b;
	int r = strcmp(one->text, other->text);

	return r != 0 ? r : (one->order > other->order) - (one->order < other->order);
}

static void release(struct settings *settings)
{
	for (size_t i = 0; i < settings->count; i++) {
		free(settings->at[i].text);
	}
	free(settings->at);
}

/* Of sorted settings. The newest one counts: --set comes after the file. */
static const struct setting *find(const struct settings *settings, const char *option)
{
	size_t low = 0; /* the first one behind @option */
	size_t high = settings->count;

	while (low < high) {
		size_t middle = low + (high - low) / 2;

		if (strcmp(settings->at[middle].text, option) <= 0) {
			low = middle + 1;
		} else {
			high = middle;
		}
	}
	return low > 0 && strcmp(settings->at[low - 1].text, option) == 0 ? &settings->at[low - 1]
									  : NULL;
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
				    .default_value = option->default_value,
				    .effect = option->effect,
				    .place = option_place(option) };

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

/* outputs[] with CONFIG_NO_SLAVE, else those beside slave @slave_pos. */
static void list_outputs(const struct listing *listing, unsigned slave_pos)
{
	char list[24] = "";
	char shown[48];

	if (slave_pos != CONFIG_NO_SLAVE) {
		snprintf(list, sizeof(list), "slaves[%u].", slave_pos);
	}
	for (size_t i = 0; i < listing->cfg->output_count; i++) {
		const struct config_output *output = &listing->cfg->output[i];

		if (output->slave_pos == slave_pos) {
			snprintf(shown, sizeof(shown), "%soutputs[%u].", list, output->item);
			list_options(listing, "outputs[].", shown);
		}
	}
}

static void list_slaves(const struct listing *listing)
{
	char shown[48];

	for (size_t i = 0; i < listing->cfg->slave_count; i++) {
		size_t pdos = 0;
		size_t sdos = 0;
		size_t channels = 0;

		snprintf(shown, sizeof(shown), "slaves[%zu].", i);
		list_options(listing, "slaves[].", shown);
		for (size_t j = 0; j < listing->cfg->pdo_count; j++) {
			if (listing->cfg->pdo[j].slave_pos == i) {
				snprintf(shown, sizeof(shown), "slaves[%zu].pdos[%zu].", i, pdos++);
				list_options(listing, "slaves[].pdos[].", shown);
			}
		}
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
		list_outputs(listing, (unsigned)i);
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
	list_outputs(listing, CONFIG_NO_SLAVE);
}

int config_effective_into(const struct config_source *source, struct config *cfg,
			  const struct config_listener *listener, char *error, size_t error_bytes)
{
	struct settings settings = { .at = NULL };
	const struct config_source watched = { .path = source->path,
					       .set = source->set,
					       .set_count = source->set_count,
					       .seen = take,
					       .ctx = &settings };
	struct listing listing = { cfg, &settings, listener->item, listener->ctx };
	int r = config_assemble_from(&watched, cfg, error, error_bytes);

	if (r == 0 && settings.result < 0) {
		r = settings.result;
		snprintf(error, error_bytes, "out of memory");
	}
	if (r == 0) {
		if (settings.count > 0) {
			qsort(settings.at, settings.count, sizeof(*settings.at), by_text);
		}
		list_all(&listing);
	}
	release(&settings);
	return r;
}

int config_effective(const struct config_source *source,
		     void (*item)(void *ctx, const struct config_item *item), void *ctx,
		     char *error, size_t error_bytes)
{
	const struct config_listener listener = { .item = item, .ctx = ctx };
	struct config *cfg = malloc(sizeof(*cfg));
	int r;

	if (cfg == NULL) {
		snprintf(error, error_bytes, "out of memory");
		return -ENOMEM;
	}
	r = config_effective_into(source, cfg, &listener, error, error_bytes);
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
