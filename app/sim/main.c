/* SPDX-License-Identifier: MIT */
/* ecdaq-sim: the simulated segment on a network interface, in real time. */
#include <errno.h>
#include <sched.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/prng.h"
#include "sim/catalogue.h"
#include "sim/control.h"
#include "sim/devices/fb1111_piccolo.h"
#include "sim/fault.h"
#include "sim/options.h"
#include "sim/segment.h"
#include "sim/wire_socket.h"

enum {
	PIECE_BYTES = 96,
	SII_PATH_BYTES = 1024,
	CATCH_UP_NS = 1000000,
	HELD_MAX = 64,
	FRAME_BYTES = 1600
};

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
	uint8_t *sii[LIMIT_SLAVES];
	FILE *edges;
	int fd;
	int control_fd;
	uint64_t frames;
	uint64_t bad_frames;
};

static _Atomic int stop_wanted;

static void on_signal(int number)
{
	(void)number;
	atomic_store_explicit(&stop_wanted, 1, memory_order_relaxed);
}

/* --- making the segment --- */

static int read_sii(struct simulation *sim, const char *name, unsigned i, size_t *ret_bytes)
{
	char path[SII_PATH_BYTES];
	char line[SII_PATH_BYTES + 64];
	FILE *file;
	int len;

	if (sim->opt.sii_dir == NULL) {
		snprintf(line, sizeof(line), "slave '%.60s': --sii DIR is missing", name);
		return sim_complain(line);
	}
	len = snprintf(path, sizeof(path), "%s/%s.bin", sim->opt.sii_dir, name);
	if (len >= (int)sizeof(path)) {
		return sim_complain("--sii: path too long");
	}
	file = fopen(path, "rb");
	sim->sii[i] = malloc(SEGMENT_SII_BYTES);
	if (file == NULL || sim->sii[i] == NULL) {
		snprintf(line, sizeof(line), "%s: %s", path, strerror(errno));
		if (file != NULL) {
			fclose(file);
		}
		return sim_complain(line);
	}
	*ret_bytes = fread(sim->sii[i], 1, SEGMENT_SII_BYTES, file);
	fclose(file);
	return 0;
}

static int make_slave(struct simulation *sim, const char *name, unsigned i,
		      struct segment_slave_spec *spec)
{
	size_t bytes = 0;
	int r;

	if (strcmp(name, "fb1111_piccolo") == 0) {
		r = fb1111_piccolo_slave((int)i, spec);
	} else {
		r = read_sii(sim, name, i, &bytes);
		r = r < 0 ? -EIO : catalogue_sii_slave(sim->sii[i], bytes, (int)i, spec);
	}
	if (r == 0) {
		spec->signal = sim->opt.signal;
	}
	return r;
}

static int list_slaves(struct simulation *sim, char names[LIMIT_SLAVES][PIECE_BYTES])
{
	const char *text = sim->opt.slaves;
	char *end;
	long count = strtol(text, &end, 10);
	int n = 0;

	if (*end == '\0' && end != text) {
		if (count < 1 || count > LIMIT_SLAVES) {
			return sim_complain("--slaves: not 1 to 64");
		}
		for (; n < count; n++) {
			snprintf(names[n], PIECE_BYTES, "fb1111_piccolo");
		}
		return n;
	}
	while (*text != '\0') {
		size_t len = strcspn(text, ",");

		if (n == LIMIT_SLAVES || len == 0 || len >= PIECE_BYTES ||
		    memchr(text, '/', len) != NULL) {
			return sim_complain(
				"--slaves: a list of at most 64 names is NAME,NAME,...");
		}
		snprintf(names[n++], PIECE_BYTES, "%.*s", (int)len, text);
		text += len + (text[len] == ',');
	}
	return n > 0 ? n : sim_complain("--slaves: nothing given");
}

static int set_crystals(const struct simulation *sim, struct segment_slave_spec *specs, int count)
{
	struct prng prng = { sim->opt.seed };
	const char *text = sim->opt.ppm;

	for (int i = 0; i < count; i++) {
		specs[i].ppm = (prng_unit(&prng) - 0.5) * 100.0;
		specs[i].clock_start_ns = prng_below(&prng, 10 * (uint64_t)NS_PER_S);
		if (text != NULL && *text != '\0') {
			char *end;

			specs[i].ppm = strtod(text, &end);
			if (end == text || (*end != ',' && *end != '\0') || specs[i].ppm < -1000 ||
			    specs[i].ppm > 1000) {
				return sim_complain(
					"--ppm: numbers from -1000 to 1000, with commas");
			}
			text = *end == ',' ? end + 1 : end;
		}
	}
	return 0;
}

static int make_segment(struct simulation *sim)
{
	static char names[LIMIT_SLAVES][PIECE_BYTES];
	static struct segment_slave_spec specs[LIMIT_SLAVES];
	int count = list_slaves(sim, names);

	if (count < 0) {
		return -1;
	}
	for (int i = 0; i < count; i++) {
		if (make_slave(sim, names[i], (unsigned)i, &specs[i]) < 0) {
			return -1;
		}
	}
	if (set_crystals(sim, specs, count) < 0) {
		return -1;
	}
	if (segment_create(specs, (size_t)count, wire_socket_now_ns(), &sim->segment) < 0) {
		return sim_complain("the segment cannot be made: no memory");
	}
	return 0;
}

static void write_edge(void *ctx, unsigned slave, int64_t t_ns, uint64_t system_time_ns)
{
	struct simulation *sim = ctx;

	fprintf(sim->edges, "%u %lld %llu\n", slave, (long long)t_ns,
		(unsigned long long)system_time_ns);
}

