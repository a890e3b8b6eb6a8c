/* SPDX-License-Identifier: MIT */
/* The WAGO coupler: states, process image, K-bus, the hand at its terminals. */
#include "devices/wago_750_354.h"

#include <errno.h>

#include "base/bytes.h"
#include "harness/test.h"
#include "segment/io_line.h"
#include "wago_bench.h"
#include "wire/al.h"
#include "wire/esc_reg.h"

enum { STATION = BENCH_STATION, AO = 4, DO = 12, AI = 4, DI = 12, MS = 1000000 };

static const uint8_t nothing[WAGO_BENCH_BYTES];

static struct bench *node(const struct signal_spec *signal)
{
	struct bench *b = wago_bench_create("wago_750_354", signal);

	wago_bench_preop(b);
	return b;
}

TEST(wago, safeop_needs_process_data_as_long_as_the_modules_ask)
{
	struct bench *b = node(NULL);

	bench_sm(b, STATION, 2, 0x1800, WAGO_BENCH_BYTES, 0x64);
	bench_sm(b, STATION, 3, 0x2400, WAGO_BENCH_BYTES - 2, 0x00);
	CHECK_EQ(wago_bench_request(b, AL_SAFEOP), AL_PREOP | AL_ERROR);
	CHECK_EQ(bench_read16(b, STATION, ESC_REG_AL_STATUS_CODE), AL_CODE_INVALID_INPUT_CONFIG);
	CHECK_EQ(wago_bench_request(b, AL_PREOP | AL_ERROR), AL_PREOP);
	bench_write8(b, STATION, ESC_REG_SM + 3 * ESC_SM_BYTES + 6, 0);
	bench_write8(b, STATION, ESC_REG_SM + 2 * ESC_SM_BYTES + 6, 0);
	wago_bench_safeop(b);
	bench_destroy(b);
}

TEST(wago, op_without_outputs_falls_back_with_001b)
{
	struct bench *b = node(NULL);

	wago_bench_safeop(b);
	CHECK_EQ(wago_bench_request(b, AL_OP), AL_SAFEOP | AL_ERROR);
	CHECK_EQ(bench_read16(b, STATION, ESC_REG_AL_STATUS_CODE), AL_CODE_SM_WATCHDOG);
	bench_destroy(b);
}

static int16_t analog(const uint8_t *image, unsigned channel)
{
	return (int16_t)get_le16(image + AI + (size_t)2 * (channel - 1));
}

static void check_volt(double volt, int counts)
{
	struct signal_spec direct = { .offset_v = volt };
	struct bench *b = node(&direct);
	uint8_t inputs[WAGO_BENCH_BYTES];

	wago_bench_op(b, nothing);
	wago_bench_exchange(b, nothing, inputs);
	CHECK_EQ(analog(inputs, 1), counts);
	CHECK_EQ(analog(inputs, 4), counts);
	CHECK_EQ(wago_bench_get(b, 0, 1), counts);
	bench_destroy(b);
}

TEST(wago, ten_volts_are_full_scale_and_more_is_clamped)
{
	check_volt(0.0, 0);
	check_volt(5.0, 0x4000);
	check_volt(-5.0, -0x4000);
	check_volt(2.5, 0x2000);
	check_volt(0.0025, 8);
	check_volt(10.0, 0x7fff);
	check_volt(12.0, 0x7fff);
	check_volt(-10.0, -0x8000);
	check_volt(-1e6, -0x8000);
}

TEST(wago, nothing_connected_is_zero_volts)
{
	struct bench *b = node(NULL);
	uint8_t inputs[WAGO_BENCH_BYTES];

	wago_bench_op(b, nothing);
	wago_bench_exchange(b, nothing, inputs);
	CHECK_MEM(inputs, nothing, sizeof(inputs));
	bench_destroy(b);
}

TEST(wago, channels_see_the_signal_a_quarter_turn_apart)
{
	struct signal_spec cosine = { .amplitude_v = 5.0, .phase_rad = 1.57079632679489661923 };
	struct bench *b = node(&cosine);
	uint8_t inputs[WAGO_BENCH_BYTES];

	wago_bench_op(b, nothing);
	wago_bench_exchange(b, nothing, inputs);
	CHECK_EQ(analog(inputs, 1), 0x4000);
	CHECK_EQ(analog(inputs, 2), 0);
	CHECK_EQ(analog(inputs, 3), -0x4000);
	CHECK_EQ(analog(inputs, 4), 0);
	bench_destroy(b);
}

