/* SPDX-License-Identifier: MIT */
/* BOOT and back through the admin socket, with a firmware file written in it. */
#include <errno.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <unistd.h>

#include "base/bytes.h"
#include "devices/catalogue.h"
#include "firmware/fb1111_piccolo/image.h"
#include "harness/test.h"
#include "sim/harness/virtual_master.h"
#include "wire/al.h"
#include "wire/esc_reg.h"
#include "wire/foe.h"

enum { BOARD = 1, PROGRAM_BYTES = 12000, FILE_BYTES = IMAGE_HEADER + PROGRAM_BYTES };

static struct virtual_bench b;
static struct virtual_master vm;
static struct virtual_transfer tr;
static uint8_t file[FILE_BYTES];

static void make_image(const char *version)
{
	memset(file, 0, sizeof(file));
	for (unsigned i = 0; i < PROGRAM_BYTES; i++) {
		file[IMAGE_HEADER + i] = (uint8_t)(i * 17 + i / 255);
	}
	memcpy(file, "PIC1", 4);
	put_le32(file + IMAGE_PRODUCT, PICCOLO_PRODUCT_CODE);
	put_le32(file + IMAGE_LENGTH, PROGRAM_BYTES);
	put_le32(file + IMAGE_CRC, piccolo_crc32(0, file + IMAGE_HEADER, PROGRAM_BYTES));
	memcpy(file + IMAGE_VERSION, version, strlen(version));
}

static void open_bench(const char *setting)
{
	const char *const settings[] = { setting, NULL };

	virtual_bench_init(&b, &(struct virtual_spec){ .slaves = 2, .seed = 31 });
	virtual_master_init_waiting(&vm, &b, settings);
	CHECK_EQ(virtual_master_bring_up(&vm), 0);
}

static void close_bench(void)
{
	virtual_master_kill(&vm);
	virtual_bench_done(&b);
}

static unsigned al_state(unsigned slave)
{
	return segment_esc(b.segment, slave)->reg[ESC_REG_AL_STATUS];
}

static struct admin_reply ask_state(uint16_t slave_pos, uint32_t state)
{
	struct admin_request rq = { .magic = ADMIN_MAGIC,
				    .verb = ADMIN_STATE,
				    .slave_pos = slave_pos,
				    .argument = { state } };

	return virtual_master_ask(&vm, &rq);
}

static void lead(enum al_state state)
{
	struct admin_reply reply = ask_state(BOARD, state);

	CHECK_STR(reply.text, "");
	CHECK_EQ(reply.result, 0);
	CHECK_EQ(al_state(BOARD), state);
}

static struct admin_request write_request(void)
{
	struct admin_request rq = { .magic = ADMIN_MAGIC,
				    .verb = ADMIN_FOE_WRITE,
				    .slave_pos = BOARD };

	snprintf(rq.name, sizeof(rq.name), "firmware.bin");
	return rq;
}

static struct admin_reply write_file(void)
{
	struct admin_request rq = write_request();

	tr = (struct virtual_transfer){ .data = file, .data_len = FILE_BYTES };
	return virtual_master_transfer(&vm, &rq, &tr);
}

static struct admin_reply read_version(uint16_t slave_pos)
{
	struct admin_request rq = { .magic = ADMIN_MAGIC,
				    .verb = ADMIN_SDO_READ,
				    .slave_pos = slave_pos,
				    .index = 0x100a };

	return virtual_master_ask(&vm, &rq);
}

static void check_version(uint16_t slave_pos, const char *version)
{
	struct admin_reply reply = read_version(slave_pos);

	CHECK_EQ(reply.result, 0);
	CHECK_EQ(reply.data_len, strlen(version));
	CHECK_EQ(memcmp(reply.data, version, strlen(version)), 0);
}

TEST(firmware_update, a_board_is_updated_in_boot_and_answers_in_preop_as_before)
{
	struct admin_reply reply;

	open_bench("bus.target=preop");
	check_version(BOARD, piccolo_description.software_version);
	make_image("7.1");
	lead(AL_BOOT);
	CHECK_EQ(al_state(0), AL_PREOP);
	reply = read_version(BOARD);
	CHECK_STR(reply.text, "slave 1 (piccolo1): SDO read of 0x100a:00: the slave has no CoE "
			      "mailbox in this state");
	reply = write_file();
	CHECK_STR(reply.text, "");
	CHECK_EQ(reply.result, 0);
	CHECK(tr.reports > 1);
	lead(AL_PREOP);
	check_version(BOARD, "7.1");
	check_version(0, piccolo_description.software_version);
	/* The bus goes to OP with it. */
	CHECK_EQ(ask_state(ADMIN_ALL_SLAVES, AL_OP).result, 0);
	CHECK_EQ(al_state(BOARD), AL_OP);
	close_bench();
}

TEST(firmware_update, boot_is_reached_from_every_state_and_left_to_init)
{
	static const unsigned way[] = { AL_INIT,  AL_BOOT, AL_BOOT, AL_INIT,
					AL_PREOP, AL_BOOT, AL_PREOP };

	open_bench("bus.target=safeop");
	lead(AL_BOOT);
	for (size_t i = 0; i < sizeof(way) / sizeof(way[0]); i++) {
		lead((enum al_state)way[i]);
	}
	check_version(BOARD, piccolo_description.software_version);
	CHECK_EQ(al_state(0), AL_SAFEOP);
	lead(AL_INIT);
	CHECK(read_version(BOARD).result < 0);
	close_bench();
}

