/* SPDX-License-Identifier: MIT */
#include <errno.h>

#include "bench.h"

#define DICTIONARY(types, objects)                                                                 \
	BENCH_DEVICE("<Profile><Dictionary>" types "<Objects>" objects                             \
		     "</Objects></Dictionary></Profile>")
#define RECORD                                                                                     \
	"<DataTypes><DataType><Name>DT6000</Name><BitSize>48</BitSize>"                            \
	"<SubItem><SubIdx>0</SubIdx><Name>SubIndex 000</Name><Type>USINT</Type></SubItem>"         \
	"<SubItem><SubIdx>1</SubIdx><Name>Voltage</Name><Type>INT</Type></SubItem>"                \
	"<SubItem><SubIdx>#x11</SubIdx><Name>Angle</Name><Type>INT16</Type></SubItem>"             \
	"</DataType><DataType><Name>INT16</Name><BaseType>INT</BaseType></DataType></DataTypes>"
#define ARRAY                                                                                      \
	"<DataTypes><DataType><Name>DT6010ARR</Name><BaseType>UINT</BaseType>"                     \
	"<ArrayInfo><LBound>1</LBound><Elements>2</Elements></ArrayInfo></DataType>"               \
	"<DataType><Name>DT6010</Name>"                                                            \
	"<SubItem><SubIdx>0</SubIdx><Name>SubIndex 000</Name><Type>USINT</Type></SubItem>"         \
	"<SubItem><Name>Elements</Name><Type>DT6010ARR</Type></SubItem></DataType></DataTypes>"
#define PART(name, unit)                                                                           \
	"<SubItem><Name>" name "</Name><Info><DefaultData>00</DefaultData>" unit "</Info></"       \
	"SubItem>"
#define UNIT(code) "<Unit>" code "</Unit>"

static const struct esi_object *object_of(const struct seen *seen, uint16_t index, uint8_t subindex)
{
	CHECK_EQ(seen->result, 0);
	CHECK_EQ(seen->count, 1);
	return esi_find_object(seen->device[0], index, subindex);
}

TEST(esi_dictionary, a_simple_object_has_its_name_type_and_unit)
{
	struct seen seen = bench_text(
		DICTIONARY("", "<Object><Index>#x2000</Index><Name LcId=\"1031\">Spannung</Name>"
			       "<Name LcId=\"1033\">Voltage</Name><Type>DINT</Type>"
			       "<Info>" UNIT("#xFD260000") "</Info></Object>"));
	const struct esi_object *object = object_of(&seen, 0x2000, 0);

	CHECK_STR(object->name, "Voltage");
	CHECK_STR(object->unit, "mV");
	CHECK_EQ(object->type, 4);
	CHECK(!object->depends_on_slot);
	CHECK(esi_find_object(seen.device[0], 0x2000, 1) == NULL);
	bench_free(&seen);
}

TEST(esi_dictionary, parts_of_a_record_go_by_their_names_in_any_order)
{
	struct seen seen = bench_text(DICTIONARY(
		RECORD,
		"<Object><Index>#x6000</Index><Name>Inputs</Name><Type>DT6000</Type><Info>" PART(
			"SubIndex 000", "") PART("Angle", UNIT("#xFF410000"))
			PART("Voltage", "") "</Info></Object>"));

	CHECK_STR(object_of(&seen, 0x6000, 1)->unit, "");
	CHECK_STR(object_of(&seen, 0x6000, 1)->name, "Voltage");
	CHECK_STR(object_of(&seen, 0x6000, 0x11)->name, "Angle");
	CHECK_STR(object_of(&seen, 0x6000, 0x11)->unit, "1e-1 deg");
	CHECK_EQ(object_of(&seen, 0x6000, 0x11)->type, 3);
	CHECK_STR(object_of(&seen, 0x6000, 0)->unit, "");
	bench_free(&seen);
}

TEST(esi_dictionary, parts_with_names_of_their_own_go_by_the_order)
{
	struct seen seen = bench_text(DICTIONARY(
		RECORD,
		"<Object><Index>#x6000</Index><Name>Inputs</Name><Type>DT6000</Type><Info>" PART(
			"count", "") PART("U", UNIT("#x00260000"))
			PART("phi", UNIT("#x00410000")) "</Info></Object>"));

	CHECK_STR(object_of(&seen, 0x6000, 1)->unit, "V");
	CHECK_STR(object_of(&seen, 0x6000, 1)->name, "Voltage");
	CHECK_STR(object_of(&seen, 0x6000, 0x11)->unit, "deg");
	bench_free(&seen);
}

