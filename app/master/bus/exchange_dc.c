/* SPDX-License-Identifier: MIT */
#include "bus/exchange_dc.h"

#include "wire/datagram.h"

/* Host and reference drift apart by 200 ppm at most: 50 s of silence. */
#define PLAUSIBLE_NS (10 * NS_PER_MS)
/* So many odd times in a row: the host's clock was stopped, or somebody else answers. */
enum { REJECT_LIMIT = 1000 };

static int64_t predict(const struct dc_track *track, mono_t at)
{
	return track->is_known ? track->last_ns + mono_sub(at, track->last_at).ns : 0;
}

uint8_t dc_track_command(struct dc_track *track, mono_t at, int64_t *ret_payload_ns)
{
	if (!track->is_following) {
		*ret_payload_ns = 0;
		return ECAT_CMD_FPRD;
	}
	track->sent_ns = predict(track, at);
	*ret_payload_ns = track->sent_ns;
	return ECAT_CMD_FRMW;
}

/*
 * The reference overwrites the payload; the others only take it. With fewer answers than there
 * were, an unchanged payload is either a reference that shows just the time that was predicted, or
 * nobody's.
 */
static int is_unsure(const struct dc_track *track, uint8_t cmd, uint16_t wkc, int64_t time_ns)
{
	return cmd == ECAT_CMD_FRMW && wkc < track->wkc_full && time_ns == track->sent_ns;
}

int dc_track_is_doubted(const struct dc_track *track)
{
	return track->rejected >= REJECT_LIMIT;
}

int64_t dc_track_answer(struct dc_track *track, uint8_t cmd, uint16_t wkc, int64_t time_ns,
			mono_t sent)
{
	int64_t off_ns = time_ns - predict(track, sent);

	/* A read that two answer is none. */
	if (wkc == 0 || time_ns == 0 || (cmd == ECAT_CMD_FPRD && wkc != 1)) {
		track->is_following = 0;
		return 0;
	}
	if (track->is_known && (off_ns > PLAUSIBLE_NS || off_ns < -PLAUSIBLE_NS) &&
	    !track->is_confirmed) {
		track->rejected += track->rejected < REJECT_LIMIT;
		track->is_following = 0;
		return 0;
	}
	if (cmd == ECAT_CMD_FRMW && wkc > track->wkc_full) {
		track->wkc_full = wkc;
	}
	track->rejected = 0;
	track->is_confirmed = 0;
	track->is_known = 1;
	/* Either way the time is right; the next frame only reads, and its WKC is the reference's.
	 */
	track->is_following = !is_unsure(track, cmd, wkc, time_ns);
	track->last_ns = time_ns;
	track->last_at = sent;
	return time_ns;
}
