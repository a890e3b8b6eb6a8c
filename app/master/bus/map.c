/* SPDX-License-Identifier: MIT */
/*
 * Process data: what each slave maps (CoE, else SII), where SOEM puts it in the image, which
 * channels, datagrams and working counters follow from that. SOEM programs SyncManagers and FMMUs;
 * the mapping is read here, so that a lost mailbox answer is an error and not an empty mapping
 * (T42).
 */
#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "bus/bus_internal.h"
#include "bus/channel_rules.h"
#include "bus/channels.h"
#include "bus/plan.h"
#include "bus/registers.h"

enum {
	SM_TYPE_OUTPUTS = 3,
	SM_TYPE_INPUTS = 4,
	FMMU_INPUTS = 1,
	FMMU_OUTPUTS = 2,
	WATCHDOG_DIVIDER = 0x09c2, /* (2498 + 2) * 40 ns = 100 us */
	WATCHDOG_UNIT_NS = 100000,
};

static uint32_t bytes_of(uint32_t bits)
{
	return (bits + 7) / 8;
}

/* --- what the slave maps --- */

/* CoE gives index and length; the SII often has the name and type. */
static void borrow_names(const struct bus *bus, size_t pos, struct pdo_entry *entry, size_t count,
			 size_t sii_count)
{
	const struct pdo_entry *sii = entry + count;

	for (size_t i = 0; i < count; i++) {
		for (size_t k = 0; k < sii_count && entry[i].index != 0; k++) {
			if (sii[k].index == entry[i].index &&
			    sii[k].subindex == entry[i].subindex) {
				memcpy(entry[i].name, sii[k].name, sizeof(entry[i].name));
				entry[i].data_type = sii[k].data_type;
				break;
			}
		}
		if (entry[i].index != 0) {
			bus_sii_complete(bus, pos, &entry[i]);
		}
	}
}

static int read_entries(struct bus *bus, size_t pos)
{
	struct bus_slave *sl = &bus->slave[pos];
	struct pdo_entry *entry = &bus->pdo[bus->pdo_count];
	size_t capacity = PDO_LIMIT - bus->pdo_count;
	int coe = 0;
	int sii;

	if (bus_has_coe(bus, pos)) {
		coe = bus_coe_entries(bus, pos, entry, capacity);
		if (coe < 0) {
			return coe;
		}
	}
	sii = bus_sii_entries(bus, pos, entry + coe, capacity - (size_t)coe);
	if (coe == 0 && sii < 0) {
		return sii;
	}
	if (coe > 0) {
		borrow_names(bus, pos, entry, (size_t)coe, sii > 0 ? (size_t)sii : 0);
		if (bus_coe_names(bus, pos, entry, (size_t)coe) < 0) {
			return -EAGAIN;
		}
	}
	bus_esi_names(bus, pos, entry, (size_t)(coe > 0 ? coe : sii));
	sl->pdo_first = bus->pdo_count;
	sl->pdo_count = (size_t)(coe > 0 ? coe : sii);
	sl->is_mapped_by_coe = coe > 0;
	bus->pdo_count += sl->pdo_count;
	return 0;
}

/* --- the image --- */

static uint32_t fmmu_bytes(const ec_slavet *soem, unsigned type)
{
	uint32_t sum = 0;

	for (unsigned i = 0; i < EC_MAXFMMU; i++) {
		if (soem->FMMU[i].FMMUactive && soem->FMMU[i].FMMUtype == type) {
			sum += etohs(soem->FMMU[i].LogLength);
		}
	}
	return sum;
}

static int check_mapped(struct bus *bus, size_t pos)
{
	const ec_slavet *soem = &bus->soem_slave[soem_index(pos)];
	uint32_t out = fmmu_bytes(soem, FMMU_OUTPUTS);
	uint32_t in = fmmu_bytes(soem, FMMU_INPUTS);

	if ((soem->Obits > 0 && (out == 0 || out < soem->Obytes)) ||
	    (soem->Ibits > 0 && (in == 0 || in < soem->Ibytes))) {
		return bus_fail_slave(
			bus, pos, -EPROTO,
			"%u bits of outputs and %u bits of inputs do not fit into its FMMUs",
			soem->Obits, soem->Ibits);
	}
	return 0;
}

