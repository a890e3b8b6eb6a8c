/* SPDX-License-Identifier: MIT */
/* Registers and EEPROM of one slave, as an operator reads and writes them. */
#include "bus/esc_access.h"

#include <errno.h>

#include "base/bytes.h"
#include "harness/test.h"
#include "sim/bus/bus_bench.h"
#include "wire/esc_reg.h"

enum { IMAGE_BYTES = 2048, STEPS_MAX = 200000 };

static uint8_t old_image[IMAGE_BYTES];
static uint8_t new_image[IMAGE_BYTES];

static struct bus_bench *found(const char *name, uint64_t seed)
{
	struct bus_bench *b =
		bench_create(&(struct bench_spec){ .catalogue = { "ek1100", name }, .seed = seed });

	CHECK_EQ(bench_find(b), 0);
	return b;
}

static int finish(struct sii_job *job)
{
	int r = 1;

	for (unsigned i = 0; i < STEPS_MAX && r == 1; i++) {
		r = sii_job_step(job);
	}
	return r;
}

static void power_cycle(struct bus_bench *b)
{
	segment_power_off(b->segment, 1, bench_now_ns(b));
	segment_power_on(b->segment, 1, bench_now_ns(b));
	CHECK_EQ(line_sleep(b->line, (span_t){ 10 * NS_PER_MS }), 0); /* the EEPROM loads */
}

/* The slave's image as it is, and one with another order number, revision and alias. */
static size_t make_images(struct bus_bench *b)
{
	struct esc *esc = segment_esc(b->segment, 1);
	size_t offset;
	size_t bytes;
	size_t len;

	CHECK(esc->sii_bytes <= IMAGE_BYTES);
	len = esc->sii_bytes & ~(size_t)1;
	memcpy(old_image, esc->sii, len);
	memcpy(new_image, esc->sii, len);
	CHECK_EQ(sii_find_category(new_image, len, SII_CATEGORY_STRINGS, &offset, &bytes), 0);
	new_image[offset + 3] = 'Z';
	put_le16(new_image + SII_ALIAS_BYTE, 0x1234);
	put_le32(new_image + SII_REVISION_BYTE, 0x00990000);
	new_image[SII_CHECKSUM_BYTE] = sii_checksum(new_image);
	new_image[SII_CHECKSUM_BYTE + 1] = 0;
	return len;
}

/* --- registers --- */

TEST(esc_access, registers_are_read_and_what_the_master_needs_is_guarded)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 1, .seed = 1 });
	uint8_t data[10] = { 0 };
	uint8_t user[2] = { 0x5a, 0xa5 };

	bench_bring_up(b);
	CHECK_EQ(esc_access_read(b->bus, 0, ESC_REG_TYPE, data, sizeof(data), b->error), 0);
	CHECK_EQ(data[0], 0x11);
	CHECK_EQ(esc_access_write(b->bus, 0, ESC_REG_USER_RAM, user, 2, ESC_GUARDED, b->error), 0);
	CHECK_EQ(esc_access_read(b->bus, 0, ESC_REG_USER_RAM, data, 2, b->error), 0);
	CHECK_EQ(memcmp(data, user, 2), 0);
	CHECK_EQ(esc_access_write(b->bus, 0, ESC_REG_AL_CONTROL, user, 2, ESC_GUARDED, b->error),
		 -EPERM);
	CHECK(strstr(b->error, "0x0120: AL control: not written while the bus is in operation") !=
	      NULL);
	CHECK_EQ(esc_access_write(b->bus, 0, 0x000f, user, 2, ESC_GUARDED, b->error), -EPERM);
	CHECK(strstr(b->error, "station address") != NULL);
	put_le16(data, AL_SAFEOP);
	CHECK_EQ(esc_access_write(b->bus, 0, ESC_REG_AL_CONTROL, data, 2, ESC_FORCED, b->error), 0);
	CHECK_EQ(get_le16(segment_esc(b->segment, 0)->reg + ESC_REG_AL_CONTROL), AL_SAFEOP);
	CHECK_EQ(esc_access_read(b->bus, 1, ESC_REG_TYPE, data, 1, b->error), -ENODEV);
	CHECK_EQ(esc_access_read(b->bus, 0, 0xffff, data, 2, b->error), -EINVAL);
	CHECK_EQ(esc_access_read(b->bus, 0, 0x0e00, data, 1, b->error), -ENXIO);
	bench_destroy(b);
}

