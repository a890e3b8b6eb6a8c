/* SPDX-License-Identifier: MIT */
#include "sim/harness/virtual_master.h"

#include <errno.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "harness/test.h"
#include "image/image.h"
#include "sim/harness/rt_guard.h"
#include "sim/harness/run_dir.h"

enum {
	REPLY_CYCLES = 2000,     /* an answer has to come within so many */
	TRANSFER_CYCLES = 60000, /* the same of one with much data */
	SETTLE_CYCLES = 100,     /* behind the bring-up, before a test begins to count */
};

#define FNV_START UINT64_C(0xcbf29ce484222325)
#define FNV_PRIME UINT64_C(0x100000001b3)

/* --- doors: behind them is the simulated world, which may do what the cycle may not --- */

static mono_t door_now(void *ctx)
{
	struct virtual_master *vm = ctx;
	struct platform pf = in_process_platform(vm->bench->host);
	mono_t now = pf.now(pf.ctx);

	if (vm->stop_at_ns != 0 && virtual_bench_now_ns(vm->bench) >= vm->stop_at_ns) {
		session_stop_ask(vm->session);
	}
	return now;
}

static int64_t door_tai(void *ctx)
{
	struct virtual_master *vm = ctx;
	struct platform pf = in_process_platform(vm->bench->host);

	return pf.tai_ns(pf.ctx);
}

static int open_door(void)
{
	int was_armed = rt_guard_is_armed();

	rt_guard_disarm();
	return was_armed;
}

static void close_door(int was_armed)
{
	if (was_armed) {
		rt_guard_arm();
	}
}

static int door_sleep(void *ctx, mono_t deadline)
{
	struct virtual_master *vm = ctx;
	struct platform pf = in_process_platform(vm->bench->host);
	int was_armed = open_door();
	int r = pf.sleep_until(pf.ctx, deadline);

	close_door(was_armed);
	return r;
}

static int door_send(void *ctx, const uint8_t *frame, size_t frame_len)
{
	struct virtual_master *vm = ctx;
	struct transport tr = in_process_transport(vm->bench->host);
	int was_armed = open_door();
	int r;

	if (vm->each_sent != NULL) {
		vm->each_sent(vm, frame, frame_len);
	}
	r = tr.send(tr.ctx, frame, frame_len);
	close_door(was_armed);
	return r;
}

static int door_receive(void *ctx, uint8_t *frame, size_t capacity, mono_t deadline, mono_t *ret_at)
{
	struct virtual_master *vm = ctx;
	struct transport tr = in_process_transport(vm->bench->host);
	int was_armed = open_door();
	int r = tr.receive(tr.ctx, frame, capacity, deadline, ret_at);

	if (r > 0 && vm->each_frame != NULL) {
		vm->each_frame(vm, frame, (size_t)r);
	}
	close_door(was_armed);
	return r;
}

static int door_is_up(void *ctx)
{
	struct virtual_master *vm = ctx;
	struct transport tr = in_process_transport(vm->bench->host);

	return tr.is_up(tr.ctx);
}

static void door_destroy(void *ctx)
{
	(void)ctx;
}

/* --- hooks --- */

static int open_transport(void *ctx, struct transport *ret_transport, struct failure *failure)
{
	(void)failure;
	*ret_transport = (struct transport){ .send = door_send,
					     .receive = door_receive,
					     .is_up = door_is_up,
					     .destroy = door_destroy,
					     .ctx = ctx };
	return 0;
}

static int start_cycle(void *ctx, struct cycle *cycle, struct failure *failure)
{
	struct virtual_master *vm = ctx;

	(void)failure;
	vm->cycle = cycle;
	return 0;
}

static int end_cycle(void *ctx)
{
	struct virtual_master *vm = ctx;
	int r = 0;

	if (vm->cycle != NULL) {
		cycle_has_stopped(vm->cycle, &r);
	}
	vm->cycle = NULL;
	return r;
}

static int has_cycle_ended(void *ctx)
{
	const struct virtual_master *vm = ctx;
	int r;

	return vm->cycle != NULL && cycle_has_stopped(vm->cycle, &r);
}

static void step_cycle(struct virtual_master *vm)
{
	int r;

	if (cycle_has_stopped(vm->cycle, &r)) {
		return; /* its thread is no more */
	}
	rt_guard_arm();
	cycle_step(vm->cycle);
	rt_guard_disarm();
	if (vm->each_cycle != NULL) {
		vm->each_cycle(vm);
	}
}

static void advance_clock(void *ctx, mono_t until)
{
	struct virtual_master *vm = ctx;
	struct platform pf = in_process_platform(vm->bench->host);

	if (vm->cycle != NULL && !has_cycle_ended(vm)) {
		step_cycle(vm);
	} else {
		pf.sleep_until(pf.ctx, until);
	}
}

