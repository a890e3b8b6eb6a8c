/* SPDX-License-Identifier: MIT */
#include "replay_transport.h"

#include <unistd.h>

#include "capture_transport.h"
#include "harness/test.h"
#include "link/line.h"
#include "unit/master/link/fake_wire.h"

static const char *make_path(void)
{
	static char path[64];
	int fd;

	snprintf(path, sizeof(path), "/tmp/ecdaq-replay-XXXXXX");
	fd = mkstemp(path);
	CHECK(fd >= 0);
	close(fd);
	return path;
}

static size_t make_frame(uint8_t *frame, uint8_t source_byte, uint8_t idx, uint16_t reg,
			 uint8_t value)
{
	const uint8_t source[6] = { source_byte, 1, 1, 1, 1, 1 };
	struct ecat_frame_builder fb;
	uint8_t *data;

	ecat_frame_begin(&fb, frame, source);
	data = ecat_frame_add(&fb, ECAT_CMD_FPRW, idx, 0x1001, reg, 4);
	data[0] = value;
	return ecat_frame_end(&fb);
}

/* Three transactions, one of them lost, through a capturing transport. */
static void make_capture(const char *path)
{
	struct fake_wire wire = { 0 };
	struct transport transport;
	struct line *line;
	uint8_t frame[LIMIT_FRAME_BYTES];
	uint8_t answer[LIMIT_FRAME_BYTES];

	CHECK_EQ(capture_create(path, 1 << 16, fake_platform(&wire), fake_transport(&wire),
				&transport),
		 0);
	CHECK_EQ(line_create(fake_platform(&wire), transport, &line), 0);
	for (uint8_t i = 0; i < 3; i++) {
		size_t len = make_frame(frame, 0x10, i, (uint16_t)(0x100 + i), i);

		wire.drop = i == 1;
		line_transact(line, frame, len, answer, sizeof(answer), (span_t){ 1000000 });
	}
	line_destroy(line);
}

struct stage {
	struct replay *rp;
	struct line *line;
};

static struct stage stage_of(const char *path, unsigned mask)
{
	struct stage st;
	char error[128];

	CHECK_EQ(replay_create(path, mask, &st.rp, error, sizeof(error)), 0);
	CHECK_EQ(line_create(replay_platform(st.rp), replay_transport(st.rp), &st.line), 0);
	return st;
}

static void stage_done(struct stage *st)
{
	line_destroy(st->line);
	replay_destroy(st->rp);
}

static int transact(struct stage *st, uint8_t source, uint8_t idx, uint16_t reg, uint8_t value)
{
	uint8_t frame[LIMIT_FRAME_BYTES];
	uint8_t answer[LIMIT_FRAME_BYTES];
	size_t len = make_frame(frame, source, idx, reg, value);

	return line_transact(st->line, frame, len, answer, sizeof(answer), (span_t){ 1000000 });
}

TEST(replay, same_frames_get_the_captured_answers)
{
	const char *path = make_path();
	struct stage st;

	make_capture(path);
	st = stage_of(path, REPLAY_EXACT);
	CHECK_EQ(replay_frames(st.rp), 3);
	CHECK_EQ(transact(&st, 0x10, 0, 0x100, 0), 60);
	CHECK_EQ(transact(&st, 0x10, 1, 0x101, 1), -ETIMEDOUT);
	CHECK_EQ(transact(&st, 0x10, 2, 0x102, 2), 60);
	CHECK_EQ(replay_matched(st.rp), 3);
	CHECK_STR(replay_trouble(st.rp), "");
	stage_done(&st);
	unlink(path);
}

TEST(replay, another_byte_ends_the_replay_and_is_told)
{
	const char *path = make_path();
	struct stage st;

	make_capture(path);
	st = stage_of(path, REPLAY_EXACT);
	CHECK_EQ(transact(&st, 0x10, 0, 0x100, 0), 60);
	CHECK_EQ(transact(&st, 0x10, 1, 0x101, 9), -EPROTO);
	CHECK_EQ(transact(&st, 0x10, 1, 0x101, 1), -EPROTO);
	CHECK_EQ(replay_matched(st.rp), 1);
	CHECK_STR(replay_trouble(st.rp),
		  "frame 2 of 3: it differs from the captured one (byte 26)");
	stage_done(&st);
	unlink(path);
}

