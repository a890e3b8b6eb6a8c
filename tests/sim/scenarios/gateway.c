/* SPDX-License-Identifier: MIT */
/* A client of the mailbox gateway and a busy EoE switch beside the cycle: no cycle is disturbed. */
#include <errno.h>
#include <netinet/in.h>
#include <unistd.h>

#include "daemon/session_internal.h"
#include "devices/fb1111_piccolo.h"
#include "harness/test.h"
#include "network/eoe_switch.h"
#include "network/gateway_frame.h"
#include "sim/harness/virtual_master.h"
#include "wire/foe.h"

enum {
	DRIVE = 1,
	STATION = 0x1002,
	ROOM = 1024 - MAILBOX_HEADER_BYTES - FOE_HEADER_BYTES,
	FILE_BYTES = 20000,
	FRAME_BYTES = 1500,
	CYCLES_PER_LOOK = 5,
	LOOKS = 400,
};

static struct virtual_bench b;
static struct virtual_master vm;
static struct eoe_switch *sw;
static uint8_t file[FILE_BYTES];

static int make(int position, struct segment_slave_spec *ret_spec)
{
	return position == DRIVE ? virtual_bench_slave("akd", position, ret_spec)
				 : fb1111_piccolo_slave(position, ret_spec);
}

/* An address of this process alone. */
static uint32_t loopback(void)
{
	return 0x7f000000u | ((uint32_t)getpid() % 0xfffff0 + 2);
}

static int connect_client(void)
{
	const struct sockaddr_in address = { .sin_family = AF_INET,
					     .sin_port = htons(34980),
					     .sin_addr = { htonl(loopback()) } };
	int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);

	CHECK_EQ(connect(fd, (const struct sockaddr *)&address, sizeof(address)), 0);
	return fd;
}

/* Broadcasts without end: every slave with EoE is sent each. */
static int flood(void *ctx, uint8_t *frame, size_t capacity)
{
	(void)ctx;
	CHECK(capacity >= FRAME_BYTES);
	memset(frame, 0, FRAME_BYTES);
	memset(frame, 0xff, 6);
	frame[6] = 2;
	return FRAME_BYTES;
}

static int swallow(void *ctx, const uint8_t *frame, size_t len)
{
	(void)ctx;
	(void)frame;
	(void)len;
	return 0;
}

static void run(void)
{
	for (unsigned i = 0; i < CYCLES_PER_LOOK; i++) {
		eoe_switch_service(sw, bus_mailbox(vm.session->bus), 2, (span_t){ NS_PER_S },
				   (mono_t){ NS_PER_S });
		CHECK_EQ(virtual_master_run(&vm, 1), SESSION_GOES_ON);
	}
}

/* One FoE message, and the answer to it. */
static struct foe_message exchange(int fd, const struct foe_message *m, uint8_t *answer)
{
	uint8_t data[GATEWAY_DATA_BYTES];
	uint8_t frame[GATEWAY_FRAME_BYTES];
	struct gateway_mail mail = { .header = { .address = STATION, .type = MAILBOX_TYPE_FOE },
				     .data = data };
	struct foe_message got;
	ssize_t len = -1;

	mail.header.data_len = (uint16_t)foe_format(m, data, sizeof(data));
	CHECK(send(fd, frame, gateway_frame_put(frame, &mail), 0) > 0);
	for (unsigned i = 0; i < LOOKS && len < 0; i++) {
		run();
		len = recv(fd, answer, GATEWAY_FRAME_BYTES, 0);
	}
	CHECK(len > 0);
	CHECK_EQ(gateway_frame_get(answer, (size_t)len, &mail), len);
	CHECK_EQ(foe_parse(mail.data, mail.header.data_len, &got), 0);
	return got;
}

static void write_file(int fd)
{
	uint8_t answer[GATEWAY_FRAME_BYTES];
	struct foe_message m = { .operation = FOE_WRITE,
				 .body = (const uint8_t *)"a.bin",
				 .body_len = 5 };

	CHECK_EQ(exchange(fd, &m, answer).operation, FOE_ACK);
	for (size_t at = 0; at < FILE_BYTES; at += ROOM) {
		m = (struct foe_message){ .operation = FOE_DATA,
					  .number = (uint32_t)(at / ROOM + 1),
					  .body = file + at,
					  .body_len =
						  FILE_BYTES - at < ROOM ? FILE_BYTES - at : ROOM };
		CHECK_EQ(exchange(fd, &m, answer).operation, FOE_ACK);
	}
}

TEST(sim_gateway, a_file_through_the_gateway_and_a_flood_of_frames_disturb_no_cycle)
{
	enum { IDLE_CYCLES = 4000 };
	const struct eoe_switch_host host = { .receive = flood, .send = swallow };
	const char *settings[] = { NULL, NULL };
	char listen[64];
	int64_t phase_idle_ns;
	int fd;

	snprintf(listen, sizeof(listen), "gateway.listen=127.%u.%u.%u", loopback() >> 16 & 255,
		 loopback() >> 8 & 255, loopback() & 255);
	settings[0] = listen;
	virtual_bench_init(&b, &(struct virtual_spec){ .slaves = 2, .make = make, .seed = 17 });
	virtual_master_init(&vm, &b, settings);
	virtual_master_settle(&vm);
	virtual_master_run(&vm, IDLE_CYCLES);
	phase_idle_ns = vm.result.phase_max_ns;
	virtual_master_forget(&vm);
	CHECK_EQ(eoe_switch_create(&host, &sw), 0);
	fd = connect_client();
	write_file(fd);
	for (unsigned i = 0; i < LOOKS; i++) {
		run();
	}
	virtual_master_check_undisturbed(&vm, LOOKS * CYCLES_PER_LOOK);
	CHECK(vm.result.phase_max_ns <= phase_idle_ns + 2000);
	CHECK(eoe_switch_counters(sw)->to_slaves > 40);
	CHECK(eoe_switch_counters(sw)->queue_full > 100);
	printf("%" PRIu64 " cycles: %u bytes by FoE, %" PRIu64 " frames of %u bytes to the slave\n",
	       vm.result.samples, (unsigned)FILE_BYTES, eoe_switch_counters(sw)->to_slaves,
	       (unsigned)FRAME_BYTES);
	eoe_switch_destroy(sw);
	close(fd);
	virtual_master_kill(&vm);
	virtual_bench_done(&b);
}
