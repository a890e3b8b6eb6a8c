/* SPDX-License-Identifier: MIT */
/* EoE through the engine: IP parameters, ARP and ping to the endpoint behind a slave. */
#include "wire/eoe.h"

#include <errno.h>

#include "base/bytes.h"
#include "harness/test.h"
#include "sim/protocols/bench.h"

static const char *const drive[] = { "all", NULL };

static const struct eoe_ip slave_ip = {
	.flags = EOE_HAS_MAC | EOE_HAS_ADDRESS | EOE_HAS_NETMASK | EOE_HAS_NAME,
	.mac = { 2, 0, 0, 0, 0, 9 },
	.address = { 192, 168, 7, 9 },
	.netmask = { 255, 255, 255, 0 },
	.name = "drive-9",
};

static struct {
	struct eoe_assembly assembly;
	uint8_t frame[EOE_FRAME_MAX_BYTES];
	size_t len;
	unsigned frames;
	unsigned bad;
} seen;

static void take(void *ctx, uint16_t slave_pos, const uint8_t *data, size_t len)
{
	int r = eoe_assemble(&seen.assembly, data, len);

	(void)ctx;
	CHECK_EQ(slave_pos, 0);
	seen.bad += r < 0;
	if (r == 1) {
		memcpy(seen.frame, seen.assembly.frame, seen.assembly.len);
		seen.len = seen.assembly.len;
		seen.frames++;
	}
}

static void begin(struct protocol_bench *b)
{
	bench_begin(b, drive);
	bench_to_preop(b, 0);
	memset(&seen, 0, sizeof(seen));
	mailbox_sink_set(b->mb, MAILBOX_TYPE_EOE, take, NULL);
}

static struct mailbox_request eoe(enum eoe_type operation)
{
	return (struct mailbox_request){ .protocol = &eoe_protocol,
					 .with.eoe = { .operation = operation },
					 .timeout = { NS_PER_S } };
}

static void set_ip(struct protocol_bench *b, const struct eoe_ip *ip)
{
	struct mailbox_request rq = eoe(EOE_SET_IP);

	rq.with.eoe.ip = *ip;
	CHECK_EQ(bench_do(b, 0, &rq), 0);
}

static void wait_frames(struct protocol_bench *b, unsigned frames)
{
	for (unsigned i = 0; i < 200 && seen.frames < frames; i++) {
		mailbox_step(b->mb);
		CHECK_EQ(line_sleep(b->line, (span_t){ NS_PER_MS }), 0);
	}
	CHECK_EQ(seen.frames, frames);
}

static void send_frame(struct protocol_bench *b, uint8_t *frame, size_t len, uint8_t number)
{
	struct mailbox_request rq = eoe(EOE_FRAGMENT);

	rq.buffer = frame;
	rq.capacity = len;
	rq.with.eoe.frame_number = number;
	CHECK_EQ(bench_do(b, 0, &rq), 0);
	CHECK_EQ(rq.len, len);
}

TEST(eoe_engine, ip_parameters_are_set_and_read_back)
{
	struct protocol_bench b;
	struct mailbox_request rq = eoe(EOE_GET_IP);
	const struct eoe_ip gateway = { .flags = EOE_HAS_GATEWAY, .gateway = { 192, 168, 7, 1 } };

	begin(&b);
	set_ip(&b, &slave_ip);
	set_ip(&b, &gateway);
	CHECK_EQ(bench_do(&b, 0, &rq), 0);
	CHECK_EQ(rq.state.eoe.ip.flags, slave_ip.flags | EOE_HAS_GATEWAY);
	CHECK_MEM(rq.state.eoe.ip.mac, slave_ip.mac, 6);
	CHECK_MEM(rq.state.eoe.ip.address, slave_ip.address, 4);
	CHECK_MEM(rq.state.eoe.ip.netmask, slave_ip.netmask, 4);
	CHECK_MEM(rq.state.eoe.ip.gateway, gateway.gateway, 4);
	CHECK_STR(rq.state.eoe.ip.name, "drive-9");
	bench_end(&b);
}

TEST(eoe_engine, a_frame_that_nobody_asked_for_arrives)
{
	struct protocol_bench b;

	begin(&b);
	set_ip(&b, &slave_ip);
	wait_frames(&b, 1);
	CHECK_EQ(seen.len, 60);
	CHECK_MEM(seen.frame + 6, slave_ip.mac, 6);
	CHECK_EQ(seen.frame[12] << 8 | seen.frame[13], 0x0806);
	CHECK_MEM(seen.frame + 28, slave_ip.address, 4);
	bench_end(&b);
}

