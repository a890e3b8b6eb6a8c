/* SPDX-License-Identifier: MIT */
/*
 * What vendors' ESI files say of slaves, at the bus: time-outs, units and names, and the commands
 * of the modules that a modular slave has.
 */
#include <errno.h>
#include <stdio.h>
#include <unistd.h>

#include "base/bytes.h"
#include "config/sdo_value.h"
#include "devices/catalogue.h"
#include "devices/wago_750_354.h"
#include "harness/test.h"
#include "sim/harness/run_dir.h"
#include "sim/harness/virtual_master.h"
#include "wire/al.h"

static struct virtual_bench b;
static struct virtual_master vm;

/* A folder with one ESI file. */
struct vendor {
	char dir[64];
	char path[96];
	char setting[96];
};

static struct vendor vendor_says(const char *text)
{
	struct vendor v;
	FILE *file;

	run_dir_make(v.dir, sizeof(v.dir));
	snprintf(v.path, sizeof(v.path), "%s/v.xml", v.dir);
	snprintf(v.setting, sizeof(v.setting), "bus.esi_dir=%s", v.dir);
	file = fopen(v.path, "we");
	CHECK(file != NULL);
	CHECK(fputs(text, file) >= 0);
	CHECK_EQ(fclose(file), 0);
	return v;
}

static void vendor_remove(const struct vendor *v)
{
	unlink(v->path);
	run_dir_remove(v->dir);
}

#define ESI(vendor, devices, modules)                                                              \
	"<EtherCATInfo><Vendor><Id>" vendor "</Id></Vendor><Descriptions><Devices>" devices        \
	"</Devices><Modules>" modules "</Modules></Descriptions></EtherCATInfo>"
#define DEVICE(product, inside)                                                                    \
	"<Device><Type ProductCode=\"" product "\" RevisionNo=\"0\">D</Type>" inside "</Device>"

static void open_up(unsigned slaves, virtual_slave_maker make, const char *const *settings)
{
	virtual_bench_init(&b, &(struct virtual_spec){ .slaves = slaves, .make = make, .seed = 5 });
	virtual_master_init(&vm, &b, settings);
}

static void bring_up(void)
{
	if (virtual_master_bring_up(&vm) < 0) {
		test_fail(__FILE__, __LINE__, "%s", vm.failure.text);
	}
}

static struct admin_reply read_object(uint16_t pos, uint16_t index, uint8_t subindex)
{
	struct admin_request rq = { .magic = ADMIN_MAGIC,
				    .verb = ADMIN_SDO_READ,
				    .slave_pos = pos,
				    .index = index,
				    .subindex = subindex };

	return virtual_master_ask(&vm, &rq);
}

/* --- time-outs --- */

static int bring_to_init(const char *esi_dir)
{
	const char *const settings[] = { "bus.target=init", "bus.scan_timeout=1s", esi_dir, NULL };
	int r;

	open_up(2, NULL, settings);
	virtual_bench_fault(&b, "at=0s slow slave=1 state=init by=3s");
	r = virtual_master_bring_up(&vm);
	CHECK_EQ(virtual_bench_al_status(&b, 1) & AL_STATE_MASK, r == 0 ? AL_INIT : AL_PREOP);
	virtual_master_close(&vm);
	return r;
}

TEST(described, a_slave_goes_back_to_init_in_the_time_its_vendor_gives_it)
{
	struct vendor v = vendor_says(
		ESI("2",
		    DEVICE("#x04570862", "<Info><StateMachine><Timeout><BackToInitTimeout>"
					 "5000</BackToInitTimeout></Timeout></StateMachine>"
					 "</Info>"),
		    ""));

	CHECK_EQ(bring_to_init(v.setting), 0);
	CHECK(bring_to_init(NULL) < 0);
	vendor_remove(&v);
}

static int make_of(const char *name, int position, struct segment_slave_spec *ret_spec)
{
	static struct slave_model model;

	CHECK_EQ(catalogue_find(name, &model), 0);
	return catalogue_slave(&model, position, ret_spec);
}

static int make_terminal(int position, struct segment_slave_spec *ret_spec)
{
	return make_of("el3104", position, ret_spec);
}

