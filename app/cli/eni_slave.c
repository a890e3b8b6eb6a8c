/* SPDX-License-Identifier: MIT */
/* A slave of the running bus as an ENI file has it: identity, PDOs, and in its commands the values
 * that its registers have. */
#include <stdio.h>
#include <string.h>

#include "base/bytes.h"
#include "base/clock.h"
#include "base/slave_place.h"
#include "base/utf8.h"
#include "cli/eni_plan.h"
#include "cli/pdo_info.h"
#include "eni/fields.h"
#include "wire/al.h"
#include "wire/coe_type.h"
#include "wire/datagram.h"

#define GET(field) atomic_load_explicit(&(field), memory_order_relaxed)

enum { SM_FIRST_BEHIND_MAILBOX = 2 };

/* --- commands of its registers --- */

struct write {
	uint32_t transitions;
	const char *comment;
	uint16_t reg;
	const void *data;
	size_t len;
};

static struct eni_command *add(struct slave_plan *s, uint32_t transitions, const char *comment)
{
	struct eni_command *init = eni_add_init(s->plan->eni, s->pos);

	if (init == NULL) {
		s->is_short = 1;
		return NULL;
	}
	init->has |= ENI_HAS(ENI_INIT_TRANSITIONS) | ENI_HAS(ENI_INIT_COMMENT) |
		     ENI_HAS(ENI_INIT_CMD) | ENI_HAS(ENI_INIT_ADP) | ENI_HAS(ENI_INIT_ADO) |
		     ENI_HAS(ENI_INIT_CNT) | ENI_HAS(ENI_INIT_RETRIES);
	init->transitions = transitions;
	snprintf(init->comment, sizeof(init->comment), "%s", comment);
	init->cnt = 1;
	init->retries = 3;
	return init;
}

static void add_write(struct slave_plan *s, const struct write *w)
{
	struct eni_command *init = add(s, w->transitions, w->comment);

	if (init == NULL) {
		return;
	}
	init->has |= ENI_HAS(ENI_INIT_DATA);
	init->cmd = ECAT_CMD_FPWR;
	init->adp = s->info.station_addr;
	init->ado = w->reg;
	s->is_short |= eni_octets_set(&init->data, w->data, w->len) < 0;
}

static void add_address(struct slave_plan *s)
{
	uint8_t address[2];
	struct eni_command *init = add(s, TURN(IP), "station address");

	put_le16(address, s->info.station_addr);
	if (init != NULL) {
		init->has |= ENI_HAS(ENI_INIT_DATA);
		init->cmd = ECAT_CMD_APWR;
		init->adp = (uint16_t)-s->pos;
		init->ado = ESC_REG_STATION_ADDRESS;
		s->is_short |= eni_octets_set(&init->data, address, sizeof(address)) < 0;
	}
}

/* The request of a state, and the look whether it is reached. */
static void add_state(struct slave_plan *s, uint32_t transitions, uint8_t state, int64_t timeout_ns)
{
	static const uint8_t mask[2] = { 0x1f, 0 }; /* with the error bit */
	const uint8_t word[2] = { state, 0 };
	const struct write request = { transitions, "request of the state", ESC_REG_AL_CONTROL,
				       word, sizeof(word) };
	struct eni_command *init;

	add_write(s, &request);
	init = add(s, transitions, "state is reached");
	if (init == NULL) {
		return;
	}
	init->has |= ENI_HAS(ENI_INIT_DATA_LEN);
	init->cmd = ECAT_CMD_FPRD;
	init->adp = s->info.station_addr;
	init->ado = ESC_REG_AL_STATUS;
	init->data_len = sizeof(word);
	eni_has_all(ENI_NODE_VALIDATE, &init->validate, 0);
	init->validate.timeout_ms = (uint32_t)(timeout_ns / NS_PER_MS);
	s->is_short |= eni_octets_set(&init->validate.data, word, sizeof(word)) < 0 ||
		       eni_octets_set(&init->validate.mask, mask, sizeof(mask)) < 0;
}

static void add_sms(struct slave_plan *s, uint32_t transitions, unsigned from, unsigned to)
{
	for (unsigned i = from; i < to && i < s->mapping.sm_count; i++) {
		uint8_t raw[ESC_SM_BYTES];
		char comment[32];
		const struct write w = { transitions, comment,
					 (uint16_t)(ESC_REG_SM + i * ESC_SM_BYTES), raw,
					 sizeof(raw) };

		if (s->mapping.sm[i].bytes == 0) {
			continue;
		}
		memcpy(raw, s->mapping.sm_raw[i], sizeof(raw));
		raw[5] = 0; /* its status is not written */
		raw[7] = 0;
		snprintf(comment, sizeof(comment), "SM%u", i);
		add_write(s, &w);
	}
}

