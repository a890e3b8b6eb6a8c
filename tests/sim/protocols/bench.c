/* SPDX-License-Identifier: MIT */
#include "sim/protocols/bench.h"

#include "base/bytes.h"
#include "devices/catalogue.h"
#include "devices/fb1111_piccolo.h"
#include "harness/test.h"
#include "wire/al.h"
#include "wire/datagram.h"
#include "wire/esc_reg.h"

enum { SM_MAILBOX_OUT = 0x26, SM_MAILBOX_IN = 0x22, TRANSMIT_NS = 4000, ALL_PROTOCOLS = 0x3f };

/* --- one datagram --- */

static uint16_t transact(struct protocol_bench *b, enum ecat_cmd cmd, uint16_t adp, uint16_t ado,
			 void *data, uint16_t len)
{
	static const uint8_t source[6] = { 2, 2, 2, 2, 2, 2 };
	uint8_t frame[LIMIT_FRAME_BYTES];
	uint8_t answer[LIMIT_FRAME_BYTES];
	struct ecat_frame_builder fb;
	struct ecat_datagram dg;
	size_t pos = 0;
	uint8_t *to;
	int r;

	ecat_frame_begin(&fb, frame, source);
	to = ecat_frame_add(&fb, cmd, 0, adp, ado, len);
	CHECK(to != NULL);
	memcpy(to, data, len);
	r = line_transact(b->line, frame, ecat_frame_end(&fb), answer, sizeof(answer),
			  line_timeout(b->line, 0));
	CHECK(r > 0);
	CHECK_EQ(ecat_frame_next(answer, (size_t)r, &pos, &dg), 1);
	memcpy(data, dg.data, len);
	return get_le16(dg.wkc);
}

static uint16_t station(unsigned pos)
{
	return (uint16_t)(BENCH_STATION + pos);
}

static void write16(struct protocol_bench *b, unsigned pos, uint16_t ado, uint16_t value)
{
	uint8_t data[2];

	put_le16(data, value);
	CHECK_EQ(transact(b, ECAT_CMD_FPWR, station(pos), ado, data, 2), 1);
}

static uint16_t read16(struct protocol_bench *b, unsigned pos, uint16_t ado)
{
	uint8_t data[2] = { 0 };

	CHECK_EQ(transact(b, ECAT_CMD_FPRD, station(pos), ado, data, 2), 1);
	return get_le16(data);
}

/* --- the engine's wire --- */

static int wire_submit(void *ctx, const uint8_t *frame, size_t frame_len)
{
	return line_submit(((struct protocol_bench *)ctx)->line, LINE_MAILBOX, frame, frame_len);
}

static int wire_collect(void *ctx, uint8_t *ret_answer, size_t capacity)
{
	return line_collect(((struct protocol_bench *)ctx)->line, LINE_MAILBOX, ret_answer,
			    capacity);
}

static size_t wire_limit(void *ctx)
{
	return line_frame_limit(((struct protocol_bench *)ctx)->line);
}

static mono_t wire_now(void *ctx)
{
	const struct platform *platform = line_platform(((struct protocol_bench *)ctx)->line);

	return platform->now(platform->ctx);
}

static int wire_sleep(void *ctx, span_t span)
{
	return line_sleep(((struct protocol_bench *)ctx)->line, span);
}

/* --- the bench --- */

static unsigned make_segment(struct protocol_bench *b, const char *const *names)
{
	static struct slave_model model;
	struct segment_slave_spec specs[BENCH_SLAVES];
	unsigned count = 0;
	char error[128];

	for (; names[count] != NULL; count++) {
		CHECK(count < BENCH_SLAVES);
		if (strcmp(names[count], "fb1111_piccolo") == 0) {
			CHECK_EQ(fb1111_piccolo_slave((int)count, &specs[count]), 0);
		} else {
			int is_all = strcmp(names[count], "all") == 0;

			CHECK_EQ(catalogue_find(is_all ? "akd" : names[count], &model), 0);
			model.sii.mailbox_protocols |= is_all ? ALL_PROTOCOLS : 0;
			CHECK_EQ(catalogue_slave(&model, (int)count, &specs[count]), 0);
		}
		CHECK_EQ(sii_parse(specs[count].sii, specs[count].sii_bytes, &b->sii[count], error,
				   sizeof(error)),
			 0);
	}
	CHECK_EQ(segment_create(specs, count, 0, &b->segment), 0);
	return count;
}

void bench_begin(struct protocol_bench *b, const char *const *names)
{
	const struct mailbox_wire wire = { .submit = wire_submit,
					   .collect = wire_collect,
					   .frame_limit = wire_limit,
					   .now = wire_now,
					   .sleep = wire_sleep,
					   .ctx = b };
	unsigned count;

	memset(b, 0, sizeof(*b));
	count = make_segment(b, names);
	b->faults = fault_plan_create(1, 0);
	CHECK_EQ(in_process_create(&(struct in_process_spec){ .segment = b->segment,
							      .seed = 1,
							      .transmit_ns = TRANSMIT_NS,
							      .faults = b->faults },
				   &b->host),
		 0);
	CHECK_EQ(line_create(in_process_platform(b->host), in_process_transport(b->host), &b->line),
		 0);
	CHECK_EQ(mailbox_create(&wire, &b->mb), 0);
	line_sleep(b->line, (span_t){ 100 * NS_PER_MS });
	for (unsigned i = 0; i < count; i++) {
		uint8_t data[2];

		put_le16(data, station(i));
		CHECK_EQ(transact(b, ECAT_CMD_APWR, (uint16_t)-i, ESC_REG_STATION_ADDRESS, data, 2),
			 1);
	}
}

