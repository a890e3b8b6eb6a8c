/* SPDX-License-Identifier: MIT */
#include "board.h"

#include <string.h>

#include "base/bytes.h"
#include "harness/test.h"
#include "wire/esc_reg.h"

enum {
	OCTETS_MASKED_MAX = 50,
	SM0 = 0x1000,
	SM1 = 0x1080,
	SM2 = 0x1100,
	SM3 = 0x1180,
	EVENT_CONTROL = 0x0001,
	EVENT_SM_CHANGED = 0x0010,
	EVENT_SM0 = 0x0100,
	EVENT_SM2 = 0x0400,
};

/* --- the ET1100 behind the pins --- */

static uint8_t esc_read(struct board *b, uint16_t address)
{
	uint8_t value = b->memory[address % BOARD_MEMORY];

	if (address == ESC_REG_AL_CONTROL) {
		b->al_event &= (uint16_t)~EVENT_CONTROL;
	} else if (address >= ESC_REG_SM && address < ESC_REG_SM + 0x40 && address % 8 == 6) {
		b->al_event &= (uint16_t)~EVENT_SM_CHANGED;
	} else if (address == SM0 + 127) {
		b->is_sm0_full = 0;
		b->al_event &= (uint16_t)~EVENT_SM0;
	} else if (address == SM2 + 8) {
		b->al_event &= (uint16_t)~EVENT_SM2;
	} else if (address == ESC_REG_SM + 8 + 5) {
		value = b->is_sm1_full ? 0x08 : 0x00;
	}
	return value;
}

static int is_sync_register(uint16_t address)
{
	return address == ESC_REG_DC_ACTIVATION || (address >= 0x0990 && address < 0x09a8);
}

static void esc_write(struct board *b, uint16_t address, uint8_t value)
{
	if (is_sync_register(address) && (b->memory[ESC_REG_DC_CYCLIC_CONTROL] & 1) == 0) {
		return; /* the SYNC unit belongs to the master */
	}
	b->memory[address % BOARD_MEMORY] = value;
	b->is_sm1_full |= address == SM1 + 127;
	b->input_writes += address == SM3 + 12;
	b->activation_writes += address == ESC_REG_DC_ACTIVATION;
}

/* --- SPI --- */

static void spi_select(struct board *b)
{
	b->breaches.select += b->is_selected != 0;
	b->breaches.before_loaded += !b->is_loaded;
	b->breaches.unmasked += !b->is_masked && !b->is_in_isr;
	b->is_selected = 1;
	b->pos = 0;
	b->is_last_out = 0;
}

static unsigned command(const struct board *b)
{
	return b->pos > 1 && (b->header[1] & 7u) == 6u ? b->header[2] >> 2 & 7u : b->header[1] & 7u;
}

static void spi_deselect(struct board *b)
{
	b->breaches.select += !b->is_selected;
	if (b->pos > 3 && command(b) == 3) {
		b->breaches.termination += !b->is_last_out;
	}
	b->is_selected = 0;
}

static uint8_t address_octet(struct board *b, uint8_t out)
{
	b->header[b->pos] = out;
	if (b->pos == 2) {
		b->breaches.address += (out & 3u) != 0;
		b->breaches.address += (out >> 2 & 7u) != 3 && (out >> 2 & 7u) != 4;
		b->address = (uint16_t)(b->header[0] << 5 | b->header[1] >> 3 | (out >> 5) << 13);
	}
	return (uint8_t)(b->pos == 0 ? b->al_event & 0xff : b->pos == 1 ? b->al_event >> 8 : 0);
}

static uint8_t spi_transfer(struct board *b, uint8_t out)
{
	uint8_t in = 0;

	b->octets++;
	b->octets_masked += b->is_masked != 0;
	b->breaches.select += !b->is_selected;
	if (b->pos < 3) {
		in = address_octet(b, out);
	} else if (command(b) == 4) {
		esc_write(b, b->address++, out);
	} else if (b->pos == 3) {
		b->breaches.wait_state += out != 0xff;
	} else {
		b->breaches.termination += b->is_last_out || (out != 0x00 && out != 0xff);
		b->is_last_out = out == 0xff;
		in = esc_read(b, b->address++);
	}
	b->pos++;
	return in;
}

static void spi_exchange(struct board *b, const uint8_t *out, uint8_t *in, uint16_t len)
{
	for (unsigned i = 0; i < len; i++) {
		uint8_t got = spi_transfer(b, out[i]);

		if (in != NULL) {
			in[i] = got;
		}
	}
}

static uint32_t spi_access(void *ctx, uint8_t *address, uint16_t address_len, const uint8_t *out,
			   uint8_t *in, uint16_t len)
{
	static const uint8_t wait_state = 0xff;
	struct board *b = ctx;

	spi_select(b);
	spi_exchange(b, address, address, address_len);
	spi_exchange(b, &wait_state, NULL, in != NULL);
	spi_exchange(b, out, in, len);
	spi_deselect(b);
	return b->us;
}