TEST(esi_dictionary, elements_of_an_array_have_a_name_and_a_unit_each)
{
	struct seen seen = bench_text(DICTIONARY(
		ARRAY, "<Object><Index>#x6010</Index><Name>Temperatures</Name><Type>DT6010</Type>"
		       "<Info>" PART("SubIndex 000", "") PART("Bearing", UNIT("#x002D0000"))
			       PART("Winding", "") "</Info></Object>"));

	CHECK_STR(object_of(&seen, 0x6010, 1)->name, "Bearing");
	CHECK_STR(object_of(&seen, 0x6010, 1)->unit, "degC");
	CHECK_STR(object_of(&seen, 0x6010, 2)->name, "Winding");
	CHECK_STR(object_of(&seen, 0x6010, 2)->unit, "");
	CHECK_EQ(object_of(&seen, 0x6010, 2)->type, 6);
	CHECK(object_of(&seen, 0x6010, 3) == NULL);
	bench_free(&seen);
	seen = bench_text(DICTIONARY(
		ARRAY, "<Object><Index>#x6010</Index><Name>Temperatures</Name><Type>DT6010</Type>"
		       "<Info>" PART("Bearing", UNIT("#x002D0000"))
			       PART("Winding", "") "</Info></Object>"));
	CHECK_STR(object_of(&seen, 0x6010, 1)->name, "Bearing");
	CHECK_STR(object_of(&seen, 0x6010, 1)->unit, "degC");
	bench_free(&seen);
}

TEST(esi_dictionary, an_array_ends_at_the_last_subindex_there_is)
{
	struct seen seen = bench_text(DICTIONARY(
		"<DataTypes><DataType><Name>A</Name><BaseType>BIT</BaseType><ArrayInfo>"
		"<LBound>200</LBound><Elements>4294967295</Elements></ArrayInfo></DataType>"
		"<DataType><Name>T</Name><SubItem><Name>E</Name><Type>A</Type></SubItem>"
		"</DataType></DataTypes>",
		"<Object><Index>1</Index><Type>T</Type></Object>"));

	CHECK(object_of(&seen, 1, 255) != NULL);
	CHECK(object_of(&seen, 1, 199) == NULL);
	CHECK_EQ(seen.device[0]->object_count, 56);
	bench_free(&seen);
}

TEST(esi_dictionary, a_code_of_the_vendor_has_the_symbol_that_its_file_gives)
{
	static const char types[] = DICTIONARY(
		"<UnitTypes><UnitType><NotationIndex>#xB6</NotationIndex>"
		"<Index>#x4B6</Index><Name>Bits</Name><Symbol>Bit</Symbol></UnitType>"
		"<UnitType><NotationIndex>#x26</NotationIndex><Symbol>volts</Symbol>"
		"</UnitType></UnitTypes>",
		"<Object><Index>1</Index><Type>UINT</Type><Info>" UNIT(
			"#x00B60000") "</Info>"
				      "</Object><Object><Index>2</Index><Type>UINT</"
				      "Type><Info>" UNIT(
					      "#x00260000") "</Info></Object>"
							    "<Object><Index>3</Index><Type>UINT</"
							    "Type><Info>" UNIT(
								    "#xFDB60000") "</Info>"
										  "</Object>");
	struct seen seen = bench_text(types);

	CHECK_STR(object_of(&seen, 1, 0)->unit, "Bit");
	CHECK_STR(object_of(&seen, 2, 0)->unit, "V");
	CHECK_STR(object_of(&seen, 3, 0)->unit, "");
	bench_free(&seen);
}

TEST(esi_dictionary, types_of_one_device_are_unknown_to_the_next_one)
{
	struct seen seen = bench_text(
		BENCH_HEAD
		"<Device><Type ProductCode=\"1\">A</Type><Profile><Dictionary>" RECORD
		"</Dictionary></Profile></Device>"
		"<Device><Type ProductCode=\"2\">B</Type><Profile><Dictionary><Objects>"
		"<Object><Index>#x6000</Index><Name>In</Name><Type>DT6000</Type></Object>"
		"</Objects></Dictionary></Profile></Device>" BENCH_TAIL);

	CHECK_EQ(seen.result, 0);
	CHECK_EQ(seen.count, 2);
	CHECK_EQ(seen.device[0]->object_count, 0);
	CHECK_EQ(seen.device[1]->object_count, 1);
	CHECK_EQ(esi_find_object(seen.device[1], 0x6000, 0)->type, 0);
	bench_free(&seen);
}

