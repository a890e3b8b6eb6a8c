/* SPDX-License-Identifier: MIT */
/* The FoE server of a simulated slave: files, packets, BUSY, errors, BOOT. */
#include <errno.h>

#include "devices/catalogue.h"
#include "devices/sii_device.h"
#include "harness/test.h"
#include "terminal.h"
#include "wire/al.h"
#include "wire/foe.h"
#include "wire/mailbox.h"

enum { BOX = 128, STATION = BENCH_STATION, PACKET = BOX - MAILBOX_HEADER_BYTES - FOE_HEADER_BYTES };

static uint8_t counter;
static uint8_t answer[BOX];

static struct bench *start(void)
{
	struct bench *b = terminal_create(BOX);

	counter = 0;
	terminal_to_preop(b, BOX);
	return b;
}

static void set(struct bench *b, const char *key, const char *value)
{
	struct sim_device *dev = segment_device(b->segment, 0);

	CHECK_EQ(dev->ops->io_set(dev, key, value), 0);
}

/* The answer to one FoE message; operation 0: there was none. */
static struct foe_message ask(struct bench *b, uint8_t operation, uint32_t number, const void *body,
			      size_t body_len)
{
	const struct foe_message m = {
		.operation = operation, .number = number, .body = body, .body_len = body_len
	};
	struct foe_message reply = { .operation = 0 };
	uint8_t data[BOX];
	uint8_t header;
	int len;

	counter = mailbox_counter_next(counter);
	CHECK_EQ(terminal_put(b, MAILBOX_TYPE_FOE, counter, data,
			      foe_format(&m, data, BOX - MAILBOX_HEADER_BYTES)),
		 1);
	len = terminal_take(b, &header, answer, sizeof(answer));
	if (len >= 0) {
		CHECK_EQ(header & 0x0f, MAILBOX_TYPE_FOE);
		CHECK_EQ(foe_parse(answer, (size_t)len, &reply), 0);
	}
	return reply;
}

static struct foe_message open_as(struct bench *b, uint8_t operation, const char *name,
				  uint32_t password)
{
	return ask(b, operation, password, name, strlen(name));
}

static void check_error(struct foe_message m, uint32_t code)
{
	CHECK_EQ(m.operation, FOE_ERROR);
	CHECK_EQ(m.number, code);
	CHECK(m.body_len > 0);
}

static void fill(uint8_t *bytes, size_t len)
{
	for (size_t i = 0; i < len; i++) {
		bytes[i] = (uint8_t)(i * 7 + i / 256);
	}
}

static void write_file(struct bench *b, const char *name, const uint8_t *bytes, size_t len)
{
	size_t pos = 0;
	size_t now;

	CHECK_EQ(open_as(b, FOE_WRITE, name, 0).operation, FOE_ACK);
	for (uint32_t packet = 1;; packet++) {
		struct foe_message m;

		now = len - pos < PACKET ? len - pos : PACKET;
		m = ask(b, FOE_DATA, packet, bytes + pos, now);
		CHECK_EQ(m.operation, FOE_ACK);
		CHECK_EQ(m.number, packet);
		pos += now;
		if (now < PACKET) {
			return;
		}
	}
}

static void check_file(struct bench *b, const char *name, const uint8_t *bytes, size_t len)
{
	struct foe_message m = open_as(b, FOE_READ, name, 0);
	size_t pos = 0;

	for (uint32_t packet = 1;; packet++) {
		CHECK_EQ(m.operation, FOE_DATA);
		CHECK_EQ(m.number, packet);
		CHECK(pos + m.body_len <= len);
		CHECK_MEM(m.body, bytes + pos, m.body_len);
		pos += m.body_len;
		if (m.body_len < PACKET) {
			break;
		}
		m = ask(b, FOE_ACK, packet, NULL, 0);
	}
	CHECK_EQ(pos, len);
	CHECK_EQ(ask(b, FOE_ACK, 99, NULL, 0).operation, FOE_ERROR); /* of the last packet */
}

