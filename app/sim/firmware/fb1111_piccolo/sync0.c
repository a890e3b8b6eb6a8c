/* SPDX-License-Identifier: MIT */
#include "sync0.h"

#include "esc_register.h"
#include "pdo.h"
#include "spi.h"

static uint64_t read_time(struct piccolo *p, uint16_t address)
{
	octet_t data[8];

	piccolo_spi_read(p, address, data, 8);
	return octets_get64(data);
}

static void write_activation(struct piccolo *p, unsigned value)
{
	octet_t data[1];

	data[0] = OCTET(value);
	piccolo_spi_write(p, REG_DC_ACTIVATION, data, 1);
}

static void discard_conversion(struct piccolo *p)
{
	(void)p->hal.adc_read(p->hal.ctx);
	(void)p->hal.adc_overrun(p->hal.ctx);
}

void piccolo_sync0_start(struct piccolo *p)
{
	p->hal.interrupts_off(p->hal.ctx);
	p->sync0.edges = 0;
	p->sync0.overrun = 0;
	p->sync0.last_ns = 0;
	p->sync0.oneshot_seen_ns = 0;
	p->sync0.last_us = p->hal.time_us(p->hal.ctx);
	discard_conversion(p); /* edges before SAFEOP were nobody's samples */
	p->sync0.enabled = 1;
	p->hal.interrupts_on(p->hal.ctx);
}

void piccolo_sync0_stop(struct piccolo *p)
{
	piccolo_sync0_disarm(p);
	p->hal.interrupts_off(p->hal.ctx);
	p->sync0.enabled = 0;
	p->hal.interrupts_on(p->hal.ctx);
}

void piccolo_sync0_disarm(struct piccolo *p)
{
	p->hal.interrupts_off(p->hal.ctx);
	if (p->sync0.armed) {
		write_activation(p, 0);
		p->sync0.armed = 0;
	}
	p->sync0.oneshot_seen_ns = 0;
	p->hal.interrupts_on(p->hal.ctx);
}

/*
 * Cycle time 0 makes the SYNC unit fire once. Activation comes last, so that the unit never
 * compares with half a start time.
 */
static void arm(struct piccolo *p, uint64_t at_ns)
{
	octet_t start[8], period[4];

	octets_put64(start, at_ns);
	octets_put32(period, 0);
	write_activation(p, 0); /* a shot that fired leaves the unit active */
	piccolo_spi_write(p, REG_DC_START_TIME, start, 8);
	piccolo_spi_write(p, REG_DC_SYNC0_CYCLE, period, 4);
	write_activation(p, ACTIVATION_CYCLIC_SYNC0);
	p->sync0.oneshot_ns = at_ns;
	p->sync0.armed = 1;
}

/* Interrupts are off, so that nothing comes between reading the clock and arming. */
static void arm_if_ahead(struct piccolo *p, uint64_t at_ns)
{
	uint64_t now_ns = read_time(p, REG_DC_SYSTEM_TIME);

	if (at_ns > now_ns && at_ns - now_ns >= PICCOLO_ONESHOT_LEAD_NS) {
		arm(p, at_ns);
	}
}

void piccolo_sync0_oneshot(struct piccolo *p, uint64_t at_ns)
{
	if (at_ns == p->sync0.oneshot_seen_ns) {
		return;
	}
	piccolo_sync0_disarm(p);
	p->sync0.oneshot_seen_ns = at_ns;
	if (at_ns == 0) {
		return;
	}
	p->hal.interrupts_off(p->hal.ctx);
	arm_if_ahead(p, at_ns);
	p->hal.interrupts_on(p->hal.ctx);
}

int piccolo_sync0_is_lost(struct piccolo *p)
{
	uint32_t limit_us = p->sync0.cycle_ns / 1000u * PICCOLO_SYNC_LOST_CYCLES;
	uint32_t quiet_us;

	if (p->mode == PICCOLO_ONESHOT) {
		return 0;
	}
	if (limit_us < PICCOLO_SYNC_LOST_MIN_US) {
		limit_us = PICCOLO_SYNC_LOST_MIN_US;
	}
	p->hal.interrupts_off(p->hal.ctx);
	quiet_us = p->hal.time_us(p->hal.ctx) - p->sync0.last_us;
	p->hal.interrupts_on(p->hal.ctx);
	return quiet_us > limit_us;
}

/*
 * The DC time of the edge, exact to the ns. Periodic: 0x0990 reads the time of the next SYNC0, one
 * cycle later. One-shot: the time that was armed; an edge that was pending from a withdrawn shot is
 * told apart by the clock. Returns 0 if the edge is nobody's.
 */
static int edge_time(struct piccolo *p, uint64_t *ret_ns)
{
	if (p->mode == PICCOLO_PERIODIC) {
		*ret_ns = read_time(p, REG_DC_START_TIME) - p->sync0.cycle_ns;
		return 1;
	}
	if (!p->sync0.armed || read_time(p, REG_DC_SYSTEM_TIME) < p->sync0.oneshot_ns) {
		return 0;
	}
	*ret_ns = p->sync0.oneshot_ns;
	return 1;
}

/* Edges lie whole cycles apart; more than one means that an edge found the interrupt still busy. */
static int is_overrun(const struct piccolo *p, uint64_t edge_ns)
{
	return p->mode == PICCOLO_PERIODIC && p->sync0.edges > 0 &&
	       edge_ns - p->sync0.last_ns > p->sync0.cycle_ns + p->sync0.cycle_ns / 2u;
}

void piccolo_sync0_isr(struct piccolo *p)
{
	uint64_t edge_ns;

	if (!p->sync0.enabled) {
		return;
	}
	if (!edge_time(p, &edge_ns)) {
		discard_conversion(p);
		return;
	}
	p->inputs.adc = p->hal.adc_read(p->hal.ctx);
	p->sync0.overrun = p->hal.adc_overrun(p->hal.ctx);
	p->sync0.overrun |= is_overrun(p, edge_ns);
	if (p->sync0.overrun && p->sync0.overruns < UINT16_MAX) {
		p->sync0.overruns++;
	}
	p->inputs.counter++;
	p->inputs.sample_time_ns = edge_ns;
	p->sync0.armed = 0;
	p->sync0.last_ns = edge_ns;
	p->sync0.last_us = p->hal.time_us(p->hal.ctx);
	p->sync0.edges++;
	piccolo_pdo_write_inputs(p);
}