/* The mail of the first request lies there, so that there is no room for the second. */
static int read_behind_a_mail(const char *esi_dir)
{
	const char *const settings[] = { "bus.mailbox_timeout=200ms", "bus.target=preop", esi_dir,
					 NULL };
	int r;

	open_up(1, make_terminal, settings);
	bring_up();
	virtual_bench_fault(&b, "at=0s mailbox kind=busy count=1200 slave=0");
	CHECK_EQ(read_object(0, 0x1018, 1).result, -ETIMEDOUT);
	r = read_object(0, 0x1018, 1).result;
	virtual_master_close(&vm);
	return r;
}

TEST(described, a_mailbox_takes_a_mail_in_the_time_its_vendor_gives_it)
{
	struct vendor v = vendor_says(
		ESI("2",
		    DEVICE("#x0c203052", "<Info><Mailbox><Timeout><RequestTimeout>4000"
					 "</RequestTimeout></Timeout></Mailbox></Info>"),
		    ""));

	CHECK_EQ(read_behind_a_mail(v.setting), 0);
	CHECK_EQ(read_behind_a_mail(NULL), -ETIMEDOUT);
	vendor_remove(&v);
}

/* --- the object dictionary --- */

static const struct channel *channel_of(uint16_t index, uint8_t subindex)
{
	size_t bytes;
	const struct sample_meta *meta = ring_meta(vm.samples, &bytes);

	for (uint32_t i = 0; i < meta->channel_count; i++) {
		const struct channel *ch = &sample_meta_channels(meta)[i];

		if (ch->index == index && ch->subindex == subindex) {
			return ch;
		}
	}
	test_fail(__FILE__, __LINE__, "no channel of 0x%04x:%02x", index, subindex);
}

#define BOARD_DICTIONARY                                                                           \
	"<Profile><Dictionary><DataTypes><DataType><Name>DT6000</Name>"                            \
	"<SubItem><SubIdx>1</SubIdx><Name>adc</Name><Type>UINT</Type></SubItem>"                   \
	"<SubItem><SubIdx>3</SubIdx><Name>time</Name><Type>ULINT</Type></SubItem></DataType>"      \
	"</DataTypes><Objects><Object><Index>#x6000</Index><Name>In</Name><Type>DT6000</Type>"     \
	"<Info><SubItem><Name>adc</Name><Info><Unit>#x00040000</Unit></Info></SubItem>"            \
	"<SubItem><Name>time</Name><Info><Unit>#xF7030000</Unit></Info></SubItem></Info>"          \
	"</Object></Objects></Dictionary></Profile>"

TEST(described, units_of_a_slave_that_gives_none_are_those_of_its_esi)
{
	struct vendor v = vendor_says(ESI("2", DEVICE("#x04570862", BOARD_DICTIONARY), ""));
	const char *const settings[] = { v.setting, "slaves[0].name=a", "slaves[1].name=b", NULL };

	open_up(2, NULL, settings);
	bring_up();
	CHECK_EQ(virtual_master_run(&vm, 200), SESSION_GOES_ON);
	CHECK_STR(channel_of(0x6000, 3)->unit, "ns");
	CHECK_STR(channel_of(0x6000, 1)->unit, "V"); /* what the board is known to measure */
	CHECK_STR(channel_of(0x6000, 2)->unit, "");
	virtual_master_close(&vm);
	vendor_remove(&v);
}

static int make_gauge(int position, struct segment_slave_spec *ret_spec)
{
	return make_of("gauge", position, ret_spec);
}

static struct slave_info first_slave(void)
{
	return session_page(vm.session)->slave[0].info;
}

