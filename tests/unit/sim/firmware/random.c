/* SPDX-License-Identifier: MIT */
/* Whatever the master does, the board keeps its rules. */
#include <string.h>

#include "base/bytes.h"
#include "base/prng.h"
#include "board.h"
#include "harness/test.h"
#include "wire/al.h"
#include "wire/esc_reg.h"

enum { SEEDS = 20, ACTIONS = 3000, MAILBOXES = 20000 };

static int is_state(unsigned status)
{
	unsigned state = status & AL_STATE_MASK;

	return (state == AL_INIT || state == AL_PREOP || state == AL_BOOT || state == AL_SAFEOP ||
		state == AL_OP) &&
	       (status & ~(unsigned)(AL_STATE_MASK | AL_ERROR)) == 0;
}

static void check_rules(const struct board *b)
{
	unsigned status = board_al_status(b);

	CHECK(is_state(status));
	CHECK_EQ((status & AL_ERROR) != 0, board_al_code(b) != 0);
	CHECK_EQ(status & AL_STATE_MASK, b->fw.al.state);
	if ((status & AL_STATE_MASK) != AL_OP) {
		CHECK_EQ(b->led, 0);
		CHECK_EQ(b->fw.sync0.armed, 0);
	}
	CHECK_EQ(b->fw.sync0.enabled, (status & AL_STATE_MASK) >= AL_SAFEOP);
	CHECK_EQ(board_breaches(b), 0);
}

static void put_request(struct board *b, struct prng *p)
{
	uint16_t control = (uint16_t)prng_below(p, 0x40);

	if (prng_below(p, 10) != 0) { /* mostly one up, so that the higher states are reached */
		unsigned state = b->fw.al.state;

		control = (uint16_t)((state < AL_OP ? state * 2 : state) | AL_ERROR);
	}
	put_le16(b->memory + ESC_REG_AL_CONTROL, control);
	b->al_event |= 1;
}

static void spoil_sm(struct board *b, struct prng *p)
{
	board_master_mailbox_sms(b);
	board_master_process_data(b);
	if (prng_below(p, 20) == 0) {
		b->memory[ESC_REG_SM + prng_below(p, 32)] ^= (uint8_t)(1u << prng_below(p, 8));
	}
}

static void put_mailbox(struct board *b, struct prng *p)
{
	uint8_t write_mode[10] = { 0x00, 0x20, 0x2f, 0x00, 0x80, 1, prng_below(p, 2) != 0 };
	uint8_t data[122];

	if (b->is_sm0_full) {
		return;
	}
	if (prng_below(p, 2) != 0) {
		board_mailbox_put(b, 3, 0, write_mode, sizeof(write_mode));
		return;
	}
	for (size_t i = 0; i < sizeof(data); i++) {
		data[i] = (uint8_t)prng_next(p);
	}
	if (prng_below(p, 2) != 0) { /* an SDO to an object that is likely there */
		static const uint16_t index[] = { 0x8000, 0x1c12, 0x1c32, 0x7000, 0x1018, 0x1600 };

		data[0] = 0;
		data[1] = 0x20;
		put_le16(data + 3, index[prng_below(p, 6)]);
		data[5] = (uint8_t)prng_below(p, 4);
	}
	board_mailbox_put(b, (uint8_t)(prng_below(p, 8) ? 3 : prng_below(p, 16)),
			  (uint8_t)prng_below(p, 8), data,
			  prng_below(p, 8) ? prng_below(p, 30) : prng_below(p, 65536));
}

static void act(struct board *b, struct prng *p, uint64_t *edge_ns)
{
	switch (prng_below(p, 8)) {
	case 0:
		put_request(b, p);
		break;
	case 1:
		spoil_sm(b, p);
		break;
	case 2:
		put_mailbox(b, p);
		break;
	case 3:
		b->is_sm1_full = 0;
		break;
	case 4:
		board_master_outputs(b, (uint8_t)prng_next(p), prng_below(p, 3) * 1500000000);
		break;
	case 5:
		if ((b->fw.mode == PICCOLO_PERIODIC) ^ (prng_below(p, 20) == 0)) {
			board_master_sync0(b, 1000000);
		} else {
			board_master_give_sync(b);
		}
		break;
	case 6:
		b->memory[ESC_REG_WATCHDOG_STATUS_PD] = (uint8_t)(prng_below(p, 50) != 0);
		break;
	default:
		*edge_ns += 1000000;
		board_set_dc_time(b, *edge_ns);
		board_sync0(b, *edge_ns);
		break;
	}
	board_run(b, (uint32_t)prng_below(p, 4000));
}

TEST(firmware, whatever_the_master_does_the_rules_hold)
{
	unsigned in_op = 0;
	unsigned armed = 0;

	for (uint64_t seed = 1; seed <= SEEDS; seed++) {
		struct prng p = { seed };
		struct board b;
		uint64_t edge_ns = 0;

		board_init(&b);
		board_start(&b);
		for (unsigned i = 0; i < ACTIONS; i++) {
			act(&b, &p, &edge_ns);
			check_rules(&b);
			in_op += b.fw.al.state == PICCOLO_OP;
			armed += b.fw.sync0.armed != 0;
		}
	}
	/* the dice do get there */
	CHECK(in_op > 1000);
	CHECK(armed > 10);
}

TEST(firmware, any_mailbox_content_is_survived)
{
	static const uint8_t read_refresh[10] = { 0x00, 0x20, 0x40, 0x00, 0x80, 2 };
	struct prng p = { 7 };
	struct board b;
	uint8_t answer[128];

	board_lead_to(&b, PICCOLO_PREOP);
	for (unsigned i = 0; i < MAILBOXES; i++) {
		put_mailbox(&b, &p);
		board_run(&b, 3000);
		CHECK(!b.is_sm0_full);
		if (b.is_sm1_full) {
			CHECK_EQ(board_mailbox_take(&b, answer), 0);
			CHECK(get_le16(answer) <= 122);
			CHECK((answer[5] & 15) == 3 || (answer[5] & 15) == 0);
		}
	}
	check_rules(&b);
	board_mailbox_put(&b, 3, 0, read_refresh, 10);
	CHECK_EQ(board_mailbox_take(&b, answer), 0);
	CHECK_EQ(answer[6 + 3], 0x00);
	CHECK_EQ(answer[6 + 4], 0x80);
}