static void add_fmmus(struct slave_plan *s)
{
	for (unsigned i = 0; i < s->mapping.fmmu_count; i++) {
		char comment[32];
		const struct write w = { TURN(PS), comment,
					 (uint16_t)(ESC_REG_FMMU + i * ESC_FMMU_BYTES),
					 s->mapping.fmmu_raw[i], ESC_FMMU_BYTES };

		if (s->mapping.fmmu[i].is_active) {
			snprintf(comment, sizeof(comment), "FMMU%u", i);
			add_write(s, &w);
		}
	}
}

static enum exit_code add_watchdog(struct slave_plan *s)
{
	static const struct {
		uint16_t reg;
		const char *comment;
	} rows[] = { { ESC_REG_WATCHDOG_DIVIDER, "watchdog divider" },
		     { ESC_REG_WATCHDOG_TIME_PD, "process data watchdog" } };
	enum exit_code result = EXIT_CODE_OK;

	for (size_t i = 0; i < 2 && s->plan->cfg->bus_watchdog_ns > 0; i++) {
		uint8_t word[2] = { 0 };
		const struct write w = { TURN(PS), rows[i].comment, rows[i].reg, word,
					 sizeof(word) };

		result = registers_read(s->plan->cli, s->pos, rows[i].reg, sizeof(word), word);
		if (result != EXIT_CODE_OK) {
			break;
		}
		add_write(s, &w);
	}
	return result;
}

/* --- clocks --- */

static enum exit_code add_clock(struct slave_plan *s, struct eni_slave *slave)
{
	static const uint8_t zero[8];
	uint8_t cycles[8] = { 0 };
	uint8_t units[2] = { 0 };
	const struct write writes[] = {
		{ TURN(PS), "SYNC units off", ESC_REG_DC_ACTIVATION, zero, 1 },
		{ TURN(PS), "SYNC0 and SYNC1 cycle", ESC_REG_DC_SYNC0_CYCLE, cycles,
		  sizeof(cycles) },
		{ TURN(PS), "first SYNC0: a time of the master, plus ShiftTime",
		  ESC_REG_DC_START_TIME, zero, sizeof(zero) },
		{ TURN(PS), "SYNC units on", ESC_REG_DC_CYCLIC_CONTROL, units, sizeof(units) },
	};
	enum exit_code result;

	if (!s->info.has_dc || !s->plan->cfg->dc_enable) {
		return EXIT_CODE_OK;
	}
	result = registers_read(s->plan->cli, s->pos, ESC_REG_DC_CYCLIC_CONTROL, sizeof(units),
				units);
	if (result == EXIT_CODE_OK) {
		result = registers_read(s->plan->cli, s->pos, ESC_REG_DC_SYNC0_CYCLE,
					sizeof(cycles), cycles);
	}
	slave->dc = (struct eni_dc){ .is_potential = 1,
				     .is_reference = s->info.is_dc_reference,
				     .cycle0_ns = (int32_t)s->info.sync0_cycle_ns,
				     .shift_ns = s->info.sync0_shift_ns };
	if (units[0] == 0 && units[1] == 0) {
		eni_has_all(ENI_NODE_DC, &slave->dc,
			    ENI_HAS(ENI_DC_CYCLE0) | ENI_HAS(ENI_DC_CYCLE1) |
				    ENI_HAS(ENI_DC_SHIFT));
		slave->dc.cycle0_ns = 0;
		slave->dc.shift_ns = 0;
		return result;
	}
	slave->dc.cycle1_ns = (int32_t)get_le32(cycles + 4);
	eni_has_all(ENI_NODE_DC, &slave->dc, 0);
	for (size_t i = 0; i < sizeof(writes) / sizeof(writes[0]); i++) {
		add_write(s, &writes[i]);
	}
	return result;
}

/* --- process data --- */

static int is_mailbox_state(const struct fmmu *f)
{
	return f->physical >= ESC_REG_SM && f->physical < ESC_REG_DC_RECEIVE_TIME_PORT;
}

static void put_range(struct eni_range *range, size_t *count, uint32_t start, uint32_t bits)
{
	if (*count < ENI_LIMIT_RANGES) {
		range[*count] = (struct eni_range){ .start = start, .len = bits };
		eni_has_all(ENI_NODE_SEND, &range[*count], 0);
		(*count)++;
	}
}