TEST(sim_foe, what_was_written_is_read_back_at_every_length_round_a_packet)
{
	static const size_t lens[] = { 0, 1, PACKET - 1, PACKET, PACKET + 1, 2 * PACKET, 1000 };
	struct bench *b = start();
	uint8_t bytes[1000];

	fill(bytes, sizeof(bytes));
	for (size_t i = 0; i < sizeof(lens) / sizeof(lens[0]); i++) {
		write_file(b, "a.bin", bytes, lens[i]);
		check_file(b, "a.bin", bytes, lens[i]);
	}
	bench_destroy(b);
}

TEST(sim_foe, a_file_that_is_not_there_and_a_wrong_password_are_errors_with_a_text)
{
	struct bench *b = start();

	check_error(open_as(b, FOE_READ, "none", 0), FOE_ERROR_NOT_FOUND);
	CHECK_MEM(answer + FOE_HEADER_BYTES, "none", 4);
	set(b, "foe.password", "0x1234");
	check_error(open_as(b, FOE_WRITE, "a", 0x1235), FOE_ERROR_NO_RIGHTS);
	CHECK_EQ(open_as(b, FOE_WRITE, "a", 0x1234).operation, FOE_ACK);
	bench_destroy(b);
}

TEST(sim_foe, busy_comes_as_often_as_set_and_then_the_packet_is_taken_once)
{
	static const uint8_t data[3] = { 1, 2, 3 };
	struct bench *b = start();

	set(b, "foe.busy", "2");
	CHECK_EQ(open_as(b, FOE_WRITE, "a", 0).operation, FOE_ACK);
	for (unsigned i = 0; i < 2; i++) {
		struct foe_message m = ask(b, FOE_DATA, 1, data, 3);

		CHECK_EQ(m.operation, FOE_BUSY);
		CHECK_EQ(m.busy_done, i + 1);
		CHECK_EQ(m.busy_all, 2);
	}
	CHECK_EQ(ask(b, FOE_DATA, 1, data, 3).operation, FOE_ACK);
	set(b, "foe.busy", "0");
	check_file(b, "a", data, 3);
	set(b, "foe.busy", "-1");
	CHECK_EQ(open_as(b, FOE_WRITE, "a", 0).operation, FOE_ACK);
	for (unsigned i = 0; i < 10; i++) {
		CHECK_EQ(ask(b, FOE_DATA, 1, data, 3).operation, FOE_BUSY);
	}
	bench_destroy(b);
}

TEST(sim_foe, an_error_in_the_middle_keeps_the_old_file)
{
	struct bench *b = start();
	uint8_t bytes[PACKET + 5];

	fill(bytes, sizeof(bytes));
	write_file(b, "a", bytes, 10);
	set(b, "foe.fail_at", "2");
	CHECK_EQ(open_as(b, FOE_WRITE, "a", 0).operation, FOE_ACK);
	CHECK_EQ(ask(b, FOE_DATA, 1, bytes, PACKET).operation, FOE_ACK);
	check_error(ask(b, FOE_DATA, 2, bytes, 5), FOE_ERROR_FLASH);
	check_error(ask(b, FOE_DATA, 3, bytes, 5), FOE_ERROR_ILLEGAL);
	set(b, "foe.fail_at", "0");
	check_file(b, "a", bytes, 10);
	bench_destroy(b);
}

TEST(sim_foe, a_repeated_packet_is_stored_once_and_a_skipped_one_is_an_error)
{
	struct bench *b = start();
	uint8_t bytes[PACKET + 1];

	fill(bytes, sizeof(bytes));
	CHECK_EQ(open_as(b, FOE_WRITE, "a", 0).operation, FOE_ACK);
	CHECK_EQ(ask(b, FOE_DATA, 1, bytes, PACKET).operation, FOE_ACK);
	CHECK_EQ(ask(b, FOE_DATA, 1, bytes, PACKET).number, 1);
	CHECK_EQ(ask(b, FOE_DATA, 2, bytes + PACKET, 1).operation, FOE_ACK);
	check_file(b, "a", bytes, PACKET + 1);
	CHECK_EQ(open_as(b, FOE_WRITE, "a", 0).operation, FOE_ACK);
	check_error(ask(b, FOE_DATA, 2, bytes, 1), FOE_ERROR_PACKET_NUMBER);
	bench_destroy(b);
}

