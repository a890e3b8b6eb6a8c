/* SPDX-License-Identifier: MIT */
#include "config/walk.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "config/startup.h"

/* Place of a mapping in the file's structure. */
struct scope {
	const char *pattern; /* "", "cycle.", "slaves[]." */
	const char *shown;   /* "", "cycle.", "slaves[1]." */
	void *base;          /* what its options fill */
	unsigned slave;      /* in slaves[].: which */
};

/* @walk->error has a problem. */
static int report(struct walk *walk)
{
	walk->problems++;
	if (walk->watch->problem != NULL) {
		walk->watch->problem(walk->watch->ctx, walk->error);
	}
	return -EINVAL;
}

int walk_fail(struct walk *walk, int line, const char *key, const char *reason)
{
	char text[OPTION_KEY_BYTES + OPTION_WHY_BYTES + 8];

	snprintf(text, sizeof(text), "%s%s%s", key, key[0] == '\0' ? "" : ": ", reason);
	option_make_plain(text);
	snprintf(walk->error, walk->error_bytes, "%s:%d: %s", walk->name, line, text);
	return report(walk);
}

/* Every problem is reported, or only the first one? */
static int goes_on(const struct walk *walk)
{
	return walk->watch->problem != NULL;
}

static void note(const struct walk *walk, const char *option, const char *text, int line)
{
	if (walk->watch->seen != NULL) {
		walk->watch->seen(walk->watch->ctx, option, text, line);
	}
}

static int line_of(const yaml_node_t *node)
{
	return (int)node->start_mark.line + 1;
}

static const char *text_of(const yaml_node_t *node)
{
	return (const char *)node->data.scalar.value;
}

/* A plain scalar that YAML reads as null. */
static int is_null(const yaml_node_t *node)
{
	const char *text;

	if (node->type != YAML_SCALAR_NODE || node->data.scalar.style != YAML_PLAIN_SCALAR_STYLE) {
		return 0;
	}
	text = text_of(node);
	return text[0] == '\0' || strcmp(text, "~") == 0 || strcasecmp(text, "null") == 0;
}

static int read_scalar(struct walk *walk, const struct scope *scope, const struct option *option,
		       const char *shown, const yaml_node_t *node)
{
	char reason[OPTION_WHY_BYTES] = "";
	int *line = &walk->lines.line[option_place(option)];

	if (scope->base == walk->cfg && *line != 0) {
		snprintf(reason, sizeof(reason), "is already set in line %d", *line);
		return walk_fail(walk, line_of(node), shown, reason);
	}
	if (node->type != YAML_SCALAR_NODE) {
		return walk_fail(walk, line_of(node), shown,
				 node->type == YAML_SEQUENCE_NODE
					 ? "expected one value, not a list"
					 : "expected a value, not a section");
	}
	if (is_null(node)) {
		return walk_fail(walk, line_of(node), shown, "has no value");
	}
	if (strlen(text_of(node)) != node->data.scalar.length) {
		return walk_fail(walk, line_of(node), shown, "contains a control character");
	}
	if (option_parse(option, text_of(node), scope->base, reason) < 0) {
		return walk_fail(walk, line_of(node), shown, reason);
	}
	*line = line_of(node);
	note(walk, shown, text_of(node), *line);
	return 0;
}

static int read_mapping(struct walk *walk, const struct scope *scope, const yaml_node_t *node);

/* Every option of the item that has no default must be in the mapping @node. */
static int check_required(struct walk *walk, const struct scope *scope, const yaml_node_t *node)
{
	size_t len = strlen(scope->pattern);
	char key[OPTION_KEY_BYTES];
	int r = 0;

	for (size_t i = 0; i < option_count() && (r == 0 || goes_on(walk)); i++) {
		const char *rest = option_at(i)->name + len;
		int is_there = 0;

		if (strncmp(option_at(i)->name, scope->pattern, len) != 0 ||
		    strchr(rest, '.') != NULL || option_at(i)->default_value != NULL) {
			continue;
		}
		for (yaml_node_pair_t *p = node->data.mapping.pairs.start;
		     p < node->data.mapping.pairs.top && !is_there; p++) {
			is_there = strcmp(text_of(yaml_document_get_node(walk->doc, p->key)),
					  rest) == 0;
		}
		if (!is_there) {
			snprintf(key, sizeof(key), "%s%s", scope->shown, rest);
			r = walk_fail(walk, line_of(node), key, "is missing");
		}
	}
	return r;
}

