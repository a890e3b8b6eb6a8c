/* SPDX-License-Identifier: MIT */
#include "cli/sii_show.h"

#include <stdio.h>
#include <stdlib.h>

#include "program/json.h"
#include "wire/sii.h"

enum { ERROR_BYTES = 160, PROTOCOLS_BYTES = 32 };

struct shown {
	const uint8_t *image;
	size_t len;
	struct sii sii;
};

static const char *protocols_of(uint16_t mask, char buf[PROTOCOLS_BYTES])
{
	static const char *const names[] = { "AoE", "EoE", "CoE", "FoE", "SoE", "VoE" };
	int used = 0;

	buf[0] = '\0';
	for (unsigned i = 0; i < sizeof(names) / sizeof(names[0]); i++) {
		if ((mask >> i & 1) != 0) {
			used += snprintf(buf + used, PROTOCOLS_BYTES - (size_t)used, "%s%s",
					 used > 0 ? " " : "", names[i]);
		}
	}
	return buf;
}

static const char *sm_type(uint8_t type)
{
	static const char *const names[] = { "-", "mailbox out", "mailbox in", "outputs",
					     "inputs" };

	return type < sizeof(names) / sizeof(names[0]) ? names[type] : "?";
}

static const char *fmmu_type(uint8_t type)
{
	static const char *const names[] = { "-", "outputs", "inputs", "mailbox state" };

	return type < sizeof(names) / sizeof(names[0]) ? names[type] : "-";
}

/* --- text --- */

static void show_text(const struct shown *s, const char *label, unsigned number)
{
	char text[SII_NAME_BYTES];

	sii_text(s->image, s->len, number, text);
	printf("%-14s %s\n", label, text[0] == '\0' ? "-" : text);
}

static void show_head(const struct shown *s)
{
	const struct sii *sii = &s->sii;
	char protocols[PROTOCOLS_BYTES];

	show_text(s, "name", sii->device_name);
	show_text(s, "order number", sii->order_name);
	show_text(s, "group", sii->group_name);
	printf("%-14s vendor 0x%08x, product 0x%08x, revision 0x%08x\n", "identity", sii->vendor,
	       sii->product, sii->revision);
	printf("%-14s %u\n%-14s %u\n", "serial", sii->serial, "alias", sii->alias);
	printf("%-14s %s\n", "checksum", sii_is_checksum_right(s->image) ? "right" : "WRONG");
	printf("%-14s %u bytes\n", "size", sii->size_bytes);
	printf("%-14s %d mA\n", "E-bus current", sii->ebus_ma);
	printf("%-14s %s\n", "mailbox",
	       sii->mailbox_protocols == 0 ? "none"
					   : protocols_of(sii->mailbox_protocols, protocols));
	if (sii->mailbox_out_len != 0) {
		printf("%-14s out 0x%04x, %u bytes; in 0x%04x, %u bytes\n", "",
		       sii->mailbox_out_start, sii->mailbox_out_len, sii->mailbox_in_start,
		       sii->mailbox_in_len);
	}
	if (sii->boot_out_len != 0) {
		printf("%-14s out 0x%04x, %u bytes; in 0x%04x, %u bytes\n", "BOOT mailbox",
		       sii->boot_out_start, sii->boot_out_len, sii->boot_in_start,
		       sii->boot_in_len);
	}
}

static void show_pdo(const struct shown *s, const struct sii_pdo *pdo)
{
	char name[SII_NAME_BYTES];

	sii_text(s->image, s->len, pdo->name, name);
	printf("%s 0x%04x %s\n", pdo->is_tx ? "TxPDO" : "RxPDO", pdo->index, name);
	if (pdo->sm != UINT8_MAX) {
		printf("    assigned to SM%u\n", pdo->sm);
	}
	for (unsigned i = 0; i < pdo->entry_count; i++) {
		const struct sii_entry *entry = &s->sii.entry[pdo->first_entry + i];

		sii_text(s->image, s->len, entry->name, name);
		printf("    0x%04x:%02x %3u bit  %s\n", entry->index, entry->subindex,
		       entry->bit_len, entry->index == 0 ? "(gap)" : name);
	}
}

static void show_rest(const struct shown *s)
{
	const struct sii *sii = &s->sii;
	char name[SII_NAME_BYTES];

	for (size_t i = 0; i < sii->sm_count; i++) {
		printf("SM%-2zu 0x%04x %5u bytes, control 0x%02x, %s%s\n", i, sii->sm[i].start,
		       sii->sm[i].len, sii->sm[i].control, sm_type(sii->sm[i].type),
		       (sii->sm[i].enable & 1) != 0 ? "" : ", off");
	}
	for (size_t i = 0; i < sii->fmmu_count; i++) {
		printf("FMMU%zu %s\n", i, fmmu_type(sii->fmmu[i]));
	}
	for (size_t i = 0; i < sii->pdo_count; i++) {
		show_pdo(s, &sii->pdo[i]);
	}
	for (size_t i = 0; i < sii->dc_mode_count; i++) {
		sii_text(s->image, s->len, sii->dc_mode[i].name, name);
		printf("DC mode %s: assign_activate 0x%04x, SYNC0 cycle %u ns, shift %d ns\n", name,
		       sii->dc_mode[i].assign_activate, sii->dc_mode[i].sync0_cycle_ns,
		       sii->dc_mode[i].sync0_shift_ns);
	}
}

