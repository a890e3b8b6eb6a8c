/* SPDX-License-Identifier: MIT */
#include "publish/gate.h"

#include <errno.h>
#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "config/output.h"
#include "image/image.h"
#include "publish/domain.h"

struct commander {
	uint64_t sender; /* 0: free */
	uint64_t last_id;
	int has_id;
	int has_answer;            /* to last_id */
	struct gate_answer answer; /* ditto */
	int is_gone;               /* its entry may be reused */
	double tokens;             /* token bucket: commands allowed now */
	int64_t refilled_ns;
};

struct gate {
	const struct config *cfg;
	struct commander commander[GATE_COMMANDERS];
	uint64_t setter[BOARD_OUTPUTS];
};

struct gate *gate_create(const struct config *cfg)
{
	struct gate *gate = calloc(1, sizeof(*gate));

	if (gate != NULL) {
		gate->cfg = cfg;
	}
	return gate;
}

void gate_destroy(struct gate *gate)
{
	free(gate);
}

__attribute__((format(printf, 3, 4))) static int refuse(char *reason, int error, const char *format,
							...)
{
	va_list args;

	va_start(args, format);
	vsnprintf(reason, GATE_REASON_BYTES, format, args);
	va_end(args);
	return error;
}

int64_t gate_lease_ns(const struct config *cfg)
{
	int64_t lease_ns = NS_PER_S;

	for (size_t i = 0; i < cfg->output_count; i++) {
		int64_t half_ns = cfg->output[i].timeout_ns / 2;

		if (half_ns > 0 && half_ns < lease_ns) {
			lease_ns = half_ns;
		}
	}
	return lease_ns < 20 * NS_PER_MS ? 20 * NS_PER_MS : lease_ns;
}

static struct commander *find(struct gate *gate, uint64_t sender)
{
	for (size_t i = 0; i < GATE_COMMANDERS; i++) {
		if (gate->commander[i].sender == sender) {
			return &gate->commander[i];
		}
	}
	return NULL;
}

static struct commander *find_gone(struct gate *gate)
{
	for (size_t i = 0; i < GATE_COMMANDERS; i++) {
		if (gate->commander[i].is_gone) {
			return &gate->commander[i];
		}
	}
	return NULL;
}

static struct commander *admit(struct gate *gate, uint64_t sender, int64_t now_ns)
{
	struct commander *c = find(gate, sender);

	if (c == NULL) {
		c = find(gate, 0);
		c = c != NULL ? c : find_gone(gate);
		if (c != NULL) {
			*c = (struct commander){ .sender = sender,
						 .tokens = gate->cfg->dds_command_rate,
						 .refilled_ns = now_ns };
		}
	}
	if (c != NULL) {
		c->is_gone = 0;
	}
	return c;
}

void gate_remove(struct gate *gate, uint64_t sender)
{
	struct commander *c = sender == 0 ? NULL : find(gate, sender);

	if (c != NULL) {
		c->is_gone = 1;
	}
	for (unsigned i = 0; i < BOARD_OUTPUTS; i++) {
		if (gate->setter[i] == sender) {
			gate->setter[i] = 0;
		}
	}
}

void gate_note_set(struct gate *gate, unsigned output, uint64_t sender)
{
	gate->setter[output] = sender;
}

uint64_t gate_setter(const struct gate *gate, unsigned output)
{
	return gate->setter[output];
}

void gate_note_answer(struct gate *gate, uint64_t sender, uint64_t id,
		      const struct gate_answer *answer)
{
	struct commander *c = sender == 0 ? NULL : find(gate, sender);

	if (c != NULL && c->has_id && c->last_id == id) {
		c->answer = *answer;
		c->has_answer = 1;
	}
}

const struct gate_answer *gate_find_answer(struct gate *gate, uint64_t sender, uint64_t id)
{
	struct commander *c = sender == 0 ? NULL : find(gate, sender);

	return c != NULL && c->has_answer && c->last_id == id ? &c->answer : NULL;
}

void gate_forget_answers(struct gate *gate)
{
	for (size_t i = 0; i < GATE_COMMANDERS; i++) {
		gate->commander[i].has_answer = 0;
	}
}

/* Token bucket of one second of @rate. */
static int exceeds_rate(struct commander *c, uint32_t rate, int64_t now_ns)
{
	c->tokens += (double)(now_ns - c->refilled_ns) * rate / 1e9;
	c->refilled_ns = now_ns;
	if (c->tokens > rate) {
		c->tokens = rate;
	}
	if (c->tokens < 1) {
		return 1;
	}
	c->tokens -= 1;
	return 0;
}

