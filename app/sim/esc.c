/* SPDX-License-Identifier: MIT */
#include "sim/esc.h"

#include <string.h>

#include "sim/esc_inside.h"
#include "wire/al.h"

const struct esc_features esc_et1100 = {
	.type = 0x11,
	.revision = 0x00,
	.build = 0x0003,
	.fmmu_count = 8,
	.sm_count = 8,
	.ram_kib = 8,
	.port_descriptor = 0x0f,
	.features = 0x01fc,
	.dc = ESC_DC_64,
	.has_sync_unit = 1,
	.eeprom_bytes_a_read = 8,
};

void esc_init(struct esc *esc, const struct esc_features *features, uint8_t *sii, size_t sii_bytes,
	      int64_t t_ns)
{
	uint8_t *r = esc->reg;

	memset(esc, 0, sizeof(*esc));
	esc->features = *features;
	esc->sii = sii;
	esc->sii_bytes = sii_bytes;
	esc->watchdog_deadline_ns = INT64_MAX;
	esc->sync.next_true_ns = INT64_MAX;
	esc_register_layout(esc);
	r[ESC_REG_TYPE] = features->type;
	r[ESC_REG_REVISION] = features->revision;
	put_le16(r + ESC_REG_BUILD, features->build);
	r[ESC_REG_FMMU_COUNT] = features->fmmu_count;
	r[ESC_REG_SM_COUNT] = features->sm_count;
	r[ESC_REG_RAM_SIZE] = features->ram_kib;
	r[ESC_REG_PORT_DESCRIPTOR] = features->port_descriptor;
	put_le16(r + ESC_REG_FEATURES, features->features);
	put_le32(r + ESC_REG_DL_CONTROL, 0x00070001);
	put_le16(r + ESC_REG_AL_CONTROL, AL_INIT);
	put_le16(r + ESC_REG_AL_STATUS, AL_INIT);
	put_le16(r + ESC_REG_WATCHDOG_DIVIDER, 0x09c2);
	put_le16(r + ESC_REG_WATCHDOG_TIME_PDI, 1000);
	put_le16(r + ESC_REG_WATCHDOG_TIME_PD, 1000);
	r[ESC_REG_WATCHDOG_STATUS_PD] = 1;
	put_le32(r + ESC_REG_AL_EVENT_MASK, 0x00ffff0f);
	put_le16(r + ESC_REG_DC_SPEED_COUNTER_START, 0x1000);
	r[ESC_REG_DC_TIME_FILTER] = 4;
	r[ESC_REG_DC_SPEED_FILTER] = 12;
	for (unsigned n = 0; n < features->sm_count; n++) {
		esc_sm_configure(esc, n, ESC_PDI);
	}
	esc->al_event = 0;
	esc_clock_start(esc, t_ns, 0, 0.0);
	esc_eeprom_power_on(esc, t_ns);
}

void esc_sync0_to(struct esc *esc, esc_sync0_sink sink, void *ctx)
{
	esc->sink = sink;
	esc->sink_ctx = ctx;
}

int esc_eeprom_loaded(const struct esc *esc)
{
	return esc->is_eeprom_loaded;
}

int esc_irq(const struct esc *esc)
{
	return (esc->al_event & get_le32(esc->reg + ESC_REG_AL_EVENT_MASK)) != 0;
}

void esc_set_links(struct esc *esc, uint8_t ports)
{
	uint16_t status = get_le16(esc->reg + ESC_REG_DL_STATUS) & 0x000f;

	for (unsigned port = 0; port < ESC_PORTS; port++) {
		int has_link = ports >> port & 1;

		status |= (uint16_t)(has_link << (4 + port));
		/* Without a link the loop closes by itself; with one there is communication. */
		status |= (uint16_t)((has_link ? 2u : 1u) << (8 + 2 * port));
	}
	put_le16(esc->reg + ESC_REG_DL_STATUS, status);
}

void esc_count_error(struct esc *esc, unsigned port, unsigned kind)
{
	static const uint16_t first[] = { ESC_REG_RX_ERROR_COUNTER, ESC_REG_RX_ERROR_COUNTER + 1,
					  ESC_REG_FORWARDED_RX_ERROR, ESC_REG_LOST_LINK_COUNTER };
	uint8_t *counter = &esc->reg[first[kind & 3] + port * ((kind & 3) < 2 ? 2u : 1u)];

	/* They stop at 0xff (data sheet). */
	if (*counter < 0xff) {
		(*counter)++;
	}
}

/* --- the wire --- */

