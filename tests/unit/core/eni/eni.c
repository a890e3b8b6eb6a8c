/* SPDX-License-Identifier: MIT */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>

#include "bench.h"
#include "eni/fields.h"
#include "eni/mapping.h"

static void check_refused(const char *text, const char *error)
{
	struct seen seen = bench_read(text);

	CHECK_EQ(seen.result, -EBADMSG);
	CHECK_STR(seen.error, error);
	CHECK(seen.eni == NULL);
}

TEST(eni, file_of_another_tool_is_read_with_its_slave)
{
	struct seen seen = bench_read(bench_foreign);
	const struct eni_slave *slave;

	CHECK_STR(seen.error, "");
	CHECK_EQ(seen.result, 0);
	slave = &seen.eni->slave[0];
	CHECK_EQ(seen.eni->slave_count, 1);
	CHECK_STR(seen.eni->master.name, "Ger\xc3\xa4t 1 (EtherCAT)");
	CHECK_STR(slave->info.name, "Klemme 2 & 3");
	CHECK_EQ(slave->info.auto_inc_addr, 0xffff);
	CHECK_EQ(slave->info.vendor, 2);
	CHECK_EQ(slave->info.product, 0xfffffff0);
	CHECK_EQ(slave->info.revision, 0x00110000);
	CHECK_EQ(slave->info.has & ENI_HAS(ENI_INFO_SERIAL), 0);
	CHECK_EQ(slave->sm[2].start, 0x1100);
	CHECK_EQ(slave->sm[2].control, 0x64);
	CHECK_EQ(slave->sm[2].pdo.item[0], 0x1600);
	CHECK_EQ(slave->sm[3].has, 0);
	CHECK_EQ(slave->mailbox.recv.poll_time_ms, 20);
	CHECK_EQ(slave->mailbox.protocols, ENI_HAS(ENI_COE));
	CHECK_EQ(slave->dc.is_reference, 1);
	CHECK_EQ(slave->dc.cycle1_ns, -250000);
	CHECK_EQ(slave->dc.shift_ns, -10);
	eni_free(seen.eni);
}

TEST(eni, pdos_commands_frames_and_variables_are_read_in_the_order_of_the_file)
{
	struct seen seen = bench_read(bench_foreign);
	const struct eni *eni = seen.eni;

	CHECK_EQ(eni->pdo_count, 3);
	CHECK_EQ(eni->pdo[0].is_tx, 1);
	CHECK_EQ(eni->pdo[0].is_fixed, 1);
	CHECK_EQ(eni->pdo[1].index, 0x1600);
	CHECK_EQ(eni->pdo[1].count, 2);
	CHECK_EQ(eni->pdo[2].has & ENI_HAS(ENI_PDO_SM), 0);
	CHECK_EQ(eni->entry[1].subindex, 1);
	CHECK_EQ(eni->init_count, 5);
	CHECK_EQ(eni->init[0].owner, ENI_MASTER);
	CHECK_EQ(eni->init[0].ado, 0x600);
	CHECK_EQ(eni->init[1].owner, 0);
	CHECK_EQ(eni->init[1].is_before_slave, 1);
	CHECK_EQ(eni->init[4].validate.timeout_ms, 3000);
	CHECK_EQ(eni->init[4].validate.mask.data[0], 0x0f);
	CHECK_EQ(eni->coe_count, 1);
	CHECK_EQ(eni->coe[0].is_complete, 1);
	CHECK_EQ(eni->coe[0].transitions, ENI_HAS(ENI_FROM_PS) | ENI_HAS(ENI_FROM_SO));
	CHECK_EQ(eni->coe[0].data.len, 4);
	CHECK_EQ(eni->coe[0].data.data[3], 0xcd);
	CHECK_EQ(eni->cyclic[0].cycle_us, 2000);
	CHECK_EQ(eni->cmd_count, 2);
	CHECK_EQ(eni->cmd[0].states, ENI_SAFEOP | ENI_OP);
	CHECK_EQ(eni->cmd[0].addr, 0x01000000);
	CHECK_EQ(eni->cmd[1].adp, 1001);
	CHECK_EQ(eni->variable_count, 2);
	CHECK_EQ(eni->variable[1].is_output, 1);
	eni_free(seen.eni);
}

