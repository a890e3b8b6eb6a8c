/* SPDX-License-Identifier: MIT */
/*
 * The configuration of all programs, one struct filled from one file (ecdaq.yaml) by one option
 * table (options.c). Every field is documented there, with default, range and unit.
 */
#ifndef CONFIG_CONFIG_H
#define CONFIG_CONFIG_H

#include <stddef.h>
#include <stdint.h>

#include "base/limits.h"

enum config_poll { CONFIG_POLL_AUTO, CONFIG_POLL_SPIN, CONFIG_POLL_SLEEP };
enum config_unlock { CONFIG_UNLOCK_REPORT, CONFIG_UNLOCK_FAIL_SAFE, CONFIG_UNLOCK_STOP };
enum config_overrun { CONFIG_OVERRUN_COUNT, CONFIG_OVERRUN_FAIL_SAFE, CONFIG_OVERRUN_STOP };
enum config_mode { CONFIG_MODE_UNSET, CONFIG_MODE_PERIODIC, CONFIG_MODE_ONESHOT };
enum config_owner { CONFIG_OWNER_LOCAL, CONFIG_OWNER_PROGRAM, CONFIG_OWNER_REMOTE };
enum config_edge_clock { CONFIG_EDGE_AUTO, CONFIG_EDGE_MONOTONIC, CONFIG_EDGE_HTE };
enum config_presence { CONFIG_ANY_SLAVES, CONFIG_EXACT_SLAVES };
enum config_revision { CONFIG_REVISION_EXACT, CONFIG_REVISION_AT_LEAST, CONFIG_REVISION_ANY };
enum config_target {
	CONFIG_TARGET_INIT,
	CONFIG_TARGET_PREOP,
	CONFIG_TARGET_SAFEOP,
	CONFIG_TARGET_OP
};

enum config_datagrams { CONFIG_DATAGRAMS_ONE, CONFIG_DATAGRAMS_PER_SLAVE };

enum config_channel_type {
	CONFIG_CHANNEL_DEVICE, /* as the device has it */
	CONFIG_CHANNEL_BOOL,
	CONFIG_CHANNEL_UINT,
	CONFIG_CHANNEL_INT,
	CONFIG_CHANNEL_FLOAT
};

enum config_when_full { CONFIG_WHEN_FULL_OLDEST, CONFIG_WHEN_FULL_STOP };
enum config_keep { CONFIG_KEEP_NEVER, CONFIG_KEEP_UNTIL_FULL, CONFIG_KEEP_ALWAYS };
enum config_addressing { CONFIG_ADDRESSING_PATH, CONFIG_ADDRESSING_HOST };
/* When a start-up SDO is written (slaves[].sdo[].transition). */
enum config_transition {
	CONFIG_TRANSITION_IP, /* as soon as the slave is in PRE-OP */
	CONFIG_TRANSITION_PS, /* in PRE-OP, before the mapping is read and SAFE-OP is requested */
	CONFIG_TRANSITION_SO, /* in SAFE-OP, before OP is requested */
	CONFIG_TRANSITION_OS, /* in OP, before SAFE-OP is requested */
	CONFIG_TRANSITIONS
};

enum config_record_values { CONFIG_RECORD_PHYSICAL, CONFIG_RECORD_RAW, CONFIG_RECORD_BOTH };
enum config_sync_type { CONFIG_SYNC_TYPE_SHOW, CONFIG_SYNC_TYPE_WRITE };
/* slaves[].assign_activate, besides words of 1 to 0xffff */
enum { CONFIG_ASSIGN_SII = 0, CONFIG_ASSIGN_NONE = 0x10000 };

enum {
	CONFIG_LIMIT_SDOS = 4 * LIMIT_SLAVES,     /* of all slaves together */
	CONFIG_LIMIT_CHANNELS = 4 * LIMIT_SLAVES, /* items of slaves[].channels[], the same */
	CONFIG_LIMIT_OUTPUTS = LIMIT_OUTPUTS,
	CONFIG_LIMIT_PDOS = 4 * LIMIT_SLAVES, /* items of slaves[].pdos[], the same */
	CONFIG_LIMIT_PDO_ENTRIES = 4096,      /* of all of them together */
	CONFIG_LIMIT_OCTETS = 65536, /* of slaves[].sdo[].value of types OCTETS and STRING */
	CONFIG_PATH_BYTES = 256,
};
enum { CONFIG_OPTIONS_BYTES = 512, CONFIG_COMMENT_BYTES = 64 };

