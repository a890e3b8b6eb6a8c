/* SPDX-License-Identifier: MIT */
/* SOEM's base functions on our NIC layer. */
#include "nicdrv.h"

#include "ethercatbase.h"

#include "harness/test.h"
#include "link/line.h"
#include "unit/master/link/fake_wire.h"
#include "wire/esc_reg.h"

struct nic {
	struct fake_wire wire;
	struct line *line;
	ecx_portt port;
};

static struct nic *nic_create(void)
{
	struct nic *nic = calloc(1, sizeof(*nic));

	CHECK_EQ(line_create(fake_platform(&nic->wire), fake_transport(&nic->wire), &nic->line), 0);
	line_bind(nic->line);
	CHECK_EQ(ecx_setupnic(&nic->port, "", 0), 1);
	return nic;
}

static void nic_destroy(struct nic *nic)
{
	ecx_closenic(&nic->port);
	line_destroy(nic->line);
	free(nic);
}

static void answer_data(struct fake_wire *wire, uint8_t *frame, size_t len)
{
	(void)wire;
	fake_pass_slave(frame, len);
	frame[26] = 0x34;
	frame[27] = 0x12;
}

TEST(nicdrv, register_read_gives_data_and_wkc)
{
	struct nic *nic = nic_create();
	uint16 value = 0;

	nic->wire.answer = answer_data;
	CHECK_EQ(ecx_FPRD(&nic->port, 0x1001, ESC_REG_AL_STATUS, 2, &value, EC_TIMEOUTRET), 1);
	CHECK_EQ(value, 0x1234);
	CHECK_EQ(nic->wire.last_sent.len, 60);
	nic_destroy(nic);
}

TEST(nicdrv, lost_register_read_is_sent_again)
{
	struct nic *nic = nic_create();
	uint16 value = 0;

	nic->wire.drop = 2;
	CHECK_EQ(ecx_FPRD(&nic->port, 0x1001, ESC_REG_AL_STATUS, 2, &value, EC_TIMEOUTRET), 1);
	CHECK_EQ(nic->wire.sent, 3);
	CHECK_EQ(nic->port.retries, 2);
	nic_destroy(nic);
}

TEST(nicdrv, silence_ends_after_three_tries)
{
	struct nic *nic = nic_create();
	uint16 value = 77;

	nic->wire.drop = 100;
	CHECK_EQ(ecx_FPRD(&nic->port, 0x1001, ESC_REG_AL_STATUS, 2, &value, EC_TIMEOUTRET3),
		 EC_NOFRAME);
	CHECK_EQ(nic->wire.sent, 3);
	CHECK_EQ(value, 77);
	CHECK_EQ(nic->wire.now_ns, 62000000);
	nic_destroy(nic);
}

TEST(nicdrv, mailbox_write_whose_answer_is_late_is_sent_exactly_once)
{
	struct nic *nic = nic_create();
	uint8 mailbox[16] = { 1 };

	nic->wire.travel_ns = 45000000;
	CHECK_EQ(ecx_FPWR(&nic->port, 0x1001, 0x1000, sizeof(mailbox), mailbox, EC_TIMEOUTRET3), 1);
	CHECK_EQ(nic->wire.sent, 1);
	nic->wire.drop = 1;
	CHECK_EQ(ecx_FPWR(&nic->port, 0x1001, 0x1000, sizeof(mailbox), mailbox, EC_TIMEOUTRET3),
		 EC_NOFRAME);
	CHECK_EQ(nic->wire.sent, 2);
	nic_destroy(nic);
}

TEST(nicdrv, register_write_is_sent_again)
{
	struct nic *nic = nic_create();
	uint16 value = 1;

	nic->wire.drop = 1;
	CHECK_EQ(ecx_FPWR(&nic->port, 0x1001, ESC_REG_AL_CONTROL, 2, &value, EC_TIMEOUTRET3), 1);
	CHECK_EQ(nic->wire.sent, 2);
	nic_destroy(nic);
}

TEST(nicdrv, late_answer_to_a_first_try_is_not_taken_for_the_next_frame)
{
	struct nic *nic = nic_create();
	uint16 value = 0;

	/* 16 buffers, but 256 indices on the wire: the same buffer does not mean the same index. */
	for (int i = 0; i < EC_MAXBUF + 1; i++) {
		uint8_t before = nic->wire.last_sent.bytes[17];

		ecx_FPRD(&nic->port, 0x1001, ESC_REG_AL_STATUS, 2, &value, EC_TIMEOUTRET);
		CHECK_EQ((uint8_t)(nic->wire.last_sent.bytes[17] - before), i == 0 ? 0 : 1);
	}
	nic_destroy(nic);
}

TEST(nicdrv, no_line_no_nic)
{
	static ecx_portt port;

	line_bind(NULL);
	CHECK_EQ(ecx_setupnic(&port, "", 0), 0);
}

TEST(osal, timers_and_sleep_run_on_the_lines_clock)
{
	struct nic *nic = nic_create();
	osal_timert timer;

	osal_timer_start(&timer, 1500);
	CHECK_EQ(osal_timer_is_expired(&timer), 0);
	osal_usleep(1499);
	CHECK_EQ(osal_timer_is_expired(&timer), 0);
	osal_usleep(1);
	CHECK_EQ(osal_timer_is_expired(&timer), 1);
	CHECK_EQ(nic->wire.now_ns, 1500000);
	CHECK_EQ(osal_current_time().sec, DC_EPOCH_UNIX_S);
	nic_destroy(nic);
}

TEST(nicdrv, a_slow_wire_is_waited_for_up_to_the_timeout_of_the_line)
{
	struct nic *nic = nic_create();
	uint16 value = 0;

	line_timeout_set(nic->line, (span_t){ 20 * NS_PER_MS });
	nic->wire.travel_ns = 15 * NS_PER_MS;
	CHECK_EQ(ecx_FPRD(&nic->port, 0x1001, ESC_REG_AL_STATUS, 2, &value, EC_TIMEOUTRET), 1);
	CHECK_EQ(nic->port.retries, 0);
	nic->wire.drop = 3;
	nic->wire.now_ns = 0;
	CHECK_EQ(ecx_FPRD(&nic->port, 0x1001, ESC_REG_AL_STATUS, 2, &value, EC_TIMEOUTRET),
		 EC_NOFRAME);
	CHECK_EQ(nic->wire.now_ns, (20 + 100 + 500) * NS_PER_MS);
	nic_destroy(nic);
}
