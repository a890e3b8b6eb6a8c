/* SPDX-License-Identifier: MIT */
/* What a slave says about itself: its SII, read whole and only as it is; its SYNC modes. */
#include <errno.h>

#include "base/bytes.h"
#include "bus/bus_internal.h"
#include "devices/catalogue.h"
#include "harness/test.h"
#include "sim/bus/bus_bench.h"
#include "wire/esc_reg.h"
#include "wire/sii.h"

static uint8_t *category(struct esc *esc, uint16_t wanted)
{
	size_t offset;
	size_t bytes;

	CHECK_EQ(sii_find_category(esc->sii, esc->sii_bytes, wanted, &offset, &bytes), 0);
	return esc->sii + offset;
}

/* --- reading --- */

TEST(description, a_segment_that_pauses_is_read_without_a_wrong_word)
{
	for (unsigned seed = 1; seed <= 8; seed++) {
		struct bus_bench *b = bench_create(
			&(struct bench_spec){ .piccolos = 1,
					      .catalogue = { "ek1100", "el3104", "el2004" },
					      .seed = seed });
		const struct slave_info *slaves;
		size_t count;

		b->pause_every_ns = 15 * NS_PER_MS;
		b->pause_ns = 6 * NS_PER_MS;
		CHECK_EQ(bench_find(b), 0);
		slaves = bus_slaves(b->bus, &count);
		CHECK_EQ(count, 4);
		for (size_t i = 0; i < count; i++) {
			const struct bus_slave *sl = &b->bus->slave[i];
			const struct esc *esc = segment_esc(b->segment, (unsigned)i);
			struct sii read;
			struct sii real;
			char why[128];

			CHECK_EQ(memcmp(sl->sii, esc->sii, SII_CATEGORIES_BYTE), 0);
			CHECK_EQ(slaves[i].product, get_le32(esc->sii + SII_PRODUCT_BYTE));
			CHECK_EQ(sii_parse(sl->sii, sl->sii_len, &read, why, sizeof(why)), 0);
			CHECK_EQ(sii_parse(esc->sii, esc->sii_bytes, &real, why, sizeof(why)), 0);
			CHECK_EQ(read.entry_count, real.entry_count);
			CHECK_EQ(memcmp(read.entry, real.entry, sizeof(real.entry)), 0);
			CHECK_EQ(memcmp(read.sm, real.sm, sizeof(real.sm)), 0);
		}
		bench_destroy(b);
	}
}

/* SOEM gave up after 20 ms and went on with zeros. */
TEST(description, a_slow_eeprom_is_waited_for)
{
	struct bus_bench *b =
		bench_create(&(struct bench_spec){ .catalogue = { "el2004" }, .seed = 3 });
	size_t count;

	segment_esc(b->segment, 0)->eeprom_slow_ns = 50 * NS_PER_MS;
	CHECK_EQ(bench_find(b), 0);
	CHECK_EQ(bus_slaves(b->bus, &count)[0].product, 0x07d43052);
	CHECK_EQ(bench_map(b), 0);
	bus_channels(b->bus, &count);
	CHECK_EQ(count, 4);
	bench_destroy(b);
}

TEST(description, a_word_that_cannot_be_read_is_an_error_and_never_zero)
{
	struct bus_bench *b = bench_create(
		&(struct bench_spec){ .catalogue = { "ek1100", "el2004" }, .seed = 4 });
	int64_t begun_ns = bench_now_ns(b);

	segment_esc(b->segment, 1)->eeprom_slow_ns = 10 * NS_PER_S;
	CHECK_EQ(bench_find(b), -EIO);
	CHECK(strstr(b->error, "slave 1 (") == b->error);
	CHECK(strstr(b->error, "its EEPROM cannot be read at word 0x0000: its EEPROM interface "
			       "stays busy") != NULL);
	CHECK(bench_now_ns(b) - begun_ns < 2 * NS_PER_S);
	bench_destroy(b);
}

TEST(description, a_wrong_checksum_is_an_error_that_names_it)
{
	struct bus_bench *b =
		bench_create(&(struct bench_spec){ .catalogue = { "el2004" }, .seed = 5 });

	/* Written since the chip has loaded it. */
	segment_esc(b->segment, 0)->sii[SII_ALIAS_BYTE] ^= 0x01;
	segment_advance(b->segment, bench_now_ns(b));
	bench_find(b);
	CHECK_EQ(bench_find(b), -EPROTO);
	CHECK(strstr(b->error, "its EEPROM is damaged: checksum of words 0 to 7") != NULL);
	bench_destroy(b);
}