/* --- samples --- */

static void hash_bytes(uint64_t *hash, const uint8_t *bytes, size_t len)
{
	while (len > 0) {
		size_t n = len < sizeof(uint64_t) ? len : sizeof(uint64_t);
		uint64_t word = 0;

		memcpy(&word, bytes, n);
		*hash = (*hash ^ word) * FNV_PRIME;
		*hash ^= *hash >> 32; /* a multiplication carries upwards only */
		bytes += n;
		len -= n;
	}
}

static const struct sample_meta *meta_of(const struct virtual_master *vm)
{
	size_t bytes;

	return ring_meta(vm->samples, &bytes);
}

static void count_op(struct virtual_result *res, const struct sample_header *h)
{
	static const uint32_t reasons =
		SAMPLE_LOST | SAMPLE_LATE | SAMPLE_SKIPPED | SAMPLE_WKC_LOW | SAMPLE_UNCHECKED;

	res->op++;
	res->bad += !slave_set_is_empty(&h->slaves_bad);
	res->bad_unexplained += !slave_set_is_empty(&h->slaves_bad) && (h->flags & reasons) == 0;
	res->unlocked += (h->flags & SAMPLE_DC_UNLOCKED) != 0;
	if (llabs((long long)h->phase_error_ns) > res->phase_max_ns) {
		res->phase_max_ns = llabs((long long)h->phase_error_ns);
	}
}

static void count_sample(struct virtual_master *vm, size_t payload_bytes)
{
	struct virtual_result *res = &vm->result;
	struct sample_header h = { .cycle = 0 };

	memcpy(&h, vm->newest, sample_head_bytes(meta_of(vm)->slave_count));
	vm->newest_header = h;
	if (res->samples == 0) {
		res->first_cycle = h.cycle;
	} else if (h.cycle != res->last_cycle + 1) {
		res->gaps++;
	}
	res->last_cycle = h.cycle;
	res->samples++;
	res->lost += (h.flags & SAMPLE_LOST) != 0;
	res->late += (h.flags & SAMPLE_LATE) != 0;
	res->doubled += (h.flags & SAMPLE_DOUBLED) != 0;
	res->skipped += (h.flags & SAMPLE_SKIPPED) != 0;
	res->wkc_low += (h.flags & SAMPLE_WKC_LOW) != 0;
	if ((h.flags & SAMPLE_NOT_OP) == 0) {
		count_op(res, &h);
	}
	hash_bytes(&res->hash, vm->newest, payload_bytes);
	if (vm->each_sample != NULL) {
		vm->each_sample(vm);
	}
}

static void take_samples(struct virtual_master *vm)
{
	uint64_t lost = 0;
	enum ring_result r;

	if (vm->samples == NULL) {
		return; /* there was no cycle yet */
	}
	while ((r = ring_read(vm->samples, vm->newest, ring_payload_bytes(vm->samples), &lost)) ==
		       RING_OK ||
	       r == RING_LOST) {
		if (r == RING_LOST) {
			test_fail(__FILE__, __LINE__, "the ring ran over: %llu samples",
				  (unsigned long long)lost);
		}
		count_sample(vm, ring_payload_bytes(vm->samples));
	}
}

static void open_samples(struct virtual_master *vm)
{
	char path[128];

	ring_reader_destroy(vm->samples);
	vm->samples = NULL;
	snprintf(path, sizeof(path), "%s/" CONFIG_RUN_SAMPLES, vm->dir);
	CHECK_EQ(ring_reader_open(path, &vm->samples), 0);
	ring_seek(vm->samples, ring_oldest(vm->samples));
}

/* --- life --- */

static void configure(struct virtual_master *vm, const char *const *settings)
{
	char error[256] = "";

	config_defaults(&vm->cfg);
	vm->cfg.ring_depth_ns = 4 * NS_PER_S;
	snprintf(vm->cfg.run_dir, sizeof(vm->cfg.run_dir), "%s", vm->dir);
	snprintf(vm->cfg.interface, sizeof(vm->cfg.interface), "virtual");
	for (size_t i = 0; settings != NULL && settings[i] != NULL; i++) {
		if (config_set(&vm->cfg, settings[i], error, sizeof(error)) < 0) {
			test_fail(__FILE__, __LINE__, "%s", error);
		}
	}
	CHECK_EQ(config_check(&vm->cfg, error, sizeof(error)), 0);
}

