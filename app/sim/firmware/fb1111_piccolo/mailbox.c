/* SPDX-License-Identifier: MIT */
#include "mailbox.h"

#include "coe.h"
#include "esc_register.h"
#include "foe.h"
#include "spi.h"

enum { COUNTER_MASK = 7, COUNTER_SHIFT = 4, ERROR_REPLY_TYPE = 1, ERROR_REPLY_LENGTH = 4 };

static uint16_t sm_start(enum piccolo_sm_index sm)
{
	return piccolo_description.sm[sm].start;
}

static uint16_t sm_register(enum piccolo_sm_index sm, unsigned offset)
{
	return (uint16_t)(REG_SM + SM_OCTETS * (unsigned)sm + offset);
}

static uint16_t least(uint16_t a, uint16_t b)
{
	return a < b ? a : b;
}

void piccolo_mailbox_reset(struct piccolo *p)
{
	struct piccolo_mailbox *m = &p->mailbox;

	m->phase = MAILBOX_IDLE;
	m->rx_len = m->rx_pos = 0;
	m->tx_len = m->tx_pos = 0;
	m->rx_counter = m->tx_counter = 0;
	m->is_repeat = m->is_repeat_wanted = 0;
	m->is_blocked = 0;
	m->activate_seen =
		piccolo_esc_read8(p, sm_register(PICCOLO_SM_MAILBOX_IN, SM_OFFSET_ACTIVATE));
}

void piccolo_mailbox_sm1_activated(struct piccolo *p, octet_t activate)
{
	struct piccolo_mailbox *m = &p->mailbox;

	if ((activate ^ m->activate_seen) & SM_ACTIVATE_REPEAT) {
		m->is_repeat_wanted = 1;
	}
	m->activate_seen = activate;
}

/* --- answering --- */

static void finish_answer(struct piccolo_mailbox *m, unsigned type, uint16_t data_len)
{
	m->tx_counter = OCTET(m->tx_counter % COUNTER_MASK + 1u);
	octets_put16(m->tx, data_len);
	m->tx[2] = m->tx[3] = 0; /* the master's address */
	m->tx[4] = 0;
	m->tx[MAILBOX_TYPE] = OCTET(type | (unsigned)m->tx_counter << COUNTER_SHIFT);
	m->tx_len = (uint16_t)(MAILBOX_HEADER + data_len);
	m->is_repeat = 0;
	m->phase = MAILBOX_WAITING;
}

static void answer_error(struct piccolo_mailbox *m, enum piccolo_mailbox_error error)
{
	octets_put16(m->tx + MAILBOX_HEADER, ERROR_REPLY_TYPE);
	octets_put16(m->tx + MAILBOX_HEADER + 2, (uint16_t)error);
	finish_answer(m, MAILBOX_TYPE_ERROR, ERROR_REPLY_LENGTH);
}

static void execute(struct piccolo *p)
{
	struct piccolo_mailbox *m = &p->mailbox;
	enum piccolo_mailbox_error error = MAILBOX_OK;
	uint16_t answer_len = 0;
	unsigned type = m->rx[MAILBOX_TYPE] & 0x0fu;

	if (octets_get16(m->rx) > MAILBOX_DATA_MAX) {
		error = MAILBOX_INVALID_SIZE;
	} else if (type == MAILBOX_TYPE_COE && p->al.state != PICCOLO_BOOT) {
		error = piccolo_coe(p, m->rx + MAILBOX_HEADER, octets_get16(m->rx),
				    m->tx + MAILBOX_HEADER, &answer_len);
	} else if (type == MAILBOX_TYPE_FOE) {
		error = piccolo_foe(p, m->rx + MAILBOX_HEADER, octets_get16(m->rx),
				    m->tx + MAILBOX_HEADER, &answer_len);
	} else {
		error = MAILBOX_UNSUPPORTED_PROTOCOL;
	}
	if (error != MAILBOX_OK) {
		answer_error(m, error);
	} else if (answer_len > 0) {
		finish_answer(m, type, answer_len);
	} else {
		m->tx_len = 0; /* an abort of the master: nothing to say, nothing to repeat */
		m->phase = MAILBOX_IDLE;
	}
}

/* The counter runs 1..7; 0 is a master that does not count, and never a repetition. */
static void take_request(struct piccolo *p)
{
	struct piccolo_mailbox *m = &p->mailbox;
	octet_t counter = OCTET((unsigned)m->rx[MAILBOX_TYPE] >> COUNTER_SHIFT & COUNTER_MASK);

	p->al_event = (uint16_t)(p->al_event & ~(unsigned)AL_EVENT_SM0); /* SM0 is empty now */
	if (counter != 0 && counter == m->rx_counter) {
		m->is_repeat = 1;
		m->phase = m->tx_len > 0 ? MAILBOX_WAITING : MAILBOX_IDLE;
		return;
	}
	m->rx_counter = counter;
	execute(p);
}

/* --- SM0 --- */

