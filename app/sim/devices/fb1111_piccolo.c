/* SPDX-License-Identifier: MIT */
#include "devices/fb1111_piccolo.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "devices/pdi_spi.h"
#include "firmware/fb1111_piccolo/host/sii.h"
#include "firmware/fb1111_piccolo/piccolo.h"

enum {
	WIRE_NS = 255,       /* two PHYs and 1 m of cable */
	PROCESSING_NS = 270, /* ET1100, MII to MII; taken as the same on the way back */
};

struct board {
	struct sim_device device; /* first */
	uint8_t sii[PICCOLO_EEPROM_OCTETS];
	struct piccolo firmware;
	struct pdi_spi spi;
	int64_t busy_until_ns; /* the CPU is at its SPI octets, or hangs */
	int64_t step_ns;       /* next pass of the main loop */
	int64_t edge_ns;       /* last SYNC0 */
	int64_t copy_ns;
	uint16_t adc;
	uint8_t is_adc_on;
	uint8_t is_adc_unread;
	uint8_t is_adc_overrun;
	uint8_t is_edge_pending;
	uint8_t is_led_on;
	/* The flash keeps what it has without power. */
	uint8_t *slot[2]; /* PICCOLO_FLASH_OCTETS; NULL: never written */
	uint8_t running;  /* slot of the running image */
	uint8_t is_restart;
	int64_t erased_ns; /* end of the last erase */
};

static struct board *board_of(struct sim_device *dev)
{
	return (struct board *)dev;
}

static int64_t later(int64_t a, int64_t b)
{
	return a > b ? a : b;
}

static int64_t earlier(int64_t a, int64_t b)
{
	return a < b ? a : b;
}

/* --- the HAL --- */

static uint32_t us_of(int64_t t_ns)
{
	return (uint32_t)(t_ns / 1000);
}

static uint32_t hal_access(void *ctx, uint8_t *address, uint16_t address_len, const uint8_t *out,
			   uint8_t *in, uint16_t len)
{
	return us_of(
		pdi_spi_access(&((struct board *)ctx)->spi, address, address_len, out, in, len));
}

static int hal_eeprom_loaded(void *ctx)
{
	return esc_eeprom_loaded(((struct board *)ctx)->device.esc);
}

static void hal_adc_start(void *ctx)
{
	((struct board *)ctx)->is_adc_on = 1;
}

static uint16_t hal_adc_read(void *ctx)
{
	struct board *b = ctx;

	if (b->is_adc_unread) {
		pdi_spi_idle_until(&b->spi, b->edge_ns + FB1111_PICCOLO_CONVERSION_NS);
		b->is_adc_unread = 0;
	}
	return b->adc;
}

static int hal_adc_overrun(void *ctx)
{
	struct board *b = ctx;
	int was = b->is_adc_overrun;

	b->is_adc_overrun = 0;
	return was;
}

/* --- the HAL's flash --- */

static void hal_flash_erase(void *ctx)
{
	struct board *b = ctx;
	uint8_t **slot = &b->slot[!b->running];

	if (*slot == NULL) {
		*slot = malloc(PICCOLO_FLASH_OCTETS);
	}
	if (*slot != NULL) {
		memset(*slot, 0xff, PICCOLO_FLASH_OCTETS);
	}
	b->erased_ns = b->spi.now_ns + FB1111_PICCOLO_ERASE_NS;
}

static int hal_flash_is_busy(void *ctx)
{
	const struct board *b = ctx;

	return b->spi.now_ns < b->erased_ns;
}

static int hal_flash_write(void *ctx, uint32_t offset, const octet_t *data, uint16_t len)
{
	struct board *b = ctx;
	uint8_t *slot = b->slot[!b->running];

	if (slot == NULL || offset > PICCOLO_FLASH_OCTETS || len > PICCOLO_FLASH_OCTETS - offset) {
		return 1;
	}
	memcpy(slot + offset, data, len);
	return 0;
}

/* The image in slot 0 was programmed through JTAG: without a header. */
static int hal_flash_running(void *ctx, octet_t *ret_header)
{
	const struct board *b = ctx;

	if (b->slot[b->running] == NULL) {
		return 0;
	}
	memcpy(ret_header, b->slot[b->running], PICCOLO_IMAGE_HEADER_OCTETS);
	return 1;
}

static void hal_flash_start(void *ctx)
{
	struct board *b = ctx;

	b->running = !b->running;
	b->is_restart = 1;
}

static void hal_led(void *ctx, int on)
{
	((struct board *)ctx)->is_led_on = on != 0;
}

static uint32_t hal_time_us(void *ctx)
{
	return us_of(((struct board *)ctx)->spi.now_ns);
}

/*
 * Within one pass of the main loop no edge can come, since time on the segment stands still; an
 * edge while the CPU is busy is served at busy_until_ns. So the mask itself has nothing to do.
 */
static void hal_interrupts(void *ctx)
{
	(void)ctx;
}

static void start_firmware(struct board *b)
{
	const struct piccolo_hal hal = {
		.ctx = b,
		.spi_access = hal_access,
		.eeprom_loaded = hal_eeprom_loaded,
		.adc_start = hal_adc_start,
		.adc_read = hal_adc_read,
		.adc_overrun = hal_adc_overrun,
		.flash_erase = hal_flash_erase,
		.flash_is_busy = hal_flash_is_busy,
		.flash_write = hal_flash_write,
		.flash_running = hal_flash_running,
		.flash_start = hal_flash_start,
		.led = hal_led,
		.time_us = hal_time_us,
		.interrupts_off = hal_interrupts,
		.interrupts_on = hal_interrupts,
	};

	piccolo_init(&b->firmware, &hal);
}

