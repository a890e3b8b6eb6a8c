/* SPDX-License-Identifier: MIT */
#include "replay_transport.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "base/limits.h"
#include "harness/pcapng.h"
#include "wire/datagram.h"
#include "wire/echo.h"

enum { SOURCE = 6, SOURCE_BYTES = 6, PASSED_A_SLAVE = 0x02, QUEUE = 16, TROUBLE_BYTES = 160 };

/* One EtherCAT frame of the capture. */
struct shot {
	int64_t t_ns;
	const uint8_t *bytes;
	size_t len;
	int is_sent;  /* by the master */
	int is_taken; /* an answer that was given */
};

struct answer {
	int64_t at_ns;
	size_t len;
	uint8_t bytes[LIMIT_FRAME_BYTES];
};

struct replay {
	unsigned mask;
	uint8_t *file;
	struct shot *shot;
	size_t shot_count;
	size_t next;       /* shot that the master's next frame is compared with */
	size_t sent_count; /* in the capture */
	size_t matched;
	int is_broken;
	int64_t now_ns;
	int64_t tai_start_ns;
	struct answer queue[QUEUE];
	unsigned queued;
	char trouble[TROUBLE_BYTES];
};

/* --- loading --- */

static int file_bytes(FILE *file, size_t *ret_len)
{
	long len;

	if (fseek(file, 0, SEEK_END) != 0) {
		return -EIO;
	}
	len = ftell(file);
	if (len < 0 || fseek(file, 0, SEEK_SET) != 0) {
		return -EIO;
	}
	*ret_len = (size_t)len;
	return 0;
}

static int file_load(const char *path, uint8_t **ret_bytes, size_t *ret_len)
{
	FILE *file = fopen(path, "rb");
	uint8_t *bytes = NULL;
	size_t len = 0;
	int r;

	if (file == NULL) {
		return -errno;
	}
	r = file_bytes(file, &len);
	if (r == 0) {
		bytes = malloc(len + 1);
		r = bytes == NULL ? -ENOMEM : 0;
	}
	if (r == 0 && fread(bytes, 1, len, file) != len) {
		r = -EIO;
	}
	(void)fclose(file);
	if (r < 0) {
		free(bytes);
		return r;
	}
	*ret_bytes = bytes;
	*ret_len = len;
	return 0;
}

static int shot_grow(struct replay *rp, size_t *capacity, const struct pcapng_packet *packet)
{
	struct shot *grown;

	if (rp->shot_count == *capacity) {
		*capacity = *capacity > 0 ? 2 * *capacity : 256;
		grown = realloc(rp->shot, *capacity * sizeof(*grown));
		if (grown == NULL) {
			return -ENOMEM;
		}
		rp->shot = grown;
	}
	/* The first frame of a capture is the master's; slaves change its source. */
	rp->shot[rp->shot_count] = (struct shot){
		.t_ns = packet->t_ns,
		.bytes = packet->bytes,
		.len = packet->len,
		.is_sent = rp->shot_count == 0 ||
			   memcmp(packet->bytes + SOURCE, rp->shot[0].bytes + SOURCE,
				  SOURCE_BYTES) == 0,
	};
	rp->sent_count += rp->shot[rp->shot_count].is_sent ? 1 : 0;
	rp->shot_count++;
	return 0;
}

static int load(struct replay *rp, size_t len)
{
	struct pcapng file;
	struct pcapng_packet packet;
	size_t capacity = 0;
	int r = pcapng_open(&file, rp->file, len);

	while (r >= 0 && (r = pcapng_next(&file, &packet)) == 1) {
		if (ecat_frame_is_valid(packet.bytes, packet.len) &&
		    packet.len <= LIMIT_FRAME_BYTES) {
			r = shot_grow(rp, &capacity, &packet);
		}
	}
	return r < 0 ? r : 0;
}