static void init(struct virtual_master *vm, struct virtual_bench *bench,
		 const char *const *settings, int can_wait)
{
	struct session_spec spec = {
		.cfg = &vm->cfg,
		.platform = { .now = door_now,
			      .tai_ns = door_tai,
			      .sleep_until = door_sleep,
			      .ctx = vm },
		.hooks = { .transport_open = open_transport,
			   .cycle_start = start_cycle,
			   .cycle_end = end_cycle,
			   .cycle_has_ended = has_cycle_ended,
			   .wait = advance_clock,
			   .ctx = vm },
		.segment = RUN_DIR_SIMULATED,
		.can_wait = can_wait,
	};

	memset(vm, 0, sizeof(*vm));
	vm->bench = bench;
	run_dir_make(vm->dir, sizeof(vm->dir));
	configure(vm, settings);
	bench->scope.period_ns = vm->cfg.cycle_period_ns;
	virtual_master_forget(vm);
	if (session_create(&spec, &vm->session, &vm->failure) < 0) {
		test_fail(__FILE__, __LINE__, "%s", vm->failure.text);
	}
}

void virtual_master_init(struct virtual_master *vm, struct virtual_bench *bench,
			 const char *const *settings)
{
	init(vm, bench, settings, 0);
}

void virtual_master_init_waiting(struct virtual_master *vm, struct virtual_bench *bench,
				 const char *const *settings)
{
	init(vm, bench, settings, 1);
}

void virtual_master_init_pair(struct virtual_master *vm, struct virtual_bench *bench,
			      const char *setting, int waits)
{
	const char *const settings[] = { "slaves[0].name=a", "slaves[1].name=b", setting, NULL };

	virtual_bench_init(bench,
			   &(struct virtual_spec){ .slaves = 2, .seed = 5, .ppm = { 30, -40 } });
	init(vm, bench, settings, waits);
}

void virtual_master_kill(struct virtual_master *vm)
{
	ring_reader_destroy(vm->samples);
	vm->samples = NULL;
	session_destroy(vm->session);
	vm->session = NULL;
	run_dir_remove(vm->dir);
}

void virtual_master_close(struct virtual_master *vm)
{
	virtual_master_kill(vm);
	virtual_bench_done(vm->bench);
}

int virtual_master_bring_up(struct virtual_master *vm)
{
	int64_t start_ns = virtual_bench_now_ns(vm->bench);
	int r = session_bring_up(vm->session, &vm->failure);

	if (vm->cycle != NULL) { /* also where it failed and the session waits */
		vm->op_ns = virtual_bench_now_ns(vm->bench) - start_ns;
		open_samples(vm);
		take_samples(vm);
	}
	return r;
}

static int run_cycles(struct virtual_master *vm, uint64_t cycles)
{
	const _Atomic uint64_t *done = &session_page(vm->session)->cycle.cycles;
	uint64_t end = *done + cycles;
	int r = SESSION_GOES_ON;

	while (r == SESSION_GOES_ON && *done < end) {
		int ended = has_cycle_ended(vm);

		step_cycle(vm);
		if (ended || ++vm->steps >= VIRTUAL_SERVICE_CYCLES) {
			vm->steps = 0;
			r = session_service(vm->session, &vm->failure);
			take_samples(vm);
		}
	}
	take_samples(vm);
	return r;
}

static int serve(struct virtual_master *vm, uint64_t periods)
{
	int r = SESSION_GOES_ON;

	for (uint64_t i = 0; i < periods && r == SESSION_GOES_ON; i++) {
		advance_clock(vm, (mono_t){ door_now(vm).ns + vm->cfg.cycle_period_ns });
		if (++vm->steps >= VIRTUAL_SERVICE_CYCLES) {
			vm->steps = 0;
			r = session_service(vm->session, &vm->failure);
		}
	}
	return r;
}

int virtual_master_run(struct virtual_master *vm, uint64_t cycles)
{
	if (vm->cycle == NULL) {
		return serve(vm, cycles);
	}
	return run_cycles(vm, cycles);
}

int virtual_master_stop(struct virtual_master *vm)
{
	int r = session_stop(vm->session, &vm->failure);

	take_samples(vm);
	session_conclude(vm->session, NULL);
	return r;
}

void virtual_master_forget(struct virtual_master *vm)
{
	vm->result = (struct virtual_result){ .hash = FNV_START };
}

void virtual_master_settle(struct virtual_master *vm)
{
	if (virtual_master_bring_up(vm) < 0) {
		test_fail(__FILE__, __LINE__, "%s", vm->failure.text);
	}
	virtual_master_run(vm, SETTLE_CYCLES);
	virtual_master_forget(vm);
}

void virtual_master_check_undisturbed(const struct virtual_master *vm, uint64_t samples)
{
	CHECK(vm->result.samples >= samples);
	CHECK_EQ(vm->result.op, vm->result.samples);
	CHECK_EQ(vm->result.gaps, 0);
	CHECK_EQ(vm->result.lost, 0);
	CHECK_EQ(vm->result.late, 0);
	CHECK_EQ(vm->result.skipped, 0);
	CHECK_EQ(vm->result.wkc_low, 0);
	CHECK_EQ(vm->result.bad, 0);
}