TEST(description, slaves_of_equal_identity_keep_their_own_contents)
{
	struct bus_bench *b = bench_create(
		&(struct bench_spec){ .catalogue = { "el2004", "el2004", "ek1100" }, .seed = 6 });
	uint8_t *names = category(segment_esc(b->segment, 1), SII_CATEGORY_STRINGS);
	uint8_t *pdo = category(segment_esc(b->segment, 1), SII_CATEGORY_RXPDO);
	const struct slave_info *slaves;
	size_t count;

	names[2] = 'X'; /* the order number, which both names begin with */
	for (uint8_t *at = names; at < pdo; at++) {
		if (memcmp(at, "EL2004", 6) == 0) {
			at[2] = '9';
		}
	}
	pdo[3] = 0xff; /* its first PDO has no SyncManager */
	CHECK_EQ(bench_find(b), 0);
	slaves = bus_slaves(b->bus, &count);
	CHECK_EQ(slaves[0].revision, slaves[1].revision);
	CHECK(strstr(slaves[0].device, "EL2004") != NULL);
	CHECK(strstr(slaves[1].device, "EL2004") == NULL);
	CHECK_EQ(bench_map(b), 0);
	slaves = bus_slaves(b->bus, &count);
	CHECK_EQ(slaves[0].output_bits, 4);
	CHECK_EQ(slaves[1].output_bits, 3);
	bench_destroy(b);
}

/* SOEM took the mapping of an earlier slave of that identity, or read the SII again itself. */
TEST(description, the_mapping_reads_no_eeprom)
{
	struct bus_bench *b = bench_create(
		&(struct bench_spec){ .catalogue = { "el2004", "el2004", "ek1100" }, .seed = 7 });
	uint8_t *pdo = category(segment_esc(b->segment, 1), SII_CATEGORY_RXPDO);
	const struct slave_info *slaves;
	unsigned commands;
	size_t count;

	for (unsigned i = 0; i < 4; i++) {
		pdo[i * 16 + 3] = 0xff;
	}
	CHECK_EQ(bench_find(b), 0);
	commands = b->eeprom_commands;
	CHECK(commands > 0);
	CHECK_EQ(bench_map(b), 0);
	CHECK_EQ(b->eeprom_commands, commands);
	slaves = bus_slaves(b->bus, &count);
	CHECK_EQ(slaves[0].output_bits, 4);
	CHECK_EQ(slaves[1].output_bits, 0);
	bench_destroy(b);
}

/* An image with a category of @filler_bytes in front of all others, and a size word that fits. */
static size_t grow_image(const char *name, uint8_t *image, size_t capacity, size_t filler_bytes)
{
	static uint8_t from[MODEL_SII_BYTES];
	static struct sii sii;
	size_t len = catalogue_image(name, from, &sii);
	size_t at = SII_CATEGORIES_BYTE;

	CHECK(len + filler_bytes + 4 <= capacity);
	memcpy(image, from, at);
	put_le16(image + at, 0x0800); /* vendor specific */
	put_le16(image + at + 2, (uint16_t)(filler_bytes / 2));
	memset(image + at + 4, 0xa5, filler_bytes);
	memcpy(image + at + 4 + filler_bytes, from + at, len - at);
	len += filler_bytes + 4;
	put_le16(image + SII_SIZE_BYTE, (uint16_t)((len + 127) / 128 - 1));
	return len;
}

TEST(description, an_sii_beyond_four_kib_is_read_to_its_end)
{
	static uint8_t image[32768];
	size_t len = grow_image("el4002", image, sizeof(image), 20000);
	struct bus_bench *b =
		bench_create(&(struct bench_spec){ .image = { { image, len } }, .seed = 8 });
	size_t count;

	CHECK_EQ(bench_find(b), 0);
	CHECK_EQ(bench_map(b), 0);
	CHECK(strstr(bus_slaves(b->bus, &count)[0].device, "EL4002") != NULL);
	CHECK_EQ(bus_slaves(b->bus, &count)[0].output_bits, 32);
	CHECK_EQ(b->bus->slave[0].assign_activate, 0);
	CHECK_EQ(b->bus->parsed.dc_mode_count, 2);
	bench_destroy(b);
}

