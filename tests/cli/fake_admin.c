/* SPDX-License-Identifier: MIT */
/* What the fake ecdaqd answers. */
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "base/admin_protocol.h"
#include "base/bytes.h"
#include "base/config_change.h"
#include "base/difference.h"
#include "base/histogram.h"
#include "base/startup_record.h"
#include "fake.h"
#include "image/image.h"
#include "wire/al.h"
#include "wire/sii.h"

/* Of slave 0: mailboxes, outputs at logical 0, inputs at 18, one that is off. */
static void make_mapping(struct fake *f)
{
	static const struct {
		uint16_t at;
		uint8_t bytes[16];
	} registers[] = {
		{ 0x0004, { 3, 4 } },
		{ 0x0600, { 0, 0, 0, 0, 9, 0, 0, 7, 0x00, 0x11, 0, 2, 1 } },
		{ 0x0610, { 18, 0, 0, 0, 13, 0, 0, 7, 0x80, 0x11, 0, 1, 1 } },
		{ 0x0620, { 31, 0, 0, 0, 13, 0, 0, 7, 0x80, 0x11, 0, 1, 0 } },
		{ 0x0800, { 0x00, 0x10, 0x80, 0, 0x26, 0, 1 } },
		{ 0x0808, { 0x80, 0x10, 0x80, 0, 0x22, 0, 1 } },
		{ 0x0810, { 0x00, 0x11, 9, 0, 0x64, 0, 1 } },
		{ 0x0818, { 0x80, 0x11, 13, 0, 0x20, 0, 0 } },
	};

	for (size_t i = 0; i < sizeof(registers) / sizeof(registers[0]); i++) {
		memcpy(f->reg + registers[i].at, registers[i].bytes,
		       registers[i].at == 0x0004  ? 2
		       : registers[i].at < 0x0800 ? 16
						  : 8);
	}
}

/* SII=FILE: an image that is one, in place of bytes of all values. */
static void read_sii(struct fake *f)
{
	FILE *file = f->sii_path == NULL ? NULL : fopen(f->sii_path, "rbe");

	if (f->sii_path != NULL && (file == NULL || fread(f->sii, 1, SII_BYTES, file) == 0)) {
		fake_die(f->sii_path, errno);
	}
	if (file != NULL) {
		fclose(file);
	}
}

void fake_listen(struct fake *f)
{
	struct sockaddr_un address = { .sun_family = AF_UNIX };

	f->listener = -1;
	f->reg[0x0130] = AL_OP;
	f->reg[0x0301] = 7;
	make_mapping(f);
	for (unsigned i = 0; i < SII_BYTES; i++) {
		f->sii[i] = (uint8_t)(i * 5 + i / 256);
	}
	put_le16(f->sii + SII_ALIAS_BYTE, 17);
	f->sii[SII_CHECKSUM_BYTE] = sii_checksum(f->sii);
	read_sii(f);
	if (strcmp(f->admin, "none") == 0) {
		return;
	}
	if (strlen(fake_path(f, CONFIG_RUN_ADMIN)) >= sizeof(address.sun_path)) {
		fake_die("admin", ENAMETOOLONG);
	}
	memcpy(address.sun_path, fake_path(f, CONFIG_RUN_ADMIN),
	       strlen(fake_path(f, CONFIG_RUN_ADMIN)));
	unlink(address.sun_path);
	f->listener = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
	if (f->listener < 0 ||
	    bind(f->listener, (const struct sockaddr *)&address, sizeof(address)) < 0 ||
	    chmod(address.sun_path, f->mode) < 0 || listen(f->listener, 4) < 0) {
		fake_die("admin", errno);
	}
}

static void refuse(struct admin_reply *reply, int result, const char *text)
{
	reply->result = result;
	snprintf(reply->text, sizeof(reply->text), "%s", text);
}