static int read_memory(struct esc *esc, const struct esc_frame *frame, uint16_t addr, uint8_t *buf,
		       size_t len)
{
	if (addr >= ESC_REG_PROCESS_RAM) {
		return esc_ram_read(esc, ESC_ECAT, addr, buf, len);
	}
	return esc_register_read(esc, frame, addr, buf, len);
}

static int write_memory(struct esc *esc, const struct esc_frame *frame, uint16_t addr,
			const uint8_t *buf, size_t len)
{
	if (addr >= ESC_REG_PROCESS_RAM) {
		return esc_ram_write(esc, ESC_ECAT, frame->pu_ns, addr, buf, len);
	}
	return esc_register_write(esc, frame, addr, buf, len);
}

static void add_wkc(struct ecat_datagram *dg, int n)
{
	put_le16(dg->wkc, (uint16_t)(get_le16(dg->wkc) + n));
}

static void do_read(struct esc *esc, const struct esc_frame *frame, struct ecat_datagram *dg,
		    int is_broadcast)
{
	uint8_t got[ECAT_DATAGRAM_MAX_BYTES];

	if (!read_memory(esc, frame, dg->ado, got, dg->data_len)) {
		return;
	}
	for (size_t i = 0; i < dg->data_len; i++) {
		dg->data[i] = is_broadcast ? dg->data[i] | got[i] : got[i];
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

static int is_addressed(const struct esc *esc, const struct ecat_datagram *dg)
{
	uint16_t station = get_le16(esc->reg + ESC_REG_STATION_ADDRESS);
	uint16_t alias = get_le16(esc->reg + ESC_REG_STATION_ALIAS);
	int is_alias_on = esc->reg[ESC_REG_DL_CONTROL + 3] & 1;

	switch ((enum ecat_cmd)dg->cmd) {
	case ECAT_CMD_APRD:
	case ECAT_CMD_APWR:
	case ECAT_CMD_APRW:
	case ECAT_CMD_ARMW:
		return dg->adp == 0;
	case ECAT_CMD_FPRD:
	case ECAT_CMD_FPWR:
	case ECAT_CMD_FPRW:
	case ECAT_CMD_FRMW:
		return dg->adp == station || (is_alias_on && dg->adp == alias);
	case ECAT_CMD_BRD:
	case ECAT_CMD_BWR:
	case ECAT_CMD_BRW:
	case ECAT_CMD_LRD:
	case ECAT_CMD_LWR:
	case ECAT_CMD_LRW:
		return 1;
	case ECAT_CMD_NOP:
		break;
	}
	return 0;
}

/* Auto-increment and broadcast addresses count the slaves they have passed. */
static void increment_address(struct ecat_datagram *dg)
{
	switch ((enum ecat_cmd)dg->cmd) {
	case ECAT_CMD_APRD:
	case ECAT_CMD_APWR:
	case ECAT_CMD_APRW:
	case ECAT_CMD_ARMW:
	case ECAT_CMD_BRD:
	case ECAT_CMD_BWR:
	case ECAT_CMD_BRW:
		dg->adp++;
		put_le16(dg->data - ECAT_DATAGRAM_HEADER_BYTES + 2, dg->adp);
		break;
	case ECAT_CMD_NOP:
	case ECAT_CMD_FPRD:
	case ECAT_CMD_FPWR:
	case ECAT_CMD_FPRW:
	case ECAT_CMD_FRMW:
	case ECAT_CMD_LRD:
	case ECAT_CMD_LWR:
	case ECAT_CMD_LRW:
		break;
	}
}

void esc_datagram(struct esc *esc, const struct esc_frame *frame, struct ecat_datagram *dg)
{
	int addressed = is_addressed(esc, dg);

	switch ((enum ecat_cmd)dg->cmd) {
	case ECAT_CMD_NOP:
		return;
	case ECAT_CMD_APRD:
	case ECAT_CMD_FPRD:
	case ECAT_CMD_BRD:
		if (addressed) {
			do_read(esc, frame, dg, dg->cmd == ECAT_CMD_BRD);
		}
		break;
	case ECAT_CMD_APWR:
	case ECAT_CMD_FPWR:
	case ECAT_CMD_BWR:
		if (addressed) {
			do_write(esc, frame, dg);
		}
		break;
	case ECAT_CMD_APRW:
	case ECAT_CMD_FPRW:
	case ECAT_CMD_BRW:
		if (addressed) {
			do_read_write(esc, frame, dg, dg->cmd == ECAT_CMD_BRW);
		}
		break;
	case ECAT_CMD_LRD:
	case ECAT_CMD_LWR:
	case ECAT_CMD_LRW:
		esc_fmmu_access(esc, frame->pu_ns, dg);
		break;
	case ECAT_CMD_ARMW:
	case ECAT_CMD_FRMW:
		if (addressed) {
			do_read(esc, frame, dg, 0);
		} else {
			do_write(esc, frame, dg);
		}
		break;
	}
	increment_address(dg);
}

/* --- the PDI --- */

static void pdi_register_read(struct esc *esc, int64_t t_ns, uint16_t addr, size_t len)
{
	/* Reading is how the firmware acknowledges. */
	if (addr <= ESC_REG_AL_CONTROL && addr + len > ESC_REG_AL_CONTROL) {
		esc->al_event &= ~(uint32_t)ESC_AL_EVENT_CONTROL;
	}
	if (addr <= ESC_REG_WATCHDOG_STATUS_PD && addr + len > ESC_REG_WATCHDOG_STATUS_PD) {
		esc->al_event &= ~(uint32_t)ESC_AL_EVENT_WATCHDOG;
	}
	if (addr <= ESC_REG_DC_SYNC0_STATUS && addr + len > ESC_REG_DC_SYNC0_STATUS) {
		esc->al_event &= ~(uint32_t)ESC_AL_EVENT_SYNC0;
	}
	for (unsigned n = 0; n < esc->features.sm_count; n++) {
		size_t activate = ESC_REG_SM + n * ESC_SM_BYTES + 6u;

		if (addr <= activate && addr + len > activate) {
			esc->al_event &= ~(uint32_t)ESC_AL_EVENT_SM_ACTIVATION;
		}
	}
	(void)t_ns;
}

void esc_pdi_read(struct esc *esc, int64_t t_ns, uint16_t addr, void *buf, size_t len)
{
	struct esc_frame now = { .pu_ns = t_ns };

	memset(buf, 0, len);
	if (!esc->is_eeprom_loaded) {
		return;
	}
	if (addr >= ESC_REG_PROCESS_RAM) {
		esc_ram_read(esc, ESC_PDI, addr, buf, len);
		return;
	}
	esc_register_read(esc, &now, addr, buf, len);
	pdi_register_read(esc, t_ns, addr, len);
}

static void pdi_register_write(struct esc *esc, int64_t t_ns, uint16_t addr, uint8_t value)
{
	int is_sync = addr > ESC_REG_DC_CYCLIC_CONTROL && addr < ESC_REG_DC_SYNC1_CYCLE + 4;
	unsigned sm = (unsigned)(addr - ESC_REG_SM) / ESC_SM_BYTES;

	if (is_sync && esc->features.has_sync_unit) {
		if (esc->reg[ESC_REG_DC_CYCLIC_CONTROL] & 1) {
			esc->reg[addr] = value;
		}
	} else if ((addr >= ESC_REG_AL_STATUS && addr < ESC_REG_AL_STATUS_CODE + 2) ||
		   (addr >= ESC_REG_AL_EVENT_MASK && addr < ESC_REG_AL_EVENT_MASK + 4) ||
		   addr >= ESC_REG_USER_RAM) {
		esc->reg[addr] = value;
	} else if (addr >= ESC_REG_SM && sm < esc->features.sm_count && addr % ESC_SM_BYTES == 7) {
		esc->reg[addr] = value;
		esc_sm_configure(esc, sm, ESC_PDI);
	}
	if (addr == ESC_REG_DC_ACTIVATION && (esc->reg[ESC_REG_DC_CYCLIC_CONTROL] & 1)) {
		esc_sync_activate(esc, t_ns);
	}
}

void esc_pdi_write(struct esc *esc, int64_t t_ns, uint16_t addr, const void *buf, size_t len)
{
	const uint8_t *bytes = buf;

	if (!esc->is_eeprom_loaded) {
		return;
	}
	if (addr >= ESC_REG_PROCESS_RAM) {
		esc_ram_write(esc, ESC_PDI, t_ns, addr, buf, len);
		return;
	}
	for (size_t i = 0; i < len && addr + i < ESC_REGISTER_BYTES; i++) {
		pdi_register_write(esc, t_ns, (uint16_t)(addr + i), bytes[i]);
	}
}

/* --- its own events --- */

int64_t esc_next_event_ns(const struct esc *esc)
{
	int64_t next = esc->sync.next_true_ns;

	if (esc->watchdog_deadline_ns < next) {
		next = esc->watchdog_deadline_ns;
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
		} else if (next == esc->watchdog_deadline_ns) {
			esc_watchdog_expire(esc);
		} else {
			esc_eeprom_done(esc);
			esc->reg[ESC_REG_DL_STATUS] |= (uint8_t)esc->is_eeprom_loaded;
		}
	}
}
