/* SPDX-License-Identifier: MIT */
/* Registers, EEPROM and error counters of a slave through the admin socket, in every state. */
#include <errno.h>
#include <sys/socket.h>
#include <unistd.h>

#include "base/bytes.h"
#include "harness/test.h"
#include "sim/harness/virtual_master.h"
#include "wire/al.h"
#include "wire/esc_reg.h"
#include "wire/sii.h"

enum { SLAVES = 2, FORCED = 1 };

static struct virtual_bench b;
static struct virtual_master vm;
static struct virtual_transfer tr;

static void open_bench(const char *setting)
{
	const char *const settings[] = { setting, NULL };

	virtual_bench_init(&b, &(struct virtual_spec){ .slaves = SLAVES, .seed = 5 });
	virtual_master_init_waiting(&vm, &b, settings);
}

static struct esc *esc_of(unsigned slave)
{
	return segment_esc(b.segment, slave);
}

static struct admin_reply read_register(uint16_t slave_pos, uint16_t reg, unsigned len)
{
	struct admin_request rq = { .magic = ADMIN_MAGIC,
				    .verb = ADMIN_REGISTER_READ,
				    .slave_pos = slave_pos,
				    .address = reg,
				    .length = len };

	return virtual_master_ask(&vm, &rq);
}

static struct admin_reply write_word(uint16_t slave_pos, uint16_t reg, uint16_t value,
				     unsigned force)
{
	struct admin_request rq = { .magic = ADMIN_MAGIC,
				    .verb = ADMIN_REGISTER_WRITE,
				    .slave_pos = slave_pos,
				    .address = reg,
				    .data_len = 2,
				    .argument = { 0, force } };

	put_le16(rq.data, value);
	return virtual_master_ask(&vm, &rq);
}

static struct admin_reply ask(enum admin_verb verb, uint16_t slave_pos, uint32_t value,
			      unsigned force)
{
	struct admin_request rq = { .magic = ADMIN_MAGIC,
				    .verb = verb,
				    .slave_pos = slave_pos,
				    .argument = { value, force } };

	tr = (struct virtual_transfer){ .data = NULL };
	return virtual_master_transfer(&vm, &rq, &tr);
}

static struct admin_reply write_sii(uint16_t slave_pos, const uint8_t *image, size_t len)
{
	struct admin_request rq = { .magic = ADMIN_MAGIC,
				    .verb = ADMIN_SII_WRITE,
				    .slave_pos = slave_pos };

	tr = (struct virtual_transfer){ .data = image, .data_len = len };
	return virtual_master_transfer(&vm, &rq, &tr);
}

static struct admin_sii_written written(const struct admin_reply *reply)
{
	struct admin_sii_written ret;

	CHECK_EQ(reply->data_len, sizeof(ret));
	memcpy(&ret, reply->data, sizeof(ret));
	return ret;
}

TEST(esc_requests, registers_are_read_and_written_in_every_state)
{
	static const struct {
		const char *setting;
		unsigned al;
	} targets[] = { { "bus.target=init", AL_INIT },
			{ "bus.target=preop", AL_PREOP },
			{ "bus.target=safeop", AL_SAFEOP },
			{ "bus.target=op", AL_OP } };

	for (size_t i = 0; i < sizeof(targets) / sizeof(targets[0]); i++) {
		struct admin_reply reply;

		open_bench(targets[i].setting);
		CHECK_EQ(virtual_master_bring_up(&vm), 0);
		reply = read_register(1, ESC_REG_AL_STATUS, 2);
		CHECK_EQ(reply.result, 0);
		CHECK_EQ(reply.data_len, 2);
		CHECK_EQ(get_le16(reply.data), targets[i].al);
		CHECK_EQ(write_word(1, ESC_REG_USER_RAM, 0x4711, 0).result, 0);
		CHECK_EQ(get_le16(esc_of(1)->reg + ESC_REG_USER_RAM), 0x4711);
		CHECK(get_le16(esc_of(0)->reg + ESC_REG_USER_RAM) != 0x4711);
		virtual_master_close(&vm);
	}
}

