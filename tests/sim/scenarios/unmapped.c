/* SPDX-License-Identifier: MIT */
/* T27: the working counter stays low though every AL status says OP: which slave is it? */
#include "base/bytes.h"
#include "harness/test.h"
#include "sim/harness/virtual_master.h"
#include "wire/datagram.h"
#include "wire/esc_reg.h"

enum { SLAVES = 30, SM_INPUTS = 3, FMMU_INPUTS = 1, ACTIVATE_OF_FMMU = 12 };

static struct virtual_bench b;
static struct virtual_master vm;

static const char *message(void)
{
	return session_page(vm.session)->message;
}

static uint32_t state(void)
{
	return atomic_load(&session_page(vm.session)->bus_state);
}

static void open_all(const char *datagrams)
{
	const char *const settings[] = { datagrams, NULL };

	virtual_bench_init(&b, &(struct virtual_spec){ .slaves = SLAVES, .seed = 27 });
	virtual_master_init(&vm, &b, settings);
	virtual_master_settle(&vm);
}

static void close_all(void)
{
	virtual_master_close(&vm);
}

/* Somebody else, as a tool with a socket of its own, writes to a register of @slave. */
static void write_behind_the_back(unsigned slave, unsigned reg, const void *data, size_t len)
{
	static const uint8_t source[6] = { 2, 2, 2, 2, 2, 2 };
	const struct esc_frame frame = { .pu_ns = virtual_bench_now_ns(&b) };
	struct esc *esc = segment_esc(b.segment, slave);
	uint8_t bytes[LIMIT_FRAME_BYTES];
	struct ecat_frame_builder fb;
	struct ecat_datagram dg;
	size_t pos = 0;
	uint8_t *to;

	ecat_frame_begin(&fb, bytes, source);
	to = ecat_frame_add(&fb, ECAT_CMD_BWR, 0, 0, (uint16_t)reg, (uint16_t)len);
	CHECK(to != NULL);
	memcpy(to, data, len);
	CHECK_EQ(ecat_frame_next(bytes, ecat_frame_end(&fb), &pos, &dg), 1);
	esc_frame_begin(esc);
	esc_datagram(esc, &frame, &dg);
	CHECK_EQ(get_le16(dg.wkc), 1);
}

static void check_named(const char *expected)
{
	virtual_master_forget(&vm);
	CHECK_EQ(virtual_master_run(&vm, 90), SESSION_GOES_ON);
	CHECK_EQ(state(), BUS_OP); /* as all AL states say */
	CHECK(vm.result.wkc_low > 80);
	CHECK_STR(message(), expected);
}

TEST(sim_unmapped, a_slave_whose_fmmu_was_switched_off_is_named_and_after_the_repair_no_longer)
{
	static const uint8_t on = 1;
	static const uint8_t off;
	enum { REG = ESC_REG_FMMU + FMMU_INPUTS * ESC_FMMU_BYTES + ACTIVATE_OF_FMMU };

	open_all(NULL);
	CHECK_STR(message(), "");
	write_behind_the_back(17, REG, &off, 1);
	check_named("working counter low while all slaves are in OP: slave 17 (piccolo17): its "
		    "FMMU1 is switched off (register 0x061c)");
	write_behind_the_back(17, REG, &on, 1);
	CHECK_EQ(virtual_master_run(&vm, 300), SESSION_GOES_ON);
	CHECK_STR(message(), "");
	virtual_master_forget(&vm);
	virtual_master_run(&vm, 300);
	CHECK_EQ(vm.result.bad, 0);
	close_all();
}

TEST(sim_unmapped, a_slave_whose_fmmu_points_elsewhere_is_named_with_datagrams_per_slave_too)
{
	uint8_t start[4];

	put_le32(start, 0x00700000);
	open_all("bus.datagrams=per_slave");
	write_behind_the_back(29, ESC_REG_FMMU + FMMU_INPUTS * ESC_FMMU_BYTES, start, 4);
	check_named("working counter low while all slaves are in OP: slave 29 (piccolo29): its "
		    "FMMU1 is not as programmed (register 0x0610)");
	close_all();
}

TEST(sim_unmapped, a_slave_whose_syncmanager_was_switched_off_is_named)
{
	static const uint8_t off;

	open_all(NULL);
	write_behind_the_back(2, ESC_REG_SM + SM_INPUTS * ESC_SM_BYTES + 6, &off, 1);
	virtual_master_run(&vm, 90);
	printf("%s\n", message());
	CHECK(strstr(message(), "slave 2 (piccolo2): ") != NULL);
	close_all();
}

TEST(sim_unmapped, a_slave_whose_application_switches_a_syncmanager_off_is_named)
{
	static const uint8_t off = 1;

	open_all(NULL);
	esc_pdi_write(segment_esc(b.segment, 5), virtual_bench_now_ns(&b),
		      ESC_REG_SM + SM_INPUTS * ESC_SM_BYTES + 7, &off, 1);
	check_named("working counter low while all slaves are in OP: slave 5 (piccolo5): its "
		    "application has switched off SM3 (register 0x081f)");
	close_all();
}
