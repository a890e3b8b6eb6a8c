/* SPDX-License-Identifier: MIT */
/* Every mailbox protocol through the admin socket, in PRE-OP and in OP beside the cycle. */
#include <errno.h>
#include <sys/socket.h>
#include <unistd.h>

#include "base/bytes.h"
#include "devices/catalogue.h"
#include "devices/fb1111_piccolo.h"
#include "harness/test.h"
#include "sim/harness/virtual_master.h"
#include "wire/aoe.h"
#include "wire/eoe.h"
#include "wire/foe.h"
#include "wire/soe.h"

enum {
	BOARD = 0,
	DRIVE = 1,
	ALL_PROTOCOLS = 0x3f,
	SDO_INFORMATION = 0x02, /* of the CoE details */
	FILE_BYTES = 5000,
	PASSWORD = 4711,
	IDN_CYCLE = 1, /* S-0-0001: 250 to 10000 us */
	VENDOR = 0x6a,
};

static struct virtual_bench b;
static struct virtual_master vm;
static struct virtual_transfer tr;
static struct admin_request rq;
static uint8_t file[FILE_BYTES];

static int make(int position, struct segment_slave_spec *ret_spec)
{
	static struct slave_model model;

	if (position != DRIVE) {
		return fb1111_piccolo_slave(position, ret_spec);
	}
	CHECK_EQ(catalogue_find("akd", &model), 0);
	model.sii.mailbox_protocols |= ALL_PROTOCOLS;
	model.sii.coe_details |= SDO_INFORMATION;
	return catalogue_slave(&model, position, ret_spec);
}

static void open_bench(const char *setting)
{
	const char *const settings[] = { setting, NULL };

	virtual_bench_init(&b, &(struct virtual_spec){ .slaves = 2, .make = make, .seed = 21 });
	virtual_master_init_waiting(&vm, &b, settings);
	for (size_t i = 0; i < sizeof(file); i++) {
		file[i] = (uint8_t)(i * 7 + i / 256);
	}
}

static void close_bench(void)
{
	virtual_master_kill(&vm);
	virtual_bench_done(&b);
}

static void drive_set(const char *key, const char *value)
{
	struct sim_device *dev = segment_device(b.segment, DRIVE);

	CHECK_EQ(dev->ops->io_set(dev, key, value), 0);
}

/* A request to the drive; the caller completes it. */
static void begin(enum admin_verb verb)
{
	rq = (struct admin_request){ .magic = ADMIN_MAGIC, .verb = verb, .slave_pos = DRIVE };
	tr = (struct virtual_transfer){ .data = NULL };
}

static struct admin_reply ask(void)
{
	return virtual_master_transfer(&vm, &rq, &tr);
}

static void ask_well(size_t answer_len)
{
	struct admin_reply reply = ask();

	CHECK_STR(reply.text, "");
	CHECK_EQ(reply.result, 0);
	CHECK_EQ(tr.answer_len, answer_len);
}

static void ask_in_vain(uint32_t code, const char *text)
{
	struct admin_reply reply = ask();

	CHECK(reply.result < 0);
	CHECK_EQ(reply.slave_code, code);
	CHECK_STR(reply.text, text);
	CHECK_EQ(tr.answer_len, 0);
}

/* --- one protocol each --- */

static void check_sdo(void)
{
	struct admin_sdo_object object;
	struct admin_sdo_entry entry;

	begin(ADMIN_SDO_READ);
	rq.index = 0x1018;
	rq.subindex = 1;
	ask_well(4);
	begin(ADMIN_SDO_LIST);
	rq.argument[0] = 1;
	CHECK_EQ(ask().result, 0);
	CHECK(tr.answer_len >= 6 && tr.answer_len % 2 == 0);
	CHECK_EQ(get_le16(tr.answer), 0x1000);
	begin(ADMIN_SDO_OBJECT);
	rq.index = 0x1018;
	ask_well(sizeof(object));
	memcpy(&object, tr.answer, sizeof(object));
	CHECK_EQ(object.index, 0x1018);
	CHECK_EQ(object.object_code, 9);
	begin(ADMIN_SDO_ENTRY);
	rq.index = 0x1018;
	rq.subindex = 2;
	ask_well(sizeof(entry));
	memcpy(&entry, tr.answer, sizeof(entry));
	CHECK_EQ(entry.subindex, 2);
	CHECK_EQ(entry.bit_len, 32);
	begin(ADMIN_SDO_OBJECT);
	rq.index = 0x7777;
	ask_in_vain(0x06020000, "slave 1 (akd1): description of object 0x7777: "
				"object does not exist (0x06020000)");
}

static void check_foe(void)
{
	drive_set("foe.password", "4711");
	begin(ADMIN_FOE_WRITE);
	snprintf(rq.name, sizeof(rq.name), "a.bin");
	rq.argument[0] = PASSWORD;
	tr.data = file;
	tr.data_len = FILE_BYTES;
	ask_well(0);
	CHECK(tr.reports > 0);
	begin(ADMIN_FOE_READ);
	snprintf(rq.name, sizeof(rq.name), "a.bin");
	rq.argument[0] = PASSWORD;
	ask_well(FILE_BYTES);
	CHECK_EQ(memcmp(tr.answer, file, FILE_BYTES), 0);
	begin(ADMIN_FOE_READ);
	snprintf(rq.name, sizeof(rq.name), "a.bin");
	ask_in_vain(FOE_ERROR_NO_RIGHTS,
		    "slave 1 (akd1): FoE read of a.bin: no access rights (0x800a): password");
}

