/* SPDX-License-Identifier: MIT */
/* Firmware update by FoE in BOOT: what is accepted, what is refused and why, what runs afterwards.
 */
#include "firmware/fb1111_piccolo/foe.h"

#include "base/bytes.h"
#include "board.h"
#include "harness/test.h"
#include "wire/al.h"
#include "wire/foe.h"

enum { FOE = 4, PACKET = 116, PROGRAM = 1000, FILE_BYTES = IMAGE_HEADER + PROGRAM, ANSWER_AT = 6 };

static uint8_t file[PICCOLO_FLASH_OCTETS + PACKET];
static uint8_t box[128];
static uint8_t counter;

static void make_file(uint32_t program_bytes, const char *version)
{
	memset(file, 0, sizeof(file));
	for (uint32_t i = 0; i < program_bytes && i < sizeof(file) - IMAGE_HEADER; i++) {
		file[IMAGE_HEADER + i] = (uint8_t)(i * 31 + 7);
	}
	memcpy(file, "PIC1", 4);
	put_le32(file + IMAGE_PRODUCT, PICCOLO_PRODUCT_CODE);
	put_le32(file + IMAGE_LENGTH, program_bytes);
	put_le32(file + IMAGE_CRC, piccolo_crc32(0, file + IMAGE_HEADER, program_bytes));
	memcpy(file + IMAGE_VERSION, version, strlen(version));
}

static void boot(struct board *b)
{
	counter = 0;
	board_init(b);
	board_start(b);
	board_master_mailbox_sms(b);
	CHECK_EQ(board_master_request(b, AL_BOOT), AL_BOOT);
}

static struct foe_message ask(struct board *b, uint8_t operation, uint32_t number, const void *body,
			      size_t len)
{
	const struct foe_message m = {
		.operation = operation, .number = number, .body = body, .body_len = len
	};
	struct foe_message reply;
	uint8_t data[122];

	counter = (uint8_t)(counter % 7 + 1);
	board_mailbox_put(b, FOE, counter, data, foe_format(&m, data, sizeof(data)));
	CHECK_EQ(board_mailbox_take(b, box), 0);
	CHECK_EQ(box[5] & 15, FOE);
	CHECK_EQ(foe_parse(box + ANSWER_AT, get_le16(box), &reply), 0);
	return reply;
}

static struct foe_message open_write(struct board *b)
{
	return ask(b, FOE_WRITE, 0, "firmware.bin", 12);
}

/* The answer to the first packet that is not acknowledged, or to the last. */
static struct foe_message send_file(struct board *b, size_t len)
{
	struct foe_message m = open_write(b);
	size_t pos = 0;

	for (uint32_t packet = 1; m.operation == FOE_ACK; packet++) {
		size_t now = len - pos < PACKET ? len - pos : PACKET;

		do {
			m = ask(b, FOE_DATA, packet, file + pos, now);
		} while (m.operation == FOE_BUSY);
		pos += now;
		if (now < PACKET) {
			break;
		}
		CHECK(m.operation != FOE_ACK || m.number == packet);
	}
	return m;
}

static void check_refused(struct board *b, size_t len, uint32_t code)
{
	struct foe_message m = send_file(b, len);

	CHECK_EQ(m.operation, FOE_ERROR);
	CHECK_EQ(m.number, code);
	CHECK(m.body_len > 0);
	CHECK_EQ(piccolo_foe_has_image(&b->fw), 0);
}

static void check_version(struct board *b, const char *version)
{
	uint8_t text[64];
	size_t len = sizeof(text);

	CHECK_EQ(board_sdo_read(b, 0x100a, 0, text, &len), 0);
	CHECK_EQ(len, strlen(version));
	CHECK_MEM(text, version, len);
}

TEST(firmware_update, the_crc_is_that_of_ieee_802_3)
{
	CHECK_EQ(piccolo_crc32(0, (const octet_t *)"123456789", 9), 0xcbf43926);
	CHECK_EQ(piccolo_crc32(piccolo_crc32(0, (const octet_t *)"1234", 4),
			       (const octet_t *)"56789", 5),
		 0xcbf43926);
}

TEST(firmware_update, a_whole_image_is_stored_and_runs_after_leaving_boot)
{
	struct board b;

	boot(&b);
	make_file(PROGRAM, "2.7.1");
	CHECK_EQ(send_file(&b, FILE_BYTES).operation, FOE_ACK);
	CHECK_EQ(b.erasures, 1);
	CHECK_MEM(b.flash, file, FILE_BYTES);
	CHECK_EQ(b.is_image_running, 0);
	CHECK_EQ(board_master_request(&b, AL_INIT), AL_INIT);
	board_run(&b, 5000);
	CHECK_EQ(b.is_image_running, 1);
	CHECK_EQ(board_master_request(&b, AL_PREOP), AL_PREOP);
	check_version(&b, "2.7.1");
	CHECK_EQ(board_breaches(&b), 0);
}

TEST(firmware_update, an_image_that_ends_with_a_full_packet_needs_an_empty_one_behind_it)
{
	struct board b;

	boot(&b);
	make_file(4 * PACKET - IMAGE_HEADER, "1");
	CHECK_EQ(send_file(&b, (size_t)4 * PACKET).operation, FOE_ACK);
	CHECK_EQ(piccolo_foe_has_image(&b.fw), 1);
}