TEST(eni, what_is_not_read_is_noted_with_its_line)
{
	struct seen seen = bench_read(bench_foreign);

	CHECK_EQ(seen.eni->note_count, 2);
	CHECK_STR(seen.eni->note[0].what, "<HotConnect> in <Slave>");
	CHECK_EQ(seen.eni->note[0].line, 8);
	CHECK_EQ(seen.eni->note[0].slave, 0);
	CHECK_STR(seen.eni->note[1].what, "<SoE> in <Mailbox>");
	eni_free(seen.eni);
}

static char *written(const struct eni *eni)
{
	char *text = NULL;
	size_t len = 0;
	FILE *out = open_memstream(&text, &len);

	CHECK(out != NULL);
	eni_write(out, eni);
	fclose(out);
	return text;
}

TEST(eni, written_and_read_back_it_is_written_to_the_same_bytes)
{
	struct seen first = bench_read(bench_foreign);
	char *once = written(first.eni);
	struct seen second = bench_read(once);
	char *twice;

	CHECK_STR(second.error, "");
	twice = written(second.eni);
	CHECK_STR(twice, once);
	CHECK_EQ(second.eni->note_count, 0);
	CHECK_EQ(second.eni->init_count, first.eni->init_count);
	CHECK_EQ(second.eni->slave[0].info.product, 0xfffffff0);
	CHECK(strstr(once, "<Name>Klemme 2 &amp; 3</Name>") != NULL);
	CHECK(strstr(once, "<SerialNo>") == NULL);
	free(once);
	free(twice);
	eni_free(first.eni);
	eni_free(second.eni);
}

TEST(eni, registers_are_those_that_the_commands_leave)
{
	static struct eni_registers registers;
	struct seen seen = bench_read(bench_foreign);

	eni_registers_of(seen.eni, 0, &registers);
	CHECK_EQ(registers.value[0x0603], 0x01);
	CHECK_EQ(registers.value[0x0818], 0x80);
	CHECK_EQ(registers.is_written[0x0818], 1);
	CHECK_EQ(registers.is_written[0x0810], 0);
	CHECK_EQ(registers.is_written[0x0130], 0);
	eni_free(seen.eni);
}

TEST(eni, a_command_of_the_way_down_leaves_nothing)
{
	static struct eni_registers registers;
	struct seen seen =
		bench_read(BENCH_SLAVE("<InitCmds><InitCmd><Transition>SP</Transition><Cmd>5</Cmd>"
				       "<Ado>#x420</Ado><Data>0102</Data></InitCmd></InitCmds>"));

	eni_registers_of(seen.eni, 0, &registers);
	CHECK_EQ(registers.is_written[0x0420], 0);
	eni_free(seen.eni);
}

TEST(eni, a_variable_is_found_as_the_entry_of_a_pdo)
{
	struct seen seen = bench_read(bench_foreign);
	const struct eni_entry *entry = NULL;
	uint32_t slave = 77;

	CHECK_EQ(eni_variable_entry(seen.eni, &seen.eni->variable[0], &slave, &entry), 0);
	CHECK_EQ(slave, 0);
	CHECK_EQ(entry->index, 0x6000);
	CHECK_EQ(eni_variable_entry(seen.eni, &seen.eni->variable[1], &slave, &entry), 0);
	CHECK_EQ(entry->index, 0x7000);
	seen.eni->variable[1].offset = 1; /* padding */
	CHECK_EQ(eni_variable_entry(seen.eni, &seen.eni->variable[1], &slave, &entry), -ENOENT);
	seen.eni->variable[1].offset = 999;
	CHECK_EQ(eni_variable_entry(seen.eni, &seen.eni->variable[1], &slave, &entry), -ENOENT);
	eni_free(seen.eni);
}

