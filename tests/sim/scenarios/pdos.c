/* SPDX-License-Identifier: MIT */
/* slaves[].pdos[]: what is assigned, what is refused, and that a slave which comes back has it. */
#include <stdio.h>
#include <string.h>

#include "harness/test.h"
#include "sim/harness/virtual_master.h"

enum { LINE = 7 };

static struct virtual_bench b;
static struct virtual_master vm;
static const char *terminal;

static int make(int position, struct segment_slave_spec *ret_spec)
{
	return virtual_bench_slave(position == 0 ? "ek1100" : terminal, position, ret_spec);
}

static void open_with(const char *name)
{
	static const char *const settings[] = { "slaves[0].name=coupler", "slaves[1].name=ai",
						"cycle.period=2ms", NULL };

	terminal = name;
	virtual_bench_init(&b, &(struct virtual_spec){ .slaves = 2, .make = make, .seed = 9 });
	virtual_master_init_waiting(&vm, &b, settings);
	snprintf(vm.cfg.path, sizeof(vm.cfg.path), "ecdaq.yaml");
}

static struct config_pdo *list(uint16_t index, const char *pdo)
{
	struct config_pdo *item = &vm.cfg.pdo[vm.cfg.pdo_count];

	*item = (struct config_pdo){ .slave_pos = 1,
				     .index = index,
				     .line = LINE + (int)vm.cfg.pdo_count };
	snprintf(item->pdo, sizeof(item->pdo), "%s", pdo);
	vm.cfg.pdo_count++;
	return item;
}

static void map_entry(struct config_pdo *item, uint32_t word)
{
	vm.cfg.pdo_entry[vm.cfg.pdo_entry_count++] = word;
	item->entry_count++;
}

static void to_op(void)
{
	if (virtual_master_bring_up(&vm) < 0) {
		test_fail(__FILE__, __LINE__, "%s", vm.failure.text);
	}
	virtual_master_run(&vm, 50);
}

/* What is assigned is what is listed. */
static void check_no_difference(void)
{
	struct virtual_transfer tr = { .data = NULL };
	struct admin_request rq = { .magic = ADMIN_MAGIC, .verb = ADMIN_COMPARE };

	CHECK_EQ(virtual_master_transfer(&vm, &rq, &tr).result, 0);
	CHECK_EQ(tr.answer_len, 0);
}

/* Bytes of process data, and whether there is a channel of that name. */
static void check_image(uint32_t bytes, const char *there, const char *missing)
{
	size_t meta_bytes;
	const struct sample_meta *meta = ring_meta(vm.samples, &meta_bytes);
	unsigned found = 0;

	CHECK_EQ(meta->image_bytes, bytes);
	for (uint32_t i = 0; i < meta->channel_count; i++) {
		const char *name = sample_meta_channels(meta)[i].name;

		found += strcmp(name, there) == 0;
		CHECK(missing == NULL || strcmp(name, missing) != 0);
	}
	CHECK_EQ(found, 1);
	check_no_difference();
}

static void check_refused(const char *wanted)
{
	CHECK(virtual_master_bring_up(&vm) < 0);
	if (strcmp(vm.failure.text, wanted) != 0) {
		test_fail(__FILE__, __LINE__, "\"%s\" instead of \"%s\"", vm.failure.text, wanted);
	}
	virtual_master_close(&vm);
}

TEST(sim_pdos, without_a_list_the_default_is_assigned)
{
	open_with("el3004");
	to_op();
	CHECK_EQ(virtual_master_sample(&vm)->slaves_bad.word[0], 0);
	check_image(16, "ai.ai_standard_channel_1_value", NULL);
	virtual_master_close(&vm);
}

TEST(sim_pdos, by_index_and_by_name_in_the_order_of_the_list)
{
	open_with("el3004");
	list(0x1a03, "0x1a03");
	list(0, "AI Compact Channel 1");
	to_op();
	CHECK_EQ(virtual_master_sample(&vm)->slaves_bad.word[0], 0);
	check_image(4, "ai.ai_compact_channel_1_value", "ai.ai_standard_channel_1_value");
	virtual_master_close(&vm);
}

