/* SPDX-License-Identifier: MIT */
#include <inttypes.h>
#include <stdint.h>
#include <string.h>

#include "base/xml_text.h"
#include "eni/eni.h"
#include "eni/fields.h"

struct writer {
	FILE *out;
	const struct eni *eni;
	int depth;
};

/* --- elements --- */

static void indent(const struct writer *w)
{
	fprintf(w->out, "%*s", 2 * w->depth, "");
}

/* Numbers in @at may be of any kind but texts and lists. */
static void put_number(const struct writer *w, const struct eni_field *field, const uint8_t *at)
{
	uint32_t value;
	int32_t number;

	memcpy(&value, at, sizeof(value));
	memcpy(&number, at, sizeof(number));
	if (field->kind == ENI_KIND_HEX) {
		fprintf(w->out, "#x%04" PRIx32, value);
	} else if (field->kind == ENI_KIND_SIGNED) {
		fprintf(w->out, "%" PRId32, number);
	} else {
		fprintf(w->out, "%" PRIu32, value);
	}
}

static void put_octets(const struct writer *w, const uint8_t *at)
{
	struct eni_octets octets;

	memcpy(&octets, at, sizeof(octets));
	for (size_t i = 0; i < octets.len; i++) {
		fprintf(w->out, "%02x", octets.data[i]);
	}
}

static void put_value(const struct writer *w, const struct eni_field *field, const uint8_t *at)
{
	if (field->kind == ENI_KIND_TEXT) {
		xml_text_put(w->out, (const char *)at);
	} else if (field->kind == ENI_KIND_OCTETS) {
		put_octets(w, at);
	} else {
		put_number(w, field, at);
	}
}

static void put_words(const struct writer *w, const struct eni_field *field, const uint8_t *at)
{
	uint32_t value;

	memcpy(&value, at, sizeof(value));
	for (size_t i = 0; field->words[i] != NULL; i++) {
		if ((value & UINT32_C(1) << i) != 0) {
			indent(w);
			fprintf(w->out, "<%s>%s</%s>\n", field->name, field->words[i], field->name);
		}
	}
}

static void put_indexes(const struct writer *w, const struct eni_field *field, const uint8_t *at)
{
	struct eni_list list;

	memcpy(&list, at, sizeof(list));
	for (size_t i = 0; i < list.count; i++) {
		indent(w);
		fprintf(w->out, "<%s>#x%04x</%s>\n", field->name, list.item[i], field->name);
	}
}

static void put_field(const struct writer *w, const struct eni_field *field, const uint8_t *at)
{
	if (field->kind == ENI_KIND_WORDS) {
		put_words(w, field, at);
	} else if (field->kind == ENI_KIND_INDEXES) {
		put_indexes(w, field, at);
	} else {
		indent(w);
		fprintf(w->out, "<%s>", field->name);
		put_value(w, field, at);
		fprintf(w->out, "</%s>\n", field->name);
	}
}

/* "<Name>" and a deeper level; @number behind it where it is not negative. */
static void open_node(struct writer *w, enum eni_node node, int number)
{
	indent(w);
	fprintf(w->out, "<%s", eni_node_name(node));
	if (number >= 0) {
		fprintf(w->out, "%d", number);
	}
	fputs(">\n", w->out);
	w->depth++;
}

static void close_node(struct writer *w, enum eni_node node, int number)
{
	w->depth--;
	indent(w);
	fprintf(w->out, "</%s", eni_node_name(node));
	if (number >= 0) {
		fprintf(w->out, "%d", number);
	}
	fputs(">\n", w->out);
}

/* The same with its attributes, and its fields behind it, from structure @base. */
static void open_filled(struct writer *w, enum eni_node node, int number, const void *base)
{
	const struct eni_table table = eni_table_of(node);
	const uint8_t *at = base;
	uint32_t has;

	memcpy(&has, base, sizeof(has));
	indent(w);
	fprintf(w->out, "<%s", eni_node_name(node));
	if (number >= 0) {
		fprintf(w->out, "%d", number);
	}
	for (size_t i = 0; i < table.count; i++) {
		const struct eni_field *field = &table.field[i];

		if (field->name[0] == '@' && (has & ENI_HAS(i)) != 0) {
			fprintf(w->out, " %s=\"", field->name + 1);
			put_value(w, field, at + field->at);
			fputc('"', w->out);
		}
	}
	fputs(">\n", w->out);
	w->depth++;
	for (size_t i = 0; i < table.count; i++) {
		const struct eni_field *field = &table.field[i];

		if (field->name[0] != '@' && (has & ENI_HAS(i)) != 0) {
			put_field(w, field, at + field->at);
		}
	}
}

