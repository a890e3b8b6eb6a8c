/* SPDX-License-Identifier: MIT */
#include "devices/wago_text.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "devices/wago_750_354.h"

#define NAME "wago_750_354"
#define EXAMPLE NAME "+457+557+430+530"

/* --- a node's name --- */

int wago_750_354_is_name(const char *name)
{
	size_t len = strlen(NAME);

	return strncmp(name, NAME, len) == 0 && (name[len] == '\0' || name[len] == '+');
}

/* A number from 0 to @limit that ends at one of @ends; moves *text to there. */
static int take_number(const char **text, const char *ends, unsigned long limit, unsigned long *ret)
{
	char *end;
	unsigned long value;

	if (**text < '0' || **text > '9') {
		return -EINVAL;
	}
	errno = 0;
	value = strtoul(*text, &end, 0);
	if (errno != 0 || value > limit || (*end != '\0' && strchr(ends, *end) == NULL)) {
		return -EINVAL;
	}
	*text = end;
	*ret = value;
	return 0;
}

int wago_750_354_by_name(int position, const char *name, struct segment_slave_spec *ret_spec)
{
	const struct wago_module *modules[WAGO_MODULES_MAX];
	const char *text = (strcmp(name, NAME) == 0 ? EXAMPLE : name) + strlen(NAME);
	size_t count = 0;

	while (*text == '+') {
		unsigned long number;

		text++;
		if (take_number(&text, "+", 999, &number) < 0) {
			return -EINVAL;
		}
		if (count == WAGO_MODULES_MAX) {
			return -E2BIG;
		}
		modules[count] = wago_module_find((unsigned)number);
		if (modules[count++] == NULL) {
			return -EINVAL;
		}
	}
	return wago_750_354_slave(position, modules, count, ret_spec);
}

/* --- its terminals --- */

struct text {
	char *buf;
	size_t bytes;
	size_t len;
};

__attribute__((format(printf, 2, 3))) static void append(struct text *t, const char *format, ...)
{
	va_list args;
	int n;

	va_start(args, format);
	n = vsnprintf(t->buf + t->len, t->bytes - t->len, format, args);
	va_end(args);
	if (n > 0) {
		t->len = t->len + (size_t)n < t->bytes ? t->len + (size_t)n : t->bytes - 1;
	}
}

static void append_slot(struct text *t, const struct sim_device *dev, size_t slot)
{
	const struct wago_module *m = wago_750_354_node(dev)->slot[slot].module;
	unsigned bits = 0;

	append(t, "%sslot%zu=", slot > 0 ? " " : "", slot + 1);
	for (unsigned channel = 1; channel <= m->channels; channel++) {
		int value = 0;

		(void)wago_750_354_get(dev, slot, channel, &value);
		if (m->bits == 1) {
			bits |= (unsigned)value << (channel - 1);
		} else {
			append(t, "%s%d", channel > 1 ? "," : "", value);
		}
	}
	if (m->bits == 1) {
		append(t, "0x%02x", bits);
	}
}

void wago_io_get(const struct sim_device *dev, char *ret_text, size_t text_bytes)
{
	struct text t = { .buf = ret_text, .bytes = text_bytes };

	ret_text[0] = '\0';
	for (size_t slot = 0; slot < wago_750_354_node(dev)->slot_count; slot++) {
		append_slot(&t, dev, slot);
	}
}

static int set_all(struct sim_device *dev, size_t slot, unsigned long bits)
{
	const struct wago_module *m = wago_750_354_node(dev)->slot[slot].module;

	if (bits >> m->channels != 0) {
		return -EINVAL;
	}
	for (unsigned channel = 1; channel <= m->channels; channel++) {
		int r = wago_750_354_set(dev, slot, channel, (int)(bits >> (channel - 1) & 1));

		if (r < 0) {
			return r;
		}
	}
	return 0;
}

int wago_io_set(struct sim_device *dev, const char *key, const char *value)
{
	unsigned long slot;
	unsigned long channel;
	unsigned long bits;

	if (strncmp(key, "slot", 4) != 0) {
		return -EINVAL;
	}
	key += 4;
	if (take_number(&key, ".", WAGO_MODULES_MAX, &slot) < 0 || slot < 1 ||
	    slot > wago_750_354_node(dev)->slot_count || take_number(&value, "", 0xff, &bits) < 0) {
		return -EINVAL;
	}
	if (*key == '\0') {
		return set_all(dev, slot - 1, bits);
	}
	key++;
	if (take_number(&key, "", 0xff, &channel) < 0 || bits > 1) {
		return -EINVAL;
	}
	return wago_750_354_set(dev, slot - 1, (unsigned)channel, (int)bits);
}
