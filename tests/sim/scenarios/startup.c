/* SPDX-License-Identifier: MIT */
/*
 * Start-up SDOs on the way to OP and down: each is written in its transition, one that is aborted
 * is named with it, and a slave that comes back gets them again.
 */
#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "base/bytes.h"
#include "base/event.h"
#include "base/startup_record.h"
#include "config/sdo_value.h"
#include "harness/test.h"
#include "sim/harness/virtual_master.h"
#include "wire/al.h"

/* FB1111-Piccolo: the mode is written in PRE-OP only, the refresh time always. */
enum { OBJECT = 0x8000, MODE = 1, REFRESH = 2, LINE = 12 };

static struct virtual_bench b;
static struct virtual_master vm;

static void open_pair(const char *setting)
{
	virtual_master_init_pair(&vm, &b, setting, 1);
	snprintf(vm.cfg.path, sizeof(vm.cfg.path), "ecdaq.yaml");
}

static struct config_sdo *add(enum config_transition transition, uint8_t subindex, uint64_t value)
{
	struct config_sdo *sdo = &vm.cfg.sdo[vm.cfg.sdo_count];

	*sdo = (struct config_sdo){ .slave_pos = 1,
				    .transition = transition,
				    .index = OBJECT,
				    .subindex = subindex,
				    .type = subindex == MODE ? SDO_USINT : SDO_UINT,
				    .bytes = subindex == MODE ? 1 : 2,
				    .value = value,
				    .line = LINE + (int)vm.cfg.sdo_count };
	vm.cfg.sdo_count++;
	return sdo;
}

static unsigned refresh_time(uint16_t pos)
{
	static struct virtual_transfer tr;
	struct admin_reply reply;

	tr = (struct virtual_transfer){ .data = NULL };
	reply = virtual_master_transfer(&vm,
					&(struct admin_request){ .magic = ADMIN_MAGIC,
								 .verb = ADMIN_SDO_READ,
								 .slave_pos = pos,
								 .index = OBJECT,
								 .subindex = REFRESH },
					&tr);
	CHECK_EQ(reply.result, 0);
	CHECK_EQ(tr.answer_len, 2);
	return get_le16(tr.answer);
}

/* SDOs that were aborted so far, and the newest one's code. */
static unsigned count_aborts(int64_t *ret_code)
{
	struct ring_reader *reader = NULL;
	struct event ev;
	char path[128];
	uint64_t lost;
	unsigned count = 0;

	snprintf(path, sizeof(path), "%s/" CONFIG_RUN_EVENTS, vm.dir);
	CHECK_EQ(ring_reader_open(path, &reader), 0);
	ring_seek(reader, ring_oldest(reader));
	while (ring_read(reader, &ev, sizeof(ev), &lost) == RING_OK) {
		if (ev.id == EVENT_SDO_ABORT) {
			CHECK_EQ(ev.slave_pos, 1);
			CHECK_EQ(ev.arg[0], OBJECT << 8 | MODE);
			*ret_code = ev.value;
			count++;
		}
	}
	ring_reader_destroy(reader);
	return count;
}

static const char *message(void)
{
	return session_page(vm.session)->message;
}

static void check_said(const char *wanted)
{
	if (strcmp(message(), wanted) != 0) {
		test_fail(__FILE__, __LINE__, "\"%s\" instead of \"%s\"", message(), wanted);
	}
}

static void bring_up(void)
{
	if (virtual_master_bring_up(&vm) < 0) {
		test_fail(__FILE__, __LINE__, "%s", vm.failure.text);
	}
}

TEST(sim_startup, the_first_ones_are_written_as_soon_as_pre_op_is_reached)
{
	open_pair("bus.target=PREOP");
	add(CONFIG_TRANSITION_IP, REFRESH, 21);
	add(CONFIG_TRANSITION_PS, REFRESH, 22);
	bring_up();
	CHECK_EQ(refresh_time(1), 21);
	CHECK_EQ(refresh_time(0), 10);
	virtual_master_close(&vm);
}

/* "0:8000:02@12=22;": transition, object, line and bytes of each. */
static const char *listed(uint16_t pos)
{
	static char text[256];
	struct virtual_transfer tr = { .data = NULL };
	struct admin_request rq = { .magic = ADMIN_MAGIC, .verb = ADMIN_STARTUP, .slave_pos = pos };
	struct admin_reply reply = virtual_master_transfer(&vm, &rq, &tr);
	struct startup_record record;
	size_t used = 0;

	CHECK_EQ(reply.result, 0);
	CHECK_STR(reply.text, "ecdaq.yaml");
	text[0] = '\0';
	for (size_t at = 0; at < tr.answer_len; at += startup_record_bytes(record.len)) {
		memcpy(&record, tr.answer + at, sizeof(record));
		used += (size_t)snprintf(text + used, sizeof(text) - used,
					 "%u:%04x:%02x@%u=", record.transition, record.index,
					 record.subindex, record.line);
		for (size_t i = 0; i < record.len; i++) {
			used += (size_t)snprintf(text + used, sizeof(text) - used, "%02x",
						 tr.answer[at + sizeof(record) + i]);
		}
		used += (size_t)snprintf(text + used, sizeof(text) - used, ";");
	}
	return text;
}