/* --- JSON --- */

static void json_string(struct json *js, const struct shown *s, const char *key, unsigned number)
{
	char text[SII_NAME_BYTES];

	sii_text(s->image, s->len, number, text);
	json_text(js, key, text);
}

static void write_head(struct json *js, const struct shown *s, uint16_t pos)
{
	const struct sii *sii = &s->sii;
	char protocols[PROTOCOLS_BYTES];

	json_u64(js, "slave", pos);
	json_string(js, s, "name", sii->device_name);
	json_string(js, s, "order", sii->order_name);
	json_string(js, s, "group", sii->group_name);
	json_u64(js, "vendor", sii->vendor);
	json_u64(js, "product", sii->product);
	json_u64(js, "revision", sii->revision);
	json_u64(js, "serial", sii->serial);
	json_u64(js, "alias", sii->alias);
	json_truth(js, "checksum_ok", sii_is_checksum_right(s->image));
	json_u64(js, "size", sii->size_bytes);
	json_i64(js, "ebus_ma", sii->ebus_ma);
	json_text(js, "mailbox", protocols_of(sii->mailbox_protocols, protocols));
}

static void write_pdo(struct json *js, const struct shown *s, const struct sii_pdo *pdo)
{
	json_object_begin(js, NULL);
	json_u64(js, "index", pdo->index);
	json_string(js, s, "name", pdo->name);
	json_text(js, "direction", pdo->is_tx ? "input" : "output");
	if (pdo->sm == UINT8_MAX) {
		json_null(js, "sync_manager");
	} else {
		json_u64(js, "sync_manager", pdo->sm);
	}
	json_array_begin(js, "entry");
	for (unsigned i = 0; i < pdo->entry_count; i++) {
		const struct sii_entry *entry = &s->sii.entry[pdo->first_entry + i];

		json_object_begin(js, NULL);
		json_u64(js, "index", entry->index);
		json_u64(js, "subindex", entry->subindex);
		json_u64(js, "bits", entry->bit_len);
		json_string(js, s, "name", entry->name);
		json_object_end(js);
	}
	json_array_end(js);
	json_object_end(js);
}

static void write_areas(struct json *js, const struct sii *sii)
{
	json_array_begin(js, "sync_manager");
	for (size_t i = 0; i < sii->sm_count; i++) {
		json_object_begin(js, NULL);
		json_u64(js, "start", sii->sm[i].start);
		json_u64(js, "length", sii->sm[i].len);
		json_u64(js, "control", sii->sm[i].control);
		json_text(js, "type", sm_type(sii->sm[i].type));
		json_object_end(js);
	}
	json_array_end(js);
	json_array_begin(js, "fmmu");
	for (size_t i = 0; i < sii->fmmu_count; i++) {
		json_text(js, NULL, fmmu_type(sii->fmmu[i]));
	}
	json_array_end(js);
}

static void write_json(const struct shown *s, uint16_t pos)
{
	const struct sii *sii = &s->sii;
	struct json js;

	json_init(&js, stdout);
	json_object_begin(&js, NULL);
	write_head(&js, s, pos);
	write_areas(&js, sii);
	json_array_begin(&js, "pdo");
	for (size_t i = 0; i < sii->pdo_count; i++) {
		write_pdo(&js, s, &sii->pdo[i]);
	}
	json_array_end(&js);
	json_array_begin(&js, "dc_mode");
	for (size_t i = 0; i < sii->dc_mode_count; i++) {
		json_object_begin(&js, NULL);
		json_string(&js, s, "name", sii->dc_mode[i].name);
		json_u64(&js, "assign_activate", sii->dc_mode[i].assign_activate);
		json_u64(&js, "sync0_cycle_ns", sii->dc_mode[i].sync0_cycle_ns);
		json_i64(&js, "sync0_shift_ns", sii->dc_mode[i].sync0_shift_ns);
		json_object_end(&js);
	}
	json_array_end(&js);
	json_object_end(&js);
	json_end_line(&js);
}

/* --- both --- */

static enum exit_code show(const struct cli *cli, const uint8_t *image, size_t len, int json_pos)
{
	struct shown *s = calloc(1, sizeof(*s));
	char error[ERROR_BYTES] = "";
	int r;

	if (s == NULL) {
		return cli_fail(cli, EXIT_CODE_FAILED, "out of memory");
	}
	*s = (struct shown){ .image = image, .len = len };
	r = sii_parse(image, len, &s->sii, error, sizeof(error));
	if (json_pos >= 0) {
		write_json(s, (uint16_t)json_pos);
	} else {
		show_head(s);
		show_rest(s);
	}
	free(s);
	return r < 0 ? cli_fail(cli, EXIT_CODE_FAILED, "%s", error) : EXIT_CODE_OK;
}

enum exit_code sii_show(const struct cli *cli, const uint8_t *image, size_t len)
{
	return show(cli, image, len, -1);
}

enum exit_code sii_show_json(const struct cli *cli, uint16_t pos, const uint8_t *image, size_t len)
{
	return show(cli, image, len, pos);
}