/* A drive whose boxes in BOOT are other ones. */
static int make_drive(int position, struct segment_slave_spec *ret_spec)
{
	static struct slave_model model;

	CHECK_EQ(catalogue_find("akd", &model), 0);
	model.sii.boot_out_start = 0x1a00;
	model.sii.boot_out_len = 256;
	model.sii.boot_in_start = 0x1b00;
	model.sii.boot_in_len = 200;
	return catalogue_slave(&model, position, ret_spec);
}

static void check_boxes(uint16_t out_start, uint16_t out_len, uint16_t in_start, uint16_t in_len)
{
	const uint8_t *sm = segment_esc(b.segment, BOARD)->reg + ESC_REG_SM;

	CHECK_EQ(get_le16(sm), out_start);
	CHECK_EQ(get_le16(sm + 2), out_len);
	CHECK_EQ(get_le16(sm + ESC_SM_BYTES), in_start);
	CHECK_EQ(get_le16(sm + ESC_SM_BYTES + 2), in_len);
}

TEST(firmware_update, boot_has_the_boxes_of_its_sii_and_preop_gets_its_own_again)
{
	static const char *const settings[] = { "bus.target=preop", NULL };

	virtual_bench_init(&b,
			   &(struct virtual_spec){ .slaves = 2, .make = make_drive, .seed = 32 });
	virtual_master_init_waiting(&vm, &b, settings);
	CHECK_EQ(virtual_master_bring_up(&vm), 0);
	make_image("7.6");
	lead(AL_BOOT);
	check_boxes(0x1a00, 256, 0x1b00, 200);
	CHECK_STR(write_file().text, "");
	lead(AL_PREOP);
	check_boxes(0x1800, 1024, 0x1c00, 1024);
	CHECK_EQ(read_version(BOARD).slave_code, 0x06020000); /* CoE answers: no such object */
	close_bench();
}

TEST(firmware_update, in_operation_boot_is_refused_with_the_way_to_it)
{
	open_bench("bus.target=op");
	CHECK_STR(ask_state(BOARD, AL_BOOT).text,
		  "the bus is in operation, and its supervision would lead the slave back: ecdaq "
		  "state PREOP all first");
	CHECK_EQ(al_state(BOARD), AL_OP);
	close_bench();
}

TEST(firmware_update, a_damaged_file_is_refused_and_the_old_version_stays)
{
	struct admin_reply reply;

	open_bench("bus.target=preop");
	make_image("7.2");
	file[FILE_BYTES - 1] ^= 1;
	lead(AL_BOOT);
	reply = write_file();
	CHECK_EQ(reply.slave_code, FOE_ERROR_CHECKSUM);
	CHECK_STR(reply.text, "slave 1 (piccolo1): FoE write of firmware.bin: wrong checksum "
			      "(0x800c): length or CRC-32 wrong");
	lead(AL_PREOP);
	check_version(BOARD, piccolo_description.software_version);
	close_bench();
}

/* Send the file, and stop looking at the answer in the middle. */
static int begin_write(void)
{
	struct admin_request rq = write_request();
	int fd = virtual_master_connect(&vm);
	size_t sent = 0;

	rq.data_total = FILE_BYTES;
	while (sent < FILE_BYTES) {
		size_t left = FILE_BYTES - sent;

		rq.data_offset = (uint32_t)sent;
		rq.data_len = (uint32_t)(left < ADMIN_DATA_BYTES ? left : ADMIN_DATA_BYTES);
		memcpy(rq.data, file + sent, rq.data_len);
		CHECK_EQ(send(fd, &rq, sizeof(rq), 0), sizeof(rq));
		sent += rq.data_len;
		rq.verb = ADMIN_DATA;
		CHECK_EQ(virtual_master_run(&vm, VIRTUAL_SERVICE_CYCLES), SESSION_GOES_ON);
	}
	CHECK_EQ(virtual_master_run(&vm, 60), SESSION_GOES_ON);
	return fd;
}

/* Write the file again, now whole. */
static void update_to(const char *version)
{
	lead(AL_BOOT);
	CHECK_EQ(write_file().result, 0);
	lead(AL_PREOP);
	check_version(BOARD, version);
}

TEST(firmware_update, a_client_that_goes_away_leaves_boot_and_the_old_version)
{
	open_bench("bus.target=preop");
	make_image("7.3");
	lead(AL_BOOT);
	close(begin_write());
	CHECK_EQ(virtual_master_run(&vm, 300), SESSION_GOES_ON);
	CHECK_EQ(al_state(BOARD), AL_BOOT);
	lead(AL_PREOP);
	check_version(BOARD, piccolo_description.software_version);
	update_to("7.3");
	close_bench();
}

TEST(firmware_update, a_power_cut_in_the_middle_is_reported_and_the_update_can_be_repeated)
{
	struct admin_reply reply = { .kind = ADMIN_REPLY_PROGRESS };
	int fd;

	open_bench("bus.target=preop");
	make_image("7.4");
	lead(AL_BOOT);
	fd = begin_write();
	virtual_bench_fault(&b, "at=0s power-off slave=1");
	virtual_bench_fault(&b, "at=1s power-on slave=1");
	CHECK_EQ(virtual_master_run(&vm, 6000), SESSION_GOES_ON);
	while (reply.kind == ADMIN_REPLY_PROGRESS) {
		CHECK_EQ(recv(fd, &reply, sizeof(reply), MSG_DONTWAIT), sizeof(reply));
	}
	close(fd);
	CHECK_EQ(reply.result, -ETIMEDOUT);
	CHECK_STR(reply.text, "slave 1 (piccolo1): FoE write of firmware.bin: no answer");
	CHECK_EQ(al_state(BOARD), AL_INIT);
	lead(AL_PREOP);
	check_version(BOARD, piccolo_description.software_version);
	update_to("7.4");
	close_bench();
}