/* RFC 1071 over @len bytes. */
static unsigned checksum(const uint8_t *p, size_t len)
{
	uint32_t sum = 0;

	for (size_t i = 0; i + 1 < len; i += 2) {
		sum += (uint32_t)p[i] << 8 | p[i + 1];
	}
	while (sum >> 16) {
		sum = (sum & 0xffff) + (sum >> 16);
	}
	return ~sum & 0xffff;
}

static void make_ping(uint8_t *frame, size_t len)
{
	static const uint8_t head[] = { 2, 0, 0, 0, 0, 9, 2, 0, 0, 0, 0, 1, 0x08, 0x00, 0x45 };
	unsigned sum;

	memset(frame, 0, len);
	memcpy(frame, head, sizeof(head));
	frame[16] = (uint8_t)((len - 14) >> 8);
	frame[17] = (uint8_t)(len - 14);
	frame[22] = 64;
	frame[23] = 1;
	memcpy(frame + 26, (const uint8_t[]){ 192, 168, 7, 1, 192, 168, 7, 9 }, 8);
	frame[34] = 8;
	for (size_t i = 42; i < len; i++) {
		frame[i] = (uint8_t)i;
	}
	sum = checksum(frame + 34, len - 34);
	frame[36] = (uint8_t)(sum >> 8);
	frame[37] = (uint8_t)sum;
}

static void ping(struct protocol_bench *b, size_t len, uint8_t number)
{
	uint8_t frame[EOE_FRAME_MAX_BYTES];
	unsigned before = seen.frames;

	make_ping(frame, len);
	send_frame(b, frame, len, number);
	wait_frames(b, before + 1);
	CHECK_EQ(seen.len, len);
	CHECK_MEM(seen.frame, frame + 6, 6);
	CHECK_EQ(seen.frame[34], 0);
	CHECK_EQ(checksum(seen.frame + 34, len - 34), 0);
	CHECK_MEM(seen.frame + 42, frame + 42, len - 42);
}

TEST(eoe_engine, pings_of_every_size_round_a_block_and_a_mail_are_answered)
{
	static const size_t lens[] = { 60, 64, 96, 992, 994, 1024, 1056, 1500, 1514, 1518 };
	struct protocol_bench b;

	begin(&b);
	set_ip(&b, &slave_ip);
	wait_frames(&b, 1);
	for (unsigned i = 0; i < sizeof(lens) / sizeof(lens[0]); i++) {
		ping(&b, lens[i], (uint8_t)i);
	}
	CHECK_EQ(seen.bad, 0);
	bench_end(&b);
}

TEST(eoe_engine, frames_in_between_disturb_neither_sdo_nor_foe)
{
	struct protocol_bench b;
	uint8_t frame[EOE_FRAME_MAX_BYTES];
	uint8_t file[5000] = { 0 };
	struct mailbox_request rq[2] = { bench_foe(2, "a.bin", file, sizeof(file)),
					 eoe(EOE_FRAGMENT) };
	char text[8];
	struct mailbox_request sdo = {
		.protocol = &coe_protocol,
		.with.coe = { .operation = COE_UPLOAD, .index = 0x1018, .subindex = 1 },
		.buffer = (uint8_t *)text,
		.capacity = sizeof(text),
		.timeout = { NS_PER_S }
	};

	begin(&b);
	set_ip(&b, &slave_ip);
	make_ping(frame, 1500);
	rq[1].buffer = frame;
	rq[1].capacity = 1500;
	CHECK_EQ(mailbox_submit(b.mb, &rq[0]), 0);
	CHECK_EQ(mailbox_submit(b.mb, &rq[1]), 0);
	CHECK_EQ(mailbox_submit(b.mb, &sdo), 0);
	CHECK_EQ(mailbox_wait_all(b.mb), 0);
	CHECK_EQ(rq[0].result, 0);
	CHECK_EQ(rq[1].result, 0);
	CHECK_EQ(sdo.result, 0);
	CHECK_EQ(get_le32((const uint8_t *)text), b.sii[0].vendor);
	wait_frames(&b, 2);
	CHECK_EQ(seen.bad, 0);
	bench_end(&b);
}

TEST(eoe_engine, parameters_out_of_range_are_refused)
{
	struct protocol_bench b;
	uint8_t frame[EOE_FRAME_MAX_BYTES + 1] = { 0 };
	struct mailbox_request rq = eoe(EOE_SET_IP_RESPONSE);

	begin(&b);
	CHECK_EQ(bench_do(&b, 0, &rq), -EINVAL);
	rq = eoe(EOE_GET_IP);
	rq.with.eoe.port = 16;
	CHECK_EQ(bench_do(&b, 0, &rq), -EINVAL);
	rq = eoe(EOE_FRAGMENT);
	CHECK_EQ(bench_do(&b, 0, &rq), -EINVAL);
	rq.buffer = frame;
	rq.capacity = sizeof(frame);
	CHECK_EQ(bench_do(&b, 0, &rq), -EINVAL);
	bench_end(&b);
}
