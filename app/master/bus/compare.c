/* SPDX-License-Identifier: MIT */
#include "bus/compare.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "base/limits.h"

struct text {
	char *buf;
	size_t bytes;
	size_t used;
};

static void append(struct text *text, const char *format, ...)
	__attribute__((format(printf, 2, 3)));

static void append(struct text *text, const char *format, ...)
{
	va_list args;
	int r;

	va_start(args, format);
	r = vsnprintf(text->buf + text->used, text->bytes - text->used, format, args);
	va_end(args);
	if (r > 0) {
		text->used += (size_t)r < text->bytes - text->used ? (size_t)r
								   : text->bytes - text->used - 1;
	}
}

/* "vendor 0x00000002 product 0x04570862 revision any" */
static void append_wanted(struct text *text, const struct config_slave *want)
{
	const struct {
		const char *name;
		uint32_t value;
	} part[] = { { "vendor", want->vendor },
		     { "product", want->product },
		     { "revision", want->revision } };

	for (size_t i = 0; i < sizeof(part) / sizeof(part[0]); i++) {
		if (part[i].value != 0) {
			append(text, "%s%s 0x%08x", i > 0 ? " " : "", part[i].name, part[i].value);
		} else {
			append(text, "%s%s any", i > 0 ? " " : "", part[i].name);
		}
	}
	if (want->revision != 0 && want->revision_policy == CONFIG_REVISION_AT_LEAST) {
		append(text, " or newer");
	}
	if (want->serial != 0) {
		append(text, " serial %u", want->serial);
	}
	if (want->alias != 0) {
		append(text, " alias %u", want->alias);
	}
	if (want->identification != 0) {
		append(text, " identification %u", want->identification);
	}
}

static void append_found(struct text *text, const struct config_slave *want,
			 const struct slave_info *found, unsigned id)
{
	append(text, "vendor 0x%08x product 0x%08x revision 0x%08x", found->vendor, found->product,
	       found->revision);
	if (want->serial != 0) {
		append(text, " serial %u", found->serial);
	}
	if (want->alias != 0) {
		append(text, " alias %u", found->alias);
	}
	if (want->identification != 0) {
		append(text, " identification %u", id);
	}
	if (found->device[0] != '\0') {
		append(text, " (%s)", found->device);
	}
}

int compare_is_revision_wanted(const struct config_slave *want, uint32_t revision)
{
	switch (want->revision_policy) {
	case CONFIG_REVISION_ANY:
		return 1;
	case CONFIG_REVISION_AT_LEAST:
		return revision >= want->revision;
	case CONFIG_REVISION_EXACT:
		break;
	}
	return want->revision == 0 || want->revision == revision;
}

int compare_is_wanted(const struct config_slave *want, const struct slave_info *found, unsigned id)
{
	return (want->vendor == 0 || want->vendor == found->vendor) &&
	       (want->product == 0 || want->product == found->product) &&
	       compare_is_revision_wanted(want, found->revision) &&
	       (want->serial == 0 || want->serial == found->serial) &&
	       (want->alias == 0 || want->alias == found->alias) &&
	       (want->identification == 0 || want->identification == id);
}

int compare_is_specific(const struct config_slave *want)
{
	return want->serial != 0 || want->alias != 0 || want->identification != 0 ||
	       want->product != 0;
}

void compare_wanted_format(const struct config_slave *want, char *buf, size_t bytes)
{
	append_wanted(&(struct text){ .buf = buf, .bytes = bytes }, want);
}

void compare_found_format(const struct config_slave *want, const struct slave_info *found,
			  unsigned id, char *buf, size_t bytes)
{
	append_found(&(struct text){ .buf = buf, .bytes = bytes }, want, found, id);
}

static unsigned id_of(const uint16_t *id, size_t pos)
{
	return id != NULL ? id[pos] : 0;
}

/* --- binding --- */

/* Row i: bit j, if the configured slaves from i on can be bound to the found ones from j on. */
struct bindable {
	uint8_t row[LIMIT_SLAVES + 1][LIMIT_SLAVES / 8 + 1];
};

static int is_bindable(const struct bindable *b, size_t i, size_t j)
{
	return b->row[i][j / 8] >> (j % 8) & 1;
}

