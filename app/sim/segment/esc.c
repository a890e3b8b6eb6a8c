/* SPDX-License-Identifier: MIT */
#include "segment/esc.h"

#include <string.h>

#include "segment/esc_internal.h"
#include "wire/al.h"

enum { PORT_0 = 0x03, PORT_0_EBUS = 0x02 }; /* of the port descriptor, 0x0007 */

const struct esc_features esc_et1100 = {
	.type = 0x11,
	.revision = 0x00,
	.build = 0x0003,
	.fmmu_count = 8,
	.sm_count = 8,
	.ram_kib = 8,
	.port_descriptor = 0x0f,
	.features = 0x00fc,
	.dc = ESC_DC_64,
	.has_sync_unit = 1,
	.is_dc_by_eeprom = 1,
	.eeprom_bytes_a_read = 8,
	.receive_time_at_power_on = ESC_RECEIVE_TIME_UNSET,
};

static void reset_registers(struct esc *esc)
{
	const struct esc_features *f = &esc->features;
	uint8_t *r = esc->reg;

	r[ESC_REG_TYPE] = f->type;
	r[ESC_REG_REVISION] = f->revision;
	put_le16(r + ESC_REG_BUILD, f->build);
	r[ESC_REG_FMMU_COUNT] = f->fmmu_count;
	r[ESC_REG_SM_COUNT] = f->sm_count;
	r[ESC_REG_RAM_SIZE] = f->ram_kib;
	r[ESC_REG_PORT_DESCRIPTOR] = f->port_descriptor;
	put_le16(r + ESC_REG_FEATURES, f->features);
	put_le32(r + ESC_REG_DL_CONTROL,
		 (f->port_descriptor & PORT_0) == PORT_0_EBUS ? 0x00c70001 : 0x00070001);
	put_le16(r + ESC_REG_AL_CONTROL, AL_INIT);
	put_le16(r + ESC_REG_AL_STATUS, AL_INIT);
	put_le16(r + ESC_REG_WATCHDOG_DIVIDER, 0x09c2);
	put_le16(r + ESC_REG_WATCHDOG_TIME_PDI, 1000);
	put_le16(r + ESC_REG_WATCHDOG_TIME_PD, 1000);
	put_le32(r + ESC_REG_AL_EVENT_MASK, 0x00ffff0f);
	put_le16(r + ESC_REG_DC_SPEED_COUNTER_START, 0x1000);
	r[ESC_REG_DC_TIME_FILTER] = 4;
	r[ESC_REG_DC_SPEED_FILTER] = 12;
	for (unsigned port = 0; port < ESC_PORTS; port++) {
		put_le32(r + ESC_REG_DC_RECEIVE_TIME_PORT + (size_t)4 * port,
			 f->receive_time_at_power_on[port]);
	}
}

void esc_init(struct esc *esc, const struct esc_features *features, uint8_t *sii, size_t sii_bytes,
	      int64_t t_ns)
{
	memset(esc, 0, sizeof(*esc));
	esc->features = *features;
	esc->sii = sii;
	esc->sii_bytes = sii_bytes;
	esc->watchdog_deadline_ns = INT64_MAX;
	esc->pdi_watchdog_deadline_ns = INT64_MAX;
	esc->sync.next_true_ns = INT64_MAX;
	esc->sync.next1_true_ns = INT64_MAX;
	esc_register_layout(esc);
	reset_registers(esc);
	for (unsigned n = 0; n < features->sm_count; n++) {
		esc_sm_configure(esc, n, ESC_PDI);
	}
	esc_clock_start(esc, t_ns, 0, 0.0);
	esc_eeprom_power_on(esc, t_ns);
}

void esc_sync0_to(struct esc *esc, esc_sync0_sink sink, void *ctx)
{
	esc->sink = sink;
	esc->sink_ctx = ctx;
}

/* --- ports --- */

int esc_is_port_closed(const struct esc *esc, unsigned port)
{
	return (esc->reg[ESC_REG_DL_CONTROL + 1] >> (2 * port) & 3) == 3;
}

void esc_set_links(struct esc *esc, uint8_t ports)
{
	uint16_t status = get_le16(esc->reg + ESC_REG_DL_STATUS) & 0x000f;

	for (unsigned port = 0; port < ESC_PORTS; port++) {
		unsigned has_link = (unsigned)ports >> port & 1u;
		/* Bit 0 the loop is closed (without a link by itself), bit 1 there is
		 * communication. */
		unsigned loop = has_link && !esc_is_port_closed(esc, port) ? 2 : 1;

		status |= (uint16_t)(has_link << (4 + port));
		status |= (uint16_t)(loop << (8 + 2 * port));
	}
	if (status != get_le16(esc->reg + ESC_REG_DL_STATUS)) {
		esc->ecat_event |= ESC_ECAT_EVENT_DL_STATUS;
	}
	put_le16(esc->reg + ESC_REG_DL_STATUS, status);
	esc->ports = ports;
}

