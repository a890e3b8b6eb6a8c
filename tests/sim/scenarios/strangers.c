/* SPDX-License-Identifier: MIT */
/*
 * Devices of other masters that join a bus in OP (T32): with an address that one of ours has, with
 * the reference clock's, with none. They are isolated, named, neither configured nor believed, and
 * when they leave, all is as before.
 */
#include "base/bytes.h"
#include "devices/fb1111_piccolo.h"
#include "harness/test.h"
#include "sim/harness/virtual_master.h"
#include "wire/al.h"
#include "wire/esc_reg.h"

enum { SLAVES = 3, FMMU_ACTIVE = 12, PARKING_FIRST = 0x7e00 };

static struct virtual_bench b;
static struct virtual_master vm;
static unsigned stranger;

static const struct status_page *page(void)
{
	return session_page(vm.session);
}

static uint32_t state(void)
{
	return atomic_load(&page()->bus_state);
}

static struct esc *stranger_esc(void)
{
	return segment_esc(b.segment, stranger);
}

/* Two of three boards in OP; the one at @position is not plugged in yet. */
static void open_without(unsigned position)
{
	static const char *const settings[] = { "slaves[0].name=a", "slaves[1].name=b", NULL };

	stranger = position;
	virtual_bench_init(
		&b, &(struct virtual_spec){ .slaves = SLAVES, .seed = 5, .ppm = { 30, -40, 15 } });
	CHECK_EQ(segment_unplug(b.segment, position, virtual_bench_now_ns(&b)), 0);
	virtual_master_init(&vm, &b, settings);
	virtual_master_settle(&vm);
}

static void close_all(void)
{
	virtual_master_close(&vm);
}

/* Another master has set its clock and its FMMU and led it to SAFE-OP. */
static void plug_in(uint16_t address)
{
	struct esc *esc = stranger_esc();

	put_le16(esc->reg + ESC_REG_STATION_ADDRESS, address);
	put_le64(esc->reg + ESC_REG_DC_SYSTEM_TIME_OFFSET, UINT64_C(0x123456789abc));
	esc->reg[ESC_REG_FMMU + FMMU_ACTIVE] = 1;
	esc_force_al_status(esc, AL_SAFEOP, 0);
	CHECK_EQ(segment_plug(b.segment, stranger, virtual_bench_now_ns(&b)), 0);
}

static int was_fail_safe;
static unsigned cycles_since;
static unsigned isolated_after; /* cycles until its address was taken away; 0: not yet */

static void note_cycle(struct virtual_master *master)
{
	uint16_t address = get_le16(stranger_esc()->reg + ESC_REG_STATION_ADDRESS);

	was_fail_safe += (int)atomic_load(&session_page(master->session)->cycle.is_fail_safe);
	cycles_since++;
	if (isolated_after == 0 && address >= PARKING_FIRST) {
		isolated_after = cycles_since;
	}
}

/* How many cycles after cycle @from the frames showed that another number answers. */
static int64_t noticed_after(uint64_t from)
{
	struct ring_reader *reader;
	struct event ev;
	uint64_t lost;
	char path[200];
	int64_t cycle = INT64_MAX;

	snprintf(path, sizeof(path), "%s/" CONFIG_RUN_EVENTS, vm.dir);
	CHECK_EQ(ring_reader_open(path, &reader), 0);
	ring_seek(reader, ring_oldest(reader));
	while (ring_read(reader, &ev, sizeof(ev), &lost) == RING_OK) {
		if (ev.id == EVENT_SLAVE_COUNT && ev.value >= (int64_t)from && cycle == INT64_MAX) {
			cycle = ev.value;
		}
	}
	ring_reader_destroy(reader);
	return cycle - (int64_t)from;
}

static void check_isolated(uint16_t address)
{
	const struct esc *esc = stranger_esc();

	CHECK(get_le16(esc->reg + ESC_REG_STATION_ADDRESS) != address || address == 0);
	CHECK_EQ(esc->reg[ESC_REG_AL_STATUS] & AL_STATE_MASK, AL_INIT);
	for (unsigned i = 0; i < 8; i++) {
		CHECK_EQ(esc->reg[ESC_REG_FMMU + i * ESC_FMMU_BYTES + FMMU_ACTIVE] & 1, 0);
	}
}