TEST(sim_foe, boot_serves_files_and_nothing_else_and_is_left_to_init_only)
{
	static const uint8_t sdo[10] = { 0x00, 0x20, 0x40, 0x00, 0x10 };
	static const uint8_t data[3] = { 1, 2, 3 };
	struct bench *b = terminal_create(BOX);
	uint8_t header;

	counter = 0;
	CHECK_EQ(terminal_request(b, AL_BOOT), AL_INIT | AL_ERROR);
	CHECK_EQ(terminal_code(b), AL_CODE_INVALID_MAILBOX_CONFIG_BOOT);
	bench_sm(b, STATION, 0, TERMINAL_MAILBOX_OUT, BOX, 0x26);
	bench_sm(b, STATION, 1, TERMINAL_MAILBOX_IN, BOX, 0x22);
	CHECK_EQ(terminal_request(b, AL_INIT | AL_ERROR), AL_INIT);
	CHECK_EQ(terminal_request(b, AL_BOOT), AL_BOOT);
	write_file(b, "a", data, 3);
	CHECK_EQ(terminal_put(b, MAILBOX_TYPE_COE, 7, sdo, sizeof(sdo)), 1);
	CHECK_EQ(terminal_take(b, &header, answer, sizeof(answer)), MAILBOX_ERROR_BYTES);
	CHECK_EQ(mailbox_error_get(answer, MAILBOX_ERROR_BYTES),
		 MAILBOX_ERROR_UNSUPPORTED_PROTOCOL);
	CHECK_EQ(terminal_request(b, AL_PREOP), AL_BOOT | AL_ERROR);
	CHECK_EQ(terminal_code(b), AL_CODE_INVALID_STATE_CHANGE);
	CHECK_EQ(terminal_request(b, AL_INIT), AL_INIT);
	CHECK_EQ(terminal_request(b, AL_PREOP), AL_PREOP);
	check_file(b, "a", data, 3);
	CHECK_EQ(terminal_request(b, AL_BOOT), AL_PREOP | AL_ERROR);
	bench_destroy(b);
}

TEST(sim_foe, a_damaged_request_is_answered_with_an_error)
{
	static const uint8_t junk[3] = { 9, 9, 9 };
	struct bench *b = start();
	struct foe_message m;
	uint8_t header;
	int len;

	CHECK_EQ(terminal_put(b, MAILBOX_TYPE_FOE, 1, junk, sizeof(junk)), 1);
	len = terminal_take(b, &header, answer, sizeof(answer));
	CHECK(len > 0);
	CHECK_EQ(foe_parse(answer, (size_t)len, &m), 0);
	check_error(m, FOE_ERROR_ILLEGAL);
	bench_destroy(b);
}

TEST(sim_foe, a_property_that_the_server_does_not_have_is_refused)
{
	struct bench *b = start();
	struct sim_device *dev = segment_device(b->segment, 0);
	static const char *const wrong[][2] = {
		{ "foe.busy", "x" },      { "foe.busy", "" },      { "foe.busy", "-2" },
		{ "foe.nothing", "1" },   { "foe.fail_at", "-1" }, { "foe.busy", "65536" },
		{ "foe.password", "-1" }, { "toe.busy", "1" },
	};

	for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++) {
		CHECK_EQ(dev->ops->io_set(dev, wrong[i][0], wrong[i][1]), -EINVAL);
	}
	bench_destroy(b);
}

TEST(sim_foe, a_slave_without_mailboxes_for_boot_refuses_it)
{
	struct slave_model model;
	struct bench *b;

	CHECK_EQ(catalogue_find("el3102", &model), 0);
	b = bench_create(&(struct bench_slave){ .pdi = 5, .device = sii_device_from_model(&model) },
			 1);
	CHECK_EQ(terminal_request(b, AL_BOOT), AL_INIT | AL_ERROR);
	CHECK_EQ(terminal_code(b), AL_CODE_BOOT_NOT_SUPPORTED);
	bench_destroy(b);
}
