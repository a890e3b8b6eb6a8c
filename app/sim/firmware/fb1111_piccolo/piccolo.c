/* SPDX-License-Identifier: MIT */
#include "piccolo.h"

#include <string.h>

#include "al.h"
#include "esc_register.h"
#include "image.h"
#include "mailbox.h"
#include "objects.h"
#include "pdo.h"
#include "spi.h"
#include "sync0.h"

enum { START_RETRY_US = 1000 };

/* What 0x100A says: the version in the running image's header, or the one it was built with. */
static void read_version(struct piccolo *p)
{
	const char *built = piccolo_description.software_version;
	octet_t header[IMAGE_HEADER];
	unsigned i;

	if (!p->hal.flash_running(p->hal.ctx, header)) {
		for (i = 0; i < PICCOLO_VERSION_OCTETS && built[i] != '\0'; i++) {
			p->version[i] = built[i];
		}
		return;
	}
	for (i = 0; i < PICCOLO_VERSION_OCTETS; i++) {
		p->version[i] = (char)header[IMAGE_VERSION + i];
	}
}

static void reset(struct piccolo *p)
{
	struct piccolo_hal hal = p->hal;

	hal.interrupts_off(hal.ctx);
	memset(p, 0, sizeof(*p));
	p->hal = hal;
	p->al.state = PICCOLO_INIT;
	piccolo_settings_reset(p);
	read_version(p);
	hal.led(hal.ctx, 0);
	hal.interrupts_on(hal.ctx);
}

void piccolo_init(struct piccolo *p, const struct piccolo_hal *hal)
{
	p->hal = *hal;
	reset(p);
}

/* Until EEPROM_LOADED the ET1100 does not drive the bus: anything read would be noise. */
static int start(struct piccolo *p)
{
	if (piccolo_esc_read8(p, REG_PDI_CONTROL) != PDI_SPI_SLAVE) {
		return 0;
	}
	p->hal.adc_start(p->hal.ctx);
	piccolo_al_start(p);
	p->is_started = 1;
	return 1;
}

static uint32_t until(uint32_t now_us, uint32_t since_us, uint32_t period_us)
{
	uint32_t gone_us = now_us - since_us;

	return gone_us < period_us ? period_us - gone_us : 0;
}

static uint32_t least(uint32_t a, uint32_t b)
{
	return a < b ? a : b;
}

static uint32_t next_due_us(const struct piccolo *p)
{
	uint32_t now_us = p->hal.time_us(p->hal.ctx);
	uint32_t due_us = until(now_us, p->accessed_us, PICCOLO_EVENT_POLL_US);

	due_us = least(due_us, until(now_us, p->al.polled_us, PICCOLO_AL_POLL_US));
	if (p->al.state >= PICCOLO_SAFEOP) {
		due_us = least(due_us, until(now_us, p->refreshed_us, p->refresh_ms * 1000u));
	}
	return due_us;
}

static void poll_events(struct piccolo *p)
{
	if (p->hal.time_us(p->hal.ctx) - p->accessed_us >= PICCOLO_EVENT_POLL_US) {
		p->hal.interrupts_off(p->hal.ctx);
		piccolo_spi_poll(p);
		p->hal.interrupts_on(p->hal.ctx);
	}
}

static void refresh(struct piccolo *p)
{
	uint32_t now_us = p->hal.time_us(p->hal.ctx);

	if (p->al.state < PICCOLO_SAFEOP || now_us - p->refreshed_us < p->refresh_ms * 1000u) {
		return;
	}
	p->refreshed_us = now_us;
	piccolo_pdo_refresh(p);
	if (p->al.state == PICCOLO_OP && piccolo_sync0_is_lost(p)) {
		piccolo_al_fail(p, PICCOLO_SAFEOP, AL_SYNC_LOST);
	}
}

uint32_t piccolo_step(struct piccolo *p)
{
	int is_busy = 0;

	if (!p->hal.eeprom_loaded(p->hal.ctx)) {
		if (p->is_started) {
			reset(p); /* the ET1100 was reset under us */
		}
		return START_RETRY_US;
	}
	if (!p->is_started && !start(p)) {
		return START_RETRY_US;
	}
	poll_events(p);
	piccolo_al_step(p);
	refresh(p);
	if (p->al.state >= PICCOLO_PREOP) {
		is_busy = piccolo_mailbox_step(p);
	}
	return is_busy ? 0 : next_due_us(p);
}
