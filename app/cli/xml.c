/* SPDX-License-Identifier: MIT */
/* ecdaq xml: an ESI file of the slaves that are there, from their SII and CoE. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/args.h"
#include "base/utf8.h"
#include "cli/cli.h"
#include "cli/each_slave.h"
#include "cli/file.h"
#include "cli/pdo_info.h"
#include "cli/source.h"
#include "esi/esi.h"
#include "wire/coe_type.h"
#include "wire/sii.h"

struct xml_command {
	struct cli *cli;
	const struct status_page *page;
	const char *path; /* NULL: standard output */
	struct esi_device *device[LIMIT_SLAVES];
	size_t count;
};

static void take_text(const struct pdo_info *info, unsigned number, char ret_text[ESI_NAME_BYTES])
{
	char text[SII_NAME_BYTES];

	sii_text(info->image, info->image_bytes, number, text);
	utf8_copy(text, ret_text, ESI_NAME_BYTES);
}

static void take_mailbox(const struct sii *sii, struct esi_device *d)
{
	static const uint8_t flags[] = { 0,
					 ESI_COE_SDO_INFO,
					 ESI_COE_PDO_ASSIGN,
					 ESI_COE_PDO_CONFIG,
					 ESI_COE_PDO_UPLOAD,
					 ESI_COE_COMPLETE_ACCESS }; /* by bit of the SII */

	d->protocols = (uint8_t)sii->mailbox_protocols;
	d->has_mailbox = d->protocols != 0;
	for (unsigned i = 0; i < sizeof(flags); i++) {
		if ((sii->coe_details & 1u << i) != 0) {
			d->coe |= flags[i];
		}
	}
}

static void take_clocks(const struct pdo_info *info, struct esi_device *d)
{
	for (size_t i = 0; i < info->sii.dc_mode_count && i < ESI_LIMIT_DC_MODES; i++) {
		const struct sii_dc_mode *from = &info->sii.dc_mode[i];
		struct esi_dc_mode *mode = &d->dc[d->dc_count++];

		*mode = (struct esi_dc_mode){ .assign_activate = from->assign_activate,
					      .sync0_cycle_ns = from->sync0_cycle_ns,
					      .sync0_factor = from->sync0_factor,
					      .sync0_shift_ns = from->sync0_shift_ns,
					      .sync1_factor = from->sync1_factor,
					      .sync1_shift_ns = from->sync1_shift_ns };
		take_text(info, from->name, mode->name);
	}
}

static void take_sms(const struct sii *sii, struct esi_device *d)
{
	for (size_t i = 0; i < sii->fmmu_count && i < ESI_LIMIT_FMMU; i++) {
		if (sii->fmmu[i] >= 1 && sii->fmmu[i] <= 3) {
			d->fmmu[d->fmmu_count++] = sii->fmmu[i];
		}
	}
	for (size_t i = 0; i < sii->sm_count && i < ESI_LIMIT_SM; i++) {
		const struct sii_sm *sm = &sii->sm[i];

		d->sm[d->sm_count++] = (struct esi_sm){ .type = sm->type,
							.control = sm->control,
							.enable = sm->enable,
							.start = sm->start,
							.bytes = sm->len };
	}
}

static void take_pdo(const struct pdo_info *info, const struct pdo_info_pdo *from,
		     struct esi_device *d)
{
	struct esi_pdo *pdo = &d->pdo[d->pdo_count++];

	*pdo = (struct esi_pdo){ .index = from->index,
				 .sm = from->is_assigned ? (int8_t)from->sm : ESI_NO_SM,
				 .is_tx = from->is_tx,
				 .first = d->entry_count,
				 .count = from->count,
				 .bits = from->bits };
	utf8_copy(from->name, pdo->name, sizeof(pdo->name));
	for (size_t i = 0; i < from->count; i++) {
		const struct pdo_info_entry *e = &info->entry[from->first + i];
		struct esi_entry *entry = &d->entry[d->entry_count++];
		const char *type = coe_type_name(e->type);

		*entry = (struct esi_entry){
			.index = e->index, .subindex = e->subindex, .bits = e->bits, .type = e->type
		};
		if (e->index != 0) {
			utf8_copy(e->name, entry->name, sizeof(entry->name));
			snprintf(entry->type_name, sizeof(entry->type_name), "%s",
				 type == NULL ? "" : type);
		}
	}
}

