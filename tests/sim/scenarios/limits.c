/* SPDX-License-Identifier: MIT */
/*
 * The master at its limits, all at once: LIMIT_SLAVES slaves of 8 bytes of outputs (8 channels) and
 * 56 bytes of inputs (7 channels) are LIMIT_OUTPUTS outputs and LIMIT_IMAGE_BYTES of process data.
 */
#include <errno.h>

#include "base/limits.h"
#include "base/ring.h"
#include "base/slave_set.h"
#include "devices/slave_model.h"
#include "harness/test.h"
#include "sim/harness/virtual_master.h"
#include "wire/datagram.h"

enum {
	OUTPUTS_EACH = LIMIT_OUTPUTS / LIMIT_SLAVES,
	OUTPUTS_ADDRESS = 0x1100, /* in the slave's memory */
	LOST = 300,
	CYCLES = 20,
	FRAME_HEADERS = ECAT_ETHERNET_BYTES + ECAT_FRAME_HEADER_BYTES,
	DATAGRAM_OVERHEAD = ECAT_DATAGRAM_HEADER_BYTES + ECAT_WKC_BYTES,
	AL_BYTES = 6, /* AL status and AL status code */
};

static struct virtual_bench b;
static struct virtual_master vm;

static const char *const one_datagram[] = { "cycle.period=10ms", "ring.depth=10s",
					    "bus.scan_timeout=60s", NULL };
static const char *const per_slave[] = { "cycle.period=10ms", "bus.datagrams=per_slave",
					 "ring.depth=10s", "bus.scan_timeout=60s", NULL };

static const char slave_text[] = "name \"Wide terminal\"\n"
				 "identity 0x2 0x7001 1\n"
				 "esc et1100\n"
				 "ports ebus ebus none none\n"
				 "config 0x0104 0 0 0 0 0 0\n"
				 "fmmu outputs inputs\n"
				 "sm 0x1100 8 0x24 1 outputs\n"
				 "sm 0x1400 56 0x20 1 inputs\n"
				 "txpdo 0x1a00 1 \"Inputs\"\n"
				 "repeat 7\n"
				 "entry 0x6000:0+1 ulint \"In%\"\n"
				 "end\n"
				 "rxpdo 0x1600 0 \"Outputs\"\n"
				 "repeat 8\n"
				 "entry 0x7000:0+1 usint \"Out%\"\n"
				 "end\n";

static struct slave_model model;
static uint8_t sii[MODEL_SII_BYTES];
static size_t sii_bytes;

/* A chip alone: it has the AL states itself (device emulation), and its inputs are zeros. */
static int make(int position, struct segment_slave_spec *ret_spec)
{
	*ret_spec = (struct segment_slave_spec){
		.features = &model.features,
		.sii = sii,
		.sii_bytes = sii_bytes,
		.parent = position - 1,
		.parent_port = 1,
		.wire_ns = 5,
		.processing_ns = 150,
		.forwarding_ns = 140,
	};
	return 0;
}

static void begin(unsigned slaves, const char *text, const char *const *settings)
{
	char error[128];

	if (slave_model_parse("wide", text, &model, error, sizeof(error)) < 0) {
		test_fail(__FILE__, __LINE__, "%s", error);
	}
	sii_bytes = slave_model_sii(&model, sii);
	virtual_bench_init(&b, &(struct virtual_spec){ .slaves = slaves, .make = make, .seed = 7 });
	virtual_master_init(&vm, &b, settings);
}

static const struct sample_meta *meta_of_ring(void)
{
	size_t bytes;

	return ring_meta(vm.samples, &bytes);
}

static void exchange_all(void)
{
	const struct sample_meta *meta = meta_of_ring();

	CHECK_EQ(meta->slave_count, LIMIT_SLAVES);
	CHECK_EQ(meta->image_bytes, LIMIT_IMAGE_BYTES);
	CHECK_EQ(meta->output_bytes, LIMIT_OUTPUTS);
	CHECK_EQ(virtual_master_run(&vm, CYCLES), SESSION_GOES_ON);
	CHECK_EQ(vm.result.op, CYCLES);
	CHECK_EQ(vm.result.bad, 0);
	CHECK_EQ(vm.result.gaps, 0);
}

/* The value that the test sets the n-th output to. */
static uint8_t wanted(unsigned n)
{
	return (uint8_t)(n * 7 + n / 256 + 1);
}

static void set_all_outputs(void)
{
	const struct channel *channels = sample_meta_channels(meta_of_ring());
	struct admin_request rq = { .magic = ADMIN_MAGIC, .verb = ADMIN_SET };
	unsigned n = 0;

	for (uint32_t i = 0; i < meta_of_ring()->channel_count; i++) {
		if (channels[i].direction != CHANNEL_OUTPUT) {
			continue;
		}
		memcpy(rq.item[rq.count].channel, channels[i].name, LIMIT_NAME_BYTES);
		rq.item[rq.count++].raw = wanted(n++);
		if (rq.count == ADMIN_ITEMS) {
			struct admin_reply reply = virtual_master_ask(&vm, &rq);

			if (reply.result < 0) {
				test_fail(__FILE__, __LINE__, "output %u: %s", n, reply.text);
			}
			rq.count = 0;
		}
	}
	CHECK_EQ(n, LIMIT_OUTPUTS);
}

