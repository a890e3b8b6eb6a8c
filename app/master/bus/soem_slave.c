/* SPDX-License-Identifier: MIT */
/*
 * SOEM's table of slaves, filled from the SII that bus/sii_read.c read: what its mailbox and its
 * mapping look at, as ecx_config_init() would have set it.
 */
#include <errno.h>

#include "bus/bus_internal.h"
#include "bus/registers.h"

enum {
	MAILBOX_OUT = 0x00010026, /* SM flags: control, enable */
	MAILBOX_IN = 0x00010022,
	MAILBOX_OUT_START = 0x1000, /* where the SM category gives none */
	MAILBOX_IN_START = 0x1080,
	DEFAULT_BOX_BYTES = 128,
	FMMUS = 4,
	FMMU_UNUSED = 0xff,
	EEPROM_TO_PDI = 1,
};

static ec_smt sm_of(uint16_t start, uint16_t len, uint32_t flags)
{
	return (ec_smt){ .StartAddr = htoes(start),
			 .SMlength = htoes(len),
			 .SMflags = htoel(flags) };
}

static void set_mailbox(ec_slavet *soem, const struct sii *sii)
{
	soem->mbx_wo = sii->mailbox_out_start;
	soem->mbx_l = sii->mailbox_out_len;
	if (soem->mbx_l == 0) {
		return;
	}
	soem->mbx_ro = sii->mailbox_in_start;
	soem->mbx_rl = sii->mailbox_in_len != 0 ? sii->mailbox_in_len : soem->mbx_l;
	soem->mbx_proto = sii->mailbox_protocols;
	for (uint8_t i = 0; i < 4; i++) {
		soem->SMtype[i] = (uint8_t)(i + 1);
	}
	soem->SM[0] = sm_of(soem->mbx_wo, soem->mbx_l, MAILBOX_OUT);
	soem->SM[1] = sm_of(soem->mbx_ro, soem->mbx_rl, MAILBOX_IN);
}

static void set_sms(ec_slavet *soem, const struct sii *sii)
{
	for (size_t i = 0; i < sii->sm_count && i < EC_MAXSM; i++) {
		const struct sii_sm *sm = &sii->sm[i];

		soem->SM[i] = sm_of(sm->start, sm->len, sm->control | (uint32_t)sm->enable << 16);
	}
	if (soem->mbx_l > 0 && soem->SM[0].StartAddr == 0) {
		soem->SM[0] = sm_of(MAILBOX_OUT_START, DEFAULT_BOX_BYTES, MAILBOX_OUT);
	}
	if (soem->mbx_l > 0 && soem->SM[1].StartAddr == 0) {
		soem->SM[1] = sm_of(MAILBOX_IN_START, DEFAULT_BOX_BYTES, MAILBOX_IN);
	}
}

static void set_fmmus(ec_slavet *soem, const struct bus_slave *sl)
{
	uint8 *func[FMMUS] = { &soem->FMMU0func, &soem->FMMU1func, &soem->FMMU2func,
			       &soem->FMMU3func };
	size_t offset;
	size_t bytes;

	if (sii_find_category(sl->sii, sl->sii_len, SII_CATEGORY_FMMU, &offset, &bytes) < 0) {
		return;
	}
	for (size_t i = 0; i < FMMUS && i < bytes; i++) {
		if (sl->sii[offset + i] != FMMU_UNUSED) {
			*func[i] = sl->sii[offset + i];
		}
	}
}

/* In BOOT a slave serves FoE only. */
static struct mailbox_slave_spec boot_of(const struct bus_slave *sl, const struct sii *sii)
{
	return (struct mailbox_slave_spec){ .station_addr = sl->info.station_addr,
					    .out_start = sii->boot_out_start,
					    .out_bytes =
						    sii->boot_in_len > 0 ? sii->boot_out_len : 0,
					    .in_start = sii->boot_in_start,
					    .in_bytes = sii->boot_in_len,
					    .protocols = SII_MAILBOX_FOE };
}

void bus_soem_describe(struct bus *bus, size_t pos)
{
	ec_slavet *soem = &bus->soem_slave[soem_index(pos)];
	struct bus_slave *sl = &bus->slave[pos];
	const struct sii *sii = &bus->parsed;

	soem->eep_man = sii->vendor;
	soem->eep_id = sii->product;
	soem->eep_rev = sii->revision;
	soem->eep_sn = sii->serial;
	soem->CoEdetails = sii->coe_details;
	soem->FoEdetails = sii->foe_details;
	soem->EoEdetails = sii->eoe_details;
	soem->SoEdetails = sii->soe_channels;
	soem->Ebuscurrent = sii->ebus_ma;
	set_mailbox(soem, sii);
	set_sms(soem, sii);
	set_fmmus(soem, sl);
	sl->boot = boot_of(sl, sii);
}

int bus_mailbox_program(struct bus *bus, size_t pos, uint16_t state)
{
	ec_slavet *soem = &bus->soem_slave[soem_index(pos)];
	const struct mailbox_slave_spec *boot = &bus->slave[pos].boot;
	ec_smt sm[2] = { soem->SM[0], soem->SM[1] };
	uint8_t to_pdi = EEPROM_TO_PDI;
	struct access access[] = {
		/* What is enabled cannot be changed. */
		{ .reg = ESC_REG_SM, .len = sizeof(sm) },
		{ .reg = ESC_REG_SM, .len = sizeof(sm), .data = sm },
		{ .reg = ESC_REG_EEPROM_CONFIG, .len = sizeof(to_pdi), .data = &to_pdi },
	};
	enum { ACCESSES = sizeof(access) / sizeof(access[0]) };

	if (state == AL_BOOT) {
		sm[0] = sm_of(boot->out_start, boot->out_bytes, MAILBOX_OUT);
		sm[1] = sm_of(boot->in_start, boot->in_bytes, MAILBOX_IN);
	}
	for (size_t i = 0; i < ACCESSES; i++) {
		access[i].cmd = ECAT_CMD_FPWR;
		access[i].adp = bus->slave[pos].info.station_addr;
	}
	if (registers_run(bus, access, ACCESSES) < 0) {
		return -EIO;
	}
	soem->eep_pdi = 1;
	return access[1].wkc == 1 ? 0 : -ENXIO;
}

/* Both mailbox SMs in one datagram: old netX slaves need that. */
int bus_mailboxes_open(struct bus *bus)
{
	static uint8_t to_pdi[1] = { EEPROM_TO_PDI };
	static struct access access[2 * LIMIT_SLAVES];
	size_t count = 0;

	for (size_t i = 0; i < bus->slave_count; i++) {
		ec_slavet *soem = &bus->soem_slave[soem_index(i)];

		if (soem->mbx_l > 0) {
			access[count++] = (struct access){ .cmd = ECAT_CMD_FPWR,
							   .adp = soem->configadr,
							   .reg = ESC_REG_SM,
							   .len = 2 * ESC_SM_BYTES,
							   .data = &soem->SM[0] };
		}
		/* Some slaves' controllers need the EEPROM on their way to PRE-OP. */
		access[count++] = (struct access){ .cmd = ECAT_CMD_FPWR,
						   .adp = soem->configadr,
						   .reg = ESC_REG_EEPROM_CONFIG,
						   .len = 1,
						   .data = to_pdi };
		soem->eep_pdi = 1;
	}
	return registers_run(bus, access, count);
}
