/* SPDX-License-Identifier: MIT */
#include "bus/differences.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/grow.h"
#include "bus/bus_internal.h"
#include "bus/channel_rules.h"
#include "bus/channels.h"
#include "bus/compare.h"
#include "bus/guests.h"
#include "image/image.h"

/* --- the list --- */

void differences_free(struct differences *list)
{
	free(list->at);
	*list = (struct differences){ .at = NULL };
}

struct difference *differences_add(struct differences *list, enum difference_kind kind)
{
	struct difference *diff = array_grow(list->at, &list->count, sizeof(*diff));

	if (diff == NULL) {
		return NULL;
	}
	list->at = diff;
	diff += list->count - 1;
	diff->kind = (uint16_t)kind;
	diff->item = DIFFERENCE_NOWHERE;
	diff->position = DIFFERENCE_NOWHERE;
	return diff;
}

/* --- slaves: which configured one goes with which found one --- */

enum { NONE = -1 };

struct pairing {
	const struct config *cfg;
	const struct slave_info *found;
	const uint16_t *id; /* NULL: not read */
	size_t found_count;
	int device[LIMIT_SLAVES];       /* of the configured slave; NONE */
	int slave[LIMIT_SLAVES];        /* of the device; NONE */
	uint8_t is_fit[LIMIT_SLAVES];   /* of the configured slave: its device is what is wanted */
	uint8_t is_moved[LIMIT_SLAVES]; /* the same, at another place */
};

static int fits(const struct pairing *p, size_t i, size_t j)
{
	return compare_is_wanted(&p->cfg->slave[i], &p->found[j], p->id != NULL ? p->id[j] : 0);
}

static void pair(struct pairing *p, size_t i, size_t j)
{
	p->device[i] = (int)j;
	p->slave[j] = (int)i;
}

static int is_same_type(const struct pairing *p, size_t i, size_t j)
{
	const struct config_slave *want = &p->cfg->slave[i];

	return (want->product == 0 || want->product == p->found[j].product) &&
	       (want->vendor == 0 || want->vendor == p->found[j].vendor);
}

/* What a difference costs: the cheapest way from what is configured to what is found is shown. */
enum {
	COST_PROPERTY = 1, /* the right type, with another serial number or the like */
	COST_MISSING = 3,  /* also of one too many */
	COST_REPLACED = 4, /* another device in its place: less than one missing, one too many */
	COST_FORBIDDEN = 1 << 20,
};

static uint32_t cost_of_pair(const struct pairing *p, size_t i, size_t j)
{
	if (fits(p, i, j)) {
		return 0;
	}
	if (is_same_type(p, i, j)) {
		return COST_PROPERTY;
	}
	return p->cfg->slave[i].is_optional ? COST_FORBIDDEN : COST_REPLACED;
}

static uint32_t cost_of_absence(const struct pairing *p, size_t i)
{
	return p->cfg->slave[i].is_optional ? 0 : COST_MISSING;
}

/* Of a device with no configured slave, where slave @i would be next. */
static uint32_t cost_of_device(const struct pairing *p, size_t i)
{
	return i == p->cfg->slave_count && p->cfg->bus_presence != CONFIG_EXACT_SLAVES
		       ? 0
		       : COST_MISSING;
}

static uint32_t min3(uint32_t a, uint32_t b, uint32_t c)
{
	uint32_t least = a < b ? a : b;

	return c < least ? c : least;
}

/* cost[i][j]: from the configured slave i and the device j on. */
static void fill_costs(const struct pairing *p, uint32_t *cost, size_t row)
{
	size_t n = p->cfg->slave_count;
	size_t m = p->found_count;

	for (size_t i = n + 1; i-- > 0;) {
		for (size_t j = m + 1; j-- > 0;) {
			uint32_t absent = i == n ? COST_FORBIDDEN
						 : cost[(i + 1) * row + j] + cost_of_absence(p, i);
			uint32_t more = j == m ? COST_FORBIDDEN
					       : cost[i * row + j + 1] + cost_of_device(p, i);
			uint32_t both = i == n || j == m ? COST_FORBIDDEN
							 : cost[(i + 1) * row + j + 1] +
								   cost_of_pair(p, i, j);

			cost[i * row + j] = i == n && j == m ? 0 : min3(absent, more, both);
		}
	}
}

