/* SPDX-License-Identifier: MIT */
/*
 * Status of ecdaqd: one page in shared memory ("status" in the run directory), written by
 * ecdaqd, read by everyone else (reader/page.h). So `ecdaq status` works while the daemon is busy,
 * and shows the last known state after it has ended. Numbers are relaxed atomics with one writer
 * each; texts are guarded by @text_sequence (odd while being written).
 */
#ifndef BASE_STATUS_H
#define BASE_STATUS_H

#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>

#include "histogram.h"
#include "limits.h"
#include "sample.h"

#define STATUS_MAGIC UINT64_C(0x3174617473716463) /* "cdqstat1" */

enum bus_state {
	BUS_DOWN = 0,
	BUS_SCANNING,
	BUS_PREOP,
	BUS_SAFEOP,
	BUS_OP,
	BUS_RECOVERING,
	BUS_STOPPED,
	BUS_FAILED,
	BUS_INIT, /* all slaves in INIT, and ecdaqd serves requests; bus.target, or a failed
		     bring-up */
};

enum status_link { STATUS_LINK_UNKNOWN = 0, STATUS_LINK_DOWN, STATUS_LINK_UP };

enum dc_state { DC_OFF = 0, DC_ACQUIRING, DC_LOCKED, DC_LOST };

/* The cycle thread's figures. [cycle] writes all of it. */
struct cycle_stats {
	_Atomic uint64_t cycles;       /* exchanges made */
	_Atomic uint64_t cycle_number; /* of the newest sample */
	_Atomic uint64_t frames_sent;
	_Atomic uint64_t frames_lost;    /* not back before the deadline, later or never */
	_Atomic uint64_t frames_late;    /* came in a later cycle, or passed the slaves outside its
					    window: not used */
	_Atomic uint64_t frames_doubled; /* duplicates, dropped */
	_Atomic uint64_t frames_foreign; /* not ours, or damaged; dropped */
	_Atomic uint64_t wkc_low;        /* cycles with a short working counter */
	_Atomic uint64_t overruns;       /* times the work passed one or more deadlines */
	_Atomic uint64_t cycles_skipped; /* deadlines passed over */
	_Atomic uint64_t samples_good;   /* slave samples in OP: fresh and counter right */
	_Atomic uint64_t samples_bad;    /* slave samples in OP that are not */
	_Atomic uint64_t samples_bad_unexplained; /* of those: wrong counter, fresh frame */
	_Atomic uint64_t op_lost;              /* times a frame showed that a slave had left OP */
	_Atomic uint64_t cycles_with_stranger; /* more slaves answered than belong to the bus */
	_Atomic uint64_t page_faults;          /* of the cycle thread since its start */
	_Atomic uint64_t rides;                /* service frames that rode along */
	_Atomic int64_t dc_time_ns;            /* of the newest cycle */
	_Atomic int64_t correction_ppb;        /* what the servo does to the host's period */
	_Atomic int64_t dc_lock_ns;  /* time from the servo's start to its first lock; 0: not yet */
	_Atomic uint64_t dc_unlocks; /* times that lock was lost */
	_Atomic uint64_t cycles_dc_diff_high; /* in OP, with |0x092C| above dc.diff_limit */
	_Atomic int64_t dc_diff_max_ns;       /* largest |0x092C| since lock */
	_Atomic uint32_t dc_state;            /* enum dc_state */
	_Atomic uint32_t is_fail_safe;
	_Atomic int64_t frames_need_ns; /* computed: first cyclic frame out to last one back */
	_Atomic uint32_t al_status;     /* of all slaves ORed, in the newest frame; 0: not read */
	_Atomic uint32_t slaves_found;  /* how many answered it */
	_Atomic uint64_t slave_good[LIMIT_SLAVES];
	_Atomic uint64_t slave_bad[LIMIT_SLAVES];
	struct histogram wake_latency;
	struct histogram round_trip;
	struct histogram phase; /* signed phase error, from lock on */
	struct histogram work;  /* wake to end of work */
};

enum control_state {
	CONTROL_NONE = 0, /* no program is configured */
	CONTROL_WAITING,  /* loaded; the bus is not in OP */
	CONTROL_RUNNING,
	CONTROL_SAFE,    /* runs, and has requested fail-safe outputs */
	CONTROL_PARKED,  /* took too long (control.overrun fail_safe) */
	CONTROL_STOPPED, /* took too long (control.overrun stop) */
	CONTROL_CRASHED,
	CONTROL_STUCK, /* cycle() did not return */
};

/* The control program. Texts: [service], before the cycle starts; numbers: [cycle]. */
struct control_status {
	char name[64];
	char path[256];
	int64_t budget_ns; /* [service] */
	_Atomic uint32_t state;
	_Atomic uint32_t reserved;
	_Atomic uint64_t calls;
	_Atomic uint64_t overruns;    /* calls that took longer than the budget */
	_Atomic uint64_t safe_cycles; /* calls that requested fail-safe outputs */
	_Atomic uint64_t limited;     /* values set that the channel or its limits did not allow */
	_Atomic uint64_t refused;     /* values set that were no numbers, or bits too many */
	struct histogram time;        /* of each call */
};