static int open_all(struct simulation *sim)
{
	char error[256];

	sim->faults = fault_plan_create(sim->opt.seed, wire_socket_now_ns());
	if (sim->faults == NULL) {
		return sim_complain("no memory");
	}
	if (sim->opt.faults != NULL &&
	    fault_plan_load(sim->faults, sim->opt.faults, segment_slave_count(sim->segment), error,
			    sizeof(error)) < 0) {
		return sim_complain(error);
	}
	if (sim->opt.edges != NULL) {
		sim->edges = fopen(sim->opt.edges, "w");
		if (sim->edges == NULL) {
			snprintf(error, sizeof(error), "%s: %s", sim->opt.edges, strerror(errno));
			return sim_complain(error);
		}
		segment_sync0_to(sim->segment, write_edge, sim);
	}
	sim->control_fd = -1;
	if (sim->opt.control != NULL) {
		sim->control_fd = control_open(sim->opt.control, error, sizeof(error));
		if (sim->control_fd < 0) {
			return sim_complain(error);
		}
	}
	sim->fd = wire_socket_open(sim->opt.interface, error, sizeof(error));
	return sim->fd < 0 ? sim_complain(error) : 0;
}

static void go_real_time(const struct sim_options *opt)
{
	struct sched_param p = { .sched_priority = opt->priority };
	cpu_set_t set;

	if (opt->cpu >= 0) {
		CPU_ZERO(&set);
		CPU_SET((unsigned)opt->cpu, &set);
		if (sched_setaffinity(0, sizeof(set), &set) < 0) {
			perror("ecdaq-sim: --cpu");
		}
	}
	if (opt->priority > 0 && sched_setscheduler(0, SCHED_FIFO, &p) < 0) {
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

static void answer(struct simulation *sim, uint8_t *frame, size_t len, int64_t t_ns)
{
	struct fault_verdict v = fault_plan_judge(sim->faults, sim->segment, t_ns, len);
	int64_t back_ns;

	sim->frames++;
	if (v.is_dropped) {
		return;
	}
	if (segment_frame(sim->segment, t_ns, frame, len, &back_ns) < 0) {
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
	if (v.delay_ns > 0) {
		hold(sim, frame, len, t_ns + v.delay_ns);
		return;
	}
	/* A master that is gone, or a link that is down, is no fault of ours. */
	(void)!send(sim->fd, frame, len, 0);
	if (v.is_doubled) {
		(void)!send(sim->fd, frame, len, 0);
	}
}

static int64_t release_held(struct simulation *sim, int64_t now_ns)
{
	int64_t next_ns = INT64_MAX;

	for (unsigned i = 0; i < HELD_MAX; i++) {
		struct held *h = &sim->held[i];

		if (h->is_used && h->due_ns <= now_ns) {
			(void)!send(sim->fd, h->bytes, h->len, 0);
			h->is_used = 0;
		} else if (h->is_used && h->due_ns < next_ns) {
			next_ns = h->due_ns;
		}
	}
	return next_ns;
}

static int serve(struct simulation *sim)
{
	uint8_t frame[FRAME_BYTES];
	char line[256];

	while (!atomic_load_explicit(&stop_wanted, memory_order_relaxed)) {
		int64_t now_ns = wire_socket_now_ns();
		int64_t due_ns = release_held(sim, now_ns);
		int64_t wait_ns = due_ns - now_ns < CATCH_UP_NS ? due_ns - now_ns : CATCH_UP_NS;
		int64_t t_ns = 0;
		int n = wire_socket_receive(sim->fd, frame, sizeof(frame), wait_ns, &t_ns);

		if (n > 0) {
			answer(sim, frame, (size_t)n, t_ns);
			continue;
		}
		if (n < 0 && n != -ENETDOWN) {
			snprintf(line, sizeof(line), "interface %s: %s", sim->opt.interface,
				 strerror(-n));
			return sim_complain(line);
		}
		/* Nobody asks: let the slaves live on meanwhile, so that no frame has to wait for
		 * them. */
		segment_advance(sim->segment, wire_socket_now_ns());
		if (sim->control_fd >= 0) {
			control_serve(sim->control_fd, sim->faults,
				      segment_slave_count(sim->segment), wire_socket_now_ns());
		}
	}
	return 0;
}

int main(int argc, char **argv)
{
	static struct simulation sim = {
		.opt = { .slaves = "2", .seed = 1, .cpu = -1 },
		.control_fd = -1,
	};
	struct sigaction action = { .sa_handler = on_signal };
	int r;

	sim.opt.signal = signal_default();
	sim_options_read(argc, argv, &sim.opt);
	sigaction(SIGTERM, &action, NULL);
	sigaction(SIGINT, &action, NULL);
	if (make_segment(&sim) < 0 || open_all(&sim) < 0) {
		return 1;
	}
	go_real_time(&sim.opt);
	r = serve(&sim);
	fprintf(stderr, "ecdaq-sim: %llu frames, %llu damaged\n", (unsigned long long)sim.frames,
		(unsigned long long)sim.bad_frames);
	if (sim.edges != NULL) {
		fclose(sim.edges);
	}
	if (sim.opt.control != NULL) {
		unlink(sim.opt.control);
	}
	segment_destroy(sim.segment);
	fault_plan_destroy(sim.faults);
	for (unsigned i = 0; i < LIMIT_SLAVES; i++) {
		free(sim.sii[i]);
	}
	return r < 0 ? 1 : 0;
}
