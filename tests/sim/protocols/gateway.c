/* SPDX-License-Identifier: MIT */
/*
 * The mailbox gateway in front of simulated drives: what clients get back, and that neither their
 * mails nor hostile bytes disturb the engine's own requests.
 */
#include "network/gateway.h"

#include <errno.h>

#include "base/bytes.h"
#include "base/prng.h"
#include "harness/test.h"
#include "sim/protocols/bench.h"
#include "wire/foe.h"

enum {
	REPLIES = 64,
	TIMEOUT_MS = 200,
	VENDOR_OBJECT = 0x1018,
	MEMORY = 0x2f00,
	AKD = 0x6a,
	ROOM = 1024 - MAILBOX_HEADER_BYTES, /* data of the drive's mails */
	FILE_BYTES = 5000,
};

static const char *const drives[] = { "all", "all", NULL };

struct reply {
	uint64_t client;
	struct mailbox_header header;
	uint8_t data[GATEWAY_DATA_BYTES];
};

static struct {
	struct protocol_bench b;
	struct gateway *gw;
	struct slave_info slaves[2];
	struct gateway_bus bus;
	struct reply reply[REPLIES];
	unsigned replies;
} here;

static void keep_reply(void *ctx, const struct gateway_peer *peer, const uint8_t *frame, size_t len)
{
	struct gateway_mail mail;
	struct reply *r = &here.reply[here.replies % REPLIES];

	(void)ctx;
	CHECK_EQ(gateway_frame_get(frame, len, &mail), len);
	r->client = peer->connection;
	r->header = mail.header;
	memcpy(r->data, mail.data, mail.header.data_len);
	here.replies++;
}

static void begin(void)
{
	const struct gateway_out out = { .send = keep_reply };

	memset(&here, 0, sizeof(here));
	bench_begin(&here.b, drives);
	for (unsigned i = 0; i < 2; i++) {
		bench_set(&here.b, i, "coe.memory", "20000");
		bench_to_preop(&here.b, i);
		here.slaves[i].station_addr = (uint16_t)(BENCH_STATION + i);
	}
	CHECK_EQ(gateway_create(&out, &here.gw), 0);
	here.bus = (struct gateway_bus){ .mb = here.b.mb,
					 .slaves = here.slaves,
					 .slave_count = 2,
					 .timeout = { TIMEOUT_MS * NS_PER_MS } };
}

static void end(void)
{
	gateway_destroy(here.gw);
	bench_end(&here.b);
}

static void pass(void)
{
	gateway_step(here.gw, &here.bus, (mono_t){ bench_now_ns(&here.b) });
	mailbox_step(here.b.mb);
	line_sleep(here.b.line, (span_t){ NS_PER_MS / 10 });
}

static void run_until_answered(unsigned replies)
{
	for (unsigned i = 0; i < 20000 && (here.replies < replies || gateway_open(here.gw) > 0);
	     i++) {
		pass();
	}
	CHECK_EQ(here.replies, replies);
	CHECK_EQ(gateway_open(here.gw), 0);
}

static void give(uint64_t client, uint16_t station, struct mailbox_header header,
		 const uint8_t *data)
{
	const struct gateway_peer peer = { .connection = client };

	header.address = station;
	gateway_take(here.gw, &peer, &(struct gateway_mail){ .header = header, .data = data });
}

static void give_upload(uint64_t client, uint16_t station, uint8_t counter, uint16_t index)
{
	uint8_t sdo[10] = { 0, 0x20, 0x40 };

	put_le16(sdo + 3, index);
	sdo[5] = 1;
	give(client, station,
	     (struct mailbox_header){
		     .data_len = sizeof(sdo), .type = MAILBOX_TYPE_COE, .counter = counter },
	     sdo);
}

static void give_foe(uint64_t client, const struct foe_message *m)
{
	uint8_t data[GATEWAY_DATA_BYTES];
	size_t len = foe_format(m, data, ROOM);

	give(client, BENCH_STATION,
	     (struct mailbox_header){
		     .data_len = (uint16_t)len, .type = MAILBOX_TYPE_FOE, .counter = 1 },
	     data);
}

static const struct reply *newest(void)
{
	CHECK(here.replies > 0);
	return &here.reply[(here.replies - 1) % REPLIES];
}

static void must_refuse(enum mailbox_error error)
{
	run_until_answered(1);
	CHECK_EQ(newest()->header.type, MAILBOX_TYPE_ERROR);
	CHECK_EQ(mailbox_error_get(newest()->data, newest()->header.data_len), error);
}

