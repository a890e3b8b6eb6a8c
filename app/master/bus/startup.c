/* SPDX-License-Identifier: MIT */
/*
 * Start-up SDOs, written in the transitions of the state machine: IP when PRE-OP is reached, PS
 * before SAFE-OP, SO before OP, OS before OP is left. Each is compared with the slave's dictionary
 * first, where it has one that answers.
 */
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "base/bytes.h"
#include "bus/bus_internal.h"
#include "config/sdo_value.h"
#include "image/entry.h"
#include "wire/coe_type.h"
#include "wire/sdo_abort.h"

static struct bus_startup *startup_of(struct bus *bus, size_t pos)
{
	return &bus->slave[pos].startup;
}

static int can_ask(const struct bus *bus, const struct startup_command *command)
{
	return !command->is_complete && command->type != CONFIG_SDO_OCTETS &&
	       (bus->soem_slave[soem_index(command->slave_pos)].CoEdetails & ECT_COEDET_SDOINFO) !=
		       0;
}

/* --- one after the other --- */

static void submit(struct bus *bus, size_t pos)
{
	struct bus_startup *su = startup_of(bus, pos);
	int r = bus_mailbox_submit(bus, &su->request);

	if (r < 0) {
		su->request.result = r;
		su->request.is_mailbox_error = 0;
		su->state = STARTUP_FAILED;
	}
}

static void ask(struct bus *bus, size_t pos)
{
	struct bus_startup *su = startup_of(bus, pos);

	su->is_asking = 1;
	su->request.buffer = su->description;
	su->request.capacity = sizeof(su->description);
	su->request.with.coe = (struct coe_parameters){ .operation = COE_ENTRY,
							.index = su->command->index,
							.subindex = su->command->subindex };
	submit(bus, pos);
}

static void write_value(struct bus *bus, size_t pos)
{
	struct bus_startup *su = startup_of(bus, pos);
	const struct startup_command *command = su->command;

	su->is_asking = 0;
	put_le64(su->data, command->value);
	/* a download only reads it */
	su->request.buffer =
		command->octets != NULL ? (uint8_t *)(uintptr_t)command->octets : su->data;
	su->request.capacity = command->len;
	su->request.with.coe =
		(struct coe_parameters){ .operation = COE_DOWNLOAD,
					 .access = command->is_complete ? COE_ACCESS_COMPLETE
									: COE_ACCESS_SINGLE,
					 .index = command->index,
					 .subindex = command->subindex };
	submit(bus, pos);
}

static int is_for(const struct startup_command *command, size_t pos,
		  enum config_transition transition)
{
	return command->slave_pos == pos && command->transition == transition;
}

static void go_on(struct bus *bus, size_t pos)
{
	struct bus_startup *su = startup_of(bus, pos);

	while (su->next < bus->startup_count &&
	       !is_for(&bus->startup[su->next], pos, su->transition)) {
		su->next++;
	}
	if (su->next == bus->startup_count) {
		su->state = STARTUP_DONE;
		su->trouble[0] = '\0';
		return;
	}
	su->command = &bus->startup[su->next++];
	if (can_ask(bus, su->command)) {
		ask(bus, pos);
	} else if (su->command->type == CONFIG_SDO_AUTO) {
		snprintf(su->untyped, sizeof(su->untyped),
			 "it has no object dictionary: give a type");
		su->state = STARTUP_FAILED;
	} else {
		write_value(bus, pos);
	}
}

static const char *why(const struct mailbox_request *rq)
{
	return rq->is_mailbox_error       ? mailbox_error_to_str(rq->detail)
	       : rq->result == -EREMOTEIO ? sdo_abort_to_str(rq->detail)
	       : rq->result == -ENOTSUP   ? "the slave has no CoE mailbox"
	       : rq->result == -ETIMEDOUT ? "no answer from its mailbox"
					  : strerror(-rq->result);
}

/* A value without a type has that of the dictionary from now on. */
static void take_type(struct bus *bus, size_t pos)
{
	struct bus_startup *su = startup_of(bus, pos);
	struct coe_entry entry;

	if (su->request.result < 0 || coe_entry_get(su->description, su->request.len, &entry) < 0) {
		snprintf(su->untyped, sizeof(su->untyped),
			 "no type in its object dictionary (%s): give a type",
			 su->request.result < 0 ? why(&su->request) : "malformed answer");
	} else if (startup_resolve(su->command, &entry, su->untyped, sizeof(su->untyped)) == 0) {
		write_value(bus, pos);
		return;
	}
	su->state = STARTUP_FAILED;
}