int replay_create(const char *path, unsigned mask, struct replay **ret_replay, char *error,
		  size_t error_bytes)
{
	struct replay *rp = calloc(1, sizeof(*rp));
	size_t len = 0;
	int r = rp == NULL ? -ENOMEM : file_load(path, &rp->file, &len);

	if (r >= 0) {
		r = load(rp, len);
	}
	if (r >= 0 && rp->sent_count == 0) {
		r = -ENODATA;
	}
	if (r < 0) {
		snprintf(error, error_bytes, "capture %s: %s", path,
			 r == -EBADMSG   ? "not a pcapng file, or damaged"
			 : r == -ENODATA ? "holds no EtherCAT frame"
					 : strerror(-r));
		replay_destroy(rp);
		return r;
	}
	rp->mask = mask;
	rp->tai_start_ns = rp->shot[0].t_ns;
	*ret_replay = rp;
	return 0;
}

void replay_destroy(struct replay *rp)
{
	if (rp != NULL) {
		free(rp->shot);
		free(rp->file);
		free(rp);
	}
}

/* --- playing --- */

/* Index bytes and source as in @from, where the mask says so. */
static void align(const struct replay *rp, const uint8_t *from, size_t from_len, uint8_t *frame,
		  size_t frame_len)
{
	size_t pos = ECAT_ETHERNET_BYTES + ECAT_FRAME_HEADER_BYTES;

	if ((rp->mask & REPLAY_MASK_SOURCE) != 0) {
		memcpy(frame + SOURCE, from + SOURCE, SOURCE_BYTES);
	}
	while ((rp->mask & REPLAY_MASK_INDEX) != 0 &&
	       pos + ECAT_DATAGRAM_HEADER_BYTES <= frame_len &&
	       pos + ECAT_DATAGRAM_HEADER_BYTES <= from_len) {
		uint16_t length_word = get_le16(frame + pos + 6);

		frame[pos + 1] = from[pos + 1];
		if ((length_word & 0x8000) == 0) {
			return;
		}
		pos += ECAT_DATAGRAM_HEADER_BYTES + (size_t)(length_word & 0x07ff) + ECAT_WKC_BYTES;
	}
}

/* Bytes that count: padding to the least length is not everywhere captured. */
static size_t meant_bytes(const uint8_t *frame)
{
	return ECAT_ETHERNET_BYTES + ECAT_FRAME_HEADER_BYTES +
	       (size_t)(get_le16(frame + ECAT_ETHERNET_BYTES) & 0x07ff);
}

static size_t first_difference(const uint8_t *a, const uint8_t *b, size_t len)
{
	size_t i = 0;

	while (i < len && a[i] == b[i]) {
		i++;
	}
	return i;
}

static int refuse(struct replay *rp, const char *why, size_t at)
{
	rp->is_broken = 1;
	snprintf(rp->trouble, sizeof(rp->trouble), "frame %zu of %zu: %s (byte %zu)",
		 rp->matched + 1, rp->sent_count, why, at);
	return -EPROTO;
}

static size_t next_sent(const struct replay *rp, size_t from)
{
	while (from < rp->shot_count && !rp->shot[from].is_sent) {
		from++;
	}
	return from;
}

/* The first answer behind shot @sent that has its commands and addresses, and was not given before.
 */
static struct shot *find_answer(struct replay *rp, size_t sent)
{
	for (size_t i = sent + 1; i < rp->shot_count; i++) {
		struct shot *s = &rp->shot[i];

		if (!s->is_sent && !s->is_taken &&
		    echo_matches(rp->shot[sent].bytes, s->bytes, s->len, ECHO_INDEX_SAME)) {
			return s;
		}
	}
	return NULL;
}