TEST(sim_startup, they_are_listed_with_their_values_and_lines)
{
	open_pair("bus.target=PREOP");
	add(CONFIG_TRANSITION_IP, REFRESH, 21);
	add(CONFIG_TRANSITION_SO, MODE, 1);
	bring_up();
	CHECK_STR(listed(1), "0:8000:02@12=1500;2:8000:01@13=01;");
	CHECK_STR(listed(0), "");
	virtual_master_close(&vm);
}

TEST(sim_startup, those_of_safe_op_come_before_op)
{
	open_pair("bus.target=SAFEOP");
	add(CONFIG_TRANSITION_SO, REFRESH, 23);
	add(CONFIG_TRANSITION_PS, REFRESH, 22);
	add(CONFIG_TRANSITION_IP, REFRESH, 21);
	bring_up();
	CHECK_EQ(refresh_time(1), 22);
	virtual_master_close(&vm);
}

/* AL states of slave 1 when a frame came back that writes 24 to its refresh time. */
static unsigned written_in;

static void look_for_write(struct virtual_master *m, const uint8_t *frame, size_t frame_len)
{
	static const uint8_t mark[] = { OBJECT & 0xff, OBJECT >> 8, REFRESH, 24, 0 };

	for (size_t i = 0; i + sizeof(mark) <= frame_len; i++) {
		if (memcmp(frame + i, mark, sizeof(mark)) == 0) {
			written_in |= 1u << (virtual_bench_al_status(m->bench, 1) & 0x0f);
		}
	}
}

TEST(sim_startup, in_op_the_last_one_was_that_of_safe_op_and_that_of_the_way_down_is_in_op)
{
	open_pair(NULL);
	add(CONFIG_TRANSITION_OS, REFRESH, 24);
	add(CONFIG_TRANSITION_SO, REFRESH, 23);
	add(CONFIG_TRANSITION_PS, REFRESH, 22);
	virtual_master_settle(&vm);
	CHECK_EQ(refresh_time(1), 23);
	written_in = 0;
	vm.each_frame = look_for_write;
	CHECK_EQ(virtual_master_stop(&vm), 0);
	CHECK_EQ(written_in, 1u << AL_OP);
	virtual_master_close(&vm);
}

TEST(sim_startup, an_abort_ends_the_bring_up_and_is_named_with_its_transition)
{
	static const struct {
		enum config_transition transition;
		uint64_t value;
		const char *said;
	} cases[] = {
		{ CONFIG_TRANSITION_IP, 7,
		  "slave 1 (b): start-up SDO 0x8000:01 at IP = 0x7 (ecdaq.yaml:12) rejected: abort "
		  "0x06090030, value out of range" },
		{ CONFIG_TRANSITION_PS, 7,
		  "slave 1 (b): start-up SDO 0x8000:01 at PS = 0x7 (ecdaq.yaml:12) rejected: abort "
		  "0x06090030, value out of range" },
		{ CONFIG_TRANSITION_SO, 1,
		  "slave 1 (b): start-up SDO 0x8000:01 at SO = 0x1 (ecdaq.yaml:12) rejected: abort "
		  "0x08000022, data cannot be transferred or stored in this state" },
	};

	for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
		int64_t code = 0;

		open_pair(NULL);
		add(cases[i].transition, MODE, cases[i].value);
		CHECK(virtual_master_bring_up(&vm) < 0);
		CHECK_EQ(vm.failure.code, EXIT_CODE_MAPPING);
		check_said(cases[i].said);
		virtual_master_run(&vm, 20);
		CHECK_EQ(count_aborts(&code), 1);
		virtual_master_close(&vm);
	}
}

TEST(sim_startup, an_abort_on_the_way_down_is_an_event_and_the_bus_still_stops)
{
	int64_t code = 0;

	open_pair(NULL);
	add(CONFIG_TRANSITION_OS, MODE, 1);
	virtual_master_settle(&vm);
	CHECK_EQ(count_aborts(&code), 0);
	CHECK_EQ(virtual_master_stop(&vm), 0);
	CHECK_EQ(count_aborts(&code), 1);
	CHECK_EQ(code, 0x08000022);
	CHECK_EQ(virtual_bench_al_status(&b, 1) & 0x0f, 1);
	virtual_master_close(&vm);
}

static int make_terminals(int position, struct segment_slave_spec *ret_spec)
{
	return virtual_bench_slave(position == 0 ? "ek1100" : "el3104", position, ret_spec);
}

