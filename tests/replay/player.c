/* SPDX-License-Identifier: MIT */
#include "player.h"

#include "base/bytes.h"
#include "harness/test.h"
#include "wire/datagram.h"
#include "wire/esc_reg.h"

enum {
	ACTIONS_MAX = 4096,
	LOOK_NS = 20000000,
	ALIVE_NS = 50000000, /* its main loop, as the PDI watchdog (100 ms) sees it */
	MAILBOX_MAX = 1024,
	SM_REQUEST = ESC_REG_SM,
	SM_ANSWER = ESC_REG_SM + ESC_SM_BYTES,
	SM_STATUS = 5,
	STATUS_READ = 0x02,
	STATUS_FULL = 0x08,
	STATUS_WRITER_OPEN = 0x80,
};

enum kind { LOOK_AT_CONTROL, SHOW_STATUS, BEGIN_ANSWER, PUT_ANSWER };

struct action {
	int64_t t_ns;
	enum kind kind;
	uint16_t status;
	uint16_t code;
	const uint8_t *answer; /* in the capture */
	size_t answer_len;
};

struct player {
	struct sim_device dev;
	uint16_t station;
	size_t count;
	size_t next;
	int64_t alive_ns;
	struct action action[ACTIONS_MAX];

	/* while the capture is gone through */
	uint16_t status;
	uint8_t answer_status; /* of SM1, as read last */
	struct action *wanted; /* its answer has not been read yet */
	uint16_t answer_start; /* of SM1, as the master set it */
};

static struct action *add(struct player *p, int64_t t_ns, enum kind kind)
{
	CHECK(p->count < ACTIONS_MAX);
	p->action[p->count] = (struct action){ .t_ns = t_ns, .kind = kind };
	return &p->action[p->count++];
}

/* --- from the capture --- */

static void see_al_status(struct player *p, const struct ecat_datagram *dg, int64_t t_ns)
{
	uint16_t status = get_le16(dg->data);
	struct action *a;

	if (status == p->status) {
		return;
	}
	a = add(p, t_ns - 1, SHOW_STATUS);
	a->status = status;
	a->code = dg->data_len >= 6 ? get_le16(dg->data + 4) : 0;
	p->status = status;
}

static void see_answer_status(struct player *p, uint8_t status, int64_t t_ns)
{
	uint8_t before = p->answer_status;

	p->answer_status = status;
	if ((status & STATUS_FULL) && !(before & STATUS_FULL)) {
		p->wanted = add(p, t_ns - 1, PUT_ANSWER);
	} else if (((status & STATUS_WRITER_OPEN) && !(before & STATUS_WRITER_OPEN)) ||
		   (status == 0 && (before & STATUS_READ))) {
		/* The first byte of the next answer takes the "was read" bit away. */
		add(p, t_ns - 1, BEGIN_ANSWER);
	}
}

static void see_answer(struct player *p, const struct ecat_datagram *dg)
{
	if (p->wanted != NULL) {
		p->wanted->answer = dg->data;
		p->wanted->answer_len = dg->data_len;
		p->wanted = NULL;
		p->answer_status = STATUS_READ;
	}
}

static void see_write(struct player *p, const struct ecat_datagram *dg, int64_t t_ns)
{
	if (dg->ado == ESC_REG_AL_CONTROL) {
		add(p, t_ns + LOOK_NS, LOOK_AT_CONTROL);
	}
	if (dg->ado <= SM_ANSWER && dg->ado + dg->data_len >= SM_ANSWER + 2) {
		p->answer_start = get_le16(dg->data + (SM_ANSWER - dg->ado));
	}
}

static void see_read(struct player *p, const struct ecat_datagram *dg, int64_t t_ns)
{
	unsigned status_at = SM_ANSWER + SM_STATUS;

	if (dg->ado == ESC_REG_AL_STATUS) {
		see_al_status(p, dg, t_ns);
	} else if (dg->ado <= status_at && dg->ado + dg->data_len > (int)status_at) {
		see_answer_status(p, dg->data[status_at - dg->ado], t_ns);
	} else if (p->answer_start != 0 && dg->ado == p->answer_start) {
		see_answer(p, dg);
	}
}

static void see(struct player *p, struct ecat_datagram *dg, const struct capture_pair *pair,
		const uint8_t *copy, int64_t t_ns)
{
	int is_ours = dg->adp == p->station;
	int is_alone = dg->adp == 1; /* a broadcast that passed one slave */

	if (get_le16(dg->wkc) == 0) {
		return;
	}
	dg->data = (uint8_t *)(uintptr_t)pair->answer + (dg->data - copy);
	if (dg->cmd == ECAT_CMD_BWR || (dg->cmd == ECAT_CMD_FPWR && is_ours)) {
		see_write(p, dg, t_ns);
	}
	if ((dg->cmd == ECAT_CMD_FPRD && is_ours) ||
	    (dg->cmd == ECAT_CMD_BRD && is_alone && dg->ado == ESC_REG_AL_STATUS)) {
		see_read(p, dg, t_ns);
	}
}