TEST(firmware_update, the_largest_image_fits_and_one_octet_more_does_not)
{
	struct board b;

	boot(&b);
	make_file(PICCOLO_FLASH_OCTETS - IMAGE_HEADER, "max");
	CHECK_EQ(send_file(&b, PICCOLO_FLASH_OCTETS).operation, FOE_ACK);
	make_file(PICCOLO_FLASH_OCTETS - IMAGE_HEADER + 1, "max");
	check_refused(&b, PICCOLO_FLASH_OCTETS + 1, FOE_ERROR_DISK_FULL);
	make_file(PROGRAM, "1");
	check_refused(&b, PICCOLO_FLASH_OCTETS + 1, FOE_ERROR_DISK_FULL);
}

TEST(firmware_update, what_is_no_image_for_this_board_is_refused_and_the_old_one_stays)
{
	struct board b;

	boot(&b);
	make_file(PROGRAM, "bad");
	file[0] = 'Q';
	check_refused(&b, FILE_BYTES, FOE_ERROR_NO_HEADER);
	check_refused(&b, IMAGE_HEADER - 1, FOE_ERROR_NO_HEADER);
	make_file(PROGRAM, "bad");
	file[IMAGE_PRODUCT]++;
	check_refused(&b, FILE_BYTES, FOE_ERROR_FIRMWARE);
	make_file(PROGRAM, "bad");
	file[FILE_BYTES - 1] ^= 1;
	check_refused(&b, FILE_BYTES, FOE_ERROR_CHECKSUM);
	make_file(PROGRAM, "bad");
	check_refused(&b, FILE_BYTES - 1, FOE_ERROR_CHECKSUM);
	b.is_flash_broken = 1;
	check_refused(&b, FILE_BYTES, FOE_ERROR_FLASH);
	CHECK_EQ(board_master_request(&b, AL_INIT), AL_INIT);
	CHECK_EQ(board_master_request(&b, AL_PREOP), AL_PREOP);
	CHECK_EQ(b.is_image_running, 0);
	check_version(&b, piccolo_description.software_version);
}

TEST(firmware_update, busy_while_the_flash_is_erased_and_the_packet_is_taken_once_afterwards)
{
	struct board b;

	boot(&b);
	make_file(10, "3.0");
	b.busy = 3;
	CHECK_EQ(open_write(&b).operation, FOE_ACK);
	for (unsigned i = 0; i < 3; i++) {
		CHECK_EQ(ask(&b, FOE_DATA, 1, file, IMAGE_HEADER + 10).operation, FOE_BUSY);
	}
	CHECK_EQ(ask(&b, FOE_DATA, 1, file, IMAGE_HEADER + 10).operation, FOE_ACK);
	CHECK_EQ(ask(&b, FOE_DATA, 1, file, IMAGE_HEADER + 10).operation, FOE_ACK);
	CHECK_EQ(piccolo_foe_has_image(&b.fw), 1);
}

TEST(firmware_update, outside_boot_writing_is_refused_and_reading_always)
{
	struct board b;
	struct foe_message m;

	counter = 0;
	board_lead_to(&b, PICCOLO_PREOP);
	m = open_write(&b);
	CHECK_EQ(m.operation, FOE_ERROR);
	CHECK_EQ(m.number, FOE_ERROR_BOOTSTRAP_ONLY);
	CHECK_EQ(ask(&b, FOE_READ, 0, "x", 1).number, FOE_ERROR_NO_FILE);
	CHECK_EQ(ask(&b, FOE_DATA, 1, "x", 1).number, FOE_ERROR_ILLEGAL);
	CHECK_EQ(b.erasures, 0);
}

TEST(firmware_update, a_packet_out_of_order_ends_the_transfer_and_so_does_leaving_boot)
{
	struct board b;

	boot(&b);
	make_file(PROGRAM, "x");
	CHECK_EQ(open_write(&b).operation, FOE_ACK);
	CHECK_EQ(ask(&b, FOE_DATA, 2, file, PACKET).number, FOE_ERROR_PACKET_NUMBER);
	CHECK_EQ(ask(&b, FOE_DATA, 1, file, PACKET).number, FOE_ERROR_ILLEGAL);
	CHECK_EQ(open_write(&b).operation, FOE_ACK);
	CHECK_EQ(ask(&b, FOE_DATA, 1, file, PACKET).operation, FOE_ACK);
	CHECK_EQ(board_master_request(&b, AL_INIT), AL_INIT);
	CHECK_EQ(board_master_request(&b, AL_BOOT), AL_BOOT);
	CHECK_EQ(ask(&b, FOE_DATA, 2, file + PACKET, PACKET).number, FOE_ERROR_ILLEGAL);
	CHECK_EQ(b.is_image_running, 0);
}

TEST(firmware_update, coe_is_not_served_in_boot_and_a_short_or_unknown_request_is_an_error)
{
	static const uint8_t sdo[10] = { 0x00, 0x20, 0x40, 0x0a, 0x10 };
	static const uint8_t junk[6] = { 9 };
	struct board b;

	boot(&b);
	board_mailbox_put(&b, 3, 1, sdo, sizeof(sdo));
	CHECK_EQ(board_mailbox_take(&b, box), 0);
	CHECK_EQ(box[5] & 15, 0);
	CHECK_EQ(get_le16(box + 8), MAILBOX_UNSUPPORTED_PROTOCOL);
	board_mailbox_put(&b, FOE, 2, junk, 5);
	CHECK_EQ(board_mailbox_take(&b, box), 0);
	CHECK_EQ(get_le16(box + 8), MAILBOX_SIZE_TOO_SHORT);
	board_mailbox_put(&b, FOE, 3, junk, 6);
	CHECK_EQ(board_mailbox_take(&b, box), 0);
	CHECK_EQ(get_le16(box + 8), MAILBOX_SERVICE_NOT_SUPPORTED);
}