TEST(described, what_the_slave_says_of_its_units_goes_before_its_esi)
{
	const char *const settings[] = { NULL, NULL };
	char text[1024];
	char product[16];
	struct vendor v;
	struct slave_info info;

	open_up(1, make_gauge, settings);
	bring_up();
	info = first_slave();
	virtual_master_close(&vm);
	snprintf(product, sizeof(product), "#x%08x", info.product);
	snprintf(text, sizeof(text),
		 "<EtherCATInfo><Vendor><Id>#x%08x</Id></Vendor><Descriptions><Devices><Device>"
		 "<Type ProductCode=\"%s\" RevisionNo=\"0\">G</Type><Profile><Dictionary>"
		 "<DataTypes><DataType><Name>R</Name><SubItem><SubIdx>1</SubIdx><Name>x</Name>"
		 "<Type>INT</Type></SubItem></DataType></DataTypes><Objects><Object>"
		 "<Index>#x6000</Index><Type>R</Type><Info><SubItem><Name>x</Name><Info>"
		 "<Unit>#x00040000</Unit></Info></SubItem></Info></Object></Objects></Dictionary>"
		 "</Profile></Device></Devices></Descriptions></EtherCATInfo>",
		 info.vendor, product);
	v = vendor_says(text);
	open_up(1, make_gauge, (const char *const[]){ v.setting, NULL });
	bring_up();
	CHECK_EQ(virtual_master_run(&vm, 200), SESSION_GOES_ON);
	CHECK(channel_of(0x6000, 1)->unit[0] != '\0');
	CHECK(strcmp(channel_of(0x6000, 1)->unit, "A") != 0);
	virtual_master_close(&vm);
	vendor_remove(&v);
}

/* --- modules --- */

#define COUPLER                                                                                    \
	DEVICE("#x07500354", "<Slots SlotPdoIncrement=\"1\" SlotIndexIncrement=\"#x10\">"          \
			     "<Slot MinInstances=\"0\" MaxInstances=\"64\"><Name>T</Name>"         \
			     "<ModuleIdent>#x04570000</ModuleIdent></Slot></Slots>")
#define COMMAND(depends, index, subindex, data)                                                    \
	"<InitCmd><Transition>IP</Transition><Index" depends ">" index                             \
	"</Index><SubIndex>" subindex "</SubIndex><Data>" data "</Data></InitCmd>"
#define MODULE(ident, inside) "<Module><Type ModuleIdent=\"" ident "\">M</Type>" inside "</Module>"
/* An analog input in slot 1 and an output in slot 2, counted from 1. */
#define INPUTS                                                                                     \
	MODULE("#x04570000",                                                                       \
	       "<TxPdo><Index DependOnSlot=\"1\">#x1a00</Index><Name>Analog inputs</Name></TxPdo>" \
	       "<Profile><Dictionary><DataTypes><DataType><Name>A</Name><BaseType>INT</BaseType>"  \
	       "<ArrayInfo><LBound>1</LBound><Elements>4</Elements></ArrayInfo></DataType>"        \
	       "<DataType><Name>R</Name><SubItem><Name>E</Name><Type>A</Type></SubItem>"           \
	       "</DataType></DataTypes><Objects><Object><Index DependOnSlot=\"1\">#x6000</Index>"  \
	       "<Name>In</Name><Type>R</Type><Info><Unit>#xFD260000</Unit></Info></Object>"        \
	       "</Objects></Dictionary></Profile>")
#define OUTPUTS                                                                                    \
	MODULE("#x05570000",                                                                       \
	       "<RxPdo><Index DependOnSlot=\"1\">#x1600</Index><Name>Analog "                      \
	       "outputs</Name></RxPdo>"                                                            \
	       "<Mailbox><CoE>" COMMAND(" DependOnSlot=\"1\"", "#x7000", "1", "3412") COMMAND(     \
		       "", "#xf200", "5", "0700") "</CoE></Mailbox><Profile><Dictionary>"          \
						  "<DataTypes><DataType><Name>R</"                 \
						  "Name><SubItem><SubIdx>2</SubIdx><Name>x</Name>" \
						  "<Type>INT</Type></SubItem></DataType></"        \
						  "DataTypes><Objects><Object>"                    \
						  "<Index "                                        \
						  "DependOnSlot=\"1\">#x7000</Index><Type>R</"     \
						  "Type><Info><SubItem><Name>x"                    \
						  "</Name><Info><Unit>#x00260000</Unit></Info></"  \
						  "SubItem></Info></Object></Objects>"             \
						  "</Dictionary></Profile>")