static void fill_bindable(const struct config *cfg, const struct slave_info *found,
			  const uint16_t *id, size_t count, struct bindable *b)
{
	memset(b, 0, sizeof(*b));
	for (size_t i = cfg->slave_count + 1; i-- > 0;) {
		for (size_t j = 0; j <= count; j++) {
			int is_possible;

			if (i == cfg->slave_count) {
				is_possible =
					j == count || cfg->bus_presence != CONFIG_EXACT_SLAVES;
			} else {
				const struct config_slave *want = &cfg->slave[i];

				is_possible = (j < count && is_bindable(b, i + 1, j + 1) &&
					       compare_is_wanted(want, &found[j], id_of(id, j))) ||
					      (want->is_optional && is_bindable(b, i + 1, j));
			}
			b->row[i][j / 8] |= (uint8_t)(is_possible << (j % 8));
		}
	}
}

int compare_bind(const struct config *cfg, const struct slave_info *found, const uint16_t *id,
		 size_t found_count, int *ret_config)
{
	struct bindable b;
	size_t j = 0;

	fill_bindable(cfg, found, id, found_count, &b);
	if (!is_bindable(&b, 0, 0)) {
		return -ENXIO;
	}
	for (size_t k = 0; k < found_count; k++) {
		ret_config[k] = -1;
	}
	for (size_t i = 0; i < cfg->slave_count; i++) {
		if (j < found_count && is_bindable(&b, i + 1, j + 1) &&
		    compare_is_wanted(&cfg->slave[i], &found[j], id_of(id, j))) {
			ret_config[j++] = (int)i;
		}
	}
	return 0;
}

static int find_position(const int *config, size_t found_count, int slave)
{
	for (size_t j = 0; j < found_count; j++) {
		if (config[j] == slave) {
			return (int)j;
		}
	}
	return -1;
}

/* "drive.position" of a slave "drive" that is absent. */
static int is_of_absent(const struct config *cfg, const int *config, size_t found_count,
			const char *channel)
{
	for (size_t i = 0; i < cfg->slave_count; i++) {
		const char *name = cfg->slave[i].name;
		size_t len = strlen(name);

		if (len > 0 && strncmp(channel, name, len) == 0 && channel[len] == '.') {
			return find_position(config, found_count, (int)i) < 0;
		}
	}
	return 0;
}

void compare_apply(const struct config *cfg, const int *config, size_t found_count,
		   struct config *bound)
{
	*bound = *cfg;
	bound->slave_count = 0;
	bound->sdo_count = 0;
	bound->pdo_count = 0;
	bound->channel_count = 0;
	bound->output_count = 0;
	for (size_t j = 0; j < found_count && config[j] >= 0; j++) {
		bound->slave[bound->slave_count++] = cfg->slave[config[j]];
	}
	for (size_t i = 0; i < cfg->sdo_count; i++) {
		int pos = find_position(config, found_count, cfg->sdo[i].slave_pos);

		if (pos >= 0) {
			bound->sdo[bound->sdo_count] = cfg->sdo[i];
			bound->sdo[bound->sdo_count++].slave_pos = (uint16_t)pos;
		}
	}
	for (size_t i = 0; i < cfg->pdo_count; i++) {
		int pos = find_position(config, found_count, cfg->pdo[i].slave_pos);

		if (pos >= 0) {
			bound->pdo[bound->pdo_count] = cfg->pdo[i];
			bound->pdo[bound->pdo_count++].slave_pos = (uint16_t)pos;
		}
	}
	for (size_t i = 0; i < cfg->channel_count; i++) {
		int pos = find_position(config, found_count, cfg->channel[i].slave_pos);

		if (pos >= 0) {
			bound->channel[bound->channel_count] = cfg->channel[i];
			bound->channel[bound->channel_count++].slave_pos = (uint16_t)pos;
		}
	}
	for (size_t i = 0; i < cfg->output_count; i++) {
		if (!is_of_absent(cfg, config, found_count, cfg->output[i].channel)) {
			bound->output[bound->output_count++] = cfg->output[i];
		}
	}
}

/* --- why it is not possible --- */