static void answer_set(struct fake *f, const struct admin_request *rq, struct admin_reply *reply)
{
	for (uint32_t i = 0; i < rq->count; i++) {
		int index = image_channel_find(f->meta.channel, CHANNELS, rq->item[i].channel);

		if (index < 0) {
			refuse(reply, -ENOENT, "no such channel");
			return;
		}
		if (strcmp(rq->item[i].channel, "piccolo1.led") == 0) {
			refuse(reply, -EPERM, "piccolo1.led: owned by program, not local");
			return;
		}
		image_set_raw(f->image, &f->meta.channel[index], rq->item[i].raw);
		fake_emit(f, EVENT_OUTPUT_SET, f->meta.channel[index].slave_pos, index, 0);
	}
	reply->cycle = f->cycle;
}

static void answer_oneshot(struct fake *f, const struct admin_request *rq,
			   struct admin_reply *reply)
{
	int64_t now_ns = fake_dc_ns(f->cycle);
	int64_t at_ns = rq->is_relative ? now_ns + rq->dc_time_ns : rq->dc_time_ns;

	if (at_ns <= now_ns) {
		refuse(reply, -ETIME, "the time is in the past");
		return;
	}
	for (unsigned i = 0; i < SLAVES; i++) {
		if (rq->slave_pos == ADMIN_ALL_SLAVES || rq->slave_pos % SLAVES == i) {
			f->armed_ns[i] = at_ns;
		}
	}
	reply->dc_time_ns = at_ns;
	reply->cycle = f->cycle;
}

static void give(struct admin_reply *reply, const void *data, uint32_t len)
{
	memcpy(reply->data, data, len);
	reply->data_len = len;
}

static void abort_sdo(struct admin_reply *reply, uint32_t code, const char *text)
{
	refuse(reply, -EREMOTEIO, text);
	reply->slave_code = code;
}

/* 0x8000:2, which no list has, and 0x8001:2, which one has. */
static int is_refresh_time(const struct admin_request *rq)
{
	return (rq->index == 0x8000 || rq->index == 0x8001) && rq->subindex == 2;
}

static void answer_read(struct fake *f, const struct admin_request *rq, struct admin_reply *reply)
{
	uint8_t bytes[4];

	if (rq->index == 0x1018 && rq->subindex == 1) {
		put_le32(bytes, 2);
		give(reply, bytes, 4);
	} else if (rq->index == 0x1008 && rq->subindex == 0) {
		give(reply, "FB1111-Piccolo", 14);
	} else if (rq->index == 0x1c12 || rq->index == 0x1c13) {
		put_le16(bytes, rq->subindex == 0 ? 1 : rq->index == 0x1c12 ? 0x1600 : 0x1a00);
		give(reply, bytes, rq->subindex == 0 ? 1 : 2);
	} else if (rq->index == 0x2000) {
		f->is_long = 1;
	} else if (is_refresh_time(rq)) {
		put_le16(bytes, f->refresh_ms);
		give(reply, bytes, 2);
	} else {
		abort_sdo(reply, 0x06020000, "slave 0 (piccolo0): SDO read: object does not exist");
	}
}

static void answer_write(struct fake *f, const struct admin_request *rq, struct admin_reply *reply)
{
	if (is_refresh_time(rq) && rq->data_len == 2) {
		f->refresh_ms = get_le16(rq->data);
		return;
	}
	abort_sdo(reply, 0x08000022, "slave 0 (piccolo0): SDO write: data cannot be stored");
}

/* Object 0x6000 has a gap and a long name, 0x7000 an entry that is not described, 0x8001 more
 * entries than are asked for at a time. */
static void answer_list(struct admin_reply *reply)
{
	static const uint16_t objects[] = { 0x6000, 0x7000, 0x8001 };
	uint8_t indices[sizeof(objects)];

	for (size_t i = 0; i < sizeof(objects) / sizeof(objects[0]); i++) {
		put_le16(indices + 2 * i, objects[i]);
	}
	give(reply, indices, sizeof(indices));
}

static void answer_object(const struct admin_request *rq, struct admin_reply *reply)
{
	struct admin_sdo_object object = { .index = rq->index,
					   .subindex_max = rq->index == 0x8001 ? 5 : 3,
					   .object_code = 9 };

	memset(object.name, 'o', sizeof(object.name) - 1);
	give(reply, &object, sizeof(object));
}