void esc_count_error(struct esc *esc, unsigned port, enum esc_error error)
{
	static const struct {
		uint16_t first;
		uint8_t a_port;
	} counters[] = {
		[ESC_ERROR_INVALID_FRAME] = { ESC_REG_RX_ERROR_COUNTER, 2 },
		[ESC_ERROR_RX] = { ESC_REG_RX_ERROR_COUNTER + 1, 2 },
		[ESC_ERROR_FORWARDED] = { ESC_REG_FORWARDED_RX_ERROR, 1 },
		[ESC_ERROR_LOST_LINK] = { ESC_REG_LOST_LINK_COUNTER, 1 },
		[ESC_ERROR_UNIT] = { ESC_REG_ECAT_PU_ERROR, 0 },
	};
	uint8_t *counter =
		&esc->reg[counters[error].first + (port % ESC_PORTS) * counters[error].a_port];

	/* They stop at 0xff (data sheet). */
	if (*counter < 0xff) {
		(*counter)++;
	}
}

void esc_force_al_status(struct esc *esc, uint8_t status, uint16_t code)
{
	esc->al_late_ns = 0;
	esc->reg[ESC_REG_AL_STATUS] = status;
	put_le16(esc->reg + ESC_REG_AL_STATUS_CODE, code);
	esc->ecat_event |= ESC_ECAT_EVENT_AL_STATUS;
}

/* --- the wire --- */

/* What was read, in @buf or where it is; NULL: nothing. */
static const uint8_t *read_memory(struct esc *esc, const struct esc_frame *frame, uint16_t addr,
				  uint8_t *buf, size_t len)
{
	const uint8_t *reg;
	size_t registers;

	if (addr >= ESC_REG_PROCESS_RAM) {
		return esc_ram_read(esc, ESC_ECAT, addr, buf, len) ? buf : NULL;
	}
	if (addr + len <= ESC_REG_PROCESS_RAM) {
		return esc_register_read(esc, ESC_ECAT, frame->pu_ns, addr, buf, len);
	}
	registers = (size_t)ESC_REG_PROCESS_RAM - addr;
	reg = esc_register_read(esc, ESC_ECAT, frame->pu_ns, addr, buf, registers);
	if (reg != NULL && reg != buf) {
		memcpy(buf, reg, registers);
	}
	return esc_ram_read(esc, ESC_ECAT, ESC_REG_PROCESS_RAM, buf + registers, len - registers) ||
			       reg != NULL
		       ? buf
		       : NULL;
}

static int write_memory(struct esc *esc, const struct esc_frame *frame, uint16_t addr,
			const uint8_t *buf, size_t len)
{
	size_t registers = 0;
	int any = 0;

	if (addr < ESC_REG_PROCESS_RAM) {
		registers = (size_t)ESC_REG_PROCESS_RAM - addr;
		registers = registers < len ? registers : len;
		any = esc_register_write(esc, frame, addr, buf, registers);
	}
	if (registers < len) {
		any |= esc_ram_write(esc, ESC_ECAT, frame->pu_ns, (uint16_t)(addr + registers),
				     buf + registers, len - registers);
	}
	return any;
}

static void add_wkc(struct ecat_datagram *dg, int n)
{
	put_le16(dg->wkc, (uint16_t)(get_le16(dg->wkc) + n));
}

static void or_bytes(uint8_t *to, const uint8_t *from, size_t len)
{
	for (size_t i = 0; i < len; i++) {
		to[i] |= from[i];
	}
}

static void do_read(struct esc *esc, const struct esc_frame *frame, struct ecat_datagram *dg,
		    int is_broadcast)
{
	uint8_t room[ECAT_DATAGRAM_MAX_BYTES];
	const uint8_t *got;

	if (dg->ado + dg->data_len > ESC_REG_PROCESS_RAM) {
		memcpy(room, dg->data, dg->data_len); /* RAM that is refused is left alone */
	}
	got = read_memory(esc, frame, dg->ado, room, dg->data_len);
	if (got == NULL) {
		return;
	}
	if (is_broadcast) {
		or_bytes(dg->data, got, dg->data_len);
	} else {
		memcpy(dg->data, got, dg->data_len);
	}
	add_wkc(dg, 1);
}

static void do_write(struct esc *esc, const struct esc_frame *frame, struct ecat_datagram *dg)
{
	add_wkc(dg, write_memory(esc, frame, dg->ado, dg->data, dg->data_len));
}

static void do_read_write(struct esc *esc, const struct esc_frame *frame, struct ecat_datagram *dg,
			  int is_broadcast)
{
	uint8_t came[ECAT_DATAGRAM_MAX_BYTES];

	memcpy(came, dg->data, dg->data_len);
	do_read(esc, frame, dg, is_broadcast);
	add_wkc(dg, 2 * write_memory(esc, frame, dg->ado, came, dg->data_len));
}

