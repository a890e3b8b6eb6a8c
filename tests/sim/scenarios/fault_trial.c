/* SPDX-License-Identifier: MIT */
#include "sim/scenarios/fault_trial.h"

#include "base/event.h"
#include "base/prng.h"
#include "harness/test.h"
#include "sim/harness/value_oracle.h"

enum {
	PPM_MAX = 100,
	PHASE_CYCLES = 20, /* of the service thread and its polls */
	WELL_MS = 150,     /* in OP without interruption: it is over */
	LIMIT_MS = 20000,
	PEACE_CYCLES = 100,
};

#define FLAGS                                                                                      \
	(SAMPLE_LOST | SAMPLE_LATE | SAMPLE_DOUBLED | SAMPLE_SKIPPED | SAMPLE_WKC_LOW |            \
	 SAMPLE_NOT_OP | SAMPLE_FAIL_SAFE)

static const char *const names[FAULT_TRIAL_SLAVES] = { "a", "b", "c" };

static const struct status_page *page(const struct fault_trial *t)
{
	return session_page(t->vm.session);
}

static int is_op(const struct fault_trial *t)
{
	return atomic_load(&page(t)->bus_state) == BUS_OP &&
	       (virtual_master_sample(&t->vm)->flags & SAMPLE_NOT_OP) == 0;
}

static void look_at_sample(struct virtual_master *vm)
{
	struct fault_trial *t = vm->user;
	const struct sample_header *h = virtual_master_sample(vm);
	int is_bad = !slave_set_is_empty(&h->slaves_bad);

	for (unsigned i = 0; i < FAULT_TRIAL_SLAVES; i++) {
		uint64_t got;
		uint64_t was;
		int r = value_oracle_check(vm, i, names[i], &got, &was);

		t->good += r == 1;
		t->false_good += r < 0;
	}
	t->samples++;
	t->bad += (uint64_t)is_bad;
	if (t->flagged == 0 && (is_bad || (h->flags & FLAGS) != 0)) {
		t->flagged = t->samples;
	}
}

static void open_bus(struct fault_trial *t, const struct fault_row *row)
{
	const char *const settings[] = { "slaves[0].name=a", "slaves[1].name=b", "slaves[2].name=c",
					 row->setting, NULL };
	struct virtual_spec spec = { .slaves = FAULT_TRIAL_SLAVES,
				     .make = value_oracle_slave,
				     .seed = t->seed };
	struct prng prng = { t->seed };
	char path[128];

	for (unsigned i = 0; i < FAULT_TRIAL_SLAVES; i++) {
		spec.ppm[i] = (double)prng_below(&prng, 2 * PPM_MAX) - PPM_MAX;
	}
	virtual_bench_init(&t->b, &spec);
	if (row->prepare != NULL) {
		row->prepare(t);
	}
	virtual_master_init(&t->vm, &t->b, settings);
	virtual_master_settle(&t->vm);
	virtual_master_run(&t->vm, prng_below(&prng, PHASE_CYCLES) + 1);
	snprintf(path, sizeof(path), "%s/" CONFIG_RUN_EVENTS, t->vm.dir);
	CHECK_EQ(ring_reader_open(path, &t->events), 0);
	ring_seek(t->events, ring_newest(t->events));
	t->vm.user = t;
	t->vm.each_sample = look_at_sample;
}

static void do_lines(struct fault_trial *t, const char *const *lines)
{
	for (unsigned i = 0; i < FAULT_LINES && lines[i] != NULL; i++) {
		virtual_bench_fault(&t->b, lines[i]);
	}
}

static void break_it(struct fault_trial *t, const struct fault_row *row)
{
	do_lines(t, row->breaks);
	if (row->break_it != NULL) {
		row->break_it(t);
	}
}

/* One cycle, and what the status page says after it. */
static void step(struct fault_trial *t, const struct fault_row *row)
{
	int was_op = is_op(t);

	CHECK_EQ(virtual_master_run(&t->vm, 1), SESSION_GOES_ON);
	if (page(t)->message[0] != '\0') {
		snprintf(t->message, sizeof(t->message), "%s", page(t)->message);
		CHECK(strstr(t->message, "is in OP") == NULL); /* that is no trouble */
		t->is_told |= row->words != NULL && strstr(t->message, row->words) != NULL;
	}
	t->was_out += !is_op(t);
	t->rounds += was_op && !is_op(t);
	if (t->repaired_ns != 0 && !is_op(t)) {
		t->not_op_ns = virtual_bench_now_ns(&t->b);
	}
}

