/* SPDX-License-Identifier: MIT */
/* Unsolicited mailbox messages of slaves, and aborted requests. */
#include <errno.h>

#include "base/bytes.h"
#include "harness/test.h"
#include "mailbox/mailbox.h"
#include "sim/bus/bus_bench.h"
#include "wire/datagram.h"
#include "wire/esc_reg.h"
#include "wire/sii.h"

enum {
	SM_IN = ESC_REG_SM + ESC_SM_BYTES,
	BOX_BYTES = 128,
	COE_EMERGENCY = 1,
	CODE = 0x5112,
	REGISTER = 0x21,
	POLL_MAX_CYCLES = 120, /* a slave without a request is polled at least so often */
};

static struct {
	unsigned count[EVENT_COUNT];
	struct event last[EVENT_COUNT];
} heard;

static void hear(void *ctx, const struct event *ev)
{
	(void)ctx;
	heard.count[ev->id]++;
	heard.last[ev->id] = *ev;
}

static struct bus_bench *start(unsigned piccolos, uint64_t seed)
{
	struct bus_bench *b =
		bench_create(&(struct bench_spec){ .piccolos = piccolos, .seed = seed });

	memset(&heard, 0, sizeof(heard));
	bus_listen(b->bus, hear, NULL);
	bench_bring_up(b);
	bench_run(b, 100);
	CHECK_EQ(heard.count[EVENT_SDO_ABORT], 0);
	return b;
}

/* The application of @slave puts an emergency into its mailbox. */
static void put_emergency(struct bus_bench *b, size_t slave)
{
	struct esc *esc = segment_esc(b->segment, slave);
	static uint8_t counter;
	uint8_t box[BOX_BYTES] = { [0] = 10 };
	uint8_t sm[4];

	counter = mailbox_counter_next(counter);
	box[5] = (uint8_t)(MAILBOX_TYPE_COE | counter << 4);
	put_le16(box + 6, COE_EMERGENCY << 12);
	put_le16(box + 8, CODE);
	box[10] = REGISTER;
	for (uint8_t i = 0; i < 5; i++) {
		box[11 + i] = (uint8_t)(0xa0 + i);
	}
	esc_pdi_read(esc, bench_now_ns(b), SM_IN, sm, sizeof(sm));
	CHECK_EQ(get_le16(sm + 2), sizeof(box));
	esc_pdi_write(esc, bench_now_ns(b), get_le16(sm), box, sizeof(box));
}

static void check_emergency(unsigned count, uint16_t slave)
{
	const struct event *ev = &heard.last[EVENT_EMERGENCY];
	char text[200];

	CHECK_EQ(heard.count[EVENT_EMERGENCY], count);
	CHECK_EQ(ev->slave_pos, slave);
	CHECK_EQ(ev->arg[0], CODE);
	CHECK_EQ(ev->arg[1], REGISTER);
	event_format(ev, text, sizeof(text));
	CHECK(strstr(text, "emergency 0x5112, error register 0x21, data a0 a1 a2 a3 a4") != NULL);
}

TEST(mailbox, unsolicited_emergency_becomes_an_event)
{
	struct bus_bench *b = start(3, 111);
	uint64_t bad = b->cycles - b->ok;

	for (unsigned i = 1; i <= 5; i++) {
		put_emergency(b, i % 3);
		bench_run(b, POLL_MAX_CYCLES);
		check_emergency(i, (uint16_t)(i % 3));
		CHECK_EQ(bench_watch(b).is_all_op, 1);
		bench_watch(b);
		CHECK_EQ(heard.count[EVENT_EMERGENCY], i);
	}
	CHECK_EQ(b->cycles - b->ok, bad);
	bench_destroy(b);
}