static int read_item(struct walk *walk, const struct scope *scope, const yaml_node_t *node)
{
	int is_whole;
	int r;

	if (node->type != YAML_MAPPING_NODE) {
		char key[OPTION_KEY_BYTES];

		snprintf(key, sizeof(key), "%.*s", (int)strlen(scope->shown) - 1, scope->shown);
		return walk_fail(walk, line_of(node), key, "expected key: value pairs");
	}
	option_fill_defaults(scope->pattern, scope->base);
	r = read_mapping(walk, scope, node);
	if (r < 0 && !goes_on(walk)) {
		return r;
	}
	is_whole = check_required(walk, scope, node) == 0;
	return r < 0 || !is_whole ? -EINVAL : 0;
}

static int read_slave(struct walk *walk, const yaml_node_t *node, unsigned index)
{
	struct config_slave *slave = &walk->cfg->slave[index];
	char shown[32];
	struct scope scope = {
		.pattern = "slaves[].", .shown = shown, .base = slave, .slave = index
	};

	snprintf(shown, sizeof(shown), "slaves[%u].", index);
	memset(slave, 0, sizeof(*slave));
	slave->line = line_of(node);
	walk->cfg->slave_count = index + 1;
	return read_item(walk, &scope, node);
}

/* The short form: its parts are options, as if each had a line of its own. */
static int read_sdo_line(struct walk *walk, const struct scope *scope, const yaml_node_t *node)
{
	struct startup_line line;
	char reason[OPTION_WHY_BYTES] = "";
	char key[OPTION_KEY_BYTES];

	snprintf(key, sizeof(key), "%.*s", (int)strlen(scope->shown) - 1, scope->shown);
	if (strlen(text_of(node)) != node->data.scalar.length) {
		return walk_fail(walk, line_of(node), key, "contains a control character");
	}
	if (startup_line_cut(text_of(node), &line, reason) < 0) {
		return walk_fail(walk, line_of(node), key, reason);
	}
	option_fill_defaults(scope->pattern, scope->base);
	for (unsigned i = 0; i < line.count; i++) {
		const struct startup_field *field = &line.field[i];
		const struct option *option;

		snprintf(key, sizeof(key), "%s%s", scope->pattern, field->name);
		option = option_find(key);
		snprintf(key, sizeof(key), "%s%s", scope->shown, field->name);
		if (option_parse(option, field->text, scope->base, reason) < 0) {
			return walk_fail(walk, line_of(node), key, reason);
		}
		walk->lines.line[option_place(option)] = line_of(node);
		note(walk, key, field->text, line_of(node));
	}
	return 0;
}

static int read_sdo(struct walk *walk, const yaml_node_t *node, unsigned slave, unsigned index)
{
	struct option_sdo item = { .value_line = 0 };
	struct config_sdo *sdo = &walk->cfg->sdo[walk->cfg->sdo_count];
	char reason[OPTION_WHY_BYTES] = "";
	char shown[48];
	struct scope scope = { .pattern = "slaves[].sdo[].", .shown = shown, .base = &item };
	const char *fault;
	int r;

	snprintf(shown, sizeof(shown), "slaves[%u].sdo[%u].", slave, index);
	r = node->type == YAML_SCALAR_NODE && !is_null(node) ? read_sdo_line(walk, &scope, node)
							     : read_item(walk, &scope, node);
	if (r < 0) {
		return r;
	}
	memset(sdo, 0, sizeof(*sdo));
	sdo->slave_pos = (uint16_t)slave;
	sdo->line = line_of(node);
	if (option_sdo_finish(&item, walk->cfg, sdo, &fault, reason) < 0) {
		char key[64];
		int line;

		snprintf(key, sizeof(key), "slaves[].sdo[].%s", fault);
		line = walk->lines.line[option_place(option_find(key))];
		snprintf(key, sizeof(key), "%s%s", shown, fault);
		return walk_fail(walk, line, key, reason);
	}
	walk->cfg->sdo_count++;
	return 0;
}

/* An item that is nothing but the PDO. */
static int read_pdo_line(struct walk *walk, const struct scope *scope, const yaml_node_t *node)
{
	const struct option *option = option_find("slaves[].pdos[].pdo");
	char key[OPTION_KEY_BYTES];

	option_fill_defaults(scope->pattern, scope->base);
	snprintf(key, sizeof(key), "%spdo", scope->shown);
	return read_scalar(walk, scope, option, key, node);
}