static void check_soe(void)
{
	begin(ADMIN_SOE_WRITE);
	rq.index = IDN_CYCLE;
	rq.argument[0] = SOE_ELEMENT_VALUE;
	rq.data_len = 2;
	put_le16(rq.data, 2000);
	ask_well(0);
	begin(ADMIN_SOE_READ);
	rq.index = IDN_CYCLE;
	rq.argument[0] = SOE_ELEMENT_VALUE;
	ask_well(2);
	CHECK_EQ(get_le16(tr.answer), 2000);
	begin(ADMIN_SOE_WRITE);
	rq.index = IDN_CYCLE;
	rq.argument[0] = SOE_ELEMENT_VALUE;
	rq.data_len = 2;
	put_le16(rq.data, 20000);
	ask_in_vain(SOE_ERROR_ABOVE_MAX, "slave 1 (akd1): SoE write of S-0-0001 of drive 0: value "
					 "above its maximum (0x7007)");
}

static void check_eoe(void)
{
	const struct eoe_ip ip = { .flags = EOE_HAS_ADDRESS | EOE_HAS_NETMASK,
				   .address = { 192, 168, 7, 9 },
				   .netmask = { 255, 255, 255, 0 } };
	struct eoe_ip got;

	begin(ADMIN_EOE_IP_WRITE);
	rq.data_len = EOE_IP_BYTES;
	eoe_ip_put(rq.data, &ip);
	ask_well(0);
	begin(ADMIN_EOE_IP_READ);
	ask_well(EOE_IP_BYTES);
	CHECK_EQ(eoe_ip_get(tr.answer, tr.answer_len, &got), 0);
	CHECK_EQ(memcmp(got.address, ip.address, 4), 0);
	begin(ADMIN_EOE_IP_WRITE);
	rq.data_len = 5;
	put_le32(rq.data, EOE_HAS_ADDRESS);
	ask_in_vain(0, "5 bytes of data are too few for this request");
}

static void check_aoe(void)
{
	begin(ADMIN_AOE_READ);
	rq.argument[0] = AOE_GROUP_SDO;
	rq.argument[1] = aoe_sdo_offset(0x1018, 2);
	rq.argument[2] = 1001;
	rq.length = 4;
	snprintf(rq.name, sizeof(rq.name), "5.0.0.0.2.1");
	ask_well(4);
	begin(ADMIN_AOE_READ);
	rq.argument[0] = 0x4020;
	rq.argument[2] = 1001;
	rq.length = 4;
	ask_in_vain(AOE_ERROR_GROUP, "slave 1 (akd1): AoE read of group 0x4020, offset 0x0, port "
				     "1001: invalid index group (0x0702)");
}

static void check_voe(void)
{
	begin(ADMIN_VOE);
	rq.argument[0] = VENDOR;
	rq.argument[1] = 7;
	rq.data_len = 3;
	memcpy(rq.data, "abc", 3);
	ask_well(5);
	CHECK_EQ(get_le16(tr.answer), 7);
	CHECK_EQ(memcmp(tr.answer + 2, "abc", 3), 0);
	begin(ADMIN_VOE);
	rq.argument[0] = VENDOR;
	rq.argument[2] = 1;
	rq.data_len = 3;
	ask_well(0);
}

static void check_all(void)
{
	check_sdo();
	check_foe();
	check_soe();
	check_eoe();
	check_aoe();
	check_voe();
}

TEST(mailbox_requests, every_protocol_is_served_in_preop)
{
	open_bench("bus.target=preop");
	CHECK_EQ(virtual_master_bring_up(&vm), 0);
	check_all();
	close_bench();
}

TEST(mailbox_requests, every_protocol_is_served_in_op_and_no_cycle_is_disturbed)
{
	open_bench("bus.target=op");
	virtual_master_settle(&vm);
	check_all();
	virtual_master_check_undisturbed(&vm, 1000);
	close_bench();
}

TEST(mailbox_requests, a_slave_without_the_protocol_is_named)
{
	open_bench("bus.target=preop");
	CHECK_EQ(virtual_master_bring_up(&vm), 0);
	begin(ADMIN_SOE_READ);
	rq.slave_pos = BOARD;
	rq.argument[0] = SOE_ELEMENT_VALUE;
	ask_in_vain(0, "slave 0 (piccolo0): SoE read of S-0-0000 of drive 0: the slave has no SoE "
		       "mailbox in this state");
	close_bench();
}

TEST(mailbox_requests, a_cancelled_file_is_ended_at_the_slave_and_can_be_written_again)
{
	struct admin_request cancel = { .magic = ADMIN_MAGIC, .verb = ADMIN_CANCEL };
	struct admin_reply reply = { .kind = ADMIN_REPLY_PROGRESS };
	int fd;

	open_bench("bus.target=preop");
	CHECK_EQ(virtual_master_bring_up(&vm), 0);
	drive_set("foe.busy", "-1");
	begin(ADMIN_FOE_WRITE);
	snprintf(rq.name, sizeof(rq.name), "a.bin");
	rq.data_len = 100;
	fd = virtual_master_connect(&vm);
	CHECK_EQ(send(fd, &rq, sizeof(rq), 0), sizeof(rq));
	CHECK_EQ(virtual_master_run(&vm, 200), SESSION_GOES_ON);
	CHECK_EQ(send(fd, &cancel, sizeof(cancel), 0), sizeof(cancel));
	CHECK_EQ(virtual_master_run(&vm, 200), SESSION_GOES_ON);
	CHECK_EQ(recv(fd, &reply, sizeof(reply), MSG_DONTWAIT), sizeof(reply));
	CHECK_EQ(reply.result, -ECANCELED);
	close(fd);
	drive_set("foe.busy", "0");
	begin(ADMIN_FOE_WRITE);
	snprintf(rq.name, sizeof(rq.name), "a.bin");
	tr.data = file;
	tr.data_len = FILE_BYTES;
	ask_well(0);
	close_bench();
}