static uint32_t read_vendor(void)
{
	uint8_t data[4];
	struct mailbox_request rq = {
		.protocol = &coe_protocol,
		.with.coe = { .operation = COE_UPLOAD, .index = VENDOR_OBJECT, .subindex = 1 },
		.buffer = data,
		.capacity = sizeof(data),
		.timeout = { TIMEOUT_MS * NS_PER_MS },
	};

	CHECK_EQ(bench_do(&here.b, 0, &rq), 0);
	return get_le32(data);
}

static void fault(const char *line)
{
	char error[128];

	fault_plan_restart(here.b.faults, bench_now_ns(&here.b));
	CHECK_EQ(fault_plan_add(here.b.faults, line, 2, error, sizeof(error)), 0);
	line_sleep(here.b.line, (span_t){ NS_PER_MS });
}

TEST(gateway, an_answer_has_the_address_and_the_counter_of_the_request)
{
	begin();
	give_upload(5, BENCH_STATION + 1, 6, VENDOR_OBJECT);
	run_until_answered(1);
	CHECK_EQ(newest()->client, 5);
	CHECK_EQ(newest()->header.address, BENCH_STATION + 1);
	CHECK_EQ(newest()->header.counter, 6);
	CHECK_EQ(newest()->header.type, MAILBOX_TYPE_COE);
	CHECK_EQ(get_le32(newest()->data + 6), AKD);
	end();
}

TEST(gateway, mails_of_one_slave_are_answered_in_their_order)
{
	begin();
	for (uint8_t i = 1; i <= 7; i++) {
		give_upload(1, BENCH_STATION, i, i == 3 ? 0x7777 : VENDOR_OBJECT);
	}
	run_until_answered(7);
	for (uint8_t i = 0; i < 7; i++) {
		CHECK_EQ(here.reply[i].header.counter, i + 1);
	}
	CHECK_EQ(here.reply[2].data[2], 0x80); /* the slave's own abort is passed back */
	CHECK_EQ(get_le32(here.reply[2].data + 6), 0x06020000);
	end();
}

TEST(gateway, the_master_has_no_objects)
{
	begin();
	give_upload(1, 0, 2, VENDOR_OBJECT);
	run_until_answered(1);
	CHECK_EQ(newest()->header.address, 0);
	CHECK_EQ(newest()->data[2], 0x80);
	CHECK_EQ(get_le16(newest()->data + 3), VENDOR_OBJECT);
	CHECK_EQ(get_le32(newest()->data + 6), 0x06020000);
	end();
}

TEST(gateway, a_mail_to_no_slave_is_refused)
{
	begin();
	give_upload(1, 0x4444, 2, VENDOR_OBJECT);
	must_refuse(MAILBOX_ERROR_INVALID_HEADER);
	end();
}

TEST(gateway, a_protocol_that_no_slave_has_is_refused)
{
	static const uint8_t data[] = { 1, 2, 3 };

	begin();
	give(1, BENCH_STATION, (struct mailbox_header){ .data_len = 3, .type = 9 }, data);
	must_refuse(MAILBOX_ERROR_UNSUPPORTED_PROTOCOL);
	end();
}

TEST(gateway, a_mail_longer_than_the_box_of_the_slave_is_refused_and_the_next_one_is_not)
{
	static const uint8_t data[ROOM + 1];

	begin();
	give(1, BENCH_STATION,
	     (struct mailbox_header){ .data_len = sizeof(data), .type = MAILBOX_TYPE_FOE }, data);
	must_refuse(MAILBOX_ERROR_INVALID_SIZE);
	give_upload(1, BENCH_STATION, 1, VENDOR_OBJECT);
	run_until_answered(2);
	CHECK_EQ(get_le32(newest()->data + 6), AKD);
	end();
}

TEST(gateway, what_a_silent_slave_does_not_answer_is_counted_and_delays_no_other_slave)
{
	int64_t begun;

	begin();
	fault("at=0s mailbox-stuck slave=0");
	begun = bench_now_ns(&here.b);
	give_upload(1, BENCH_STATION, 1, VENDOR_OBJECT);
	give_upload(1, BENCH_STATION + 1, 2, VENDOR_OBJECT);
	for (unsigned i = 0; i < 500 && here.replies == 0; i++) {
		pass();
	}
	CHECK_EQ(here.replies, 1);
	CHECK_EQ(newest()->header.counter, 2);
	CHECK(bench_now_ns(&here.b) - begun < TIMEOUT_MS * NS_PER_MS / 4);
	run_until_answered(1);
	CHECK(bench_now_ns(&here.b) - begun >= TIMEOUT_MS * NS_PER_MS);
	CHECK_EQ(gateway_counters(here.gw)->unanswered, 1);
	end();
}

/* Each client's packets, one after the answer to the other. */
struct writer {
	uint64_t client;
	const char *name;
	uint8_t fill;
	size_t sent;
	uint32_t packet;
	int is_done;
};

