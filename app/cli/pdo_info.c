/* SPDX-License-Identifier: MIT */
#include "cli/pdo_info.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "base/utf8.h"
#include "cli/admin_client.h"
#include "cli/esi_source.h"
#include "cli/text.h"

enum {
	OBJECT_SM_ASSIGN = 0x1c10,
	SM_MIN = 4,
	SM_OUTPUTS = 3,
	SM_INPUTS = 4,
	CACHED = 1, /* ADMIN_SII_READ: argument[0] */
};

struct pdo_reader {
	struct cli *cli;
	struct pdo_info *info;
	struct admin_request request;
	struct admin_transfer transfer;
	int is_over; /* what has failed will fail again: no further request */
};

void pdo_info_free(struct pdo_info *info)
{
	if (info != NULL) {
		free(info->image);
		free(info);
	}
}

unsigned pdo_info_sm_type(const struct pdo_info *info, unsigned sm)
{
	if (sm < info->sii.sm_count && info->sii.sm[sm].type != 0) {
		return info->sii.sm[sm].type;
	}
	return sm == 2 ? SM_OUTPUTS : sm == 3 ? SM_INPUTS : 0;
}

unsigned pdo_info_sm_count(const struct pdo_info *info)
{
	return info->sii.sm_count > SM_MIN ? (unsigned)info->sii.sm_count : SM_MIN;
}

void pdo_info_ports(const struct pdo_info *info, char ret_text[PDO_INFO_PORTS_BYTES])
{
	enum { PORTS_AT = 16 }; /* in the general category of an SII */
	static const char letters[] = " Y KH";
	unsigned last = PDO_INFO_PORTS_BYTES - 1;
	size_t at;
	size_t len;
	unsigned ports;

	memset(ret_text, 0, PDO_INFO_PORTS_BYTES);
	if (sii_find_category(info->image, info->image_bytes, SII_CATEGORY_GENERAL, &at, &len) <
		    0 ||
	    len < PORTS_AT + 2) {
		return;
	}
	ports = get_le16(info->image + at + PORTS_AT);
	for (unsigned i = 0; i < last; i++) {
		unsigned kind = ports >> (4 * i) & 0xf;

		ret_text[i] = kind < sizeof(letters) - 1 ? letters[kind] : ' ';
	}
	for (; last > 0 && ret_text[last - 1] == ' '; last--) {
		ret_text[last - 1] = '\0';
	}
}

/* --- SII --- */

static void take_pdo(struct pdo_info *info, const struct sii_pdo *from)
{
	struct pdo_info_pdo *pdo = &info->pdo[info->pdo_count];

	if (info->pdo_count == PDO_INFO_PDOS) {
		return;
	}
	*pdo = (struct pdo_info_pdo){ .index = from->index,
				      .sm = from->sm < SII_LIMIT_SM ? (int16_t)from->sm
								    : PDO_INFO_NO_SM,
				      .is_tx = from->is_tx,
				      .is_assigned = from->sm < SII_LIMIT_SM,
				      .first = info->entry_count,
				      .bits = from->bits };
	sii_text(info->image, info->image_bytes, from->name, pdo->name);
	for (size_t i = 0; i < from->entry_count && info->entry_count < PDO_INFO_ENTRIES; i++) {
		const struct sii_entry *e = &info->sii.entry[from->first_entry + i];
		struct pdo_info_entry *entry = &info->entry[info->entry_count++];

		*entry = (struct pdo_info_entry){ .index = e->index,
						  .subindex = e->subindex,
						  .bits = e->bit_len,
						  .type = e->data_type };
		sii_text(info->image, info->image_bytes, e->name, entry->name);
		pdo->count++;
	}
	info->pdo_count++;
}

static enum exit_code read_sii(struct pdo_reader *rd)
{
	struct pdo_info *info = rd->info;
	enum exit_code result;