/* slaves[]: what is expected at each position, and how it is set up. */
struct config_slave {
	char name[32];     /* "" = made from the device name and position */
	char group[32];    /* "" = none */
	uint32_t vendor;   /* 0 = any */
	uint32_t product;  /* 0 = any */
	uint32_t revision; /* 0 = any */
	enum config_revision revision_policy;
	uint32_t serial;         /* 0 = any */
	uint32_t identification; /* explicit device identification; 0 = any */
	uint32_t is_optional;
	uint32_t alias;        /* 0 = any */
	enum config_mode mode; /* FB1111-Piccolo: writes 0x8000:01 in PRE-OP */
	int64_t sync0_shift_ns;
	char sync0_line[96];      /* GPIO line its SYNC0 is wired to; "" = none */
	uint32_t assign_activate; /* or CONFIG_ASSIGN_SII, CONFIG_ASSIGN_NONE */
	enum config_sync_type sync_type;
	int64_t preop_timeout_ns; /* 0: by its ESI description, else CONFIG_PREOP_TIMEOUT_NS */
	int64_t op_timeout_ns;    /* 0: by its ESI description, else bus_op_timeout_ns */
	int line;                 /* in the file, for messages */
};

/* of a slave that has no other */
#define CONFIG_PREOP_TIMEOUT_NS INT64_C(3000000000)

/* What slaves[].sdo[].type may say besides the types of sdo_value.h. */
enum config_sdo_octets { CONFIG_SDO_STRING = 64, CONFIG_SDO_OCTETS, CONFIG_SDO_AUTO };

/* slaves[].sdo[]: start-up SDOs, written in a transition, in order. */
struct config_sdo {
	uint16_t slave_pos;
	uint16_t index;
	uint8_t subindex;
	uint8_t is_complete; /* complete access, from subindex 0 or 1 on */
	uint8_t type;        /* enum sdo_type, enum config_sdo_octets */
	enum config_transition transition;
	uint16_t bytes;
	uint64_t value;  /* little-endian; of enum config_sdo_octets: not used */
	uint32_t octets; /* where they begin in config.octets; CONFIG_SDO_AUTO: the value's text */
	char comment[CONFIG_COMMENT_BYTES];
	int line;
};

/* slaves[].pdos[]: the PDOs that are assigned, in this order. */
struct config_pdo {
	uint16_t slave_pos;
	uint16_t index; /* 0: by its name */
	char pdo[LIMIT_NAME_BYTES];
	uint16_t entry_first; /* in config.pdo_entry */
	uint16_t entry_count; /* 0: its mapping stays as it is */
	int line;
};

/* slaves[].channels[]: what the channels that are meant are called, and what their values mean. */
struct config_channel {
	uint16_t slave_pos;
	char match[LIMIT_NAME_BYTES]; /* fnmatch pattern of the device's name or of the object */
	char name[LIMIT_NAME_BYTES];  /* without the slave's; "" = the device's */
	char unit[LIMIT_UNIT_BYTES];  /* "" = the device's */
	double scale;                 /* 0 = the device's, and its offset */
	double offset;
	enum config_channel_type type;
	double min; /* plausible range, physical; infinite = none */
	double max;
	int line;
};

/* of an item of the list outputs[], not of slaves[].outputs[] */
enum { CONFIG_NO_SLAVE = 0xffff };

/* outputs[] and slaves[].outputs[]: by channel name. */
struct config_output {
	char channel[LIMIT_NAME_BYTES]; /* with the slave's name, as soon as the file is read */
	uint16_t slave_pos;             /* of slaves[], or CONFIG_NO_SLAVE */
	uint16_t item;                  /* place in its list of the file */
	enum config_owner owner;
	double fail_safe; /* physical value */
	double min;       /* physical */
	double max;
	int64_t timeout_ns; /* remote owners; 0 = none */
	int line;
};

