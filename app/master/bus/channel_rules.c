/* SPDX-License-Identifier: MIT */
#include "bus/channel_rules.h"

#include <errno.h>
#include <fnmatch.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "image/image.h"

enum { OBJECT_BYTES = 16, LIST_BYTES = 120 };

static const uint8_t type_of[] = {
	/* enum channel_type */
	[CONFIG_CHANNEL_BOOL] = CHANNEL_BOOL,
	[CONFIG_CHANNEL_UINT] = CHANNEL_UINT,
	[CONFIG_CHANNEL_INT] = CHANNEL_INT,
	[CONFIG_CHANNEL_FLOAT] = CHANNEL_FLOAT,
};

static int is_of(const struct config_channel *item, const struct slave_info *slave)
{
	return item->slave_pos == slave->slave_pos;
}

/* "piccolo0.adc" of slave "piccolo0" is "adc". */
static const char *entry_of(const struct slave_info *slave, const struct channel *ch)
{
	size_t len = strlen(slave->name);

	return strncmp(ch->name, slave->name, len) == 0 && ch->name[len] == '.' ? ch->name + len + 1
										: ch->name;
}

int channel_rule_matches(const struct config_channel *item, const struct slave_info *slave,
			 const struct channel *ch)
{
	char object[OBJECT_BYTES];

	snprintf(object, sizeof(object), "0x%04x:%02x", ch->index, ch->subindex);
	return fnmatch(item->match, entry_of(slave, ch), 0) == 0 ||
	       fnmatch(item->match, ch->name, 0) == 0 || fnmatch(item->match, object, 0) == 0;
}

void channel_rules_list(const struct channel_rules_of *of, char *buf, size_t bytes)
{
	size_t len = 0;

	buf[0] = '\0';
	for (size_t i = 0; i < of->count; i++) {
		const char *name = entry_of(of->slave, &of->channel[i]);

		if (len + strlen(name) + sizeof(", ...") > bytes) {
			snprintf(buf + len, bytes - len, ", ...");
			return;
		}
		len += (size_t)snprintf(buf + len, bytes - len, "%s%s", len > 0 ? ", " : "", name);
	}
}

static struct channel retyped(const struct config_channel *item, const struct channel *ch)
{
	struct channel typed = *ch;

	if (item->type != CONFIG_CHANNEL_DEVICE) {
		typed.type = type_of[item->type];
	}
	return typed;
}

/* One problem of one item. */
struct complaint {
	const struct channel_rules_of *of;
	const struct config_channel *item;
	char *error;
	size_t error_bytes;
};

__attribute__((format(printf, 2, 3))) static int refuse(const struct complaint *to,
							const char *format, ...)
{
	const struct config *cfg = to->of->cfg;
	int used = snprintf(to->error, to->error_bytes, "%s:%d: slave %u (%s): channels: %s: ",
			    cfg->path[0] != '\0' ? cfg->path : "configuration", to->item->line,
			    to->of->slave->slave_pos, to->of->slave->name, to->item->match);
	va_list args;

	if (used > 0 && (size_t)used < to->error_bytes) {
		va_start(args, format);
		vsnprintf(to->error + used, to->error_bytes - (size_t)used, format, args);
		va_end(args);
	}
	return -EINVAL;
}

static int check_match(const struct complaint *to, const struct channel *ch)
{
	const struct config_channel *item = to->item;
	struct channel typed = retyped(item, ch);
	size_t len = strlen(to->of->slave->name) + 1 + strlen(item->name);
	char type[OBJECT_BYTES];

	if (!image_channel_fits(&typed, LIMIT_IMAGE_BYTES)) {
		image_type_format(&typed, type, sizeof(type));
		return refuse(to, "%s has %u bits: it cannot be a %.*s",
			      entry_of(to->of->slave, ch), ch->bit_len,
			      (int)strcspn(type, "0123456789"), type);
	}
	if (item->name[0] != '\0' && len >= sizeof(ch->name)) {
		return refuse(to, "%s.%s is longer than %zu characters", to->of->slave->name,
			      item->name, sizeof(ch->name) - 1);
	}
	return 0;
}