static int read_pdo(struct walk *walk, const yaml_node_t *node, unsigned slave, unsigned index)
{
	struct option_pdo item;
	struct config_pdo *pdo = &walk->cfg->pdo[walk->cfg->pdo_count];
	char reason[OPTION_WHY_BYTES] = "";
	char shown[48];
	struct scope scope = { .pattern = "slaves[].pdos[].", .shown = shown, .base = &item };
	const char *fault;
	int r;

	snprintf(shown, sizeof(shown), "slaves[%u].pdos[%u].", slave, index);
	r = node->type == YAML_SCALAR_NODE && !is_null(node) ? read_pdo_line(walk, &scope, node)
							     : read_item(walk, &scope, node);
	if (r < 0) {
		return r;
	}
	memset(pdo, 0, sizeof(*pdo));
	pdo->slave_pos = (uint16_t)slave;
	pdo->line = line_of(node);
	if (option_pdo_finish(&item, walk->cfg, pdo, &fault, reason) < 0) {
		char key[64];

		snprintf(key, sizeof(key), "%s%s", shown, fault);
		return walk_fail(walk, pdo->line, key, reason);
	}
	walk->cfg->pdo_count++;
	return 0;
}

static int read_channel(struct walk *walk, const yaml_node_t *node, unsigned slave, unsigned index)
{
	struct config_channel *channel = &walk->cfg->channel[walk->cfg->channel_count];
	char shown[48];
	struct scope scope = { .pattern = "slaves[].channels[].", .shown = shown, .base = channel };
	int r;

	snprintf(shown, sizeof(shown), "slaves[%u].channels[%u].", slave, index);
	memset(channel, 0, sizeof(*channel));
	channel->slave_pos = (uint16_t)slave;
	channel->line = line_of(node);
	r = read_item(walk, &scope, node);
	if (r < 0) {
		memset(channel, 0, sizeof(*channel));
		return r;
	}
	walk->cfg->channel_count++;
	return 0;
}

/* Of outputs[], or of slaves[].outputs[]: the same options. */
static int read_output(struct walk *walk, const struct scope *list, const yaml_node_t *node,
		       unsigned index)
{
	struct config_output *output = &walk->cfg->output[walk->cfg->output_count++];
	char shown[64];
	struct scope scope = { .pattern = "outputs[].", .shown = shown, .base = output };

	snprintf(shown, sizeof(shown), "%soutputs[%u].", list->shown, index);
	memset(output, 0, sizeof(*output));
	output->slave_pos = list->base == walk->cfg ? CONFIG_NO_SLAVE : (uint16_t)list->slave;
	output->item = (uint16_t)index;
	output->line = line_of(node);
	return read_item(walk, &scope, node);
}

/* Items of list @id so far: those inside slaves[] share one bound, and with outputs[], too. */
static size_t used_of(const struct config *cfg, enum option_list_id id, size_t index)
{
	return id == OPTION_LIST_SDOS       ? cfg->sdo_count
	       : id == OPTION_LIST_PDOS     ? cfg->pdo_count
	       : id == OPTION_LIST_CHANNELS ? cfg->channel_count
	       : id == OPTION_LIST_SLAVES   ? index
					    : cfg->output_count;
}

static int read_list(struct walk *walk, const struct scope *scope, enum option_list_id id,
		     const char *shown, const yaml_node_t *node)
{
	const struct option_list *list = &option_lists[id];
	char reason[OPTION_WHY_BYTES];
	unsigned index = 0;
	int first = 0;
	int r = 0;

	if (is_null(node)) {
		return 0;
	}
	if (node->type != YAML_SEQUENCE_NODE) {
		return walk_fail(walk, line_of(node), shown,
				 "expected a list: lines that start with \"- \"");
	}
	for (yaml_node_item_t *i = node->data.sequence.items.start;
	     (first == 0 || goes_on(walk)) && i < node->data.sequence.items.top; i++, index++) {
		const yaml_node_t *item = yaml_document_get_node(walk->doc, *i);
		size_t used = used_of(walk->cfg, id, index);

		if (used >= list->limit) {
			snprintf(reason, sizeof(reason), "more than %s = %zu items",
				 list->limit_name, list->limit);
			return walk_fail(walk, line_of(item), shown, reason);
		}
		switch (id) {
		case OPTION_LIST_SLAVES:
			r = read_slave(walk, item, index);
			break;
		case OPTION_LIST_PDOS:
			r = read_pdo(walk, item, scope->slave, index);
			break;
		case OPTION_LIST_SDOS:
			r = read_sdo(walk, item, scope->slave, index);
			break;
		case OPTION_LIST_CHANNELS:
			r = read_channel(walk, item, scope->slave, index);
			break;
		case OPTION_LIST_SLAVE_OUTPUTS:
		case OPTION_LIST_OUTPUTS:
			r = read_output(walk, scope, item, index);
			break;
		case OPTION_LISTS:
			break;
		}
		first = first == 0 ? r : first;
	}
	return first;
}

