/* SPDX-License-Identifier: MIT */
#include "cycle/outputs.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/slave_set.h"
#include "config/output.h"
#include "image/field.h"
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

static int configure(const struct channel *channel, const struct config *cfg,
		     const struct config_output *wanted, struct output_rules *rules,
		     const char **ret_why)
{
	if (image_physical_to_raw(channel, wanted->fail_safe, &rules->fail_safe_raw) < 0) {
		*ret_why = "the channel cannot hold its fail_safe value";
		return -EINVAL;
	}
	if ((isfinite(wanted->min) &&
	     image_physical_to_raw(channel, wanted->min, &rules->min_raw) == -EINVAL) ||
	    (isfinite(wanted->max) &&
	     image_physical_to_raw(channel, wanted->max, &rules->max_raw) == -EINVAL)) {
		*ret_why = "min and max of a BOOL are 0 and 1";
		return -EINVAL;
	}
	rules->min = wanted->min;
	rules->max = wanted->max;
	/* A limit the channel cannot reach is none. */
	if (image_physical_to_raw(channel, wanted->min, &rules->min_raw) < 0) {
		rules->min = -INFINITY;
	}
	if (image_physical_to_raw(channel, wanted->max, &rules->max_raw) < 0) {
		rules->max = INFINITY;
	}
	/* Rounded up: a timeout below a period is a period, not none. */
	rules->timeout_cycles =
		(uint64_t)((wanted->timeout_ns + cfg->cycle_period_ns - 1) / cfg->cycle_period_ns);
	return 0;
}

/* Not of integers without limits: limited() would return them as they are. */
static int needs_limits(const struct channel *channel, const struct output_rules *rules)
{
	return channel->type == CHANNEL_FLOAT || !isfinite(channel->scale) ||
	       !isfinite(channel->offset) || isfinite(rules->min) || isfinite(rules->max);
}

int outputs_rules_set(struct outputs *outputs, const struct config *cfg, char *error,
		      size_t error_bytes)
{
	struct outputs_rules *all = &outputs->rules;

	for (size_t i = 0; i < outputs->output_count; i++) {
		const struct channel *channel = outputs->output[i].channel;
		const struct config_output *wanted = config_output_find(cfg, channel->name);
		struct output_rules *rules = &all->of[all->filled][i];
		const char *why = "";

		*rules = (struct output_rules){ .min = -INFINITY, .max = INFINITY };
		if (wanted != NULL && configure(channel, cfg, wanted, rules, &why) < 0) {
			return refuse(error, error_bytes, cfg, wanted, why);
		}
		rules->has_limits = needs_limits(channel, rules);
	}
	all->filled = atomic_exchange_explicit(&all->spare, all->filled | OUTPUTS_RULES_NEW,
					       memory_order_acq_rel) &
		      ~OUTPUTS_RULES_NEW;
	return 0;
}

/* Those in force in this cycle. */
static const struct output_rules *take_rules(struct outputs_rules *all)
{
	if (atomic_load_explicit(&all->spare, memory_order_relaxed) & OUTPUTS_RULES_NEW) {
		all->taken =
			atomic_exchange_explicit(&all->spare, all->taken, memory_order_acq_rel) &
			~OUTPUTS_RULES_NEW;
	}
	return all->of[all->taken];
}

int outputs_init(struct outputs *outputs, const struct cycle_spec *spec, char *error,
		 size_t error_bytes)
{
	memset(outputs, 0, sizeof(*outputs));
	for (size_t i = 0; i < spec->channel_count; i++) {
		unsigned words = slave_set_words(spec->channels[i].slave_pos + 1u);

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
			.field = image_field_of(&spec->channels[i]),
			.slave_pos = spec->channels[i].slave_pos,
			.owner = CYCLE_WRITER_LOCAL,
		};
		outputs->set_words = words > outputs->set_words ? words : outputs->set_words;
	}
	memcpy(outputs->board, spec->boards, sizeof(outputs->board));
	outputs->rules.taken = 1;
	atomic_init(&outputs->rules.spare, 2);
	for (size_t i = 0; i < spec->cfg->output_count; i++) {
		const struct config_output *wanted = &spec->cfg->output[i];
		struct output *out = find(outputs, wanted->channel);

		if (out == NULL) {
			return refuse(error, error_bytes, spec->cfg, wanted,
				      "no such output channel");
		}
		out->owner = writer_of[wanted->owner];
	}
	return outputs_rules_set(outputs, spec->cfg, error, error_bytes);
}

