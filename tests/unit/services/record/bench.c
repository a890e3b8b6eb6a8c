/* SPDX-License-Identifier: MIT */
#include "unit/services/record/bench.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/bytes.h"
#include "base/clock.h"
#include "base/event.h"
#include "harness/test.h"
#include "record/file_io.h"
#include "record/messages.h"
#include "record/store.h"

static mono_t bench_now(void *ctx)
{
	return (mono_t){ ((const struct bench *)ctx)->now_ns };
}

static void bench_say(void *ctx, const char *line)
{
	struct bench *b = ctx;
	size_t len = strlen(b->said);

	snprintf(b->said + len, sizeof(b->said) - len, "%s\n", line);
}

static uint64_t file_bytes(int fd)
{
	struct stat st;

	CHECK_EQ(fstat(fd, &st), 0);
	return (uint64_t)st.st_size;
}

static void note_lost(struct bench *b)
{
	struct bench_lost *lost = &b->lost[b->lost_count];

	CHECK(b->lost_count < BENCH_LOST);
	lost->file = b->file;
	lost->from = b->synced_bytes;
	lost->to = file_bytes(b->file_fd);
	if (lost->to <= lost->from) {
		return;
	}
	lost->fd = dup(b->file_fd);
	CHECK(lost->fd >= 0);
	CHECK(pread(lost->fd, lost->head, sizeof(lost->head), (off_t)lost->from) >= 0);
	b->lost_count++;
}

/* The page cache is dropped: files are what the disk has. */
static void drop_caches(struct bench *b)
{
	for (; b->lost_count > 0; b->lost_count--) {
		struct bench_lost *lost = &b->lost[b->lost_count - 1];
		uint8_t head[sizeof(lost->head)] = { 0 };

		CHECK(pread(lost->fd, head, sizeof(head), (off_t)lost->from) >= 0);
		for (uint64_t at = lost->from;
		     memcmp(head, lost->head, sizeof(head)) == 0 && at < lost->to; at++) {
			CHECK_EQ(pwrite(lost->fd, "", 1, (off_t)at), 1);
		}
		close(lost->fd);
	}
}

static int call_fails(struct bench *b)
{
	b->calls++;
	if (b->fail_call == 0 || b->calls < b->fail_call ||
	    b->calls >= b->fail_call + b->fail_count) {
		return 0;
	}
	note_lost(b);
	return 1;
}

static int io_write(void *ctx, const void *data, size_t len)
{
	struct bench *b = ctx;

	if (call_fails(b)) {
		b->io.write(b->io.ctx, data, len / 2);
		return b->error;
	}
	return b->io.write(b->io.ctx, data, len);
}

static int io_sync(void *ctx)
{
	struct bench *b = ctx;

	int r = call_fails(b) ? b->error : b->io.sync(b->io.ctx);

	b->synced_bytes = r == 0 ? file_bytes(b->file_fd) : b->synced_bytes;
	return r;
}

static int io_truncate(void *ctx, uint64_t bytes)
{
	struct bench *b = ctx;

	if (call_fails(b)) {
		return b->error;
	}
	for (unsigned i = 0; i < b->lost_count; i++) {
		if (b->lost[i].file == b->file && b->lost[i].to > bytes) {
			b->lost[i].to = bytes;
		}
	}
	return b->io.truncate(b->io.ctx, bytes);
}

static void seam_wrap(void *ctx, const char *path, struct mcap_io *io)
{
	struct bench *b = ctx;

	b->io = *io;
	if (b->file_fd > 0) {
		close(b->file_fd);
	}
	b->file_fd = open(path, O_RDWR | O_CLOEXEC);
	CHECK(b->file_fd > 0);
	b->synced_bytes = 0;
	b->file++;
	*io = (struct mcap_io){
		.write = io_write, .sync = io_sync, .truncate = io_truncate, .ctx = b
	};
}

uint64_t bench_used(const char *dir)
{
	struct store_entry *entries;
	uint64_t used = 0;
	size_t count;

	CHECK_EQ(store_list_all(dir, &entries, &count), 0);
	for (size_t i = 0; i < count; i++) {
		used += entries[i].bytes;
	}
	free(entries);
	return used;
}

static int seam_free_bytes(void *ctx, const char *dir, uint64_t *ret_bytes)
{
	struct bench *b = ctx;
	uint64_t used = bench_used(dir);

	b->most_bytes = used > b->most_bytes ? used : b->most_bytes;
	CHECK(b->disk_bytes == 0 || used <= b->disk_bytes);
	*ret_bytes = b->disk_bytes != 0 ? b->disk_bytes - used : b->bytes_free;
	return 0;
}