	rd->request.verb = ADMIN_SII_READ;
	rd->request.argument[0] = CACHED;
	result = admin_transfer_do(rd->cli, &rd->transfer);
	rd->request.argument[0] = 0;
	if (result != EXIT_CODE_OK) {
		return result;
	}
	info->image = rd->transfer.answer;
	info->image_bytes = rd->transfer.answer_len;
	rd->transfer.answer = NULL;
	if (sii_parse(info->image, info->image_bytes, &info->sii, info->damage,
		      sizeof(info->damage)) < 0 &&
	    info->image_bytes < SII_CATEGORIES_BYTE) {
		return cli_fail(rd->cli, EXIT_CODE_FAILED, "ecdaqd: an SII of %zu bytes",
				info->image_bytes);
	}
	for (size_t i = 0; i < info->sii.pdo_count; i++) {
		take_pdo(info, &info->sii.pdo[i]);
	}
	return EXIT_CODE_OK;
}

/* --- CoE --- */

/* 1 and the answer; 0: the slave has no such object; -1: no answer, no further request. */
static int ask(struct pdo_reader *rd, enum admin_verb verb, uint16_t index, uint8_t subindex)
{
	rd->request.verb = verb;
	rd->request.index = index;
	rd->request.subindex = subindex;
	if (rd->is_over) {
		return -1;
	}
	if (admin_transfer_read(rd->cli, &rd->transfer) != EXIT_CODE_OK) {
		snprintf(rd->info->why, sizeof(rd->info->why), "no answer of ecdaqd");
		rd->is_over = 1;
		return -1;
	}
	if (rd->transfer.reply.result == -EREMOTEIO) {
		return 0;
	}
	if (rd->transfer.reply.result < 0) {
		snprintf(rd->info->why, sizeof(rd->info->why), "%s", rd->transfer.reply.text);
		rd->is_over = 1;
		return -1;
	}
	return 1;
}

static int ask_number(struct pdo_reader *rd, uint16_t index, unsigned subindex, uint32_t *ret_value)
{
	uint8_t padded[4] = { 0 };
	size_t len;
	int r = ask(rd, ADMIN_SDO_READ, index, (uint8_t)subindex);

	if (r <= 0) {
		return r;
	}
	len = rd->transfer.answer_len < sizeof(padded) ? rd->transfer.answer_len : sizeof(padded);
	if (len > 0) {
		memcpy(padded, rd->transfer.answer, len);
	}
	*ret_value = get_le32(padded);
	return 1;
}

/* What the SII says of the same entry, in any PDO. */
static const struct pdo_info_entry *known_entry(const struct pdo_info *info, uint16_t index,
						uint8_t subindex, size_t count)
{
	for (size_t i = 0; i < count; i++) {
		if (info->entry[i].index == index && info->entry[i].subindex == subindex &&
		    info->entry[i].type != 0) {
			return &info->entry[i];
		}
	}
	return NULL;
}

static void name_entry(struct pdo_reader *rd, struct pdo_info_entry *entry, size_t known)
{
	const struct pdo_info_entry *same =
		known_entry(rd->info, entry->index, entry->subindex, known);
	struct admin_sdo_entry found;

	if (entry->index == 0) {
		return;
	}
	if (same != NULL) {
		entry->type = same->type;
		memcpy(entry->name, same->name, sizeof(entry->name));
		return;
	}
	if (ask(rd, ADMIN_SDO_ENTRY, entry->index, entry->subindex) > 0 &&
	    rd->transfer.answer_len == sizeof(found)) {
		memcpy(&found, rd->transfer.answer, sizeof(found));
		found.name[sizeof(found.name) - 1] = '\0';
		entry->type = found.data_type;
		snprintf(entry->name, sizeof(entry->name), "%s", found.name);
	}
}

/* The present mapping of @pdo. Names come after the loop: an unnamed entry of the SII must not be
 * taken for a known one. */
