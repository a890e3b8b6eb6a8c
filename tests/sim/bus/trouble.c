/* SPDX-License-Identifier: MIT */
/* What a user does wrong, and slaves that are not what they should be: one clear line each. */
#include <errno.h>

#include "base/bytes.h"
#include "bus/bus_internal.h"
#include "harness/test.h"
#include "sim/bus/bus_bench.h"
#include "wire/esc_reg.h"
#include "wire/sii.h"

TEST(trouble, a_segment_without_slaves_is_an_error)
{
	static const char *const settings[] = { "bus.scan_timeout=200ms", NULL };
	struct bus_bench *b = bench_create(
		&(struct bench_spec){ .piccolos = 1, .seed = 12, .settings = settings });

	segment_power_off(b->segment, 0, bench_now_ns(b));
	CHECK_EQ(bench_find(b), -ENODEV);
	CHECK(strstr(b->error, "no slave answers") != NULL);
	CHECK(strstr(b->error, "unchanged") == NULL);
	bench_destroy(b);
}

TEST(trouble, frames_that_return_unchanged_are_named_as_such)
{
	static const char *const settings[] = { "bus.scan_timeout=200ms", NULL };
	struct bus_bench *b = bench_create(
		&(struct bench_spec){ .piccolos = 1, .seed = 12, .settings = settings });
	char error[BUS_ERROR_BYTES];

	CHECK_EQ(fault_plan_add(b->faults, "p=1 mirror", 1, error, sizeof(error)), 0);
	CHECK_EQ(bench_find(b), -ENODEV);
	CHECK(strstr(b->error, "no slave answers on the line: frames return unchanged") != NULL);
	bench_destroy(b);
}

TEST(trouble, missing_slave_is_named_by_position_and_identity)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 1, .seed = 13 });

	b->cfg.slave_count = 2;
	b->cfg.slave[1].vendor = 2;
	b->cfg.slave[1].product = 0x04570862;
	CHECK_EQ(bench_find(b), -ENXIO);
	CHECK(strstr(b->error, "slave 1 is missing") != NULL);
	CHECK(strstr(b->error, "0x04570862") != NULL);
	bench_destroy(b);
}

TEST(trouble, cycle_below_a_slave_s_minimum_is_refused_with_the_remedy)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 2, .seed = 16 });

	b->cfg.cycle_period_ns = 99999;
	CHECK_EQ(bench_find(b), 0);
	CHECK_EQ(bench_map(b), -EPROTO);
	CHECK(strstr(b->error, "slave 0 (") == b->error);
	CHECK(strstr(b->error, "cycle.period 99999 ns is below the slave's minimum of 100000 ns "
			       "(0x1c32:05): set cycle.period to 100us or more") != NULL);
	b->cfg.cycle_period_ns = 100000;
	bench_new_master(b);
	CHECK_EQ(bench_find(b), 0);
	CHECK_EQ(bench_map(b), 0);
	bench_destroy(b);
}

TEST(trouble, blank_eeprom_is_an_error_and_no_hang)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 2, .seed = 14 });
	struct esc *esc = segment_esc(b->segment, 1);

	memset(esc->sii, 0xff, esc->sii_bytes);
	CHECK_EQ(bench_find(b), -EPROTO);
	CHECK(strstr(b->error, "slave 1") != NULL);
	CHECK(strstr(b->error, "EEPROM") != NULL);
	memset(esc->sii, 0x00, esc->sii_bytes);
	bench_new_master(b);
	CHECK_EQ(bench_find(b), -EPROTO);
	CHECK(bench_now_ns(b) < 20 * NS_PER_S);
	bench_destroy(b);
}

TEST(trouble, circular_category_list_ends_the_walk)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .sii = { "el2889" }, .seed = 15 });
	struct esc *esc = segment_esc(b->segment, 0);

	/* 0x80 + 4 + 2 * 0x7ffe is 0x80 again in 16 bits. */
	put_le16(esc->sii + 0x80, 3);
	put_le16(esc->sii + 0x82, 0x7ffe);
	CHECK_EQ(bench_find(b), -EPROTO);
	CHECK(strstr(b->error, "SYNC modes are unknown") != NULL);
	CHECK(strstr(b->error, "runs past the end") != NULL);
	bench_new_master(b);
	b->cfg.slave_count = 1;
	b->cfg.slave[0].assign_activate = CONFIG_ASSIGN_NONE;
	CHECK_EQ(bench_find(b), 0);
	CHECK_EQ(bench_map(b), -EPROTO);
	CHECK(strstr(b->error, "runs past the end") != NULL);
	bench_destroy(b);
}