static int read_section(struct walk *walk, const char *name, const yaml_node_t *node)
{
	char prefix[OPTION_KEY_BYTES + 2];
	struct scope scope = { .pattern = prefix, .shown = prefix, .base = walk->cfg };

	if (is_null(node)) {
		return 0; /* a section whose options are all commented out */
	}
	if (node->type != YAML_MAPPING_NODE) {
		return walk_fail(walk, line_of(node), name,
				 "is a section: expected key: value pairs");
	}
	snprintf(prefix, sizeof(prefix), "%s.", name);
	return read_mapping(walk, &scope, node);
}

static int fail_unknown(struct walk *walk, int line, const char *pattern, const char *shown)
{
	const char *guess = option_suggest(pattern);
	char reason[OPTION_WHY_BYTES];

	if (guess == NULL) {
		return walk_fail(walk, line, shown, "unknown option");
	}
	snprintf(reason, sizeof(reason), "unknown option; did you mean %s?", guess);
	return walk_fail(walk, line, shown, reason);
}

static int check_key(struct walk *walk, const struct scope *scope, const yaml_node_t *map,
		     const yaml_node_pair_t *pair)
{
	const yaml_node_t *key = yaml_document_get_node(walk->doc, pair->key);
	const yaml_node_t *other;
	char shown[OPTION_KEY_BYTES];
	char reason[OPTION_WHY_BYTES];

	if (key->type != YAML_SCALAR_NODE) {
		return walk_fail(walk, line_of(key), scope->shown, "a key must be a word");
	}
	for (const yaml_node_pair_t *p = map->data.mapping.pairs.start; p < pair; p++) {
		other = yaml_document_get_node(walk->doc, p->key);
		if (strcmp(text_of(other), text_of(key)) == 0) {
			snprintf(shown, sizeof(shown), "%s%.40s", scope->shown, text_of(key));
			snprintf(reason, sizeof(reason), "is already set in line %d",
				 line_of(other));
			return walk_fail(walk, line_of(key), shown, reason);
		}
	}
	return 0;
}

static int read_pair(struct walk *walk, const struct scope *scope, const char *key, int line,
		     const yaml_node_t *value)
{
	char pattern[OPTION_KEY_BYTES];
	char shown[OPTION_KEY_BYTES];
	const struct option *option;
	int list;

	snprintf(pattern, sizeof(pattern), "%s%.60s", scope->pattern, key);
	snprintf(shown, sizeof(shown), "%s%.60s", scope->shown, key);
	if (key[0] == '\0') {
		return walk_fail(walk, line, shown, "an empty key");
	}
	if (strchr(key, '[') != NULL || strlen(key) > 60) {
		return fail_unknown(walk, line, pattern, shown);
	}
	option = option_find(pattern);
	if (option != NULL) {
		return read_scalar(walk, scope, option, shown, value);
	}
	list = option_list_find(pattern);
	if (list >= 0) {
		return read_list(walk, scope, (enum option_list_id)list, shown, value);
	}
	if (scope->pattern[0] == '\0' && option_is_section(pattern)) {
		return read_section(walk, key, value);
	}
	return fail_unknown(walk, line, pattern, shown);
}

static int read_mapping(struct walk *walk, const struct scope *scope, const yaml_node_t *node)
{
	int first = 0;

	for (const yaml_node_pair_t *p = node->data.mapping.pairs.start;
	     p < node->data.mapping.pairs.top && (first == 0 || goes_on(walk)); p++) {
		const yaml_node_t *key = yaml_document_get_node(walk->doc, p->key);
		int r = check_key(walk, scope, node, p);

		if (r == 0) {
			r = read_pair(walk, scope, text_of(key), line_of(key),
				      yaml_document_get_node(walk->doc, p->value));
		}
		first = first == 0 ? r : first;
	}
	return first;
}