static void begin_write(const struct writer *w)
{
	give_foe(w->client, &(struct foe_message){ .operation = FOE_WRITE,
						   .body = (const uint8_t *)w->name,
						   .body_len = strlen(w->name) });
}

static void go_on_writing(struct writer *w, const struct reply *r)
{
	uint8_t part[ROOM];
	size_t room = ROOM - FOE_HEADER_BYTES;
	size_t now = FILE_BYTES - w->sent < room ? FILE_BYTES - w->sent : room;
	struct foe_message m;

	CHECK_EQ(foe_parse(r->data, r->header.data_len, &m), 0);
	CHECK_EQ(m.operation, FOE_ACK);
	CHECK_EQ(m.number, w->packet);
	w->is_done = w->sent == FILE_BYTES;
	if (!w->is_done) {
		memset(part, w->fill, now);
		w->sent += now;
		w->packet++;
		give_foe(w->client, &(struct foe_message){ .operation = FOE_DATA,
							   .number = w->packet,
							   .body = part,
							   .body_len = now });
	}
}

static void must_have_file(const char *name, uint8_t fill)
{
	static uint8_t got[FILE_BYTES + 1];
	struct mailbox_request rq = bench_foe(FOE_READ, name, got, sizeof(got));

	CHECK_EQ(bench_do(&here.b, 0, &rq), 0);
	CHECK_EQ(rq.len, FILE_BYTES);
	for (size_t i = 0; i < FILE_BYTES; i++) {
		CHECK_EQ(got[i], fill);
	}
}

TEST(gateway, transfers_of_two_clients_to_one_slave_do_not_mix)
{
	struct writer w[2] = { { .client = 1, .name = "a.bin", .fill = 0xaa },
			       { .client = 2, .name = "b.bin", .fill = 0xbb } };
	unsigned seen = 0;

	begin();
	begin_write(&w[0]);
	begin_write(&w[1]);
	for (unsigned i = 0; i < 20000 && !(w[0].is_done && w[1].is_done); i++) {
		if (i % 8 == 0) { /* mails of another protocol pass in between */
			give_upload(3, BENCH_STATION, 1, VENDOR_OBJECT);
		}
		pass();
		for (; seen < here.replies; seen++) {
			const struct reply *r = &here.reply[seen % REPLIES];

			if (r->client != 3) {
				go_on_writing(&w[r->client - 1], r);
			}
		}
	}
	CHECK(w[0].is_done && w[1].is_done);
	must_have_file("a.bin", 0xaa);
	must_have_file("b.bin", 0xbb);
	end();
}

TEST(gateway, a_client_that_stops_in_a_transfer_is_waited_for_half_a_second)
{
	int64_t begun;

	begin();
	begin_write(&(struct writer){ .client = 1, .name = "a.bin" });
	run_until_answered(1);
	begun = bench_now_ns(&here.b);
	begin_write(&(struct writer){ .client = 2, .name = "b.bin" });
	run_until_answered(2);
	CHECK(bench_now_ns(&here.b) - begun > 450 * NS_PER_MS);
	CHECK(bench_now_ns(&here.b) - begun < 600 * NS_PER_MS);
	CHECK_EQ(newest()->client, 2);
	end();
}

TEST(gateway, the_acknowledge_of_the_last_packet_read_is_not_waited_for)
{
	static uint8_t file[100];
	struct mailbox_request rq = bench_foe(FOE_WRITE, "c.bin", file, sizeof(file));
	int64_t begun;

	begin();
	CHECK_EQ(bench_do(&here.b, 0, &rq), 0);
	give_foe(1, &(struct foe_message){ .operation = FOE_READ,
					   .body = (const uint8_t *)"c.bin",
					   .body_len = 5 });
	run_until_answered(1);
	begun = bench_now_ns(&here.b);
	give_foe(1, &(struct foe_message){ .operation = FOE_ACK, .number = 1 });
	run_until_answered(1);
	CHECK(bench_now_ns(&here.b) - begun < TIMEOUT_MS * NS_PER_MS / 4);
	CHECK_EQ(gateway_counters(here.gw)->unanswered, 0);
	end();
}