/* One slave as the service thread last saw it. [service] */
struct slave_status {
	struct slave_info info;
	_Atomic uint32_t al_state; /* enum al_state, bit 4: error; 0: unknown, no frame comes back
				    */
	_Atomic uint32_t al_status_code;
	_Atomic uint32_t is_lost;
	_Atomic int32_t dc_diff_ns;
	/* Sums of the chip's 8-bit counters (bus/error_counters.h), per port */
	_Atomic uint32_t rx_errors[4];        /* 0x0300..0x0307: invalid frames and RX errors */
	_Atomic uint32_t forwarded_errors[4]; /* 0x0308..0x030B: found by a slave before */
	_Atomic uint32_t lost_links[4];       /* 0x0310..0x0313 */
	_Atomic uint32_t processing_errors;   /* 0x030C */
	_Atomic uint32_t pdi_errors;          /* 0x030D */
	_Atomic uint32_t are_errors_short;    /* 1: a counter saturated at 255, the sum is low */
	_Atomic uint32_t output_sync_type;    /* 0x1C32:01; 0: free run, or no such object */
	_Atomic uint32_t input_sync_type;     /* 0x1C33:01 */
	_Atomic uint32_t minimum_cycle_ns;    /* 0x1C32:05, 0x1C33:05, the larger; 0: not given */
	_Atomic uint32_t place;               /* base/slave_place.h; 0: not known */
	_Atomic int32_t cable_ns;             /* one way, from the slave before it; -1: not known */
	char group[32]; /* slaves[].group; "": none. Written before the count */
};

struct status_page {
	uint64_t magic;
	uint32_t bytes;        /* sizeof(struct status_page): the layout's version */
	uint32_t is_simulated; /* the segment is ecdaq-sim, as the command line states */
	int64_t pid;
	int64_t start_tai_ns;
	uint64_t session; /* same as in the ring's meta */
	uint64_t period_ns;
	char version[32];
	char interface[32];                 /* NIC name */
	_Atomic uint64_t text_sequence;     /* [service] odd: message is being written */
	char message[256];                  /* [service] newest trouble, one line; "" for none */
	_Atomic uint32_t bus_state;         /* [service] enum bus_state */
	_Atomic uint32_t bus_state_at_stop; /* [service] what it was when the orderly stop began */
	_Atomic uint32_t bus_target;        /* [service] enum bus_state that the bus is led to */
	_Atomic uint32_t is_waiting;        /* [service] 1: not there; message says why */
	_Atomic uint32_t link;              /* [service] enum status_link */
	_Atomic uint32_t link_mbps;         /* [service] 0: not known */
	_Atomic uint32_t slave_count;       /* [service] */
	_Atomic uint32_t slaves_expected;   /* [service] 0: whatever is there */
	_Atomic uint32_t exit_code;         /* [service] valid in STOPPED and FAILED */
	_Atomic uint64_t heartbeat;         /* [service] counts up about ten times a second */
	_Atomic uint32_t rt_degraded;       /* [service] bit per enum event_rt that failed */
	_Atomic uint32_t cycle_cpu;         /* [service] core of the cycle thread; ~0: not pinned */
	struct slave_status slave[LIMIT_SLAVES];
	struct cycle_stats cycle;
	struct control_status control;
};

#define RECORD_STATUS_MAGIC UINT64_C(0x3163657273716463) /* "cdqsrec1" */

/* Status of ecdaq-record ("record-status" in the run directory). [recorder] */
struct record_status {
	uint64_t magic;
	uint32_t bytes;
	uint32_t reserved;
	int64_t pid;
	_Atomic uint64_t text_sequence;
	char path[512]; /* file being written */
	char message[256];
	_Atomic uint32_t state; /* enum record_state */
	_Atomic uint64_t session;
	_Atomic uint64_t recorded_cycles; /* samples written in this session of the master */
	_Atomic uint64_t recorded_gaps;   /* gaps in the cycle number */
	_Atomic uint64_t cycles_missing;  /* sum over the gaps */
	_Atomic uint64_t first_cycle;
	_Atomic uint64_t last_cycle;
	_Atomic uint64_t synced_cycle; /* last cycle that an fdatasync covers */
	_Atomic uint64_t bytes_written;
	_Atomic uint64_t files;
	_Atomic uint64_t bytes_free; /* of the file system */
	_Atomic uint64_t lag_cycles; /* slots behind the producer */
	_Atomic uint64_t heartbeat;
};

#define DDS_STATUS_MAGIC UINT64_C(0x3173646473716463) /* "cdqsdds1" */