static int pair_in_order(struct pairing *p)
{
	size_t row = p->found_count + 1;
	uint32_t *cost = calloc((p->cfg->slave_count + 1) * row, sizeof(*cost));
	size_t i = 0;
	size_t j = 0;

	if (cost == NULL) {
		return -ENOMEM;
	}
	fill_costs(p, cost, row);
	while (i < p->cfg->slave_count && j < p->found_count) {
		uint32_t least = cost[i * row + j];

		if (least == cost[(i + 1) * row + j + 1] + cost_of_pair(p, i, j)) {
			p->is_fit[i] = (uint8_t)fits(p, i, j);
			pair(p, i++, j++);
		} else if (least == cost[(i + 1) * row + j] + cost_of_absence(p, i)) {
			i++;
		} else {
			j++;
		}
	}
	free(cost);
	return 0;
}

/* The rest that fits at another place; any device fits a slave of which nothing is stated. */
static void pair_moved(struct pairing *p)
{
	for (size_t i = 0; i < p->cfg->slave_count; i++) {
		for (size_t j = 0; j < p->found_count && p->device[i] == NONE; j++) {
			if (p->slave[j] == NONE && compare_is_specific(&p->cfg->slave[i]) &&
			    fits(p, i, j)) {
				p->is_fit[i] = 1;
				p->is_moved[i] = 1;
				pair(p, i, j);
			}
		}
	}
}

/* --- slaves: what is different --- */

static struct difference *add_slave(const struct pairing *p, struct differences *list,
				    enum difference_kind kind, size_t i)
{
	const struct config_slave *want = &p->cfg->slave[i];
	struct difference *diff = differences_add(list, kind);

	if (diff == NULL) {
		return NULL;
	}
	diff->item = (uint16_t)i;
	diff->line = (uint32_t)want->line;
	snprintf(diff->name, sizeof(diff->name), "%s", want->name);
	snprintf(diff->group, sizeof(diff->group), "%s", want->group);
	compare_wanted_format(want, diff->expected, sizeof(diff->expected));
	return diff;
}

static int add_property(const struct pairing *p, struct differences *list, size_t i,
			const char *property, uint32_t expected, uint32_t found)
{
	int is_hex = strcmp(property, "revision") == 0;
	int is_least = is_hex && p->cfg->slave[i].revision_policy == CONFIG_REVISION_AT_LEAST;
	struct difference *diff = add_slave(p, list, DIFFERENCE_IDENTITY, i);

	if (diff == NULL) {
		return -ENOMEM;
	}
	diff->position = (uint16_t)p->device[i];
	snprintf(diff->property, sizeof(diff->property), "%s", property);
	snprintf(diff->expected, sizeof(diff->expected), is_hex ? "0x%08x%s" : "%u%s", expected,
		 is_least ? " or newer" : "");
	snprintf(diff->found, sizeof(diff->found), is_hex ? "0x%08x" : "%u", found);
	return 0;
}

/* The device in the place of slave @i is not what is wanted: every property that is not. */
static int add_identity(const struct pairing *p, struct differences *list, size_t i)
{
	const struct config_slave *want = &p->cfg->slave[i];
	size_t j = (size_t)p->device[i];
	const struct slave_info *found = &p->found[j];
	unsigned id = p->id != NULL ? p->id[j] : 0;
	struct difference *diff;
	int r = 0;

	if (!is_same_type(p, i, j)) {
		diff = add_slave(p, list, DIFFERENCE_IDENTITY, i);
		if (diff == NULL) {
			return -ENOMEM;
		}
		diff->position = (uint16_t)j;
		snprintf(diff->property, sizeof(diff->property), "device");
		compare_found_format(want, found, id, diff->found, sizeof(diff->found));
		return 0;
	}
	if (!compare_is_revision_wanted(want, found->revision)) {
		r = add_property(p, list, i, "revision", want->revision, found->revision);
	}
	if (r == 0 && want->serial != 0 && want->serial != found->serial) {
		r = add_property(p, list, i, "serial", want->serial, found->serial);
	}
	if (r == 0 && want->alias != 0 && want->alias != found->alias) {
		r = add_property(p, list, i, "alias", want->alias, found->alias);
	}
	if (r == 0 && want->identification != 0 && want->identification != id) {
		r = add_property(p, list, i, "identification", want->identification, id);
	}
	return r;
}