static void read_request(struct piccolo *p)
{
	struct piccolo_mailbox *m = &p->mailbox;
	uint16_t len = least((uint16_t)(m->rx_len - m->rx_pos), SPI_CHUNK);

	piccolo_esc_read(p, (uint16_t)(sm_start(PICCOLO_SM_MAILBOX_OUT) + m->rx_pos),
			 m->rx + m->rx_pos, len);
	m->rx_pos = (uint16_t)(m->rx_pos + len);
	if (m->rx_pos == len) { /* the first chunk has the header */
		m->rx_len = least(
			(uint16_t)(MAILBOX_HEADER + least(octets_get16(m->rx), MAILBOX_DATA_MAX)),
			PICCOLO_MAILBOX_OCTETS);
		m->rx_len = m->rx_len < m->rx_pos ? m->rx_pos : m->rx_len;
	}
	if (m->rx_pos == PICCOLO_MAILBOX_OCTETS) {
		take_request(p);
	} else if (m->rx_pos == m->rx_len) {
		m->phase = MAILBOX_RELEASING;
	}
}

static void release_request(struct piccolo *p)
{
	(void)piccolo_esc_read8(
		p, (uint16_t)(sm_start(PICCOLO_SM_MAILBOX_OUT) + PICCOLO_MAILBOX_OCTETS - 1));
	take_request(p);
}

/* --- SM1 --- */

static octet_t is_sm1_full(struct piccolo *p)
{
	octet_t status = piccolo_esc_read8(p, sm_register(PICCOLO_SM_MAILBOX_IN, SM_OFFSET_STATUS));

	return OCTET((status & SM_STATUS_MAILBOX_FULL) != 0);
}

/* A repeat request is acknowledged by copying its toggle bit, once the answer is in SM1 again. */
static void finish_repeat(struct piccolo *p)
{
	struct piccolo_mailbox *m = &p->mailbox;
	octet_t acknowledge[1];

	m->phase = MAILBOX_IDLE;
	if (!m->is_repeat_wanted) {
		return;
	}
	m->is_repeat_wanted = 0;
	acknowledge[0] = OCTET(m->activate_seen & SM_ACTIVATE_REPEAT);
	piccolo_esc_write(p, sm_register(PICCOLO_SM_MAILBOX_IN, SM_OFFSET_PDI_CONTROL), acknowledge,
			  1);
}

/* Returns nonzero if there is something to do at once. A full SM1 is looked at again later. */
static int begin_answer(struct piccolo *p)
{
	struct piccolo_mailbox *m = &p->mailbox;
	uint32_t now_us = p->hal.time_us(p->hal.ctx);

	if (m->is_blocked && now_us - m->blocked_us < PICCOLO_EVENT_POLL_US) {
		return 0;
	}
	m->is_blocked = is_sm1_full(p);
	m->blocked_us = now_us;
	if (!m->is_blocked) {
		m->tx_pos = 0;
		m->phase = MAILBOX_WRITING;
		return 1;
	}
	if (m->is_repeat) {
		m->is_blocked = 0;
		finish_repeat(p); /* that answer is still there */
	}
	return 0;
}

/* SM1 is full for the master once its last octet is written. */
static void write_answer(struct piccolo *p)
{
	struct piccolo_mailbox *m = &p->mailbox;
	uint16_t start = sm_start(PICCOLO_SM_MAILBOX_IN);
	uint16_t len = least((uint16_t)(m->tx_len - m->tx_pos), SPI_CHUNK);
	octet_t last[1] = { 0 };

	if (len > 0) {
		piccolo_esc_write(p, (uint16_t)(start + m->tx_pos), m->tx + m->tx_pos, len);
		m->tx_pos = (uint16_t)(m->tx_pos + len);
		if (m->tx_pos < PICCOLO_MAILBOX_OCTETS) {
			return;
		}
	} else {
		piccolo_esc_write(p, (uint16_t)(start + PICCOLO_MAILBOX_OCTETS - 1), last, 1);
	}
	m->is_repeat = 1;
	finish_repeat(p);
}

static void begin_repeat(struct piccolo *p)
{
	struct piccolo_mailbox *m = &p->mailbox;

	if (m->tx_len == 0) {
		finish_repeat(p); /* nothing was ever answered */
		return;
	}
	m->is_repeat = 1;
	m->phase = MAILBOX_WAITING;
}

int piccolo_mailbox_step(struct piccolo *p)
{
	struct piccolo_mailbox *m = &p->mailbox;

	switch (m->phase) {
	case MAILBOX_IDLE:
		if (m->is_repeat_wanted) {
			begin_repeat(p);
			return 1;
		}
		if ((p->al_event & AL_EVENT_SM0) == 0) {
			return 0;
		}
		m->rx_pos = 0;
		m->rx_len = SPI_CHUNK;
		m->phase = MAILBOX_READING;
		read_request(p);
		return 1;
	case MAILBOX_READING:
		read_request(p);
		return 1;
	case MAILBOX_RELEASING:
		release_request(p);
		return 1;
	case MAILBOX_WAITING:
		return begin_answer(p);
	case MAILBOX_WRITING:
		write_answer(p);
		return 1;
	}
	return 0;
}