/* The image while it is built. */
struct layout {
	const uint8_t *image; /* what SOEM's places count from */
	struct plan_area area[PLAN_AREAS];
	size_t area_count;
};

/* Where the slave's SMs of one direction begin, and the areas they take. */
static void place_direction(const struct bus *bus, size_t pos, int is_output, struct layout *lay,
			    struct channels_place *place)
{
	const ec_slavet *soem = &bus->soem_slave[soem_index(pos)];
	const uint8_t *base = is_output ? soem->outputs : soem->inputs;
	uint32_t start_bit = is_output ? soem->Ostartbit : soem->Istartbit;
	uint32_t bits = is_output ? soem->Obits : soem->Ibits;
	uint32_t at;

	if (bits == 0) {
		return;
	}
	at = (uint32_t)(base - lay->image);
	for (unsigned n = 0; n < EC_MAXSM; n++) {
		uint32_t bytes = etohs(soem->SM[n].SMlength);

		if (soem->SMtype[n] != (is_output ? SM_TYPE_OUTPUTS : SM_TYPE_INPUTS)) {
			continue;
		}
		place->bit_offset[n] = at * 8 + start_bit;
		lay->area[lay->area_count++] = (struct plan_area){
			.start = at,
			.end = bits < 8 ? at + bytes_of(start_bit + bits) : at + bytes,
			.slave_pos = (uint16_t)pos,
			.sm = (uint8_t)n,
			.is_output = (uint8_t)is_output,
			.is_lrw_forbidden = bus->slave[pos].is_lrw_forbidden,
		};
		at += bytes;
	}
}

static int build_channels(struct bus *bus, struct layout *lay)
{
	struct channels_table table = { .channel = bus->channel, .capacity = LIMIT_CHANNELS };

	for (size_t i = 0; i < bus->slave_count; i++) {
		struct bus_slave *sl = &bus->slave[i];
		struct channels_place place = { 0 };
		int r = check_mapped(bus, i);

		if (r < 0) {
			return r;
		}
		place_direction(bus, i, 1, lay, &place);
		place_direction(bus, i, 0, lay, &place);
		r = channels_add(&sl->info, &bus->pdo[sl->pdo_first], sl->pdo_count, &place,
				 &table);
		if (r < 0) {
			return bus_fail_slave(bus, i, r, "more channels than LIMIT_CHANNELS (%d)",
					      LIMIT_CHANNELS);
		}
	}
	bus->channel_count = table.count;
	return 0;
}

static struct channel_rules_of rules_of(const struct bus *bus, size_t pos)
{
	size_t first;
	size_t count = channels_of(bus->channel, bus->channel_count, (uint16_t)pos, &first);

	return (struct channel_rules_of){ .cfg = bus->cfg,
					  .slave = &bus->slave[pos].info,
					  .channel = &bus->channel[first],
					  .count = count };
}

/* slaves[].channels[]: all are checked before the first is applied, so that the names of the
 * device are there to compare with after a failure. */
static int apply_channel_rules(struct bus *bus)
{
	char unused[BUS_ERROR_BYTES];
	int r = 0;

	for (size_t i = 0; i < bus->slave_count && r >= 0; i++) {
		const struct channel_rules_of of = rules_of(bus, i);

		r = channel_rules_check(&of, bus->error != NULL ? bus->error : unused,
					BUS_ERROR_BYTES);
	}
	for (size_t i = 0; i < bus->slave_count && r >= 0; i++) {
		const struct channel_rules_of of = rules_of(bus, i);

		r = channel_rules_apply(&of);
	}
	return r;
}