TEST(description, an_emulated_eeprom_is_read)
{
	struct bus_bench *b =
		bench_create(&(struct bench_spec){ .catalogue = { "akd" }, .seed = 9 });
	size_t count;

	CHECK_EQ(bench_find(b), 0);
	CHECK_EQ(bus_slaves(b->bus, &count)[0].product, 0x00414b44);
	CHECK_EQ(b->bus->slave[0].eeprom_status & 0x20, 0x20);
	bench_bring_up(b);
	bench_destroy(b);
}

TEST(description, sixty_four_slaves_are_read_at_the_same_time)
{
	struct bus_bench *one = bench_create(&(struct bench_spec){ .piccolos = 1, .seed = 10 });
	struct bus_bench *many = bench_create(&(struct bench_spec){ .piccolos = 64, .seed = 10 });
	int64_t one_ns = -bench_now_ns(one);
	int64_t many_ns = -bench_now_ns(many);

	CHECK_EQ(bench_find(one), 0);
	one_ns += bench_now_ns(one);
	line_bind(many->line);
	CHECK_EQ(bench_find(many), 0);
	many_ns += bench_now_ns(many);
	printf("scan of 1 slave %lld ms, of 64 slaves %lld ms\n", (long long)(one_ns / NS_PER_MS),
	       (long long)(many_ns / NS_PER_MS));
	CHECK(one_ns > 0);
	CHECK(many_ns < 4 * one_ns);
	bench_destroy(many);
	line_bind(one->line);
	bench_destroy(one);
}

/* --- frames that no slave has seen --- */

TEST(description, frames_that_return_unchanged_are_named)
{
	static const char *const settings[] = { "bus.scan_timeout=200ms", NULL };
	struct bus_bench *b = bench_create(
		&(struct bench_spec){ .piccolos = 1, .seed = 11, .settings = settings });

	b->is_loopback = 1;
	CHECK_EQ(bench_find(b), -ENODEV);
	CHECK(strstr(b->error, "frames return unchanged") != NULL);
	bench_destroy(b);
}

/* --- SYNC modes --- */

struct sync_expectation {
	uint8_t activation; /* 0x0981 */
	uint32_t sync0_ns;
	uint32_t sync1_ns;
};

static void check_sync(struct bus_bench *b, unsigned slave, struct sync_expectation e)
{
	const uint8_t *reg = segment_esc(b->segment, slave)->reg;

	CHECK_EQ(reg[ESC_REG_DC_ACTIVATION], e.activation);
	if (e.activation != 0) {
		CHECK_EQ(get_le32(reg + ESC_REG_DC_SYNC0_CYCLE), e.sync0_ns);
		CHECK_EQ(get_le32(reg + ESC_REG_DC_SYNC1_CYCLE), e.sync1_ns);
	}
}

static const struct sync_expectation no_sync = { 0 };

/* T40, D4: the first mode of the SII is the vendor's default; no DC category is no SYNC. */
TEST(description, default_sync_modes_of_real_images_are_the_vendors)
{
	static const char *const settings[] = { "dc.burst_frames=100", NULL };
	struct bus_bench *b = bench_create(
		&(struct bench_spec){ .piccolos = 1,
				      .sii = { "ek1100", "el2889", "el4002", "el2521-0000", "akd" },
				      .clocked = 0x3e,
				      .seed = 12,
				      .settings = settings });

	bench_bring_up(b);
	check_sync(b, 0, (struct sync_expectation){ 0x03, 1000000, 0 });
	check_sync(b, 2, no_sync);
	check_sync(b, 3, no_sync); /* modes 0x0000, 0x0700 */
	check_sync(b, 4, no_sync); /* modes 0x0000, 0x0300 */
	check_sync(b, 5, (struct sync_expectation){ 0x03, 1000000, 0 });
	bench_destroy(b);
}

TEST(description, default_sync_modes_of_the_catalogue_are_the_vendors)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){
		.catalogue = { "akd", "el4002", "el2521", "el2889" }, .clocked = 0xf, .seed = 13 });

	bench_bring_up(b);
	check_sync(b, 0, (struct sync_expectation){ 0x03, 1000000, 0 });
	check_sync(b, 1, no_sync);
	check_sync(b, 2, no_sync);
	check_sync(b, 3, no_sync);
	bench_destroy(b);
}