TEST(esc_access, diagnosis_is_decoded_and_counters_are_reset)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 2, .seed = 2 });
	struct esc *esc = segment_esc(b->segment, 0);
	struct esc_diagnosis d;

	bench_bring_up(b);
	esc->reg[ESC_REG_RX_ERROR_COUNTER + 2] = 6;
	esc->reg[ESC_REG_RX_ERROR_COUNTER + 3] = 7;
	esc->reg[ESC_REG_FORWARDED_RX_ERROR + 1] = 8;
	esc->reg[ESC_REG_ECAT_PU_ERROR] = 9;
	esc->reg[ESC_REG_PDI_ERROR] = 10;
	esc->reg[ESC_REG_LOST_LINK_COUNTER + 1] = 3;
	esc->reg[ESC_REG_WATCHDOG_COUNTER_PD] = 11;
	esc->reg[ESC_REG_WATCHDOG_COUNTER_PDI] = 12;
	CHECK_EQ(esc_diagnosis_read(b->bus, 0, &d, b->error), 0);
	CHECK_EQ(d.type, 0x11);
	CHECK_EQ(d.al_status, AL_OP);
	CHECK_EQ(d.is_pdi_operational, 1);
	CHECK_EQ(d.port[0].is_communicating, 1);
	CHECK_EQ(d.port[1].is_communicating, 1);
	CHECK_EQ(d.port[0].is_ebus, 0);
	CHECK_EQ(d.port[1].invalid_frames, 6);
	CHECK_EQ(d.port[1].rx_errors, 7);
	CHECK_EQ(d.port[1].forwarded_errors, 8);
	CHECK_EQ(d.port[1].lost_links, 3);
	CHECK_EQ(d.has_processing_errors, 1);
	CHECK_EQ(d.processing_errors, 9);
	CHECK_EQ(d.pdi_errors, 10);
	CHECK_EQ(d.has_expirations, 1);
	CHECK_EQ(d.expirations_pd, 11);
	CHECK_EQ(d.expirations_pdi, 12);
	CHECK_EQ(d.port[2].is_link, 0);
	CHECK_EQ(d.port[2].is_loop_closed, 1);
	CHECK_EQ(d.watchdog_pd_ns, 100 * NS_PER_MS);
	CHECK_EQ(d.is_watchdog_alive, 1);
	CHECK_EQ(esc_errors_reset(b->bus, 0, b->error), 0);
	CHECK_EQ(esc_diagnosis_read(b->bus, 0, &d, b->error), 0);
	CHECK_EQ(d.port[1].invalid_frames, 0);
	CHECK_EQ(d.port[1].rx_errors, 0);
	CHECK_EQ(d.port[1].forwarded_errors, 0);
	CHECK_EQ(d.port[1].lost_links, 0);
	CHECK_EQ(d.processing_errors, 0);
	CHECK_EQ(d.pdi_errors, 0);
	CHECK_EQ(d.expirations_pd, 0);
	CHECK_EQ(d.expirations_pdi, 0);
	bench_destroy(b);
}

/* --- EEPROM --- */

TEST(esc_access, an_eeprom_is_read_whole_and_no_longer_than_the_buffer)
{
	static uint8_t image[8192];
	struct bus_bench *b = found("el3104", 3);
	struct esc *esc = segment_esc(b->segment, 1);
	struct sii_job job;

	CHECK_EQ(sii_job_read(&job, b->bus, 1, image, sizeof(image)), 0);
	CHECK_EQ(finish(&job), 0);
	CHECK_EQ(job.len_bytes, sii_stated_bytes(esc->sii));
	CHECK_EQ(memcmp(image, esc->sii, esc->sii_bytes), 0);
	CHECK_EQ(sii_job_read(&job, b->bus, 1, image, 256), 0);
	CHECK_EQ(finish(&job), -ENOSPC);
	CHECK_EQ(sii_job_read(&job, b->bus, 2, image, sizeof(image)), -ENODEV);
	bench_destroy(b);
}

TEST(esc_access, an_image_is_written_verified_and_used_after_power_on)
{
	struct bus_bench *b = found("el2004", 4);
	struct esc *esc = segment_esc(b->segment, 1);
	size_t len = make_images(b);
	struct sii_job job;
	size_t count;

	CHECK_EQ(sii_job_write(&job, b->bus, 1, new_image, len, ESC_GUARDED), 0);
	CHECK_EQ(finish(&job), 0);
	CHECK(job.written_words >= 5 && job.written_words <= 8);
	CHECK_EQ(memcmp(esc->sii, new_image, len), 0);
	/* A second time there is nothing to write. */
	CHECK_EQ(sii_job_write(&job, b->bus, 1, new_image, len, ESC_GUARDED), 0);
	CHECK_EQ(finish(&job), 0);
	CHECK_EQ(job.written_words, 0);
	power_cycle(b);
	bench_new_master(b);
	CHECK_EQ(bench_find(b), 0);
	CHECK_EQ(bus_slaves(b->bus, &count)[1].revision, 0x00990000);
	CHECK_EQ(bus_slaves(b->bus, &count)[1].alias, 0x1234);
	bench_destroy(b);
}