static void check_stranger(unsigned position, uint16_t address, const char *owner)
{
	int64_t offset_ns;
	uint64_t from;

	open_without(position);
	virtual_master_forget(&vm);
	was_fail_safe = 0;
	cycles_since = 0;
	isolated_after = 0;
	vm.each_cycle = note_cycle;
	from = virtual_master_sample(&vm)->cycle;
	plug_in(address);
	CHECK_EQ(virtual_master_run(&vm, 3000), SESSION_GOES_ON);
	printf("position %u, address 0x%04x: noticed after %lld cycles, isolated after %u, %d "
	       "fail-safe, %llu bad samples: %s\n",
	       position, address, (long long)noticed_after(from), isolated_after, was_fail_safe,
	       (unsigned long long)vm.result.bad, page()->message);
	CHECK(noticed_after(from) <= 2);
	CHECK(isolated_after > 0);
	CHECK(isolated_after <= 12);
	check_isolated(address);
	CHECK_EQ(state(), BUS_OP);
	CHECK(strstr(page()->message, "not configured") != NULL);
	CHECK(strstr(page()->message, "vendor 0x00000002 product 0x04570862") != NULL);
	if (owner != NULL) {
		CHECK(strstr(page()->message, owner) != NULL);
	}
	CHECK(was_fail_safe <= 2);
	CHECK_EQ(atomic_load(&page()->cycle.dc_unlocks), 0);
	offset_ns = virtual_master_sample(&vm)->frame_dc_ns;
	virtual_master_run(&vm, 6000);
	/* Its clock was never taken for the reference. */
	CHECK(virtual_master_sample(&vm)->frame_dc_ns - offset_ns < 6100 * NS_PER_MS);
	CHECK(virtual_master_sample(&vm)->frame_dc_ns - offset_ns > 5900 * NS_PER_MS);
	CHECK_EQ(segment_unplug(b.segment, position, virtual_bench_now_ns(&b)), 0);
	virtual_master_run(&vm, 1000);
	CHECK_STR(page()->message, "");
	CHECK_EQ(state(), BUS_OP);
	virtual_master_forget(&vm);
	virtual_master_run(&vm, 1000);
	CHECK_EQ(vm.result.op, vm.result.samples);
	CHECK_EQ(vm.result.bad, 0);
	close_all();
}

TEST(sim_strangers, a_fresh_device_behind_the_last_slave)
{
	check_stranger(2, 0, NULL);
}

TEST(sim_strangers, a_device_with_the_address_of_the_reference_clock)
{
	check_stranger(2, 0x1001, "slave 0 (a)");
}

TEST(sim_strangers, a_device_with_the_address_of_another_slave)
{
	check_stranger(2, 0x1002, "slave 1 (b)");
}

TEST(sim_strangers, a_device_with_a_used_address_in_front_of_its_owner)
{
	check_stranger(0, 0x1001, "slave 0 (a)");
}

TEST(sim_strangers, a_device_with_a_used_address_between_the_slaves)
{
	check_stranger(1, 0x1002, "slave 1 (b)");
}

/* It has even what this session has written to slave b: neither is believed, b is found again by
 * its place. */
TEST(sim_strangers, a_device_with_all_the_marks_of_a_slave_is_not_taken_for_it)
{
	const struct esc *original;
	struct esc *copy;
	int ms = 0;

	open_without(2);
	original = segment_esc(b.segment, 1);
	copy = stranger_esc();
	memcpy(copy->reg + ESC_REG_FMMU, original->reg + ESC_REG_FMMU, 8 * ESC_FMMU_BYTES);
	memcpy(copy->reg + ESC_REG_DC_SYSTEM_TIME_OFFSET,
	       original->reg + ESC_REG_DC_SYSTEM_TIME_OFFSET, 8);
	put_le16(copy->reg + ESC_REG_STATION_ADDRESS, 0x1002);
	CHECK_EQ(segment_plug(b.segment, 2, virtual_bench_now_ns(&b)), 0);
	virtual_master_run(&vm, 30);
	CHECK(get_le16(copy->reg + ESC_REG_STATION_ADDRESS) != 0x1002);
	CHECK(get_le16(original->reg + ESC_REG_STATION_ADDRESS) != 0x1002);
	while ((state() != BUS_OP || ms < 100) && ms < 5000) {
		virtual_master_run(&vm, 10);
		ms += 10;
	}
	CHECK_EQ(state(), BUS_OP);
	CHECK_EQ(get_le16(original->reg + ESC_REG_STATION_ADDRESS), 0x1002);
	CHECK(strstr(page()->message, "position 2: a device that is not configured") != NULL);
	close_all();
}

/* It was isolated before, and its address was given to another guest meanwhile. */
TEST(sim_strangers, two_devices_with_the_same_isolation_address_are_told_apart)
{
	int ms = 0;

	open_without(2);
	virtual_bench_fault(&b, "at=0s power-off slave=1");
	virtual_master_run(&vm, 300);
	put_le16(stranger_esc()->reg + ESC_REG_STATION_ADDRESS, PARKING_FIRST);
	virtual_bench_fault(&b, "at=0s power-on slave=1");
	CHECK_EQ(segment_plug(b.segment, 2, virtual_bench_now_ns(&b)), 0);
	CHECK(state() != BUS_OP);
	while (state() != BUS_OP && ms < 5000) {
		virtual_master_run(&vm, 10);
		ms += 10;
	}
	CHECK_EQ(state(), BUS_OP);
	virtual_master_run(&vm, 200);
	CHECK(get_le16(stranger_esc()->reg + ESC_REG_STATION_ADDRESS) >= PARKING_FIRST);
	CHECK(strstr(page()->message, "position 2: a device that is not configured") != NULL);
	close_all();
}

