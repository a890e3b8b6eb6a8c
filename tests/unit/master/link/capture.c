/* SPDX-License-Identifier: MIT */
#include "link/capture.h"

#include <stdio.h>
#include <unistd.h>

#include "base/frame_record.h"
#include "base/ring.h"
#include "harness/test.h"
#include "unit/master/link/fake_wire.h"

struct bench {
	struct fake_wire wire;
	struct capture *capture;
	struct transport transport;
	struct ring *ring;
	struct ring_reader *reader;
	char path[64];
};

static void open_bench(struct bench *b)
{
	struct ring_spec spec = { .path = b->path,
				  .kind = FRAME_RING_KIND,
				  .payload_bytes = FRAME_SLOT_BYTES,
				  .slot_count = 8,
				  .file_mode = 0600 };

	*b = (struct bench){ .wire = { .now_ns = 1000, .travel_ns = FAKE_TRAVEL_NS } };
	snprintf(b->path, sizeof(b->path), "/dev/shm/ecdaq-capture-%d", (int)getpid());
	CHECK_EQ(ring_create(&spec, &b->ring), 0);
	CHECK_EQ(ring_reader_open(b->path, &b->reader), 0);
	CHECK_EQ(capture_create(fake_platform(&b->wire), &b->capture), 0);
	b->transport = capture_wrap(b->capture, fake_transport(&b->wire));
}

static void close_bench(struct bench *b)
{
	b->transport.destroy(b->transport.ctx);
	capture_destroy(b->capture);
	ring_reader_destroy(b->reader);
	ring_destroy(b->ring);
	unlink(b->path);
}

static size_t exchange(struct bench *b, uint8_t *frame)
{
	static const uint8_t source[6] = { 2 };
	uint8_t answer[LIMIT_FRAME_BYTES];
	struct ecat_frame_builder fb;
	mono_t at = { 0 };
	size_t len;

	ecat_frame_begin(&fb, frame, source);
	ecat_frame_add(&fb, ECAT_CMD_BRD, 0, 0, 0x0130, 2);
	len = ecat_frame_end(&fb);
	b->transport.send(b->transport.ctx, frame, len);
	b->transport.receive(b->transport.ctx, answer, sizeof(answer),
			     (mono_t){ b->wire.now_ns + NS_PER_MS }, &at);
	return len;
}

TEST(capture, frames_are_copied_out_and_in_with_their_times_and_only_when_wanted)
{
	struct bench b;
	uint8_t frame[LIMIT_FRAME_BYTES];
	uint8_t slot[FRAME_SLOT_BYTES];
	struct frame_record head;
	int64_t sent_ns;
	uint64_t lost;
	size_t len;

	open_bench(&b);
	exchange(&b, frame);
	CHECK_EQ(ring_pushed(b.ring), 0);
	capture_set_ring(b.capture, b.ring);
	sent_ns = b.wire.now_ns;
	len = exchange(&b, frame);
	CHECK_EQ(ring_pushed(b.ring), 2);
	CHECK_EQ(ring_read(b.reader, slot, sizeof(slot), &lost), RING_OK);
	memcpy(&head, slot, sizeof(head));
	CHECK_EQ(head.direction, FRAME_OUT);
	CHECK_EQ(head.mono_ns, sent_ns);
	CHECK_EQ(head.frame_bytes, len);
	CHECK_EQ(head.error, 0);
	CHECK_MEM(slot + sizeof(head), frame, len);
	CHECK_EQ(ring_read(b.reader, slot, sizeof(slot), &lost), RING_OK);
	memcpy(&head, slot, sizeof(head));
	CHECK_EQ(head.direction, FRAME_IN);
	CHECK(head.mono_ns >= sent_ns + FAKE_TRAVEL_NS);
	CHECK_EQ(head.frame_bytes, len);
	capture_set_ring(b.capture, NULL);
	exchange(&b, frame);
	CHECK_EQ(ring_pushed(b.ring), 2);
	close_bench(&b);
}

TEST(capture, frames_that_nobody_reads_are_overwritten_and_counted)
{
	enum { EXCHANGES = 50 };
	struct bench b;
	uint8_t frame[LIMIT_FRAME_BYTES];
	uint8_t slot[FRAME_SLOT_BYTES];
	enum ring_result got;
	uint64_t missed = 0;
	uint64_t lost;
	uint64_t count = 0;

	open_bench(&b);
	capture_set_ring(b.capture, b.ring);
	for (int n = 0; n < EXCHANGES; n++) {
		exchange(&b, frame);
	}
	while ((got = ring_read(b.reader, slot, sizeof(slot), &lost)) != RING_EMPTY) {
		CHECK(got == RING_OK || got == RING_LOST);
		if (got == RING_OK) {
			count++;
		} else {
			missed += lost;
		}
	}
	CHECK(count > 0 && count <= 8);
	CHECK_EQ(count + missed, 2 * EXCHANGES);
	close_bench(&b);
}

TEST(capture, a_frame_that_the_transport_refuses_is_marked_and_the_error_is_passed_on)
{
	struct bench b;
	uint8_t frame[60] = { 0 };
	uint8_t slot[FRAME_SLOT_BYTES];
	struct frame_record head;
	uint64_t lost;

	open_bench(&b);
	capture_set_ring(b.capture, b.ring);
	b.wire.send_error = -ENOBUFS;
	CHECK_EQ(b.transport.send(b.transport.ctx, frame, sizeof(frame)), -ENOBUFS);
	CHECK_EQ(ring_read(b.reader, slot, sizeof(slot), &lost), RING_OK);
	memcpy(&head, slot, sizeof(head));
	CHECK_EQ(head.error, -ENOBUFS);
	close_bench(&b);
}