static struct esi_device *describe(const struct pdo_info *info)
{
	struct esi_device *d = calloc(1, sizeof(*d));
	size_t entries = 0;

	for (size_t i = 0; i < info->pdo_count; i++) {
		entries += info->pdo[i].count;
	}
	if (d == NULL) {
		return NULL;
	}
	d->pdo = calloc(info->pdo_count + 1, sizeof(*d->pdo));
	d->entry = calloc(entries + 1, sizeof(*d->entry));
	if (d->pdo == NULL || d->entry == NULL) {
		esi_device_free(d);
		return NULL;
	}
	d->id = (struct esi_identity){ .kind = ESI_DEVICE,
				       .vendor = info->sii.vendor,
				       .product = info->sii.product,
				       .revision = info->sii.revision };
	take_text(info, info->sii.order_name, d->type);
	take_text(info, info->sii.device_name, d->name);
	take_text(info, info->sii.group_name, d->group);
	memcpy(d->group_name, d->group, sizeof(d->group_name));
	d->eeprom_bytes = info->sii.size_bytes;
	pdo_info_ports(info, d->physics);
	take_sms(&info->sii, d);
	for (size_t i = 0; i < info->pdo_count; i++) {
		take_pdo(info, &info->pdo[i], d);
	}
	take_mailbox(&info->sii, d);
	take_clocks(info, d);
	return d;
}

static enum exit_code add_slave(void *ctx, uint16_t pos)
{
	struct xml_command *cmd = ctx;
	struct pdo_info *info;
	enum exit_code result = pdo_info_read(cmd->cli, pos, &info);

	if (result != EXIT_CODE_OK) {
		return result;
	}
	pdo_info_warn(cmd->cli, pos, info);
	if (info->damage[0] != '\0') {
		result = cli_fail(cmd->cli, EXIT_CODE_FAILED, "slave %u: its SII is damaged: %s",
				  pos, info->damage);
	} else if (cmd->count == LIMIT_SLAVES) {
		result = cli_fail(cmd->cli, EXIT_CODE_USAGE, "more than %d slaves", LIMIT_SLAVES);
	} else {
		cmd->device[cmd->count] = describe(info);
		if (cmd->device[cmd->count] == NULL) {
			result = cli_fail(cmd->cli, EXIT_CODE_FAILED, "out of memory");
		} else {
			cmd->count++;
		}
	}
	pdo_info_free(info);
	return result;
}

static enum exit_code write_out(const struct xml_command *cmd)
{
	enum exit_code result = EXIT_CODE_OK;
	char *text = NULL;
	size_t len = 0;
	FILE *out = cmd->path == NULL ? stdout : open_memstream(&text, &len);

	if (out == NULL) {
		return cli_fail(cmd->cli, EXIT_CODE_FAILED, "out of memory");
	}
	esi_write(out, (const struct esi_device *const *)cmd->device, cmd->count);
	if (cmd->path == NULL) {
		return result;
	}
	if (fclose(out) != 0) {
		result = cli_fail(cmd->cli, EXIT_CODE_FAILED, "out of memory");
	} else {
		result = file_write(cmd->cli, cmd->path, (const uint8_t *)text, len);
	}
	free(text);
	return result;
}

enum exit_code verb_xml(struct cli *cli, int argc, char **argv)
{
	struct xml_command cmd = { .cli = cli };
	const struct args_option options[] = {
		{ "output", 'o', args_text, &cmd.path, "FILE", "write it to FILE" },
	};
	struct args args = { .options = options, .option_count = 1, .operands_max = 4096 };
	enum exit_code result;

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	result = source_status(cli, &cmd.page);
	if (result != EXIT_CODE_OK) {
		return result;
	}
	result = each_slave(cli, cmd.page, args.operands, args.operand_count, add_slave, &cmd);
	if (result == EXIT_CODE_OK && cmd.count == 0) {
		result = cli_fail(cli, EXIT_CODE_NO_SLAVE, "no slave was found");
	}
	if (result == EXIT_CODE_OK) {
		result = write_out(&cmd);
	}
	for (size_t i = 0; i < cmd.count; i++) {
		esi_device_free(cmd.device[i]);
	}
	source_status_close(cmd.page);
	return result;
}