static int add_of_slave(const struct pairing *p, struct differences *list, size_t i)
{
	struct difference *diff;

	if (p->device[i] == NONE) {
		diff = add_slave(
			p, list,
			p->cfg->slave[i].is_optional ? DIFFERENCE_OPTIONAL : DIFFERENCE_MISSING, i);
		return diff != NULL ? 0 : -ENOMEM;
	}
	if (!p->is_fit[i]) {
		return add_identity(p, list, i);
	}
	if (p->is_moved[i]) {
		diff = add_slave(p, list, DIFFERENCE_PLACE, i);
		if (diff == NULL) {
			return -ENOMEM;
		}
		diff->position = (uint16_t)p->device[i];
	}
	return 0;
}

static int add_of_device(const struct pairing *p, struct differences *list, size_t j)
{
	const struct config_slave any = { .name = "" };
	struct difference *diff;

	if (p->slave[j] != NONE) {
		return 0;
	}
	diff = differences_add(list, DIFFERENCE_UNEXPECTED);
	if (diff == NULL) {
		return -ENOMEM;
	}
	diff->position = (uint16_t)j;
	snprintf(diff->name, sizeof(diff->name), "%s", p->found[j].device);
	compare_found_format(&any, &p->found[j], 0, diff->found, sizeof(diff->found));
	return 0;
}

/* Behind the last configured slave others are allowed, unless bus.presence is exact. */
static size_t judged_devices(const struct pairing *p)
{
	size_t count = p->found_count;

	if (p->cfg->bus_presence != CONFIG_EXACT_SLAVES) {
		while (count > 0 && p->slave[count - 1] == NONE) {
			count--;
		}
	}
	return count;
}

static void pair_bound(struct pairing *p, const int *config)
{
	for (size_t j = 0; j < p->found_count; j++) {
		if (config[j] >= 0) {
			p->is_fit[config[j]] = 1;
			pair(p, (size_t)config[j], j);
		}
	}
}

int differences_of_slaves(const struct config *cfg, const struct slave_info *found,
			  const uint16_t *id, size_t found_count, struct differences *list)
{
	struct pairing *p = calloc(1, sizeof(*p));
	int config[LIMIT_SLAVES];
	size_t devices;
	int r = 0;

	if (p == NULL) {
		return -ENOMEM;
	}
	*p = (struct pairing){ .cfg = cfg, .found = found, .id = id, .found_count = found_count };
	for (size_t i = 0; i < LIMIT_SLAVES; i++) {
		p->device[i] = NONE;
		p->slave[i] = NONE;
	}
	if (compare_bind(cfg, found, id, found_count, config) == 0) {
		pair_bound(p, config);
	} else {
		r = pair_in_order(p);
		pair_moved(p);
	}
	for (size_t i = 0; i < cfg->slave_count && r == 0; i++) {
		r = add_of_slave(p, list, i);
	}
	devices = judged_devices(p);
	for (size_t j = 0; j < devices && r == 0; j++) {
		r = add_of_device(p, list, j);
	}
	free(p);
	return r;
}

/* --- channels --- */

static int meets_a_channel(const struct channel_rules_of *of, const struct config_channel *item)
{
	for (size_t i = 0; i < of->count; i++) {
		if (channel_rule_matches(item, of->slave, &of->channel[i])) {
			return 1;
		}
	}
	return 0;
}