static void answer_entry(const struct admin_request *rq, struct admin_reply *reply)
{
	struct admin_sdo_entry entry = { .index = rq->index,
					 .data_type = rq->subindex == 3 ? 0x0801 : 6,
					 .bit_len = 16,
					 .access = 0x008f,
					 .subindex = rq->subindex };

	memset(entry.name, 'e', sizeof(entry.name) - 1);
	if (rq->index == 0x7000) {
		abort_sdo(reply, 0x08000000, "slave 0 (piccolo0): description: general error");
	} else if (rq->index != 0x8001 && rq->subindex == 2) {
		abort_sdo(reply, 0x06090011, "slave 0 (piccolo0): description: no subindex");
	} else {
		give(reply, &entry, sizeof(entry));
	}
}

static void clear(struct fake *f)
{
	histogram_clear(&f->page->cycle.wake_latency);
	f->page->cycle.frames_lost = 0;
}

static void answer_rescan(struct fake *f, const struct admin_request *rq, struct admin_reply *reply)
{
	if (rq->argument[1] == 0 && f->page->bus_state == BUS_OP) {
		refuse(reply, -EPERM, "the bus is in operation, and a rescan stops it: --force");
		return;
	}
	for (unsigned i = 0; i < SLAVES; i++) {
		f->page->slave[i].al_state = AL_OP;
	}
}

/* Slave 1 refuses BOOT. */
static void answer_state(struct fake *f, const struct admin_request *rq, struct admin_reply *reply)
{
	for (unsigned i = 0; i < SLAVES; i++) {
		if (rq->slave_pos == ADMIN_ALL_SLAVES || rq->slave_pos == i) {
			if (i == 1 && rq->argument[0] == AL_BOOT) {
				refuse(reply, -EIO, "slave 1: refuses BOOT and is in OP");
				return;
			}
			f->page->slave[i].al_state = rq->argument[0];
		}
	}
	reply->data[0] = (uint8_t)rq->argument[0];
	reply->data_len = 1;
}

/* --- registers and EEPROM: of slave 0; slave 1 does not answer --- */

static void answer_register(struct fake *f, const struct admin_request *rq,
			    struct admin_reply *reply)
{
	if (rq->slave_pos != 0 || rq->address + rq->length > sizeof(f->reg)) {
		refuse(reply, -ENXIO, "slave 1: 0x0130 does not answer: no such register");
	} else if (rq->verb == ADMIN_REGISTER_READ && rq->address == 0x0ffe) {
		give(reply, f->reg, 2 * ADMIN_REGISTER_BYTES); /* more than was asked for */
	} else if (rq->verb == ADMIN_REGISTER_READ) {
		give(reply, f->reg + rq->address, rq->length);
	} else if (rq->address == 0x0120 && rq->argument[1] == 0) {
		refuse(reply, -EPERM, "slave 0: 0x0120: AL control: not written");
	} else {
		memcpy(f->reg + rq->address, f->data, f->data_len);
	}
}

static void answer_written(struct admin_reply *reply, uint32_t compared, uint32_t written)
{
	give(reply, &(struct admin_sii_written){ .compared = compared, .written = written },
	     sizeof(struct admin_sii_written));
}

static void answer_sii(struct fake *f, const struct admin_request *rq, struct admin_reply *reply)
{
	uint32_t differ = 0;

	if (rq->verb == ADMIN_SII_READ && rq->argument[0] != 0) {
		return; /* that of the bring-up: of all slaves the same */
	}
	if (rq->slave_pos != 0) {
		refuse(reply, -EPERM, "slave 1: it is in SAFE-OP or OP");
	} else if (rq->verb == ADMIN_SII_ALIAS) {
		differ = get_le16(f->sii + SII_ALIAS_BYTE) != rq->argument[0] ? 2 : 0;
		put_le16(f->sii + SII_ALIAS_BYTE, (uint16_t)rq->argument[0]);
		answer_written(reply, 8, differ);
	} else if (rq->verb == ADMIN_SII_WRITE) {
		for (uint32_t i = 0; i + 1 < f->data_len; i += 2) {
			differ += memcmp(f->sii + i, f->data + i, 2) != 0;
		}
		memcpy(f->sii, f->data, f->data_len);
		answer_written(reply, f->data_len / 2, differ);
	}
}