static void put_ranges(struct slave_plan *s, struct eni_slave *slave)
{
	for (unsigned i = 0; i < s->mapping.fmmu_count; i++) {
		const struct fmmu *f = &s->mapping.fmmu[i];
		uint32_t start = 8 * (f->logical - s->plan->start) + f->start_bit;

		if (!f->is_active || f->bytes == 0) {
			continue;
		}
		if (is_mailbox_state(f)) {
			slave->mailbox.recv.has |= ENI_HAS(ENI_AREA_STATUS_BIT);
			slave->mailbox.recv.status_bit = 8 * f->logical + f->start_bit;
		} else if (f->is_write) {
			put_range(slave->send, &slave->send_count, start,
				  8u * (f->bytes - 1u) + f->stop_bit - f->start_bit + 1u);
		} else if (f->is_read) {
			put_range(slave->recv, &slave->recv_count, start,
				  8u * (f->bytes - 1u) + f->stop_bit - f->start_bit + 1u);
		}
	}
}

static void put_area(struct eni_area *area, const struct sync_manager *sm)
{
	area->start = sm->start;
	area->len = sm->bytes;
	area->has |= ENI_IS_THERE | 3;
}

static void put_sms(struct slave_plan *s, struct eni_slave *slave)
{
	static const char *const types[] = { "Inputs", "Outputs", "MBoxIn", "MBoxOut" };

	for (unsigned i = 0; i < s->mapping.sm_count && i < ENI_LIMIT_SM; i++) {
		const struct sync_manager *sm = &s->mapping.sm[i];
		struct eni_sm *to = &slave->sm[i];

		if (sm->bytes == 0) {
			continue;
		}
		*to = (struct eni_sm){ .start = sm->start,
				       .bytes = sm->bytes,
				       .min = sm->bytes,
				       .max = sm->bytes,
				       .control = s->mapping.sm_raw[i][4],
				       .enable = sm->is_active };
		snprintf(to->type, sizeof(to->type), "%s",
			 types[2 * sm->is_mailbox + sm->is_write]);
		for (size_t n = 0; n < s->pdo->pdo_count; n++) {
			if (s->pdo->pdo[n].is_assigned && s->pdo->pdo[n].sm == (int)i &&
			    to->pdo.count < ENI_LIMIT_SM_PDOS) {
				to->pdo.item[to->pdo.count++] = s->pdo->pdo[n].index;
			}
		}
		eni_has_all(ENI_NODE_SM, to, 0);
		if (sm->is_mailbox) {
			put_area(sm->is_write ? &slave->mailbox.send : &slave->mailbox.recv, sm);
		}
	}
	if ((slave->mailbox.send.has & ENI_IS_THERE) != 0) {
		slave->mailbox.protocols = 0;
		for (unsigned i = 0; i <= ENI_VOE; i++) {
			slave->mailbox.protocols |= s->pdo->sii.mailbox_protocols & ENI_HAS(i);
		}
		eni_has_all(ENI_NODE_MAILBOX, &slave->mailbox, 0);
	}
}

static void put_entry(struct slave_plan *s, const struct pdo_info_entry *from)
{
	struct eni_entry *entry = eni_add_entry(s->plan->eni);
	const char *type = coe_type_name(from->type);

	if (entry == NULL) {
		s->is_short = 1;
		return;
	}
	entry->index = from->index;
	entry->subindex = from->subindex;
	entry->bits = from->bits;
	entry->has |= 7; /* Index, SubIndex, BitLen */
	if (from->index != 0) {
		xml_plain(from->name, entry->name, sizeof(entry->name));
		snprintf(entry->type, sizeof(entry->type), "%s", type == NULL ? "" : type);
		eni_has_all(ENI_NODE_ENTRY, entry, ENI_HAS(4) | (type == NULL ? ENI_HAS(5) : 0));
	}
}

/* Those that are assigned: first the outputs, as the file has them. */
static void put_pdos(struct slave_plan *s, unsigned is_tx)
{
	for (size_t i = 0; i < s->pdo->pdo_count; i++) {
		const struct pdo_info_pdo *from = &s->pdo->pdo[i];
		struct eni_pdo *pdo;

		if (!from->is_assigned || from->is_tx != is_tx || from->sm < 0 ||
		    from->sm >= ENI_LIMIT_SM) {
			continue;
		}
		pdo = eni_add_pdo(s->plan->eni, s->pos);
		if (pdo == NULL) {
			s->is_short = 1;
			return;
		}
		pdo->is_tx = is_tx;
		pdo->index = from->index;
		pdo->sm = (uint32_t)from->sm;
		xml_plain(from->name, pdo->name, sizeof(pdo->name));
		eni_has_all(ENI_NODE_RX_PDO, pdo, 3 | ENI_HAS(5)); /* Fixed, Mandatory, Exclude */
		for (size_t e = 0; e < from->count; e++) {
			put_entry(s, &s->pdo->entry[from->first + e]);
		}
	}
}