/* --- on the segment's time --- */

static void power_on(struct sim_device *dev, int64_t t_ns)
{
	struct board *b = board_of(dev);

	b->busy_until_ns = b->step_ns = t_ns;
	b->edge_ns = b->copy_ns = 0;
	b->adc = 0;
	b->is_adc_on = b->is_adc_unread = b->is_adc_overrun = b->is_edge_pending = 0;
	b->is_restart = 0;
	b->erased_ns = 0;
	pdi_spi_init(&b->spi, dev->esc, t_ns);
	start_firmware(b);
}

static void run_interrupt(struct board *b, int64_t t_ns)
{
	uint32_t before = b->firmware.sync0.edges;

	b->is_edge_pending = 0;
	pdi_spi_idle_until(&b->spi, t_ns + FB1111_PICCOLO_INTERRUPT_NS);
	piccolo_sync0_isr(&b->firmware);
	b->busy_until_ns = b->spi.now_ns;
	/* What the accesses brought back of AL events is looked at right after. */
	b->step_ns = earlier(b->step_ns, b->busy_until_ns);
	if (b->firmware.sync0.edges != before) {
		b->copy_ns = b->busy_until_ns - b->edge_ns;
	}
}

static void run_step(struct board *b, int64_t t_ns)
{
	int64_t wait_ns;

	pdi_spi_idle_until(&b->spi, t_ns);
	wait_ns = (int64_t)piccolo_step(&b->firmware) * 1000;
	b->busy_until_ns = b->spi.now_ns;
	b->step_ns = b->busy_until_ns + later(wait_ns, FB1111_PICCOLO_LOOP_NS);
	if (b->is_restart) {
		b->is_restart = 0;
		b->is_adc_on = 0;
		b->step_ns = b->busy_until_ns + FB1111_PICCOLO_RESTART_NS;
		start_firmware(b);
	}
}

static int64_t next_wake_ns(const struct sim_device *dev)
{
	const struct board *b = (const struct board *)dev;
	int64_t cpu_ns =
		b->is_edge_pending ? b->busy_until_ns : later(b->step_ns, b->busy_until_ns);

	return earlier(cpu_ns, pdi_spi_due_ns(&b->spi));
}

static void run(struct sim_device *dev, int64_t t_ns)
{
	struct board *b = board_of(dev);

	pdi_spi_settle(&b->spi, t_ns);
	if (b->busy_until_ns > t_ns) {
		return;
	}
	if (b->is_edge_pending) {
		run_interrupt(b, t_ns);
	} else if (b->step_ns <= t_ns) {
		run_step(b, t_ns);
	}
}

static void sync0(struct sim_device *dev, int64_t t_ns, uint64_t system_time_ns)
{
	struct board *b = board_of(dev);

	(void)system_time_ns; /* a pin has no time: the firmware must find it out */
	b->edge_ns = t_ns;
	if (b->is_adc_on) {
		b->is_adc_overrun |= b->is_adc_unread;
		b->is_adc_unread = 1;
		b->adc = dev->signal != NULL ? signal_adc(dev->signal, t_ns) : 0;
	}
	b->is_edge_pending = 1;
	if (b->busy_until_ns <= t_ns) {
		pdi_spi_settle(&b->spi, t_ns);
		run_interrupt(b, t_ns);
	}
}

static void destroy(struct sim_device *dev)
{
	free(board_of(dev)->slot[0]);
	free(board_of(dev)->slot[1]);
	free(dev);
}

static void io_get(const struct sim_device *dev, char *ret_text, size_t text_bytes)
{
	snprintf(ret_text, text_bytes, "led=%d", fb1111_piccolo_led(dev));
}

int fb1111_piccolo_slave(int position, struct segment_slave_spec *ret_spec)
{
	static const struct sim_device_ops ops = {
		.power_on = power_on,
		.next_wake_ns = next_wake_ns,
		.run = run,
		.sync0 = sync0,
		.io_get = io_get,
		.destroy = destroy,
	};
	struct board *b = calloc(1, sizeof(*b));

	if (b == NULL) {
		return -ENOMEM;
	}
	b->device.ops = &ops;
	*ret_spec = (struct segment_slave_spec){
		.features = &esc_et1100,
		.sii = b->sii,
		.sii_bytes = fb1111_piccolo_sii(b->sii, sizeof(b->sii)),
		.device = &b->device,
		.signal = signal_default(),
		.parent = position - 1,
		.parent_port = 1,
		.wire_ns = WIRE_NS,
		.processing_ns = PROCESSING_NS,
		.forwarding_ns = PROCESSING_NS,
	};
	return 0;
}

int fb1111_piccolo_led(const struct sim_device *dev)
{
	return ((const struct board *)dev)->is_led_on;
}

int64_t fb1111_piccolo_copy_ns(const struct sim_device *dev)
{
	return ((const struct board *)dev)->copy_ns;
}

void fb1111_piccolo_stall(struct sim_device *dev, int64_t t_ns, int64_t span_ns)
{
	struct board *b = board_of(dev);

	b->busy_until_ns = later(b->busy_until_ns, t_ns + span_ns);
	pdi_spi_idle_until(&b->spi, b->busy_until_ns);
}
