/* SPDX-License-Identifier: MIT */
/*
 * FoE, SoE, EoE, AoE and VoE with a mailbox that answers late, twice, wrongly or not at all: how a
 * request ends, in which time, and that the next ones work. CoE has its own (coe.c).
 */
#include <errno.h>

#include "base/bytes.h"
#include "harness/test.h"
#include "sim/protocols/bench.h"
#include "wire/foe.h"

enum {
	TIMEOUT_MS = 200,
	FILE_BYTES = 9000,
	TABLE = 0x8001, /* P-0-0001 */
	TABLE_BYTES = 1204,
	ECHO_BYTES = 40,
};

enum protocol { FOE_IN, FOE_OUT, SOE_IN, SOE_OUT, EOE_IP, AOE_IN, AOE_OUT, VOE_ECHO, PROTOCOLS };

static const char *const names[PROTOCOLS] = {
	"FoE read",   "FoE write", "SoE read",  "SoE write",
	"EoE get IP", "AoE read",  "AoE write", "VoE",
};
static const char *const drives[] = { "all", "all", NULL };

static uint8_t buffer[FILE_BYTES];

static struct mailbox_request make(enum protocol protocol)
{
	struct mailbox_request rq = { .buffer = buffer, .timeout = { TIMEOUT_MS * NS_PER_MS } };

	switch (protocol) {
	case FOE_IN:
	case FOE_OUT:
		rq = bench_foe(protocol == FOE_IN ? FOE_READ : FOE_WRITE, "a.bin", buffer,
			       FILE_BYTES);
		rq.timeout = (span_t){ TIMEOUT_MS * NS_PER_MS };
		break;
	case SOE_IN:
	case SOE_OUT:
		rq.protocol = &soe_protocol;
		rq.capacity = TABLE_BYTES;
		rq.with.soe = (struct soe_parameters){ .operation = protocol == SOE_IN ? SOE_READ
										       : SOE_WRITE,
						       .elements = SOE_ELEMENT_VALUE,
						       .idn = TABLE };
		break;
	case EOE_IP:
		rq.protocol = &eoe_protocol;
		rq.with.eoe.operation = EOE_GET_IP;
		break;
	case AOE_IN:
	case AOE_OUT:
		rq.protocol = &aoe_protocol;
		rq.capacity = 4;
		rq.with.aoe = (struct aoe_parameters){ .command = protocol == AOE_IN ? AOE_READ
										     : AOE_WRITE,
						       .group = AOE_GROUP_SDO,
						       .offset = aoe_sdo_offset(0x607a, 0) };
		break;
	case VOE_ECHO:
	case PROTOCOLS:
		rq.protocol = &voe_protocol;
		rq.capacity = ECHO_BYTES;
		rq.with.voe = (struct voe_parameters){ .vendor = 0x6a, .len = ECHO_BYTES };
		break;
	}
	return rq;
}

static void fill(uint8_t seed)
{
	for (unsigned i = 0; i < FILE_BYTES; i++) {
		buffer[i] = (uint8_t)(i * 29 + i / 253 + seed);
	}
	/* What the table of the drive begins with: its length, and the most it can have. */
	put_le16(buffer, TABLE_BYTES - 4);
	put_le16(buffer + 2, TABLE_BYTES - 4);
}

static size_t length_of(enum protocol protocol)
{
	static const size_t len[PROTOCOLS] = { [FOE_IN] = FILE_BYTES,
					       [FOE_OUT] = FILE_BYTES,
					       [SOE_IN] = TABLE_BYTES,
					       [SOE_OUT] = TABLE_BYTES,
					       [AOE_IN] = 4,
					       [AOE_OUT] = 4,
					       [VOE_ECHO] = ECHO_BYTES,
					       [EOE_IP] = 0 };

	return len[protocol];
}