static void answer_diagnosis(struct fake *f, const struct admin_request *rq,
			     struct admin_reply *reply)
{
	struct admin_diagnosis found = { .port[0] = { .is_link = 1,
						      .is_communicating = 1,
						      .invalid_frames = 11,
						      .rx_errors = f->reg[0x0301],
						      .forwarded_errors = 12,
						      .lost_links = 255 },
					 .port[2] = { .is_link = 1 },
					 .has_processing_errors = 1,
					 .processing_errors = 4,
					 .pdi_errors = 3,
					 .has_expirations = (uint8_t)f->has_long_names,
					 .expirations_pd = 8,
					 .expirations_pdi = 9 };

	if (rq->slave_pos != 0) {
		refuse(reply, -EIO, "slave 1: no frame came back");
		return;
	}
	if (f->is_noisy) {
		f->noise = (uint8_t)(f->noise < 250 ? f->noise + 2 : 2);
		found.port[1] = (struct admin_port){ .is_link = 1,
						     .is_communicating = 1,
						     .is_ebus = (uint8_t)f->has_ebus,
						     .rx_errors = f->noise };
	}
	give(reply, &found, sizeof(found));
}

/* One LRW of the image, FRMW of the system time; slave 1 has not answered. */
static void answer_datagrams(const struct fake *f, struct admin_reply *reply)
{
	static const struct admin_datagram list[] = {
		{ .command = 12, .bytes = IMAGE_BYTES, .wkc_expected = 6, .wkc = 3 },
		{ .command = 14,
		  .bytes = 8,
		  .address = UINT32_C(0x09101001),
		  .wkc_expected = ADMIN_WKC_UNKNOWN,
		  .wkc = 2 },
	};

	if (f->page->bus_state != BUS_OP) {
		refuse(reply, -EAGAIN, "the process data are not mapped");
	} else {
		give(reply, list, sizeof(list));
	}
}

/* What is about one slave's objects. */
static void answer_coe(struct fake *f, const struct admin_request *rq, struct admin_reply *reply)
{
	uint32_t object = (uint32_t)rq->index << 8 | rq->subindex;

	if (f->is_deaf && rq->verb == ADMIN_SDO_ENTRY && f->asked != object) {
		f->asked = object;
		refuse(reply, -ETIMEDOUT, "no answer");
	} else if (rq->verb == ADMIN_SDO_READ) {
		answer_read(f, rq, reply);
	} else if (rq->verb == ADMIN_SDO_WRITE) {
		answer_write(f, rq, reply);
	} else if (rq->verb == ADMIN_SDO_LIST) {
		answer_list(reply);
	} else if (rq->verb == ADMIN_SDO_OBJECT) {
		answer_object(rq, reply);
	} else {
		answer_entry(rq, reply);
	}
}

static void answer_startup(struct admin_reply *reply)
{
	const struct startup_record record[] = {
		{ .index = 0x8000,
		  .subindex = 1,
		  .len = 1,
		  .transition = 0,
		  .origin = STARTUP_OF_ESI },
		{ .index = 0x8010,
		  .len = 4,
		  .is_complete = 1,
		  .transition = 1,
		  .origin = STARTUP_OF_CONFIG,
		  .line = 12 },
	};
	const uint8_t data[] = { 7, 1, 2, 3, 4 };

	snprintf(reply->text, sizeof(reply->text), "/etc/ecdaq.yaml");
	memcpy(reply->data, &record[0], sizeof(record[0]));
	reply->data[sizeof(record[0])] = data[0];
	memcpy(reply->data + startup_record_bytes(1), &record[1], sizeof(record[1]));
	memcpy(reply->data + startup_record_bytes(1) + sizeof(record[1]), data + 1, 4);
	reply->data_len = (uint32_t)(startup_record_bytes(1) + startup_record_bytes(4));
	reply->data_total = reply->data_len;
}

