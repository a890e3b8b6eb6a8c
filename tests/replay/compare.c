/* SPDX-License-Identifier: MIT */
#include "compare.h"

#include "base/bytes.h"
#include "harness/test.h"
#include "wire/datagram.h"
#include "wire/esc_reg.h"
#include "wire/pcapng.h"

/* Registers in which no two runs agree: above all those whose value is the time. */
static const struct {
	uint16_t first;
	uint16_t len;
	uint8_t bits; /* in which it may differ */
	const char *why;
} volatiles[] = {
	{ ESC_REG_EEPROM_CONTROL, 1, 0x10,
	  "bit 4: no data sheet names it; terminals drop it some time after SAFE-OP" },
	{ ESC_REG_DC_RECEIVE_TIME_PORT, 16, 0xff,
	  "receive time: that clock runs since its power-on" },
	{ ESC_REG_DC_SYSTEM_TIME, 8, 0xff, "system time of the reference clock" },
	{ ESC_REG_DC_RECEIVE_TIME_PU, 8, 0xff, "receive time: that clock runs since its power-on" },
	{ ESC_REG_DC_SYSTEM_TIME_DIFF, 4, 0xff, "what is left of the clocks' difference" },
};

/* A frame on its way: what our segment has answered, until the capture shows what the real one did.
 */
struct pending {
	uint8_t bytes[ECAT_FRAME_MAX_BYTES];
	size_t len;
	int is_used;
};

static const char *explain(const struct ecat_datagram *dg, size_t offset, uint8_t difference)
{
	size_t at = (size_t)dg->ado + offset;

	if (dg->cmd == ECAT_CMD_LRD || dg->cmd == ECAT_CMD_LWR || dg->cmd == ECAT_CMD_LRW) {
		return NULL;
	}
	for (size_t i = 0; i < sizeof(volatiles) / sizeof(volatiles[0]); i++) {
		if (at >= volatiles[i].first &&
		    at < (size_t)volatiles[i].first + volatiles[i].len &&
		    (difference & ~volatiles[i].bits) == 0) {
			return volatiles[i].why;
		}
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
		w = explain(real, i, real->data[i] ^ simulated->data[i]);
		unexplained += w == NULL;
		explained += w != NULL;
		why = w != NULL ? w : why;
	}
	c->bytes += real->data_len;
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

static struct pending *slot_of(struct pending *pending, const uint8_t *frame, size_t len)
{
	struct ecat_datagram wanted;
	struct ecat_datagram dg;
	uint8_t copy[ECAT_FRAME_MAX_BYTES];
	size_t pos = 0;

	memcpy(copy, frame, len);
	CHECK_EQ(ecat_frame_next(copy, len, &pos, &wanted), 1);
	for (unsigned i = 0; i < COMPARE_MAX_FRAMES; i++) {
		pos = 0;
		if (pending[i].is_used &&
		    ecat_frame_next(pending[i].bytes, pending[i].len, &pos, &dg) == 1 &&
		    dg.idx == wanted.idx && dg.cmd == wanted.cmd &&
		    dg.data_len == wanted.data_len) {
			return &pending[i];
		}
	}
	return NULL;
}

static void request(struct pending *pending, struct segment *segment, int64_t t_ns,
		    const struct pcapng_packet *p)
{
	int64_t back_ns;

	for (unsigned i = 0; i < COMPARE_MAX_FRAMES; i++) {
		struct pending *slot = &pending[i];

		if (slot->is_used) {
			continue;
		}
		slot->is_used = 1;
		slot->len = p->len;
		memcpy(slot->bytes, p->bytes, p->len);
		CHECK_EQ(segment_frame(segment, t_ns, slot->bytes, p->len, &back_ns), 0);
		return;
	}
	test_fail(__FILE__, __LINE__, "more than %d frames on the wire", COMPARE_MAX_FRAMES);
}

void compare_run(const struct bytes *capture, struct segment *segment, int64_t start_ns,
		 struct compare *ret)
{
	static struct pending pending[COMPARE_MAX_FRAMES];
	struct pcapng_packet p;
	struct pcapng file;
	int64_t first_ns = INT64_MIN;

	memset(ret, 0, sizeof(*ret));
	memset(pending, 0, sizeof(pending));
	CHECK_EQ(pcapng_open(&file, capture->at, capture->len), 0);
	while (pcapng_next(&file, &p) == 1) {
		struct pending *slot;
		uint8_t real[ECAT_FRAME_MAX_BYTES];

		if (p.len > sizeof(real) || !ecat_frame_is_valid(p.bytes, p.len)) {
			continue;
		}
		first_ns = first_ns == INT64_MIN ? p.t_ns : first_ns;
		if (!(p.bytes[6] & 2)) {
			request(pending, segment, start_ns + p.t_ns - first_ns, &p);
			continue;
		}
		memcpy(real, p.bytes, p.len);
		slot = slot_of(pending, real, p.len);
		if (slot != NULL) {
			compare_frames(ret, real, p.len, slot->bytes, slot->len);
			slot->is_used = 0;
		}
	}
	for (unsigned i = 0; i < COMPARE_MAX_FRAMES; i++) {
		ret->unanswered += (unsigned)pending[i].is_used;
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
	printf("%s: %u frames, %u datagrams, %u data bytes; WKCs that differ: %u; headers: %u; "
	       "data bytes: "
	       "%u, not explained: %u\n",
	       title, c->frames, c->datagrams, c->bytes, c->wkc_differ, c->header_differ,
	       c->bytes_differ, c->bytes_unexplained);
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
