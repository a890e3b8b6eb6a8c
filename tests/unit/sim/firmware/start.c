/* SPDX-License-Identifier: MIT */
/* Power-on, and that description, registers and layout agree with what others say of them. */
#include "board.h"
#include "firmware/fb1111_piccolo/esc_register.h"
#include "firmware/fb1111_piccolo/host/sii.h"
#include "firmware/fb1111_piccolo/pdo.h"
#include "firmware/fb1111_piccolo/spi.h"
#include "harness/test.h"
#include "wire/al.h"
#include "wire/esc_reg.h"
#include "wire/sii.h"

TEST(firmware, nothing_touches_the_bus_before_eeprom_loaded)
{
	struct board b;

	board_init(&b);
	board_run(&b, 500000);
	board_sync0(&b, 1000000);
	CHECK_EQ(b.octets, 0);
	CHECK_EQ(b.led, 0);
	CHECK_EQ(b.adc_started, 0);

	board_start(&b);
	CHECK(b.octets > 0);
	CHECK_EQ(b.adc_started, 1);
	CHECK_EQ(board_al_status(&b), AL_INIT);
	CHECK_EQ(board_breaches(&b), 0);
}

TEST(firmware, waits_until_the_esc_shows_an_spi_interface)
{
	struct board b;

	board_init(&b);
	b.memory[ESC_REG_PDI_CONTROL] = 0xff; /* a floating bus */
	board_start(&b);
	CHECK_EQ(board_al_status(&b), 0);
	b.memory[ESC_REG_PDI_CONTROL] = 0x05;
	board_run(&b, 3000);
	CHECK_EQ(board_al_status(&b), AL_INIT);
}

TEST(firmware, starts_anew_when_the_esc_is_reset)
{
	struct board b;

	board_lead_to(&b, PICCOLO_OP);
	board_master_outputs(&b, 1, 0);
	board_run(&b, 11000);
	CHECK_EQ(b.led, 1);
	b.is_loaded = 0;
	board_run(&b, 5000);
	CHECK_EQ(b.led, 0);
	CHECK_EQ(b.fw.al.state, PICCOLO_INIT);
	CHECK_EQ(b.breaches.before_loaded, 0);
	board_start(&b);
	CHECK_EQ(board_al_status(&b), AL_INIT);
	CHECK_EQ(b.adc_started, 2);
	CHECK_EQ(board_breaches(&b), 0);
}

TEST(firmware, spi_reaches_every_address_bit_and_brings_al_events_back)
{
	struct board b;
	octet_t data[2];

	board_init(&b);
	board_start(&b);
	for (unsigned bit = 0; bit < 16; bit++) {
		uint16_t address = (uint16_t)(1u << bit);

		b.al_event = (uint16_t)(0x8001u | 1u << bit);
		piccolo_esc_read(&b.fw, address, data, 2);
		CHECK_EQ(b.address, address + 2);
		CHECK_EQ(b.fw.al_event, 0x8001u | 1u << bit);
		data[0] = data[1] = 0x5a;
		piccolo_esc_write(&b.fw, address, data, 2);
		CHECK_EQ((uint16_t)(b.address - 2), address);
	}
	b.al_event = 0x4321;
	b.is_masked = 1;
	piccolo_spi_poll(&b.fw);
	CHECK_EQ(b.fw.al_event, 0x4321);
	CHECK_EQ(board_breaches(&b), 0);
}

