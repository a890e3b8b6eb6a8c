/* SPDX-License-Identifier: MIT */
#include <errno.h>

#include "bench.h"
#include "wire/sii.h"

static void check_refused(const char *text, const char *error)
{
	struct seen seen = bench_text(text);

	CHECK_EQ(seen.result, -EBADMSG);
	CHECK_STR(seen.error, error);
	bench_free(&seen);
}

TEST(esi, device_is_read_with_vendor_group_and_names)
{
	struct seen seen = bench_text(BENCH_DEVICE(
		"<Name LcId=\"1033\"><![CDATA[EL1 & more]]></Name><GroupType>g</GroupType>"));
	const struct esi_device *d = seen.device[0];

	CHECK_EQ(seen.result, 0);
	CHECK_EQ(seen.count, 1);
	CHECK_EQ(d->id.vendor, 0x1337);
	CHECK_EQ(d->id.product, 0x10);
	CHECK_EQ(d->id.revision, 2);
	CHECK_STR(d->type, "EL1");
	CHECK_STR(d->name, "EL1 & more");
	CHECK_STR(d->vendor_name, "V");
	CHECK_STR(d->group_name, "Terminals");
	CHECK_STR(d->physics, "YY");
	CHECK_EQ(d->line, 4);
	bench_free(&seen);
}

TEST(esi, english_name_is_preferred_in_any_order)
{
	struct seen seen = bench_text(BENCH_DEVICE(
		"<Name LcId=\"1033\">Terminal</Name><Name LcId=\"1031\">Klemme</Name>"));

	CHECK_STR(seen.device[0]->name, "Terminal");
	bench_free(&seen);
	seen = bench_text(BENCH_DEVICE(
		"<Name LcId=\"1031\">Klemme</Name><Name LcId=\"1033\">Terminal</Name>"));
	CHECK_STR(seen.device[0]->name, "Terminal");
	bench_free(&seen);
	seen = bench_text(BENCH_DEVICE("<Name LcId=\"1031\">Klemme</Name>"));
	CHECK_STR(seen.device[0]->name, "Klemme");
	bench_free(&seen);
}

TEST(esi, pdos_have_their_entries_exclusions_and_flags)
{
	struct seen seen = bench_text(BENCH_DEVICE(
		"<RxPdo Fixed=\"1\" Sm=\"2\"><Index>#x1600</Index><Name>Out</Name>"
		"<Exclude>#x1601</Exclude><Exclude>5634</Exclude>"
		"<Entry><Index>#x7000</Index><SubIndex>1</SubIndex><BitLen>1</BitLen>"
		"<Name>LED</Name><DataType>BOOL</DataType></Entry>"
		"<Entry><Index>#x0</Index><BitLen>7</BitLen></Entry></RxPdo>"
		"<TxPdo Mandatory=\"true\"><Index DependOnSlot=\"1\">#x1a00</Index><Name>In</Name>"
		"<Entry><Index>#x6000</Index><SubIndex>#x11</SubIndex><BitLen>16</BitLen>"
		"<Name>Value</Name><DataType DScale=\"+/-10\">INT</DataType></Entry></TxPdo>"));
	const struct esi_device *d = seen.device[0];

	CHECK_EQ(seen.result, 0);
	CHECK_EQ(d->pdo_count, 2);
	CHECK_EQ(d->pdo[0].index, 0x1600);
	CHECK_EQ(d->pdo[0].sm, 2);
	CHECK(!d->pdo[0].is_tx && d->pdo[0].is_fixed && !d->pdo[0].is_mandatory);
	CHECK_EQ(d->pdo[0].exclude_count, 2);
	CHECK_EQ(d->pdo[0].exclude[1], 0x1602);
	CHECK_EQ(d->pdo[0].count, 2);
	CHECK_EQ(d->pdo[0].bits, 8);
	CHECK_EQ(d->pdo[1].sm, ESI_NO_SM);
	CHECK(d->pdo[1].is_tx && d->pdo[1].is_mandatory);
	CHECK_EQ(d->entry[d->pdo[1].first].subindex, 0x11);
	CHECK_EQ(d->entry[d->pdo[1].first].type, 3);
	CHECK_EQ(d->entry[1].type, 0);
	CHECK_EQ(d->entry[1].bits, 7);
	CHECK_STR(esi_find_entry(d, 0, 0x6000, 0x11)->name, "Value");
	CHECK_STR(esi_find_entry(d, 0x1600, 0x6000, 0x11)->name, "Value");
	CHECK(esi_find_entry(d, 0, 0x6000, 0x12) == NULL);
	bench_free(&seen);
}

