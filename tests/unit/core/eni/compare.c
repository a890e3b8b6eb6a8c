/* SPDX-License-Identifier: MIT */
#include <stdio.h>
#include <stdlib.h>

#include "bench.h"
#include "eni/compare.h"

enum { KEPT = 16 };

struct found {
	struct eni_difference difference[KEPT];
	size_t count;
};

static void keep(void *ctx, const struct eni_difference *difference)
{
	struct found *found = ctx;

	CHECK(found->count < KEPT);
	found->difference[found->count++] = *difference;
}

/* bench_foreign against itself with the first @old replaced by @put. */
static struct found compare(const char *old, const char *put)
{
	struct found found = { .count = 0 };
	struct seen ours = bench_read(bench_foreign);
	char *text = NULL;
	size_t len = 0;
	FILE *out = open_memstream(&text, &len);
	const char *at = strstr(bench_foreign, old);
	struct seen theirs;
	struct eni_compare c = { .ours = ours.eni, .found = keep, .ctx = &found };

	CHECK(out != NULL && at != NULL);
	fprintf(out, "%.*s%s%s", (int)(at - bench_foreign), bench_foreign, put, at + strlen(old));
	fclose(out);
	theirs = bench_read(text);
	CHECK_STR(theirs.error, "");
	c.theirs = theirs.eni;
	eni_compare_all(&c);
	eni_free(ours.eni);
	eni_free(theirs.eni);
	free(text);
	return found;
}

struct expected {
	enum eni_weight weight;
	const char *what;
	const char *theirs;
	const char *ours;
};

static void check_one(const char *old, const char *put, struct expected want)
{
	struct found found = compare(old, put);

	CHECK_EQ(found.count, 1);
	CHECK_STR(found.difference[0].what, want.what);
	CHECK_STR(found.difference[0].theirs, want.theirs);
	CHECK_STR(found.difference[0].ours, want.ours);
	CHECK_EQ(found.difference[0].weight, want.weight);
}

TEST(eni_compare, a_file_does_not_differ_from_itself)
{
	CHECK_EQ(compare("K2.Out", "K2.Out").count, 0);
}

TEST(eni_compare, identity_of_a_slave_is_compared)
{
	check_one("<RevisionNo>1114112<", "<RevisionNo>#x120000<",
		  (struct expected){ ENI_WRONG_SLAVE, "revision", "0x120000", "0x110000" });
	check_one("<VendorId>#x2<", "<VendorId>3<",
		  (struct expected){ ENI_WRONG_SLAVE, "vendor", "0x0003", "0x0002" });
	check_one("Klemme 2 & 3", "T2",
		  (struct expected){ ENI_ALLOWED, "name", "T2", "Klemme 2 & 3" });
	check_one("<PhysAddr>1001", "<PhysAddr>1002",
		  (struct expected){ ENI_ALLOWED, "station address", "0x03ea", "0x03e9" });
}

TEST(eni_compare, a_slave_more_is_named)
{
	check_one("<Cyclic>",
		  "<Slave><Info><Name>X</Name><VendorId>5</VendorId><ProductCode>6</ProductCode>"
		  "</Info></Slave><Cyclic>",
		  (struct expected){ ENI_WRONG_SLAVE, "slave", "X 0x00000005 0x00000006", "none" });
}

TEST(eni_compare, sync_managers_and_fmmus_are_compared_by_what_they_do)
{
	check_one("8011020020000100", "8011040020000100",
		  (struct expected){ ENI_DIFFERENT, "SM3 bytes", "4", "2" });
	check_one("<ControlByte>#x64", "<ControlByte>#x24",
		  (struct expected){ ENI_DIFFERENT, "SM2 watchdog", "0", "1" });
	check_one("00000001010000070011000201000000", "00000002010000070011000201000000",
		  (struct expected){ ENI_ALLOWED, "FMMU of 0x1100.0", "0x02000000.0, 1 bytes",
				     "0x01000000.0, 1 bytes" });
	check_one("00000001010000070011000201000000", "00000001010000030011000201000000",
		  (struct expected){ ENI_DIFFERENT, "bits of the FMMU of 0x1100.0", "4", "8" });
	check_one("00000001010000070011000201000000", "00000001010000070011000200000000",
		  (struct expected){ ENI_DIFFERENT, "FMMU of 0x1100.0", "none",
				     "0x01000000.0, 1 bytes" });
}