TEST(gateway, mails_do_not_come_between_those_of_a_transfer_of_the_engine)
{
	static uint8_t written[20000];
	static uint8_t read[20000];
	struct mailbox_request rq = {
		.protocol = &coe_protocol,
		.with.coe = { .operation = COE_DOWNLOAD, .index = MEMORY, .subindex = 1 },
		.buffer = written,
		.capacity = sizeof(written),
		.timeout = { TIMEOUT_MS * NS_PER_MS },
	};

	begin();
	for (size_t i = 0; i < sizeof(written); i++) {
		written[i] = (uint8_t)(i * 7 % 251);
	}
	for (unsigned way = 0; way < 2; way++) {
		CHECK_EQ(mailbox_submit(here.b.mb, &rq), 0);
		while (mailbox_is_running(&rq)) {
			if (gateway_open(here.gw) == 0) {
				give_upload(1, BENCH_STATION, 1, VENDOR_OBJECT);
			}
			pass();
		}
		CHECK_EQ(rq.result, 0);
		CHECK_EQ(rq.len, sizeof(written));
		rq.with.coe.operation = COE_UPLOAD;
		rq.buffer = read;
	}
	CHECK_MEM(read, written, sizeof(read));
	CHECK(here.replies > 0);
	CHECK_EQ(get_le32(newest()->data + 6), AKD);
	end();
}

TEST(gateway, a_client_that_is_gone_gets_nothing_and_holds_no_place)
{
	const struct gateway_peer gone = { .connection = 1 };

	begin();
	give_upload(1, BENCH_STATION, 1, VENDOR_OBJECT);
	give_upload(1, BENCH_STATION, 2, VENDOR_OBJECT);
	pass(); /* the first one is with the slave */
	gateway_forget(here.gw, &gone);
	give_upload(2, BENCH_STATION, 3, VENDOR_OBJECT);
	run_until_answered(1);
	CHECK_EQ(newest()->client, 2);
	end();
}

TEST(gateway, a_client_has_eight_places_and_a_flood_of_datagrams_leaves_the_others)
{
	begin();
	for (unsigned i = 0; i < 20; i++) {
		give_upload(7, BENCH_STATION, 1, VENDOR_OBJECT);
	}
	CHECK_EQ(gateway_open(here.gw), GATEWAY_MAILS_OF_PEER);
	CHECK_EQ(gateway_counters(here.gw)->dropped, 20 - GATEWAY_MAILS_OF_PEER);
	for (uint16_t port = 1; port < 1000; port++) {
		const struct gateway_peer peer = { .address = { .sin6_port = port } };
		static const uint8_t data[10];

		gateway_take(here.gw, &peer,
			     &(struct gateway_mail){ .header = { .data_len = sizeof(data),
								 .address = BENCH_STATION },
						     .data = data });
	}
	CHECK_EQ(gateway_open(here.gw), GATEWAY_MAILS_OF_PEER + GATEWAY_MAILS_OF_UDP);
	for (uint64_t client = 10; client < 10 + GATEWAY_CLIENTS - 1; client++) {
		const struct gateway_peer peer = { .connection = client };

		CHECK(!gateway_is_full(here.gw, &peer));
		for (unsigned i = 0; i < GATEWAY_MAILS_OF_PEER; i++) {
			give_upload(client, BENCH_STATION + 1, 1, VENDOR_OBJECT);
		}
		CHECK(gateway_is_full(here.gw, &peer));
	}
	CHECK_EQ(gateway_open(here.gw), GATEWAY_MAILS);
	end();
}

TEST(gateway, when_the_bus_goes_down_all_mails_are_forgotten)
{
	begin();
	give_upload(1, BENCH_STATION, 1, VENDOR_OBJECT);
	give_upload(1, BENCH_STATION, 2, VENDOR_OBJECT);
	pass();
	gateway_detach(here.gw);
	here.bus.mb = NULL;
	gateway_step(here.gw, &here.bus, (mono_t){ bench_now_ns(&here.b) });
	CHECK_EQ(gateway_open(here.gw), 0);
	CHECK_EQ(here.replies, 0);
	end();
}

TEST(gateway, mails_of_any_bytes_leave_the_mailbox_usable)
{
	struct prng rng = { .state = 11 };
	uint8_t data[GATEWAY_DATA_BYTES];

	begin();
	for (unsigned round = 0; round < 400; round++) {
		size_t len = 1 + prng_next(&rng) % (round % 10 == 0 ? ROOM : 40);

		for (size_t i = 0; i < len; i++) {
			data[i] = (uint8_t)prng_next(&rng);
		}
		if (round % 2 == 0) { /* near to a real one */
			data[0] = 0;
			data[1 % len] = 0x20;
		}
		give(1, BENCH_STATION,
		     (struct mailbox_header){ .data_len = (uint16_t)len,
					      .type = (uint8_t)(prng_next(&rng) % 16) },
		     data);
		for (unsigned i = 0; i < 5000 && gateway_open(here.gw) > 0; i++) {
			pass();
		}
		CHECK_EQ(gateway_open(here.gw), 0);
		if (round % 20 == 0) {
			CHECK_EQ(read_vendor(), AKD);
		}
	}
	CHECK(gateway_counters(here.gw)->answers > 20);
	end();
}