/* The line of what @assignment sets is no longer the one to blame. */
static void forget_line(struct walk *walk, const char *assignment)
{
	for (size_t i = 0; i < option_count(); i++) {
		size_t len = strlen(option_at(i)->name);

		if (strncmp(option_at(i)->name, assignment, len) == 0 && assignment[len] == '=') {
			walk->lines.line[i] = 0;
		}
	}
}

static int read_root(struct walk *walk)
{
	const yaml_node_t *root = yaml_document_get_root_node(walk->doc);
	struct scope scope = { .pattern = "", .shown = "", .base = walk->cfg };

	if (root == NULL || is_null(root)) {
		return 0; /* nothing but comments */
	}
	if (root->type != YAML_MAPPING_NODE) {
		return walk_fail(walk, line_of(root), "",
				 "expected sections: lines such as \"cycle:\"");
	}
	return read_mapping(walk, &scope, root);
}

/* Only a name that config_set() has taken comes here. */
static void note_set(const struct walk *walk, const char *assignment)
{
	const char *equals = strchr(assignment, '=');
	char name[OPTION_KEY_BYTES];

	snprintf(name, sizeof(name), "%.*s", (int)(equals - assignment), assignment);
	note(walk, name, equals + 1, 0);
}

/* A fault of the whole configuration: with the line of the file, where there is one. */
static int add_fault(void *ctx, const char *key, int line, const char *reason)
{
	struct walk *walk = ctx;

	if (line > 0) {
		walk_fail(walk, line, key, reason);
	} else {
		snprintf(walk->error, walk->error_bytes, "%s: %s", key, reason);
		report(walk);
	}
	return !goes_on(walk);
}

/* Outputs beside their slave get the names of their channels. */
static void name_outputs(struct walk *walk)
{
	static const char key[] = "slaves[].outputs[].channel";
	char reason[OPTION_WHY_BYTES];

	for (size_t i = 0; i < walk->cfg->output_count && (walk->problems == 0 || goes_on(walk));
	     i++) {
		struct config_output *output = &walk->cfg->output[i];
		const char *slave;
		char name[sizeof(walk->cfg->slave[0].name) + LIMIT_NAME_BYTES];

		if (output->slave_pos == CONFIG_NO_SLAVE || output->channel[0] == '\0') {
			continue;
		}
		slave = walk->cfg->slave[output->slave_pos].name;
		snprintf(name, sizeof(name), "%s.%s", slave, output->channel);
		if (slave[0] == '\0') {
			walk_fail(walk, output->line, key, "requires slaves[].name");
		} else if (strlen(name) >= LIMIT_NAME_BYTES) {
			snprintf(reason, sizeof(reason), "%s is longer than %d characters", name,
				 LIMIT_NAME_BYTES - 1);
			walk_fail(walk, output->line, key, reason);
		} else {
			memcpy(output->channel, name, strlen(name) + 1);
		}
	}
}

int walk_finish(struct walk *walk)
{
	for (size_t i = 0; i < walk->set_count && (walk->problems == 0 || goes_on(walk)); i++) {
		if (config_set(walk->cfg, walk->set[i], walk->error, walk->error_bytes) < 0) {
			report(walk);
		} else {
			forget_line(walk, walk->set[i]);
			note_set(walk, walk->set[i]);
		}
	}
	if (walk->problems == 0) {
		name_outputs(walk);
	}
	if (walk->problems == 0) {
		option_cross_check(walk->cfg, &walk->lines,
				   &(struct option_faults){ .add = add_fault, .ctx = walk });
	}
	return walk->problems == 0 ? 0 : -EINVAL;
}

int walk_document(struct walk *walk)
{
	const struct option *presence = option_find("bus.presence");

	read_root(walk);
	if (walk->problems > 0 && !goes_on(walk)) {
		return -EINVAL;
	}
	if (walk->cfg->slave_count > 0 && walk->lines.line[option_place(presence)] == 0) {
		walk->cfg->bus_presence = CONFIG_EXACT_SLAVES;
	}
	return walk_finish(walk);
}
