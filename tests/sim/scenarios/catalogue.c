/* SPDX-License-Identifier: MIT */
/* Every slave of the simulator's catalogue on one line, brought to OP by the whole master. */
#include <math.h>

#include "base/ring.h"
#include "devices/catalogue.h"
#include "devices/plant.h"
#include "devices/wago_750_354.h"
#include "harness/test.h"
#include "sim/harness/virtual_master.h"
#include "wire/datagram.h"
#include "wire/esc_reg.h"

static struct virtual_bench b;
static struct virtual_master vm;

static int make(int position, struct segment_slave_spec *ret_spec)
{
	static struct slave_model model;

	catalogue_read((size_t)position, &model);
	if (plant_is_name(model.name)) {
		return plant_by_name(position, model.name, ret_spec);
	}
	if (wago_750_354_is_name(model.name)) {
		return wago_750_354_by_name(position, model.name, ret_spec);
	}
	return catalogue_slave(&model, position, ret_spec);
}

static void open_all(unsigned slaves, virtual_slave_maker maker, const char *const *settings)
{
	virtual_bench_init(&b,
			   &(struct virtual_spec){ .slaves = slaves, .make = maker, .seed = 5 });
	virtual_master_init(&vm, &b, settings);
	if (virtual_master_bring_up(&vm) < 0) {
		test_fail(__FILE__, __LINE__, "%s", vm.failure.text);
	}
	CHECK_EQ(virtual_master_run(&vm, 200), SESSION_GOES_ON);
}

static void close_all(void)
{
	CHECK_EQ(virtual_master_stop(&vm), 0);
	virtual_master_close(&vm);
}

/* Bits of the PDOs that entry @i assigns by default. */
static uint32_t assigned_bits(size_t i)
{
	static struct slave_model model;
	uint32_t bits = 0;

	catalogue_read(i, &model);
	for (size_t p = 0; p < model.sii.pdo_count; p++) {
		bits += model.sii.pdo[p].sm < model.sii.sm_count ? model.sii.pdo[p].bits : 0;
	}
	return bits;
}

static int64_t signed16(const char *name)
{
	return (int16_t)virtual_master_value(&vm, name);
}

TEST(catalogue, all_its_slaves_come_to_op_with_the_channels_of_their_entries)
{
	const struct sample_meta *meta;
	size_t bytes;
	uint32_t bits[LIMIT_SLAVES] = { 0 };

	open_all((unsigned)catalogue_count(), make, NULL);
	meta = ring_meta(vm.samples, &bytes);
	for (uint32_t i = 0; i < meta->channel_count; i++) {
		const struct channel *c = &sample_meta_channels(meta)[i];

		bits[c->slave_pos] += c->bit_len;
	}
	for (size_t i = 0; i < catalogue_count(); i++) {
		printf("  slave %zu: %u bits in channels\n", i, bits[i]);
		CHECK(bits[i] <= assigned_bits(i) || assigned_bits(i) == 0);
		CHECK((bits[i] > 0) == (assigned_bits(i) > 0) || i + 1 == catalogue_count());
	}
	CHECK_EQ(virtual_master_sample(&vm)->slaves_bad.word[0], 0);
	CHECK(vm.result.op > 100);
	close_all();
}

static int make_analog(int position, struct segment_slave_spec *ret_spec)
{
	static const char *const names[] = { "ek1100", "el3104", "el4132" };

	return virtual_bench_slave(names[position], position, ret_spec);
}

TEST(catalogue, an_analog_terminal_shows_the_signal_at_its_scale)
{
	static const char *const settings[] = { "slaves[0].name=coupler", "slaves[1].name=ai",
						"slaves[2].name=ao", NULL };
	int64_t low = INT16_MAX;
	int64_t high = INT16_MIN;

	open_all(3, make_analog, settings);
	for (unsigned i = 0; i < 120; i++) {
		int64_t now;

		CHECK_EQ(virtual_master_run(&vm, 10), SESSION_GOES_ON);
		now = signed16("ai.ai_standard_channel_1_value");
		low = now < low ? now : low;
		high = now > high ? now : high;
	}
	/* 1 V and a sine of 0.5 V; 10 V are 0x7fff. */
	CHECK(low > 1620 && low < 1660);
	CHECK(high > 4890 && high < 4930);
	close_all();
}

static int make_gauge(int position, struct segment_slave_spec *ret_spec)
{
	static const char *const names[] = { "ek1100", "el3104", "gauge" };

	return virtual_bench_slave(names[position], position, ret_spec);
}

static const struct channel *channel(const char *name)
{
	size_t bytes;
	const struct sample_meta *meta = ring_meta(vm.samples, &bytes);

	for (uint32_t i = 0; i < meta->channel_count; i++) {
		if (strcmp(sample_meta_channels(meta)[i].name, name) == 0) {
			return &sample_meta_channels(meta)[i];
		}
	}
	test_fail(__FILE__, __LINE__, "no channel %s", name);
	return NULL;
}

TEST(catalogue, channels_have_the_units_of_their_objects_unless_they_are_configured)
{
	static const char *const settings[] = { "slaves[0].name=coupler", "slaves[1].name=ai",
						"slaves[2].name=gauge", NULL };
	struct config_channel *item;

	virtual_bench_init(&b,
			   &(struct virtual_spec){ .slaves = 3, .make = make_gauge, .seed = 5 });
	virtual_master_init(&vm, &b, settings);
	item = &vm.cfg.channel[vm.cfg.channel_count++];
	*item = (struct config_channel){ .slave_pos = 2,
					 .match = "pressure",
					 .unit = "psi",
					 .min = -HUGE_VAL,
					 .max = HUGE_VAL };
	if (virtual_master_bring_up(&vm) < 0) {
		test_fail(__FILE__, __LINE__, "%s", vm.failure.text);
	}
	CHECK_STR(channel("gauge.voltage")->unit, "mV");
	CHECK_STR(channel("gauge.temperature")->unit, "1e-1 degC");
	CHECK_STR(channel("gauge.pressure")->unit, "psi");
	CHECK_STR(channel("gauge.speed")->unit, "rev/min");
	CHECK_STR(channel("gauge.speed_set")->unit, "rev/min");
	CHECK_STR(channel("gauge.count")->unit, "");
	CHECK(channel("gauge.voltage")->scale == 1);
	CHECK_STR(channel("ai.ai_standard_channel_1_value")->unit, "");
	close_all();
}