TEST(sim_startup, a_type_that_the_dictionary_contradicts_is_not_written)
{
	int64_t code = 0;

	virtual_bench_init(
		&b, &(struct virtual_spec){ .slaves = 2, .make = make_terminals, .seed = 5 });
	virtual_master_init_waiting(
		&vm, &b, (const char *const[]){ "slaves[0].name=a", "slaves[1].name=b", NULL });
	snprintf(vm.cfg.path, sizeof(vm.cfg.path), "ecdaq.yaml");
	*add(CONFIG_TRANSITION_PS, REFRESH, 5) =
		(struct config_sdo){ .slave_pos = 1,
				     .transition = CONFIG_TRANSITION_PS,
				     .index = 0x1018,
				     .subindex = 1,
				     .type = SDO_UINT,
				     .bytes = 2,
				     .value = 5,
				     .line = LINE };
	CHECK(virtual_master_bring_up(&vm) < 0);
	check_said("slave 1 (b): start-up SDO 0x1018:01 at PS = 0x5 (ecdaq.yaml:12): the "
		   "configuration has UINT, its dictionary UDINT of 32 bits");
	CHECK_EQ(count_aborts(&code), 0);
	virtual_master_close(&vm);
}

/* A value without a type: @text into object @index:@subindex. */
static void add_untyped(uint16_t index, uint8_t subindex, const char *text)
{
	struct config_sdo *sdo = add(CONFIG_TRANSITION_PS, REFRESH, 0);

	sdo->index = index;
	sdo->subindex = subindex;
	sdo->type = CONFIG_SDO_AUTO;
	sdo->octets = (uint32_t)vm.cfg.octet_count;
	sdo->bytes = (uint16_t)strlen(text);
	memcpy(vm.cfg.octets + vm.cfg.octet_count, text, sdo->bytes);
	vm.cfg.octet_count += sdo->bytes;
}

static int make_gauge(int position, struct segment_slave_spec *ret_spec)
{
	return virtual_bench_slave(position == 0 ? "ek1100" : "gauge", position, ret_spec);
}

static void open_gauge(void)
{
	virtual_bench_init(&b,
			   &(struct virtual_spec){ .slaves = 2, .make = make_gauge, .seed = 5 });
	virtual_master_init_waiting(
		&vm, &b, (const char *const[]){ "slaves[0].name=a", "slaves[1].name=b", NULL });
	snprintf(vm.cfg.path, sizeof(vm.cfg.path), "ecdaq.yaml");
}

TEST(sim_startup, a_value_without_a_type_has_that_of_the_dictionary)
{
	open_gauge();
	add_untyped(0x6000, 3, "1.5");
	add_untyped(0x7000, 1, "-2");
	vm.cfg.sdo[0].transition = CONFIG_TRANSITION_IP;
	bring_up();
	CHECK_STR(listed(1), "0:6000:03@12=0000c03f;1:7000:01@13=feff;");
	virtual_master_close(&vm);
}

TEST(sim_startup, a_value_that_its_type_does_not_take_is_not_written)
{
	open_gauge();
	add_untyped(0x7000, 1, "40000");
	CHECK(virtual_master_bring_up(&vm) < 0);
	check_said("slave 1 (b): start-up SDO 0x7000:01 at PS (ecdaq.yaml:12): \"40000\" is not a "
		   "valid INT");
	virtual_master_close(&vm);
}

TEST(sim_startup, a_value_without_a_type_needs_a_dictionary_that_has_the_object)
{
	open_gauge();
	add_untyped(0x8000, 1, "1");
	CHECK(virtual_master_bring_up(&vm) < 0);
	check_said(
		"slave 1 (b): start-up SDO 0x8000:01 at PS (ecdaq.yaml:12): no type in its object "
		"dictionary (object does not exist): give a type");
	virtual_master_close(&vm);
	open_pair("bus.target=PREOP");
	add_untyped(OBJECT, REFRESH, "20");
	vm.cfg.sdo[0].transition = CONFIG_TRANSITION_IP;
	CHECK(virtual_master_bring_up(&vm) < 0);
	check_said("slave 1 (b): start-up SDO 0x8000:02 at IP (ecdaq.yaml:12): it has no object "
		   "dictionary: "
		   "give a type");
	virtual_master_close(&vm);
}

static void wait_for_op(unsigned limit_ms)
{
	for (unsigned ms = 0; atomic_load(&session_page(vm.session)->bus_state) != BUS_OP;
	     ms += 10) {
		if (ms > limit_ms) {
			test_fail(__FILE__, __LINE__, "not in OP after %u ms: %s", ms, message());
		}
		CHECK_EQ(virtual_master_run(&vm, 10), SESSION_GOES_ON);
	}
}

TEST(sim_startup, a_slave_that_was_without_power_gets_them_again)
{
	open_pair(NULL);
	add(CONFIG_TRANSITION_IP, REFRESH, 21);
	add(CONFIG_TRANSITION_SO, REFRESH, 23);
	virtual_master_settle(&vm);
	virtual_bench_fault(&b, "at=10ms power-off slave=1");
	virtual_master_run(&vm, 500);
	virtual_bench_fault(&b, "at=0s power-on slave=1");
	virtual_master_run(&vm, 20);
	wait_for_op(2000);
	CHECK_EQ(refresh_time(1), 23);
	virtual_master_close(&vm);
}
