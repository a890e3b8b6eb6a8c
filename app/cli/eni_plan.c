/* SPDX-License-Identifier: MIT */
#include "cli/eni_plan.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "cli/config_file.h"
#include "eni/fields.h"
#include "wire/al.h"
#include "wire/datagram.h"

/* --- commands of the master --- */

/* Broadcasts before the slaves have addresses (master/bus/enumerate.c), and before their clocks are
 * set (master/bus/dc.c). */
static int put_broadcasts(struct eni *eni)
{
	static const uint8_t zeros[48];
	static const uint8_t init[2] = { AL_INIT | AL_ERROR, 0 };
	static const struct {
		const char *comment;
		uint16_t reg;
		uint16_t len;
		const uint8_t *data;
	} rows[] = {
		{ "all ports as links are", ESC_REG_DL_CONTROL + 1, 1, zeros },
		{ "error counters to zero", ESC_REG_RX_ERROR_COUNTER, 8, zeros },
		{ "FMMUs off", ESC_REG_FMMU, 3 * ESC_FMMU_BYTES, zeros },
		{ "SyncManagers off", ESC_REG_SM, 4 * ESC_SM_BYTES, zeros },
		{ "SYNC units off", ESC_REG_DC_ACTIVATION, 1, zeros },
		{ "state INIT", ESC_REG_AL_CONTROL, 2, init },
	};

	for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
		struct eni_command *command = eni_add_init(eni, ENI_MASTER);

		if (command == NULL ||
		    eni_octets_set(&command->data, rows[i].data, rows[i].len) < 0) {
			return -1;
		}
		command->has |= ENI_HAS(ENI_INIT_TRANSITIONS) | ENI_HAS(ENI_INIT_COMMENT) |
				ENI_HAS(ENI_INIT_CMD) | ENI_HAS(ENI_INIT_ADP) |
				ENI_HAS(ENI_INIT_ADO) | ENI_HAS(ENI_INIT_DATA) |
				ENI_HAS(ENI_INIT_RETRIES);
		command->transitions = ENI_HAS(ENI_FROM_IP);
		snprintf(command->comment, sizeof(command->comment), "%s", rows[i].comment);
		command->cmd = ECAT_CMD_BWR;
		command->ado = rows[i].reg;
		command->retries = 3;
	}
	return 0;
}

static int put_master(const struct eni_plan *plan)
{
	struct eni *eni = plan->eni;

	snprintf(eni->master.name, sizeof(eni->master.name), "ecdaq");
	snprintf(eni->master.destination, sizeof(eni->master.destination), "ffffffffffff");
	snprintf(eni->master.source, sizeof(eni->master.source), "000000000000");
	snprintf(eni->master.ether_type, sizeof(eni->master.ether_type), "88a4");
	eni_has_all(ENI_NODE_MASTER_INFO, &eni->master, 0);
	return put_broadcasts(eni);
}

/* --- cyclic frames --- */

/* Process data are in the image where ecdaqd has them, in the inputs and in the outputs; what the
 * other datagrams carry is behind it. */
static int put_command(struct eni_plan *plan, const struct admin_datagram *dg, uint32_t *behind)
{
	uint32_t image = plan->samples.meta->image_bytes;
	struct eni_command *command = eni_add_cmd(plan->eni);
	uint32_t at = dg->address - plan->start;

	if (command == NULL) {
		return -1;
	}
	if (!datagram_is_logical(dg) || at >= image) {
		if (datagram_is_logical(dg)) {
			plan->eni->mailbox_states.start = dg->address;
			plan->eni->mailbox_states.count = dg->wkc_expected;
			eni_has_all(ENI_NODE_MAILBOX_STATES, &plan->eni->mailbox_states, 0);
		}
		at = *behind;
		*behind += dg->bytes;
	}
	eni_has_all(ENI_NODE_CMD, command,
		    ENI_HAS(ENI_CMD_COMMENT) | ENI_HAS(ENI_CMD_DATA) |
			    (datagram_is_logical(dg) ? ENI_HAS(ENI_CMD_ADP) | ENI_HAS(ENI_CMD_ADO)
						     : ENI_HAS(ENI_CMD_ADDR)) |
			    (dg->wkc_expected == ADMIN_WKC_UNKNOWN ? ENI_HAS(ENI_CMD_CNT) : 0));
	command->states = ENI_SAFEOP | ENI_OP;
	command->cmd = dg->command;
	if (datagram_is_logical(dg)) {
		command->addr = dg->address;
	} else {
		command->adp = dg->address & 0xffff;
		command->ado = dg->address >> 16;
	}
	command->data_len = dg->bytes;
	command->cnt = dg->wkc_expected == ADMIN_WKC_UNKNOWN ? 0 : dg->wkc_expected;
	command->input_offs = at;
	command->output_offs = at;
	return 0;
}

static int put_frames(struct eni_plan *plan, uint32_t *ret_bytes)
{
	struct eni_cyclic *cyclic = eni_add_cyclic(plan->eni);
	uint32_t behind = plan->samples.meta->image_bytes;

	if (cyclic == NULL) {
		return -1;
	}
	cyclic->cycle_us = (uint32_t)(plan->samples.meta->period_ns / NS_PER_US);
	cyclic->has |= ENI_HAS(ENI_CYCLIC_CYCLE);
	for (size_t i = 0; i < plan->list.count; i++) {
		const struct admin_datagram *dg = &plan->list.datagram[i];

		if ((i == 0 || dg->frame != plan->list.datagram[i - 1].frame) &&
		    eni_add_frame(plan->eni) == NULL) {
			return -1;
		}
		if (put_command(plan, dg, &behind) < 0) {
			return -1;
		}
	}
	*ret_bytes = behind;
	return 0;
}