/* The configured slave other than @not_this that the found one is: they were exchanged; or -1. */
static int find_other(const struct config *cfg, size_t not_this, const struct slave_info *found,
		      unsigned id)
{
	for (size_t i = 0; i < cfg->slave_count; i++) {
		const struct config_slave *other = &cfg->slave[i];

		if (i != not_this && compare_is_specific(other) &&
		    compare_is_wanted(other, found, id)) {
			return (int)i;
		}
	}
	return -1;
}

/* Configured slaves and found devices, one each, in any order. */
struct matching {
	const struct config *cfg;
	const struct slave_info *found;
	const uint16_t *id;
	size_t found_count;
	int config[LIMIT_SLAVES];       /* that has this device; -1: none */
	uint8_t is_tried[LIMIT_SLAVES]; /* device, for the slave that is looking for one */
};

/* Slave @i gets a device, if need be of another slave that can have another one. */
static int match_one(struct matching *m, size_t i)
{
	for (size_t j = 0; j < m->found_count; j++) {
		if (m->is_tried[j] ||
		    !compare_is_wanted(&m->cfg->slave[i], &m->found[j], id_of(m->id, j))) {
			continue;
		}
		m->is_tried[j] = 1;
		if (m->config[j] < 0 || match_one(m, (size_t)m->config[j])) {
			m->config[j] = (int)i;
			return 1;
		}
	}
	return 0;
}

static void append_name(struct text *text, const struct config *cfg, size_t i)
{
	append(text, "slave %zu%s%s", i, cfg->slave[i].name[0] != '\0' ? " " : "",
	       cfg->slave[i].name);
}

/* Slaves that are at no other place either: "slave 2 pump is missing; ". */
static void append_missing(struct text *text, struct matching *m)
{
	unsigned missing = 0;

	for (size_t j = 0; j < m->found_count; j++) {
		m->config[j] = -1;
	}
	for (size_t i = 0; i < m->cfg->slave_count; i++) {
		memset(m->is_tried, 0, sizeof(m->is_tried));
		if (m->cfg->slave[i].is_optional || match_one(m, i)) {
			continue;
		}
		if (missing++ == 0) {
			append_name(text, m->cfg, i);
		}
	}
	if (missing > 1) {
		append(text, " and %u more are missing; ", missing - 1);
	} else if (missing > 0) {
		append(text, " is missing; ");
	}
}

/* The device at @position is not the configured slave @i. */
static void append_wrong(struct text *text, struct matching *m, size_t i, size_t position)
{
	const struct config_slave *want = &m->cfg->slave[i];
	const struct slave_info *found = &m->found[position];
	unsigned id = id_of(m->id, position);
	int other = find_other(m->cfg, i, found, id);

	if (other >= 0) {
		append_missing(text, m);
	}
	append_name(text, m->cfg, i);
	append(text, ": wrong identity: expected ");
	append_wanted(text, want);
	append(text, ", found ");
	append_found(text, want, found, id);
	if (other >= 0) {
		append(text, ", which is ");
		append_name(text, m->cfg, (size_t)other);
	}
}

int compare_slaves(const struct config *cfg, const struct slave_info *found, const uint16_t *id,
		   size_t found_count, char *error, size_t error_bytes)
{
	struct text text = { .buf = error, .bytes = error_bytes };
	struct matching m = { .cfg = cfg, .found = found, .id = id, .found_count = found_count };
	size_t j = 0; /* position */

	if (compare_bind(cfg, found, id, found_count, m.config) == 0) {
		return 0;
	}
	for (size_t i = 0; i < cfg->slave_count; i++) {
		const struct config_slave *want = &cfg->slave[i];

		if (j < found_count && compare_is_wanted(want, &found[j], id_of(id, j))) {
			j++;
			continue;
		}
		if (want->is_optional) {
			continue;
		}
		if (j >= found_count) {
			append_name(&text, cfg, i);
			append(&text, " is missing: %zu found, %zu expected; expected ",
			       found_count, cfg->slave_count);
			append_wanted(&text, want);
			return -ENXIO;
		}
		append_wrong(&text, &m, i, j);
		return -ENXIO;
	}
	if (j < found_count) {
		append(&text, "slave %zu is unexpected: %zu found, %zu expected; found ", j,
		       found_count, cfg->slave_count);
		append_found(&text, &(struct config_slave){ 0 }, &found[j], 0);
	}
	return -ENXIO;
}