TEST(mailbox, emergency_before_an_answer_is_reported_and_the_answer_is_read)
{
	struct bus_bench *b = start(2, 112);
	uint8_t data[64];

	for (unsigned i = 1; i <= 5; i++) {
		uint32_t abort = 0;
		size_t len = sizeof(data);

		put_emergency(b, 1);
		CHECK_EQ(bus_sdo_read(b->bus, 1, 0x1008, 0, data, &len, &abort), 0);
		CHECK_EQ(len, strlen("FB1111-Piccolo"));
		check_emergency(i, 1);
	}
	CHECK_EQ(heard.count[EVENT_SDO_ABORT], 0);
	bench_destroy(b);
}

/* D3: whatever the time-out, the slave gets the download once. */
TEST(mailbox, late_answer_to_a_download_does_not_repeat_it)
{
	struct bus_bench *b = start(1, 114);
	uint8_t data[2] = { 7, 0 };
	unsigned before = bench_mailbox_writes(b);
	uint32_t abort = 0;
	size_t len = sizeof(data);

	b->cfg.bus_mailbox_timeout_ns = 700 * NS_PER_MS;
	bench_fault(b, "at=0s mailbox-stuck slave=0 for=1500ms");
	CHECK_EQ(bus_sdo_write(b->bus, 0, 0x8000, 2, data, sizeof(data), &abort), -ETIMEDOUT);
	CHECK_EQ(bench_mailbox_writes(b) - before, 1);
	bench_run(b, 2000);
	/* the abort that follows the time-out, once the slave reads again */
	CHECK_EQ(bench_mailbox_writes(b) - before, 2);
	CHECK_EQ(bus_sdo_read(b->bus, 0, 0x8000, 2, data, &len, &abort), 0);
	CHECK_EQ(get_le16(data), 7);
	CHECK_EQ(heard.count[EVENT_SDO_ABORT], 0);
	bench_destroy(b);
}

static void put_eoe_fragment(struct bus_bench *b, size_t slave)
{
	struct esc *esc = segment_esc(b->segment, slave);
	uint8_t box[BOX_BYTES] = { [0] = 36, [5] = 2 | 1 << 4 };
	uint8_t sm[4];

	esc_pdi_read(esc, bench_now_ns(b), SM_IN, sm, sizeof(sm));
	esc_pdi_write(esc, bench_now_ns(b), get_le16(sm), box, sizeof(box));
}

/* D25 */
TEST(mailbox, eoe_fragment_in_front_of_an_answer_does_not_fail_the_transfer)
{
	struct bus_bench *b = start(2, 115);
	uint8_t data[64];
	size_t len = sizeof(data);
	uint32_t abort = 0;

	put_eoe_fragment(b, 0);
	CHECK_EQ(bus_sdo_read(b->bus, 0, 0x1008, 0, data, &len, &abort), 0);
	CHECK_EQ(len, strlen("FB1111-Piccolo"));
	CHECK_EQ(mailbox_counters_of(bus_mailbox(b->bus), 0)->dropped, 1);
	bench_destroy(b);
}

TEST(mailbox, sdo_that_a_slave_aborts_is_an_event_with_object_and_code)
{
	struct bus_bench *b = start(2, 113);
	const struct event *ev = &heard.last[EVENT_SDO_ABORT];
	uint8_t data[8] = { 0 };
	uint32_t abort = 0;
	size_t len = sizeof(data);

	CHECK_EQ(bus_sdo_read(b->bus, 1, 0x5555, 3, data, &len, &abort), -EREMOTEIO);
	CHECK_EQ(heard.count[EVENT_SDO_ABORT], 1);
	CHECK_EQ(ev->slave_pos, 1);
	CHECK_EQ(ev->arg[0], 0x555503);
	CHECK_EQ(ev->value, 0x06020000);
	CHECK_EQ(bus_sdo_write(b->bus, 0, 0x1008, 0, data, 4, &abort), -EREMOTEIO);
	CHECK_EQ(heard.count[EVENT_SDO_ABORT], 2);
	CHECK_EQ(ev->slave_pos, 0);
	CHECK_EQ(ev->value, abort);
	bench_destroy(b);
}

