/* SPDX-License-Identifier: MIT */
/* A firmware update of the simulated Piccolo: BOOT, transfer, back, the version before and after.
 */
#include <errno.h>
#include <stdlib.h>

#include "base/bytes.h"
#include "firmware/fb1111_piccolo/image.h"
#include "harness/test.h"
#include "sim/protocols/bench.h"
#include "wire/foe.h"

enum { PROGRAM_BYTES = 60000, FILE_BYTES = IMAGE_HEADER + PROGRAM_BYTES };

static uint8_t *make_image(const char *version)
{
	uint8_t *file = calloc(1, FILE_BYTES);

	CHECK(file != NULL);
	for (unsigned i = 0; i < PROGRAM_BYTES; i++) {
		file[IMAGE_HEADER + i] = (uint8_t)(i * 17 + i / 255);
	}
	memcpy(file, "PIC1", 4);
	put_le32(file + IMAGE_PRODUCT, PICCOLO_PRODUCT_CODE);
	put_le32(file + IMAGE_LENGTH, PROGRAM_BYTES);
	put_le32(file + IMAGE_CRC, piccolo_crc32(0, file + IMAGE_HEADER, PROGRAM_BYTES));
	memcpy(file + IMAGE_VERSION, version, strlen(version));
	return file;
}

static void check_version(struct protocol_bench *b, unsigned pos, const char *version)
{
	char text[32];

	bench_to_preop(b, pos);
	bench_version(b, pos, text, sizeof(text));
	CHECK_STR(text, version);
}

static const char *const two_boards[] = { "fb1111_piccolo", "fb1111_piccolo", NULL };

TEST(firmware_by_foe, version_changes_on_the_updated_board_and_on_no_other)
{
	struct protocol_bench b;
	uint8_t *file = make_image("4.2");
	struct mailbox_request rq = bench_foe(FOE_WRITE, "firmware.bin", file, FILE_BYTES);
	int64_t begun_ns;

	bench_begin(&b, two_boards);
	check_version(&b, 0, piccolo_description.software_version);
	bench_to_boot(&b, 1);
	begun_ns = bench_now_ns(&b);
	CHECK_EQ(bench_do(&b, 1, &rq), 0);
	CHECK_EQ(rq.len, FILE_BYTES);
	CHECK(bench_now_ns(&b) - begun_ns < 2 * NS_PER_S);
	check_version(&b, 1, "4.2");
	check_version(&b, 0, piccolo_description.software_version);
	bench_end(&b);
	free(file);
}

TEST(firmware_by_foe, an_image_with_a_wrong_crc_is_refused_and_the_old_version_stays)
{
	struct protocol_bench b;
	uint8_t *file = make_image("4.3");
	struct mailbox_request rq = bench_foe(FOE_WRITE, "firmware.bin", file, FILE_BYTES);

	file[FILE_BYTES - 5] ^= 1;
	bench_begin(&b, two_boards);
	bench_to_boot(&b, 0);
	CHECK_EQ(bench_do(&b, 0, &rq), -EREMOTEIO);
	CHECK_EQ(rq.detail, FOE_ERROR_CHECKSUM);
	CHECK_STR(rq.state.foe.text, "length or CRC-32 wrong");
	check_version(&b, 0, piccolo_description.software_version);
	bench_end(&b);
	free(file);
}

TEST(firmware_by_foe, a_cancelled_transfer_leaves_the_old_version_and_another_one_works)
{
	struct protocol_bench b;
	uint8_t *file = make_image("4.4");
	struct mailbox_request rq = bench_foe(FOE_WRITE, "firmware.bin", file, FILE_BYTES);

	bench_begin(&b, two_boards);
	bench_to_boot(&b, 0);
	rq.slave_pos = 0;
	CHECK_EQ(mailbox_submit(b.mb, &rq), 0);
	while (rq.len < FILE_BYTES / 2) {
		mailbox_step(b.mb);
		CHECK_EQ(line_sleep(b.line, (span_t){ NS_PER_MS / 10 }), 0);
	}
	mailbox_cancel(b.mb, &rq);
	CHECK_EQ(rq.result, -ECANCELED);
	for (unsigned i = 0; i < 100; i++) { /* the error message to the slave */
		mailbox_step(b.mb);
		line_sleep(b.line, (span_t){ NS_PER_MS });
	}
	check_version(&b, 0, piccolo_description.software_version);
	bench_to_boot(&b, 0);
	CHECK_EQ(bench_do(&b, 0, &rq), 0);
	check_version(&b, 0, "4.4");
	bench_end(&b);
	free(file);
}

TEST(firmware_by_foe, two_boards_are_updated_at_the_same_time)
{
	struct protocol_bench b;
	uint8_t *file[2] = { make_image("5.0"), make_image("5.1") };
	struct mailbox_request rq[2];

	bench_begin(&b, two_boards);
	for (unsigned i = 0; i < 2; i++) {
		bench_to_boot(&b, i);
		rq[i] = bench_foe(FOE_WRITE, "firmware.bin", file[i], FILE_BYTES);
		rq[i].slave_pos = (uint16_t)i;
		CHECK_EQ(mailbox_submit(b.mb, &rq[i]), 0);
	}
	CHECK_EQ(mailbox_wait_all(b.mb), 0);
	CHECK_EQ(rq[0].result, 0);
	CHECK_EQ(rq[1].result, 0);
	check_version(&b, 0, "5.0");
	check_version(&b, 1, "5.1");
	bench_end(&b);
	free(file[0]);
	free(file[1]);
}

TEST(firmware_by_foe, outside_boot_the_board_refuses_with_code_and_text)
{
	struct protocol_bench b;
	uint8_t *file = make_image("6.0");
	struct mailbox_request rq = bench_foe(FOE_WRITE, "firmware.bin", file, FILE_BYTES);

	bench_begin(&b, two_boards);
	bench_to_preop(&b, 0);
	CHECK_EQ(bench_do(&b, 0, &rq), -EREMOTEIO);
	CHECK_EQ(rq.detail, FOE_ERROR_BOOTSTRAP_ONLY);
	bench_end(&b);
	free(file);
}