TEST(replay, index_and_source_count_unless_they_are_masked)
{
	const char *path = make_path();
	struct stage st;

	make_capture(path);
	st = stage_of(path, REPLAY_EXACT);
	CHECK_EQ(transact(&st, 0x10, 7, 0x100, 0), -EPROTO);
	stage_done(&st);
	st = stage_of(path, REPLAY_MASK_INDEX);
	CHECK_EQ(transact(&st, 0x50, 7, 0x100, 0), -EPROTO);
	stage_done(&st);
	st = stage_of(path, REPLAY_MASK_INDEX | REPLAY_MASK_SOURCE);
	CHECK_EQ(transact(&st, 0x50, 7, 0x100, 0), 60);
	stage_done(&st);
	unlink(path);
}

TEST(replay, end_of_the_capture_is_told)
{
	const char *path = make_path();
	struct stage st;

	make_capture(path);
	st = stage_of(path, REPLAY_EXACT);
	for (uint8_t i = 0; i < 3; i++) {
		transact(&st, 0x10, i, (uint16_t)(0x100 + i), i);
	}
	CHECK_EQ(transact(&st, 0x10, 3, 0x103, 3), -EPROTO);
	CHECK_STR(replay_trouble(st.rp), "frame 4 of 3: the capture has ended (byte 0)");
	stage_done(&st);
	unlink(path);
}

TEST(replay, full_capture_ends_and_stays_readable)
{
	const char *path = make_path();
	struct fake_wire wire = { 0 };
	struct transport transport;
	struct replay *rp;
	uint8_t frame[LIMIT_FRAME_BYTES];
	char error[128];

	CHECK_EQ(capture_create(path, 10, fake_platform(&wire), fake_transport(&wire), &transport),
		 -EINVAL);
	CHECK_EQ(capture_create(path, 400, fake_platform(&wire), fake_transport(&wire), &transport),
		 0);
	for (uint8_t i = 0; i < 20; i++) {
		transport.send(transport.ctx, frame, make_frame(frame, 0x10, i, 0x100, i));
	}
	transport.destroy(transport.ctx);
	CHECK_EQ(replay_create(path, 0, &rp, error, sizeof(error)), 0);
	CHECK_EQ(replay_frames(rp), 3);
	replay_destroy(rp);
	unlink(path);
}

TEST(replay, what_is_no_capture_is_refused_in_one_line)
{
	const char *path = make_path();
	struct replay *rp = NULL;
	char error[128];
	FILE *file;

	CHECK_EQ(replay_create("/nowhere/x.pcapng", 0, &rp, error, sizeof(error)), -ENOENT);
	CHECK(strstr(error, "/nowhere/x.pcapng") != NULL);
	CHECK_EQ(replay_create(path, 0, &rp, error, sizeof(error)), -EBADMSG);
	file = fopen(path, "wb");
	fputs("this is not a capture at all, only text", file);
	fclose(file);
	CHECK_EQ(replay_create(path, 0, &rp, error, sizeof(error)), -EBADMSG);
	CHECK(strchr(error, '\n') == NULL);
	CHECK(rp == NULL);
	unlink(path);
}

/* Both transactions are sent before the first answer comes; the second has none. */
static void make_capture_of_two_equal_frames(const char *path)
{
	struct fake_wire wire = { 0 };
	struct transport transport;
	uint8_t frame[LIMIT_FRAME_BYTES];
	size_t len = make_frame(frame, 0x10, 0, 0x100, 0);

	CHECK_EQ(capture_create(path, 1 << 16, fake_platform(&wire), fake_transport(&wire),
				&transport),
		 0);
	CHECK_EQ(transport.send(transport.ctx, frame, len), 0);
	wire.drop = 1;
	CHECK_EQ(transport.send(transport.ctx, frame, len), 0);
	CHECK_EQ(transport.receive(transport.ctx, frame, sizeof(frame), (mono_t){ 1000000 }, NULL),
		 60);
	transport.destroy(transport.ctx);
}