/* Its categories are damaged, its words are not. What stands behind the damage is not guessed. */
TEST(trouble, damaged_sii_of_a_real_drive_is_named_where_its_contents_are_needed)
{
	struct bus_bench *b =
		bench_create(&(struct bench_spec){ .sii = { "akd-damaged" }, .seed = 16 });
	const struct slave_info *slave;
	size_t count;

	CHECK_EQ(bench_find(b), -EPROTO);
	CHECK(strstr(b->error, "slave 0 (") == b->error);
	CHECK(strstr(b->error, "its SYNC modes are unknown: SII: the category at byte 0x28a runs "
			       "past the end (2048 bytes)") != NULL);
	bench_new_master(b);
	b->cfg.slave_count = 1;
	b->cfg.slave[0].assign_activate = CONFIG_ASSIGN_NONE;
	CHECK_EQ(bench_find(b), 0);
	slave = bus_slaves(b->bus, &count);
	CHECK_EQ(count, 1);
	CHECK_EQ(slave->vendor, 0x6a);
	CHECK_EQ(slave->product, 0x414b44);
	CHECK_EQ(bench_map(b), -EPROTO);
	CHECK(strstr(b->error, "runs past the end") != NULL);
	CHECK(bench_now_ns(b) < 20 * NS_PER_S);
	bench_destroy(b);
}

TEST(trouble, mode_of_a_slave_that_has_none_is_refused)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .sii = { "el2889" }, .seed = 18 });

	b->cfg.slave_count = 1;
	b->cfg.slave[0].mode = CONFIG_MODE_ONESHOT;
	CHECK_EQ(bench_find(b), 0);
	CHECK_EQ(bench_map(b), -ENOTSUP);
	bench_destroy(b);
}

TEST(trouble, refused_startup_sdo_is_an_error_with_line_and_abort_code)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 1, .seed = 19 });

	b->cfg.slave_count = 1;
	b->cfg.sdo_count = 1;
	b->cfg.sdo[0] = (struct config_sdo){ .transition = CONFIG_TRANSITION_PS,
					     .index = 0x8000,
					     .subindex = 1,
					     .bytes = 1,
					     .value = 7,
					     .line = 12 };
	snprintf(b->cfg.path, sizeof(b->cfg.path), "ecdaq.yaml");
	CHECK_EQ(bench_find(b), 0);
	CHECK_EQ(bench_map(b), -EPROTO);
	CHECK(strstr(b->error, "0x8000:01") != NULL);
	CHECK(strstr(b->error, "ecdaq.yaml:12") != NULL);
	CHECK(strstr(b->error, "abort 0x06090030") != NULL);
	bench_destroy(b);
}

TEST(trouble, stop_before_any_slave_was_found_is_no_error)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 1, .seed = 20 });
	unsigned frames = bench_frames_sent(b);

	CHECK_EQ(bus_stop(b->bus, b->error), 0);
	/* INIT by broadcast: a scan that was interrupted may have left slaves in PRE-OP. */
	CHECK_EQ(bench_frames_sent(b), frames + 1);
	bench_destroy(b);
}

/* The contents of the SII's category @wanted. */
static uint8_t *sii_category(struct esc *esc, uint16_t wanted)
{
	size_t at = SII_CATEGORIES_BYTE;

	while (get_le16(esc->sii + at) != wanted) {
		at += 4 + 2 * (size_t)get_le16(esc->sii + at + 2);
		CHECK(at + 4 < esc->sii_bytes);
	}
	return esc->sii + at + 4;
}

/* CoE details (General, byte 5), and an input entry that only the object dictionary can name. */
static void set_coe_details(struct bus_bench *b, uint8_t details)
{
	struct esc *esc = segment_esc(b->segment, 0);
	uint8_t *entry = sii_category(esc, SII_CATEGORY_TXPDO) + 8;

	sii_category(esc, SII_CATEGORY_GENERAL)[5] = details;
	entry[3] = 0; /* name */
	entry[4] = 0; /* data type */
}

static void note_event(void *ctx, const struct event *ev)
{
	struct event *last = ctx;

	CHECK_EQ(last->id, EVENT_NONE);
	*last = *ev;
}

/* Its mapping is fixed: CoE details have neither PDO assignment nor configuration. */
TEST(trouble, coe_is_used_where_the_sii_states_another_length_and_an_event_reports_it_once)
{
	enum { SM_OUTPUTS = 2, SM_BYTES = 8, SM_LENGTH = 2 };
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 1, .seed = 22 });
	struct event seen = { .id = EVENT_NONE };
	uint8_t *length = sii_category(segment_esc(b->segment, 0), SII_CATEGORY_SM) +
			  SM_OUTPUTS * SM_BYTES + SM_LENGTH;
	uint16_t by_coe = get_le16(length);

	put_le16(length, (uint16_t)(by_coe + 2));
	bus_listen(b->bus, note_event, &seen);
	bench_bring_up(b);
	CHECK_EQ(seen.id, EVENT_SM_LENGTH);
	CHECK_EQ(seen.slave_pos, 0);
	CHECK_EQ(seen.arg[0], SM_OUTPUTS);
	CHECK_EQ(seen.arg[1], by_coe);
	CHECK_EQ(seen.value, by_coe + 2);
	CHECK_EQ(get_le16(segment_esc(b->segment, 0)->reg + ESC_REG_SM + SM_OUTPUTS * ESC_SM_BYTES +
			  SM_LENGTH),
		 by_coe);
	bench_destroy(b);
}