static void find_all_outputs_in_the_slaves(void)
{
	for (unsigned slave = 0; slave < LIMIT_SLAVES; slave++) {
		uint8_t memory[OUTPUTS_EACH];

		esc_pdi_read(segment_esc(b.segment, slave), virtual_bench_now_ns(&b),
			     OUTPUTS_ADDRESS, memory, sizeof(memory));
		for (unsigned i = 0; i < OUTPUTS_EACH; i++) {
			CHECK_EQ(memory[i], wanted(slave * OUTPUTS_EACH + i));
		}
	}
}

static unsigned frames_of(unsigned accesses, unsigned bytes)
{
	unsigned fit = (ECAT_FRAME_MAX_BYTES - FRAME_HEADERS) / (DATAGRAM_OVERHEAD + bytes);

	return (accesses + fit - 1) / fit;
}

/*
 * How many cycles after its loss a slave is reported as lost, at the latest. The frame that shows
 * it asks for a poll in the next pass of the service loop; the slave is lost when it has not
 * answered in two polls. Each frame of a poll takes a cycle: the AL status of all; the positions,
 * whose number has changed, in the first poll only; the error counters of some.
 */
static unsigned cycles_to_lost(unsigned slaves)
{
	unsigned states = frames_of(slaves + 1, AL_BYTES);
	unsigned positions = frames_of(2 * slaves + 1, 2);

	return 1 + VIRTUAL_SERVICE_CYCLES + states + positions + 1 + VIRTUAL_SERVICE_CYCLES +
	       states + 1;
}

static const struct status_page *page(void)
{
	return session_page(vm.session);
}

static unsigned count_lost(void)
{
	unsigned count = 0;

	for (unsigned i = 0; i < LIMIT_SLAVES; i++) {
		count += atomic_load(&page()->slave[i].is_lost);
	}
	return count;
}

/* It is bad at once, and the only one. */
static void check_bad(void)
{
	const struct slave_set *bad = &virtual_master_sample(&vm)->slaves_bad;

	CHECK_EQ(slave_set_count(bad), 1);
	CHECK_EQ(slave_set_next(bad, 0), LOST);
}

static void lose_one_slave(unsigned slaves)
{
	uint64_t from = atomic_load(&page()->cycle.cycles);
	uint64_t took;

	virtual_bench_fault(&b, "at=0s unplug slave=300");
	CHECK_EQ(virtual_master_run(&vm, 2), SESSION_GOES_ON);
	check_bad();
	while (count_lost() == 0 && atomic_load(&page()->cycle.cycles) < from + 10 * CYCLES) {
		CHECK_EQ(virtual_master_run(&vm, 1), SESSION_GOES_ON);
	}
	took = atomic_load(&page()->cycle.cycles) - from;
	CHECK_EQ(count_lost(), 1);
	CHECK_EQ(atomic_load(&page()->slave[LOST].is_lost), 1);
	check_bad();
	printf("slave %d of %u is reported as lost after %llu cycles, at most %u\n", LOST, slaves,
	       (unsigned long long)took, cycles_to_lost(slaves));
	CHECK(took <= cycles_to_lost(slaves));
}

TEST(limits, the_greatest_bus_is_exchanged_and_all_its_outputs_arrive)
{
	begin(LIMIT_SLAVES, slave_text, one_datagram);
	virtual_master_settle(&vm);
	printf("%d slaves: OP after %.1f s of bus time\n", LIMIT_SLAVES, (double)vm.op_ns * 1e-9);
	exchange_all();
	set_all_outputs();
	CHECK_EQ(virtual_master_run(&vm, 2), SESSION_GOES_ON);
	find_all_outputs_in_the_slaves();
	virtual_master_close(&vm);
}

/* Not all LIMIT_SLAVES: each of two datagrams a slave passes each slave of the simulation. */
TEST(limits, a_lost_slave_beyond_the_first_words_is_bad_at_once_and_lost_after_two_polls)
{
	enum { SLAVES = LOST + 10 };

	for (unsigned phase = 0; phase < VIRTUAL_SERVICE_CYCLES; phase += 6) {
		begin(SLAVES, slave_text, per_slave);
		CHECK_EQ(virtual_master_bring_up(&vm), 0);
		printf("%u slaves: OP after %.1f s of bus time\n", SLAVES, (double)vm.op_ns * 1e-9);
		CHECK_EQ(virtual_master_run(&vm, CYCLES + phase), SESSION_GOES_ON);
		CHECK(slave_set_is_empty(&virtual_master_sample(&vm)->slaves_bad));
		lose_one_slave(SLAVES);
		virtual_master_close(&vm);
	}
}

TEST(limits, one_byte_more_of_process_data_is_refused)
{
	enum { SLAVES = 64, BYTES = LIMIT_IMAGE_BYTES / SLAVES };
	char text[512];

	snprintf(text, sizeof(text),
		 "name \"Wide\"\nidentity 2 3 1\nesc et1100\nports ebus ebus none none\n"
		 "config 0x0104 0 0 0 0 0 0\nfmmu inputs\nsm 0x1100 %d 0x20 1 inputs\n"
		 "txpdo 0x1a00 0 \"Inputs\"\nrepeat %d\nentry 0x6000:0+1 ulint \"In%%\"\nend\n",
		 BYTES, BYTES / 8);
	begin(SLAVES, text, one_datagram);
	CHECK_EQ(virtual_master_bring_up(&vm), 0);
	virtual_master_close(&vm);
	begin(SLAVES + 1, text, one_datagram);
	CHECK_EQ(virtual_master_bring_up(&vm), -E2BIG);
	if (strstr(vm.failure.text, "the process image exceeds LIMIT_IMAGE_BYTES (32768)") ==
	    NULL) {
		test_fail(__FILE__, __LINE__, "%s", vm.failure.text);
	}
	virtual_master_close(&vm);
}