TEST(replay, a_captured_answer_is_given_once)
{
	const char *path = make_path();
	struct transport transport;
	struct replay *rp;
	uint8_t frame[LIMIT_FRAME_BYTES];
	size_t len = make_frame(frame, 0x10, 0, 0x100, 0);
	char error[128];

	make_capture_of_two_equal_frames(path);
	CHECK_EQ(replay_create(path, REPLAY_EXACT, &rp, error, sizeof(error)), 0);
	transport = replay_transport(rp);
	CHECK_EQ(transport.send(transport.ctx, frame, len), 0);
	CHECK_EQ(transport.send(transport.ctx, frame, len), 0);
	CHECK_EQ(replay_matched(rp), 2);
	CHECK_EQ(transport.receive(transport.ctx, frame, sizeof(frame), (mono_t){ 1000000 }, NULL),
		 60);
	CHECK_EQ(transport.receive(transport.ctx, frame, sizeof(frame), (mono_t){ 1000000 }, NULL),
		 -EAGAIN);
	replay_destroy(rp);
	unlink(path);
}

/* One frame of two datagrams, indices @idx and @idx + 1. */
static size_t make_double_frame(uint8_t *frame, uint8_t idx)
{
	const uint8_t source[6] = { 0x10, 1, 1, 1, 1, 1 };
	struct ecat_frame_builder fb;

	ecat_frame_begin(&fb, frame, source);
	ecat_frame_add(&fb, ECAT_CMD_FPRD, idx, 0x1001, 0x100, 4);
	ecat_frame_add(&fb, ECAT_CMD_FPRD, (uint8_t)(idx + 1), 0x1001, 0x200, 4);
	return ecat_frame_end(&fb);
}

TEST(replay, the_index_of_every_datagram_of_a_frame_is_masked)
{
	const char *path = make_path();
	struct fake_wire wire = { 0 };
	struct transport transport;
	struct replay *rp;
	struct ecat_datagram dg;
	uint8_t frame[LIMIT_FRAME_BYTES];
	char error[128];
	size_t pos = 0;
	int len;

	CHECK_EQ(capture_create(path, 1 << 16, fake_platform(&wire), fake_transport(&wire),
				&transport),
		 0);
	CHECK_EQ(transport.send(transport.ctx, frame, make_double_frame(frame, 0)), 0);
	CHECK(transport.receive(transport.ctx, frame, sizeof(frame), (mono_t){ 1000000 }, NULL) >
	      0);
	transport.destroy(transport.ctx);

	CHECK_EQ(replay_create(path, REPLAY_MASK_INDEX, &rp, error, sizeof(error)), 0);
	transport = replay_transport(rp);
	CHECK_EQ(transport.send(transport.ctx, frame, make_double_frame(frame, 7)), 0);
	len = transport.receive(transport.ctx, frame, sizeof(frame), (mono_t){ 1000000 }, NULL);
	CHECK(len > 0);
	for (uint8_t idx = 7; idx <= 8; idx++) {
		CHECK_EQ(ecat_frame_next(frame, (size_t)len, &pos, &dg), 1);
		CHECK_EQ(dg.idx, idx);
		CHECK_EQ(get_le16(dg.wkc), 1);
	}
	replay_destroy(rp);
	unlink(path);
}

TEST(replay, the_wall_clock_begins_at_the_first_captured_frame)
{
	const char *path = make_path();
	struct fake_wire wire = { 0 };
	struct platform platform;
	struct replay *rp;
	char error[128];

	make_capture(path);
	CHECK_EQ(replay_create(path, REPLAY_EXACT, &rp, error, sizeof(error)), 0);
	platform = replay_platform(rp);
	CHECK_EQ(platform.tai_ns(platform.ctx), fake_tai(&wire)); /* of a wire at time 0 */
	CHECK_EQ(platform.sleep_until(platform.ctx, (mono_t){ 250 }), 0);
	CHECK_EQ(platform.tai_ns(platform.ctx), fake_tai(&wire) + 250);
	replay_destroy(rp);
	unlink(path);
}

/* A file of sysfs has the size of a page and less in it. */
TEST(replay, a_capture_that_cannot_be_read_to_its_end_is_refused)
{
	struct replay *rp = NULL;
	char error[128];

	CHECK_EQ(replay_create("/sys/devices/system/cpu/online", 0, &rp, error, sizeof(error)),
		 -EIO);
	CHECK_STR(error, "capture /sys/devices/system/cpu/online: Input/output error");
	CHECK(rp == NULL);
}