static int build_plan(struct bus *bus, const struct plan_area *area, size_t area_count)
{
	const ec_groupt *group = &bus->group[0];
	unsigned mailbox_bits = 0;
	int blocked = -1;

	if (bus->cfg->bus_monitor &&
	    bus_mailbox_state_map(bus, group->logstartaddr + group->Obytes + group->Ibytes,
				  &mailbox_bits) < 0) {
		return bus_fail(bus, -EIO, "FMMUs of the mailbox states: frames are lost");
	}
	bus->plan = (struct exchange_plan){
		.image_bytes = group->Obytes + group->Ibytes,
		.output_bytes = group->Obytes,
		.logical_start = group->logstartaddr,
		.mailbox_bits = (uint16_t)mailbox_bits,
		.slave_count = (uint16_t)bus->slave_count,
		.is_split = bus->cfg->bus_datagrams == CONFIG_DATAGRAMS_PER_SLAVE,
		.monitor = (int)bus->cfg->bus_monitor,
		/* room for FRMW is always reserved; bus_dc_setup() sets its slave */
		.dc_reference = UINT16_MAX,
	};
	if (plan_chunks(&bus->plan, area, area_count, &blocked) < 0) {
		if (blocked < 0) {
			return bus_fail(
				bus, -E2BIG,
				"%u bytes of process data need more than LIMIT_FRAMES (%d) frames "
				"or LIMIT_CHUNKS (%d) datagrams",
				bus->plan.image_bytes, LIMIT_FRAMES, LIMIT_CHUNKS);
		}
		return bus_fail_slave(
			bus, area[blocked].slave_pos, -E2BIG,
			"SM%u has %u bytes: they do not fit in one frame and must not be split",
			area[blocked].sm, area[blocked].end - area[blocked].start);
	}
	bus->plan.dc_reference = 0;
	return 0;
}

/* --- watchdog --- */

/* A slave without the register keeps what it has; one that stores another value than the one
 * written is an error (T08). */
static int set_watchdog(struct bus *bus, size_t pos)
{
	int64_t time = (bus->cfg->bus_watchdog_ns + WATCHDOG_UNIT_NS - 1) / WATCHDOG_UNIT_NS;
	uint8_t wanted[2][2];
	const uint16_t reg[2] = { ESC_REG_WATCHDOG_DIVIDER, ESC_REG_WATCHDOG_TIME_PD };

	if (bus->cfg->bus_watchdog_ns == 0 || bus->slave[pos].info.output_bits == 0) {
		return 0;
	}
	put_le16(wanted[0], WATCHDOG_DIVIDER);
	put_le16(wanted[1], (uint16_t)(time > UINT16_MAX ? UINT16_MAX : time));
	for (int i = 0; i < 2; i++) {
		uint8_t got[2] = { 0 };

		register_write(bus, pos, reg[i], wanted[i], sizeof(wanted[i]));
		if (register_read(bus, pos, reg[i], got, sizeof(got)) == 0 &&
		    memcmp(got, wanted[i], sizeof(got)) != 0) {
			return bus_fail_slave(
				bus, pos, -EPROTO,
				"watchdog register 0x%04x reads 0x%04x after 0x%04x was written",
				reg[i], get_le16(got), get_le16(wanted[i]));
		}
	}
	return 0;
}

/* --- public --- */

int bus_restore_mapping(struct bus *bus, size_t pos)
{
	const ec_slavet *soem = &bus->soem_slave[soem_index(pos)];
	int r = 0;

	for (unsigned n = 0; n < EC_MAXSM && r >= 0; n++) {
		if (soem->SM[n].StartAddr != 0) {
			r = register_write(bus, pos, (uint16_t)(ESC_REG_SM + n * ESC_SM_BYTES),
					   &soem->SM[n], ESC_SM_BYTES);
		}
	}
	for (unsigned i = 0; i < EC_MAXFMMU && r >= 0; i++) {
		if (soem->FMMU[i].FMMUactive) {
			r = register_write(bus, pos, (uint16_t)(ESC_REG_FMMU + i * ESC_FMMU_BYTES),
					   &soem->FMMU[i], ESC_FMMU_BYTES);
		}
	}
	return r < 0 ? r : set_watchdog(bus, pos);
}