static void make_rings(struct bench *b, uint64_t slots)
{
	struct {
		struct sample_meta head;
		struct slave_info slave;
		struct channel channel;
	} meta = { .head = { .version = SAMPLE_VERSION,
			     .slave_count = 1,
			     .channel_count = 1,
			     .image_bytes = BENCH_IMAGE_BYTES,
			     .period_ns = 1000000,
			     .session = b->session },
		   .slave = { .name = "adc" },
		   .channel = {
			   .name = "adc.value", .type = CHANNEL_UINT, .bit_len = 32, .scale = 1 } };
	const struct ring_spec samples = { .path = b->ring_path,
					   .kind = "sample",
					   .payload_bytes =
						   sample_head_bytes(1) + BENCH_IMAGE_BYTES,
					   .slot_count = slots,
					   .meta = &meta,
					   .meta_bytes = sizeof(meta),
					   .period_ns = 1000000,
					   .file_mode = 0600 };
	const struct ring_spec events = { .path = b->events_path,
					  .kind = "event",
					  .payload_bytes = sizeof(struct event),
					  .slot_count = 64,
					  .file_mode = 0600 };

	CHECK_EQ(ring_create(&events, &b->events), 0);
	CHECK_EQ(ring_create(&samples, &b->ring), 0);
}

void bench_init(struct bench *b, uint64_t session, uint64_t slots)
{
	snprintf(b->root, sizeof(b->root), "%s/ecdaq-bench-XXXXXX",
		 getenv("TMPDIR") != NULL ? getenv("TMPDIR") : "/tmp");
	CHECK(mkdtemp(b->root) != NULL);
	snprintf(b->ring_path, sizeof(b->ring_path), "%s/samples", b->root);
	snprintf(b->events_path, sizeof(b->events_path), "%s/events", b->root);
	snprintf(b->status_path, sizeof(b->status_path), "%s/record/status", b->root);
	snprintf(b->dir, sizeof(b->dir), "%s/records/here", b->root);
	b->now_ns = 1000 * NS_PER_S;
	b->bytes_free = UINT64_C(1) << 40;
	b->session = session;
	b->seam =
		(struct record_seam){ .wrap = seam_wrap, .free_bytes = seam_free_bytes, .ctx = b };
	b->options = (struct recorder_options){ .ring_path = b->ring_path,
						.events_path = b->events_path,
						.status_path = b->status_path,
						.dir = b->dir,
						.chunk_period_ns = 100 * NS_PER_MS,
						.sync_period_ns = NS_PER_S,
						.zstd_level = 1,
						.config_path = "",
						.config_text = "cycle:\n  period: 1ms\n",
						.platform = { .now = bench_now, .ctx = b },
						.seam = &b->seam,
						.report = bench_say,
						.report_ctx = b };
	make_rings(b, slots);
}

static void remove_tree(const char *path)
{
	char command[BENCH_PATH_BYTES + 64];
	struct store_entry *entries;
	size_t count;

	if (store_list(path, &entries, &count) == 0) {
		for (size_t i = 0; i < count; i++) {
			CHECK_EQ(store_path(path, entries[i].name, command, sizeof(command)), 0);
			unlink(command);
		}
		free(entries);
	}
}

void bench_done(struct bench *b)
{
	static const char *const files[] = { "samples",
					     "events",
					     "record/status",
					     "record",
					     "records/here/.ecdaq-record.lock",
					     "records/here/.ecdaq-record.state" };
	char path[2 * BENCH_PATH_BYTES];

	recorder_destroy(b->recorder);
	drop_caches(b);
	if (b->file_fd > 0) {
		close(b->file_fd);
	}
	ring_destroy(b->ring);
	ring_destroy(b->events);
	remove_tree(b->dir);
	for (size_t i = 0; i < sizeof(files) / sizeof(files[0]); i++) {
		snprintf(path, sizeof(path), "%s/%s", b->root, files[i]);
		remove(path);
	}
	rmdir(b->dir);
	snprintf(path, sizeof(path), "%s/records", b->root);
	rmdir(path);
	rmdir(b->root);
}

void bench_restart_master(struct bench *b, uint64_t session, int is_closed)
{
	struct ring *ring = b->ring;
	struct ring *events = b->events;

	if (is_closed) {
		ring_close(ring);
		ring_close(events);
	}
	b->session = session;
	make_rings(b, 4096);
	ring_destroy(ring);
	ring_destroy(events);
}