/* What was written by a request of the pair comes back by the other one. */
static void check_works(struct protocol_bench *b, unsigned pos, enum protocol protocol,
			uint8_t seed)
{
	static const enum protocol writer[PROTOCOLS] = {
		[FOE_IN] = FOE_OUT, [FOE_OUT] = FOE_OUT, [SOE_IN] = SOE_OUT, [SOE_OUT] = SOE_OUT,
		[AOE_IN] = AOE_OUT, [AOE_OUT] = AOE_OUT, [EOE_IP] = EOE_IP,  [VOE_ECHO] = VOE_ECHO
	};
	enum protocol out = writer[protocol];
	static uint8_t expected[FILE_BYTES];
	struct mailbox_request rq;

	fill(seed);
	memcpy(expected, buffer, FILE_BYTES);
	rq = make(out);
	CHECK_EQ(bench_do(b, pos, &rq), 0);
	CHECK_EQ(rq.len, length_of(out));
	if (out == EOE_IP || out == VOE_ECHO) {
		CHECK_MEM(buffer, expected, length_of(out));
		return;
	}
	memset(buffer, 0, FILE_BYTES);
	rq = make(out - 1);
	CHECK_EQ(bench_do(b, pos, &rq), 0);
	CHECK_EQ(rq.len, length_of(out));
	CHECK_MEM(buffer, expected, rq.len);
}

static void fault(struct protocol_bench *b, const char *line)
{
	char error[128];

	fault_plan_restart(b->faults, bench_now_ns(b));
	if (fault_plan_add(b->faults, line, 2, error, sizeof(error)) < 0) {
		test_fail(__FILE__, __LINE__, "%s", error);
	}
	/* a fault that happens once happens with the next frame */
	line_sleep(b->line, (span_t){ NS_PER_MS });
}

/* The results of all protocols; PROTOCOLS of them. */
static void check_all(const char *line, const int *results)
{
	struct protocol_bench b;

	bench_begin(&b, drives);
	bench_to_preop(&b, 0);
	bench_to_preop(&b, 1);
	for (enum protocol p = 0; p < PROTOCOLS; p++) {
		struct mailbox_request rq = make(p);
		int64_t start_ns;
		int r;

		check_works(&b, 0, p, 1);
		fault(&b, line);
		start_ns = bench_now_ns(&b);
		r = bench_do(&b, 0, &rq);
		if (r != results[p]) {
			test_fail(__FILE__, __LINE__, "%s, %s: %d, not %d", line, names[p], r,
				  results[p]);
		}
		CHECK(r < 0 || rq.len == length_of(p));
		CHECK(bench_now_ns(&b) - start_ns < 3 * TIMEOUT_MS * NS_PER_MS);
		/* the next transfer is not touched by it, nor is the other slave */
		line_sleep(b.line, (span_t){ 400 * NS_PER_MS });
		fault(&b, "at=0s mailbox kind=late by=0s slave=0");
		check_works(&b, 1, p, 2);
		check_works(&b, 0, p, 3);
	}
	bench_end(&b);
}

#define ALL(r) { r, r, r, r, r, r, r, r }

TEST(stubborn_mailbox, late_answer_within_the_timeout_is_taken)
{
	check_all("at=0s mailbox kind=late by=150ms slave=0", (const int[])ALL(0));
}

TEST(stubborn_mailbox, late_answer_after_the_timeout_is_no_answer_of_the_next_request)
{
	check_all("at=0s mailbox kind=late by=300ms slave=0", (const int[])ALL(-ETIMEDOUT));
}

TEST(stubborn_mailbox, doubled_answers_are_dropped)
{
	check_all("at=0s mailbox kind=double count=20 slave=0", (const int[])ALL(0));
}

TEST(stubborn_mailbox, wrong_counters_fail_nothing)
{
	check_all("at=0s mailbox kind=counter count=20 slave=0", (const int[])ALL(0));
}

TEST(stubborn_mailbox, length_beyond_the_mailbox_is_a_protocol_error)
{
	check_all("at=0s mailbox kind=length slave=0", (const int[])ALL(-EPROTO));
}

TEST(stubborn_mailbox, missing_answer_is_a_timeout)
{
	int results[PROTOCOLS] = ALL(-ETIMEDOUT);

	results[SOE_IN] = -EPROTO; /* the fragments behind the missing one do come */
	check_all("at=0s mailbox kind=silent slave=0", results);
}

TEST(stubborn_mailbox, eoe_fragments_before_answers_fail_nothing)
{
	check_all("at=0s mailbox kind=eoe count=20 slave=0", (const int[])ALL(0));
}

TEST(stubborn_mailbox, sdo_aborts_are_of_coe_only)
{
	check_all("at=0s mailbox kind=abort slave=0", (const int[])ALL(0));
}

TEST(stubborn_mailbox, slave_that_reads_no_request_is_a_timeout)
{
	check_all("at=0s mailbox kind=busy count=600 slave=0", (const int[])ALL(-ETIMEDOUT));
}
