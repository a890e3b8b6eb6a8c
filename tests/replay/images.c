/* SPDX-License-Identifier: MIT */
/* EEPROM images and captures of real devices, as files: what is in them, and what damage does. */
#include <dirent.h>
#include <errno.h>

#include "capture.h"
#include "harness/pcapng.h"
#include "harness/test.h"
#include "wire/sii.h"

static struct sii sii;
static char error[160];

static int parse(const uint8_t *image, size_t bytes)
{
	/* Of its own size on the heap, so that the sanitizer sees every byte beyond. */
	uint8_t *copy = malloc(bytes > 0 ? bytes : 1);
	char name[SII_NAME_BYTES];
	int r;

	CHECK(copy != NULL);
	memcpy(copy, image, bytes);
	error[0] = '\0';
	r = sii_parse(copy, bytes, &sii, error, sizeof(error));
	CHECK((r < 0) == (error[0] != '\0'));
	sii_text(copy, bytes, sii.device_name, name);
	free(copy);
	return r;
}

static void parse_file(const char *name, int wanted)
{
	struct bytes image = capture_load(name);

	CHECK_EQ(parse(image.at, image.len), wanted);
	capture_free(&image);
}

static unsigned pdos_of_sm(uint8_t sm)
{
	unsigned count = 0;

	for (size_t i = 0; i < sii.pdo_count; i++) {
		count += sii.pdo[i].sm == sm;
	}
	return count;
}

TEST(images, a_couplers_eeprom_says_no_process_data)
{
	parse_file("sii/ek1100.bin", 0);
	CHECK_EQ(sii.vendor, 2);
	CHECK_EQ(sii.product, 0x044c2c52);
	CHECK_EQ(sii.size_bytes, 2048);
	CHECK_EQ(sii.pdo_count, 0);
	CHECK_EQ(sii.sm_count, 0);
}

TEST(images, an_el2889_has_two_output_sms_with_eight_bits_each)
{
	parse_file("sii/el2889.bin", 0);
	CHECK_EQ(sii.sm_count, 2);
	CHECK_EQ(sii.sm[0].start, 0x0f00);
	CHECK_EQ(sii.sm[1].start, 0x0f01);
	CHECK_EQ(sii.sm[0].type, 3);
	CHECK_EQ(sii.pdo_count, 16);
	CHECK_EQ(pdos_of_sm(0), 8);
	CHECK_EQ(pdos_of_sm(1), 8);
	for (size_t i = 0; i < sii.pdo_count; i++) {
		CHECK_EQ(sii.pdo[i].bits, 1);
		CHECK_EQ(sii.pdo[i].is_tx, 0);
	}
}

TEST(images, a_drive_has_three_protocols_and_24_pdos_and_two_dc_modes)
{
	parse_file("sii/akd.bin", 0);
	CHECK_EQ(sii.mailbox_protocols, SII_MAILBOX_COE | SII_MAILBOX_EOE | SII_MAILBOX_FOE);
	CHECK_EQ(sii.pdo_count, 24);
	CHECK_EQ(sii.fmmu_count, 3);
	CHECK_EQ(sii.fmmu[0], 1);
	CHECK_EQ(sii.fmmu[1], 2);
	CHECK_EQ(sii.fmmu[2], 3);
	CHECK_EQ(sii.dc_mode_count, 2);
	CHECK_EQ(sii.dc_mode[0].assign_activate, 0x0300);
	CHECK_EQ(sii.dc_mode[1].assign_activate, 0x0000);
}

TEST(images, a_damaged_drive_is_refused_with_its_reason_and_keeps_what_stood_before)
{
	parse_file("sii/akd-damaged.bin", -EBADMSG);
	CHECK(strstr(error, "runs past") != NULL);
	CHECK_EQ(sii.product, 0x00414b44);
}

TEST(images, a_drive_cut_at_any_byte_is_read_or_refused_and_never_overrun)
{
	struct bytes image = capture_load("sii/akd.bin");
	unsigned refused = 0;

	for (size_t len = 0; len <= image.len; len++) {
		refused += parse(image.at, len) < 0;
	}
	CHECK(refused > SII_CATEGORIES_BYTE && refused < image.len);
	capture_free(&image);
}

TEST(images, a_drive_with_any_one_byte_changed_is_survived)
{
	struct bytes image = capture_load("sii/akd.bin");

	for (size_t i = 0; i < image.len; i++) {
		uint8_t kept = image.at[i];

		image.at[i] = (uint8_t)~kept;
		(void)parse(image.at, image.len);
		image.at[i] = 0xff;
		(void)parse(image.at, image.len);
		image.at[i] = kept;
	}
	capture_free(&image);
}

static int has_suffix(const char *name, const char *suffix)
{
	size_t len = strlen(name);

	return len > strlen(suffix) && strcmp(name + len - strlen(suffix), suffix) == 0;
}

TEST(images, every_image_there_is_is_read_but_the_damaged_one)
{
	struct bytes any = capture_load("sii/ek1100.bin"); /* skips where there are none */
	DIR *folder = opendir(capture_folder("sii"));
	unsigned count = 0;

	CHECK(folder != NULL);
	for (struct dirent *e = readdir(folder); e != NULL; e = readdir(folder)) {
		char name[300];

		if (!has_suffix(e->d_name, ".bin")) {
			continue;
		}
		snprintf(name, sizeof(name), "sii/%s", e->d_name);
		parse_file(name, strstr(name, "damaged") != NULL ? -EBADMSG : 0);
		CHECK(sii.vendor != 0);
		count++;
	}
	closedir(folder);
	printf("%u EEPROM images\n", count);
	CHECK(count > 0);
	capture_free(&any);
}

TEST(images, every_capture_is_read_to_its_end_and_cut_anywhere_it_ends_in_an_error)
{
	struct bytes c = capture_load("captures/soem-no-slaves.pcapng");
	struct pcapng_packet packet;
	struct pcapng file;
	unsigned whole = 0;
	int r;

	CHECK_EQ(pcapng_open(&file, c.at, c.len), 0);
	while ((r = pcapng_next(&file, &packet)) == 1) {
		whole++;
	}
	CHECK_EQ(r, 0);
	CHECK_EQ(whole, 23);
	for (size_t len = 0; len < c.len; len++) {
		uint8_t *cut = malloc(len + 1);
		unsigned count = 0;

		CHECK(cut != NULL);
		memcpy(cut, c.at, len);
		if (pcapng_open(&file, cut, len) == 0) {
			while (pcapng_next(&file, &packet) == 1) {
				count++;
			}
		}
		CHECK(count <= whole);
		free(cut);
	}
	capture_free(&c);
}