TEST(sim_pdos, a_slave_that_was_without_power_gets_its_assignment_again)
{
	open_with("el3004");
	list(0x1a01, "0x1a01");
	to_op();
	virtual_bench_fault(&b, "at=10ms power-off slave=1");
	virtual_master_run(&vm, 300);
	virtual_bench_fault(&b, "at=0s power-on slave=1");
	for (unsigned i = 0; i < 200; i++) {
		virtual_master_run(&vm, 10);
	}
	CHECK_EQ(atomic_load(&session_page(vm.session)->bus_state), BUS_OP);
	CHECK_EQ(virtual_master_sample(&vm)->slaves_bad.word[0], 0);
	virtual_master_close(&vm);
}

TEST(sim_pdos, a_name_that_it_does_not_have_is_refused_with_those_that_it_has)
{
	open_with("el3004");
	list(0, "AI Compact Channel 9");
	check_refused(
		"slave 1 (ai): PDO AI Compact Channel 9 (ecdaq.yaml:7): it has no PDO of this "
		"name; it has: AI Standard Channel 1, AI Compact Channel 1, AI Standard "
		"Channel 2, AI Compact Channel 2, AI Standard Channel 3, AI Compact Channel "
		"3, ...");
}

TEST(sim_pdos, an_index_that_it_does_not_have_is_refused)
{
	open_with("el3004");
	list(0x1a20, "0x1a20");
	check_refused(
		"slave 1 (ai): PDO 0x1a20 (ecdaq.yaml:7): 0x1a20 does not exist in its object "
		"dictionary");
}

TEST(sim_pdos, a_pdo_is_listed_once)
{
	open_with("el3004");
	list(0x1a01, "0x1a01");
	list(0, "AI Compact Channel 1");
	check_refused("slave 1 (ai): PDO AI Compact Channel 1 (ecdaq.yaml:8): is already listed in "
		      "line 7");
}

TEST(sim_pdos, a_name_that_several_have_needs_the_index)
{
	open_with("akd");
	list(0, "Outputs");
	check_refused(
		"slave 1 (ai): PDO Outputs (ecdaq.yaml:7): 12 of its PDOs have this name: give "
		"the index");
}

TEST(sim_pdos, inputs_stay_as_they_are_where_only_outputs_are_listed)
{
	open_with("akd");
	list(0x1702, "0x1702");
	to_op();
	CHECK_EQ(virtual_master_sample(&vm)->slaves_bad.word[0], 0);
	check_image(12, "ai.target_velocity", NULL);
	virtual_master_close(&vm);
}

TEST(sim_pdos, a_fixed_assignment_can_be_listed_and_not_changed)
{
	open_with("el3102");
	list(0x1a00, "0x1a00");
	list(0x1a01, "0x1a01");
	to_op();
	virtual_master_close(&vm);
	open_with("el3102");
	list(0x1a01, "0x1a01");
	check_refused("slave 1 (ai): PDO 0x1a01 (ecdaq.yaml:7): the slave's assignment to SM3 is "
		      "fixed, and another one (SII: no PDO assignment; ecdaq pdo)");
}

TEST(sim_pdos, a_fixed_mapping_is_not_changed)
{
	open_with("el3004");
	map_entry(list(0x1a01, "0x1a01"), 0x60001110);
	check_refused("slave 1 (ai): PDO 0x1a01 (ecdaq.yaml:7): its mapping is fixed (SII: no PDO "
		      "configuration)");
}

TEST(sim_pdos, what_the_slave_aborts_is_named_with_the_pdo)
{
	open_with("akd");
	map_entry(list(0x1600, "0x1600"), 0x60400010);
	check_refused(
		"slave 1 (ai): PDO 0x1600: SDO 0x1600:00 = 0x0 (ecdaq.yaml:7) rejected: abort "
		"0x06010002, object can only be read");
}

TEST(sim_pdos, a_slave_without_coe_has_nothing_to_assign)
{
	open_with("el1008");
	list(0x1a00, "0x1a00");
	check_refused("slave 1 (ai): PDO 0x1a00 (ecdaq.yaml:7): the slave has no CoE mailbox: its "
		      "PDOs are fixed");
}
