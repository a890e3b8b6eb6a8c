/* SPDX-License-Identifier: MIT */
/*
 * The EoE switch between a host of this test and simulated drives, whose endpoints answer ARP and
 * ping: who gets which frame, and what misbehaving slaves and full queues cost.
 */
#include "network/eoe_switch.h"

#include <errno.h>

#include "harness/test.h"
#include "sim/protocols/bench.h"

enum {
	SLAVES = 3,
	MAC = 6,
	HOST_FRAMES = 200,
	HOST_KEPT = 64,
	PING_BYTES = 1400, /* more than the drive's mailbox of 1024 bytes */
	ARP_BYTES = 60,
	TYPE_AT = 12,
	ARP = 0x0806,
	IPV4 = 0x0800,
	UNKNOWN_TYPE = 0x88b5, /* for experiments: no endpoint answers it */
};

static const char *const line[] = { "all", "all", "all", NULL };
static const uint8_t host_mac[MAC] = { 2, 0, 0, 0, 0, 0xfe };
static const uint8_t host_ip[4] = { 192, 168, 7, 254 };

struct host_frame {
	uint8_t bytes[EOE_FRAME_MAX_BYTES + 1];
	size_t len;
};

static struct {
	struct protocol_bench b;
	struct eoe_switch *sw;
	struct host_frame out[HOST_FRAMES];
	unsigned out_count;
	unsigned out_next;
	struct host_frame in[HOST_KEPT];
	unsigned in_count;
	uint64_t announced; /* frames to slaves: what the others said by ARP */
	int is_down;
} here;

static int host_receive(void *ctx, uint8_t *frame, size_t capacity)
{
	const struct host_frame *f = &here.out[here.out_next];
	size_t len = f->len < capacity ? f->len : capacity;

	(void)ctx;
	if (here.out_next == here.out_count) {
		return -EAGAIN;
	}
	memcpy(frame, f->bytes, len);
	here.out_next++;
	return (int)len;
}

static int host_send(void *ctx, const uint8_t *frame, size_t len)
{
	(void)ctx;
	if (here.is_down) {
		return -EIO;
	}
	memcpy(here.in[here.in_count % HOST_KEPT].bytes, frame, len);
	here.in[here.in_count % HOST_KEPT].len = len;
	here.in_count++;
	return 0;
}

static void slave_mac(unsigned pos, uint8_t *mac)
{
	const uint8_t all[MAC] = { 2, 0, 0, 0, 0, (uint8_t)(1 + pos) };

	memcpy(mac, all, MAC);
}

static void service(void)
{
	eoe_switch_service(here.sw, here.b.mb, SLAVES, (span_t){ 200 * NS_PER_MS },
			   (mono_t){ bench_now_ns(&here.b) });
}

static void run_ms(unsigned ms)
{
	for (unsigned i = 0; i < ms * 2; i++) {
		service();
		mailbox_step(here.b.mb);
		line_sleep(here.b.line, (span_t){ NS_PER_MS / 2 });
	}
}

/* The endpoints have addresses, and have said so by ARP. */
static void begin(void)
{
	const struct eoe_switch_host host = { .receive = host_receive, .send = host_send };

	memset(&here, 0, sizeof(here));
	bench_begin(&here.b, line);
	CHECK_EQ(eoe_switch_create(&host, &here.sw), 0);
	service();
	for (unsigned i = 0; i < SLAVES; i++) {
		struct mailbox_request rq = {
			.protocol = &eoe_protocol,
			.with.eoe = { .operation = EOE_SET_IP,
				      .ip = { .flags = EOE_HAS_MAC | EOE_HAS_ADDRESS,
					      .address = { 192, 168, 7, (uint8_t)(1 + i) } } },
			.timeout = { NS_PER_S },
		};

		slave_mac(i, rq.with.eoe.ip.mac);
		bench_to_preop(&here.b, i);
		CHECK_EQ(bench_do(&here.b, i, &rq), 0);
	}
	run_ms(300);
	CHECK_EQ(here.in_count, SLAVES);
	here.in_count = 0;
	here.announced = eoe_switch_counters(here.sw)->to_slaves;
}

static void end(void)
{
	eoe_switch_destroy(here.sw);
	bench_end(&here.b);
}

static void fault(const char *text)
{
	char error[128];

	fault_plan_restart(here.b.faults, bench_now_ns(&here.b));
	CHECK_EQ(fault_plan_add(here.b.faults, text, SLAVES, error, sizeof(error)), 0);
	line_sleep(here.b.line, (span_t){ NS_PER_MS });
}

static struct host_frame *give(const uint8_t *to, unsigned type, size_t len)
{
	struct host_frame *f = &here.out[here.out_count++];

