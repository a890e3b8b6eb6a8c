/* SPDX-License-Identifier: MIT */
/* What a program may call (control.h). An index that no find() gave is harmless. */
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "control/control_internal.h"
#include "image/image.h"

#define COUNT(field)                                                                               \
	atomic_store_explicit(&(field), atomic_load_explicit(&(field), memory_order_relaxed) + 1,  \
			      memory_order_relaxed)

/* --- in init() --- */

static int trouble(struct control *ctl, int r, const char *name, const char *why)
{
	if (ctl->first_error[0] == '\0') {
		snprintf(ctl->first_error, sizeof(ctl->first_error), "%.63s: %s", name, why);
	}
	return r;
}

static int find(void *host, const char *name, int is_output, uint32_t *ret_index)
{
	struct control *ctl = host;
	int n = image_channel_find(ctl->spec.channels, ctl->spec.channel_count, name);

	if (n < 0) {
		return trouble(ctl, -ENOENT, name, "no such channel (see `ecdaq channels`)");
	}
	if (is_output && ctl->output_of[n] < 0) {
		return trouble(ctl, -EROFS, name, "is an input and cannot be written");
	}
	if (is_output && !ctl->output[ctl->output_of[n]].is_own) {
		return trouble(ctl, -EACCES, name,
			       "does not belong to the program (outputs: owner: program)");
	}
	*ret_index = (uint32_t)n;
	return 0;
}

static int option_text(void *host, const char *key, char *ret_text, uint32_t text_bytes)
{
	struct control *ctl = host;
	const char *value = arguments_get(&ctl->arguments, key);

	if (value == NULL) {
		return -ENOENT;
	}
	if (strlen(value) >= text_bytes) {
		return trouble(ctl, -ENAMETOOLONG, key, "the value in control.options is too long");
	}
	memcpy(ret_text, value, strlen(value) + 1);
	return 0;
}

static int option_number(void *host, const char *key, double *ret_value)
{
	struct control *ctl = host;
	const char *text = arguments_get(&ctl->arguments, key);
	char *end;
	double value;

	if (text == NULL) {
		return -ENOENT;
	}
	value = strtod(text, &end);
	if (end == text || *end != '\0' || !isfinite(value)) {
		return trouble(ctl, -EINVAL, key, "the value in control.options is not a number");
	}
	*ret_value = value;
	return 0;
}

static void say(void *host, const char *text)
{
	struct control *ctl = host;

	snprintf(ctl->message, sizeof(ctl->message), "%s", text);
}

/* --- in cycle() --- */

static const struct channel *channel(const struct control *ctl, uint32_t index)
{
	return index < ctl->spec.channel_count ? &ctl->spec.channels[index] : NULL;
}

static uint64_t get_raw(void *host, uint32_t index)
{
	const struct control *ctl = host;
	const struct channel *ch = channel(ctl, index);

	return ch != NULL ? image_get_raw(ctl->image, ch) : 0;
}

static int64_t get_int(void *host, uint32_t index)
{
	const struct control *ctl = host;
	const struct channel *ch = channel(ctl, index);
	uint64_t raw = get_raw(host, index);

	if (ch != NULL && ch->type == CHANNEL_INT && ch->bit_len < 64) {
		uint64_t sign = UINT64_C(1) << (ch->bit_len - 1);

		raw = (raw ^ sign) - sign;
	}
	return (int64_t)raw;
}

static double get(void *host, uint32_t index)
{
	const struct control *ctl = host;
	const struct channel *ch = channel(ctl, index);

	return ch != NULL ? image_get_physical(ctl->image, ch) : 0.0;
}

static int is_good(void *host, uint32_t index)
{
	const struct control *ctl = host;
	const struct channel *ch = channel(ctl, index);

	return ch != NULL && ecdaq_is_slave_good(&ctl->now, ch->slave_pos);
}

/* The output, if it is the program's. */
static struct control_output *output(struct control *ctl, uint32_t index)
{
	struct control_output *out;

	if (index >= ctl->spec.channel_count || ctl->output_of[index] < 0) {
		return NULL;
	}
	out = &ctl->output[ctl->output_of[index]];
	return out->is_own ? out : NULL;
}

static uint64_t low_bits(unsigned bit_len)
{
	return bit_len >= 64 ? UINT64_MAX : (UINT64_C(1) << bit_len) - 1;
}

/* The end of the channel's range on the side where @physical is. */
static uint64_t end_of_range(const struct channel *ch, double physical)
{
	int is_above = (physical - ch->offset) / ch->scale > 0;
	uint64_t all = low_bits(ch->bit_len);

	if (ch->type != CHANNEL_INT) {
		return is_above ? all : 0;
	}
	return is_above ? all >> 1 : all ^ (all >> 1);
}

static int refuse(struct control *ctl)
{
	COUNT(ctl->spec.status->refused);
	return -EINVAL;
}

static int set(void *host, uint32_t index, double physical)
{
	struct control *ctl = host;
	struct control_output *out = output(ctl, index);
	uint64_t raw = 0;
	int r;

	if (out == NULL) {
		return refuse(ctl);
	}
	/* An infinity is a number that is limited; for a float channel without limits it is not. */
	if (isinf(physical) && (physical > 0 ? isinf(out->max) : isinf(out->min)) &&
	    ctl->spec.channels[index].type == CHANNEL_FLOAT) {
		physical = NAN;
	}
	r = image_physical_to_raw(&ctl->spec.channels[index], physical, &raw);
	if (r == -EINVAL) {
		out->is_set = 0;
		return refuse(ctl);
	}
	out->raw = r < 0 ? end_of_range(&ctl->spec.channels[index], physical) : raw;
	out->is_set = 1;
	if (r < 0 || physical < out->min || physical > out->max) {
		COUNT(ctl->spec.status->limited);
		return 1;
	}
	return 0;
}

static int set_raw(void *host, uint32_t index, uint64_t raw)
{
	struct control *ctl = host;
	struct control_output *out = output(ctl, index);
	double physical;

	if (out == NULL) {
		return refuse(ctl);
	}
	physical = image_raw_to_physical(&ctl->spec.channels[index], raw);
	if (raw > low_bits(ctl->spec.channels[index].bit_len) || isnan(physical)) {
		out->is_set = 0;
		return refuse(ctl);
	}
	out->raw = raw;
	out->is_set = 1;
	if (physical < out->min || physical > out->max) {
		COUNT(ctl->spec.status->limited);
		return 1;
	}
	return 0;
}

static void release(void *host, uint32_t index)
{
	struct control_output *out = output(host, index);

	if (out != NULL) {
		out->is_set = 0;
	}
}

const struct ecdaq_calls control_calls = {
	.bytes = sizeof(struct ecdaq_calls),
	.find = find,
	.option_text = option_text,
	.option_number = option_number,
	.say = say,
	.get_raw = get_raw,
	.get_int = get_int,
	.get = get,
	.is_good = is_good,
	.set = set,
	.set_raw = set_raw,
	.release = release,
};
