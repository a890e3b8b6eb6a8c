/* SPDX-License-Identifier: MIT */
#include "config/version.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/grow.h"
#include "config/effective.h"
#include "config/option.h"
#include "config/output.h"

struct text_item {
	const struct option *option;
	size_t order; /* in the file */
	char *key;    /* "slaves[0].name", zero, the value, zero */
	const char *value;
};

/* Sorted by key. */
struct config_texts {
	struct text_item *at;
	size_t count;
	int result; /* 0 or -ENOMEM */
};

static void free_texts(struct config_texts *texts)
{
	if (texts == NULL) {
		return;
	}
	for (size_t i = 0; i < texts->count; i++) {
		free(texts->at[i].key);
	}
	free(texts->at);
	free(texts);
}

void config_version_done(struct config_version *version)
{
	free_texts(version->texts);
	version->texts = NULL;
}

static int add(struct config_texts *texts, const struct option *option, const char *key,
	       const char *value)
{
	size_t key_len = strlen(key) + 1;
	size_t value_len = strlen(value) + 1;
	size_t order = texts->count;
	char *text = malloc(key_len + value_len);
	struct text_item *at =
		text == NULL ? NULL : array_grow(texts->at, &texts->count, sizeof(*at));

	if (at == NULL) {
		free(text);
		texts->result = -ENOMEM;
		return -ENOMEM;
	}
	memcpy(text, key, key_len);
	memcpy(text + key_len, value, value_len);
	texts->at = at;
	at[order] = (struct text_item){
		.option = option, .order = order, .key = text, .value = text + key_len
	};
	return 0;
}

static void take_item(void *ctx, const struct config_item *item)
{
	add(ctx, option_at(item->place), item->option, item->value);
}

static int by_key(const void *a, const void *b)
{
	return strcmp(((const struct text_item *)a)->key, ((const struct text_item *)b)->key);
}

int config_version_read(const struct config_source *source, struct config_version *version,
			char *error, size_t error_bytes)
{
	struct config_texts *texts = calloc(1, sizeof(*texts));
	const struct config_listener listener = { .item = take_item, .ctx = texts };
	int r = texts == NULL ? -ENOMEM : 0;

	if (r == 0) {
		r = config_effective_into(source, version->cfg, &listener, error, error_bytes);
		r = r < 0 ? r : texts->result;
	}
	if (r == -ENOMEM) {
		snprintf(error, error_bytes, "out of memory");
	}
	if (r < 0) {
		free_texts(texts);
		return r;
	}
	qsort(texts->at, texts->count, sizeof(*texts->at), by_key);
	version->texts = texts;
	return 0;
}

/* --- what a difference means --- */

enum { FIELD_BYTES = CONFIG_OPTIONS_BYTES };

/* Two texts may be one value: 1ms and 1000us. */
static int is_same_value(const struct text_item *a, const struct text_item *b)
{
	union {
		uint64_t aligned;
		char field[FIELD_BYTES];
	} values[2] = { { 0 }, { 0 } };
	const char *texts[2] = { a->value, b->value };
	char reason[OPTION_WHY_BYTES];
	struct option option = *a->option;

	if (strcmp(a->value, b->value) == 0) {
		return 1;
	}
	option.offset = 0;
	for (int i = 0; i < 2; i++) {
		if (option.bytes > FIELD_BYTES ||
		    option_parse(&option, texts[i], values[i].field, reason) < 0) {
			return 0;
		}
	}
	return memcmp(values[0].field, values[1].field, option.bytes) == 0;
}

/* Both items mean the same output with the same owner. The control program was told its limits at
 * its start. */
static int keeps_output(const struct config_output *running, const struct config_output *wanted)
{
	return running != NULL && wanted != NULL &&
	       strcmp(running->channel, wanted->channel) == 0 && running->owner == wanted->owner &&
	       wanted->owner != CONFIG_OWNER_PROGRAM;
}

/* The item that @key is of: "outputs[3].max", "slaves[1].outputs[0].max". */
static const struct config_output *output_of(const struct config *cfg, const char *key)
{
	static const char slaves[] = "slaves[";
	static const char outputs[] = "outputs[";
	size_t len = strlen(slaves);
	unsigned long slave_pos =
		strncmp(key, slaves, len) == 0 ? strtoul(key + len, NULL, 10) : CONFIG_NO_SLAVE;
	const char *item = strstr(key, outputs);

	return item == NULL ? NULL
			    : config_output_at(cfg, (unsigned)slave_pos,
					       strtoul(item + strlen(outputs), NULL, 10));
}