struct config {
	/* runtime */
	char run_dir[CONFIG_PATH_BYTES]; /* ring, events, status, admin socket; "" = default */
	char group[32];                  /* of the run directory and its files; "" = default */
	char admin_group[32];            /* of the admin socket */
	char remote_group[32];           /* of the socket that gives the board of remote outputs */
	/* bus */
	char interface[32];
	char bus_esi_dir[CONFIG_PATH_BYTES]; /* "" = none */
	int64_t bus_scan_timeout_ns;
	int64_t bus_mailbox_timeout_ns;
	int64_t bus_op_timeout_ns;
	int64_t bus_frame_timeout_ns;
	int64_t bus_watchdog_ns; /* SM watchdog of the slaves; 0 = leave */
	uint32_t bus_wkc_miss_limit_cycles;
	uint32_t bus_recovery_attempts;
	uint32_t bus_monitor; /* 1: BRD of AL status and 0x092C in every cycle */
	enum config_presence bus_presence;
	enum config_target bus_target;
	enum config_datagrams bus_datagrams;
	/* cycle */
	int64_t cycle_period_ns;
	double cycle_phase_percent;   /* set point: frame after SYNC0, share of the period */
	double cycle_receive_percent; /* receive deadline, share of the period */
	int32_t cycle_cpu;            /* -1 = do not pin */
	uint32_t cycle_priority;      /* SCHED_FIFO; 0: not requested */
	enum config_poll cycle_poll;
	enum config_overrun cycle_overrun;
	uint32_t cycle_lock_memory;
	int32_t cycle_cpu_dma_latency_us; /* -1 = leave */
	/* dc */
	uint32_t dc_enable;
	int64_t dc_lock_limit_ns; /* |filtered phase error| below this */
	uint32_t dc_lock_cycles;  /* for so many cycles */
	int64_t dc_unlock_limit_ns;
	enum config_unlock dc_unlock_policy;
	int64_t dc_slew_ns; /* largest correction a cycle */
	double dc_kp;
	double dc_ki;
	int64_t dc_diff_limit_ns; /* |0x092C| before SYNC0 is started */
	int64_t dc_lock_timeout_ns;
	uint32_t dc_burst_frames;  /* static drift compensation */
	int64_t dc_sync0_pulse_ns; /* for documentation and checks: comes from SII */
	/* control */
	char control_program[CONFIG_PATH_BYTES];    /* shared object; "" = none */
	char control_options[CONFIG_OPTIONS_BYTES]; /* "KEY=VALUE, ..."; "" = none */
	int64_t control_budget_ns;
	enum config_overrun control_overrun;
	int64_t control_stuck_ns; /* timeout of one call: the process ends */
	/* gateway */
	char gateway_listen[64]; /* off, loopback or an address */
	uint32_t gateway_port;
	/* eoe */
	char eoe_interface[32]; /* TAP device; "" = none */
	/* ring */
	int64_t ring_depth_ns;
	uint32_t event_depth;
	/* record */
	uint32_t record_enable;
	char record_dir[CONFIG_PATH_BYTES];
	int64_t record_chunk_period_ns;
	int64_t record_sync_period_ns;
	int64_t record_rotate_period_ns;
	uint64_t record_rotate_bytes;
	enum config_when_full record_when_full;
	enum config_keep record_keep_until_uploaded;
	enum config_record_values record_values;
	uint64_t record_budget_bytes;  /* of all recordings; 0: none, and nothing is deleted */
	uint64_t record_reserve_bytes; /* stays free */
	int32_t record_compression;    /* zstd level, 0 = none */
	/* dds */
	uint32_t dds_enable;
	char dds_interface[32];
	uint32_t dds_domain;
	char dds_tag[64]; /* "" = none */
	uint32_t dds_multicast;
	char dds_peers[CONFIG_PATH_BYTES]; /* addresses, comma between; "" = none */
	uint32_t dds_block_cycles;         /* 0 = no blocks */
	uint32_t dds_allow_insecure_commands;
	uint32_t dds_command_rate;            /* commands a second and commander */
	char dds_security[CONFIG_PATH_BYTES]; /* folder of our keys; "" = no DDS Security */
	uint32_t dds_ros2_mirror;
	/* web */
	uint32_t web_enable;
	char web_listen[64]; /* loopback or an address */
	uint32_t web_port;
	uint32_t web_clients;              /* WebSockets at a time */
	char web_hosts[CONFIG_PATH_BYTES]; /* names in the header Host, comma between; "" = none */
	char web_origins[CONFIG_PATH_BYTES];     /* of pages that may connect, the same */
	char web_certificate[CONFIG_PATH_BYTES]; /* files; "" = no TLS */
	char web_key[CONFIG_PATH_BYTES];
	/* stream */
	uint32_t stream_enable;
	char stream_servers[CONFIG_PATH_BYTES];     /* URLs, comma between */
	char stream_appliance[64];                  /* "" = host name */
	char stream_name[64];                       /* of the JetStream stream */
	char stream_credentials[CONFIG_PATH_BYTES]; /* files; "" = none */
	uint32_t stream_tls;
	char stream_ca[CONFIG_PATH_BYTES];
	char stream_certificate[CONFIG_PATH_BYTES];
	char stream_key[CONFIG_PATH_BYTES];
	uint32_t stream_block_cycles;
	uint64_t stream_memory_bytes;
	/* uplink */
	uint32_t uplink_enable;
	char uplink_endpoint[CONFIG_PATH_BYTES]; /* URL */
	char uplink_region[64];
	char uplink_bucket[64];
	enum config_addressing uplink_addressing;
	char uplink_prefix[CONFIG_PATH_BYTES];      /* of the keys; "" = none */
	char uplink_appliance[64];                  /* "" = host name */
	char uplink_credentials[CONFIG_PATH_BYTES]; /* files */
	char uplink_ca[CONFIG_PATH_BYTES];          /* "" = those of the system */
	char uplink_dir[CONFIG_PATH_BYTES];         /* marks */
	uint64_t uplink_part_bytes;
	uint64_t uplink_rate_limit_bytes; /* in a second; 0: none */
	/* sync0 */
	uint32_t sync0_enable;
	char sync0_edges[CONFIG_PATH_BYTES]; /* edge file of ecdaq-sim instead of lines; "" = lines
					      */
	int64_t sync0_window_ns;
	int64_t sync0_lost_ns; /* time without an edge until it is lost */
	uint32_t sync0_buffer; /* events that the kernel queues */
	enum config_edge_clock sync0_clock;
	int32_t sync0_cpu; /* -1 = do not pin */
	char sync0_calibration[CONFIG_PATH_BYTES];
	double sync0_drift_limit_ppm; /* limits: 0 = not judged */
	double sync0_rate_limit_ppm;
	int64_t sync0_jitter_limit_ns;
	int64_t sync0_phase_limit_ns;
	int64_t sync0_skew_limit_ns;
	/* lists */
	struct config_slave slave[LIMIT_SLAVES];
	size_t slave_count;
	struct config_sdo sdo[CONFIG_LIMIT_SDOS];
	size_t sdo_count;
	uint8_t octets[CONFIG_LIMIT_OCTETS]; /* values of start-up SDOs that are longer */
	size_t octet_count;
	struct config_pdo pdo[CONFIG_LIMIT_PDOS];
	size_t pdo_count;
	uint32_t pdo_entry[CONFIG_LIMIT_PDO_ENTRIES]; /* index << 16 | subindex << 8 | bits */
	size_t pdo_entry_count;
	struct config_channel channel[CONFIG_LIMIT_CHANNELS];
	size_t channel_count;
	struct config_output output[CONFIG_LIMIT_OUTPUTS];
	size_t output_count;
	char path[CONFIG_PATH_BYTES]; /* file it came from, "" = defaults only */
};