TEST(eni, parts_that_may_be_missing_are_missing)
{
	struct seen seen = bench_read(
		"<EtherCATConfig><Config><Slave><Info/></Slave></Config></EtherCATConfig>");

	CHECK_EQ(seen.result, 0);
	CHECK_EQ(seen.eni->slave_count, 1);
	CHECK_EQ(seen.eni->cyclic_count, 0);
	CHECK_EQ(seen.eni->inputs.has, 0);
	eni_free(seen.eni);
	seen = bench_read("<EtherCATConfig/>");
	CHECK_EQ(seen.result, 0);
	CHECK_EQ(seen.eni->slave_count, 0);
	eni_free(seen.eni);
}

TEST(eni, what_is_wrong_is_refused_with_its_line)
{
	check_refused("<html/>", "t.xml:1: no ENI: <html> instead of <EtherCATConfig>");
	check_refused("", "t.xml:1: no XML: no element found");
	check_refused("<EtherCATConfig>\n<Config>", "t.xml:2: no XML: no element found");
	check_refused(BENCH_SLAVE("<Info>\n<VendorId>two</VendorId></Info>"),
		      "t.xml:4: VendorId: \"two\" is no number (#x1F or 31)");
	check_refused(BENCH_SLAVE("<Info><PhysAddr>65536</PhysAddr></Info>"),
		      "t.xml:3: PhysAddr: 65536 is not within 0 to 65535");
	check_refused(BENCH_SLAVE("<Info><VendorId>-2147483649</VendorId></Info>"),
		      "t.xml:3: VendorId: -2147483649 is not within -2147483648 to 4294967295");
	check_refused(BENCH_SLAVE("<ProcessData><Sm16/></ProcessData>"),
		      "t.xml:3: <Sm16>: one too many, or out of memory");
	check_refused(BENCH_SLAVE("<DC><ReferenceClock>yes</ReferenceClock></DC>"),
		      "t.xml:3: ReferenceClock: \"yes\" is neither 0 nor 1");
	check_refused(BENCH_SLAVE("<InitCmds><InitCmd><Transition>XY</Transition></InitCmd>"
				  "</InitCmds>"),
		      "t.xml:3: Transition: unknown \"XY\"");
	check_refused(BENCH_SLAVE("<InitCmds><InitCmd><Data>0x2</Data></InitCmd></InitCmds>"),
		      "t.xml:3: Data: \"0x2\" is no row of hexadecimal octets");
	check_refused(BENCH_SLAVE("<ProcessData><RxPdo Sm=\"16\"/></ProcessData>"),
		      "t.xml:3: @Sm: 16 is not within 0 to 15");
}

TEST(eni, hostile_files_are_refused)
{
	char *deep = calloc(1, 4096);
	size_t len = 0;

	check_refused("<!DOCTYPE a [<!ENTITY b \"bb\"><!ENTITY c \"&b;&b;\">]>\n<EtherCATConfig/>",
		      "t.xml:1: a document type declaration (<!DOCTYPE) is not accepted");
	len += (size_t)snprintf(deep, 4096, "<EtherCATConfig>");
	for (int i = 0; i < 40; i++) {
		len += (size_t)snprintf(deep + len, 4096 - len, "<a>");
	}
	check_refused(deep, "t.xml:1: more than 32 levels of elements");
	free(deep);
}

TEST(eni, a_list_without_end_is_refused_at_its_limit)
{
	static const char row[] = "<Slave/>";
	char *text = NULL;
	size_t len = 0;
	FILE *out = open_memstream(&text, &len);

	CHECK(out != NULL);
	fputs("<EtherCATConfig><Config>", out);
	for (int i = 0; i <= ENI_LIMIT_SLAVES; i++) {
		fputs(row, out);
	}
	fclose(out);
	check_refused(text, "t.xml:1: <Slave>: one too many, or out of memory");
	free(text);
}

TEST(eni, a_file_that_is_not_there_is_named)
{
	struct eni *eni = NULL;
	char error[256] = "";

	CHECK_EQ(eni_read_file("/nowhere/a.xml", &eni, error, sizeof(error)), -ENOENT);
	CHECK_STR(error, "/nowhere/a.xml: No such file or directory");
	CHECK_EQ(eni_read_file("/dev", &eni, error, sizeof(error)), -EINVAL);
	CHECK_STR(error, "/dev: not a regular file");
}