static int is_of_output(const struct option *option)
{
	static const char prefix[] = "outputs[].";

	return strncmp(option->name, prefix, strlen(prefix)) == 0;
}

static enum config_effect effect_of(const struct config_version *running,
				    const struct config_version *wanted,
				    const struct text_item *item)
{
	enum config_effect effect = item->option->effect;

	if (effect == CONFIG_EFFECT_NOW && is_of_output(item->option) &&
	    !keeps_output(output_of(running->cfg, item->key), output_of(wanted->cfg, item->key))) {
		return CONFIG_EFFECT_RESCAN;
	}
	return effect;
}

/* --- compare --- */

struct found {
	struct config_change change;
	size_t order;
	size_t second; /* of two at the same place, the one that is in the file now */
};

struct found_list {
	struct found *at;
	size_t count;
};

static void put_value(char buf[CONFIG_CHANGE_VALUE_BYTES], const char *value)
{
	static const char cut[] = "...";

	if (snprintf(buf, CONFIG_CHANGE_VALUE_BYTES, "%s", value) >= CONFIG_CHANGE_VALUE_BYTES) {
		memcpy(buf + CONFIG_CHANGE_VALUE_BYTES - sizeof(cut), cut, sizeof(cut));
	}
}

static struct found *new_found(struct found_list *list)
{
	struct found *at = array_grow(list->at, &list->count, sizeof(*at));

	if (at == NULL) {
		return NULL;
	}
	list->at = at;
	return &at[list->count - 1];
}

/* An item that only one of them has: once, with its first option. */
static int add_item(struct found_list *list, const struct text_item *item, int is_new)
{
	size_t len = (size_t)(strrchr(item->key, '.') - item->key);
	struct found *found;

	for (size_t i = 0; i < list->count; i++) {
		const char *option = list->at[i].change.option;

		/* Of an item that is reported already, or of a list in it. */
		if (option[strlen(option) - 1] == ']' &&
		    strncmp(option, item->key, strlen(option)) == 0) {
			list->at[i].order =
				item->order < list->at[i].order ? item->order : list->at[i].order;
			return 0;
		}
	}
	found = new_found(list);
	if (found == NULL) {
		return -ENOMEM;
	}
	found->order = item->order;
	found->second = (size_t)is_new;
	found->change.effect = CONFIG_EFFECT_RESCAN;
	snprintf(found->change.option, sizeof(found->change.option), "%.*s", (int)len, item->key);
	put_value(found->change.old_value, is_new ? "none" : "an item");
	put_value(found->change.new_value, is_new ? "an item" : "none");
	return 0;
}

static int add_change(struct found_list *list, const struct config_version *running,
		      const struct config_version *wanted, const struct text_item *old,
		      const struct text_item *new)
{
	struct found *found;

	if (is_same_value(old, new)) {
		return 0;
	}
	found = new_found(list);
	if (found == NULL) {
		return -ENOMEM;
	}
	found->order = new->order;
	found->second = 1;
	found->change.effect = (uint32_t)effect_of(running, wanted, new);
	snprintf(found->change.option, sizeof(found->change.option), "%s", new->key);
	put_value(found->change.old_value, old->value);
	put_value(found->change.new_value, new->value);
	return 0;
}

static int collect(struct found_list *list, const struct config_version *running,
		   const struct config_version *wanted)
{
	const struct config_texts *a = running->texts;
	const struct config_texts *b = wanted->texts;
	size_t i = 0;
	size_t j = 0;
	int r = 0;

	while (r == 0 && (i < a->count || j < b->count)) {
		int order = i == a->count   ? 1
			    : j == b->count ? -1
					    : strcmp(a->at[i].key, b->at[j].key);

		if (order == 0) {
			r = add_change(list, running, wanted, &a->at[i], &b->at[j]);
		} else {
			r = add_item(list, order < 0 ? &a->at[i] : &b->at[j], order > 0);
		}
		i += order <= 0;
		j += order >= 0;
	}
	return r;
}

static int by_order(const void *a, const void *b)
{
	const struct found *one = a;
	const struct found *other = b;

	if (one->order != other->order) {
		return one->order < other->order ? -1 : 1;
	}
	return (one->second > other->second) - (one->second < other->second);
}