TEST(description, sync_can_be_chosen_and_switched_off)
{
	static const char *const settings[] = { "slaves[0].assign_activate=none",
						"slaves[1].assign_activate=0x0700",
						"slaves[2].assign_activate=0x0300",
						"slaves[3].assign_activate=0x0300", NULL };
	struct bus_bench *b = bench_create(
		&(struct bench_spec){ .catalogue = { "akd", "el4002", "el2521", "el2889" },
				      .clocked = 0xf,
				      .seed = 14,
				      .settings = settings });

	bench_bring_up(b);
	check_sync(b, 0, no_sync);
	/* its SII: SYNC1 100 us after each SYNC0 */
	check_sync(b, 1, (struct sync_expectation){ 0x07, 1000000, 100000 });
	check_sync(b, 2, (struct sync_expectation){ 0x03, 1000000, 0 });
	check_sync(b, 3, (struct sync_expectation){ 0x03, 1000000, 0 });
	bench_destroy(b);
}

/* The EL4002's second mode, with other cycles and shifts, is chosen. */
static struct bus_bench *make_mode(int16_t factor0, int32_t shift0_ns, int16_t factor1,
				   int32_t shift1_ns, uint64_t seed)
{
	static const char *const settings[] = { "slaves[0].assign_activate=0x0700", NULL };
	struct bus_bench *b = bench_create(&(struct bench_spec){
		.catalogue = { "el4002" }, .clocked = 1, .seed = seed, .settings = settings });
	uint8_t *mode = category(segment_esc(b->segment, 0), SII_CATEGORY_DC) + 24;

	put_le32(mode + 4, (uint32_t)shift0_ns);
	put_le32(mode + 8, (uint32_t)shift1_ns);
	put_le16(mode + 12, (uint16_t)factor1);
	put_le16(mode + 16, (uint16_t)factor0);
	return b;
}

TEST(description, sync_cycle_factors_and_shifts_of_a_mode_reach_the_slave)
{
	struct bus_bench *b = make_mode(4, 250000, 2, 30000, 15);
	const uint8_t *reg = segment_esc(b->segment, 0)->reg;

	bench_bring_up(b);
	check_sync(b, 0, (struct sync_expectation){ 0x07, 4000000, 4030000 });
	CHECK_EQ(segment_esc(b->segment, 0)->sync.next_local_ns % 4000000, 250000);
	CHECK_EQ(bus_sync0_is_running(b->bus, 0), 1);
	bench_destroy(b);
	b = make_mode(-2, 0, 0, 20000, 16);
	reg = segment_esc(b->segment, 0)->reg;
	bench_bring_up(b);
	check_sync(b, 0, (struct sync_expectation){ 0x07, 500000, 20000 });
	CHECK_EQ(get_le32(reg + ESC_REG_DC_SYNC0_CYCLE), 500000);
	bench_destroy(b);
}

/* What bus_slaves() states of the first slave. */
static int32_t stated_shift_ns(struct bus_bench *b)
{
	size_t count;
	int32_t shift_ns;

	CHECK_EQ(bench_find(b), 0);
	shift_ns = bus_slaves(b->bus, &count)[0].sync0_shift_ns;
	bench_destroy(b);
	return shift_ns;
}

TEST(description, the_stated_sync0_shift_is_that_of_the_sii_and_the_configuration)
{
	static const char *const settings[] = { "slaves[0].sync0_shift=-30us", NULL };

	CHECK_EQ(stated_shift_ns(make_mode(1, 250000, 0, 0, 41)), 250000);
	CHECK_EQ(stated_shift_ns(make_mode(1, 1250000, 0, 0, 42)), 250000);
	CHECK_EQ(stated_shift_ns(make_mode(4, -1250000, 0, 0, 43)), -1250000);
	CHECK_EQ(stated_shift_ns(bench_create(
			 &(struct bench_spec){ .piccolos = 1, .seed = 44, .settings = settings })),
		 -30000);
}

/* After bring-up: what the slave was programmed with. */
TEST(description, the_stated_sync0_cycle_is_that_of_the_slave_and_none_without_sync0)
{
	static const char *const off[] = { "slaves[0].assign_activate=none", NULL };
	static const char *const shots[] = { "slaves[0].mode=oneshot", NULL };
	const struct {
		struct bus_bench *bench;
		uint32_t cycle_ns;
	} cases[] = {
		{ make_mode(4, 250000, 0, 0, 45), 4000000 },
		{ make_mode(-2, 0, 0, 0, 46), 500000 },
		{ bench_create(&(struct bench_spec){ .piccolos = 1, .seed = 47 }), 1000000 },
		{ bench_create(&(struct bench_spec){
			  .catalogue = { "el4002" }, .clocked = 1, .seed = 48, .settings = off }),
		  0 },
		{ bench_create(
			  &(struct bench_spec){ .piccolos = 1, .seed = 49, .settings = shots }),
		  0 },
	};

	for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
		size_t count;

		bench_bring_up(cases[i].bench);
		CHECK_EQ(bus_slaves(cases[i].bench->bus, &count)[0].sync0_cycle_ns,
			 cases[i].cycle_ns);
		bench_destroy(cases[i].bench);
	}
}

