/* SPDX-License-Identifier: MIT */
/*
 * The cyclic frame that a plain SOEM master exchanges with this coupler
 * every millisecond: 76 bytes, one LRW of 28 bytes from logical address 0 and one FRMW of 8 bytes
 * of 0x0910 of station 0x1001; they came back with working counters 3 and 1.
 */
#include "base/bytes.h"
#include "coupler.h"
#include "harness/test.h"
#include "image/image.h"
#include "wire/datagram.h"

enum {
	FRAME_BYTES = 76,
	IMAGE_BYTES = 28,
	TIME_BYTES = 8,
	STATION = 0x1001,
	SYSTEM_TIME = 0x0910,
	LRW_AT = ECAT_ETHERNET_BYTES + ECAT_FRAME_HEADER_BYTES,
	FRMW_AT = LRW_AT + ECAT_DATAGRAM_HEADER_BYTES + IMAGE_BYTES + ECAT_WKC_BYTES,
	LENGTH_MASK = 0x07ff,
	MORE = 0x8000,
};

static const char *const settings[] = { "bus.monitor=off", NULL };

/* What was seen of the cyclic frames. */
struct seen {
	int is_watching;
	uint64_t frames;
	uint64_t cyclic;
};

static void check_frame(const uint8_t *f, size_t frame_len)
{
	const uint8_t *lrw = f + LRW_AT;
	const uint8_t *frmw = f + FRMW_AT;

	CHECK_EQ(frame_len, FRAME_BYTES);
	CHECK_EQ(f[12] << 8 | f[13], 0x88a4);
	CHECK_EQ(get_le16(f + ECAT_ETHERNET_BYTES) & LENGTH_MASK, FRAME_BYTES - LRW_AT);
	CHECK_EQ(lrw[0], ECAT_CMD_LRW);
	CHECK_EQ(get_le32(lrw + 2), 0);
	CHECK_EQ(get_le16(lrw + 6), IMAGE_BYTES | MORE);
	CHECK_EQ(get_le16(lrw + ECAT_DATAGRAM_HEADER_BYTES + IMAGE_BYTES), 3);
	CHECK_EQ(frmw[0], ECAT_CMD_FRMW);
	CHECK_EQ(get_le16(frmw + 2), STATION);
	CHECK_EQ(get_le16(frmw + 4), SYSTEM_TIME);
	CHECK_EQ(get_le16(frmw + 6), TIME_BYTES);
	CHECK_EQ(get_le16(frmw + ECAT_DATAGRAM_HEADER_BYTES + TIME_BYTES), 1);
}

/* Mailbox and register traffic of the service loop rides along in frames of its own. */
static void look(struct virtual_master *vm, const uint8_t *frame, size_t frame_len)
{
	struct seen *seen = vm->user;

	if (!seen->is_watching) {
		return;
	}
	seen->frames++;
	if (frame_len > LRW_AT && frame[LRW_AT] == ECAT_CMD_LRW) {
		seen->cyclic++;
		check_frame(frame, frame_len);
	}
}

TEST(sim_loopback, the_cyclic_frame_has_76_bytes_with_lrw_and_frmw)
{
	static struct virtual_bench b;
	static struct virtual_master vm;
	struct seen seen = { 0 };

	coupler_bench_init(&b, 1.0);
	coupler_bring_up(&vm, &b, settings);
	vm.each_frame = look;
	vm.user = &seen;
	virtual_master_run(&vm, 20);
	virtual_master_forget(&vm);
	seen.is_watching = 1;
	virtual_master_run(&vm, 1000);
	seen.is_watching = 0;
	CHECK_EQ(seen.cyclic, 1000);
	printf("%llu of %llu frames were cyclic\n", (unsigned long long)seen.cyclic,
	       (unsigned long long)seen.frames);
	CHECK_EQ(vm.result.op, vm.result.samples);
	CHECK_EQ(vm.result.bad, 0);
	CHECK_EQ(virtual_master_stop(&vm), 0);
	virtual_master_close(&vm);
}

static const struct channel *channel_of(const struct virtual_master *vm, const char *name)
{
	size_t bytes;
	const struct sample_meta *meta = ring_meta(vm->samples, &bytes);
	const struct channel *channels = sample_meta_channels(meta);
	int n = image_channel_find(channels, meta->channel_count, name);

	if (n < 0) {
		test_fail(__FILE__, __LINE__, "no channel is named %s", name);
	}
	return &channels[n];
}

static void check_channel(const struct virtual_master *vm, const char *name, uint8_t direction,
			  uint8_t type, uint32_t byte)
{
	const struct channel *ch = channel_of(vm, name);

	CHECK_EQ(ch->direction, direction);
	CHECK_EQ(ch->type, type);
	CHECK_EQ(ch->bit_offset, byte * 8);
}

TEST(sim_loopback, the_ordinary_mapping_makes_named_channels_of_the_coupler)
{
	static struct virtual_bench b;
	static struct virtual_master vm;
	size_t bytes;

	coupler_bench_init(&b, 1.0);
	coupler_bring_up(&vm, &b, settings);
	/* Both headers have 6 values; 4 + 8 channels each way. */
	CHECK_EQ(((const struct sample_meta *)ring_meta(vm.samples, &bytes))->channel_count,
		 6 + 12 + 5 + 12);
	check_channel(&vm, "wago0.slot2_channel_1_data", CHANNEL_OUTPUT, CHANNEL_INT, 4);
	check_channel(&vm, "wago0.slot2_channel_4_data", CHANNEL_OUTPUT, CHANNEL_INT, 10);
	check_channel(&vm, "wago0.slot4_channel_1_data", CHANNEL_OUTPUT, CHANNEL_BOOL, 12);
	check_channel(&vm, "wago0.diagnostics_control_word", CHANNEL_OUTPUT, CHANNEL_UINT, 2);
	check_channel(&vm, "wago0.k_bus_cycle_overrun_flag", CHANNEL_INPUT, CHANNEL_BOOL, 14);
	check_channel(&vm, "wago0.slot1_channel_1_data", CHANNEL_INPUT, CHANNEL_INT, 18);
	check_channel(&vm, "wago0.slot3_channel_1_data", CHANNEL_INPUT, CHANNEL_BOOL, 26);
	CHECK_EQ(virtual_master_stop(&vm), 0);
	virtual_master_close(&vm);
}