TEST(trouble, equal_lengths_by_coe_and_sii_are_no_event)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 1, .seed = 22 });
	struct event seen = { .id = EVENT_NONE };

	bus_listen(b->bus, note_event, &seen);
	bench_bring_up(b);
	CHECK_EQ(seen.id, EVENT_NONE);
	bench_destroy(b);
}

static unsigned mailbox_writes_of_bring_up(uint8_t coe_details)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 1, .seed = 21 });
	unsigned writes;

	set_coe_details(b, coe_details);
	CHECK_EQ(bench_find(b), 0);
	CHECK_EQ(bench_map(b), 0);
	writes = bench_mailbox_writes(b);
	bench_destroy(b);
	return writes;
}

TEST(trouble, sdo_information_is_not_requested_from_a_slave_without_it)
{
	enum { SDO = 0x01, SDO_INFORMATION = 0x02, PDO_ASSIGN = 0x04 };
	unsigned without = mailbox_writes_of_bring_up(SDO);

	CHECK(without > 0);
	CHECK(mailbox_writes_of_bring_up(SDO | SDO_INFORMATION) > without);
	CHECK_EQ(mailbox_writes_of_bring_up(SDO | PDO_ASSIGN), without);
}

/*
 * A slave of another identity, without CoE, with inputs of @entries times 255 bits that have no
 * name. Its SII ends behind them.
 */
static void set_inputs_of_sii(struct esc *esc, uint8_t entries)
{
	enum { PDO_HEAD_BYTES = 8, ENTRY_BYTES = 8, PRODUCT = 0x14, PROTOCOLS = 0x38 };
	uint8_t *pdo = sii_category(esc, SII_CATEGORY_TXPDO);
	size_t bytes = PDO_HEAD_BYTES + ENTRY_BYTES * (size_t)entries;

	CHECK(pdo + bytes + 2 <= esc->sii + esc->sii_bytes);
	esc->sii[PRODUCT]++;
	put_le16(esc->sii + PROTOCOLS, 0);
	put_le16(pdo - 2, (uint16_t)(bytes / 2));
	pdo[2] = entries;
	memset(pdo + PDO_HEAD_BYTES, 0, bytes - PDO_HEAD_BYTES);
	for (size_t i = 0; i < entries; i++) {
		pdo[PDO_HEAD_BYTES + i * ENTRY_BYTES + 5] = 255; /* bit length */
	}
	put_le16(pdo + bytes, SII_CATEGORY_END);
}

/* 50 * 255 bits, behind the outputs of slave 0 in the image. */
TEST(trouble, inputs_longer_than_a_frame_are_refused_with_their_length)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 2, .seed = 23 });

	set_inputs_of_sii(segment_esc(b->segment, 1), 50);
	CHECK_EQ(bench_find(b), 0);
	CHECK_EQ(bench_map(b), -E2BIG);
	CHECK(strstr(b->error, "slave 1 (") == b->error);
	CHECK(strstr(b->error, ": SM3 has 1594 bytes: they do not fit in one frame and must not "
			       "be split") != NULL);
	bench_destroy(b);
}

/* Before mapping a slave has neither inputs nor outputs. */
TEST(trouble, sync_objects_are_not_read_of_a_slave_without_inputs_and_outputs)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 1, .seed = 24 });
	unsigned writes;

	CHECK_EQ(bench_find(b), 0);
	writes = bench_mailbox_writes(b);
	CHECK_EQ(bus_sync_limits(b->bus, 0), 0);
	CHECK_EQ(bench_mailbox_writes(b), writes);
	CHECK_EQ(bench_map(b), 0);
	writes = bench_mailbox_writes(b);
	CHECK_EQ(bus_sync_limits(b->bus, 0), 0);
	CHECK_EQ(bench_mailbox_writes(b), writes + 4);
	bench_destroy(b);
}

/* The broadcast that stops SYNC units does not reach one that belongs to the slave's controller. */
TEST(trouble, sync_unit_that_an_earlier_master_left_active_is_switched_off)
{
	for (uint8_t owner = 0; owner <= 1; owner++) {
		struct bus_bench *b =
			bench_create(&(struct bench_spec){ .piccolos = 1, .seed = 22 });
		struct esc *esc = segment_esc(b->segment, 0);

		esc->reg[ESC_REG_DC_CYCLIC_CONTROL] = owner;
		esc->reg[ESC_REG_DC_ACTIVATION] = 0x03;
		CHECK_EQ(bench_find(b), 0);
		CHECK_EQ(esc->reg[ESC_REG_DC_CYCLIC_CONTROL], 0);
		CHECK_EQ(esc->reg[ESC_REG_DC_ACTIVATION], 0);
		bench_destroy(b);
	}
}