static int by_time(const void *a, const void *b)
{
	const struct action *x = a;
	const struct action *y = b;

	return x->t_ns < y->t_ns ? -1 : x->t_ns > y->t_ns;
}

/* --- on the segment --- */

static int64_t next_wake_ns(const struct sim_device *dev)
{
	const struct player *p = (const struct player *)dev;
	int64_t action_ns = p->next < p->count ? p->action[p->next].t_ns : INT64_MAX;

	return action_ns < p->alive_ns ? action_ns : p->alive_ns;
}

static void take_request(struct player *p, int64_t t_ns)
{
	uint8_t box[MAILBOX_MAX];
	uint8_t sm[ESC_SM_BYTES];

	esc_pdi_read(p->dev.esc, t_ns, SM_REQUEST, sm, sizeof(sm));
	if ((sm[SM_STATUS] & STATUS_FULL) && get_le16(sm + 2) <= sizeof(box)) {
		esc_pdi_read(p->dev.esc, t_ns, get_le16(sm), box, get_le16(sm + 2));
	}
}

static void put_answer(struct player *p, const struct action *a)
{
	uint8_t sm[ESC_SM_BYTES];

	esc_pdi_read(p->dev.esc, a->t_ns, SM_ANSWER, sm, sizeof(sm));
	CHECK_EQ(get_le16(sm + 2), a->answer_len);
	esc_pdi_write(p->dev.esc, a->t_ns, get_le16(sm), a->answer, a->answer_len);
}

static void begin_answer(struct player *p, int64_t t_ns)
{
	uint8_t sm[ESC_SM_BYTES];
	uint8_t first = 0;

	esc_pdi_read(p->dev.esc, t_ns, SM_ANSWER, sm, sizeof(sm));
	esc_pdi_write(p->dev.esc, t_ns, get_le16(sm), &first, 1);
}

static void show_status(struct player *p, const struct action *a)
{
	uint8_t bytes[2];

	esc_pdi_read(p->dev.esc, a->t_ns, ESC_REG_AL_CONTROL, bytes, 2);
	put_le16(bytes, a->code);
	esc_pdi_write(p->dev.esc, a->t_ns, ESC_REG_AL_STATUS_CODE, bytes, 2);
	put_le16(bytes, a->status);
	esc_pdi_write(p->dev.esc, a->t_ns, ESC_REG_AL_STATUS, bytes, 2);
}

static void run(struct sim_device *dev, int64_t t_ns)
{
	struct player *p = (struct player *)dev;
	uint8_t ignored[2];

	if (p->alive_ns <= t_ns) {
		esc_pdi_read(dev->esc, t_ns, ESC_REG_AL_EVENT_REQUEST, ignored, 2);
		p->alive_ns = t_ns + ALIVE_NS;
	}
	for (; p->next < p->count && p->action[p->next].t_ns <= t_ns; p->next++) {
		const struct action *a = &p->action[p->next];

		switch (a->kind) {
		case LOOK_AT_CONTROL:
			esc_pdi_read(dev->esc, a->t_ns, ESC_REG_AL_CONTROL, ignored, 2);
			break;
		case SHOW_STATUS:
			show_status(p, a);
			break;
		case BEGIN_ANSWER:
			take_request(p, a->t_ns);
			begin_answer(p, a->t_ns);
			break;
		case PUT_ANSWER:
			take_request(p, a->t_ns);
			put_answer(p, a);
			break;
		}
	}
}

static void power_on(struct sim_device *dev, int64_t t_ns)
{
	((struct player *)dev)->alive_ns = t_ns + ALIVE_NS;
}

static void sync0(struct sim_device *dev, int64_t t_ns, uint64_t system_time_ns)
{
	(void)dev;
	(void)t_ns;
	(void)system_time_ns;
}

static void destroy(struct sim_device *dev)
{
	free(dev);
}

struct sim_device *player_create(const struct capture_pairs *pairs, uint16_t station,
				 int64_t start_ns)
{
	static const struct sim_device_ops ops = {
		.power_on = power_on,
		.next_wake_ns = next_wake_ns,
		.run = run,
		.sync0 = sync0,
		.destroy = destroy,
	};
	struct player *p = calloc(1, sizeof(*p));

	CHECK(p != NULL);
	p->dev.ops = &ops;
	p->station = station;
	p->status = 1; /* INIT */
	for (size_t i = 0; i < pairs->count; i++) {
		const struct capture_pair *pair = &pairs->at[i];
		uint8_t copy[ECAT_FRAME_MAX_BYTES];
		struct ecat_datagram dg;
		size_t pos = 0;

		if (pair->answer == NULL) {
			continue;
		}
		memcpy(copy, pair->answer, pair->answer_len);
		while (ecat_frame_next(copy, pair->answer_len, &pos, &dg) == 1) {
			see(p, &dg, pair, copy, start_ns + pair->t_ns);
		}
	}
	qsort(p->action, p->count, sizeof(p->action[0]), by_time);
	return &p->dev;
}