/* --- T04 --- */

static uint8_t name_buffer[64];

static void begin_read(struct bus_bench *b, struct mailbox_request *rq)
{
	*rq = (struct mailbox_request){ .protocol = &coe_protocol,
					.slave_pos = 1,
					.with.coe = { .operation = COE_UPLOAD, .index = 0x1008 },
					.buffer = name_buffer,
					.capacity = sizeof(name_buffer) };
	CHECK_EQ(bus_mailbox_submit(b->bus, rq), 0);
}

static void check_name_is_read(struct bus_bench *b)
{
	size_t len = sizeof(name_buffer);
	uint32_t abort = 0;

	CHECK_EQ(bus_sdo_read(b->bus, 1, 0x1008, 0, name_buffer, &len, &abort), 0);
	CHECK_EQ(len, strlen("FB1111-Piccolo"));
}

/* A request is on its way for @cycles while the state changes; its answer comes all the same. */
static void change_with_sdo(struct bus_bench *b, enum al_state state, unsigned cycles)
{
	struct mailbox_request rq;

	begin_read(b, &rq);
	bench_run(b, cycles);
	CHECK_EQ(bus_request_state(b->bus, state, (span_t){ NS_PER_S }, b->error), 0);
	bench_run(b, 50);
	CHECK_EQ(rq.result, 0);
	CHECK_EQ(rq.len, strlen("FB1111-Piccolo"));
	check_name_is_read(b);
}

TEST(mailbox, sdo_is_answered_whatever_state_change_it_meets)
{
	enum { ROUNDS = 5 };
	struct bus_bench *b = start(2, 119);

	for (unsigned i = 0; i < ROUNDS; i++) {
		struct mailbox_request cut;

		change_with_sdo(b, AL_SAFEOP, i);
		change_with_sdo(b, AL_PREOP, i);
		change_with_sdo(b, AL_SAFEOP, i);
		change_with_sdo(b, AL_OP, i);
		begin_read(b, &cut);
		bench_run(b, i);
		bench_stop(b);
		bench_new_master(b); /* ends what still runs */
		CHECK(!mailbox_is_running(&cut));
		bench_bring_up(b);
		check_name_is_read(b);
	}
	bench_destroy(b);
}

TEST(mailbox, master_that_is_started_again_finds_full_mailboxes_and_reads_on)
{
	enum { CUTS = 12 };
	struct bus_bench *b = start(2, 120);

	for (unsigned i = 0; i < CUTS; i++) {
		struct mailbox_request cut;

		/* a mail that nobody fetches, and a request that was cut off somewhere */
		put_emergency(b, 0);
		begin_read(b, &cut);
		bench_run(b, i / 2);
		if (i % 2 == 1) {
			put_emergency(b, 1);
		}
		bench_new_master(b);
		CHECK(!mailbox_is_running(&cut));
		bench_bring_up(b);
		check_name_is_read(b);
	}
	bench_destroy(b);
}

/* --- a storm --- */

enum { STORM_SLAVES = 64, STORM_TRANSFERS = 10, STORM_CYCLES = 1500 };

struct storm {
	struct bus *bus;
	struct mailbox_request request[STORM_SLAVES];
	uint8_t data[STORM_SLAVES][64];
	unsigned left[STORM_SLAVES];
	unsigned good;
};

static void submit_one(struct storm *st, unsigned slave)
{
	struct mailbox_request *rq = &st->request[slave];

	rq->protocol = &coe_protocol;
	rq->buffer = st->data[slave];
	rq->capacity = sizeof(st->data[slave]);
	CHECK_EQ(bus_mailbox_submit(st->bus, rq), 0);
}