TEST(firmware, registers_are_those_of_the_wire_module)
{
	CHECK_EQ(REG_AL_CONTROL, ESC_REG_AL_CONTROL);
	CHECK_EQ(REG_AL_STATUS, ESC_REG_AL_STATUS);
	CHECK_EQ(REG_AL_STATUS_CODE, ESC_REG_AL_STATUS_CODE);
	CHECK_EQ(REG_PDI_CONTROL, ESC_REG_PDI_CONTROL);
	CHECK_EQ(REG_WATCHDOG_STATUS_PD, ESC_REG_WATCHDOG_STATUS_PD);
	CHECK_EQ(REG_SM, ESC_REG_SM);
	CHECK_EQ(REG_DC_SYSTEM_TIME, ESC_REG_DC_SYSTEM_TIME);
	CHECK_EQ(REG_DC_CYCLIC_CONTROL, ESC_REG_DC_CYCLIC_CONTROL);
	CHECK_EQ(REG_DC_ACTIVATION, ESC_REG_DC_ACTIVATION);
	CHECK_EQ(REG_DC_START_TIME, ESC_REG_DC_START_TIME);
	CHECK_EQ(REG_DC_SYNC0_CYCLE, ESC_REG_DC_SYNC0_CYCLE);
	CHECK_EQ(SM_OCTETS, ESC_SM_BYTES);

	CHECK_EQ(AL_INVALID_STATE_CHANGE, AL_CODE_INVALID_STATE_CHANGE);
	CHECK_EQ(AL_UNKNOWN_STATE, AL_CODE_UNKNOWN_STATE);
	CHECK_EQ(AL_INVALID_MAILBOX_CONFIG_BOOT, AL_CODE_INVALID_MAILBOX_CONFIG_BOOT);
	CHECK_EQ(AL_INVALID_MAILBOX_CONFIG, AL_CODE_INVALID_MAILBOX_CONFIG);
	CHECK_EQ(AL_SM_WATCHDOG, AL_CODE_SM_WATCHDOG);
	CHECK_EQ(AL_INVALID_OUTPUT_CONFIG, AL_CODE_INVALID_OUTPUT_CONFIG);
	CHECK_EQ(AL_INVALID_INPUT_CONFIG, AL_CODE_INVALID_INPUT_CONFIG);
	CHECK_EQ(AL_SYNC_LOST, AL_CODE_FATAL_SYNC_ERROR);
	CHECK_EQ(AL_SYNC_NOT_RECEIVED, AL_CODE_NO_SYNC_ERROR);
	CHECK_EQ(AL_INVALID_DC_SYNC_CONFIG, AL_CODE_INVALID_DC_SYNC_CONFIG);
	CHECK_EQ(AL_INVALID_DC_CYCLE, AL_CODE_DC_INVALID_SYNC_CYCLE);
}

static unsigned bit_offset(const struct piccolo_pdo *pdo, const char *name)
{
	unsigned offset = 0;

	for (unsigned i = 0; i < pdo->entry_count; i++) {
		const struct piccolo_entry *e = &pdo->entries[i];

		if (e->name != NULL && (name == NULL ? 0 : strcmp(e->name, name) == 0)) {
			return offset;
		}
		offset += e->bits;
	}
	return name == NULL ? offset : UINT32_MAX;
}

TEST(firmware, process_data_layout_is_that_of_the_description)
{
	const struct piccolo_pdo *rx = &piccolo_description.rx;
	const struct piccolo_pdo *tx = &piccolo_description.tx;

	CHECK_EQ(bit_offset(tx, "adc"), 8 * INPUT_ADC);
	CHECK_EQ(bit_offset(tx, "counter"), 8 * INPUT_COUNTER);
	CHECK_EQ(bit_offset(tx, "sample_time"), 8 * INPUT_SAMPLE_TIME);
	CHECK_EQ(bit_offset(tx, "status"), 8 * INPUT_STATUS);
	CHECK_EQ(bit_offset(tx, NULL), 8 * PICCOLO_INPUT_OCTETS);
	CHECK_EQ(bit_offset(rx, "led"), 8 * OUTPUT_LED);
	CHECK_EQ(bit_offset(rx, "oneshot_time"), 8 * OUTPUT_ONESHOT_TIME);
	CHECK_EQ(bit_offset(rx, NULL), 8 * PICCOLO_OUTPUT_OCTETS);
	CHECK_EQ(piccolo_description.sm[PICCOLO_SM_OUTPUTS].length, PICCOLO_OUTPUT_OCTETS);
	CHECK_EQ(piccolo_description.sm[PICCOLO_SM_INPUTS].length, PICCOLO_INPUT_OCTETS);
}