static int check_item(const struct complaint *to)
{
	const struct channel_rules_of *of = to->of;
	char names[LIST_BYTES];
	size_t met = 0;

	for (size_t i = 0; i < of->count; i++) {
		if (channel_rule_matches(to->item, of->slave, &of->channel[i])) {
			int r = check_match(to, &of->channel[i]);

			if (r < 0) {
				return r;
			}
			met++;
		}
	}
	if (met == 0) {
		channel_rules_list(of, names, sizeof(names));
		return refuse(to, "no such channel; there are: %s", of->count > 0 ? names : "none");
	}
	if (met > 1 && to->item->name[0] != '\0') {
		return refuse(to, "meets %zu channels, which cannot all be named %s", met,
			      to->item->name);
	}
	return 0;
}

static void apply(const struct config_channel *item, const struct slave_info *slave,
		  struct channel *ch)
{
	*ch = retyped(item, ch);
	if (item->unit[0] != '\0') {
		snprintf(ch->unit, sizeof(ch->unit), "%s", item->unit);
	}
	if (item->scale != 0) {
		ch->scale = item->scale;
		ch->offset = item->offset;
	}
	if (isfinite(item->min) || isfinite(item->max)) {
		ch->min = item->min;
		ch->max = item->max;
	}
	if (item->name[0] != '\0') {
		snprintf(ch->name, sizeof(ch->name), "%s.%.*s", slave->name,
			 (int)(sizeof(ch->name) - 2 - strlen(slave->name)), item->name);
	}
}

/* All items mean channels by the names of the device, also behind one that renames. */
int channel_rules_apply(const struct channel_rules_of *of)
{
	size_t bytes = of->count * sizeof(of->channel[0]);
	struct channel *device = malloc(bytes + 1);

	if (device == NULL) {
		return -ENOMEM;
	}
	memcpy(device, of->channel, bytes);
	for (size_t n = 0; n < of->cfg->channel_count; n++) {
		const struct config_channel *item = &of->cfg->channel[n];

		for (size_t i = 0; is_of(item, of->slave) && i < of->count; i++) {
			if (channel_rule_matches(item, of->slave, &device[i])) {
				apply(item, of->slave, &of->channel[i]);
			}
		}
	}
	free(device);
	return 0;
}

/* The item that gives channel @i its name; NULL: it keeps the device's. */
static const struct config_channel *naming(const struct channel_rules_of *of, size_t i)
{
	const struct config_channel *last = NULL;

	for (size_t n = 0; n < of->cfg->channel_count; n++) {
		const struct config_channel *item = &of->cfg->channel[n];

		if (is_of(item, of->slave) && item->name[0] != '\0' &&
		    channel_rule_matches(item, of->slave, &of->channel[i])) {
			last = item;
		}
	}
	return last;
}

/* A new name must not be that of a channel that keeps its own. */
static int check_taken(const struct complaint *to)
{
	const struct channel_rules_of *of = to->of;

	for (size_t i = 0; to->item->name[0] != '\0' && i < of->count; i++) {
		if (strcmp(entry_of(of->slave, &of->channel[i]), to->item->name) == 0 &&
		    naming(of, i) == NULL) {
			return refuse(to, "another channel of this slave has the name %s",
				      to->item->name);
		}
	}
	return 0;
}

int channel_rules_check(const struct channel_rules_of *of, char *error, size_t error_bytes)
{
	for (size_t n = 0; n < of->cfg->channel_count; n++) {
		const struct config_channel *item = &of->cfg->channel[n];
		const struct complaint to = { of, item, error, error_bytes };
		int r;

		if (!is_of(item, of->slave)) {
			continue;
		}
		r = check_item(&to);
		r = r < 0 ? r : check_taken(&to);
		if (r < 0) {
			return r;
		}
	}
	return 0;
}