TEST(eni_compare, pdos_are_compared_by_index_and_entries)
{
	check_one("<RxPdo><Index>#x1601", "<RxPdo Sm=\"2\"><Index>#x1601",
		  (struct expected){ ENI_DIFFERENT, "PDOs of SM2", "0x1600 0x1601", "0x1600" });
	check_one("<SubIndex>#x01<", "<SubIndex>2<",
		  (struct expected){ ENI_DIFFERENT, "entry 1 of PDO 0x1600", "0x7000:02, 1 bits",
				     "0x7000:01, 1 bits" });
}

TEST(eni_compare, start_up_commands_are_compared_with_their_data)
{
	struct found found = compare("0200aBcD", "0200aBcE");

	CHECK_EQ(found.count, 2);
	CHECK_STR(found.difference[0].what, "start-up command 0x8000:00");
	CHECK_STR(found.difference[0].theirs, "complete access, 0200abce");
	CHECK_STR(found.difference[0].ours, "none");
	CHECK_STR(found.difference[1].theirs, "none");
	CHECK_EQ(found.difference[1].weight, ENI_DIFFERENT);
	found = compare("</InitCmds></CoE>",
			"<InitCmd><Transition>PS</Transition><Ccs>1</Ccs><Index>#x1c12</Index>"
			"<SubIndex>0</SubIndex><Data>00</Data></InitCmd></InitCmds></CoE>");
	CHECK_EQ(found.count, 1);
	CHECK_EQ(found.difference[0].weight, ENI_ALLOWED);
}

TEST(eni_compare, clocks_and_watchdogs_are_compared)
{
	check_one("<ShiftTime>-10", "<ShiftTime>-20",
		  (struct expected){ ENI_DIFFERENT, "SYNC0 shift in ns", "-20", "-10" });
	check_one("<ReferenceClock>true", "<ReferenceClock>0",
		  (struct expected){ ENI_DIFFERENT, "reference clock", "0", "1" });
	check_one("<InitCmd><Transition>PS</Transition><BeforeSlave>",
		  "<InitCmd><Transition>PS</Transition><Cmd>5</Cmd><Ado>#x420</Ado>"
		  "<Data>e803</Data></InitCmd>"
		  "<InitCmd><Transition>PS</Transition><BeforeSlave>",
		  (struct expected){ ENI_DIFFERENT, "register 0x0420 (process data watchdog)",
				     "0x03e8", "0x0000" });
	check_one("<InitCmd><Transition>PS</Transition><BeforeSlave>",
		  "<InitCmd><Transition>PS</Transition><Comment>user</Comment><Cmd>5</Cmd>"
		  "<Ado>#xf80</Ado><Data>01</Data></InitCmd>"
		  "<InitCmd><Transition>PS</Transition><BeforeSlave>",
		  (struct expected){ ENI_ALLOWED, "write of register 0x0f80", "user", "none" });
}

TEST(eni_compare, frames_are_compared_by_bytes_and_working_counter)
{
	struct found found = compare("<Cnt>3<", "<Cnt>2<");

	CHECK_EQ(found.count, 2);
	CHECK_STR(found.difference[0].what, "expected working counter");
	CHECK_EQ(found.difference[0].weight, ENI_DIFFERENT);
	CHECK_STR(found.difference[1].what, "process data datagram 0");
	CHECK_EQ(found.difference[1].weight, ENI_ALLOWED);
	check_one("<Addr>16777216", "<Addr>#x2000000",
		  (struct expected){ ENI_ALLOWED, "process data datagram 0",
				     "LRW 0x02000000, 4 bytes, WKC 3",
				     "LRW 0x01000000, 4 bytes, WKC 3" });
	check_one("<CycleTime>2000", "<CycleTime>1000",
		  (struct expected){ ENI_DIFFERENT, "cycle time in us", "1000", "2000" });
	CHECK_EQ(compare("<Cmd>14</Cmd><Adp>1001</Adp>", "<Cmd>13</Cmd><Adp>0</Adp>").count, 0);
}

TEST(eni_compare, time_of_the_reference_clock_must_go_round)
{
	struct found found =
		compare("<Ado>2320</Ado><DataLength>8", "<Ado>2304</Ado><DataLength>8");

	CHECK_EQ(found.count, 2);
	CHECK_STR(found.difference[0].theirs, "FRMW 0x03e9:0x0900, 8 bytes");
	CHECK_EQ(found.difference[0].weight, ENI_ALLOWED);
	CHECK_STR(found.difference[1].ours, "FRMW 0x03e9:0x0910, 8 bytes");
	CHECK_EQ(found.difference[1].weight, ENI_DIFFERENT);
}
