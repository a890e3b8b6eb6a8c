/* SPDX-License-Identifier: MIT */
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "eni/eni.h"
#include "eni/fields.h"
#include "xml/xml.h"

struct eni_reader {
	struct eni *eni;
	struct xml *xml;
	int depth;
	uint32_t owner;                          /* slave that is being read, or ENI_MASTER */
	enum eni_node node[XML_LIMIT_DEPTH + 1]; /* [0]: the document */
	void *base[XML_LIMIT_DEPTH + 1];         /* structure of the element; NULL: none */
	size_t field[XML_LIMIT_DEPTH + 1];       /* of an ENI_NODE_FIELD */
};

/* --- structures of elements --- */

static struct eni_slave *slave_of(const struct eni_reader *rd)
{
	return &rd->eni->slave[rd->eni->slave_count - 1];
}

static void *begin_range(struct eni_range *range, size_t *count)
{
	if (*count == ENI_LIMIT_RANGES) {
		return NULL;
	}
	range[*count].has = ENI_IS_THERE;
	return &range[(*count)++];
}

static void *begin_slave(struct eni_reader *rd)
{
	struct eni_slave *slave = eni_add_slave(rd->eni);

	if (slave != NULL) {
		slave->line = xml_line(rd->xml);
		rd->owner = (uint32_t)rd->eni->slave_count - 1;
	}
	return slave;
}

static void *begin_sm(struct eni_reader *rd, const char *name)
{
	unsigned long number = strtoul(name + strlen("Sm"), NULL, 10);
	struct eni_slave *slave = slave_of(rd);

	if (number >= ENI_LIMIT_SM) {
		return NULL;
	}
	memset(&slave->sm[number], 0, sizeof(slave->sm[number]));
	slave->sm[number].has = ENI_IS_THERE;
	return &slave->sm[number];
}

static void *begin_port(struct eni_reader *rd)
{
	struct eni_slave *slave = slave_of(rd);

	if (slave->port_count == ENI_LIMIT_PORTS) {
		return NULL;
	}
	slave->port[slave->port_count].has = ENI_IS_THERE;
	return &slave->port[slave->port_count++];
}

static void *begin_pdo(struct eni_reader *rd, enum eni_node node)
{
	struct eni_pdo *pdo = eni_add_pdo(rd->eni, rd->owner);

	if (pdo != NULL) {
		pdo->is_tx = node == ENI_NODE_TX_PDO;
	}
	return pdo;
}

static void *begin_command(struct eni_reader *rd, enum eni_node node)
{
	struct eni_command *command =
		node == ENI_NODE_INIT ? eni_add_init(rd->eni, rd->owner) : eni_add_cmd(rd->eni);

	if (command != NULL) {
		command->line = xml_line(rd->xml);
	}
	return command;
}

static void *begin_coe(struct eni_reader *rd)
{
	struct eni_coe *coe = eni_add_coe(rd->eni, rd->owner);

	if (coe != NULL) {
		coe->line = xml_line(rd->xml);
	}
	return coe;
}

static void *begin_variable(struct eni_reader *rd)
{
	struct eni_variable *variable =
		eni_add_variable(rd->eni, rd->node[rd->depth] == ENI_NODE_OUTPUTS);

	if (variable != NULL) {
		variable->line = xml_line(rd->xml);
	}
	return variable;
}

static void *there(uint32_t *has)
{
	*has |= ENI_IS_THERE;
	return has;
}

/* Of an element that is there once. */
static void *begin_single(struct eni_reader *rd, enum eni_node node)
{
	struct eni *eni = rd->eni;

	if (node == ENI_NODE_MASTER_INFO) {
		return there(&eni->master.has);
	}
	if (node == ENI_NODE_MAILBOX_STATES) {
		return there(&eni->mailbox_states.has);
	}
	if (node == ENI_NODE_INPUTS || node == ENI_NODE_OUTPUTS) {
		return there(node == ENI_NODE_INPUTS ? &eni->inputs.has : &eni->outputs.has);
	}
	if (node == ENI_NODE_VALIDATE) {
		return there(&eni->init[eni->init_count - 1].validate.has);
	}
	if (node == ENI_NODE_INFO) {
		return there(&slave_of(rd)->info.has);
	}
	if (node == ENI_NODE_IDENTIFICATION) {
		return there(&slave_of(rd)->identification.has);
	}
	if (node == ENI_NODE_DC) {
		return there(&slave_of(rd)->dc.has);
	}
	return rd->eni; /* it has no fields */
}

static void *begin_mailbox(struct eni_reader *rd, enum eni_node node)
{
	struct eni_mailbox *mailbox = &slave_of(rd)->mailbox;

	switch ((int)node) {
	case ENI_NODE_MAILBOX:
		return there(&mailbox->has);
	case ENI_NODE_MAILBOX_SEND:
		return there(&mailbox->send.has);
	case ENI_NODE_MAILBOX_RECV:
		return there(&mailbox->recv.has);
	case ENI_NODE_BOOT_SEND:
		return there(&mailbox->boot_send.has);
	default:
		return there(&mailbox->boot_recv.has);
	}
}

