/* SPDX-License-Identifier: MIT */
#include "compare.h"

#include "base/bytes.h"
#include "harness/test.h"
#include "wire/datagram.h"
#include "wire/esc_reg.h"

/*
 * Registers in which no two runs agree. Times must be near: our clocks start with what the first
 * latch of the capture showed, frames with what the capturing host had on its own clock.
 */
enum kind { SOME_BITS, TIME_32, TIME_64, ANYTHING };

enum { NEAR_NS = 150000 };

static const struct {
	uint16_t first;
	uint16_t len;
	enum kind kind;
	uint8_t bits; /* SOME_BITS: those that may differ */
	const char *why;
} volatiles[] = {
	{ ESC_REG_EEPROM_CONTROL, 1, SOME_BITS, 0x10,
	  "bit 4: no data sheet names it; terminals drop it at some time" },
	{ ESC_REG_EEPROM_CONTROL + 1, 1, SOME_BITS, 0x81,
	  "busy: the EEPROM was ready between our answer and the real one, within 30 us" },
	{ ESC_REG_DC_RECEIVE_TIME_PORT, 16, TIME_32, 0, "receive time: near" },
	{ ESC_REG_DC_SYSTEM_TIME, 8, TIME_64, 0, "system time: near" },
	{ ESC_REG_DC_RECEIVE_TIME_PU, 8, TIME_64, 0, "receive time: near" },
	{ ESC_REG_DC_SYSTEM_TIME_DIFF, 4, ANYTHING, 0, "what is left of the clocks' difference" },
};

/* The time register that byte @offset lies in, in both; are they near? */
static int is_near(const struct ecat_datagram *real, const struct ecat_datagram *simulated,
		   size_t offset, size_t width)
{
	size_t at = (size_t)real->ado + offset;
	size_t first = at - at % width;
	int64_t apart_ns;

	if (first < real->ado || first + 4 > (size_t)real->ado + real->data_len) {
		return 0;
	}
	first -= real->ado;
	if (width == 8 && first + 8 <= real->data_len) {
		apart_ns =
			(int64_t)(get_le64(real->data + first) - get_le64(simulated->data + first));
	} else {
		apart_ns =
			(int32_t)(get_le32(real->data + first) - get_le32(simulated->data + first));
	}
	return llabs(apart_ns) <= NEAR_NS;
}

/* A port without link keeps what it had, which nobody knows. */
static int is_leftover(const struct compare *c, const struct ecat_datagram *dg, size_t at)
{
	size_t port = (at - ESC_REG_DC_RECEIVE_TIME_PORT) / 4;

	return dg->adp == c->leftover_station && at >= ESC_REG_DC_RECEIVE_TIME_PORT &&
	       at < ESC_REG_DC_SYSTEM_TIME && (c->leftover_ports >> port & 1);
}

static const char *explain(const struct compare *c, const struct ecat_datagram *real,
			   const struct ecat_datagram *simulated, size_t offset)
{
	uint8_t difference = real->data[offset] ^ simulated->data[offset];
	size_t at = (size_t)real->ado + offset;
	int is_fine = 0;

	if (real->cmd == ECAT_CMD_LRD || real->cmd == ECAT_CMD_LWR || real->cmd == ECAT_CMD_LRW) {
		return NULL;
	}
	if (is_leftover(c, real, at)) {
		return "receive time of a port without link: what it had before";
	}
	for (size_t i = 0; i < sizeof(volatiles) / sizeof(volatiles[0]); i++) {
		if (at < volatiles[i].first ||
		    at >= (size_t)volatiles[i].first + volatiles[i].len) {
			continue;
		}
		switch (volatiles[i].kind) {
		case SOME_BITS:
			is_fine = (difference & ~volatiles[i].bits) == 0;
			break;
		case TIME_32:
			is_fine = is_near(real, simulated, offset, 4);
			break;
		case TIME_64:
			is_fine = is_near(real, simulated, offset, 8);
			break;
		case ANYTHING:
			is_fine = 1;
			break;
		}
		return is_fine ? volatiles[i].why : NULL;
	}
	return NULL;
}

static struct compare_row *row_for(struct compare *c, const struct ecat_datagram *dg,
				   const char *why)
{
	struct compare_row *row;

	for (unsigned i = 0; i < c->row_count; i++) {
		row = &c->row[i];
		if (row->cmd == dg->cmd && row->adp == dg->adp && row->ado == dg->ado &&
		    row->why == why) {
			return row;
		}
	}
	CHECK(c->row_count < COMPARE_ROWS);
	row = &c->row[c->row_count++];
	*row = (struct compare_row){ .cmd = dg->cmd, .adp = dg->adp, .ado = dg->ado, .why = why };
	return row;
}

static void note(struct compare *c, const struct ecat_datagram *real,
		 const struct ecat_datagram *simulated, const char *why, unsigned bytes)
{
	struct compare_row *row = row_for(c, real, why);
	size_t shown = real->data_len < sizeof(row->real) ? real->data_len : sizeof(row->real);

	if (row->datagrams == 0) {
		memcpy(row->real, real->data, shown);
		memcpy(row->simulated, simulated->data, shown);
	}
	row->datagrams++;
	row->bytes += bytes;
	c->bytes_differ += bytes;
	c->bytes_unexplained += why == NULL ? bytes : 0;
}