static void check_refused(struct bus_bench *b, const char *what)
{
	CHECK_EQ(bench_find(b), -ENOTSUP);
	CHECK(strstr(b->error, "SYNC mode \"DC\" of its SII (AssignActivate 0x0700)") != NULL);
	CHECK(strstr(b->error, what) != NULL);
	bench_destroy(b);
}

TEST(description, a_sync_mode_that_cannot_be_done_is_refused_by_name)
{
	check_refused(make_mode(-3, 0, 0, 0, 17), "no multiple or fraction");
	check_refused(make_mode(1, 0, -2, 0, 18), "SYNC1 cycle below the SYNC0 cycle");
	check_refused(make_mode(1, 0, 0, -1000, 19), "SYNC1 shift outside the SYNC0 cycle");
	check_refused(make_mode(1, 0, 0, 1000000, 20), "SYNC1 shift outside the SYNC0 cycle");
	check_refused(make_mode(30000, 0, 0, 0, 21), "beyond 32 bits");
}

TEST(description, sync_types_are_written_and_read_back_where_the_configuration_says_so)
{
	static const char *const off[] = { "slaves[0].assign_activate=none",
					   "slaves[0].sync_type=write", NULL };
	static const char *const on[] = { "slaves[0].sync_type=write", NULL };
	static const char *const show[] = { "slaves[0].assign_activate=none", NULL };
	struct bus_bench *b;

	b = bench_create(&(struct bench_spec){ .piccolos = 1, .seed = 22, .settings = show });
	CHECK_EQ(bench_find(b), 0);
	CHECK_EQ(bench_map(b), 0);
	CHECK_EQ(b->bus->slave[0].output_sync.type, 2);
	bench_destroy(b);
	b = bench_create(&(struct bench_spec){ .piccolos = 1, .seed = 23, .settings = on });
	CHECK_EQ(bench_find(b), 0);
	CHECK_EQ(bench_map(b), 0);
	CHECK_EQ(b->bus->slave[0].output_sync.type, 2);
	bench_destroy(b);
	/* The board's firmware has no mode without SYNC0 and says so. */
	b = bench_create(&(struct bench_spec){ .piccolos = 1, .seed = 24, .settings = off });
	CHECK_EQ(bench_find(b), 0);
	CHECK(bench_map(b) < 0);
	CHECK(strstr(b->error, "0x1c32:01 cannot be set to synchronization type 1") != NULL);
	bench_destroy(b);
}

/* --- SYNC0 start --- */

TEST(description, a_reference_clock_that_answers_nonsense_ends_the_start_of_sync0)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 2, .seed = 25 });
	int64_t begun_ns;

	CHECK_EQ(bench_find(b), 0);
	CHECK_EQ(bench_map(b), 0);
	CHECK_EQ(bench_cycle(b), 0);
	begun_ns = bench_now_ns(b);
	/* Where the caller believes the clock to be, it will not be for 10 years. */
	CHECK_EQ(bus_sync0_start(b->bus, b->last.dc_time_ns + INT64_C(315360000) * NS_PER_S,
				 b->error),
		 -EIO);
	CHECK(strstr(b->error, "the reference clock reads") != NULL);
	CHECK(bench_now_ns(b) - begun_ns < 2 * NS_PER_S);
	bench_destroy(b);
}

TEST(description, a_sync_unit_whose_owner_cannot_be_read_is_an_error)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 1, .seed = 26 });
	struct esc *esc = segment_esc(b->segment, 0);

	CHECK_EQ(bench_find(b), 0);
	CHECK_EQ(bench_map(b), 0);
	CHECK_EQ(bench_cycle(b), 0);
	/* D24: the register answers no more. */
	esc->readable[ESC_REG_DC_CYCLIC_CONTROL / 8] &=
		(uint8_t)~(1u << ESC_REG_DC_CYCLIC_CONTROL % 8);
	CHECK_EQ(bus_sync0_start(b->bus, b->last.dc_time_ns, b->error), -EIO);
	CHECK(strstr(b->error, "its SYNC unit (0x0980) cannot be programmed") != NULL);
	bench_destroy(b);
}