/* The structure that @node fills; NULL: refused. */
static void *begin_node(struct eni_reader *rd, enum eni_node node, const char *name)
{
	switch ((int)node) {
	case ENI_NODE_SLAVE:
		return begin_slave(rd);
	case ENI_NODE_SEND:
		return begin_range(slave_of(rd)->send, &slave_of(rd)->send_count);
	case ENI_NODE_RECV:
		return begin_range(slave_of(rd)->recv, &slave_of(rd)->recv_count);
	case ENI_NODE_SM:
		return begin_sm(rd, name);
	case ENI_NODE_RX_PDO:
	case ENI_NODE_TX_PDO:
		return begin_pdo(rd, node);
	case ENI_NODE_ENTRY:
		return eni_add_entry(rd->eni);
	case ENI_NODE_INIT:
	case ENI_NODE_CMD:
		return begin_command(rd, node);
	case ENI_NODE_COE_INIT:
		return begin_coe(rd);
	case ENI_NODE_PORT:
		return begin_port(rd);
	case ENI_NODE_CYCLIC:
		return eni_add_cyclic(rd->eni);
	case ENI_NODE_FRAME:
		return eni_add_frame(rd->eni);
	case ENI_NODE_VARIABLE:
		return begin_variable(rd);
	case ENI_NODE_MAILBOX:
	case ENI_NODE_MAILBOX_SEND:
	case ENI_NODE_MAILBOX_RECV:
	case ENI_NODE_BOOT_SEND:
	case ENI_NODE_BOOT_RECV:
		return begin_mailbox(rd, node);
	default:
		return begin_single(rd, node);
	}
}

/* --- what is passed over --- */

static void note_passed(struct eni_reader *rd, const char *name)
{
	enum eni_node parent = rd->node[rd->depth];
	struct eni_note *note = eni_add_note(rd->eni);

	if (note != NULL) {
		note->line = xml_line(rd->xml);
		note->slave = rd->owner;
		snprintf(note->what, sizeof(note->what), "<%.60s> in <%s>", name,
			 eni_node_name(parent));
		xml_plain(note->what, note->what, sizeof(note->what));
	}
}

static int read_attributes(struct eni_reader *rd, enum eni_node node, const char **attribute)
{
	const struct eni_table table = eni_table_of(node);

	for (size_t i = 0; i < table.count; i++) {
		const char *name = table.field[i].name;
		const char *text = name[0] == '@' ? xml_attribute(attribute, name + 1) : NULL;
		int r = text == NULL ? 0
				     : eni_field_set(rd->xml, node, i, text, rd->base[rd->depth]);

		if (r < 0) {
			return r;
		}
	}
	return 0;
}

/* --- what xml.h calls --- */

static int begin(void *ctx, struct xml *xml, const char *name, const char **attribute)
{
	struct eni_reader *rd = ctx;
	enum eni_node parent = rd->node[rd->depth];
	enum eni_node node = parent == ENI_NODE_FIELD
				     ? ENI_NODE_OTHER
				     : eni_node_find(parent, name, &rd->field[rd->depth + 1]);
	void *base = NULL;

	rd->xml = xml;
	if (parent == ENI_NODE_ROOT && node == ENI_NODE_OTHER) {
		return xml_fail(xml, "no ENI: <%.40s> instead of <EtherCATConfig>", name);
	}
	if (node == ENI_NODE_OTHER && parent != ENI_NODE_OTHER) {
		note_passed(rd, name);
	} else if (node != ENI_NODE_FIELD && node != ENI_NODE_OTHER) {
		base = begin_node(rd, node, name);
		if (base == NULL) {
			return xml_fail(xml, "<%.40s>: one too many, or out of memory", name);
		}
	}
	rd->depth++;
	rd->node[rd->depth] = node;
	rd->base[rd->depth] = base;
	return read_attributes(rd, node, attribute);
}

static int end(void *ctx, struct xml *xml, const char *name, const char *text)
{
	struct eni_reader *rd = ctx;
	enum eni_node node = rd->node[rd->depth--];

	(void)name;
	rd->xml = xml;
	if (node == ENI_NODE_SLAVE) {
		rd->owner = ENI_MASTER;
	}
	return node != ENI_NODE_FIELD
		       ? 0
		       : eni_field_set(xml, rd->node[rd->depth], rd->field[rd->depth + 1], text,
				       rd->base[rd->depth]);
}

static int read_with(int (*run)(void *ctx, const struct xml_handler *handler, char *error,
				size_t error_bytes),
		     void *ctx, struct eni **ret_eni, char *error, size_t error_bytes)
{
	struct eni_reader rd = { .node = { ENI_NODE_ROOT }, .owner = ENI_MASTER };
	const struct xml_handler handler = { .begin = begin, .end = end, .ctx = &rd };
	int r;

	rd.eni = calloc(1, sizeof(*rd.eni));
	if (rd.eni == NULL) {
		snprintf(error, error_bytes, "out of memory");
		return -ENOMEM;
	}
	r = run(ctx, &handler, error, error_bytes);
	if (r < 0) {
		eni_free(rd.eni);
		return r;
	}
	*ret_eni = rd.eni;
	return 0;
}

struct text {
	const char *name;
	const char *text;
	size_t len;
};

static int read_text(void *ctx, const struct xml_handler *handler, char *error, size_t error_bytes)
{
	const struct text *text = ctx;

	return xml_read(text->name, text->text, text->len, handler, error, error_bytes);
}

static int read_path(void *ctx, const struct xml_handler *handler, char *error, size_t error_bytes)
{
	const char *const *path = ctx;

	return xml_read_file(*path, handler, error, error_bytes);
}

int eni_read(const char *name, const char *text, size_t len, struct eni **ret_eni, char *error,
	     size_t error_bytes)
{
	struct text source = { name, text, len };

	return read_with(read_text, &source, ret_eni, error, error_bytes);
}

int eni_read_file(const char *path, struct eni **ret_eni, char *error, size_t error_bytes)
{
	return read_with(read_path, &path, ret_eni, error, error_bytes);
}