TEST(esi, clocks_mailboxes_timeouts_and_sync_managers_are_read)
{
	struct seen seen = bench_text(BENCH_DEVICE(
		"<Info><StateMachine><Timeout><PreopTimeout>2000</PreopTimeout></Timeout>"
		"</StateMachine><Mailbox><Timeout><RequestTimeout>100</RequestTimeout>"
		"<ResponseTimeout>4000</ResponseTimeout></Timeout></Mailbox></Info>"
		"<Fmmu>Outputs</Fmmu><Fmmu>MBoxState</Fmmu>"
		"<Sm DefaultSize=\"128\" StartAddress=\"#x1000\" ControlByte=\"#x26\" "
		"Enable=\"1\">MBoxOut</Sm><Sm StartAddress=\"#x1100\">Inputs</Sm>"
		"<Mailbox><CoE SdoInfo=\"1\" CompleteAccess=\"true\"/><FoE/></Mailbox>"
		"<Dc><OpMode><Name>DC</Name><AssignActivate>#x730</AssignActivate>"
		"<CycleTimeSync0 Factor=\"-2\">0</CycleTimeSync0>"
		"<ShiftTimeSync0>-500</ShiftTimeSync0></OpMode></Dc>"
		"<Eeprom><ByteSize>2048</ByteSize></Eeprom>"));
	const struct esi_device *d = seen.device[0];

	CHECK_EQ(seen.result, 0);
	CHECK_EQ(d->preop_timeout_ms, 2000);
	CHECK_EQ(d->response_timeout_ms, 4000);
	CHECK_EQ(d->fmmu_count, 2);
	CHECK_EQ(d->fmmu[1], 3);
	CHECK_EQ(d->sm_count, 2);
	CHECK_EQ(d->sm[0].bytes, 128);
	CHECK_EQ(d->sm[0].control, 0x26);
	CHECK_EQ(d->sm[1].type, 4);
	CHECK_EQ(d->protocols, SII_MAILBOX_COE | SII_MAILBOX_FOE);
	CHECK_EQ(d->coe, ESI_COE_SDO_INFO | ESI_COE_COMPLETE_ACCESS);
	CHECK_EQ(d->dc_count, 1);
	CHECK_EQ(d->dc[0].assign_activate, 0x730);
	CHECK_EQ(d->dc[0].sync0_factor, -2);
	CHECK_EQ(d->dc[0].sync0_shift_ns, -500);
	CHECK_EQ(d->eeprom_bytes, 2048);
	bench_free(&seen);
}

TEST(esi, start_up_commands_have_transitions_and_data)
{
	struct seen seen = bench_text(BENCH_DEVICE(
		"<Mailbox><CoE><InitCmd CompleteAccess=\"1\"><Transition>PS</Transition>"
		"<Transition>SO</Transition><Index>#x1c12</Index><SubIndex>0</SubIndex>"
		"<Data>0200001601</Data><Comment>assign</Comment></InitCmd></CoE></Mailbox>"));
	const struct esi_command *c = seen.device[0]->command;

	CHECK_EQ(seen.result, 0);
	CHECK_EQ(seen.device[0]->command_count, 1);
	CHECK_EQ(c->transitions, ESI_TRANSITION_PS | ESI_TRANSITION_SO);
	CHECK_EQ(c->index, 0x1c12);
	CHECK_EQ(c->len, 5);
	CHECK_EQ(c->data[3], 0x16);
	CHECK(c->is_complete_access);
	bench_free(&seen);
}