static void storm_done(void *ctx, struct mailbox_request *rq)
{
	struct storm *st = ctx;

	st->good += rq->result == 0 && rq->len == strlen("FB1111-Piccolo");
	if (--st->left[rq->slave_pos] > 0) {
		submit_one(st, rq->slave_pos);
	}
}

/* Phases of STORM_CYCLES cycles in OP; cycles until the storm is over into @ret_cycles. */
static void run_storm(int is_stormy, int64_t *ret_phase_ns, unsigned *ret_cycles)
{
	static struct storm st;
	struct bus_bench *b = start(STORM_SLAVES, 116);
	uint64_t bad = b->cycles - b->ok;

	memset(&st, 0, sizeof(st));
	st.bus = b->bus;
	for (unsigned i = 0; i < STORM_SLAVES && is_stormy; i++) {
		st.left[i] = STORM_TRANSFERS;
		st.request[i] = (struct mailbox_request){ .slave_pos = (uint16_t)i,
							  .with.coe = { .operation = COE_UPLOAD,
									.index = 0x1008 },
							  .done = storm_done,
							  .ctx = &st };
		submit_one(&st, i);
	}
	for (unsigned i = 0; i < STORM_CYCLES; i++) {
		bench_run(b, 1);
		ret_phase_ns[i] = b->phase_error_ns;
		if (st.good < STORM_SLAVES * STORM_TRANSFERS) {
			*ret_cycles = i + 1;
		}
	}
	CHECK_EQ(st.good, is_stormy ? STORM_SLAVES * STORM_TRANSFERS : 0);
	CHECK_EQ(b->cycles - b->ok, bad);
	bench_destroy(b);
}

/* T02, with all slaves at the same time. */
TEST(mailbox, sdo_storm_to_64_slaves_changes_no_cycle_s_phase)
{
	static int64_t stormy[STORM_CYCLES];
	static int64_t calm[STORM_CYCLES];
	unsigned cycles = 0;
	unsigned changed = 0;

	run_storm(0, calm, &cycles);
	run_storm(1, stormy, &cycles);
	for (unsigned i = 0; i < STORM_CYCLES; i++) {
		changed += stormy[i] != calm[i];
	}
	printf("%u SDO transfers to %u slaves at once: %u cycles of 1 ms, %.0f transfers/s; "
	       "%u cycles with another phase\n",
	       STORM_SLAVES * STORM_TRANSFERS, STORM_SLAVES, cycles,
	       STORM_SLAVES * STORM_TRANSFERS * 1000.0 / cycles, changed);
	CHECK_EQ(changed, 0);
}

TEST(mailbox, sdo_transfers_to_64_slaves_at_once_are_20_times_as_many_as_one_at_a_time)
{
	static int64_t phase[STORM_CYCLES];
	struct bus_bench *b = start(STORM_SLAVES, 117);
	uint64_t from = b->cycles;
	unsigned at_once = 0;
	double single;
	double all;

	for (uint16_t i = 0; i < STORM_SLAVES; i++) {
		uint8_t data[64];
		size_t len = sizeof(data);
		uint32_t abort;

		CHECK_EQ(bus_sdo_read(b->bus, i, 0x1008, 0, data, &len, &abort), 0);
	}
	single = STORM_SLAVES * 1000.0 / (double)(b->cycles - from);
	bench_destroy(b);
	run_storm(1, phase, &at_once);
	all = STORM_SLAVES * STORM_TRANSFERS * 1000.0 / at_once;
	printf("SDO transfers/s: %.0f one at a time, %.0f to 64 slaves at once: %.1f times\n",
	       single, all, all / single);
	CHECK(all >= 20 * single);
}

/* Bus time until the process data of so many boards are mapped. */
static double mapping_ms(unsigned slaves)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = slaves, .seed = 118 });
	int64_t from_ns;
	double ms;

	CHECK_EQ(bench_find(b), 0);
	from_ns = bench_now_ns(b);
	CHECK_EQ(bus_map(b->bus, b->error), 0);
	ms = (double)(bench_now_ns(b) - from_ns) / NS_PER_MS;
	bench_destroy(b);
	return ms;
}