/* Auto-increment and broadcast addresses count the slaves they have passed. */
static const struct command {
	enum { TO_NOBODY, TO_POSITION, TO_STATION, TO_ALL } to;
	enum { DOES_NOTHING, DOES_READ, DOES_WRITE, DOES_BOTH, DOES_LOGICAL, DOES_MULTIPLE } does;
	int counts;
} commands[] = {
	[ECAT_CMD_APRD] = { TO_POSITION, DOES_READ, 1 },
	[ECAT_CMD_APWR] = { TO_POSITION, DOES_WRITE, 1 },
	[ECAT_CMD_APRW] = { TO_POSITION, DOES_BOTH, 1 },
	[ECAT_CMD_FPRD] = { TO_STATION, DOES_READ, 0 },
	[ECAT_CMD_FPWR] = { TO_STATION, DOES_WRITE, 0 },
	[ECAT_CMD_FPRW] = { TO_STATION, DOES_BOTH, 0 },
	[ECAT_CMD_BRD] = { TO_ALL, DOES_READ, 1 },
	[ECAT_CMD_BWR] = { TO_ALL, DOES_WRITE, 1 },
	[ECAT_CMD_BRW] = { TO_ALL, DOES_BOTH, 1 },
	[ECAT_CMD_LRD] = { TO_ALL, DOES_LOGICAL, 0 },
	[ECAT_CMD_LWR] = { TO_ALL, DOES_LOGICAL, 0 },
	[ECAT_CMD_LRW] = { TO_ALL, DOES_LOGICAL, 0 },
	[ECAT_CMD_ARMW] = { TO_POSITION, DOES_MULTIPLE, 1 },
	[ECAT_CMD_FRMW] = { TO_STATION, DOES_MULTIPLE, 0 },
};

static int is_addressed(const struct esc *esc, const struct ecat_datagram *dg,
			const struct command *command)
{
	if (command->to == TO_STATION) {
		return dg->adp == get_le16(esc->reg + ESC_REG_STATION_ADDRESS) ||
		       ((esc->reg[ESC_REG_DL_CONTROL + 3] & 1) &&
			dg->adp == get_le16(esc->reg + ESC_REG_STATION_ALIAS));
	}
	return command->to == TO_ALL || (command->to == TO_POSITION && dg->adp == 0);
}

static void execute(struct esc *esc, const struct esc_frame *frame, struct ecat_datagram *dg,
		    const struct command *command)
{
	int is_broadcast = command->to == TO_ALL;

	switch (command->does) {
	case DOES_NOTHING:
		break;
	case DOES_READ:
		do_read(esc, frame, dg, is_broadcast);
		break;
	case DOES_WRITE:
		do_write(esc, frame, dg);
		break;
	case DOES_BOTH:
		do_read_write(esc, frame, dg, is_broadcast);
		break;
	case DOES_LOGICAL:
		esc_fmmu_access(esc, frame, dg);
		break;
	case DOES_MULTIPLE: /* one reads, and the others write */
		do_read(esc, frame, dg, 0);
		break;
	}
}

/* Pending ECAT events that 0x0200 lets through, of all slaves, come back with each datagram. */
static void add_irq(const struct esc *esc, struct ecat_datagram *dg)
{
	uint16_t event = (uint16_t)esc->ecat_event & get_le16(esc->reg + ESC_REG_ECAT_EVENT_MASK);

	if (event != 0) {
		dg->irq |= event;
		put_le16(dg->data - 2, dg->irq);
	}
}

void esc_datagram(struct esc *esc, const struct esc_frame *frame, struct ecat_datagram *dg)
{
	const struct command *command = &commands[ECAT_CMD_NOP];

	if (dg->data_len > ECAT_DATAGRAM_MAX_BYTES) {
		return;
	}
	if (dg->cmd < sizeof(commands) / sizeof(commands[0])) {
		command = &commands[dg->cmd];
	}
	add_irq(esc, dg);
	if (is_addressed(esc, dg, command)) {
		execute(esc, frame, dg, command);
	} else if (command->does == DOES_MULTIPLE) {
		do_write(esc, frame, dg);
	}
	if (command->counts) {
		dg->adp++;
		put_le16(dg->data - ECAT_DATAGRAM_HEADER_BYTES + 2, dg->adp);
	}
}

/* --- its own events --- */

int64_t esc_next_event_ns(const struct esc *esc)
{
	int64_t next = esc->sync.next_true_ns;

	if (esc->sync.next1_true_ns < next) {
		next = esc->sync.next1_true_ns;
	}
	if (esc->watchdog_deadline_ns < next) {
		next = esc->watchdog_deadline_ns;
	}
	if (esc->pdi_watchdog_deadline_ns < next) {
		next = esc->pdi_watchdog_deadline_ns;
	}
	if (esc->eeprom_busy_until_ns != 0 && esc->eeprom_busy_until_ns < next) {
		next = esc->eeprom_busy_until_ns;
	}
	return next;
}

void esc_advance(struct esc *esc, int64_t t_ns)
{
	for (int64_t next = esc_next_event_ns(esc); next <= t_ns; next = esc_next_event_ns(esc)) {
		if (next == esc->sync.next_true_ns) {
			esc_sync_edge(esc);
		} else if (next == esc->sync.next1_true_ns) {
			esc_sync1_edge(esc);
		} else if (next == esc->watchdog_deadline_ns) {
			esc_watchdog_expire(esc);
		} else if (next == esc->pdi_watchdog_deadline_ns) {
			esc_pdi_watchdog_expire(esc);
		} else {
			esc_eeprom_done(esc);
		}
	}
}
