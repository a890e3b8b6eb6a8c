/* SPDX-License-Identifier: MIT */
/* A frame passes the segment: slave by slave, each at its own time, datagram by datagram. */
#include <errno.h>

#include "base/bytes.h"
#include "segment/segment_internal.h"
#include "wire/datagram.h"
#include "wire/esc_reg.h"

enum {
	DATAGRAMS_MAX = 128,
	NS_A_BYTE = 80, /* 100 Mbit/s */
	PREAMBLE_BYTES = 8,
	FCS_AND_GAP_BYTES = 16,
	QUEUE_NS = 5000000, /* the queue of a NIC holds no more */
};

static int find_datagrams(uint8_t *frame, size_t frame_len, struct ecat_datagram *dg)
{
	size_t pos = 0;
	int count = 0;
	int r;

	if (!ecat_frame_is_valid(frame, frame_len)) {
		return -1;
	}
	while ((r = ecat_frame_next(frame, frame_len, &pos, &dg[count])) == 1) {
		if (++count == DATAGRAMS_MAX) {
			return -1;
		}
	}
	return r < 0 ? -1 : count;
}

/* Oscillators of both ends of a link are not in phase, and PHYs have FIFOs. */
static int64_t jitter(struct node *n)
{
	uint64_t span = 2 * (uint64_t)n->jitter_ns + 1;

	return n->jitter_ns > 0 ? (int64_t)prng_below(&n->prng, span) - n->jitter_ns : 0;
}

static struct esc_frame shift(const struct esc_frame *passing, struct node *n, int64_t t_ns)
{
	struct esc_frame f = *passing;

	t_ns += jitter(n);
	f.pu_ns += t_ns;
	for (unsigned port = 0; port < PATH_PORTS; port++) {
		f.port_ns[port] += t_ns;
	}
	return f;
}

/*
 * To another station, and with nothing to say in its IRQ field: nothing happens to it here. Most
 * datagrams of a frame that asks many slaves are that.
 */
static int is_for_others(const struct esc *esc, const struct ecat_datagram *dg)
{
	return (dg->cmd == ECAT_CMD_FPRD || dg->cmd == ECAT_CMD_FPWR || dg->cmd == ECAT_CMD_FPRW) &&
	       dg->adp != get_le16(esc->reg + ESC_REG_STATION_ADDRESS) &&
	       !(esc->reg[ESC_REG_DL_CONTROL + 3] & 1) &&
	       (esc->ecat_event & get_le16(esc->reg + ESC_REG_ECAT_EVENT_MASK)) == 0;
}

static void pass(struct node *n, const struct esc_frame *passing, int64_t t_ns,
		 const uint8_t *frame, struct ecat_datagram *dg, int count)
{
	struct esc_frame f = shift(passing, n, t_ns);
	int64_t now_ns = f.pu_ns;

	esc_frame_begin(&n->esc);
	for (int i = 0; i < count; i++) {
		/* A datagram acts when its end has come by. */
		int64_t offset = (int64_t)(dg[i].wkc - frame) + PREAMBLE_BYTES;

		now_ns = f.pu_ns + offset * NS_A_BYTE;
		if (n->next_ns <= now_ns) {
			segment_run_node(n, now_ns);
		}
		if (!is_for_others(&n->esc, &dg[i])) {
			esc_datagram(&n->esc, &f, &dg[i]);
		}
	}
	if (n->device != NULL && n->device->ops->frame_passed != NULL) {
		n->device->ops->frame_passed(n->device, now_ns);
	}
	if (esc_take_reset(&n->esc)) {
		segment_start_node(n, now_ns, 0);
	}
	segment_plan(n);
}

/*
 * The first slave finds the damage and spoils the check sum, by which the others know that it was
 * found.
 */
static void count_errors(struct segment *seg, const struct frame_path *path, size_t from,
			 enum esc_error error)
{
	int is_first = 1;

	for (unsigned k = 0; k < path->count; k++) {
		if (is_first && path->slave[k] != from) {
			continue;
		}
		esc_count_error(&seg->node[path->slave[k]].esc, 0,
				is_first ? error : ESC_ERROR_FORWARDED);
		is_first = 0;
	}
}

/* A wire carries one frame at a time. */
static int64_t start_of(struct segment *seg, enum segment_port from, int64_t t_ns, size_t len)
{
	int64_t start = t_ns > seg->wire_free_ns[from] ? t_ns : seg->wire_free_ns[from];

	seg->wire_free_ns[from] =
		start + (int64_t)(len + PREAMBLE_BYTES + FCS_AND_GAP_BYTES) * NS_A_BYTE;
	return start;
}

static int is_ethercat(const uint8_t *frame, size_t frame_len)
{
	return frame_len >= ECAT_ETHERNET_BYTES && frame[12] == ECAT_ETHERTYPE >> 8 &&
	       frame[13] == (ECAT_ETHERTYPE & 0xff);
}

int segment_frame_from(struct segment *segment, enum segment_port from, int64_t t_ns,
		       uint8_t *frame, size_t frame_len, struct segment_return *ret)
{
	const struct frame_path *path = &segment->path[from];
	struct ecat_datagram dg[DATAGRAMS_MAX];
	int is_rewired = 0;
	int count;

	segment_advance(segment, t_ns);
	if (!path->is_back) {
		return -ENOLINK;
	}
	if (!is_ethercat(frame, frame_len)) {
		return -EBADMSG; /* not theirs: slaves take it off the wire (0x0100 bit 0) */
	}
	count = find_datagrams(frame, frame_len, dg);
	if (count < 0) {
		count_errors(segment, path, path->slave[0], ESC_ERROR_UNIT);
		return -EBADMSG;
	}
	if (segment->wire_free_ns[from] > t_ns + QUEUE_NS) {
		return -ENOBUFS;
	}
	t_ns = start_of(segment, from, t_ns, frame_len);
	for (unsigned k = 0; k < path->count; k++) {
		struct node *n = &segment->node[path->slave[k]];

		pass(n, &path->passing[path->slave[k]], t_ns, frame, dg, count);
		is_rewired |= n->esc.is_loop_changed;
	}
	if (path->count > 0) {
		frame[6] |= 0x02; /* every ESC marks the source address of what it has processed */
	}
	*ret = (struct segment_return){ .port = path->exit, .t_ns = t_ns + path->back_ns };
	if (is_rewired) {
		segment_find_paths(segment);
	}
	return 0;
}

int segment_frame(struct segment *segment, int64_t t_ns, uint8_t *frame, size_t frame_len,
		  int64_t *ret_back_ns)
{
	struct segment_return back;
	int r = segment_frame_from(segment, SEGMENT_PRIMARY, t_ns, frame, frame_len, &back);

	if (r < 0) {
		return r;
	}
	if (back.port != SEGMENT_PRIMARY) {
		return -ENOLINK;
	}
	*ret_back_ns = back.t_ns;
	return 0;
}

void segment_damaged_frame(struct segment *segment, int64_t t_ns, size_t slave)
{
	segment_advance(segment, t_ns);
	count_errors(segment, &segment->path[SEGMENT_PRIMARY], slave, ESC_ERROR_INVALID_FRAME);
}