/* Status of ecdaq-dds ("dds-status" in the run directory). [publisher] */
struct dds_status {
	uint64_t magic;
	uint32_t bytes;
	uint32_t domain;
	int64_t pid;
	char interface[32];
	char tag[64];             /* discovery tag; "" for none */
	uint32_t is_secure;       /* DDS Security is in use */
	uint32_t are_commands_on; /* commands are taken at all */
	_Atomic uint64_t session; /* of the master that is published; 0: none */
	_Atomic uint64_t published_cycles;
	_Atomic uint64_t missed_cycles;   /* had left the ring */
	_Atomic uint64_t failed_messages; /* rejected by DDS */
	_Atomic uint64_t subscribers;     /* readers of samples and blocks */
	_Atomic uint64_t commands_accepted;
	_Atomic uint64_t commands_refused;
	_Atomic uint64_t heartbeat;
};

#define STREAM_STATUS_MAGIC UINT64_C(0x3172747373716463) /* "cdqsstr1" */

enum stream_state {
	STREAM_CONNECTING = 0,
	STREAM_WAITING,    /* for ecdaqd */
	STREAM_RECORDINGS, /* sends what the ring no longer has */
	STREAM_LIVE
};

/* Status of ecdaq-stream ("stream/status" in the run directory). [streamer] */
struct stream_status {
	uint64_t magic;
	uint32_t bytes;
	uint32_t reserved;
	int64_t pid;
	char stream[64];
	char appliance[64];
	_Atomic uint64_t text_sequence;
	char server[256];       /* "": not connected */
	char message[256];      /* latest problem; "": none */
	_Atomic uint32_t state; /* enum stream_state */
	_Atomic uint64_t session;
	_Atomic uint64_t next_cycle; /* of the session, to be sent next */
	_Atomic uint64_t blocks;     /* messages of slaves that were stored */
	_Atomic uint64_t cycles;     /* in them, each slave's counted */
	_Atomic uint64_t bytes_sent; /* of them */
	_Atomic uint64_t events;
	_Atomic uint64_t events_lost; /* had left the ring */
	_Atomic uint64_t gaps;
	_Atomic uint64_t cycles_missing; /* in the gaps */
	_Atomic uint64_t connects;
	_Atomic uint64_t lag_cycles; /* in the ring, not read yet */
	_Atomic uint64_t heartbeat;
};

#define UPLINK_STATUS_MAGIC UINT64_C(0x326c707571616463) /* "cdaqupl2" */

enum uplink_state {
	UPLINK_IDLE = 0,
	UPLINK_SENDING,
	UPLINK_RETRYING /* the store cannot be reached, or rejects */
};

/* Status of ecdaq-uplink ("uplink/status" in the run directory). [uplink] */
struct uplink_status {
	uint64_t magic;
	uint32_t bytes;
	uint32_t reserved;
	int64_t pid;
	char endpoint[256];
	char bucket[64];
	char appliance[64];
	_Atomic uint64_t text_sequence;
	char file[80];          /* recording that is being uploaded; "": none */
	char message[256];      /* latest problem; "": none */
	_Atomic uint32_t state; /* enum uplink_state */
	_Atomic uint64_t file_bytes;
	_Atomic uint64_t file_sent; /* of these */
	_Atomic uint64_t uploaded;  /* recordings, since it was started */
	_Atomic uint64_t uploaded_bytes;
	_Atomic uint64_t waiting; /* finished recordings that are not uploaded */
	_Atomic uint64_t waiting_bytes;
	_Atomic uint64_t deleted;        /* before they were uploaded */
	_Atomic uint64_t failures;       /* attempts */
	_Atomic uint64_t uploaded_utc_s; /* Unix time of the newest upload; 0: none yet */
	_Atomic uint64_t waiting_utc_s;  /* when the oldest that waits was begun; 0: none waits */
	_Atomic uint64_t heartbeat;
};

enum record_state {
	RECORD_WAITING = 0,
	RECORD_RUNNING,
	RECORD_DISK_FULL,
	RECORD_ENDED,
	RECORD_FAILED
};

const char *bus_state_to_str(uint32_t state);
const char *dc_state_to_str(uint32_t state);
const char *record_state_to_str(uint32_t state);
const char *control_state_to_str(uint32_t state);
const char *stream_state_to_str(uint32_t state);
const char *uplink_state_to_str(uint32_t state);

/**
 * Make a page of @bytes at @path (any size that starts with magic and bytes) and map it for
 * writing; the caller fills it. NULL with errno. Unmap with status_unmap(). Context: blocking.
 */
void *status_create(const char *path, uint64_t magic, uint32_t bytes, unsigned file_mode);
/** The same in a folder of its own (base/run_path.h), for all to read. */
void *status_create_own(const char *path, uint64_t magic, uint32_t bytes);
/**
 * Copy the page at @path to @ret_page, which has @bytes; @sequence_offset is the place of its
 * text_sequence, 0: it has none. 0; -ENOENT, ...; -EPROTO: another version, or too short (ret
 * undefined). Use reader/page.h, which also checks the contents. Context: blocking.
 */
int status_read(const char *path, uint64_t magic, uint32_t bytes, size_t sequence_offset,
		void *ret_page);
void status_unmap(const void *page, uint32_t bytes);

/** Write @text into a guarded text field. Context: the page's writer. */
void status_text_set(_Atomic uint64_t *sequence, char *field, uint32_t field_bytes,
		     const char *text);

#endif