int config_version_compare(const struct config_version *running,
			   const struct config_version *wanted, struct config_change **ret_change,
			   size_t *ret_count)
{
	struct found_list list = { .at = NULL };
	int r = collect(&list, running, wanted);
	struct config_change *change = calloc(list.count + 1, sizeof(*change));

	if (r < 0 || change == NULL) {
		free(list.at);
		free(change);
		return -ENOMEM;
	}
	if (list.count > 0) {
		qsort(list.at, list.count, sizeof(*list.at), by_order);
	}
	for (size_t i = 0; i < list.count; i++) {
		change[i] = list.at[i].change;
	}
	*ret_count = list.count;
	*ret_change = change;
	free(list.at);
	return 0;
}

/* --- take --- */

static void copy_field(const struct option *option, void *to, const void *from)
{
	memcpy((char *)to + option->offset, (const char *)from + option->offset, option->bytes);
}

/* The options of sections with @effect. */
static void copy_sections(struct config *to, const struct config *from, enum config_effect effect)
{
	for (size_t i = 0; i < option_count(); i++) {
		const struct option *option = option_at(i);

		if (strchr(option->name, '[') == NULL && option->effect == effect) {
			copy_field(option, to, from);
		}
	}
}

static void copy_output(struct config_output *to, const struct config_output *from)
{
	for (size_t i = 0; i < option_count(); i++) {
		const struct option *option = option_at(i);

		if (is_of_output(option) && option->effect == CONFIG_EFFECT_NOW) {
			copy_field(option, to, from);
		}
	}
	to->line = from->line;
}

void config_take_now(struct config *cfg, const struct config *wanted)
{
	copy_sections(cfg, wanted, CONFIG_EFFECT_NOW);
	for (size_t i = 0; i < cfg->output_count; i++) {
		struct config_output *output = &cfg->output[i];
		const struct config_output *from =
			config_output_at(wanted, output->slave_pos, output->item);

		if (keeps_output(output, from)) {
			copy_output(output, from);
		}
	}
}

void config_follow(struct config *bound, const struct config *running)
{
	copy_sections(bound, running, CONFIG_EFFECT_NOW);
	for (size_t i = 0; i < bound->output_count; i++) {
		for (size_t j = 0; j < running->output_count; j++) {
			if (strcmp(bound->output[i].channel, running->output[j].channel) == 0) {
				copy_output(&bound->output[i], &running->output[j]);
			}
		}
	}
}

static const struct text_item *find(const struct config_texts *texts, const struct text_item *key)
{
	return texts->count == 0
		       ? NULL
		       : bsearch(key, texts->at, texts->count, sizeof(*texts->at), by_key);
}

/* The texts of @running after it took from @wanted what it can, now or in a rescan. */
static struct config_texts *merge(const struct config_version *running,
				  const struct config_version *wanted, int is_rescan)
{
	const struct config_texts *frame = is_rescan ? wanted->texts : running->texts;
	const struct config_texts *other = is_rescan ? running->texts : wanted->texts;
	struct config_texts *merged = calloc(1, sizeof(*merged));

	for (size_t i = 0; merged != NULL && i < frame->count; i++) {
		const struct text_item *item = &frame->at[i];
		const struct text_item *same = find(other, item);
		enum config_effect effect = effect_of(running, wanted, item);
		int is_other = is_rescan ? effect == CONFIG_EFFECT_RESTART
					 : effect != CONFIG_EFFECT_RESTART &&
						   effect != CONFIG_EFFECT_RESCAN;

		if (add(merged, item->option, item->key,
			is_other && same != NULL ? same->value : item->value) < 0) {
			free_texts(merged);
			return NULL;
		}
		merged->at[i].order = item->order;
	}
	return merged;
}

int config_version_take_now(struct config_version *running, const struct config_version *wanted)
{
	struct config_texts *texts = merge(running, wanted, 0);

	if (texts == NULL) {
		return -ENOMEM;
	}
	config_take_now(running->cfg, wanted->cfg);
	for (enum config_effect service = CONFIG_EFFECT_RECORD; service < CONFIG_EFFECTS;
	     service++) {
		copy_sections(running->cfg, wanted->cfg, service);
	}
	free_texts(running->texts);
	running->texts = texts;
	return 0;
}

int config_version_take_rescan(struct config_version *running, const struct config_version *wanted)
{
	struct config *kept = malloc(sizeof(*kept));
	struct config_texts *texts = merge(running, wanted, 1);

	if (texts == NULL || kept == NULL) {
		free_texts(texts);
		free(kept);
		return -ENOMEM;
	}
	*kept = *running->cfg;
	*running->cfg = *wanted->cfg;
	copy_sections(running->cfg, kept, CONFIG_EFFECT_RESTART);
	free(kept);
	free_texts(running->texts);
	running->texts = texts;
	return 0;
}
