/* SPDX-License-Identifier: MIT */
/*
 * A check of the doctor: a row that reads a file and compares it, or a function where that is not
 * enough. Both see nothing but the target: a machine, the configuration that it shall serve, and
 * an ecdaqd if one runs. Context: blocking.
 */
#ifndef CLI_DOCTOR_CHECK_H
#define CLI_DOCTOR_CHECK_H

#include <stdint.h>

#include "base/status.h"
#include "base/sync0.h"
#include "cli/probe.h"
#include "config/config.h"

enum finding_level {
	FINDING_OK,
	FINDING_WARN, /* costs latency or safety, or will under load */
	FINDING_FAIL, /* the measurement cannot be relied on like this */
	FINDING_SKIP, /* does not apply here, or cannot be read */
	FINDING_LEVELS,
};

enum { FINDING_TEXT_BYTES = 256 };

struct finding {
	enum finding_level level;
	char value[FINDING_TEXT_BYTES];
	char remedy[FINDING_TEXT_BYTES]; /* "": none is needed */
	int needs_root;                  /* a file could not be read by this user */
};

/* In a text of a finding: the value ends here, what follows is the remedy. */
#define REMEDY "\x1f"

void finding_set(struct finding *f, enum finding_level level, const char *format, ...)
	__attribute__((format(printf, 3, 4)));
/** SKIP, because reading @what failed with @err (negative errno). */
void finding_unread(struct finding *f, const char *what, int err);

/** "OK", "WARN", "FAIL", "SKIP". */
const char *finding_level_to_str(enum finding_level level);

struct thread {
	int64_t pid;
	int64_t tid; /* 0: none */
	char name[32];
	int is_kernel;
	int policy;
	int priority;                 /* of FIFO and RR */
	char cores[PROBE_TEXT_BYTES]; /* where it may run: "0-2" */
};

struct target {
	struct probe probe;
	const struct config *cfg;
	int64_t pid;                      /* of an ecdaqd that runs; 0: none is seen */
	const struct status_page *page;   /* its page; NULL: none, or it cannot be read */
	int page_err;                     /* why: 0 there is none, else -errno */
	const struct sync0_status *sync0; /* page of an ecdaq-sync0 that runs; NULL: none */
	const char *nic;                  /* "": none is configured */
	int is_nic_elsewhere;             /* in a network namespace of ecdaqd's own */
	int cpu;                          /* the cycle's core; -1: not pinned */
	struct thread cycle;              /* the cycle's thread; tid 0: there is none */
};

/** Does the kernel keep other work off @cpu, by its command line or by a cpuset partition? */
int target_is_isolated(const struct target *t, int cpu);
/** No hardware behind the EtherCAT port: veth, tap. */
int target_is_nic_virtual(const struct target *t);

/* Without what it needs a check is skipped. */
enum check_need {
	NEEDS_CORE = 1,      /* a core of the cycle's own */
	NEEDS_NIC = 2,       /* the EtherCAT port, seen from here */
	NEEDS_PAGE = 4,      /* the status page of an ecdaqd that runs */
	NEEDS_RECORDING = 8, /* recording is on */
};

/** 1, or 0 and SKIP in @f if one of @needs (check_need) is not there. */
int target_has(const struct target *t, unsigned needs, struct finding *f);

enum check_compare {
	ALWAYS,
	IF_ABSENT,      /* there is no such file: this kernel does not have it */
	IF_UNSUPPORTED, /* the port cannot do it */
	IF_HAS,         /* the operand is a part of the text */
	IF_IN,          /* the text is one of the operand's words */
	IF_AT_LEAST,    /* as numbers; the operand may be a fact */
	IF_LISTS_CORE,  /* a list of cores has the cycle's */
};

/*
 * Texts are templates: {core} (0 without one), {nic}, {dir} (of recordings), {text} (what the row
 * read), {/PATH} (another file). A fact is the path of a file, also with {core} and {nic}, or a
 * call and its figure (probe_call): "clock error_us".
 */
struct check_rule {
	enum finding_level level;
	const char *text;
	enum check_compare compare;
	const char *operand;
	const char *fact; /* NULL: what the row read; one that cannot be read does not hold */
};

enum { CHECK_RULES = 4 };

struct check {
	const char *name; /* NULL ends a table */
	unsigned needs;
	void (*judge)(const struct target *t, struct finding *f); /* NULL: by the rules */
	const char *fact; /* if it cannot be read, and no rule is for that: SKIP; NULL: none */
	struct check_rule rules[CHECK_RULES]; /* the first that holds */
};

void check_run(const struct check *check, const struct target *t, struct finding *f);

extern const struct check checks_of_kernel[];
extern const struct check checks_of_threads[];
extern const struct check checks_of_nic[];
extern const struct check checks_of_irqs[];
extern const struct check checks_of_system[];

#endif