/** Fill @cfg with the defaults. */
void config_defaults(struct config *cfg);

/**
 * Read @path over the defaults. 0; or -EINVAL with one line "FILE:LINE: what: reason" in @error, or
 * another -errno with a line. @cfg is untouched on failure. Context: blocking.
 */
int config_load(const char *path, struct config *cfg, char *error, size_t error_bytes);
/** The same from memory; messages use @name as the file's name. */
int config_parse(const char *name, const char *text, size_t text_len, struct config *cfg,
		 char *error, size_t error_bytes);
/**
 * Set one option by its dotted name as the file would: "cycle.period=500us",
 * "slaves[0].mode=oneshot" (one past the last makes a new item). Same errors, without FILE:LINE.
 * Options are not checked against each other: call config_check() after the last one.
 */
int config_set(struct config *cfg, const char *assignment, char *error, size_t error_bytes);
/**
 * Configuration of a command line: the defaults, the file @path over them (NULL: none), then
 * @set_count assignments in order, and only then the check of the options against each other. Same
 * errors; an error of the check names the line of the file, unless the option was set over it.
 */
int config_assemble(const char *path, const char *const *set, size_t set_count, struct config *cfg,
		    char *error, size_t error_bytes);
/* Where a configuration comes from, and what reading it reports besides its result. */
struct config_source {
	const char *path;       /* NULL: the defaults */
	const char *const *set; /* "cycle.period=500us", over the file */
	size_t set_count;
	/** NULL: the first problem is the only one. Else every problem, one line as in @error; the
	 * reading goes on behind it, and fails at its end. Options are checked against each other
	 * only where there was no problem before. */
	void (*problem)(void *ctx, const char *line);
	/** NULL, or: @option, by its dotted name, is @text: in that line of the file; 0: set over
	 * it. */
	void (*seen)(void *ctx, const char *option, const char *text, int line);
	void *ctx;
};