	CHECK(here.out_count <= HOST_FRAMES);
	memset(f, 0, sizeof(*f));
	memcpy(f->bytes, to, MAC);
	memcpy(f->bytes + MAC, host_mac, MAC);
	f->bytes[TYPE_AT] = (uint8_t)(type >> 8);
	f->bytes[TYPE_AT + 1] = (uint8_t)type;
	f->len = len;
	return f;
}

static void give_arp(unsigned pos)
{
	static const uint8_t broadcast[MAC] = { 0xff, 0xff, 0xff, 0xff, 0xff, 0xff };
	static const uint8_t request[] = { 0, 1, 8, 0, 6, 4, 0, 1 };
	uint8_t *arp = give(broadcast, ARP, ARP_BYTES)->bytes + 14;

	memcpy(arp, request, sizeof(request));
	memcpy(arp + 8, host_mac, MAC);
	memcpy(arp + 14, host_ip, 4);
	memcpy(arp + 24, host_ip, 3);
	arp[27] = (uint8_t)(1 + pos);
}

static void give_ping(unsigned pos, size_t len)
{
	uint8_t mac[MAC];
	struct host_frame *f;

	slave_mac(pos, mac);
	f = give(mac, IPV4, len);
	f->bytes[14] = 0x45;
	f->bytes[23] = 1;
	memcpy(f->bytes + 26, host_ip, 4);
	memcpy(f->bytes + 30, host_ip, 3);
	f->bytes[33] = (uint8_t)(1 + pos);
	f->bytes[34] = 8;
	for (size_t i = 42; i < len; i++) {
		f->bytes[i] = (uint8_t)(i * 7);
	}
}

static void give_to_slave(unsigned pos, size_t len)
{
	uint8_t mac[MAC];

	slave_mac(pos, mac);
	give(mac, UNKNOWN_TYPE, len);
}

static uint64_t to_slaves(void)
{
	return eoe_switch_counters(here.sw)->to_slaves - here.announced;
}

/* A mail of the slave in its box, as its application would put it. */
static void post(unsigned pos, const uint8_t *data, size_t len)
{
	struct esc *esc = segment_esc(here.b.segment, pos);
	uint8_t box[1024] = { 0 };

	mailbox_header_put(box, &(struct mailbox_header){ .data_len = (uint16_t)len,
							  .type = MAILBOX_TYPE_EOE });
	memcpy(box + MAILBOX_HEADER_BYTES, data, len);
	esc_pdi_write(esc, bench_now_ns(&here.b), 0x1c00, box, sizeof(box));
}

/* A frame of @len bytes in one fragment of slave @pos. */
static void post_frame(unsigned pos, const uint8_t *frame, size_t len)
{
	uint8_t data[1000];
	struct eoe_split split = { .frame = frame, .len = len };

	post(pos, data, eoe_split_next(&split, data, sizeof(data)));
}

TEST(eoe_switch, arp_and_a_ping_in_fragments_come_back)
{
	begin();
	give_arp(1);
	run_ms(100);
	CHECK_EQ(here.in_count, 1);
	CHECK_EQ(here.in[0].bytes[MAC + 5], 2);
	CHECK_EQ(here.in[0].bytes[TYPE_AT] << 8 | here.in[0].bytes[TYPE_AT + 1], ARP);
	give_ping(1, PING_BYTES);
	run_ms(100);
	CHECK_EQ(here.in_count, 2);
	CHECK_EQ(here.in[1].len, PING_BYTES);
	CHECK_EQ(here.in[1].bytes[34], 0);
	CHECK_MEM(here.in[1].bytes + 42, here.out[1].bytes + 42, PING_BYTES - 42);
	end();
}

TEST(eoe_switch, after_a_long_silence_an_answer_is_fetched_within_five_milliseconds)
{
	uint8_t frame[100] = { 0 };

	begin();
	run_ms(3000);
	give_to_slave(0, 100);
	run_ms(12);
	memset(frame, 0xff, MAC);
	slave_mac(0, frame + MAC);
	post_frame(0, frame, sizeof(frame));
	run_ms(5);
	CHECK_EQ(here.in_count, 1);
	end();
}

TEST(eoe_switch, a_frame_to_a_known_address_goes_to_that_slave_only)
{
	begin();
	give_to_slave(2, 100);
	run_ms(50);
	CHECK_EQ(to_slaves(), 1);
	end();
}

TEST(eoe_switch, broadcasts_and_unknown_addresses_go_to_all_slaves)
{
	static const uint8_t unknown[MAC] = { 2, 9, 9, 9, 9, 9 };

	begin();
	give_arp(77);
	run_ms(50);
	CHECK_EQ(to_slaves(), SLAVES);
	give(unknown, UNKNOWN_TYPE, 100);
	run_ms(50);
	CHECK_EQ(to_slaves(), 2 * SLAVES);
	end();
}