/* The description is there, or the slave gives none: then the slave's own answer to the write
 * counts alone. */
static void take_description(struct bus *bus, size_t pos)
{
	struct bus_startup *su = startup_of(bus, pos);
	struct coe_entry entry;

	if (su->request.result == -ECANCELED || su->request.result == -ENODEV) {
		su->state = STARTUP_FAILED;
	} else if (su->command->type == CONFIG_SDO_AUTO) {
		take_type(bus, pos);
	} else if (su->request.result == 0 &&
		   coe_entry_get(su->description, su->request.len, &entry) == 0 &&
		   !startup_fits(su->command, &entry)) {
		su->found_type = entry.data_type;
		su->found_bits = entry.bit_len;
		su->state = STARTUP_FAILED;
	} else {
		write_value(bus, pos);
	}
}

static void request_done(void *ctx, struct mailbox_request *rq)
{
	struct bus *bus = ctx;
	struct bus_startup *su = startup_of(bus, rq->slave_pos);

	if (su->is_asking) {
		take_description(bus, rq->slave_pos);
	} else if (rq->result < 0) {
		su->state = STARTUP_FAILED;
	} else {
		go_on(bus, rq->slave_pos);
	}
}

static int has_wrong_mode(const struct bus_slave *sl)
{
	return sl->mode != CONFIG_MODE_UNSET && !slave_is_piccolo(&sl->info);
}

void bus_startup_begin(struct bus *bus, size_t pos, enum config_transition transition)
{
	struct bus_startup *su = startup_of(bus, pos);

	bus_startup_cancel(bus, pos);
	su->state = STARTUP_RUNNING;
	su->transition = transition;
	su->next = 0;
	su->command = NULL;
	su->is_asking = 0;
	su->found_bits = 0;
	su->untyped[0] = '\0';
	su->request = (struct mailbox_request){ .protocol = &coe_protocol,
						.slave_pos = (uint16_t)pos,
						.done = request_done,
						.ctx = bus };
	if (transition == CONFIG_TRANSITION_PS && has_wrong_mode(&bus->slave[pos])) {
		su->state = STARTUP_FAILED;
		su->request.result = -ENOTSUP;
		return;
	}
	go_on(bus, pos);
}

void bus_startup_cancel(struct bus *bus, size_t pos)
{
	struct bus_startup *su = startup_of(bus, pos);

	if (mailbox_is_running(&su->request)) {
		mailbox_cancel(bus->mailbox, &su->request);
	}
	su->state = STARTUP_IDLE;
}

/* --- failures --- */

/* "start-up SDO 0x8000:01 at PS = 0x7 (ecdaq.yaml:12)" */
static void name_command(const struct bus *bus, const struct startup_command *command, char *text,
			 size_t text_bytes)
{
	char value[32] = "";
	char where[CONFIG_PATH_BYTES + 16];

	if (command->octets == NULL) {
		snprintf(value, sizeof(value), " = 0x%" PRIx64, command->value);
	}
	snprintf(where, sizeof(where), "%s:%d", bus->cfg->path, command->line);
	if (command->origin == STARTUP_OF_ESI) {
		snprintf(where, sizeof(where), "InitCmd of its ESI description");
	}
	if (command->origin == STARTUP_OF_PDOS) {
		snprintf(text, text_bytes, "PDO %s: SDO 0x%04x:%02x%s (%s)", command->pdo,
			 command->index, command->subindex, value, where);
		return;
	}
	snprintf(text, text_bytes, "start-up SDO 0x%04x:%02x at %s%s (%s)", command->index,
		 command->subindex, config_transition_to_str(command->transition), value, where);
}

static int fail_mismatch(struct bus *bus, size_t pos, const char *name)
{
	const struct bus_startup *su = startup_of(bus, pos);
	const char *found = coe_type_name(su->found_type);
	char type[16];

	snprintf(type, sizeof(type), "type 0x%04x", su->found_type);
	return bus_fail_slave(bus, pos, -EPROTO,
			      "%s: the configuration has %s, its dictionary %s of %u bits", name,
			      su->command->type == CONFIG_SDO_STRING
				      ? "a STRING"
				      : sdo_type_to_str((enum sdo_type)su->command->type),
			      found != NULL ? found : type, su->found_bits);
}