/* --- process image --- */

static void put_type(const struct channel *ch, char *text, size_t bytes)
{
	static const char *const plain[] = { "USINT", "UINT", "UDINT", "ULINT" };
	static const char *const with_sign[] = { "SINT", "INT", "DINT", "LINT" };
	int n = ch->bit_len == 8 ? 0 : ch->bit_len == 16 ? 1 : ch->bit_len == 32 ? 2 : 3;
	int is_plain = n < 3 || ch->bit_len == 64;

	if (ch->type == CHANNEL_BOOL) {
		snprintf(text, bytes, "BOOL");
	} else if (ch->type == CHANNEL_FLOAT) {
		snprintf(text, bytes, "%s", ch->bit_len == 32 ? "REAL" : "LREAL");
	} else if (is_plain) {
		snprintf(text, bytes, "%s", (ch->type == CHANNEL_INT ? with_sign : plain)[n]);
	} else {
		snprintf(text, bytes, "BIT%u", ch->bit_len);
	}
}

static int put_variables(const struct eni_plan *plan, uint32_t is_output)
{
	for (uint32_t i = 0; i < plan->samples.meta->channel_count; i++) {
		const struct channel *ch = &plan->samples.channels[i];
		struct eni_variable *variable;

		if ((ch->direction == CHANNEL_OUTPUT) != (int)is_output) {
			continue;
		}
		variable = eni_add_variable(plan->eni, is_output);
		if (variable == NULL) {
			return -1;
		}
		xml_plain(ch->name, variable->name, sizeof(variable->name));
		put_type(ch, variable->type, sizeof(variable->type));
		variable->bits = ch->bit_len;
		variable->offset = ch->bit_offset;
		eni_has_all(ENI_NODE_VARIABLE, variable, ENI_HAS(1)); /* Comment */
	}
	return 0;
}

/* --- all --- */

static enum exit_code put_slaves(struct eni_plan *plan)
{
	enum exit_code result = EXIT_CODE_OK;

	for (uint32_t i = 0; i < source_slave_count(plan->page) && result == EXIT_CODE_OK; i++) {
		result = eni_plan_slave(plan, (uint16_t)i);
	}
	return result;
}

static enum exit_code put_all(struct eni_plan *plan)
{
	struct eni *eni = plan->eni;
	uint32_t bytes = 0;
	enum exit_code result;

	for (size_t i = plan->list.count; i > 0; i--) {
		if (datagram_is_logical(&plan->list.datagram[i - 1])) {
			plan->start = plan->list.datagram[i - 1].address;
		}
	}
	if (put_master(plan) < 0) {
		return cli_fail(plan->cli, EXIT_CODE_FAILED, "out of memory");
	}
	result = put_slaves(plan);
	if (result != EXIT_CODE_OK) {
		return result;
	}
	if (put_frames(plan, &bytes) < 0 || put_variables(plan, 0) < 0 ||
	    put_variables(plan, 1) < 0) {
		return cli_fail(plan->cli, EXIT_CODE_FAILED, "out of memory");
	}
	eni->inputs.bytes = bytes;
	eni->outputs.bytes = bytes;
	eni_has_all(ENI_NODE_INPUTS, &eni->inputs, 0);
	eni_has_all(ENI_NODE_OUTPUTS, &eni->outputs, 0);
	return EXIT_CODE_OK;
}

/* The configuration of the ecdaqd that is running. */
static enum exit_code read_config(struct eni_plan *plan, struct config *cfg)
{
	static struct config_file file; /* large */
	static const struct args_list none;
	char error[512];
	enum exit_code result = config_file_find(plan->cli, NULL, &none, &file);

	plan->cfg = cfg;
	if (result == EXIT_CODE_OK && config_assemble(file.path, file.set.item, file.set.count, cfg,
						      error, sizeof(error)) < 0) {
		result = cli_fail(plan->cli, EXIT_CODE_CONFIG, "%s", error);
	}
	return result;
}

static enum exit_code read_with_samples(struct eni_plan *plan)
{
	enum exit_code result = datagrams_read(plan->cli, &plan->list);

	if (result == EXIT_CODE_OK && plan->list.count == 0) {
		result = cli_fail(plan->cli, EXIT_CODE_STATE, "no cyclic frames: %s",
				  plan->list.why);
	}
	if (result == EXIT_CODE_OK && plan->samples.meta->session != plan->page->session) {
		result = cli_fail(plan->cli, EXIT_CODE_STATE,
				  "the samples are of an earlier session");
	}
	if (result == EXIT_CODE_OK) {
		result = put_all(plan);
	}
	datagrams_done(&plan->list);
	return result;
}

enum exit_code eni_plan_read(struct cli *cli, struct eni **ret_eni)
{
	static struct config cfg; /* large */
	struct eni_plan plan = { .cli = cli };
	enum exit_code result = source_status(cli, &plan.page);

	if (result != EXIT_CODE_OK) {
		return result;
	}
	plan.eni = calloc(1, sizeof(*plan.eni));
	result = plan.eni == NULL ? cli_fail(cli, EXIT_CODE_FAILED, "out of memory")
				  : read_config(&plan, &cfg);
	if (result == EXIT_CODE_OK) {
		result = samples_open(cli, &plan.samples);
	}
	if (result == EXIT_CODE_OK) {
		result = read_with_samples(&plan);
		samples_close(&plan.samples);
	}
	source_status_close(plan.page);
	if (result != EXIT_CODE_OK) {
		eni_free(plan.eni);
		return result;
	}
	*ret_eni = plan.eni;
	return EXIT_CODE_OK;
}
