/* SPDX-License-Identifier: MIT */
/* The parts of the fake ecdaqd: its life (fake_daemon.c), what it shows (fake_page.c), what it
 * answers (fake_admin.c). */
#ifndef TESTS_CLI_FAKE_H
#define TESTS_CLI_FAKE_H

#include <stdint.h>
#include <time.h>

#include "base/event.h"
#include "base/ring.h"
#include "base/sample.h"
#include "base/status.h"
#include "config/config.h"

#ifndef FAKE_SLAVES
#define FAKE_SLAVES 2
#endif
enum { SLAVES = FAKE_SLAVES, ENTRIES = 6, CHANNELS = SLAVES * ENTRIES };
enum { OUT_BYTES = 9, IN_BYTES = 13, IMAGE_BYTES = SLAVES * (OUT_BYTES + IN_BYTES) };
enum { SII_BYTES = 2048, RING_SLOTS = SLAVES > 2 ? 4096 : 65536 };
enum { FIRST_CYCLE = 1000, STEP_NS = 1000000 };

struct meta {
	struct sample_meta head;
	struct slave_info slave[SLAVES];
	struct channel channel[CHANNELS];
};

struct fake {
	const char *dir;
	long speed;
	int has_jump;
	int has_recorder;
	const char *admin;
	const char *sii_path;
	unsigned mode;
	unsigned slaves; /* claimed on the status page */
	int has_long_names;
	int has_ebus; /* at port 1 */
	int is_deaf;  /* to the first request of each entry of a dictionary */
	uint32_t asked;
	unsigned alias;      /* of both slaves; 0: 1001 of the second */
	const char *aliases; /* one each, with commas between; NULL: as alias says */
	const char *items;   /* of slaves[], from 1, one for each slave; NULL: none is configured */
	int has_bits;        /* channels that are not whole bytes */
	int is_noisy;        /* 2 errors more at port 1 of slave 0 in each look */
	uint8_t noise;       /* as its counter is now */
	int has_branches;    /* of five slaves, at ports 3 and 1 of the first */
	uint64_t page_faults;
	long beyond;       /* slaves that ecdaq-sync0 has no line for; -1: it does not run */
	double adc_max;    /* plausible range of the first adc from 0 to here; 0: it has none */
	unsigned control;  /* calls of a control program; 0: there is none */
	uint32_t degraded; /* bit per enum event_rt */
	struct meta meta;
	struct status_page *page;
	struct record_status *record;
	struct ring *samples;
	struct ring *events;
	int listener;
	int is_stopped;
	uint64_t cycle;
	uint64_t conversions;
	uint8_t image[IMAGE_BYTES];
	uint16_t refresh_ms; /* 0x8000:2 */
	int64_t armed_ns[SLAVES];
	uint8_t reg[0x1000];     /* of slave 0 */
	uint8_t sii[SII_BYTES];  /* of slave 0 */
	uint8_t data[SII_BYTES]; /* of the request */
	uint32_t data_len;
	int is_long; /* the answer is sii[] */
};

int64_t fake_clock_ns(clockid_t clock);
/** The path of @file in the run directory, until the next call. */
const char *fake_path(const struct fake *f, const char *file);
void fake_die(const char *what, int err) __attribute__((noreturn));
/** The DC time of a cycle. */
int64_t fake_dc_ns(uint64_t cycle);

void fake_describe(struct fake *f);
void fake_make_rings(struct fake *f);
void fake_make_status(struct fake *f);
void fake_make_record_status(struct fake *f);
void fake_make_sync0_status(struct fake *f);
void fake_emit(struct fake *f, enum event_id id, uint16_t slave_pos, int64_t value, int32_t arg);

void fake_listen(struct fake *f);
void fake_serve_client(struct fake *f);

#endif