void bench_push(struct bench *b, uint64_t first, uint64_t count)
{
	for (uint64_t cycle = first; cycle < first + count; cycle++) {
		int64_t since_ns = (int64_t)cycle * NS_PER_MS;
		struct sample_header h = {
			.cycle = cycle,
			.dc_time_ns = INT64_C(800000000) * NS_PER_S + since_ns,
			.wake_tai_ns = INT64_C(1766000000) * NS_PER_S + since_ns + b->tai_step_ns,
			.frame_dc_ns = INT64_C(800000000) * NS_PER_S + since_ns + 500000,
			.round_trip_ns = 20000,
			.wkc = 1,
			.wkc_expected = 1,
		};
		uint8_t image[BENCH_IMAGE_BYTES];

		b->newest_tai_ns = h.wake_tai_ns;
		put_le32(image, (uint32_t)cycle);
		ring_push(b->ring, &h, sample_head_bytes(1), image, sizeof(image));
	}
}

void bench_push_event(struct bench *b, uint64_t number)
{
	const struct event ev = { .id = EVENT_OUTPUT_SET,
				  .mono_ns = (int64_t)(b->session * 1000 + number),
				  .tai_ns = b->newest_tai_ns + 300000,
				  .value = (int64_t)number,
				  .slave_pos = 0 };

	ring_push(b->events, &ev, sizeof(ev), NULL, 0);
}

int bench_start(struct bench *b)
{
	char error[256];
	int r = recorder_create(&b->options, &b->recorder, error, sizeof(error));

	if (r < 0) {
		bench_say(b, error);
	}
	return r;
}

void bench_kill(struct bench *b)
{
	recorder_destroy(b->recorder);
	b->recorder = NULL;
}

int bench_run(struct bench *b)
{
	int ended = 0;
	enum recorder_result result;

	do {
		result = recorder_step(b->recorder);
		ended |= result == RECORDER_ENDED;
	} while (result != RECORDER_IDLE);
	return ended;
}

void bench_wait(struct bench *b, int64_t ns)
{
	while (ns > 0) {
		int64_t step_ns = ns < 50 * NS_PER_MS ? ns : 50 * NS_PER_MS;

		b->now_ns += step_ns;
		ns -= step_ns;
		bench_run(b);
	}
}

int bench_stop(struct bench *b)
{
	int r = recorder_finish(b->recorder);

	bench_kill(b);
	return r;
}

struct reading {
	struct track track;
	int has_even_times;
	int64_t offset_ns; /* log time of cycle 0; 0: not known yet */
};

static void read_item(void *ctx, const struct mcap_item *item)
{
	struct reading *r = ctx;
	uint64_t cycle;

	track_item(&r->track, item);
	if (r->has_even_times && item->kind == MCAP_ITEM_MESSAGE &&
	    item->id == r->track.cycle_channel &&
	    messages_decode_cycle(item->data, item->data_len, &cycle) == 0) {
		int64_t offset_ns = (int64_t)(item->log_time_ns - cycle * 1000000);

		r->offset_ns = r->offset_ns != 0 ? r->offset_ns : offset_ns;
		CHECK_EQ(offset_ns, r->offset_ns);
	}
}

static void read_one(const char *path, struct reading *reading)
{
	const struct mcap_visitor visitor = { .item = read_item, .ctx = reading };
	struct mcap_source source;
	struct mcap_scan *scan;
	int fd = open(path, O_RDONLY | O_CLOEXEC);

	CHECK(fd >= 0);
	CHECK_EQ(file_source(&fd, &source), 0);
	CHECK_EQ(mcap_scan_create(&source, &visitor, &scan), 0);
	mcap_scan_destroy(scan);
	close(fd);
}

struct track bench_read(struct bench *b, unsigned *ret_finished, unsigned *ret_parts)
{
	struct store_entry *entries;
	struct reading reading = { .has_even_times = b->has_even_times };
	size_t count;

	drop_caches(b);
	*ret_finished = 0;
	*ret_parts = 0;
	track_init(&reading.track);
	CHECK_EQ(store_list(b->dir, &entries, &count), 0);
	for (size_t i = 0; i < count; i++) {
		char path[2 * BENCH_PATH_BYTES];

		*(entries[i].is_part ? ret_parts : ret_finished) += 1;
		CHECK_EQ(store_path(b->dir, entries[i].name, path, sizeof(path)), 0);
		read_one(path, &reading);
	}
	free(entries);
	return reading.track;
}
