/* SPDX-License-Identifier: MIT */
/*
 * Requests of the admin socket to the registers and the EEPROM of one slave. Registers take one
 * frame and are answered at once; an EEPROM is one job at a time, a step in each pass.
 */
#include <assert.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "bus/esc_access.h"
#include "daemon/session_internal.h"
#include "wire/sii.h"

enum { PROGRESS_WORDS = 64 }; /* from one report to the next */

static_assert((int)ADMIN_REGISTER_BYTES == (int)ESC_ACCESS_BYTES, "one limit");
static_assert((int)ADMIN_PORTS == (int)ESC_PORTS, "one limit");

/* The one job on an EEPROM. */
struct sii_request {
	struct sii_job job;
	struct session *session;
	size_t shown; /* words that the client knows of */
	uint8_t image[];
};

static enum esc_guard guard_of(const struct admin_pending *pending)
{
	return pending->request.argument[1] != 0 ? ESC_FORCED : ESC_GUARDED;
}

static void finish(struct admin_pending *pending, int r, const char *error)
{
	if (r < 0) {
		admin_pending_refuse(pending, r, "%s", error);
	} else {
		admin_pending_complete(pending, 0);
	}
}

/* --- registers --- */

static void read_register(struct session *s, struct admin_pending *pending)
{
	const struct admin_request *rq = &pending->request;
	char error[BUS_ERROR_BYTES] = "";
	int r = esc_access_read(s->bus, rq->slave_pos, (uint16_t)rq->address, pending->reply.data,
				rq->length, error);

	pending->reply.data_len = rq->length;
	finish(pending, r, error);
}

static void write_register(struct session *s, struct admin_pending *pending)
{
	const struct admin_request *rq = &pending->request;
	char error[BUS_ERROR_BYTES] = "";
	int r = esc_access_write(s->bus, rq->slave_pos, (uint16_t)rq->address, pending->data,
				 pending->data_len, guard_of(pending), error);

	finish(pending, r, error);
}

static void diagnose(struct session *s, struct admin_pending *pending)
{
	char error[BUS_ERROR_BYTES] = "";
	struct esc_diagnosis found = { 0 };
	int r = esc_diagnosis_read(s->bus, pending->request.slave_pos, &found, error);
	struct admin_diagnosis answer = {
		.has_processing_errors = found.has_processing_errors,
		.processing_errors = found.processing_errors,
		.pdi_errors = found.pdi_errors,
		.has_expirations = found.has_expirations,
		.expirations_pd = found.expirations_pd,
		.expirations_pdi = found.expirations_pdi,
	};

	for (size_t i = 0; i < ESC_PORTS; i++) {
		answer.port[i] = (struct admin_port){
			.is_link = found.port[i].is_link,
			.is_communicating = found.port[i].is_communicating,
			.is_ebus = found.port[i].is_ebus,
			.invalid_frames = found.port[i].invalid_frames,
			.rx_errors = found.port[i].rx_errors,
			.forwarded_errors = found.port[i].forwarded_errors,
			.lost_links = found.port[i].lost_links,
		};
	}
	memcpy(pending->reply.data, &answer, sizeof(answer));
	pending->reply.data_len = sizeof(answer);
	finish(pending, r, error);
}

static void reset_errors(struct session *s, struct admin_pending *pending)
{
	char error[BUS_ERROR_BYTES] = "";

	finish(pending, esc_errors_reset(s->bus, pending->request.slave_pos, error), error);
}

/* --- EEPROM --- */

static int answer_image(struct admin_pending *pending, const uint8_t *image, size_t bytes)
{
	uint8_t *room = admin_pending_reserve(pending, bytes);

	if (room == NULL) {
		return -ENOMEM;
	}
	memcpy(room, image, bytes);
	admin_pending_answer_len(pending, bytes);
	return 0;
}

/* What the scan has read. */
static void answer_known(const struct session *s, struct admin_pending *pending)
{
	size_t bytes;
	const uint8_t *image = bus_slave_sii(s->bus, pending->request.slave_pos, &bytes);

	finish(pending, image == NULL ? -ENODATA : answer_image(pending, image, bytes),
	       image == NULL ? "its EEPROM could not be read at the start" : "out of memory");
}