TEST(firmware, sii_needs_its_whole_size_and_leaves_a_short_buffer_alone)
{
	uint8_t image[PICCOLO_EEPROM_OCTETS];

	memset(image, 0x77, sizeof(image));
	CHECK_EQ(fb1111_piccolo_sii(image, sizeof(image) - 1), 0);
	CHECK_EQ(image[0], 0x77);
	CHECK_EQ(fb1111_piccolo_sii(image, sizeof(image)), 2048);
	CHECK_EQ(image[0], 0x05);
}

TEST(firmware, sii_checksum_is_that_of_real_terminals)
{
	/* the first words of EL4002 and of an evaluation board, with the checksums they carry */
	static const uint8_t el4002[14] = { 0x05, 0x04, 0x03, 0x88 };
	static const uint8_t evb9252[14] = { 0x80, 0x02 };

	CHECK_EQ(fb1111_piccolo_sii_checksum(el4002, sizeof(el4002)), 0xa4);
	CHECK_EQ(fb1111_piccolo_sii_checksum(evb9252, sizeof(evb9252)), 0xc6);
}

static void check_entries(const struct sii *sii, const struct sii_pdo *got,
			  const struct piccolo_pdo *wanted)
{
	CHECK_EQ(got->index, wanted->index);
	CHECK_EQ(got->sm, wanted->sm);
	CHECK_EQ(got->entry_count, wanted->entry_count);
	for (unsigned i = 0; i < got->entry_count; i++) {
		const struct sii_entry *e = &sii->entry[got->first_entry + i];

		CHECK_EQ(e->index, wanted->entries[i].index);
		CHECK_EQ(e->subindex, wanted->entries[i].subindex);
		CHECK_EQ(e->bit_len, wanted->entries[i].bits);
	}
}

TEST(firmware, sii_is_what_the_master_reads_out_of_it)
{
	const struct piccolo_description *d = &piccolo_description;
	static struct sii sii;
	uint8_t image[PICCOLO_EEPROM_OCTETS];
	char error[128];
	char text[SII_NAME_BYTES];

	CHECK_EQ(fb1111_piccolo_sii(image, sizeof(image)), sizeof(image));
	CHECK_EQ(sii_parse(image, sizeof(image), &sii, error, sizeof(error)), 0);
	CHECK_EQ(sii_checksum(image), image[14]);
	CHECK_EQ(sii.vendor, PICCOLO_VENDOR_ID);
	CHECK_EQ(sii.product, PICCOLO_PRODUCT_CODE);
	CHECK_EQ(sii.revision, PICCOLO_REVISION);
	CHECK_EQ(sii.size_bytes, sizeof(image));
	CHECK_EQ(sii.mailbox_out_start, d->sm[PICCOLO_SM_MAILBOX_OUT].start);
	CHECK_EQ(sii.mailbox_in_len, d->sm[PICCOLO_SM_MAILBOX_IN].length);
	CHECK_EQ(sii.mailbox_protocols, SII_MAILBOX_COE | SII_MAILBOX_FOE);
	CHECK_EQ(sii.boot_out_start, 0x1000);
	CHECK_EQ(sii.boot_out_len, 128);
	CHECK_EQ(sii.boot_in_start, 0x1080);
	CHECK_EQ(sii.boot_in_len, 128);
	CHECK_EQ(sii.sm_count, PICCOLO_SM_COUNT);
	CHECK_EQ(sii.sm[PICCOLO_SM_OUTPUTS].control, 0x64);
	CHECK_EQ(sii.dc_mode[0].assign_activate, 0x0300);
	CHECK_EQ(sii.pdo_count, 2);
	check_entries(&sii, &sii.pdo[sii.pdo[0].is_tx ? 0 : 1], &d->tx);
	check_entries(&sii, &sii.pdo[sii.pdo[0].is_tx ? 1 : 0], &d->rx);
	sii_text(image, sizeof(image), sii.device_name, text);
	CHECK_STR(text, d->name);
}