void bench_end(struct protocol_bench *b)
{
	mailbox_destroy(b->mb);
	line_destroy(b->line);
	in_process_destroy(b->host);
	fault_plan_destroy(b->faults);
	segment_destroy(b->segment);
}

int64_t bench_now_ns(const struct protocol_bench *b)
{
	return in_process_true_ns(b->host, wire_now((void *)(uintptr_t)b));
}

uint16_t bench_request(struct protocol_bench *b, unsigned pos, uint16_t state)
{
	uint16_t status = 0;

	write16(b, pos, ESC_REG_AL_CONTROL, state);
	for (unsigned i = 0; i < 1000; i++) {
		line_sleep(b->line, (span_t){ NS_PER_MS });
		status = read16(b, pos, ESC_REG_AL_STATUS);
		if (status == (state & AL_STATE_MASK) || ((status & AL_ERROR) && i > 10)) {
			break;
		}
	}
	return status;
}

uint16_t bench_al_code(struct protocol_bench *b, unsigned pos)
{
	return read16(b, pos, ESC_REG_AL_STATUS_CODE);
}

static void set_sm(struct protocol_bench *b, unsigned pos, unsigned n, uint16_t start, uint16_t len,
		   uint8_t control)
{
	uint8_t sm[ESC_SM_BYTES] = { [4] = control, [6] = 1 };

	put_le16(sm, start);
	put_le16(sm + 2, len);
	CHECK_EQ(transact(b, ECAT_CMD_FPWR, station(pos), (uint16_t)(ESC_REG_SM + n * ESC_SM_BYTES),
			  sm, sizeof(sm)),
		 1);
}

static void to_state(struct protocol_bench *b, unsigned pos, enum al_state state,
		     const struct mailbox_slave_spec *spec)
{
	CHECK_EQ(mailbox_slave_set(b->mb, (uint16_t)pos, NULL), 0);
	CHECK_EQ(bench_request(b, pos, AL_INIT), AL_INIT);
	set_sm(b, pos, 0, spec->out_start, spec->out_bytes, SM_MAILBOX_OUT);
	set_sm(b, pos, 1, spec->in_start, spec->in_bytes, SM_MAILBOX_IN);
	CHECK_EQ(bench_request(b, pos, (uint16_t)state), state);
	CHECK_EQ(mailbox_slave_set(b->mb, (uint16_t)pos, spec), 0);
}

void bench_to_preop(struct protocol_bench *b, unsigned pos)
{
	const struct sii *s = &b->sii[pos];

	to_state(b, pos, AL_PREOP,
		 &(struct mailbox_slave_spec){ .station_addr = station(pos),
					       .out_start = s->mailbox_out_start,
					       .out_bytes = s->mailbox_out_len,
					       .in_start = s->mailbox_in_start,
					       .in_bytes = s->mailbox_in_len,
					       .protocols = s->mailbox_protocols });
}

void bench_to_boot(struct protocol_bench *b, unsigned pos)
{
	const struct sii *s = &b->sii[pos];

	to_state(b, pos, AL_BOOT,
		 &(struct mailbox_slave_spec){ .station_addr = station(pos),
					       .out_start = s->boot_out_start,
					       .out_bytes = s->boot_out_len,
					       .in_start = s->boot_in_start,
					       .in_bytes = s->boot_in_len,
					       .protocols = SII_MAILBOX_FOE });
}

void bench_set(struct protocol_bench *b, unsigned pos, const char *key, const char *value)
{
	struct sim_device *dev = segment_device(b->segment, pos);

	CHECK_EQ(dev->ops->io_set(dev, key, value), 0);
}

int bench_do(struct protocol_bench *b, unsigned pos, struct mailbox_request *rq)
{
	rq->slave_pos = (uint16_t)pos;
	CHECK_EQ(mailbox_submit(b->mb, rq), 0);
	return mailbox_wait(b->mb, rq);
}

void bench_version(struct protocol_bench *b, unsigned pos, char *ret_text, size_t text_bytes)
{
	struct mailbox_request rq = { .protocol = &coe_protocol,
				      .with.coe = { .operation = COE_UPLOAD, .index = 0x100a },
				      .buffer = (uint8_t *)ret_text,
				      .capacity = text_bytes - 1,
				      .timeout = { NS_PER_S } };

	CHECK_EQ(bench_do(b, pos, &rq), 0);
	ret_text[rq.len] = '\0';
}

struct mailbox_request bench_foe(uint8_t operation, const char *name, uint8_t *buffer,
				 size_t capacity)
{
	return (struct mailbox_request){ .protocol = &foe_protocol,
					 .with.foe = { .operation = operation, .name = name },
					 .buffer = buffer,
					 .capacity = capacity,
					 .timeout = { NS_PER_S } };
}