TEST(esc_requests, what_the_master_needs_is_written_in_operation_only_by_force)
{
	struct admin_reply reply;
	unsigned divider;

	open_bench("bus.target=op");
	virtual_master_settle(&vm);
	divider = get_le16(esc_of(0)->reg + ESC_REG_WATCHDOG_DIVIDER);
	reply = write_word(0, ESC_REG_WATCHDOG_DIVIDER, (uint16_t)(divider + 1), 0);
	CHECK_EQ(reply.result, -EPERM);
	CHECK(strstr(reply.text, "watchdogs") != NULL);
	CHECK_EQ(get_le16(esc_of(0)->reg + ESC_REG_WATCHDOG_DIVIDER), divider);
	CHECK_EQ(write_word(0, ESC_REG_WATCHDOG_DIVIDER, (uint16_t)(divider + 1), FORCED).result,
		 0);
	CHECK_EQ(get_le16(esc_of(0)->reg + ESC_REG_WATCHDOG_DIVIDER), divider + 1);
	CHECK_EQ(read_register(0, 0x0e00, 1).result, -ENXIO);
	CHECK_EQ(read_register(0, 0xffff, 2).result, -EINVAL);
	CHECK_EQ(read_register(SLAVES, ESC_REG_TYPE, 1).result, -ENODEV);
	/* The cycle was not disturbed. */
	CHECK(vm.result.samples > 0);
	CHECK_EQ(vm.result.lost, 0);
	CHECK_EQ(vm.result.wkc_low, 0);
	CHECK_EQ(session_page(vm.session)->bus_state, BUS_OP);
	virtual_master_close(&vm);
}

TEST(esc_requests, an_eeprom_is_read_in_op_without_disturbing_the_cycle)
{
	struct esc *esc;

	open_bench("bus.target=op");
	virtual_master_settle(&vm);
	esc = esc_of(1);
	CHECK_EQ(ask(ADMIN_SII_READ, 1, 0, 0).result, 0);
	CHECK_EQ(tr.answer_len, sii_stated_bytes(esc->sii));
	CHECK_EQ(memcmp(tr.answer, esc->sii,
			esc->sii_bytes < tr.answer_len ? esc->sii_bytes : tr.answer_len),
		 0);
	CHECK(tr.reports >= 4);
	virtual_master_check_undisturbed(&vm, 500);
	virtual_master_close(&vm);
}

TEST(esc_requests, a_request_outlives_frames_that_are_lost_for_some_cycles)
{
	struct admin_reply reply;
	struct esc *esc;
	uint64_t lost;

	open_bench("bus.target=op");
	virtual_master_settle(&vm);
	esc = esc_of(1);
	virtual_bench_fault(&b, "at=0s for=12ms lose");
	lost = vm.result.lost;
	reply = read_register(1, ESC_REG_AL_STATUS, 2);
	CHECK_STR(reply.text, "");
	CHECK_EQ(reply.result, 0);
	CHECK_EQ(get_le16(reply.data), AL_OP);
	CHECK(vm.result.lost >= lost + 10);
	virtual_bench_fault(&b, "at=5ms for=60ms lose");
	lost = vm.result.lost;
	reply = ask(ADMIN_SII_READ, 1, 0, 0);
	CHECK_STR(reply.text, "");
	CHECK_EQ(reply.result, 0);
	CHECK(vm.result.lost >= lost + 50);
	CHECK_EQ(tr.answer_len, sii_stated_bytes(esc->sii));
	CHECK_EQ(memcmp(tr.answer, esc->sii,
			esc->sii_bytes < tr.answer_len ? esc->sii_bytes : tr.answer_len),
		 0);
	virtual_master_close(&vm);
}

TEST(esc_requests, an_eeprom_that_no_frame_reaches_is_an_error)
{
	open_bench("bus.target=op");
	virtual_master_settle(&vm);
	virtual_bench_fault(&b, "at=5ms for=30s lose");
	CHECK(ask(ADMIN_SII_READ, 1, 0, 0).result < 0);
	virtual_master_close(&vm);
}