TEST(eoe_switch, slaves_reach_each_other_and_the_host_does_not_see_it)
{
	uint8_t frame[100] = { 0 };

	begin();
	slave_mac(2, frame);
	slave_mac(0, frame + MAC);
	frame[TYPE_AT] = UNKNOWN_TYPE >> 8;
	frame[TYPE_AT + 1] = UNKNOWN_TYPE & 0xff;
	post_frame(0, frame, sizeof(frame));
	run_ms(150);
	CHECK_EQ(eoe_switch_counters(here.sw)->from_slaves, SLAVES + 1);
	CHECK_EQ(to_slaves(), 1);
	CHECK_EQ(here.in_count, 0);
	end();
}

TEST(eoe_switch, an_address_that_moves_to_another_slave_is_followed)
{
	uint8_t frame[100] = { 0 };

	begin();
	give_to_slave(1, 100); /* the host's own address is known then */
	run_ms(50);
	memcpy(frame, host_mac, MAC);
	slave_mac(2, frame + MAC); /* now behind slave 0 */
	post_frame(0, frame, sizeof(frame));
	run_ms(150);
	CHECK_EQ(here.in_count, 1);
	give_ping(2, 100); /* slave 2 would answer */
	run_ms(100);
	CHECK_EQ(to_slaves(), 2);
	CHECK_EQ(here.in_count, 1);
	end();
}

TEST(eoe_switch, a_slave_that_takes_no_mails_costs_a_bounded_queue_and_the_others_nothing)
{
	const struct eoe_switch_counters *ct;

	begin();
	fault("at=0s power-off slave=2");
	for (unsigned i = 0; i < 100; i++) {
		give_to_slave(2, 100);
	}
	give_ping(0, 100);
	run_ms(100);
	ct = eoe_switch_counters(here.sw);
	CHECK_EQ(here.in_count, 1);
	CHECK_EQ(ct->queue_full, 100 - EOE_SWITCH_QUEUE);
	run_ms(EOE_SWITCH_QUEUE * 250);
	CHECK_EQ(ct->not_taken, EOE_SWITCH_QUEUE);
	end();
}

TEST(eoe_switch, fragments_that_do_not_fit_are_dropped_and_the_next_frame_is_whole)
{
	struct eoe_header h = { .type = EOE_FRAGMENT, .fragment = 5, .blocks = 3 };
	uint8_t data[EOE_HEADER_BYTES + EOE_BLOCK_BYTES] = { 0 };

	begin();
	eoe_header_put(data, &h); /* the middle of nothing */
	post(1, data, sizeof(data));
	run_ms(150);
	h = (struct eoe_header){ .type = EOE_FRAGMENT, .blocks = 40 };
	eoe_header_put(data, &h); /* the first one, and no other ever */
	post(1, data, sizeof(data));
	run_ms(150);
	post(1, data, 2); /* no header */
	run_ms(150);
	CHECK_EQ(eoe_switch_counters(here.sw)->bad_fragments, 2);
	CHECK_EQ(eoe_switch_counters(here.sw)->bad_slave, 1);
	give_ping(1, 100);
	run_ms(100);
	CHECK_EQ(here.in_count, 1);
	end();
}

TEST(eoe_switch, frames_too_short_or_from_a_group_address_are_not_forwarded)
{
	uint8_t frame[60] = { 0 };

	begin();
	memset(frame, 0xff, MAC);
	memset(frame + MAC, 0xff, MAC);
	post_frame(0, frame, sizeof(frame));
	run_ms(150);
	frame[MAC] = 2;
	post_frame(0, frame, 13);
	run_ms(150);
	CHECK_EQ(eoe_switch_counters(here.sw)->invalid_frames, 2);
	CHECK_EQ(here.in_count, 0);
	CHECK_EQ(to_slaves(), 0);
	end();
}

TEST(eoe_switch, frames_longer_than_eoe_carries_and_those_to_a_host_that_is_down_are_counted)
{
	begin();
	give_to_slave(0, EOE_FRAME_MAX_BYTES + 1);
	give_to_slave(0, EOE_FRAME_MAX_BYTES);
	run_ms(50);
	CHECK_EQ(eoe_switch_counters(here.sw)->host_lost, 1);
	CHECK_EQ(to_slaves(), 1);
	here.is_down = 1;
	give_ping(0, 100);
	run_ms(100);
	CHECK_EQ(eoe_switch_counters(here.sw)->host_lost, 2);
	end();
}

TEST(eoe_switch, after_the_bus_was_down_frames_pass_again)
{
	begin();
	give_to_slave(0, 1000);
	service();
	eoe_switch_detach(here.sw);
	CHECK_EQ(eoe_switch_counters(here.sw)->not_taken, 1);
	give_to_slave(0, 100);
	eoe_switch_service(here.sw, NULL, 0, (span_t){ NS_PER_S },
			   (mono_t){ bench_now_ns(&here.b) });
	CHECK_EQ(here.out_next, here.out_count);
	give_ping(0, 100);
	run_ms(100);
	CHECK_EQ(here.in_count, 1);
	end();
}
