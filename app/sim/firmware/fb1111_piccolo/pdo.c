/* SPDX-License-Identifier: MIT */
#include "pdo.h"

#include "al.h"
#include "esc_register.h"
#include "spi.h"
#include "sync0.h"

enum { OUTPUT_LED_BIT = 0x01, WATCHDOG_NOT_EXPIRED = 0x01 };

void piccolo_pdo_reset(struct piccolo *p)
{
	p->inputs = (struct piccolo_inputs){ 0, 0, 0 };
	p->sync0.overrun = 0;
	p->has_outputs = 0;
	piccolo_pdo_outputs_safe(p);
}

void piccolo_pdo_start(struct piccolo *p)
{
	octet_t data[PICCOLO_OUTPUT_OCTETS];

	/* The data in SM2 is from an earlier run; reading it clears its event. */
	piccolo_esc_read(p, piccolo_description.sm[PICCOLO_SM_OUTPUTS].start, data,
			 PICCOLO_OUTPUT_OCTETS);
	p->al_event = (uint16_t)(p->al_event & ~(unsigned)AL_EVENT_SM2);
	p->has_outputs = 0;
	p->refreshed_us = p->hal.time_us(p->hal.ctx);
	p->hal.interrupts_off(p->hal.ctx);
	piccolo_pdo_write_inputs(p);
	p->hal.interrupts_on(p->hal.ctx);
}

void piccolo_pdo_outputs_safe(struct piccolo *p)
{
	p->outputs = (struct piccolo_outputs){ 0, 0 };
	p->hal.led(p->hal.ctx, 0);
	piccolo_sync0_disarm(p);
}

octet_t piccolo_pdo_status(const struct piccolo *p)
{
	unsigned status = 0;

	status |= p->mode == PICCOLO_ONESHOT ? (unsigned)PICCOLO_STATUS_ONESHOT : 0u;
	status |= p->sync0.armed ? (unsigned)PICCOLO_STATUS_ARMED : 0u;
	status |= p->sync0.overrun ? (unsigned)PICCOLO_STATUS_OVERRUN : 0u;
	return OCTET(status);
}

void piccolo_pdo_write_inputs(struct piccolo *p)
{
	octet_t data[PICCOLO_INPUT_OCTETS];

	octets_put16(data + INPUT_ADC, p->inputs.adc);
	octets_put16(data + INPUT_COUNTER, p->inputs.counter);
	octets_put64(data + INPUT_SAMPLE_TIME, p->inputs.sample_time_ns);
	data[INPUT_STATUS] = piccolo_pdo_status(p);
	piccolo_spi_write(p, piccolo_description.sm[PICCOLO_SM_INPUTS].start, data,
			  PICCOLO_INPUT_OCTETS);
}

static void take_outputs(struct piccolo *p)
{
	octet_t data[PICCOLO_OUTPUT_OCTETS];

	piccolo_esc_read(p, piccolo_description.sm[PICCOLO_SM_OUTPUTS].start, data,
			 PICCOLO_OUTPUT_OCTETS);
	p->al_event = (uint16_t)(p->al_event & ~(unsigned)AL_EVENT_SM2);
	p->has_outputs = 1;
	if (p->al.state != PICCOLO_OP) {
		return; /* SAFEOP: outputs stay safe */
	}
	p->outputs.led = OCTET(data[OUTPUT_LED] & OUTPUT_LED_BIT);
	p->outputs.oneshot_time_ns = octets_get64(data + OUTPUT_ONESHOT_TIME);
	p->hal.led(p->hal.ctx, p->outputs.led);
	if (p->mode == PICCOLO_ONESHOT) {
		piccolo_sync0_oneshot(p, p->outputs.oneshot_time_ns);
	}
}

static int is_watchdog_expired(struct piccolo *p)
{
	return p->is_watchdog_used &&
	       (piccolo_esc_read8(p, REG_WATCHDOG_STATUS_PD) & WATCHDOG_NOT_EXPIRED) == 0;
}

void piccolo_pdo_refresh(struct piccolo *p)
{
	if (p->al.state == PICCOLO_OP && is_watchdog_expired(p)) {
		piccolo_al_fail(p, PICCOLO_SAFEOP, AL_SM_WATCHDOG);
		return;
	}
	if (p->al_event & AL_EVENT_SM2) {
		take_outputs(p);
	}
	if (p->mode == PICCOLO_ONESHOT) {
		p->hal.interrupts_off(p->hal.ctx);
		piccolo_pdo_write_inputs(p);
		p->hal.interrupts_on(p->hal.ctx);
	}
}