/* One of each sort: a slave, a device; PDOs, an output; or a note. */
static void answer_compare(const struct fake *f, struct admin_reply *reply)
{
	const struct difference diff[] = {
		{ .kind = DIFFERENCE_IDENTITY,
		  .item = 1,
		  .position = 1,
		  .line = 7,
		  .name = "rear",
		  .group = "axes",
		  .property = "revision",
		  .expected = "0x00000002",
		  .found = "0x00000001" },
		{ .kind = DIFFERENCE_UNEXPECTED,
		  .item = DIFFERENCE_NOWHERE,
		  .position = 2,
		  .name = "EL\x1b[31m",
		  .found = "vendor 0x00000002" },
	};
	const struct difference mapped[] = {
		{ .kind = DIFFERENCE_PDOS,
		  .line = 5,
		  .name = "front",
		  .property = "PDOs",
		  .expected = "0x1a01",
		  .found = "0x1a00, 0x1a01" },
		{ .kind = DIFFERENCE_CHANNEL,
		  .position = DIFFERENCE_NOWHERE,
		  .line = 9,
		  .name = "rear.nope",
		  .expected = "an output channel",
		  .found = "no channel of this name" },
	};
	const struct difference note = { .kind = DIFFERENCE_OPTIONAL,
					 .item = 3,
					 .position = DIFFERENCE_NOWHERE,
					 .name = "spare",
					 .expected = "vendor any" };

	static_assert(sizeof(diff) <= sizeof(reply->data), "one message");
	static_assert(sizeof(mapped) <= sizeof(reply->data), "one message");
	snprintf(reply->text, sizeof(reply->text), "/etc/ecdaq.yaml");
	if (strcmp(f->admin, "differs") == 0) {
		give(reply, diff, sizeof(diff));
	} else if (strcmp(f->admin, "mapped") == 0) {
		give(reply, mapped, sizeof(mapped));
	} else if (strcmp(f->admin, "half") == 0) {
		give(reply, &note, sizeof(note) / 2);
	} else {
		give(reply, &note, sizeof(note));
	}
}

/* One of each sort; none; or a file with an error. */
static void answer_reload(const struct fake *f, struct admin_reply *reply)
{
	const struct config_change change[] = {
		{ .effect = CONFIG_EFFECT_NOW,
		  .option = "bus.op_timeout",
		  .old_value = "10s",
		  .new_value = "5s" },
		{ .effect = CONFIG_EFFECT_RESTART,
		  .option = "eoe.interface",
		  .old_value = "",
		  .new_value = "e\x1b[31m" },
	};

	static_assert(sizeof(change) <= sizeof(reply->data), "one message");
	snprintf(reply->text, sizeof(reply->text), "/etc/ecdaq.yaml");
	if (strcmp(f->admin, "differs") == 0) {
		give(reply, change, sizeof(change));
	} else if (strcmp(f->admin, "half") == 0) {
		give(reply, change, sizeof(change) - 1);
	} else if (strcmp(f->admin, "wrong") == 0) {
		reply->result = -EINVAL;
		snprintf(reply->text, sizeof(reply->text), "/etc/ecdaq.yaml:3: cycle.perid: no");
	}
}

static void answer_of_config(const struct fake *f, const struct admin_request *rq,
			     struct admin_reply *reply)
{
	if (rq->verb == ADMIN_COMPARE) {
		answer_compare(f, reply);
	} else if (rq->verb == ADMIN_CONFIG_RELOAD) {
		answer_reload(f, reply);
	} else {
		answer_startup(reply);
	}
}