TEST(wago, digital_inputs_follow_the_hand)
{
	struct bench *b = node(NULL);
	uint8_t inputs[WAGO_BENCH_BYTES];

	wago_bench_op(b, nothing);
	CHECK_EQ(wago_750_354_set(wago_bench_device(b), 2, 1, 1), 0);
	CHECK_EQ(wago_750_354_set(wago_bench_device(b), 2, 8, 1), 0);
	wago_bench_exchange(b, nothing, inputs);
	CHECK_EQ(inputs[DI], 0x81);
	CHECK_EQ(wago_750_354_set(wago_bench_device(b), 2, 1, 0), 0);
	wago_bench_exchange(b, nothing, inputs);
	CHECK_EQ(inputs[DI], 0x80);
	CHECK_EQ(inputs[DI + 1], 0);
	bench_destroy(b);
}

TEST(wago, a_hand_finds_no_terminal_that_is_not_there)
{
	struct bench *b = node(NULL);
	struct sim_device *dev = wago_bench_device(b);
	int value = 77;

	CHECK_EQ(wago_750_354_set(dev, 2, 0, 1), -EINVAL);
	CHECK_EQ(wago_750_354_set(dev, 2, 9, 1), -EINVAL);
	CHECK_EQ(wago_750_354_set(dev, 0, 1, 1), -EINVAL);
	CHECK_EQ(wago_750_354_set(dev, 3, 1, 1), -EINVAL);
	CHECK_EQ(wago_750_354_set(dev, 4, 1, 1), -EINVAL);
	CHECK_EQ(wago_750_354_get(dev, SIZE_MAX, 1, &value), -EINVAL);
	CHECK_EQ(wago_750_354_get(dev, 1, 5, &value), -EINVAL);
	CHECK_EQ(value, 77);
	bench_destroy(b);
}

TEST(wago, outputs_reach_the_terminals_in_op_only)
{
	uint8_t outputs[WAGO_BENCH_BYTES] = { [AO] = 0x34, [AO + 1] = 0xf2, [DO] = 0xf8 };
	uint8_t inputs[WAGO_BENCH_BYTES];
	struct bench *b = node(NULL);

	wago_bench_op(b, outputs);
	wago_bench_exchange(b, outputs, inputs);
	CHECK_EQ(wago_bench_get(b, 1, 1), (int16_t)0xf234);
	CHECK_EQ(wago_bench_get(b, 1, 2), 0);
	CHECK_EQ(wago_bench_get(b, 3, 3), 0);
	CHECK_EQ(wago_bench_get(b, 3, 4), 1);
	CHECK_EQ(wago_bench_get(b, 3, 8), 1);
	CHECK_EQ(wago_bench_request(b, AL_SAFEOP), AL_SAFEOP);
	wago_bench_exchange(b, outputs, inputs);
	CHECK_EQ(wago_bench_get(b, 1, 1), 0);
	CHECK_EQ(wago_bench_get(b, 3, 4), 0);
	bench_destroy(b);
}

TEST(wago, outputs_that_stop_coming_are_zero_after_the_watchdog)
{
	uint8_t outputs[WAGO_BENCH_BYTES] = { [DO] = 0xff };
	uint8_t inputs[WAGO_BENCH_BYTES];
	struct bench *b = node(NULL);

	wago_bench_op(b, outputs);
	wago_bench_exchange(b, outputs, inputs);
	CHECK_EQ(wago_bench_get(b, 3, 1), 1);
	bench_wait(b, 90 * MS);
	CHECK_EQ(wago_bench_get(b, 3, 1), 1);
	bench_wait(b, 15 * MS);
	CHECK_EQ(wago_bench_get(b, 3, 1), 0);
	CHECK_EQ(bench_read16(b, STATION, ESC_REG_AL_STATUS), AL_SAFEOP | AL_ERROR);
	bench_destroy(b);
}

TEST(wago, held_inputs_and_outputs_stand_still_and_say_so)
{
	uint8_t outputs[WAGO_BENCH_BYTES] = { [DO] = 0x01 };
	uint8_t inputs[WAGO_BENCH_BYTES];
	struct bench *b = node(NULL);

	wago_bench_op(b, outputs);
	wago_bench_exchange(b, outputs, inputs);
	CHECK_EQ(inputs[0], 0);
	outputs[0] = 0x06; /* hold both */
	outputs[DO] = 0x02;
	wago_750_354_set(wago_bench_device(b), 2, 1, 1);
	wago_bench_exchange(b, outputs, inputs);
	CHECK_EQ(inputs[0], 0x06);
	CHECK_EQ(inputs[DI], 0x00);
	CHECK_EQ(wago_bench_get(b, 3, 1), 1);
	CHECK_EQ(wago_bench_get(b, 3, 2), 0);
	outputs[0] = 0x08; /* clear */
	wago_bench_exchange(b, outputs, inputs);
	CHECK_EQ(inputs[0], 0x08);
	CHECK_EQ(inputs[DI], 0x01);
	CHECK_EQ(wago_bench_get(b, 3, 2), 0);
	outputs[0] = 0;
	wago_bench_exchange(b, outputs, inputs);
	CHECK_EQ(inputs[0], 0);
	CHECK_EQ(wago_bench_get(b, 3, 2), 1);
	bench_destroy(b);
}