static int read_mapping(struct pdo_reader *rd, struct pdo_info_pdo *pdo, size_t known)
{
	struct pdo_info *info = rd->info;
	uint32_t count;
	int r = ask_number(rd, pdo->index, 0, &count);

	if (r <= 0) {
		return r;
	}
	pdo->first = info->entry_count;
	pdo->count = 0;
	pdo->bits = 0;
	for (unsigned i = 1; i <= (count & 0xff) && info->entry_count < PDO_INFO_ENTRIES; i++) {
		struct pdo_info_entry *entry = &info->entry[info->entry_count];
		uint32_t word = 0;

		r = ask_number(rd, pdo->index, i, &word);
		if (r <= 0) {
			return r;
		}
		*entry = (struct pdo_info_entry){ .index = (uint16_t)(word >> 16),
						  .subindex = (uint8_t)(word >> 8),
						  .bits = (uint8_t)word };
		name_entry(rd, entry, known);
		info->entry_count++;
		pdo->count++;
		pdo->bits += entry->bits;
	}
	return 1;
}

static struct pdo_info_pdo *find_pdo(struct pdo_info *info, uint16_t index)
{
	for (size_t i = 0; i < info->pdo_count; i++) {
		if (info->pdo[i].index == index) {
			return &info->pdo[i];
		}
	}
	return NULL;
}

/* @index is the @place-th PDO that is assigned. */
static struct pdo_info_pdo *put_pdo(struct pdo_reader *rd, uint16_t index, size_t place)
{
	struct pdo_info *info = rd->info;
	struct pdo_info_pdo *pdo = find_pdo(info, index);
	struct pdo_info_pdo moved;

	if (pdo == NULL) {
		struct admin_sdo_object object;

		if (info->pdo_count == PDO_INFO_PDOS) {
			return NULL;
		}
		pdo = &info->pdo[info->pdo_count++];
		*pdo = (struct pdo_info_pdo){ .index = index };
		if (ask(rd, ADMIN_SDO_OBJECT, index, 0) > 0 &&
		    rd->transfer.answer_len == sizeof(object)) {
			memcpy(&object, rd->transfer.answer, sizeof(object));
			object.name[sizeof(object.name) - 1] = '\0';
			snprintf(pdo->name, sizeof(pdo->name), "%s", object.name);
		}
	}
	moved = *pdo;
	if (pdo < &info->pdo[place]) {
		pdo->times++;
		return NULL; /* shown once */
	}
	memmove(&info->pdo[place + 1], &info->pdo[place],
		(size_t)(pdo - &info->pdo[place]) * sizeof(*pdo));
	info->pdo[place] = moved;
	return &info->pdo[place];
}

/* The PDOs of one SyncManager; @place: how many are assigned so far. 1; 0: no such object. */
static int read_sm(struct pdo_reader *rd, unsigned sm, size_t known, size_t *place)
{
	uint16_t assign = (uint16_t)(OBJECT_SM_ASSIGN + sm);
	uint32_t count;
	int r = ask_number(rd, assign, 0, &count);

	for (unsigned i = 1; r > 0 && i <= (count & 0xff); i++) {
		struct pdo_info_pdo *pdo;
		uint32_t index;

		r = ask_number(rd, assign, i, &index);
		if (r <= 0 || (uint16_t)index == 0) {
			continue;
		}
		pdo = put_pdo(rd, (uint16_t)index, *place);
		if (pdo != NULL) {
			pdo->sm = (int16_t)sm;
			pdo->is_tx = pdo_info_sm_type(rd->info, sm) == SM_INPUTS;
			pdo->is_assigned = 1;
			pdo->times = 1;
			(*place)++;
			r = read_mapping(rd, pdo, known) < 0 ? -1 : 1;
		}
	}
	return r;
}

static int read_coe(struct pdo_reader *rd)
{
	struct pdo_info *info = rd->info;
	size_t known = info->entry_count;
	size_t place = 0;
	int is_there = 0;

	for (unsigned sm = 0; sm < pdo_info_sm_count(info); sm++) {
		unsigned type = pdo_info_sm_type(info, sm);
		int r;

		if (type != SM_OUTPUTS && type != SM_INPUTS) {
			continue;
		}
		r = read_sm(rd, sm, known, &place);
		if (r < 0) {
			return r;
		}
		is_there |= r;
	}
	for (size_t i = place; is_there && i < info->pdo_count; i++) {
		info->pdo[i].is_assigned = 0;
	}
	return is_there;
}