static int fail_startup(struct bus *bus, size_t pos)
{
	const struct bus_slave *sl = &bus->slave[pos];
	const struct startup_command *command = sl->startup.command;
	const struct mailbox_request *rq = &sl->startup.request;
	char name[CONFIG_PATH_BYTES + 128];

	if (has_wrong_mode(sl)) {
		return bus_fail_slave(
			bus, pos, -ENOTSUP,
			"mode is an option of the FB1111-Piccolo; this is vendor 0x%08x "
			"product 0x%08x",
			sl->info.vendor, sl->info.product);
	}
	name_command(bus, command, name, sizeof(name));
	if (sl->startup.untyped[0] != '\0') {
		return bus_fail_slave(bus, pos, -EPROTO, "%s: %s", name, sl->startup.untyped);
	}
	if (sl->startup.found_bits != 0) {
		return fail_mismatch(bus, pos, name);
	}
	if (rq->result == -EREMOTEIO && !rq->is_mailbox_error) {
		bus_tell_abort(bus, pos, command->index, command->subindex, rq->detail);
		return bus_fail_slave(bus, pos, -EPROTO, "%s rejected: abort 0x%08x, %s", name,
				      rq->detail, sdo_abort_to_str(rq->detail));
	}
	return bus_fail_slave(bus, pos, rq->result, "%s: %s", name, why(rq));
}

int bus_startup_poll(struct bus *bus, size_t pos, enum config_transition transition)
{
	struct bus_startup *su = startup_of(bus, pos);
	enum startup_state state;

	if (su->state == STARTUP_IDLE || su->transition != transition) {
		bus_startup_begin(bus, pos, transition);
	}
	state = su->state;
	if (state == STARTUP_RUNNING) {
		return 1;
	}
	su->state = STARTUP_IDLE;
	return state == STARTUP_FAILED ? fail_startup(bus, pos) : 0;
}

/* --- all slaves --- */

int bus_startup_all(struct bus *bus, enum config_transition transition)
{
	int r;

	for (size_t i = 0; i < bus->slave_count; i++) {
		bus_startup_begin(bus, i, transition);
	}
	r = mailbox_wait_all(bus->mailbox);
	for (size_t i = 0; i < bus->slave_count && r >= 0; i++) {
		r = bus_startup_poll(bus, i, transition);
	}
	for (size_t i = 0; i < bus->slave_count && r < 0; i++) {
		bus_startup_cancel(bus, i);
	}
	return r;
}

int bus_startup(struct bus *bus, enum config_transition transition, char *error)
{
	bus->error = error;
	return bus_startup_all(bus, transition);
}

int bus_has_startup(const struct bus *bus, enum config_transition transition)
{
	for (size_t i = 0; i < bus->startup_count; i++) {
		if (bus->startup[i].transition == transition) {
			return 1;
		}
	}
	return 0;
}

static int is_any_running(const struct bus *bus)
{
	for (size_t i = 0; i < bus->slave_count; i++) {
		if (bus->slave[i].startup.state == STARTUP_RUNNING) {
			return 1;
		}
	}
	return 0;
}

/* What has not ended on the way down is given up. */
static int end_down(struct bus *bus, size_t pos)
{
	struct bus_startup *su = startup_of(bus, pos);

	if (su->state == STARTUP_IDLE) {
		return 0;
	}
	if (mailbox_is_running(&su->request)) {
		mailbox_cancel(bus->mailbox, &su->request);
		su->request.result = -ETIMEDOUT;
	}
	return bus_startup_poll(bus, pos, CONFIG_TRANSITION_OS);
}

int bus_startup_down(struct bus *bus, char *error)
{
	mono_t give_up = mono_add(bus_now(bus), (span_t){ BUS_STARTUP_DOWN_NS });
	int first = 0;

	for (size_t i = 0; i < bus->slave_count; i++) {
		bus_startup_cancel(bus, i);
		if ((bus->slave[i].al_status & AL_STATE_MASK) == AL_OP && !bus->slave[i].is_lost) {
			bus_startup_begin(bus, i, CONFIG_TRANSITION_OS);
		}
	}
	while (is_any_running(bus) && bus_now(bus).ns < give_up.ns) {
		mailbox_step(bus->mailbox);
		if (line_sleep(bus->line, (span_t){ NS_PER_MS / 4 }) < 0) {
			break;
		}
	}
	for (size_t i = 0; i < bus->slave_count; i++) {
		int r;

		bus->error = first < 0 ? NULL : error;
		r = end_down(bus, i);
		first = first < 0 ? first : r;
	}
	return first;
}