static void answer_written(struct admin_pending *pending, const struct sii_job *job)
{
	struct admin_sii_written written = { .compared = (uint32_t)job->total_words,
					     .written = (uint32_t)job->written_words };

	memcpy(pending->reply.data, &written, sizeof(written));
	pending->reply.data_len = sizeof(written);
}

/* The job has ended with @r: answer, and free it. */
static void end_job(struct admin_pending *pending, int r)
{
	struct sii_request *sr = pending->work;
	struct session *s = sr->session;

	pending->work = NULL;
	pending->poll = NULL;
	pending->cancel = NULL;
	s->sii = NULL;
	if (r == 0 && sr->job.kind == SII_JOB_READ) {
		r = answer_image(pending, sr->image, sr->job.len_bytes);
	} else if (r == 0) {
		answer_written(pending, &sr->job);
	}
	finish(pending, r, r == -ECANCELED ? "the bus was taken down" : sr->job.error);
	free(sr);
}

static void poll_job(struct admin_pending *pending, const struct admin_target *target)
{
	struct sii_request *sr = pending->work;
	int r = sii_job_step(&sr->job);

	(void)target;
	if (r <= 0) {
		end_job(pending, r);
	} else if (sr->job.done_words >= sr->shown + PROGRESS_WORDS) {
		sr->shown = sr->job.done_words;
		admin_pending_progress(pending, (uint32_t)sr->job.done_words,
				       (uint32_t)sr->job.total_words);
	}
}

static void cancel_job(struct admin_pending *pending)
{
	end_job(pending, -ECANCELED);
}

void session_sii_end(struct session *s)
{
	if (s->sii != NULL) {
		end_job(s->sii, -ECANCELED);
	}
}

static int begin_job(struct session *s, const struct admin_pending *pending, struct sii_request *sr)
{
	const struct admin_request *rq = &pending->request;

	if (rq->verb == ADMIN_SII_READ) {
		return sii_job_read(&sr->job, s->bus, rq->slave_pos, sr->image, SII_LIMIT_BYTES);
	}
	if (rq->verb == ADMIN_SII_ALIAS) {
		return sii_job_alias(&sr->job, s->bus, rq->slave_pos, (uint16_t)rq->argument[0],
				     guard_of(pending));
	}
	return sii_job_write(&sr->job, s->bus, rq->slave_pos, pending->data, pending->data_len,
			     guard_of(pending));
}

static void start_job(struct session *s, struct admin_pending *pending)
{
	size_t room = pending->request.verb == ADMIN_SII_READ ? SII_LIMIT_BYTES : 0;
	struct sii_request *sr;
	size_t count;
	int r;

	if (s->sii != NULL) {
		const struct slave_info *slaves = bus_slaves(s->bus, &count);

		admin_pending_refuse(pending, -EBUSY,
				     "the EEPROM of slave %u (%s) is being read or written: one "
				     "at a time",
				     s->sii->request.slave_pos,
				     slaves[s->sii->request.slave_pos].name);
		return;
	}
	sr = calloc(1, sizeof(*sr) + room);
	if (sr == NULL) {
		admin_pending_complete(pending, -ENOMEM);
		return;
	}
	sr->session = s;
	pending->work = sr;
	s->sii = pending;
	r = begin_job(s, pending, sr);
	if (r < 0) {
		end_job(pending, r);
		return;
	}
	pending->poll = poll_job;
	pending->cancel = cancel_job;
}

void session_esc_request(struct session *s, struct admin_pending *pending)
{
	switch (pending->request.verb) {
	case ADMIN_REGISTER_READ:
		read_register(s, pending);
		return;
	case ADMIN_REGISTER_WRITE:
		write_register(s, pending);
		return;
	case ADMIN_DIAGNOSIS:
		diagnose(s, pending);
		return;
	case ADMIN_ERRORS_RESET:
		reset_errors(s, pending);
		return;
	case ADMIN_SII_READ:
		if (pending->request.argument[0] != 0) {
			answer_known(s, pending);
		} else {
			start_job(s, pending);
		}
		return;
	default: /* others of the EEPROM */
		start_job(s, pending);
		return;
	}
}