/* All of an element that has nothing but fields; nothing where it is not there. */
static void put_node(struct writer *w, enum eni_node node, int number, const void *base)
{
	uint32_t has;

	memcpy(&has, base, sizeof(has));
	if ((has & ENI_IS_THERE) != 0) {
		open_filled(w, node, number, base);
		close_node(w, node, number);
	}
}

/* --- commands --- */

static void put_inits(struct writer *w, uint32_t owner)
{
	int is_open = 0;

	for (size_t i = 0; i < w->eni->init_count; i++) {
		const struct eni_command *init = &w->eni->init[i];

		if (init->owner != owner) {
			continue;
		}
		if (!is_open) {
			open_node(w, ENI_NODE_INITS, -1);
			is_open = 1;
		}
		open_filled(w, ENI_NODE_INIT, -1, init);
		put_node(w, ENI_NODE_VALIDATE, -1, &init->validate);
		close_node(w, ENI_NODE_INIT, -1);
	}
	if (is_open) {
		close_node(w, ENI_NODE_INITS, -1);
	}
}

static void put_coe(struct writer *w, uint32_t slave)
{
	int is_open = 0;

	for (size_t i = 0; i < w->eni->coe_count; i++) {
		if (w->eni->coe[i].slave != slave) {
			continue;
		}
		if (!is_open) {
			open_node(w, ENI_NODE_COE, -1);
			open_node(w, ENI_NODE_COE_INITS, -1);
			is_open = 1;
		}
		put_node(w, ENI_NODE_COE_INIT, -1, &w->eni->coe[i]);
	}
	if (is_open) {
		close_node(w, ENI_NODE_COE_INITS, -1);
		close_node(w, ENI_NODE_COE, -1);
	}
}

/* --- slaves --- */

static void put_pdo(struct writer *w, const struct eni_pdo *pdo)
{
	enum eni_node node = pdo->is_tx ? ENI_NODE_TX_PDO : ENI_NODE_RX_PDO;

	open_filled(w, node, -1, pdo);
	for (size_t i = 0; i < pdo->count; i++) {
		put_node(w, ENI_NODE_ENTRY, -1, &w->eni->entry[pdo->first + i]);
	}
	close_node(w, node, -1);
}

static void put_process_data(struct writer *w, uint32_t number)
{
	const struct eni_slave *slave = &w->eni->slave[number];

	open_node(w, ENI_NODE_PROCESS_DATA, -1);
	for (size_t i = 0; i < slave->send_count; i++) {
		put_node(w, ENI_NODE_SEND, -1, &slave->send[i]);
	}
	for (size_t i = 0; i < slave->recv_count; i++) {
		put_node(w, ENI_NODE_RECV, -1, &slave->recv[i]);
	}
	for (int i = 0; i < ENI_LIMIT_SM; i++) {
		put_node(w, ENI_NODE_SM, i, &slave->sm[i]);
	}
	for (size_t i = 0; i < w->eni->pdo_count; i++) {
		if (w->eni->pdo[i].slave == number && !w->eni->pdo[i].is_tx) {
			put_pdo(w, &w->eni->pdo[i]);
		}
	}
	for (size_t i = 0; i < w->eni->pdo_count; i++) {
		if (w->eni->pdo[i].slave == number && w->eni->pdo[i].is_tx) {
			put_pdo(w, &w->eni->pdo[i]);
		}
	}
	close_node(w, ENI_NODE_PROCESS_DATA, -1);
}