/* --- two equal slaves on two ports of one --- */

static int tree_slave(int position, struct segment_slave_spec *ret_spec)
{
	int r = fb1111_piccolo_slave(position, ret_spec);

	if (position > 0) {
		ret_spec->parent = 0;
		ret_spec->parent_port = position == 1 ? 3 : 1;
	}
	return r;
}

/* Both are lost; whichever returns first is itself, not the first of the two. */
TEST(sim_strangers, equal_slaves_that_return_in_any_order_are_told_apart_by_their_ports)
{
	static const char *const settings[] = { "slaves[0].name=a", "slaves[1].name=b",
						"slaves[2].name=c", NULL };

	for (unsigned first = 1; first <= 2; first++) {
		char fault[48];

		virtual_bench_init(
			&b, &(struct virtual_spec){ .slaves = 3, .make = tree_slave, .seed = 8 });
		virtual_master_init(&vm, &b, settings);
		virtual_master_settle(&vm);
		virtual_bench_fault(&b, "at=0s power-off slave=1");
		virtual_bench_fault(&b, "at=0s power-off slave=2");
		virtual_master_run(&vm, 500);
		snprintf(fault, sizeof(fault), "at=0s power-on slave=%u", first);
		virtual_bench_fault(&b, fault);
		virtual_master_run(&vm, 1500);
		CHECK_EQ(get_le16(segment_esc(b.segment, first)->reg + ESC_REG_STATION_ADDRESS),
			 0x1001 + first);
		snprintf(fault, sizeof(fault), "at=0s power-on slave=%u", 3 - first);
		virtual_bench_fault(&b, fault);
		virtual_master_run(&vm, 2000);
		CHECK_EQ(state(), BUS_OP);
		CHECK_EQ(get_le16(segment_esc(b.segment, 3 - first)->reg + ESC_REG_STATION_ADDRESS),
			 0x1001 + 3 - first);
		close_all();
	}
}

TEST(sim_strangers, the_port_towards_a_stranger_is_open_again_after_a_stop)
{
	const uint8_t *loop_control = NULL;

	open_without(2);
	plug_in(0x1001);
	virtual_master_run(&vm, 1000);
	loop_control = segment_esc(b.segment, 1)->reg + ESC_REG_DL_CONTROL + 1;
	CHECK(*loop_control != 0);
	CHECK_EQ(virtual_master_stop(&vm), 0);
	CHECK_EQ(*loop_control, 0);
	close_all();
}

/* --- slaves that may be absent, and such that only their number tells apart --- */

static void open_with(const char *const *settings, const char *fault)
{
	virtual_bench_init(
		&b, &(struct virtual_spec){ .slaves = SLAVES, .seed = 5, .ppm = { 30, -40, 15 } });
	if (fault != NULL) {
		virtual_bench_fault(&b, fault);
	}
	virtual_master_init(&vm, &b, settings);
}

TEST(sim_strangers, an_absent_optional_slave_is_reported_and_the_others_work)
{
	static const char *const settings[] = {
		"slaves[0].name=a",           "slaves[1].name=b",
		"slaves[1].identification=7", "slaves[1].optional=true",
		"slaves[2].name=c",           "outputs[0].channel=b.led",
		"outputs[1].channel=c.led",   NULL
	};

	open_with(settings, "at=0s unplug slave=1");
	virtual_master_settle(&vm);
	virtual_master_run(&vm, 500);
	CHECK_EQ(state(), BUS_OP);
	CHECK_EQ(atomic_load(&page()->slave_count), 2);
	CHECK_STR(page()->slave[1].info.name, "c");
	CHECK_EQ(page()->slave[0].info.config_item, 1);
	CHECK_EQ(page()->slave[1].info.config_item, 3);
	CHECK_STR(page()->message, "slaves[1] b is optional and absent");
	/* It comes later: for this session it is a stranger. */
	virtual_bench_fault(&b, "at=0s plug slave=1");
	virtual_master_run(&vm, 1000);
	CHECK_EQ(state(), BUS_OP);
	CHECK(strstr(page()->message, "position 1: a device that is not configured") != NULL);
	close_all();
}

TEST(sim_strangers, slaves_are_told_apart_by_their_identification_switch)
{
	static const char *const settings[] = { "slaves[0].name=a", "slaves[0].identification=5",
						"slaves[1].name=b", "slaves[2].name=c", NULL };

	open_with(settings, "at=0s switch slave=0 id=5");
	virtual_master_settle(&vm);
	CHECK_EQ(state(), BUS_OP);
	close_all();
	open_with(settings, "at=0s switch slave=0 id=6");
	CHECK(virtual_master_bring_up(&vm) < 0);
	CHECK(strstr(vm.failure.text, "expected vendor any product any revision any "
				      "identification 5") != NULL);
	CHECK(strstr(vm.failure.text, "identification 6") != NULL);
	close_all();
}