static int ask_entries(struct bus *bus, size_t pos)
{
	int r = read_entries(bus, pos);

	bus->pdo_count = 0;
	return r;
}

static int read_mapping(struct bus *bus)
{
	uint32_t total_bytes = 0;
	int r = bus_read_ahead(bus, ask_entries);

	for (size_t i = 0; i < bus->slave_count && r >= 0; i++) {
		r = read_entries(bus, i);
		if (r >= 0) {
			r = bus_map_sm(bus, i, &total_bytes);
		}
	}
	bus_read_ahead_end(bus);
	return r;
}

static int read_limits(struct bus *bus)
{
	int r = bus_read_ahead(bus, bus_sync_limits);

	for (size_t i = 0; i < bus->slave_count && r >= 0; i++) {
		r = bus_sync_limits(bus, i);
	}
	bus_read_ahead_end(bus);
	return r;
}

static int read_all(struct bus *bus)
{
	int r = bus_pdos_plan(bus, 0, bus->slave_count);

	r = r < 0 ? r : bus_startup_all(bus, CONFIG_TRANSITION_PS);
	r = r < 0 ? r : read_mapping(bus);
	return r < 0 ? r : read_limits(bus);
}

/* At their limits while their sizes are not known. */
static int make_tables(struct bus *bus)
{
	free(bus->pdo);
	free(bus->channel);
	bus->pdo_count = 0;
	bus->channel_count = 0;
	bus->pdo = calloc(PDO_LIMIT, sizeof(bus->pdo[0]));
	bus->channel = calloc(LIMIT_CHANNELS, sizeof(bus->channel[0]));
	return bus->pdo != NULL && bus->channel != NULL
		       ? 0
		       : bus_fail(bus, -ENOMEM, "no memory for the channel table");
}

/* Memory of ecdaqd is locked: what is not used is given back. */
static void shrink_tables(struct bus *bus)
{
	void *pdo = realloc(bus->pdo, (bus->pdo_count + 1) * sizeof(bus->pdo[0]));
	void *channel = realloc(bus->channel, (bus->channel_count + 1) * sizeof(bus->channel[0]));

	bus->pdo = pdo != NULL ? pdo : bus->pdo;
	bus->channel = channel != NULL ? channel : bus->channel;
}

/* Its entries are not kept: they have no place in an image. */
int bus_map_one(struct bus *bus, size_t pos)
{
	struct bus_slave *sl = &bus->slave[pos];
	uint32_t bytes = 0;
	int r = make_tables(bus);

	r = r < 0 ? r : read_entries(bus, pos);
	r = r < 0 ? r : bus_map_sm(bus, pos, &bytes);
	sl->pdo_count = 0;
	bus->pdo_count = 0;
	shrink_tables(bus);
	return r < 0 ? r : bus_restore_mapping(bus, pos);
}

int bus_map(struct bus *bus, char *error)
{
	static const uint8_t image[LIMIT_IMAGE_BYTES]; /* SOEM only computes places in it */
	struct layout lay = { .image = image };
	int r;

	bus->error = error;
	r = make_tables(bus);
	r = r < 0 ? r : read_all(bus);
	if (r < 0) {
		return r;
	}
	ecx_config_map_group(&bus->context, (void *)(uintptr_t)image, 0);
	r = build_channels(bus, &lay);
	r = r < 0 ? r : apply_channel_rules(bus);
	if (r >= 0) {
		r = build_plan(bus, lay.area, lay.area_count);
	}
	for (size_t i = 0; i < bus->slave_count && r >= 0; i++) {
		r = set_watchdog(bus, i);
	}
	shrink_tables(bus);
	bus_publish_slaves(bus);
	return r;
}