static void stay_out(struct fault_trial *t, const struct fault_row *row)
{
	for (unsigned ms = 0; ms < row->out_ms; ms++) {
		int was_op = is_op(t);

		step(t, row);
		if (row->is_repeated && !was_op && is_op(t)) {
			break_it(t, row);
		}
	}
	if (row->must_be_out && is_op(t)) {
		test_fail(__FILE__, __LINE__, "%s, seed %llu: in OP before it was repaired",
			  row->name, (unsigned long long)t->seed);
	}
}

static void wait_until_well(struct fault_trial *t, const struct fault_row *row)
{
	unsigned well_ms = 0;

	for (unsigned ms = 0; well_ms < WELL_MS; ms++) {
		if (ms > LIMIT_MS) {
			virtual_master_print_events(&t->vm, 30);
			test_fail(__FILE__, __LINE__, "%s, seed %llu: not in OP after %d ms: %s",
				  row->name, (unsigned long long)t->seed, LIMIT_MS,
				  page(t)->message);
		}
		step(t, row);
		well_ms = is_op(t) ? well_ms + 1 : 0;
	}
}

static void check_peace(struct fault_trial *t, const struct fault_row *row)
{
	const struct virtual_result *res = &t->vm.result;
	uint64_t gaps = res->gaps;

	virtual_master_forget(&t->vm);
	CHECK_EQ(virtual_master_run(&t->vm, PEACE_CYCLES), SESSION_GOES_ON);
	if (gaps != 0 || res->bad != 0 || res->op != res->samples || res->unlocked != 0 ||
	    page(t)->message[0] != '\0') {
		test_fail(__FILE__, __LINE__,
			  "%s, seed %llu: not well again: %llu gaps, %llu bad, message \"%s\"",
			  row->name, (unsigned long long)t->seed, (unsigned long long)gaps,
			  (unsigned long long)res->bad, page(t)->message);
	}
}

/* The event, with the slave and the cause, is among those since the fault. */
static void check_told(struct fault_trial *t, const struct fault_row *row)
{
	struct event ev;
	uint64_t lost;
	int has_event = row->event == EVENT_NONE;

	while (ring_read(t->events, &ev, sizeof(ev), &lost) == RING_OK) {
		has_event |= ev.id == row->event && ev.slave_pos == row->slave &&
			     (row->value == 0 || ev.value == row->value);
	}
	if (!has_event || (row->words != NULL && !t->is_told)) {
		virtual_master_print_events(&t->vm, 60);
		test_fail(__FILE__, __LINE__,
			  "%s, seed %llu: event %s of slave %u: %s; \"%s\" in "
			  "the message: %s, newest \"%s\"",
			  row->name, (unsigned long long)t->seed, event_name(row->event),
			  row->slave, has_event ? "yes" : "no",
			  row->words != NULL ? row->words : "", t->is_told ? "yes" : "no",
			  t->message);
	}
}

void fault_trial_run(struct fault_trial *t, const struct fault_row *row, uint64_t seed)
{
	memset(t, 0, sizeof(*t));
	t->seed = seed;
	open_bus(t, row);
	break_it(t, row);
	if (row->out_ms == 0) {
		t->repaired_ns = virtual_bench_now_ns(&t->b);
	} else {
		stay_out(t, row);
		do_lines(t, row->repairs);
		t->repaired_ns =
			virtual_bench_now_ns(&t->b) + (int64_t)row->repair_takes_ms * NS_PER_MS;
		if (row->repair_it != NULL) {
			row->repair_it(t);
		}
	}
	wait_until_well(t, row);
	check_peace(t, row);
	check_told(t, row);
	ring_reader_destroy(t->events);
	virtual_master_close(&t->vm);
}

double fault_trial_back_ms(const struct fault_trial *t)
{
	int64_t end_ns = t->served_ns != 0 ? t->served_ns : t->not_op_ns;

	return end_ns > t->repaired_ns ? (double)(end_ns - t->repaired_ns) * 1e-6 : 0;
}