TEST(esi_dictionary, what_depends_on_the_slot_is_marked)
{
	struct seen seen = bench_text(
		BENCH_HEAD "</Devices><Modules><Module><Type ModuleIdent=\"5\">AI</Type><TxPdo>"
			   "<Index DependOnSlot=\"true\">#x1a00</Index><Entry>"
			   "<Index DependOnSlot=\"1\">#x6000</Index></Entry><Entry>"
			   "<Index>#xf100</Index></Entry></TxPdo><Mailbox><CoE><InitCmd>"
			   "<Index DependOnSlot=\"1\">#x8000</Index></InitCmd></CoE></Mailbox>"
			   "<Profile><Dictionary><Objects><Object>"
			   "<Index DependOnSlot=\"1\">#x6000</Index><Type>INT</Type></Object>"
			   "</Objects></Dictionary></Profile></Module></Modules></Descriptions>"
			   "</EtherCATInfo>");
	const struct esi_device *d = seen.device[0];

	CHECK_EQ(seen.result, 0);
	CHECK(d->pdo[0].depends_on_slot);
	CHECK(d->entry[0].depends_on_slot && !d->entry[1].depends_on_slot);
	CHECK(d->command[0].depends_on_slot);
	CHECK(d->object[0].depends_on_slot);
	bench_free(&seen);
}

TEST(esi_dictionary, slots_are_counted_through_and_may_have_distances_of_their_own)
{
	struct seen seen = bench_text(BENCH_DEVICE(
		"<Slots SlotPdoIncrement=\"1\" SlotIndexIncrement=\"#x10\">"
		"<Slot MinInstances=\"1\" MaxInstances=\"1\"><Name>Head</Name></Slot>"
		"<Slot MinInstances=\"0\" MaxInstances=\"2\" SlotIndexIncrement=\"#x20\">"
		"<Name>IO</Name></Slot></Slots>"));
	const struct esi_device *d = seen.device[0];

	CHECK_EQ(seen.result, 0);
	CHECK_STR(esi_find_slot(d, 0)->name, "Head");
	CHECK_EQ(esi_find_slot(d, 0)->index_increment, 0x10);
	CHECK_STR(esi_find_slot(d, 1)->name, "IO");
	CHECK_EQ(esi_find_slot(d, 2)->index_increment, 0x20);
	CHECK_EQ(esi_find_slot(d, 2)->pdo_increment, 1);
	CHECK(esi_find_slot(d, 3) == NULL);
	bench_free(&seen);
}

TEST(esi_dictionary, a_wrong_number_is_named_with_its_line)
{
	struct seen seen = bench_text(DICTIONARY(
		"", "\n<Object><Index>#x2000</Index><Info><Unit>V</Unit></Info></Object>"));

	CHECK_EQ(seen.result, -EBADMSG);
	CHECK_STR(seen.error, "t.xml:6: Unit: \"V\" is no number (#x1F or 31)");
	bench_free(&seen);
}

TEST(esi_dictionary, a_mapped_entry_is_known_by_its_pdo_then_by_its_object)
{
	struct seen seen = bench_text(BENCH_DEVICE(
		"<Profile><Dictionary><Objects><Object><Index DependOnSlot=\"1\">#x6000</Index>"
		"<Name>object</Name><Type>INT</Type><Info>" UNIT(
			"#x00260000") "</Info></Object>"
				      "</Objects></Dictionary></Profile>"
				      "<TxPdo><Index>#x1a00</Index><Name>one</Name><Entry>"
				      "<Index "
				      "DependOnSlot=\"1\">#x6000</Index><BitLen>16</"
				      "BitLen><Name>first</Name>"
				      "</Entry></TxPdo><TxPdo><Index "
				      "DependOnSlot=\"1\">#x1a01</Index><Name>two</Name>"
				      "<Entry><Index "
				      "DependOnSlot=\"1\">#x6000</Index><BitLen>16</BitLen>"
				      "<Name>second</Name><DataType>UINT</DataType></Entry></"
				      "TxPdo>"));
	const struct esi_device *d = seen.device[0];
	const struct esi_shift none = { 0, 0 };
	const struct esi_shift third = { 2, 0x20 };
	struct esi_known known = esi_find_known(d, none, 0x1a01, 0x6000, 0);

	CHECK_STR(known.pdo_name, "two");
	CHECK_STR(known.name, "second");
	CHECK_STR(known.unit, "V");
	CHECK_EQ(known.type, 6);
	known = esi_find_known(d, none, 0x1a07, 0x6000, 0);
	CHECK_STR(known.pdo_name, "");
	CHECK_STR(known.name, "first");
	CHECK_EQ(known.type, 3);
	known = esi_find_known(d, third, 0x1a03, 0x6020, 0);
	CHECK_STR(known.pdo_name, "two");
	CHECK_STR(known.name, "second");
	CHECK_STR(known.unit, "V");
	known = esi_find_known(d, third, 0x1a00, 0x6000, 0);
	CHECK_STR(known.pdo_name, "one");
	CHECK_STR(known.name, "");
	CHECK_STR(known.unit, "");
	bench_free(&seen);
}