static void queue_answer(struct replay *rp, size_t sent, const uint8_t *frame, size_t frame_len)
{
	struct shot *s = find_answer(rp, sent);
	struct answer *a;
	uint8_t mark;

	if (s == NULL || rp->queued == QUEUE) {
		return; /* it was lost then, too */
	}
	s->is_taken = 1;
	a = &rp->queue[rp->queued++];
	a->at_ns = rp->now_ns + (s->t_ns > rp->shot[sent].t_ns ? s->t_ns - rp->shot[sent].t_ns : 0);
	a->len = s->len;
	memcpy(a->bytes, s->bytes, s->len);
	mark = a->bytes[SOURCE] & PASSED_A_SLAVE;
	align(rp, frame, frame_len, a->bytes, a->len);
	a->bytes[SOURCE] |= mark;
}

static int replay_send(void *ctx, const uint8_t *frame, size_t frame_len)
{
	struct replay *rp = ctx;
	size_t at = next_sent(rp, rp->next);
	uint8_t wanted[LIMIT_FRAME_BYTES];
	size_t len;

	if (rp->is_broken) {
		return -EPROTO;
	}
	if (!ecat_frame_is_valid(frame, frame_len)) {
		return refuse(rp, "it is no EtherCAT frame", 0);
	}
	if (at == rp->shot_count) {
		return refuse(rp, "the capture has ended", 0);
	}
	len = meant_bytes(rp->shot[at].bytes);
	memcpy(wanted, rp->shot[at].bytes, len);
	align(rp, frame, frame_len, wanted, len);
	if (meant_bytes(frame) != len) {
		return refuse(rp, "it has another length than the captured one",
			      ECAT_ETHERNET_BYTES);
	}
	if (memcmp(wanted, frame, len) != 0) {
		return refuse(rp, "it differs from the captured one",
			      first_difference(wanted, frame, len));
	}
	rp->next = at + 1;
	rp->matched++;
	queue_answer(rp, at, frame, frame_len);
	return 0;
}

static int replay_receive(void *ctx, uint8_t *frame, size_t capacity, mono_t deadline,
			  mono_t *ret_at)
{
	struct replay *rp = ctx;
	struct answer *a = &rp->queue[0];
	size_t len;

	if (rp->queued == 0 || (a->at_ns > deadline.ns && a->at_ns > rp->now_ns)) {
		rp->now_ns = deadline.ns > rp->now_ns ? deadline.ns : rp->now_ns;
		return -EAGAIN;
	}
	rp->now_ns = a->at_ns > rp->now_ns ? a->at_ns : rp->now_ns;
	len = a->len < capacity ? a->len : capacity;
	memcpy(frame, a->bytes, len);
	if (ret_at != NULL) {
		ret_at->ns = rp->now_ns;
	}
	rp->queued--;
	memmove(rp->queue, rp->queue + 1, rp->queued * sizeof(rp->queue[0]));
	return (int)len;
}

static int replay_is_up(void *ctx)
{
	return !((struct replay *)ctx)->is_broken;
}

static mono_t replay_now(void *ctx)
{
	return (mono_t){ ((struct replay *)ctx)->now_ns };
}

static int64_t replay_tai(void *ctx)
{
	const struct replay *rp = ctx;

	return rp->tai_start_ns + rp->now_ns;
}

static int replay_sleep(void *ctx, mono_t deadline)
{
	struct replay *rp = ctx;

	rp->now_ns = deadline.ns > rp->now_ns ? deadline.ns : rp->now_ns;
	return 0;
}

struct platform replay_platform(struct replay *rp)
{
	return (struct platform){
		.now = replay_now, .tai_ns = replay_tai, .sleep_until = replay_sleep, .ctx = rp
	};
}

struct transport replay_transport(struct replay *rp)
{
	return (struct transport){
		.send = replay_send, .receive = replay_receive, .is_up = replay_is_up, .ctx = rp
	};
}

size_t replay_frames(const struct replay *rp)
{
	return rp->sent_count;
}

size_t replay_matched(const struct replay *rp)
{
	return rp->matched;
}

const char *replay_trouble(const struct replay *rp)
{
	return rp->trouble;
}