int differences_of_channels(const struct config *cfg, const struct slave_info *slave,
			    struct channel *channel, size_t channel_count, struct differences *list)
{
	struct channel_rules_of of = { .cfg = cfg, .slave = slave };
	size_t first;

	of.count = channels_of(channel, channel_count, slave->slave_pos, &first);
	of.channel = channel + first;
	for (size_t i = 0; i < cfg->channel_count; i++) {
		const struct config_channel *item = &cfg->channel[i];
		struct difference *diff;

		if (item->slave_pos != slave->slave_pos || meets_a_channel(&of, item)) {
			continue;
		}
		diff = differences_add(list, DIFFERENCE_NO_CHANNEL);
		if (diff == NULL) {
			return -ENOMEM;
		}
		diff->position = slave->slave_pos;
		diff->line = (uint32_t)item->line;
		snprintf(diff->name, sizeof(diff->name), "%s", slave->name);
		snprintf(diff->group, sizeof(diff->group), "%s",
			 cfg->slave[slave->slave_pos].group);
		snprintf(diff->property, sizeof(diff->property), "channels");
		snprintf(diff->expected, sizeof(diff->expected), "%s", item->match);
		channel_rules_list(&of, diff->found, sizeof(diff->found));
	}
	return 0;
}

/* --- outputs --- */

static struct difference *add_output(const struct config *cfg, struct differences *list,
				     enum difference_kind kind, size_t i)
{
	struct difference *diff = differences_add(list, kind);

	if (diff != NULL) {
		diff->item = (uint16_t)i;
		diff->line = (uint32_t)cfg->output[i].line;
		snprintf(diff->name, sizeof(diff->name), "%s", cfg->output[i].channel);
	}
	return diff;
}

int differences_of_outputs(const struct config *cfg, const struct channel *channels,
			   size_t channel_count, struct differences *list)
{
	for (size_t i = 0; i < cfg->output_count; i++) {
		int at = image_channel_find(channels, channel_count, cfg->output[i].channel);
		struct difference *diff;

		if (at >= 0 && channels[at].direction == CHANNEL_OUTPUT) {
			continue;
		}
		diff = add_output(cfg, list, DIFFERENCE_CHANNEL, i);
		if (diff == NULL) {
			return -ENOMEM;
		}
		snprintf(diff->expected, sizeof(diff->expected), "an output channel");
		snprintf(diff->found, sizeof(diff->found), "%s",
			 at >= 0 ? "an input channel" : "no channel of this name");
	}
	return 0;
}

static int is_slave_named(const struct config *cfg, const struct bus *bus, const char *channel)
{
	size_t len = strcspn(channel, ".");

	for (size_t i = 0; i < cfg->slave_count; i++) {
		if (strlen(cfg->slave[i].name) == len &&
		    strncmp(cfg->slave[i].name, channel, len) == 0) {
			return 1;
		}
	}
	for (size_t i = 0; bus != NULL && i < bus->slave_count; i++) {
		if (strlen(bus->info[i].name) == len &&
		    strncmp(bus->info[i].name, channel, len) == 0) {
			return 1;
		}
	}
	return 0;
}

/* One line for what only the mapping shows; none for 0. */
static int add_unchecked(struct differences *list, const char *what, size_t count)
{
	struct difference *diff = count == 0 ? NULL : differences_add(list, DIFFERENCE_UNCHECKED);

	if (diff == NULL) {
		return count == 0 ? 0 : -ENOMEM;
	}
	snprintf(diff->name, sizeof(diff->name), "%s", what);
	snprintf(diff->found, sizeof(diff->found),
		 "%zu cannot be compared: process data are mapped on the way from PRE-OP to "
		 "SAFE-OP",
		 count);
	return 0;
}

/* Without a channel table: a slave's name that nobody has is wrong in any case. */
static int add_unmapped(const struct bus *bus, const struct config *cfg, struct differences *list)
{
	size_t unchecked = 0;
	struct difference *diff;

	for (size_t i = 0; i < cfg->output_count; i++) {
		if (is_slave_named(cfg, bus, cfg->output[i].channel)) {
			unchecked++;
			continue;
		}
		diff = add_output(cfg, list, DIFFERENCE_CHANNEL, i);
		if (diff == NULL) {
			return -ENOMEM;
		}
		snprintf(diff->expected, sizeof(diff->expected), "an output channel");
		snprintf(diff->found, sizeof(diff->found), "no slave of this name");
	}
	return add_unchecked(list, "outputs", unchecked);
}