static int check_order(struct commander *c, const struct gate_command *cmd,
		       const struct gate_view *view, char *reason)
{
	if (c->has_id && cmd->id == c->last_id) {
		return refuse(reason, -EALREADY, "id %" PRIu64 " was used before: duplicate",
			      cmd->id);
	}
	if (c->has_id && cmd->id < c->last_id) {
		return refuse(reason, -ESTALE, "id %" PRIu64 " is older than %" PRIu64 ": stale",
			      cmd->id, c->last_id);
	}
	c->has_id = 1;
	c->last_id = cmd->id;
	c->has_answer = 0;
	if (cmd->session != 0 && cmd->session != view->table->meta.session) {
		return refuse(reason, -ESTALE,
			      "for session %" PRIu64 ", not the current one: stale", cmd->session);
	}
	if (cmd->not_after_cycle != 0 && view->cycle >= cmd->not_after_cycle) {
		return refuse(reason, -ESTALE,
			      "not after cycle %" PRIu64 ", now %" PRIu64 ": stale",
			      cmd->not_after_cycle, view->cycle);
	}
	return 0;
}

static int check_item(const struct gate *gate, const struct gate_command *cmd, uint32_t i,
		      const struct channel_table *table, struct gate_item *ret_item, char *reason)
{
	int index = image_channel_find(table->channels, table->meta.channel_count, cmd->channel[i]);
	const struct channel *ch;
	struct gate_item item;
	char type[16];
	int r;

	if (index < 0) {
		return refuse(reason, -ENOENT, "%.*s: no such channel", GATE_NAME_BYTES,
			      cmd->channel[i]);
	}
	ch = &table->channels[index];
	item.output = config_output_index(table->channels, (size_t)index);
	if (item.output >= BOARD_OUTPUTS) {
		return refuse(reason, -ENOENT, "%s: more than %d outputs", ch->name, BOARD_OUTPUTS);
	}
	item.raw = cmd->is_raw ? cmd->raw[i] : 0;
	r = cmd->is_raw ? 0 : image_physical_to_raw(ch, cmd->values[i], &item.raw);
	if (r == -EINVAL) {
		image_type_format(ch, type, sizeof(type));
		return refuse(reason, r, "%s: %g is not a value of type %s", ch->name,
			      cmd->values[i], type);
	}
	if (r < 0) {
		return refuse(reason, r, "%s: %g is outside the range of the channel", ch->name,
			      cmd->values[i]);
	}
	r = config_output_check(gate->cfg, ch, CONFIG_OWNER_REMOTE, item.raw, reason,
				GATE_REASON_BYTES);
	if (r == 0) {
		*ret_item = item;
	}
	return r;
}

static int check_shape(const struct gate_command *cmd, char *reason)
{
	if (cmd->count == 0 || cmd->count > GATE_ITEMS) {
		return refuse(reason, -EINVAL, "%u channels in one command: expected 1 to %d",
			      cmd->count, GATE_ITEMS);
	}
	if ((cmd->is_raw ? cmd->raw_count : cmd->value_count) != cmd->count) {
		return refuse(reason, -EINVAL, "%u channels and %u %s", cmd->count,
			      cmd->is_raw ? cmd->raw_count : cmd->value_count,
			      cmd->is_raw ? "raw" : "values");
	}
	for (uint32_t i = 0; i < cmd->count; i++) {
		if (cmd->channel[i] == NULL) {
			return refuse(reason, -EINVAL, "channel without a name");
		}
		for (uint32_t j = 0; j < i; j++) {
			if (strcmp(cmd->channel[i], cmd->channel[j]) == 0) {
				return refuse(reason, -EINVAL, "%.*s: listed twice",
					      GATE_NAME_BYTES, cmd->channel[i]);
			}
		}
	}
	return 0;
}

int gate_check(struct gate *gate, const struct gate_command *cmd, const struct gate_view *view,
	       struct gate_item *ret_items, char *reason)
{
	struct commander *commander;
	int r;

	if (!domain_takes_commands(gate->cfg)) {
		return refuse(
			reason, -EPERM,
			"commands are disabled without DDS Security (dds.allow_insecure_commands)");
	}
	commander = admit(gate, cmd->sender, view->now_ns);
	if (commander == NULL) {
		return refuse(reason, -EUSERS, "more than %d commanders", GATE_COMMANDERS);
	}
	if (exceeds_rate(commander, gate->cfg->dds_command_rate, view->now_ns)) {
		return refuse(reason, -EAGAIN,
			      "more than %u commands per second (dds.command_rate)",
			      gate->cfg->dds_command_rate);
	}
	r = check_shape(cmd, reason);
	if (r < 0) {
		return r;
	}
	if (view->table == NULL || !view->is_op) {
		return refuse(reason, -EAGAIN, "the bus is not in OP");
	}
	r = check_order(commander, cmd, view, reason);
	for (uint32_t i = 0; r == 0 && i < cmd->count; i++) {
		r = check_item(gate, cmd, i, view->table, &ret_items[i], reason);
	}
	return r;
}

int gate_has_timeout(const struct channel_table *table, const struct config *cfg, unsigned output)
{
	unsigned n = 0;

	for (uint32_t i = 0; i < table->meta.channel_count; i++) {
		if (table->channels[i].direction == CHANNEL_OUTPUT && n++ == output) {
			const struct config_output *rules =
				config_output_find(cfg, table->channels[i].name);

			return rules != NULL && rules->timeout_ns > 0;
		}
	}
	return 0;
}