static void answer(struct fake *f, const struct admin_request *rq, struct admin_reply *reply)
{
	*reply = (struct admin_reply){ .magic = ADMIN_MAGIC, .id = rq->id };
	switch ((enum admin_verb)rq->verb) {
	case ADMIN_PING:
	case ADMIN_FOE_READ: /* an empty file */
	case ADMIN_FOE_WRITE:
		break;
	case ADMIN_SET:
		answer_set(f, rq, reply);
		break;
	case ADMIN_ONESHOT:
		answer_oneshot(f, rq, reply);
		break;
	case ADMIN_STOP:
		f->is_stopped = 1;
		break;
	case ADMIN_CLEAR:
		clear(f);
		break;
	case ADMIN_RESCAN:
		answer_rescan(f, rq, reply);
		break;
	case ADMIN_STATE:
		answer_state(f, rq, reply);
		break;
	case ADMIN_REGISTER_READ:
	case ADMIN_REGISTER_WRITE:
		answer_register(f, rq, reply);
		break;
	case ADMIN_SII_READ:
	case ADMIN_SII_WRITE:
	case ADMIN_SII_ALIAS:
		answer_sii(f, rq, reply);
		break;
	case ADMIN_DIAGNOSIS:
		answer_diagnosis(f, rq, reply);
		break;
	case ADMIN_ERRORS_RESET:
		f->reg[0x0301] = 0;
		break;
	case ADMIN_DATAGRAMS:
		answer_datagrams(f, reply);
		break;
	case ADMIN_COMPARE:
	case ADMIN_CONFIG_RELOAD:
	case ADMIN_STARTUP:
		answer_of_config(f, rq, reply);
		break;
	case ADMIN_SDO_READ:
	case ADMIN_SDO_WRITE:
	case ADMIN_SDO_LIST:
	case ADMIN_SDO_OBJECT:
	case ADMIN_SDO_ENTRY:
		answer_coe(f, rq, reply);
		break;
	case ADMIN_CAPTURE:
	case ADMIN_SOE_READ:
	case ADMIN_SOE_WRITE:
	case ADMIN_EOE_IP_READ:
	case ADMIN_EOE_IP_WRITE:
	case ADMIN_AOE_READ:
	case ADMIN_AOE_WRITE:
	case ADMIN_VOE:
	case ADMIN_CANCEL:
	case ADMIN_DATA:
		refuse(reply, -EINVAL, "not served here");
		break;
	}
}

/* The data of a request, from as many messages as it has. 0 or -1. */
static int collect(struct fake *f, int fd, const struct admin_request *rq)
{
	struct admin_request more = *rq;

	f->data_len = 0;
	for (;;) {
		if (more.data_len > ADMIN_DATA_BYTES ||
		    f->data_len + more.data_len > sizeof(f->data)) {
			return -1;
		}
		memcpy(f->data + f->data_len, more.data, more.data_len);
		f->data_len += more.data_len;
		if (f->data_len >= rq->data_total) {
			return 0;
		}
		if (recv(fd, &more, sizeof(more), 0) != (ssize_t)sizeof(more) ||
		    more.verb != ADMIN_DATA || more.id != rq->id ||
		    more.data_offset != f->data_len) {
			return -1;
		}
	}
}

static void post(int fd, const struct admin_reply *reply)
{
	if (send(fd, reply, sizeof(*reply), MSG_NOSIGNAL) < 0) {
		perror("test_fake_daemon: send");
	}
}

/* With progress before it, and in as many messages as it takes. */
static void post_long(const struct fake *f, int fd, struct admin_reply *reply)
{
	reply->kind = ADMIN_REPLY_PROGRESS;
	reply->done = 1;
	reply->total = 2;
	post(fd, reply);
	reply->data_total = sizeof(f->sii);
	reply->data_len = ADMIN_DATA_BYTES;
	for (uint32_t at = 0; at < sizeof(f->sii); at += ADMIN_DATA_BYTES) {
		reply->kind = at + ADMIN_DATA_BYTES < sizeof(f->sii) ? ADMIN_REPLY_DATA
								     : ADMIN_REPLY_DONE;
		reply->data_offset = at;
		memcpy(reply->data, f->sii + at, ADMIN_DATA_BYTES);
		post(fd, reply);
	}
}

void fake_serve_client(struct fake *f)
{
	int fd = accept(f->listener, NULL, NULL);
	struct admin_request request;
	struct admin_reply reply;

	if (fd < 0) {
		return;
	}
	if (recv(fd, &request, sizeof(request), 0) == (ssize_t)sizeof(request) &&
	    request.magic == ADMIN_MAGIC && collect(f, fd, &request) == 0 &&
	    strcmp(f->admin, "mute") != 0) {
		f->is_long = request.verb == ADMIN_SII_READ;
		answer(f, &request, &reply);
		if (strcmp(f->admin, "garbage") == 0) {
			reply.magic ^= 1;
		}
		if (f->is_long && reply.result == 0) {
			post_long(f, fd, &reply);
		} else {
			post(fd, &reply);
		}
	}
	close(fd);
}