TEST(mailbox, the_mapping_of_64_slaves_takes_less_than_five_times_that_of_one)
{
	double one_ms = mapping_ms(1);
	double all_ms = mapping_ms(STORM_SLAVES);

	printf("mapping: %.1f ms with one slave, %.1f ms with %u\n", one_ms, all_ms, STORM_SLAVES);
	CHECK(one_ms > 1);
	CHECK(all_ms < 5 * one_ms);
}

/* --- the states of the mailboxes in the cyclic frames --- */

/* A byte of the slave's registers, behind the master's back. */
static void write_register(struct bus_bench *b, size_t slave, uint16_t reg, uint8_t value)
{
	static const uint8_t source[6] = { 0x10 };
	uint8_t frame[ECAT_FRAME_MAX_BYTES];
	struct ecat_frame_builder fb;
	int64_t back_ns;
	size_t count;
	uint8_t *data;

	ecat_frame_begin(&fb, frame, source);
	data = ecat_frame_add(&fb, ECAT_CMD_FPWR, 0, bus_slaves(b->bus, &count)[slave].station_addr,
			      reg, 1);
	CHECK(data != NULL);
	*data = value;
	CHECK_EQ(segment_frame(b->segment, bench_now_ns(b), frame, ecat_frame_end(&fb), &back_ns),
		 0);
}

static uint64_t count_polls(struct bus_bench *b, unsigned slaves)
{
	uint64_t polls = 0;

	for (uint16_t i = 0; i < slaves; i++) {
		polls += mailbox_counters_of(bus_mailbox(b->bus), i)->polls;
	}
	return polls;
}

static uint64_t polls_in(struct bus_bench *b, unsigned slaves, unsigned cycles)
{
	uint64_t before = count_polls(b, slaves);

	bench_run(b, cycles);
	return count_polls(b, slaves) - before;
}

/* A slave whose FMMU is off would seem to have no mail for ever: all are polled then. */
TEST(mailbox, states_of_64_mailboxes_come_in_the_cyclic_frame_and_no_slave_is_polled)
{
	enum { CYCLES = 1000, SLAVE = 17, FMMU_ON = ESC_REG_FMMU + 2 * ESC_FMMU_BYTES + 12 };
	struct bus_bench *b = start(STORM_SLAVES, 121);
	uint64_t hinted;
	uint64_t polled;

	CHECK_EQ(bus_plan(b->bus)->mailbox_bits, STORM_SLAVES);
	CHECK_EQ(segment_esc(b->segment, SLAVE)->reg[FMMU_ON], 1);
	hinted = polls_in(b, STORM_SLAVES, CYCLES);
	CHECK_EQ(bus_plan(b->bus)->wkc_expected, b->last.wkc);
	write_register(b, SLAVE, FMMU_ON, 0);
	bench_run(b, 30);
	polled = polls_in(b, STORM_SLAVES, CYCLES);
	printf("%u slaves in OP, %u cycles: %u datagrams that poll mailboxes, %u without their "
	       "states in the frame\n",
	       STORM_SLAVES, CYCLES, (unsigned)hinted, (unsigned)polled);
	CHECK_EQ(hinted, 0);
	CHECK(polled >= STORM_SLAVES * CYCLES / 110);
	CHECK_EQ(b->wkc_low, 0); /* it is no process data */
	segment_power_off(b->segment, SLAVE, bench_now_ns(b));
	for (unsigned i = 0; i < 5; i++) {
		bench_run(b, 50);
		bench_watch(b);
	}
	segment_power_on(b->segment, SLAVE, bench_now_ns(b));
	bench_recover(b, 6000);
	bench_run(b, 30);
	CHECK_EQ(polls_in(b, STORM_SLAVES, CYCLES), 0);
	bench_destroy(b);
}