/* --- the rest of the board --- */

static int eeprom_loaded(void *ctx)
{
	return ((struct board *)ctx)->is_loaded;
}

static void adc_start(void *ctx)
{
	((struct board *)ctx)->adc_started++;
}

static uint16_t adc_read(void *ctx)
{
	return ((struct board *)ctx)->adc;
}

static int adc_overrun(void *ctx)
{
	struct board *b = ctx;
	int was = b->adc_overrun;

	b->adc_overrun = 0;
	return was;
}

static void led(void *ctx, int on)
{
	((struct board *)ctx)->led = on;
}

static uint32_t time_us(void *ctx)
{
	return ((struct board *)ctx)->us;
}

static void interrupts_off(void *ctx)
{
	struct board *b = ctx;

	b->breaches.nesting += b->is_masked != 0;
	b->is_masked = 1;
	b->octets_masked = 0;
}

static void flash_erase(void *ctx)
{
	struct board *b = ctx;

	memset(b->flash, 0xff, sizeof(b->flash));
	b->erasures++;
}

static int flash_is_busy(void *ctx)
{
	struct board *b = ctx;

	return b->busy > 0 ? (int)b->busy-- : 0;
}

static int flash_write(void *ctx, uint32_t offset, const octet_t *data, uint16_t len)
{
	struct board *b = ctx;

	CHECK(offset <= PICCOLO_FLASH_OCTETS && len <= PICCOLO_FLASH_OCTETS - offset);
	memcpy(b->flash + offset, data, len);
	return b->is_flash_broken;
}

static int flash_running(void *ctx, octet_t *ret_header)
{
	struct board *b = ctx;

	if (b->is_image_running) {
		memcpy(ret_header, b->flash, PICCOLO_IMAGE_HEADER_OCTETS);
	}
	return b->is_image_running;
}

/* The CPU is reset: what the program knew is gone. */
static void flash_start(void *ctx)
{
	struct board *b = ctx;
	struct piccolo_hal hal = b->fw.hal;

	b->is_image_running = 1;
	piccolo_init(&b->fw, &hal);
}

static void run_isr(struct board *b)
{
	b->is_edge_pending = 0;
	b->is_in_isr = 1;
	piccolo_sync0_isr(&b->fw);
	b->is_in_isr = 0;
}

static void interrupts_on(void *ctx)
{
	struct board *b = ctx;

	b->breaches.nesting += !b->is_masked;
	b->breaches.too_long += b->octets_masked > OCTETS_MASKED_MAX;
	b->is_masked = 0;
	if (b->is_edge_pending) {
		run_isr(b);
	}
}

void board_init(struct board *b)
{
	const struct piccolo_hal hal = {
		.ctx = b,
		.spi_access = spi_access,
		.eeprom_loaded = eeprom_loaded,
		.adc_start = adc_start,
		.adc_read = adc_read,
		.adc_overrun = adc_overrun,
		.flash_erase = flash_erase,
		.flash_is_busy = flash_is_busy,
		.flash_write = flash_write,
		.flash_running = flash_running,
		.flash_start = flash_start,
		.led = led,
		.time_us = time_us,
		.interrupts_off = interrupts_off,
		.interrupts_on = interrupts_on,
	};

	memset(b, 0, sizeof(*b));
	b->us = UINT32_MAX - 20000u; /* the timer wraps early in every test */
	b->memory[ESC_REG_PDI_CONTROL] = 0x05;
	b->memory[ESC_REG_WATCHDOG_STATUS_PD] = 1;
	b->led = 1; /* the firmware must switch it off */
	piccolo_init(&b->fw, &hal);
}

void board_start(struct board *b)
{
	b->is_loaded = 1;
	board_run(b, 2000);
}

void board_run(struct board *b, uint32_t us)
{
	uint32_t end = b->us + us;

	while ((int32_t)(end - b->us) > 0) {
		uint32_t wait_us = piccolo_step(&b->fw);

		b->us += wait_us < 20 ? 20 : wait_us;
	}
}

void board_sync0(struct board *b, uint64_t edge_ns)
{
	put_le64(b->memory + ESC_REG_DC_START_TIME,
		 edge_ns + get_le32(b->memory + ESC_REG_DC_SYNC0_CYCLE));
	b->is_edge_pending = 1;
	if (!b->is_masked) {
		run_isr(b);
	}
}

unsigned board_breaches(const struct board *b)
{
	const struct board_breaches *x = &b->breaches;

	return x->before_loaded + x->unmasked + x->select + x->wait_state + x->termination +
	       x->address + x->nesting + x->too_long;
}