/* SYNC0 from 1 ms ahead, every @period_ns. */
static void start_sync0(struct bench *b, uint32_t period_ns)
{
	uint64_t now = bench_read64(b, STATION, ESC_REG_DC_SYSTEM_TIME);

	bench_write64(b, STATION, ESC_REG_DC_START_TIME, now + MS);
	bench_write32(b, STATION, ESC_REG_DC_SYNC0_CYCLE, period_ns);
	bench_write8(b, STATION, ESC_REG_DC_ACTIVATION, 0x03);
}

TEST(wago, sync0_faster_than_the_k_bus_raises_the_overrun_flag)
{
	uint8_t outputs[WAGO_BENCH_BYTES] = { 0 };
	uint8_t inputs[WAGO_BENCH_BYTES];
	struct bench *b = node(NULL);

	start_sync0(b, WAGO_KBUS_NS / 2 + 1000);
	wago_bench_op(b, outputs);
	wago_bench_exchange(b, outputs, inputs);
	CHECK_EQ(inputs[0], 0x01);
	outputs[0] = 0x01; /* the flag is not wanted */
	wago_bench_exchange(b, outputs, inputs);
	CHECK_EQ(inputs[0], 0x00);
	bench_destroy(b);
}

TEST(wago, each_sync0_edge_starts_one_k_bus_cycle)
{
	struct signal_spec ramp = { .frequency_hz = 10.0, .amplitude_v = 9.0 };
	uint8_t inputs[WAGO_BENCH_BYTES];
	struct bench *b = node(&ramp);
	int64_t edge_ns;

	start_sync0(b, 20 * MS);
	wago_bench_safeop(b);
	bench_wait(b, 30 * MS);
	segment_advance(b->segment, b->now_ns);
	edge_ns = segment_esc(b->segment, 0)->sync.next_true_ns;
	bench_wait(b, edge_ns + 2 * WAGO_KBUS_NS - b->now_ns);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPRD, STATION, 0x2400, inputs, sizeof(inputs)), 1);
	/* The value of the edge, to half a step of the converter. */
	CHECK(llabs((long long)(signal_volt(&ramp, edge_ns) * 3276.8) - analog(inputs, 1)) <= 5);
	bench_destroy(b);
}

static void check_io(struct bench *b, const char *line, const char *answer)
{
	char text[256];

	CHECK_EQ(io_line(b->segment, line, text, sizeof(text)), 0);
	CHECK_STR(text, answer);
}

static void check_refused(struct bench *b, const char *line)
{
	char text[256] = "";

	CHECK_EQ(io_line(b->segment, line, text, sizeof(text)), -EINVAL);
	CHECK(text[0] != '\0');
}

TEST(wago, io_lines_are_a_hand_at_the_terminals)
{
	uint8_t outputs[WAGO_BENCH_BYTES] = { [AO] = 0xff, [AO + 1] = 0xff, [DO] = 0xf8 };
	uint8_t inputs[WAGO_BENCH_BYTES];
	struct bench *b = node(NULL);
	char text[256] = "as before";

	wago_bench_op(b, outputs);
	check_io(b, "io slave=0 slot3=0x80 slot3.1=1\n",
		 "slot1=0,0,0,0 slot2=-1,0,0,0 slot3=0x00 slot4=0xf8");
	wago_bench_exchange(b, outputs, inputs);
	check_io(b, "io slave=0", "slot1=0,0,0,0 slot2=-1,0,0,0 slot3=0x81 slot4=0xf8");
	check_refused(b, "io");
	check_refused(b, "io slave=1");
	check_refused(b, "io slave=x");
	check_refused(b, "io slave=0 slot3");
	check_refused(b, "io slave=0 slot4=1");
	check_refused(b, "io slave=0 slot3=0x100");
	check_refused(b, "io slave=0 slot3.9=1");
	check_refused(b, "io slave=0 slot3.1=2");
	check_refused(b, "io slave=0 slot0=1");
	check_refused(b, "io slave=0 slot65=1");
	check_refused(b, "io slave=0 slot3=");
	CHECK_EQ(io_line(b->segment, "at=1s lose", text, sizeof(text)), -ENOENT);
	CHECK_EQ(io_line(b->segment, "ion=1", text, sizeof(text)), -ENOENT);
	CHECK_STR(text, "as before");
	bench_destroy(b);
}

TEST(wago, a_slave_without_terminals_refuses_io_lines)
{
	struct bench *b = bench_create_one();

	check_refused(b, "io slave=0");
	bench_destroy(b);
}
