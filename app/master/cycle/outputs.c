/* SPDX-License-Identifier: MIT */
#include "cycle/outputs.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/slave_set.h"
#include "image/image.h"

static const enum cycle_writer writer_of[] = {
	[CONFIG_OWNER_LOCAL] = CYCLE_WRITER_LOCAL,
	[CONFIG_OWNER_PROGRAM] = CYCLE_WRITER_PROGRAM,
	[CONFIG_OWNER_REMOTE] = CYCLE_WRITER_REMOTE,
};

static int refuse(char *error, size_t error_bytes, const struct config *cfg,
		  const struct config_output *wanted, const char *why)
{
	snprintf(error, error_bytes, "%s:%d: outputs: %s: %s",
		 cfg->path[0] != '\0' ? cfg->path : "configuration", wanted->line, wanted->channel,
		 why);
	return -EINVAL;
}

static struct output *find(struct outputs *outputs, const char *name)
{
	for (size_t i = 0; i < outputs->output_count; i++) {
		if (strncmp(outputs->output[i].channel->name, name, LIMIT_NAME_BYTES) == 0) {
			return &outputs->output[i];
		}
	}
	return NULL;
}

static int configure(struct outputs *outputs, const struct cycle_spec *spec,
		     const struct config_output *wanted, char *error, size_t error_bytes)
{
	struct output *out = find(outputs, wanted->channel);

	if (out == NULL) {
		return refuse(error, error_bytes, spec->cfg, wanted, "no such output channel");
	}
	if (image_physical_to_raw(out->channel, wanted->fail_safe, &out->fail_safe_raw) < 0) {
		return refuse(error, error_bytes, spec->cfg, wanted,
			      "the channel cannot hold its fail_safe value");
	}
	if ((isfinite(wanted->min) &&
	     image_physical_to_raw(out->channel, wanted->min, &out->min_raw) == -EINVAL) ||
	    (isfinite(wanted->max) &&
	     image_physical_to_raw(out->channel, wanted->max, &out->max_raw) == -EINVAL)) {
		return refuse(error, error_bytes, spec->cfg, wanted,
			      "min and max of a BOOL are 0 and 1");
	}
	out->min = wanted->min;
	out->max = wanted->max;
	/* A limit the channel cannot reach is none. */
	if (image_physical_to_raw(out->channel, wanted->min, &out->min_raw) < 0) {
		out->min = -INFINITY;
	}
	if (image_physical_to_raw(out->channel, wanted->max, &out->max_raw) < 0) {
		out->max = INFINITY;
	}
	out->owner = writer_of[wanted->owner];
	/* Rounded up: a timeout below a period is a period, not none. */
	out->timeout_cycles = (uint64_t)((wanted->timeout_ns + spec->cfg->cycle_period_ns - 1) /
					 spec->cfg->cycle_period_ns);
	return 0;
}

int outputs_init(struct outputs *outputs, const struct cycle_spec *spec, char *error,
		 size_t error_bytes)
{
	memset(outputs, 0, sizeof(*outputs));
	for (size_t i = 0; i < spec->channel_count; i++) {
		if (spec->channels[i].direction != CHANNEL_OUTPUT) {
			continue;
		}
		if (outputs->output_count == BOARD_OUTPUTS) {
			snprintf(error, error_bytes, "more than BOARD_OUTPUTS = %d output channels",
				 BOARD_OUTPUTS);
			return -E2BIG;
		}
		outputs->output[outputs->output_count++] = (struct output){
			.channel = &spec->channels[i],
			.owner = CYCLE_WRITER_LOCAL,
			.min = -INFINITY,
			.max = INFINITY,
		};
	}
	memcpy(outputs->board, spec->boards, sizeof(outputs->board));
	for (size_t i = 0; i < spec->cfg->output_count; i++) {
		int r = configure(outputs, spec, &spec->cfg->output[i], error, error_bytes);

		if (r < 0) {
			return r;
		}
	}
	return 0;
}

static void take_boards(struct outputs *outputs, uint64_t cycle)
{
	for (unsigned w = 0; w < CYCLE_WRITERS; w++) {
		struct board *board = outputs->board[w];
		uint64_t beat;
		int has_new_set;

		if (board == NULL) {
			continue;
		}
		beat = atomic_load_explicit(&board->beat, memory_order_relaxed);
		has_new_set = board_take(board, (unsigned)outputs->output_count, &outputs->set[w]);
		if (beat != outputs->beat[w] || has_new_set) {
			outputs->beat[w] = beat;
			outputs->alive_cycle[w] = cycle;
		}
	}
}

/* A NaN is in no range: neither comparison would stop it. */
static uint64_t limited(const struct output *out, uint64_t raw)
{
	double physical = image_raw_to_physical(out->channel, raw);

	if (isnan(physical)) {
		return out->fail_safe_raw;
	}
	if (physical < out->min) {
		return out->min_raw;
	}
	return physical > out->max ? out->max_raw : raw;
}

unsigned outputs_choose(struct outputs *outputs, uint8_t *image, const struct slave_set *live,
			uint64_t cycle)
{
	unsigned timed_out = 0;

	take_boards(outputs, cycle);
	for (size_t i = 0; i < outputs->output_count; i++) {
		const struct output *out = &outputs->output[i];
		const struct board_set *set = &outputs->set[out->owner];
		int is_silent = out->timeout_cycles > 0 &&
				cycle - outputs->alive_cycle[out->owner] > out->timeout_cycles;
		int is_wanted = set->is_set[i] && slave_set_has(live, out->channel->slave_pos);

		outputs->is_live[i] = (uint8_t)(is_wanted && !is_silent);
		timed_out += is_wanted && is_silent;
		image_set_raw(image, out->channel,
			      outputs->is_live[i] ? limited(out, set->raw[i]) : out->fail_safe_raw);
	}
	return timed_out;
}

/* Nothing of the newest set of @writer is missing in the slaves of @arrived. */
static int is_in_effect(const struct outputs *outputs, unsigned writer,
			const struct slave_set *arrived)
{
	const struct board_set *set = &outputs->set[writer];

	for (size_t i = 0; i < outputs->output_count; i++) {
		const struct output *out = &outputs->output[i];
		int is_newer = (int32_t)(set->put[i] - (uint32_t)outputs->answered[writer]) > 0;

		/* A withdrawn value is in effect by not being there. */
		if (out->owner == writer && is_newer && set->is_set[i] &&
		    !(outputs->is_live[i] && slave_set_has(arrived, out->channel->slave_pos))) {
			return 0;
		}
	}
	return 1;
}

void outputs_arrived(struct outputs *outputs, const struct slave_set *arrived, uint64_t cycle)
{
	if (slave_set_is_empty(arrived)) {
		return;
	}
	for (unsigned w = 0; w < CYCLE_WRITERS; w++) {
		uint64_t sequence = outputs->set[w].sequence;

		if (outputs->board[w] != NULL && sequence != outputs->answered[w] &&
		    is_in_effect(outputs, w, arrived)) {
			outputs->answered[w] = sequence;
			board_answer(outputs->board[w], sequence, cycle);
		}
	}
}