TEST(esi, modules_and_slots_are_read)
{
	struct seen seen = bench_text(
		BENCH_HEAD "<Device><Type ProductCode=\"1\">M</Type><Slots SlotPdoIncrement=\"1\" "
			   "SlotIndexIncrement=\"#x10\"><Slot MinInstances=\"0\" "
			   "MaxInstances=\"8\"><Name>Slot</Name><ModuleIdent>#x20</ModuleIdent>"
			   "<ModuleIdent>#x21</ModuleIdent></Slot></Slots></Device></Devices>"
			   "<Modules><Module><Type ModuleIdent=\"#x20\">DI</Type><TxPdo>"
			   "<Index>#x1a00</Index></TxPdo></Module></Modules></Descriptions>"
			   "</EtherCATInfo>");

	CHECK_EQ(seen.result, 0);
	CHECK_EQ(seen.count, 2);
	CHECK_EQ(seen.device[0]->slot_count, 1);
	CHECK_EQ(seen.device[0]->slot[0].max, 8);
	CHECK_EQ(seen.device[0]->slot[0].module, 0x20);
	CHECK_EQ(seen.device[0]->slot[0].module_count, 2);
	CHECK_EQ(seen.device[0]->slot_index_increment, 0x10);
	CHECK_EQ(seen.device[1]->id.kind, ESI_MODULE);
	CHECK_EQ(seen.device[1]->id.product, 0x20);
	CHECK_EQ(seen.device[1]->pdo_count, 1);
	bench_free(&seen);
}

TEST(esi, device_that_is_not_wanted_is_passed_over)
{
	static const char text[] =
		BENCH_HEAD "<Device><Type ProductCode=\"1\">A</Type><RxPdo><Index>not "
			   "read</Index></RxPdo></Device>"
			   "<Device><Type "
			   "ProductCode=\"2\">B</Type><RxPdo><Index>#x1600</Index></RxPdo></Device>"
			   "<Device><Type ProductCode=\"3\">C</Type></Device>" BENCH_TAIL;
	struct seen seen = { .wanted = 2 };

	bench_read(&seen, text, strlen(text));
	CHECK_EQ(seen.result, 0);
	CHECK_EQ(seen.count, 1);
	CHECK_STR(seen.device[0]->type, "B");
	CHECK_EQ(seen.device[0]->pdo_count, 1);
	bench_free(&seen);
}

TEST(esi, what_is_wrong_is_named_with_file_and_line)
{
	check_refused(BENCH_DEVICE("\n<RxPdo>\n<Index>#x16zz</Index></RxPdo>"),
		      "t.xml:7: Index: \"#x16zz\" is no number (#x1F or 31)");
	check_refused(BENCH_DEVICE("<RxPdo Sm=\"16\"></RxPdo>"),
		      "t.xml:5: Sm: 16 is not within 0 to 15");
	check_refused(BENCH_DEVICE("<TxPdo><Index>#x10000</Index></TxPdo>"),
		      "t.xml:5: Index: #x10000 is not within 0 to 65535");
	check_refused(
		BENCH_DEVICE("<Mailbox><CoE><InitCmd><Data>0x2</Data></InitCmd></CoE></Mailbox>"),
		"t.xml:5: Data: \"0x2\" is no row of hexadecimal octets");
	check_refused("<html/>", "t.xml:1: no ESI: <html> instead of <EtherCATInfo>");
	check_refused("<EtherCATInfo>\n<Vendor>", "t.xml:2: no XML: no element found");
	check_refused("", "t.xml:1: no XML: no element found");
	check_refused("<EtherCATInfo><Descriptions><Devices><Device>",
		      "t.xml:1: a device without <Vendor><Id> before it");
}

TEST(esi, devices_before_an_error_are_kept)
{
	struct seen seen =
		bench_text(BENCH_HEAD "<Device><Type ProductCode=\"1\">A</Type></Device>"
				      "<Device><Type ProductCode=\"x\">B</Type></Device>");

	CHECK_EQ(seen.result, -EBADMSG);
	CHECK_EQ(seen.count, 1);
	bench_free(&seen);
}

TEST(esi, list_of_files_has_a_vendor_for_each)
{
	struct seen seen = bench_text(
		"<EtherCATInfoList><EtherCATInfo><Vendor><Id>1</Id></Vendor><Descriptions><Devices>"
		"<Device><Type>A</Type></Device></Devices></Descriptions></EtherCATInfo>"
		"<EtherCATInfo><Vendor><Id>2</Id></Vendor><Descriptions><Devices>"
		"<Device><Type>B</Type></Device></Devices></Descriptions></EtherCATInfo>"
		"</EtherCATInfoList>");

	CHECK_EQ(seen.result, 0);
	CHECK_EQ(seen.count, 2);
	CHECK_EQ(seen.device[0]->id.vendor, 1);
	CHECK_EQ(seen.device[1]->id.vendor, 2);
	bench_free(&seen);
}
