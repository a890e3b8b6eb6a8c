/* SPDX-License-Identifier: MIT */
/*
 * ADMIN_CAPTURE: frames go to a ring in the run directory as long as somebody asks for it. The
 * request stays open; its end, however it comes, ends the capture. The ring is kept until the
 * daemon ends: the cycle thread may be writing to it, and the next capture takes it again.
 */
#include <errno.h>
#include <string.h>

#include "base/frame_record.h"
#include "base/ring.h"
#include "daemon/session_internal.h"
#include "link/capture.h"

/* Two seconds at 1 kHz with one cyclic frame, out and in; 6 MiB. */
enum { CAPTURE_SLOTS = 4096, FILE_MODE = 0640 };

static void end(struct admin_pending *pending, int result)
{
	struct session *s = pending->work;

	s->captures--;
	if (s->captures == 0) {
		capture_set_ring(s->capture, NULL);
	}
	pending->cancel = NULL;
	admin_pending_complete(pending, result);
}

static void cancel(struct admin_pending *pending)
{
	end(pending, -ECANCELED);
}

static int make_ring(struct session *s)
{
	char path[CONFIG_PATH_BYTES + 16];
	const struct ring_spec spec = {
		.path = path,
		.kind = FRAME_RING_KIND,
		.payload_bytes = FRAME_SLOT_BYTES,
		.slot_count = CAPTURE_SLOTS,
		.file_mode = FILE_MODE,
	};
	int r = run_dir_path(&s->run, CONFIG_RUN_FRAMES, path, sizeof(path));

	return r < 0 ? r : ring_create(&spec, &s->frames);
}

void session_capture(void *ctx, struct admin_pending *pending)
{
	struct session *s = ctx;
	int r = s->frames == NULL ? make_ring(s) : 0;

	if (r < 0) {
		admin_pending_refuse(pending, r, "the ring of frames: %s", strerror(-r));
		return;
	}
	s->captures++;
	capture_set_ring(s->capture, s->frames);
	pending->work = s;
	pending->outlives_bus = 1; /* so that a rescan is captured */
	pending->cancel = cancel;
	admin_pending_progress(pending, 1, 1);
}