TEST(mailbox, mail_is_noticed_within_two_cycles)
{
	enum { MAILS = 50 };
	struct bus_bench *b = start(STORM_SLAVES, 122);

	bench_run(b, 300);
	for (unsigned i = 0; i < MAILS; i++) {
		uint16_t slave = (uint16_t)(i * 7 % STORM_SLAVES);
		uint64_t before = mailbox_counters_of(bus_mailbox(b->bus), slave)->received;
		uint64_t from = b->cycles;

		put_emergency(b, slave);
		while (mailbox_counters_of(bus_mailbox(b->bus), slave)->received == before) {
			CHECK(b->cycles - from < 4);
			bench_run(b, 1);
		}
		/* The frame that shows it, the one that reads it, and its answer. */
		CHECK(b->cycles - from <= 3);
		bench_run(b, i % 5);
	}
	CHECK_EQ(heard.count[EVENT_EMERGENCY], MAILS);
	CHECK_EQ(polls_in(b, STORM_SLAVES, 10), 0);
	bench_destroy(b);
}

TEST(mailbox, a_slave_that_cannot_map_its_mailbox_state_is_polled)
{
	enum { SLAVES = 4, UNDECLARED = 1, BYTES_ONLY = 2, MAILBOX_STATE = 3, UNUSED = 0xff };
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = SLAVES, .seed = 123 });
	struct esc *esc = segment_esc(b->segment, UNDECLARED);
	size_t offset;
	size_t bytes;

	CHECK_EQ(sii_find_category(esc->sii, esc->sii_bytes, SII_CATEGORY_FMMU, &offset, &bytes),
		 0);
	CHECK_EQ(esc->sii[offset + 2], MAILBOX_STATE);
	esc->sii[offset + 2] = UNUSED;
	segment_esc(b->segment, BYTES_ONLY)->reg[ESC_REG_FEATURES] |= ESC_FEATURE_FMMU_BYTES;
	bench_bring_up(b);
	bench_run(b, 300);
	CHECK_EQ(bus_plan(b->bus)->mailbox_bits, SLAVES - 2);
	for (uint16_t i = 0; i < SLAVES; i++) {
		uint64_t before = mailbox_counters_of(bus_mailbox(b->bus), i)->polls;

		bench_run(b, 300);
		CHECK_EQ(mailbox_counters_of(bus_mailbox(b->bus), i)->polls > before,
			 i == UNDECLARED || i == BYTES_ONLY);
	}
	bench_destroy(b);
}

/* D2 */
TEST(mailbox, dead_mailbox_delays_neither_supervision_nor_other_slaves)
{
	struct bus_bench *b = start(3, 118);
	uint8_t data[64];
	struct mailbox_request dead = { .protocol = &coe_protocol,
					.slave_pos = 1,
					.with.coe = { .operation = COE_UPLOAD, .index = 0x1008 },
					.buffer = data,
					.capacity = sizeof(data) };
	uint8_t other[64];
	size_t len = sizeof(other);
	uint32_t abort = 0;
	uint64_t from;

	bench_fault(b, "at=0s mailbox-stuck slave=1");
	CHECK_EQ(bus_mailbox_submit(b->bus, &dead), 0);
	bench_run(b, 100);
	CHECK(mailbox_is_running(&dead));
	bench_fault(b, "at=0s al-error slave=0 code=0x001b");
	bench_run(b, 1);
	from = b->cycles;
	CHECK_EQ(bench_watch(b).slaves_op, 2);
	CHECK(b->cycles - from <= 10);
	from = b->cycles;
	CHECK_EQ(bus_sdo_read(b->bus, 2, 0x1008, 0, other, &len, &abort), 0);
	CHECK(b->cycles - from <= 10);
	CHECK(mailbox_is_running(&dead));
	bench_run(b, 2000);
	CHECK_EQ(dead.result, -ETIMEDOUT);
	bench_destroy(b);
}