/* The same of slaves[].pdos[]: of how many slaves. */
static int add_unmapped_pdos(const struct config *cfg, struct differences *list)
{
	size_t slaves = 0;

	for (size_t i = 0; i < cfg->pdo_count; i++) {
		slaves += i == 0 || cfg->pdo[i].slave_pos != cfg->pdo[i - 1].slave_pos;
	}
	return add_unchecked(list, "slaves[].pdos", slaves);
}

/* --- all --- */

static int add_lost(const struct bus *bus, const struct config *cfg, struct differences *list)
{
	for (size_t j = 0; j < bus->slave_count; j++) {
		uint16_t item = bus->info[j].config_item;
		struct difference *diff;

		if (!bus->slave[j].is_lost) {
			continue;
		}
		diff = differences_add(list, DIFFERENCE_LOST);
		if (diff == NULL) {
			return -ENOMEM;
		}
		diff->position = (uint16_t)j;
		if (item > 0 && item <= cfg->slave_count) {
			diff->item = (uint16_t)(item - 1);
			diff->line = (uint32_t)cfg->slave[item - 1].line;
			snprintf(diff->group, sizeof(diff->group), "%s",
				 cfg->slave[item - 1].group);
		}
		snprintf(diff->name, sizeof(diff->name), "%.*s", (int)sizeof(diff->name) - 1,
			 bus->info[j].name);
	}
	return 0;
}

/* Devices that came after the scan. */
static int add_guests(const struct bus *bus, struct differences *list)
{
	struct difference *diff;

	if (bus_guests_known(bus) == 0) {
		return 0;
	}
	diff = differences_add(list, DIFFERENCE_UNEXPECTED);
	if (diff == NULL) {
		return -ENOMEM;
	}
	bus_guests_describe(bus, diff->found, sizeof(diff->found));
	return 0;
}

int differences_of_bus(const struct bus *bus, const struct config *cfg, struct differences *list)
{
	int r;

	if (bus == NULL) {
		r = differences_of_slaves(cfg, NULL, NULL, 0, list);
		r = r < 0 ? r : add_unmapped_pdos(cfg, list);
		return r < 0 ? r : add_unmapped(bus, cfg, list);
	}
	r = differences_of_slaves(cfg, bus->info, bus->identification, bus->slave_count, list);
	r = r < 0 ? r : add_lost(bus, cfg, list);
	r = r < 0 ? r : add_guests(bus, list);
	if (r < 0) {
		return r;
	}
	/* A channel table without a plan: slaves[].channels[] could not be applied to it. */
	for (size_t i = 0;
	     i < bus->slave_count && bus->plan.slave_count == 0 && bus->channel_count > 0; i++) {
		r = differences_of_channels(bus->cfg, &bus->info[i], bus->channel,
					    bus->channel_count, list);
		if (r < 0) {
			return r;
		}
	}
	for (size_t i = 0;
	     i < bus->slave_count && bus->plan.slave_count > 0 && bus->pdo != NULL && r == 0; i++) {
		r = differences_of_pdos(bus->cfg, &bus->info[i], &bus->pdo[bus->slave[i].pdo_first],
					bus->slave[i].pdo_count, list);
	}
	if (r == 0 && (bus->plan.slave_count == 0 || bus->pdo == NULL)) {
		r = add_unmapped_pdos(cfg, list);
	}
	if (r < 0) {
		return r;
	}
	/* With a channel table, the slaves fit: the outputs of those that are absent are left out.
	 */
	return bus->plan.slave_count > 0
		       ? differences_of_outputs(bus->cfg, bus->channel, bus->channel_count, list)
		       : add_unmapped(bus, cfg, list);
}