/* 1 if there is a new set, or a sign of life while a writer is silent. */
static int take_boards(struct outputs *outputs, uint64_t cycle)
{
	int has_news = 0;

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
			has_news |= has_new_set || outputs->choice.is_any_silent;
		}
	}
	return has_news;
}

/* A NaN is in no range: neither comparison would stop it. */
static uint64_t limited(const struct channel *channel, const struct output_rules *rules,
			uint64_t raw)
{
	double physical = image_raw_to_physical(channel, raw);

	if (isnan(physical)) {
		return rules->fail_safe_raw;
	}
	if (physical < rules->min) {
		return rules->min_raw;
	}
	return physical > rules->max ? rules->max_raw : raw;
}

/* 1 if the owner of @out is silent in @cycle. If not, the choice holds until it may be. */
static int is_silent(const struct outputs *outputs, const struct output *out,
		     const struct output_rules *rules, uint64_t cycle,
		     struct outputs_choice *choice)
{
	uint64_t alive_cycle = outputs->alive_cycle[out->owner];

	if (rules->timeout_cycles == 0) {
		return 0;
	}
	if (cycle - alive_cycle > rules->timeout_cycles) {
		choice->is_any_silent = 1;
		return 1;
	}
	if (alive_cycle + rules->timeout_cycles + 1 < choice->next_timeout) {
		choice->next_timeout = alive_cycle + rules->timeout_cycles + 1;
	}
	return 0;
}

static struct outputs_choice choose(struct outputs *outputs, uint8_t *image,
				    const struct output_rules *in_force,
				    const struct slave_set *live, uint64_t cycle)
{
	struct outputs_choice choice = { .in_force = in_force,
					 .live = *live,
					 .next_timeout = UINT64_MAX };

	for (size_t i = 0; i < outputs->output_count; i++) {
		const struct output *out = &outputs->output[i];
		const struct output_rules *rules = &in_force[i];
		const struct board_set *set = &outputs->set[out->owner];
		int is_late = is_silent(outputs, out, rules, cycle, &choice);
		int is_wanted = set->is_set[i] && slave_set_has(live, out->slave_pos);
		uint64_t raw = rules->fail_safe_raw;

		outputs->is_live[i] = (uint8_t)(is_wanted && !is_late);
		choice.timed_out += is_wanted && is_late;
		if (outputs->is_live[i]) {
			raw = rules->has_limits ? limited(out->channel, rules, set->raw[i])
						: set->raw[i];
		}
		image_field_set(image, out->field, raw);
	}
	return choice;
}

unsigned outputs_choose(struct outputs *outputs, uint8_t *image, const struct slave_set *live,
			uint64_t cycle)
{
	const struct output_rules *in_force = take_rules(&outputs->rules);
	const struct outputs_choice *last = &outputs->choice;
	int has_news = take_boards(outputs, cycle);

	if (has_news || in_force != last->in_force || cycle >= last->next_timeout ||
	    slave_set_differs(live, &last->live, outputs->set_words)) {
		outputs->choice = choose(outputs, image, in_force, live, cycle);
	}
	return outputs->choice.timed_out;
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

int outputs_are_due(const struct outputs *outputs)
{
	for (unsigned w = 0; w < CYCLE_WRITERS; w++) {
		if (outputs->set[w].sequence != outputs->answered[w]) {
			return 1;
		}
	}
	return 0;
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