const struct sample_header *virtual_master_sample(const struct virtual_master *vm)
{
	return &vm->newest_header;
}

uint64_t virtual_master_value(const struct virtual_master *vm, const char *name)
{
	const struct sample_meta *meta = meta_of(vm);
	const struct channel *channels = sample_meta_channels(meta);
	int n = image_channel_find(channels, meta->channel_count, name);

	if (n < 0) {
		test_fail(__FILE__, __LINE__, "no channel is named %s", name);
	}
	return image_get_raw(vm->newest + sample_head_bytes(meta->slave_count), &channels[n]);
}

void virtual_master_print_events(const struct virtual_master *vm, uint64_t count)
{
	struct ring_reader *reader = NULL;
	struct event ev;
	char path[128];
	char text[256];
	uint64_t lost;

	snprintf(path, sizeof(path), "%s/" CONFIG_RUN_EVENTS, vm->dir);
	if (ring_reader_open(path, &reader) < 0) {
		return;
	}
	ring_seek(reader, ring_newest(reader) > count ? ring_newest(reader) - count : 0);
	while (ring_read(reader, &ev, sizeof(ev), &lost) == RING_OK) {
		event_format(&ev, text, sizeof(text));
		fprintf(stderr, "  %.6f s: %s\n", (double)ev.mono_ns * 1e-9, text);
	}
	ring_reader_destroy(reader);
}

/* --- admin --- */

int virtual_master_connect(const struct virtual_master *vm)
{
	struct sockaddr_un address = { .sun_family = AF_UNIX };
	int fd = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);

	snprintf(address.sun_path, sizeof(address.sun_path), "%s/" CONFIG_RUN_ADMIN, vm->dir);
	CHECK_EQ(connect(fd, (const struct sockaddr *)&address, sizeof(address)), 0);
	return fd;
}

/* The request with its data, in as many messages as it takes. */
static void send_request(int fd, const struct admin_request *request, const uint8_t *data,
			 size_t len)
{
	struct admin_request message = *request;
	size_t sent = 0;

	if (data == NULL) {
		CHECK_EQ(send(fd, &message, sizeof(message), 0), sizeof(message));
		return;
	}
	message.data_total = (uint32_t)len;
	do {
		size_t left = len - sent;

		message.data_offset = (uint32_t)sent;
		message.data_len = (uint32_t)(left < ADMIN_DATA_BYTES ? left : ADMIN_DATA_BYTES);
		memcpy(message.data, data + sent, message.data_len);
		CHECK_EQ(send(fd, &message, sizeof(message), 0), sizeof(message));
		message.verb = ADMIN_DATA;
		sent += message.data_len;
	} while (sent < len);
}

struct admin_reply virtual_master_transfer(struct virtual_master *vm,
					   const struct admin_request *request,
					   struct virtual_transfer *tr)
{
	struct admin_reply reply;
	int fd = virtual_master_connect(vm);

	send_request(fd, request, tr->data, tr->data_len);
	for (int i = 0; i < TRANSFER_CYCLES / VIRTUAL_SERVICE_CYCLES; i++) {
		if (virtual_master_run(vm, VIRTUAL_SERVICE_CYCLES) == SESSION_RESTART) {
			virtual_master_bring_up(vm);
		}
		while (recv(fd, &reply, sizeof(reply), MSG_DONTWAIT) == (ssize_t)sizeof(reply)) {
			tr->reports += (unsigned)(reply.kind == ADMIN_REPLY_PROGRESS);
			CHECK(reply.data_len <= sizeof(tr->answer) - tr->answer_len);
			memcpy(tr->answer + tr->answer_len, reply.data, reply.data_len);
			tr->answer_len += reply.data_len;
			if (reply.kind == ADMIN_REPLY_DONE) {
				close(fd);
				return reply;
			}
		}
	}
	test_fail(__FILE__, __LINE__, "no reply to verb %u", request->verb);
}

struct admin_reply virtual_master_ask(struct virtual_master *vm,
				      const struct admin_request *request)
{
	struct admin_reply reply;
	int fd = virtual_master_connect(vm);

	CHECK_EQ(send(fd, request, sizeof(*request), 0), sizeof(*request));
	for (int i = 0; i < REPLY_CYCLES / VIRTUAL_SERVICE_CYCLES; i++) {
		if (virtual_master_run(vm, VIRTUAL_SERVICE_CYCLES) == SESSION_RESTART) {
			virtual_master_bring_up(vm);
		}
		if (recv(fd, &reply, sizeof(reply), MSG_DONTWAIT) == (ssize_t)sizeof(reply)) {
			close(fd);
			return reply;
		}
	}
	test_fail(__FILE__, __LINE__, "no reply to verb %u", request->verb);
}