static int make_drive(int position, struct segment_slave_spec *ret_spec)
{
	static const char *const names[] = { "akd", "el1008", "el2828" };

	return virtual_bench_slave(names[position], position, ret_spec);
}

static void set(const char *channel, uint64_t raw)
{
	struct admin_request rq = { .magic = ADMIN_MAGIC, .verb = ADMIN_SET, .count = 1 };

	snprintf(rq.item[0].channel, sizeof(rq.item[0].channel), "%s", channel);
	rq.item[0].raw = raw;
	CHECK_EQ(virtual_master_ask(&vm, &rq).result, 0);
	CHECK_EQ(virtual_master_run(&vm, 20), SESSION_GOES_ON);
}

TEST(catalogue, a_drive_follows_its_controlword_and_its_set_point)
{
	static const char *const settings[] = { "slaves[0].name=drive", "slaves[1].name=di",
						"slaves[2].name=do", NULL };

	open_all(3, make_drive, settings);
	CHECK_EQ(virtual_master_value(&vm, "drive.statusword"), 0x50);
	set("drive.controlword", 0x06);
	CHECK_EQ(virtual_master_value(&vm, "drive.statusword"), 0x31);
	set("drive.controlword", 0x07);
	set("drive.controlword", 0x0f);
	CHECK_EQ(virtual_master_value(&vm, "drive.statusword"), 0x37);
	set("drive.1st_set_point", 123456);
	CHECK_EQ(virtual_master_value(&vm, "drive.position_actual_internal_value"), 123456);
	close_all();
}

/* Slaves that support no LRW, between others. */
static int make_without_lrw(int position, struct segment_slave_spec *ret_spec)
{
	static const char *const names[] = { "el2004", "akd", "el1004", "el2004" };
	static struct slave_model model;

	CHECK_EQ(catalogue_find(names[position], &model), 0);
	if (position == 1 || position == 3) {
		model.sii.general_flags |= SII_GENERAL_NOT_LRW;
		model.features.features |= ESC_FEATURE_NO_LRW;
	}
	return catalogue_slave(&model, position, ret_spec);
}

static unsigned lrw_seen;

static void look_for_lrw(struct virtual_master *master, const uint8_t *frame, size_t frame_len)
{
	uint8_t copy[LIMIT_FRAME_BYTES];
	struct ecat_datagram dg;
	size_t pos = 0;

	(void)master;
	memcpy(copy, frame, frame_len);
	while (ecat_frame_next(copy, frame_len, &pos, &dg) == 1) {
		lrw_seen += dg.cmd == ECAT_CMD_LRW;
	}
}

static void run_without_lrw(const char *datagrams)
{
	const char *const settings[] = { "slaves[0].name=a", "slaves[1].name=drive", datagrams,
					 NULL };

	open_all(4, make_without_lrw, settings);
	lrw_seen = 0;
	vm.each_frame = look_for_lrw;
	set("drive.controlword", 0x06);
	CHECK_EQ(virtual_master_value(&vm, "drive.statusword"), 0x31);
	set("drive.1st_set_point", 123456);
	CHECK_EQ(virtual_master_sample(&vm)->wkc, virtual_master_sample(&vm)->wkc_expected);
	CHECK_EQ(virtual_master_sample(&vm)->flags, 0);
	close_all();
}

TEST(catalogue, slaves_without_lrw_are_served_with_lwr_and_lrd)
{
	run_without_lrw("bus.datagrams=one");
	CHECK_EQ(lrw_seen, 0);
	run_without_lrw("bus.datagrams=per_slave");
	CHECK(lrw_seen > 0); /* of the others */
}

TEST(catalogue, terminals_are_read_and_set_by_the_address_of_their_entries)
{
	static const char *const settings[] = { "slaves[0].name=drive", "slaves[1].name=di",
						"slaves[2].name=do", NULL };
	struct sim_device *di;
	struct sim_device *terminals;
	char text[256];

	open_all(3, make_drive, settings);
	di = segment_device(b.segment, 1);
	terminals = segment_device(b.segment, 2);
	for (unsigned on = 0; on < 2; on++) {
		CHECK_EQ(di->ops->io_set(di, "0x6010:01", on ? "1" : "0"), 0);
		CHECK_EQ(virtual_master_run(&vm, 5), SESSION_GOES_ON);
		CHECK_EQ(virtual_master_value(&vm, "di.channel_2_input"), on);
	}
	CHECK(di->ops->io_set(di, "0x7010:01", "1") < 0);
	CHECK(di->ops->io_set(di, "0x6010:02", "1") < 0);
	CHECK(di->ops->io_set(di, "0x6010:01", "on") < 0);
	CHECK(terminals->ops->io_set(terminals, "0x7010:01", "1") < 0);
	set("do.channel_3_output", 1);
	terminals->ops->io_get(terminals, text, sizeof(text));
	CHECK(strstr(text, "0x7010:01=0 0x7020:01=1 0x7030:01=0") != NULL);
	terminals->ops->io_get(terminals, text, 20);
	CHECK_STR(text, "0x7000:01=0"); /* whole words only */
	close_all();
}
