/* SPDX-License-Identifier: MIT */
/*
 * A cyclic loop on SOEM as it is, with its own driver of the NIC: SYNC0 in all slaves, deadlines
 * that follow the reference clock as in SOEM's own example red_test.c. Built by peers.py.
 */
#include <string.h>
#include <unistd.h>

#include "ethercat.h"
#include "loop.h"

enum { IMAGE_BYTES = 65536, SAFEOP_US = 10000000, OP_CYCLES = 10000 };

static struct {
	ecx_portt port;
	ec_slavet slaves[EC_MAXSLAVE];
	int slave_count;
	ec_groupt groups[EC_MAXGROUP];
	uint8 esi_buffer[EC_MAXEEPBUF];
	uint32 esi_map[EC_MAXEEPBITMAP];
	ec_eringt errors;
	ec_idxstackT stack;
	boolean has_error;
	int64 dc_time;
	ec_SMcommtypet comm_type[EC_MAX_MAPT];
	ec_PDOassignt assign[EC_MAX_MAPT];
	ec_PDOdesct desc[EC_MAX_MAPT];
	ec_eepromSMt sm;
	ec_eepromFMMUt fmmu;
	uint8 image[IMAGE_BYTES];
	int wkc_expected;
	int limit_us;
	int64_t period_ns;
	int64_t integral;
} bus;

static ecx_contextt context = {
	.port = &bus.port,
	.slavelist = bus.slaves,
	.slavecount = &bus.slave_count,
	.maxslave = EC_MAXSLAVE,
	.grouplist = bus.groups,
	.maxgroup = EC_MAXGROUP,
	.esibuf = bus.esi_buffer,
	.esimap = bus.esi_map,
	.elist = &bus.errors,
	.idxstack = &bus.stack,
	.ecaterror = &bus.has_error,
	.DCtime = &bus.dc_time,
	.SMcommtype = bus.comm_type,
	.PDOassign = bus.assign,
	.PDOdesc = bus.desc,
	.eepSM = &bus.sm,
	.eepFMMU = &bus.fmmu,
};

static int exchange(void *ctx)
{
	(void)ctx;
	ecx_send_processdata(&context);
	return ecx_receive_processdata(&context, bus.limit_us) == bus.wkc_expected;
}

/* red_test.c, ec_sync(): half a period after SYNC0. */
static int64_t correction_ns(void *ctx)
{
	int64_t delta = (bus.dc_time - bus.period_ns / 2) % bus.period_ns;

	(void)ctx;
	if (delta > bus.period_ns / 2) {
		delta -= bus.period_ns;
	}
	bus.integral += (delta > 0) - (delta < 0);
	return -(delta / 100) - bus.integral / 20;
}

static int fail(const char *what)
{
	fprintf(stderr, "soem: %s\n", what);
	return 1;
}

static void request(uint16 state)
{
	bus.slaves[0].state = state;
	ecx_writestate(&context, 0);
}

/* Cycles until all slaves are in OP; which they reach only while data are exchanged. */
static int wait_for_op(void)
{
	int64_t deadline_ns = loop_now_ns() + bus.period_ns;

	for (int i = 0; i < OP_CYCLES; i++) {
		loop_sleep_until(deadline_ns);
		(void)exchange(NULL);
		deadline_ns += bus.period_ns + correction_ns(NULL);
		if (i == 10) {
			request(EC_STATE_OPERATIONAL);
		}
		if (i > 10 && i % 10 == 0 && ecx_readstate(&context) == EC_STATE_OPERATIONAL) {
			return 1;
		}
	}
	return 0;
}

static int bring_up(const struct loop_options *opt)
{
	if (ecx_init(&context, opt->nic) <= 0) {
		return fail("no such network interface, or no right to open it");
	}
	if (ecx_config_init(&context, FALSE) <= 0) {
		return fail("no slaves");
	}
	ecx_configdc(&context);
	/* SAFE-OP is requested below, when SYNC0 is set up: a Piccolo refuses it without. */
	context.manualstatechange = 1;
	if (ecx_config_map_group(&context, bus.image, 0) > IMAGE_BYTES) {
		return fail("process image too large");
	}
	for (int i = 1; i <= bus.slave_count; i++) {
		if (bus.slaves[i].hasdc) {
			ecx_dcsync0(&context, (uint16)i, TRUE, (uint32)opt->period_ns, 0);
		}
	}
	request(EC_STATE_SAFE_OP);
	if (ecx_statecheck(&context, 0, EC_STATE_SAFE_OP, SAFEOP_US) != EC_STATE_SAFE_OP) {
		return fail("a slave did not reach SAFE-OP");
	}
	bus.wkc_expected = bus.groups[0].outputsWKC * 2 + bus.groups[0].inputsWKC;
	return wait_for_op() ? 0 : fail("a slave did not reach OP");
}

int main(int argc, char **argv)
{
	struct loop_options opt = loop_read_options(argc, argv);
	struct loop loop = { .exchange = exchange, .correction_ns = correction_ns };

	bus.period_ns = opt.period_ns;
	bus.limit_us = (int)(opt.limit_ns / 1000);
	if (bring_up(&opt) != 0) {
		return 1;
	}
	printf("slaves %d\n", bus.slave_count);
	loop_run(&opt, &loop);
	request(EC_STATE_INIT);
	ecx_close(&context);
	return 0;
}