static void put_mailbox(struct writer *w, uint32_t number)
{
	const struct eni_mailbox *mailbox = &w->eni->slave[number].mailbox;

	if ((mailbox->has & ENI_IS_THERE) == 0) {
		return;
	}
	open_node(w, ENI_NODE_MAILBOX, -1);
	put_node(w, ENI_NODE_MAILBOX_SEND, -1, &mailbox->send);
	put_node(w, ENI_NODE_MAILBOX_RECV, -1, &mailbox->recv);
	if (((mailbox->boot_send.has | mailbox->boot_recv.has) & ENI_IS_THERE) != 0) {
		open_node(w, ENI_NODE_BOOT, -1);
		put_node(w, ENI_NODE_BOOT_SEND, -1, &mailbox->boot_send);
		put_node(w, ENI_NODE_BOOT_RECV, -1, &mailbox->boot_recv);
		close_node(w, ENI_NODE_BOOT, -1);
	}
	put_words(w, &eni_table_of(ENI_NODE_MAILBOX).field[0],
		  (const uint8_t *)&mailbox->protocols);
	put_coe(w, number);
	close_node(w, ENI_NODE_MAILBOX, -1);
}

static void put_slave(struct writer *w, uint32_t number)
{
	const struct eni_slave *slave = &w->eni->slave[number];

	open_node(w, ENI_NODE_SLAVE, -1);
	if ((slave->info.has & ENI_IS_THERE) != 0) {
		open_filled(w, ENI_NODE_INFO, -1, &slave->info);
		put_node(w, ENI_NODE_IDENTIFICATION, -1, &slave->identification);
		close_node(w, ENI_NODE_INFO, -1);
	}
	put_process_data(w, number);
	put_mailbox(w, number);
	put_inits(w, number);
	for (size_t i = 0; i < slave->port_count; i++) {
		put_node(w, ENI_NODE_PORT, -1, &slave->port[i]);
	}
	put_node(w, ENI_NODE_DC, -1, &slave->dc);
	close_node(w, ENI_NODE_SLAVE, -1);
}

/* --- frames and image --- */

static void put_frame(struct writer *w, uint32_t number)
{
	open_filled(w, ENI_NODE_FRAME, -1, &w->eni->frame[number]);
	for (size_t i = 0; i < w->eni->cmd_count; i++) {
		if (w->eni->cmd[i].owner == number) {
			put_node(w, ENI_NODE_CMD, -1, &w->eni->cmd[i]);
		}
	}
	close_node(w, ENI_NODE_FRAME, -1);
}

static void put_cyclic(struct writer *w, uint32_t number)
{
	open_filled(w, ENI_NODE_CYCLIC, -1, &w->eni->cyclic[number]);
	for (uint32_t i = 0; i < w->eni->frame_count; i++) {
		if (w->eni->frame[i].cyclic == number) {
			put_frame(w, i);
		}
	}
	close_node(w, ENI_NODE_CYCLIC, -1);
}

static void put_image(struct writer *w, enum eni_node node, const struct eni_image *image)
{
	if ((image->has & ENI_IS_THERE) == 0) {
		return;
	}
	open_filled(w, node, -1, image);
	for (size_t i = 0; i < w->eni->variable_count; i++) {
		if (w->eni->variable[i].is_output == (node == ENI_NODE_OUTPUTS)) {
			put_node(w, ENI_NODE_VARIABLE, -1, &w->eni->variable[i]);
		}
	}
	close_node(w, node, -1);
}

void eni_write(FILE *out, const struct eni *eni)
{
	struct writer w = { .out = out, .eni = eni };

	fputs("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n", out);
	open_node(&w, ENI_NODE_FILE, -1);
	open_node(&w, ENI_NODE_CONFIG, -1);
	open_node(&w, ENI_NODE_MASTER, -1);
	put_node(&w, ENI_NODE_MASTER_INFO, -1, &eni->master);
	put_node(&w, ENI_NODE_MAILBOX_STATES, -1, &eni->mailbox_states);
	put_inits(&w, ENI_MASTER);
	close_node(&w, ENI_NODE_MASTER, -1);
	for (uint32_t i = 0; i < eni->slave_count; i++) {
		put_slave(&w, i);
	}
	for (uint32_t i = 0; i < eni->cyclic_count; i++) {
		put_cyclic(&w, i);
	}
	if (((eni->inputs.has | eni->outputs.has) & ENI_IS_THERE) != 0) {
		open_node(&w, ENI_NODE_IMAGE, -1);
		put_image(&w, ENI_NODE_INPUTS, &eni->inputs);
		put_image(&w, ENI_NODE_OUTPUTS, &eni->outputs);
		close_node(&w, ENI_NODE_IMAGE, -1);
	}
	close_node(&w, ENI_NODE_CONFIG, -1);
	close_node(&w, ENI_NODE_FILE, -1);
}