TEST(esc_access, an_emulated_eeprom_is_written)
{
	struct bus_bench *b = found("akd", 5);
	struct esc *esc = segment_esc(b->segment, 1);
	struct sii_job job;

	CHECK_EQ(sii_job_alias(&job, b->bus, 2, 0x0777, ESC_GUARDED), -ENODEV);
	CHECK_STR(job.error, "no slave at position 2: there are 2");
	CHECK_EQ(sii_job_alias(&job, b->bus, 1, 0x0777, ESC_GUARDED), 0);
	CHECK_EQ(finish(&job), 0);
	CHECK_EQ(get_le16(esc->sii + SII_ALIAS_BYTE), 0x0777);
	CHECK_EQ(sii_is_checksum_right(esc->sii), 1);
	bench_destroy(b);
}

TEST(esc_access, wrong_images_and_wrong_states_are_refused_before_anything_is_written)
{
	struct bus_bench *b = found("el2004", 6);
	size_t len = make_images(b);
	struct sii_job job;

	new_image[SII_CHECKSUM_BYTE] ^= 1;
	CHECK_EQ(sii_job_write(&job, b->bus, 1, new_image, len, ESC_FORCED), -EINVAL);
	CHECK(strncmp(job.error, "slave 1 (el2004_1): SII image: checksum", 39) == 0);
	new_image[SII_CHECKSUM_BYTE] ^= 1;
	CHECK_EQ(sii_job_write(&job, b->bus, 1, new_image, 0x90, ESC_FORCED), -EINVAL);
	CHECK(strstr(job.error, "past the end") != NULL);
	CHECK_EQ(sii_job_write(&job, b->bus, 1, new_image, 0x91, ESC_FORCED), -EINVAL);
	put_le16(new_image + SII_SIZE_BYTE, 1);
	CHECK_EQ(sii_job_write(&job, b->bus, 1, new_image, len, ESC_FORCED), -EINVAL);
	CHECK(strstr(job.error, "size word") != NULL);
	make_images(b);
	put_le32(new_image + SII_PRODUCT_BYTE, 0x12345678);
	CHECK_EQ(sii_job_write(&job, b->bus, 1, new_image, len, ESC_GUARDED), 0);
	CHECK_EQ(finish(&job), -EINVAL);
	CHECK(strstr(job.error, "another vendor or product") != NULL);
	make_images(b);
	esc_force_al_status(segment_esc(b->segment, 1), AL_SAFEOP, 0);
	CHECK_EQ(sii_job_write(&job, b->bus, 1, new_image, len, ESC_GUARDED), 0);
	CHECK_EQ(finish(&job), -EPERM);
	CHECK_EQ(memcmp(segment_esc(b->segment, 1)->sii, old_image, len), 0);
	bench_destroy(b);
}

/* The state that esc_access.h documents, after the power failed in the @words-th word. */
static void check_cut(struct bus_bench *b, unsigned words, size_t len, unsigned count[3])
{
	struct esc *esc = segment_esc(b->segment, 1);
	struct sii_job job;
	int r = 1;

	memcpy(esc->sii, old_image, len);
	esc_eeprom_cut(esc, words);
	CHECK_EQ(sii_job_write(&job, b->bus, 1, new_image, len, ESC_GUARDED), 0);
	while (r == 1 && !esc->is_eeprom_cut) {
		r = sii_job_step(&job);
	}
	CHECK(r >= 0);
	if (memcmp(esc->sii, old_image, len) == 0) {
		count[0]++;
	} else if (memcmp(esc->sii, new_image, len) == 0) {
		count[1]++;
	} else {
		count[2]++;
		CHECK_EQ(sii_is_checksum_right(esc->sii), 0);
	}
	power_cycle(b);
}

TEST(esc_access, power_loss_at_any_word_leaves_the_old_the_new_or_a_marked_eeprom)
{
	struct bus_bench *b = found("el2004", 7);
	size_t len = make_images(b);
	unsigned count[3] = { 0 }; /* old, new, marked */
	struct sii_job job;
	unsigned words;

	CHECK_EQ(sii_job_write(&job, b->bus, 1, new_image, len, ESC_GUARDED), 0);
	CHECK_EQ(finish(&job), 0);
	words = (unsigned)job.written_words;
	CHECK(words > 4);
	for (unsigned n = 1; n <= words; n++) {
		char text[BUS_ERROR_BYTES];
		unsigned marked = count[2];

		check_cut(b, n, len, count);
		bench_new_master(b);
		if (count[2] == marked) {
			CHECK_EQ(bench_find(b), 0);
			continue;
		}
		/* It is reported, and writing again completes it. */
		CHECK_EQ(bench_find(b), -EPROTO);
		snprintf(text, sizeof(text), "%s", b->error);
		CHECK(strstr(text, "its EEPROM is damaged: checksum") != NULL);
		CHECK_EQ(sii_job_write(&job, b->bus, 1, new_image, len, ESC_GUARDED), 0);
		CHECK_EQ(finish(&job), 0);
		CHECK_EQ(memcmp(segment_esc(b->segment, 1)->sii, new_image, len), 0);
	}
	printf("cut at each of %u words: %u old, %u new, %u marked\n", words, count[0], count[1],
	       count[2]);
	CHECK(count[2] >= words - 2);
	bench_destroy(b);
}
