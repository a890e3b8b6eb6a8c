/* SPDX-License-Identifier: MIT */
/* ecdaq-sim: the simulated segment on a network interface, in real time. */
#include <assert.h>
#include <errno.h>
#include <inttypes.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "base/stop.h"
#include "segment/edge_writer.h"
#include "segment/fault.h"
#include "segment/segment.h"
#include "simulator/control.h"
#include "simulator/options.h"
#include "simulator/topology.h"
#include "simulator/wire_socket.h"

enum {
	WAKE_MIN_NS = 200000, /* so near to each other events are run together */
	WAKE_MAX_NS = 10000000,
	CONTROL_NS = 10000000, /* how often the control socket is looked at */
	HELD_MAX = 64,
	FRAME_BYTES = 1600,
};

#define HELD_TO_NEXT INT64_MAX

/* A frame that a fault holds back. */
struct held {
	int is_used;
	int64_t due_ns;
	size_t len;
	uint8_t bytes[FRAME_BYTES];
};

struct simulation {
	struct sim_options opt;
	struct segment *segment;
	struct fault_plan *faults;
	struct held held[HELD_MAX];
	struct edge_writer *edges; /* NULL: not wanted */
	int fd;
	int control_fd;
	int64_t control_ns; /* when it was looked at last */
	uint64_t frames;
	uint64_t bad_frames;
};

/* --- files and sockets --- */

static void write_edge(void *ctx, unsigned slave, int64_t t_ns, uint64_t system_time_ns)
{
	edge_writer_put(((struct simulation *)ctx)->edges, slave, t_ns, system_time_ns);
}

static int make_faults(struct simulation *sim, char *error, size_t error_bytes)
{
	size_t slaves = segment_slave_count(sim->segment);
	char jitter[64] = "";
	int r;

	sim->faults = fault_plan_create((uint64_t)sim->opt.seed.value, wire_socket_now_ns());
	if (sim->faults == NULL) {
		snprintf(error, error_bytes, "no memory");
		return -ENOMEM;
	}
	if (sim->opt.transit_jitter_ns.value > 0) {
		snprintf(jitter, sizeof(jitter), "p=1 jitter by=%" PRId64 "ns",
			 (int64_t)sim->opt.transit_jitter_ns.value);
	}
	r = fault_plan_add(sim->faults, jitter, slaves, error, error_bytes);
	return r < 0 || sim->opt.faults == NULL
		       ? r
		       : fault_plan_load(sim->faults, sim->opt.faults, slaves, error, error_bytes);
}

static int open_all(struct simulation *sim)
{
	char error[256];
	int r;

	r = make_faults(sim, error, sizeof(error));
	if (r < 0) {
		return sim_error(error);
	}
	if (sim->opt.edges != NULL) {
		r = edge_writer_open(sim->opt.edges, (uint64_t)sim->opt.edges_keep_mib.value << 20,
				     &sim->edges);
		if (r < 0) {
			snprintf(error, sizeof(error), "%s: %s", sim->opt.edges, strerror(-r));
			return sim_error(error);
		}
		segment_sync0_to(sim->segment, write_edge, sim);
	}
	/* Held to the end. Before the control socket: that of the one which is there stays. */
	if (wire_socket_claim(sim->opt.interface, error, sizeof(error)) < 0) {
		return sim_error(error);
	}
	sim->control_fd = -1;
	if (sim->opt.control != NULL) {
		sim->control_fd = control_open(sim->opt.control, error, sizeof(error));
		if (sim->control_fd < 0) {
			return sim_error(error);
		}
	}
	sim->fd = wire_socket_open(sim->opt.interface, error, sizeof(error));
	return sim->fd < 0 ? sim_error(error) : 0;
}

static void flush_edges(struct simulation *sim, int64_t now_ns)
{
	char error[256];
	int r = sim->edges == NULL ? 0 : edge_writer_flush(sim->edges, now_ns);

	if (r < 0) {
		snprintf(error, sizeof(error), "--edges-keep: %s: %s: the whole file is kept",
			 sim->opt.edges, strerror(-r));
		sim_error(error);
	}
}

static void go_real_time(const struct sim_options *opt)
{
	struct sched_param p = { .sched_priority = (int)opt->priority.value };
	cpu_set_t set;

	if (opt->cpu.value >= 0) {
		CPU_ZERO(&set);
		CPU_SET((unsigned)opt->cpu.value, &set);
		if (sched_setaffinity(0, sizeof(set), &set) < 0) {
			perror("ecdaq-sim: --cpu");
		}
	}
	if (opt->priority.value > 0 && sched_setscheduler(0, SCHED_FIFO, &p) < 0) {
		perror("ecdaq-sim: --priority");
	}
}

/* --- frames --- */

static void hold(struct simulation *sim, const uint8_t *frame, size_t len, int64_t due_ns)
{
	for (unsigned i = 0; i < HELD_MAX; i++) {
		struct held *h = &sim->held[i];

		if (!h->is_used) {
			h->is_used = 1;
			h->due_ns = due_ns;
			h->len = len;
			memcpy(h->bytes, frame, len);
			return;
		}
	}
}

