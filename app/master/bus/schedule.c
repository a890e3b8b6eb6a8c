/* SPDX-License-Identifier: MIT */
#include "bus/schedule.h"

#include <math.h>

#include "bus/exchange_frame.h"
#include "link/line.h"
#include "wire/datagram.h"

enum {
	HOP_NS = 1000,   /* one slave there and back, with its wires: 100BASE-TX, some metres */
	HOST_NS = 10000, /* driver and NIC, out and in */
	ROUND_NS = 10000,
	SERVICE_BYTES_MIN = 256, /* a service frame that must fit, or nobody watches the slaves */
};

/* What lies behind the entry of @node, until the frame leaves it towards the master. */
static int64_t latched_path_ns(const struct dc_node *node)
{
	int64_t longest_ns = 0;

	for (unsigned port = 0; port < DC_PORTS; port++) {
		/* Times wrap (T13), and closed ports hold old ones. */
		int64_t ns = (int32_t)(node->time_ns[port] - node->time_ns[node->entry_port]);

		if ((node->ports >> port & 1) != 0 && ns > longest_ns) {
			longest_ns = ns;
		}
	}
	return longest_ns;
}

static int64_t path_ns(const struct dc_node *node, size_t count)
{
	size_t first = 0;
	int64_t estimate_ns = HOP_NS * (int64_t)count;

	while (first < count && node[first].kind == CLOCK_NONE) {
		first++;
	}
	if (first < count) {
		int64_t latched_ns = latched_path_ns(&node[first]);

		/* A lone slave, or one whose ports are unknown, has latched no path. */
		return HOP_NS * (int64_t)(first + 1) + latched_ns;
	}
	return HOP_NS + estimate_ns;
}

static int64_t percent_of(int64_t ns, double percent)
{
	return (int64_t)((double)ns * percent / 100.0);
}

static int64_t smallest_period_ns(const struct schedule *sc, double receive_percent)
{
	int64_t service_ns = sc->need_ns + sc->path_ns + ecat_wire_time_ns(SERVICE_BYTES_MIN);
	double for_answer = ceil((double)sc->need_ns * 100.0 / receive_percent);
	double for_service = ceil((double)service_ns * 100.0 / LINE_WINDOW_PERCENT);
	int64_t ns = (int64_t)(for_answer > for_service ? for_answer : for_service);

	return (ns + ROUND_NS - 1) / ROUND_NS * ROUND_NS;
}

struct schedule schedule_compute(const struct exchange_plan *plan, const struct dc_node *node,
				 size_t count, int64_t period_ns, double receive_percent)
{
	struct schedule sc = { .path_ns = path_ns(node, count) };
	int64_t left_ns;

	for (unsigned i = 0; i < exchange_frame_count(plan); i++) {
		sc.wire_ns += ecat_wire_time_ns(exchange_frame_bytes(plan, i));
	}
	sc.need_ns = sc.wire_ns + sc.path_ns + HOST_NS;
	sc.allowed_ns = percent_of(period_ns, receive_percent);
	sc.smallest_period_ns = smallest_period_ns(&sc, receive_percent);
	left_ns = percent_of(period_ns, LINE_WINDOW_PERCENT) - sc.need_ns - sc.path_ns;
	if (left_ns >= ecat_wire_time_ns(0)) {
		sc.service_frame_bytes = (size_t)(left_ns / ECAT_BYTE_NS) - ECAT_UNSEEN_BYTES;
	}
	return sc;
}