static int make_coupler(int position, struct segment_slave_spec *ret_spec)
{
	return wago_750_354_by_name(position, "wago_750_354", ret_spec);
}

static struct vendor coupler(void)
{
	return vendor_says(ESI("#x21", COUPLER, INPUTS OUTPUTS));
}

TEST(described, start_up_commands_of_a_module_go_to_the_objects_of_its_slot)
{
	struct vendor v = coupler();
	const char *const settings[] = { v.setting, "bus.target=preop", NULL };

	open_up(1, make_coupler, settings);
	bring_up();
	CHECK_EQ(get_le16(read_object(0, 0x7010, 1).data), 0x1234);
	CHECK_EQ(get_le16(read_object(0, 0xf200, 5).data), 7);
	virtual_master_close(&vm);
	vendor_remove(&v);
}

TEST(described, a_configured_start_up_sdo_replaces_that_of_a_module)
{
	struct vendor v = coupler();
	const char *const settings[] = { v.setting, "bus.target=preop", "slaves[0].name=w", NULL };

	open_up(1, make_coupler, settings);
	vm.cfg.sdo[0] = (struct config_sdo){ .transition = CONFIG_TRANSITION_IP,
					     .index = 0x7010,
					     .subindex = 1,
					     .type = SDO_UINT,
					     .bytes = 2,
					     .value = 3 };
	vm.cfg.sdo_count = 1;
	bring_up();
	CHECK_EQ(get_le16(read_object(0, 0x7010, 1).data), 3);
	CHECK_EQ(get_le16(read_object(0, 0xf200, 5).data), 7);
	virtual_master_close(&vm);
	vendor_remove(&v);
}

/* Slot 2 has the output module: told to be an input, it has no command. */
static void check_configured(struct config_sdo sdo, const void *octets)
{
	struct vendor v = coupler();
	const char *const settings[] = { v.setting, "bus.target=preop", "slaves[0].name=w", NULL };

	open_up(1, make_coupler, settings);
	sdo.index = 0xf030;
	sdo.transition = CONFIG_TRANSITION_OS; /* the simulated coupler has no such object */
	vm.cfg.sdo[0] = sdo;
	vm.cfg.sdo_count = 1;
	if (octets != NULL) {
		memcpy(vm.cfg.octets, octets, sdo.bytes);
		vm.cfg.octet_count = sdo.bytes;
	}
	bring_up();
	CHECK_EQ(get_le16(read_object(0, 0xf200, 5).data), 0);
	virtual_master_close(&vm);
	vendor_remove(&v);
}

TEST(described, a_configured_module_goes_before_the_one_that_is_found)
{
	static const uint8_t both[] = { 2, 0, 0, 0, 0x57, 4, 0, 0, 0x57, 4 };
	static const char number[] = "0x04570000";

	check_configured(
		(struct config_sdo){
			.subindex = 2, .type = SDO_UDINT, .bytes = 4, .value = 0x04570000 },
		NULL);
	check_configured((struct config_sdo){ .subindex = 2,
					      .type = CONFIG_SDO_AUTO,
					      .bytes = sizeof(number) - 1 },
			 number);
	check_configured((struct config_sdo){ .is_complete = 1,
					      .type = CONFIG_SDO_OCTETS,
					      .bytes = sizeof(both) },
			 both);
}

TEST(described, channels_of_a_module_have_the_units_and_names_of_its_esi)
{
	struct vendor v = coupler();
	const char *const settings[] = { v.setting, NULL };

	open_up(1, make_coupler, settings);
	bring_up();
	CHECK_EQ(virtual_master_run(&vm, 200), SESSION_GOES_ON);
	CHECK_STR(channel_of(0x6000, 1)->unit, "mV");
	CHECK_STR(channel_of(0x6000, 4)->unit, "mV");
	CHECK_STR(channel_of(0x7010, 1)->unit, "");
	CHECK_STR(channel_of(0x7010, 2)->unit, "V");
	CHECK(strstr(channel_of(0x6000, 1)->name, "analog_inputs") != NULL);
	CHECK(strstr(channel_of(0x7010, 1)->name, "analog_outputs") != NULL);
	virtual_master_close(&vm);
	vendor_remove(&v);
}