TEST(esc_requests, an_image_is_written_in_preop_and_refused_in_op)
{
	static uint8_t image[8192];
	struct admin_reply reply;
	size_t len;

	open_bench("bus.target=preop");
	CHECK_EQ(virtual_master_bring_up(&vm), 0);
	len = esc_of(1)->sii_bytes & ~(size_t)1;
	CHECK(len <= sizeof(image));
	memcpy(image, esc_of(1)->sii, len);
	put_le16(image + SII_ALIAS_BYTE, 0x1234);
	reply = write_sii(1, image, len); /* its checksum is wrong now */
	CHECK_EQ(reply.result, -EINVAL);
	CHECK(strstr(reply.text, "checksum") != NULL);
	image[SII_CHECKSUM_BYTE] = sii_checksum(image);
	reply = write_sii(1, image, len);
	CHECK_EQ(reply.result, 0);
	CHECK_EQ(written(&reply).compared, len / 2);
	CHECK(written(&reply).written >= 2 && written(&reply).written <= 4);
	CHECK_EQ(memcmp(esc_of(1)->sii, image, len), 0);
	reply = ask(ADMIN_SII_ALIAS, 1, 0x1235, 0);
	CHECK_EQ(reply.result, 0);
	CHECK(written(&reply).written >= 2);
	CHECK_EQ(get_le16(esc_of(1)->sii + SII_ALIAS_BYTE), 0x1235);
	CHECK(sii_is_checksum_right(esc_of(1)->sii));
	reply = ask(ADMIN_SII_ALIAS, 1, 0x1235, 0);
	CHECK_EQ(written(&reply).written, 0);
	virtual_master_close(&vm);
	open_bench("bus.target=op");
	virtual_master_settle(&vm);
	reply = write_sii(1, image, len);
	CHECK_EQ(reply.result, -EPERM);
	CHECK(strstr(reply.text, "SAFE-OP or OP") != NULL);
	CHECK(get_le16(esc_of(1)->sii + SII_ALIAS_BYTE) != 0x1234);
	virtual_master_close(&vm);
}

TEST(esc_requests, a_read_of_an_eeprom_ends_when_the_bus_is_taken_down)
{
	struct admin_request rq = { .magic = ADMIN_MAGIC, .verb = ADMIN_SII_READ };
	struct admin_request rescan = { .magic = ADMIN_MAGIC, .verb = ADMIN_RESCAN };
	struct admin_reply reply;
	int fd;

	open_bench("bus.target=preop");
	CHECK_EQ(virtual_master_bring_up(&vm), 0);
	fd = virtual_master_connect(&vm);
	CHECK_EQ(send(fd, &rq, sizeof(rq), 0), sizeof(rq));
	CHECK_EQ(virtual_master_run(&vm, 100), SESSION_GOES_ON);
	reply = ask(ADMIN_SII_READ, 1, 0, 0);
	CHECK_EQ(reply.result, -EBUSY);
	CHECK_STR(reply.text,
		  "the EEPROM of slave 0 (piccolo0) is being read or written: one at a time");
	CHECK_EQ(virtual_master_ask(&vm, &rescan).result, 0);
	do {
		CHECK_EQ(recv(fd, &reply, sizeof(reply), MSG_DONTWAIT), sizeof(reply));
	} while (reply.kind == ADMIN_REPLY_PROGRESS);
	CHECK_EQ(reply.result, -ECANCELED);
	CHECK_STR(reply.text, "the bus was taken down");
	close(fd);
	CHECK_EQ(ask(ADMIN_SII_READ, 1, 0, 0).result, 0);
	virtual_master_close(&vm);
}

TEST(esc_requests, error_counters_are_read_and_reset_and_their_sums_go_on)
{
	struct admin_diagnosis found;
	struct admin_reply reply;
	uint32_t sum;

	open_bench("bus.target=op");
	virtual_master_settle(&vm);
	esc_of(1)->reg[ESC_REG_RX_ERROR_COUNTER + 1] = 7;
	CHECK_EQ(virtual_master_run(&vm, 500), SESSION_GOES_ON);
	sum = session_page(vm.session)->slave[1].rx_errors[0];
	CHECK(sum >= 7);
	reply = ask(ADMIN_DIAGNOSIS, 1, 0, 0);
	CHECK_EQ(reply.result, 0);
	CHECK_EQ(reply.data_len, sizeof(found));
	memcpy(&found, reply.data, sizeof(found));
	CHECK_EQ(found.port[0].rx_errors, 7);
	CHECK_EQ(found.port[0].is_communicating, 1);
	CHECK_EQ(found.port[3].is_communicating, 0);
	CHECK_EQ(found.has_processing_errors, 1);
	CHECK_EQ(ask(ADMIN_ERRORS_RESET, 1, 0, 0).result, 0);
	reply = ask(ADMIN_DIAGNOSIS, 1, 0, 0);
	memcpy(&found, reply.data, sizeof(found));
	CHECK_EQ(found.port[0].rx_errors, 0);
	CHECK_EQ(virtual_master_run(&vm, 500), SESSION_GOES_ON);
	CHECK_EQ(session_page(vm.session)->slave[1].rx_errors[0], sum);
	virtual_master_close(&vm);
}