/* Assigned ones first, by SyncManager. */
static void sort(struct pdo_info *info)
{
	size_t place = 0;

	for (int sm = 0; sm < SII_LIMIT_SM; sm++) {
		for (size_t i = place; i < info->pdo_count; i++) {
			struct pdo_info_pdo pdo = info->pdo[i];

			if (pdo.is_assigned && pdo.sm == sm) {
				memmove(&info->pdo[place + 1], &info->pdo[place],
					(i - place) * sizeof(pdo));
				info->pdo[place++] = pdo;
			}
		}
	}
}

/* A half-read dictionary is none: what the SII says is left. */
static enum exit_code add_coe(struct pdo_reader *rd)
{
	struct pdo_info *info = rd->info;
	struct pdo_info *by_sii = malloc(sizeof(*by_sii));

	if (by_sii == NULL) {
		return cli_fail(rd->cli, EXIT_CODE_FAILED, "out of memory");
	}
	*by_sii = *info;
	info->is_by_coe = read_coe(rd) > 0;
	if (!info->is_by_coe && info->why[0] == '\0') {
		snprintf(info->why, sizeof(info->why),
			 "its object dictionary has no assignment of PDOs (0x1c12, 0x1c13)");
	}
	if (!info->is_by_coe) {
		memcpy(by_sii->why, info->why, sizeof(by_sii->why));
		*info = *by_sii;
	}
	free(by_sii);
	return EXIT_CODE_OK;
}

void pdo_info_warn(const struct cli *cli, uint16_t pos, const struct pdo_info *info)
{
	char why[sizeof(info->why)];

	if (info->why[0] != '\0') {
		(void)cli_fail(cli, EXIT_CODE_OK, "slave %u: PDOs by SII, not by CoE: %s", pos,
			       text_plain(info->why, why, sizeof(why)));
	}
}

/* --- ESI: names and types that both lack --- */

static void complete(struct pdo_info_entry *e, const struct esi_device *device, uint16_t pdo)
{
	struct esi_known known;

	if (e->index == 0) {
		return;
	}
	known = esi_find_known(device, (struct esi_shift){ 0, 0 }, pdo, e->index, e->subindex);
	if (e->name[0] == '\0') {
		utf8_copy(known.name, e->name, sizeof(e->name));
	}
	e->type = e->type != 0 ? e->type : known.type;
}

static void add_esi(struct cli *cli, struct pdo_info *info)
{
	const struct esi_device *device =
		esi_source_find(cli, info->sii.vendor, info->sii.product, info->sii.revision);

	for (size_t i = 0; device != NULL && i < info->pdo_count; i++) {
		struct pdo_info_pdo *pdo = &info->pdo[i];
		const struct esi_pdo *known = esi_find_pdo(device, pdo->index);

		if (known != NULL && pdo->name[0] == '\0') {
			utf8_copy(known->name, pdo->name, sizeof(pdo->name));
		}
		for (size_t k = 0; k < pdo->count; k++) {
			complete(&info->entry[pdo->first + k], device, pdo->index);
		}
	}
}

enum exit_code pdo_info_read(struct cli *cli, uint16_t pos, struct pdo_info **ret_info)
{
	struct pdo_reader rd = { .cli = cli, .request = { .slave_pos = pos } };
	enum exit_code result;

	rd.transfer = (struct admin_transfer){ .request = &rd.request };
	rd.info = calloc(1, sizeof(*rd.info));
	if (rd.info == NULL) {
		return cli_fail(cli, EXIT_CODE_FAILED, "out of memory");
	}
	result = read_sii(&rd);
	if (result == EXIT_CODE_OK && (rd.info->sii.mailbox_protocols & SII_MAILBOX_COE) != 0) {
		result = add_coe(&rd);
	}
	admin_transfer_done(&rd.transfer);
	if (result != EXIT_CODE_OK) {
		pdo_info_free(rd.info);
		return result;
	}
	sort(rd.info);
	add_esi(cli, rd.info);
	*ret_info = rd.info;
	return EXIT_CODE_OK;
}