/* --- the slave --- */

static void put_info(struct slave_plan *s, struct eni_slave *slave)
{
	struct slave_place place =
		slave_place_unpack(GET(s->plan->page->slave[s->pos].place), s->pos);
	struct eni_port *port = &slave->port[0];
	char ports[PDO_INFO_PORTS_BYTES];

	slave->info = (struct eni_info){ .phys_addr = s->info.station_addr,
					 .auto_inc_addr = (uint16_t)-s->pos,
					 .vendor = s->info.vendor,
					 .product = s->info.product,
					 .revision = s->info.revision,
					 .serial = s->info.serial };
	xml_plain(s->info.name, slave->info.name, sizeof(slave->info.name));
	pdo_info_ports(s->pdo, ports);
	snprintf(slave->info.physics, sizeof(slave->info.physics), "%s", ports);
	eni_has_all(ENI_NODE_INFO, &slave->info, 0);
	if (s->info.alias != 0) {
		slave->identification = (struct eni_identification){ .value = s->info.alias,
								     .ado = ESC_REG_STATION_ALIAS };
		eni_has_all(ENI_NODE_IDENTIFICATION, &slave->identification, 0);
	}
	if (place.is_known && place.parent >= 0) {
		*port = (struct eni_port){
			.is_selected = 1,
			.phys_addr =
				source_slave(s->plan->page, (uint32_t)place.parent).station_addr
		};
		snprintf(port->port, sizeof(port->port), "%c", 'A' + (int)place.parent_port);
		eni_has_all(ENI_NODE_PORT, port, 0);
		slave->port_count = 1;
	}
}

static enum exit_code put_all(struct slave_plan *s, struct eni_slave *slave)
{
	const struct config *cfg = s->plan->cfg;
	int64_t preop_ns = s->is_listed ? s->item.preop_timeout_ns : CONFIG_PREOP_TIMEOUT_NS;
	int64_t op_ns = s->is_listed && s->item.op_timeout_ns > 0 ? s->item.op_timeout_ns
								  : cfg->bus_op_timeout_ns;
	int has_mailbox = s->pdo->sii.mailbox_protocols != 0;
	unsigned behind = has_mailbox ? SM_FIRST_BEHIND_MAILBOX : 0;
	enum exit_code result;

	put_info(s, slave);
	put_sms(s, slave);
	put_ranges(s, slave);
	put_pdos(s, 0);
	put_pdos(s, 1);
	result = eni_plan_startup(s);
	if (result != EXIT_CODE_OK) {
		return result;
	}
	add_address(s);
	add_sms(s, TURN(IP), 0, behind);
	add_state(s, TURN(IP) | TURN(SP) | TURN(OP), AL_PREOP, preop_ns);
	add_sms(s, TURN(PS), behind, SYNC_MANAGER_COUNT_MAX);
	add_fmmus(s);
	result = add_watchdog(s);
	if (result == EXIT_CODE_OK) {
		result = add_clock(s, slave);
	}
	add_state(s, TURN(PS) | TURN(OS), AL_SAFEOP, op_ns);
	add_state(s, TURN(SO), AL_OP, op_ns);
	add_state(s, TURN(PI) | TURN(SI) | TURN(OI), AL_INIT, op_ns);
	return result;
}

enum exit_code eni_plan_slave(struct eni_plan *plan, uint16_t pos)
{
	struct slave_plan s = { .plan = plan, .pos = pos, .info = source_slave(plan->page, pos) };
	struct eni_slave *slave = eni_add_slave(plan->eni);
	struct pdo_info *pdo = NULL;
	enum exit_code result = mapping_read(plan->cli, pos, &s.mapping);

	if (slave == NULL) {
		return cli_fail(plan->cli, EXIT_CODE_FAILED, "out of memory");
	}
	result = result == EXIT_CODE_OK ? pdo_info_read(plan->cli, pos, &pdo) : result;
	if (result != EXIT_CODE_OK) {
		return result;
	}
	s.pdo = pdo;
	pdo_info_warn(plan->cli, pos, pdo); /* it may be another mapping than that of the bring-up
					     */
	if (s.info.config_item > 0 && s.info.config_item <= plan->cfg->slave_count) {
		s.is_listed = 1;
		s.item = plan->cfg->slave[s.info.config_item - 1];
	}
	result = put_all(&s, slave);
	pdo_info_free(pdo);
	return s.is_short ? cli_fail(plan->cli, EXIT_CODE_FAILED, "out of memory") : result;
}