static void send_back(struct simulation *sim, const uint8_t *frame, size_t len)
{
	/* A master that is gone, or a link that is down, is no fault of ours. */
	(void)!send(sim->fd, frame, len, 0);
}

static void release_one(struct simulation *sim, struct held *h)
{
	send_back(sim, h->bytes, h->len);
	h->is_used = 0;
}

static void release_for_next(struct simulation *sim)
{
	for (unsigned i = 0; i < HELD_MAX; i++) {
		if (sim->held[i].is_used && sim->held[i].due_ns == HELD_TO_NEXT) {
			release_one(sim, &sim->held[i]);
		}
	}
}

static void answer(struct simulation *sim, uint8_t *frame, size_t len, int64_t t_ns)
{
	struct fault_verdict v;
	int64_t back_ns;

	release_for_next(sim);
	v = fault_plan_judge(sim->faults, sim->segment, t_ns, len);
	sim->frames++;
	if (v.is_dropped) {
		return;
	}
	t_ns += v.transit_ns;
	if (!v.is_mirrored && segment_frame(sim->segment, t_ns, frame, len, &back_ns) < 0) {
		sim->bad_frames++;
		return;
	}
	if (v.is_lost) {
		return;
	}
	if (v.corrupt_at > 0) {
		frame[v.corrupt_at] ^= v.corrupt_xor;
	}
	if (v.truncate_to > 0) {
		len = v.truncate_to < 14 ? 14 : v.truncate_to;
	}
	if (v.is_held || v.delay_ns > 0) {
		hold(sim, frame, len, v.is_held ? HELD_TO_NEXT : t_ns + v.delay_ns);
		return;
	}
	send_back(sim, frame, len);
	if (v.is_doubled) {
		send_back(sim, frame, len);
	}
}

/* Send what is due; when is the next? */
static int64_t release_due(struct simulation *sim, int64_t now_ns)
{
	int64_t next_ns = INT64_MAX;

	for (unsigned i = 0; i < HELD_MAX; i++) {
		struct held *h = &sim->held[i];

		if (h->is_used && h->due_ns <= now_ns) {
			release_one(sim, h);
		} else if (h->is_used && h->due_ns < next_ns) {
			next_ns = h->due_ns;
		}
	}
	return next_ns;
}

static void look_at_control(struct simulation *sim, int64_t now_ns)
{
	if (sim->control_fd >= 0 && now_ns - sim->control_ns >= CONTROL_NS) {
		sim->control_ns = now_ns;
		control_serve(sim->control_fd, sim->faults, sim->segment, now_ns);
	}
}

/*
 * The slaves live on between the frames, at their own times, so that no frame has to wait until
 * what has happened since the last one is caught up with.
 */
static int64_t live_on(struct simulation *sim)
{
	int64_t now_ns = wire_socket_now_ns();
	int64_t due_ns = release_due(sim, now_ns);
	int64_t event_ns;
	int64_t wait_ns;

	look_at_control(sim, now_ns);
	flush_edges(sim, now_ns);
	segment_advance(sim->segment, now_ns);
	event_ns = segment_next_event_ns(sim->segment);
	wait_ns = event_ns == INT64_MAX ? WAKE_MAX_NS : event_ns - now_ns;
	if (wait_ns < WAKE_MIN_NS) {
		wait_ns = WAKE_MIN_NS;
	} else if (wait_ns > WAKE_MAX_NS) {
		wait_ns = WAKE_MAX_NS;
	}
	return due_ns - now_ns < wait_ns ? due_ns - now_ns : wait_ns;
}

static int serve(struct simulation *sim)
{
	uint8_t frame[FRAME_BYTES];
	char line[256];

	assert(sim->fd >= 0);
	while (!stop_requested()) {
		int64_t t_ns = 0;
		int n = wire_socket_receive(sim->fd, frame, sizeof(frame), live_on(sim), &t_ns);

		if (n > 0) {
			answer(sim, frame, (size_t)n, t_ns);
		} else if (n < 0 && n != -ENETDOWN) {
			snprintf(line, sizeof(line), "interface %s: %s", sim->opt.interface,
				 strerror(-n));
			return sim_error(line);
		}
	}
	return 0;
}

int main(int argc, char **argv)
{
	static struct simulation sim = {
		.control_fd = -1,
	};
	int r;

	sim.opt = sim_options_default();
	sim_options_read(argc, argv, &sim.opt);
	stop_catch(STOP_REPEAT_IGNORED, NULL);
	if (topology_create(&sim.opt, wire_socket_now_ns(), &sim.segment) < 0 ||
	    open_all(&sim) < 0) {
		return 1;
	}
	go_real_time(&sim.opt);
	r = serve(&sim);
	fprintf(stderr, "ecdaq-sim: %llu frames, %llu damaged\n", (unsigned long long)sim.frames,
		(unsigned long long)sim.bad_frames);
	edge_writer_close(sim.edges);
	if (sim.opt.control != NULL) {
		unlink(sim.opt.control);
	}
	segment_destroy(sim.segment);
	fault_plan_destroy(sim.faults);
	return r < 0 ? 1 : 0;
}