/** config_assemble() of @source, watched. With problem(), @error has the last one. */
int config_assemble_from(const struct config_source *source, struct config *cfg, char *error,
			 size_t error_bytes);
/** Check the options against each other; config_load() and config_parse() do so themselves. 0 or
 * -EINVAL. */
int config_check(const struct config *cfg, char *error, size_t error_bytes);

/** What @sdo of @cfg writes, sdo->bytes long: in @cfg, or in @buffer. Context: any. */
const uint8_t *config_sdo_data(const struct config *cfg, const struct config_sdo *sdo,
			       uint8_t buffer[8]);
/** "IP", "PS", "SO", "OS". */
const char *config_transition_to_str(enum config_transition transition);

/** Does the slave convert on command: by its mode, or else by its SDO 0x8000:01? Context: any. */
int config_is_oneshot(const struct config *cfg, uint16_t slave_pos);

enum { CONFIG_WHY_BYTES = 192 };

/**
 * A duration as the file has it ("500us", "1.5s"; a plain number is in s), for the command lines of
 * the programs. 0, or -EINVAL or -ERANGE with the reason in @reason (CONFIG_WHY_BYTES), ret
 * untouched.
 */
int config_parse_duration(const char *text, int64_t *ret_ns, char *reason);

/* What the name of an appliance, as in NATS subjects and keys of objects, may be made of. */
#define CONFIG_TOKEN "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-"

/* Files of the run directory, which is ecdaqd's; a service has a folder of its own in it. */
#define CONFIG_RUN_SAMPLES "samples"                 /* ring of samples */
#define CONFIG_RUN_EVENTS "events"                   /* ring of events */
#define CONFIG_RUN_FRAMES "frames"                   /* ring of frames, base/frame_record.h */
#define CONFIG_RUN_STATUS "status"                   /* struct status_page */
#define CONFIG_RUN_ADMIN "admin"                     /* socket, base/admin_protocol.h */
#define CONFIG_RUN_COMMANDS_REMOTE "commands-remote" /* socket that gives ecdaq-dds its board */
#define CONFIG_RUN_RECORD_STATUS "record/status"     /* struct record_status */
#define CONFIG_RUN_DDS_STATUS "dds/status"           /* struct dds_status */
#define CONFIG_RUN_STREAM_STATUS "stream/status"     /* struct stream_status */
#define CONFIG_RUN_UPLINK_STATUS "uplink/status"     /* struct uplink_status */
#define CONFIG_RUN_WEB_PAGE "web-command/page"       /* sockets, base/web_command.h */
#define CONFIG_RUN_WEB_TOKEN "web-command/token"
#define CONFIG_RUN_SYNC0 "sync0/results"       /* ring of struct sync0_result */
#define CONFIG_RUN_SYNC0_EVENTS "sync0/events" /* ring of events of ecdaq-sync0 */
#define CONFIG_RUN_SYNC0_STATUS "sync0/status" /* struct sync0_status */
#define CONFIG_RUN_SYNC0_LOCK "sync0/lock"     /* held by the one ecdaq-sync0 */

/** 1 if the run directory is named by @cfg->run_dir or $ECDAQ_RUN_DIR, and not the default. */
int config_has_run_dir(const struct config *cfg);
/** Where the run directory is: @cfg->run_dir, else $ECDAQ_RUN_DIR, else /run/ecdaq (root) or
 * /dev/shm/ecdaq-UID. */
int config_run_path(const struct config *cfg, const char *file, char *ret_path, size_t path_bytes);

#endif