static void compare_data(struct compare *c, const struct ecat_datagram *real,
			 const struct ecat_datagram *simulated)
{
	unsigned unexplained = 0;
	unsigned explained = 0;
	const char *why = NULL;

	for (size_t i = 0; i < real->data_len; i++) {
		const char *w;

		if (real->data[i] == simulated->data[i]) {
			continue;
		}
		w = explain(c, real, simulated, i);
		unexplained += w == NULL;
		explained += w != NULL;
		why = w != NULL ? w : why;
	}
	c->bytes += real->data_len;
	if (real->cmd == ECAT_CMD_FPRD && real->ado >= ESC_REG_PROCESS_RAM) {
		c->ram_bytes += real->data_len;
	}
	if (explained > 0) {
		note(c, real, simulated, why, explained);
	}
	if (unexplained > 0) {
		note(c, real, simulated, NULL, unexplained);
	}
}

/* Differences of receive times are wire and processing delays: those must agree. */
static void keep_latch(struct compare *c, const struct ecat_datagram *real,
		       const struct ecat_datagram *simulated)
{
	size_t first = (size_t)(real->ado - ESC_REG_DC_RECEIVE_TIME_PORT) / 4;
	struct compare_latch *l = NULL;

	if (real->cmd != ECAT_CMD_FPRD || real->ado < ESC_REG_DC_RECEIVE_TIME_PORT ||
	    real->ado >= ESC_REG_DC_SYSTEM_TIME || get_le16(real->wkc) != 1) {
		return;
	}
	for (unsigned i = 0; i < c->latch_count; i++) {
		l = c->latch[i].station == real->adp ? &c->latch[i] : l;
	}
	if (l == NULL) {
		CHECK(c->latch_count < COMPARE_ROWS);
		l = &c->latch[c->latch_count++];
		*l = (struct compare_latch){ .station = real->adp };
	}
	for (size_t i = 0; i < real->data_len / 4u && first + i < 4; i++) {
		l->real[first + i] = get_le32(real->data + 4 * i);
		l->simulated[first + i] = get_le32(simulated->data + 4 * i);
		l->ports_read |= 1u << (first + i);
	}
}

static void compare_frames(struct compare *c, uint8_t *real, size_t real_len, uint8_t *simulated,
			   size_t simulated_len)
{
	struct ecat_datagram r;
	struct ecat_datagram s;
	size_t real_pos = 0;
	size_t simulated_pos = 0;

	c->header_differ += memcmp(real, simulated, ECAT_ETHERNET_BYTES) != 0;
	while (ecat_frame_next(real, real_len, &real_pos, &r) == 1) {
		CHECK_EQ(ecat_frame_next(simulated, simulated_len, &simulated_pos, &s), 1);
		CHECK_EQ(s.data_len, r.data_len);
		c->datagrams++;
		if (r.cmd != s.cmd || r.idx != s.idx || r.adp != s.adp || r.ado != s.ado ||
		    r.irq != s.irq) {
			c->header_differ++;
			printf("header: %s %04x:%04x irq %04x, simulated %04x:%04x irq %04x\n",
			       ecat_cmd_to_str(r.cmd), r.adp, r.ado, r.irq, s.adp, s.ado, s.irq);
		}
		if (get_le16(r.wkc) != get_le16(s.wkc)) {
			c->wkc_differ++;
			printf("WKC: %s %04x:%04x %u, simulated %u\n", ecat_cmd_to_str(r.cmd),
			       r.adp, r.ado, get_le16(r.wkc), get_le16(s.wkc));
		}
		compare_data(c, &r, &s);
		keep_latch(c, &r, &s);
	}
	c->frames++;
}

void compare_run(const struct capture_pairs *pairs, struct segment *segment, int64_t start_ns,
		 struct compare *ret)
{
	for (size_t i = 0; i < pairs->count; i++) {
		const struct capture_pair *p = &pairs->at[i];
		uint8_t simulated[ECAT_FRAME_MAX_BYTES];
		uint8_t real[ECAT_FRAME_MAX_BYTES];
		int64_t back_ns;

		memcpy(simulated, p->request, p->len);
		CHECK_EQ(segment_frame(segment, start_ns + p->t_ns, simulated, p->len, &back_ns),
			 0);
		if (p->answer == NULL) {
			ret->unanswered++;
			continue;
		}
		memcpy(real, p->answer, p->answer_len);
		compare_frames(ret, real, p->answer_len, simulated, p->len);
	}
}

static void print_bytes(const uint8_t *bytes)
{
	for (unsigned i = 0; i < 8; i++) {
		printf("%02x", bytes[i]);
	}
}

void compare_print(const char *title, const struct compare *c)
{
	printf("%s: %u frames, %u datagrams, %u WKCs and %u data bytes (%u of mailbox answers)\n",
	       title, c->frames, c->datagrams, c->datagrams, c->bytes, c->ram_bytes);
	printf("  differing: %u WKCs, %u headers, %u data bytes, of which not explained %u\n",
	       c->wkc_differ, c->header_differ, c->bytes_differ, c->bytes_unexplained);
	for (unsigned i = 0; i < c->row_count; i++) {
		const struct compare_row *row = &c->row[i];

		printf("  %s %04x:%04x  %4u datagrams %5u bytes  ", ecat_cmd_to_str(row->cmd),
		       row->adp, row->ado, row->datagrams, row->bytes);
		print_bytes(row->real);
		printf(" / ");
		print_bytes(row->simulated);
		printf("  %s\n", row->why != NULL ? row->why : "NOT EXPLAINED");
	}
}
