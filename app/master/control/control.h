/* SPDX-License-Identifier: MIT */
/*
 * Control programs: your own code in the cycle of ecdaqd, on named channels. Installed as
 * <ecdaq/control.h>; app/doc/reference/control.md describes how to write, build and run one.
 *
 * A program is a shared object with one symbol, ecdaq_program:
 *
 *	static int blink_init(const struct ecdaq_init *in, void **ret_state)
 *	{
 *		return ecdaq_find_output(in, "piccolo0.led", &led);
 *	}
 *
 *	static int blink_cycle(const struct ecdaq_cycle *cy, void *state)
 *	{
 *		ecdaq_set(cy, led, cy->number / 500 % 2);
 *		return ECDAQ_GO_ON;
 *	}
 *
 *	const struct ecdaq_program ecdaq_program = {
 *		ECDAQ_PROGRAM_HEAD, .name = "blink", .init = blink_init, .cycle = blink_cycle,
 *	};
 *
 * init() runs before the first cycle of a session and may block. cycle() runs in the real-time
 * thread, once for every cycle in OP, after the inputs of cycle k have come and before the frame of
 * cycle k + 1 is made: what it sets travels with that frame. It must not block, allocate, print or
 * take a lock. exit() runs after the last cycle.
 *
 * The header requires no other file of ecdaq, neither to compile nor to link.
 */
#ifndef ECDAQ_CONTROL_H
#define ECDAQ_CONTROL_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Of this header. A program that was built with another one is not loaded. */
#define ECDAQ_CONTROL_ABI UINT32_C(2)

/* A channel that was found by its name in init(); the same until exit(). */
struct ecdaq_input {
	uint32_t index;
};

struct ecdaq_output {
	uint32_t index;
};

enum ecdaq_flag {
	ECDAQ_LOST = 1 << 0,        /* no frame came back: all inputs keep their last values */
	ECDAQ_LATE = 1 << 1,        /* the frame passed the slaves outside its window: as above */
	ECDAQ_WKC_LOW = 1 << 2,     /* not all slaves answered: some inputs may be old */
	ECDAQ_FAIL_SAFE = 1 << 4,   /* the frame of this cycle carried fail-safe values */
	ECDAQ_BAD_COUNTER = 1 << 6, /* a slave's conversion counter is not the expected one */
	ECDAQ_DC_UNLOCKED = 1 << 7, /* the master's clock is not locked to the slaves' */
	ECDAQ_FIRST = 1 << 16,      /* first call since the bus came (back) to OP */
};

struct ecdaq_calls;

/* Argument of cycle(); valid during the call. */
struct ecdaq_cycle {
	const struct ecdaq_calls *calls;
	void *host;
	uint64_t number;    /* k: the SYNC0 edge that the inputs belong to */
	int64_t dc_time_ns; /* DC time of that edge, ns since 2000-01-01; 0 without DC */
	int64_t period_ns;  /* of the cycle */
	/* Slaves whose inputs are not fresh and good in this cycle: ecdaq_is_slave_good(). Slave n
	 * is bit n % 64 of word n / 64. */
	const uint64_t *slaves_bad;
	uint32_t slave_count;
	uint32_t flags;   /* enum ecdaq_flag */
	uint32_t elapsed; /* cycles since the last call: 1; more if some were skipped; 0 at the
			     first */
	uint32_t reserved;
};

/* Argument of init(); valid during the call. */
struct ecdaq_init {
	const struct ecdaq_calls *calls;
	void *host;
	int64_t period_ns;
	int64_t budget_ns; /* what cycle() may take (control.budget) */
	uint32_t slave_count;
	uint32_t reserved;
};

/* What ecdaqd offers; used through the functions below. */
struct ecdaq_calls {
	uint32_t bytes;
	int (*find)(void *host, const char *name, int is_output, uint32_t *ret_index);
	int (*option_text)(void *host, const char *key, char *ret_text, uint32_t text_bytes);
	int (*option_number)(void *host, const char *key, double *ret_value);
	void (*say)(void *host, const char *text);
	uint64_t (*get_raw)(void *host, uint32_t index);
	int64_t (*get_int)(void *host, uint32_t index);
	double (*get)(void *host, uint32_t index);
	int (*is_good)(void *host, uint32_t index);
	int (*set)(void *host, uint32_t index, double physical);
	int (*set_raw)(void *host, uint32_t index, uint64_t raw);
	void (*release)(void *host, uint32_t index);
};

enum ecdaq_verdict {
	ECDAQ_GO_ON = 0,
	ECDAQ_MAKE_SAFE = 1, /* all outputs of the program hold their fail-safe values until cycle()
				returns ECDAQ_GO_ON */
};

/* The shared object's one symbol, named ecdaq_program. */
struct ecdaq_program {
	uint32_t abi;   /* ECDAQ_CONTROL_ABI */
	uint32_t bytes; /* sizeof(struct ecdaq_program) */
	const char *name;
	/** 0, or a negative errno: ecdaqd ends with the reason (ecdaq_say(), or the first call that
	 * failed). @ret_state is handed to the others. */
	int (*init)(const struct ecdaq_init *in, void **ret_state);
	/** An enum ecdaq_verdict. */
	int (*cycle)(const struct ecdaq_cycle *cy, void *state);
	/** May be NULL. */
	void (*exit)(void *state);
};

#define ECDAQ_PROGRAM_HEAD .abi = ECDAQ_CONTROL_ABI, .bytes = sizeof(struct ecdaq_program)

/* The object may hide all its symbols but this one (-fvisibility=hidden). */
extern __attribute__((visibility("default"))) const struct ecdaq_program ecdaq_program;

/* --- in init() --- */

/** The channel named @name, to be read; an output, too (what the frame of this cycle carried).
 * 0 or -ENOENT. */
static inline int ecdaq_find_input(const struct ecdaq_init *in, const char *name,
				   struct ecdaq_input *ret_input)
{
	return in->calls->find(in->host, name, 0, &ret_input->index);
}

/**
 * The output channel named @name, to be written. 0; -ENOENT: there is none; -EROFS: it is an input;
 * -EACCES: its owner is not the program (outputs[].owner).
 */
static inline int ecdaq_find_output(const struct ecdaq_init *in, const char *name,
				    struct ecdaq_output *ret_output)
{
	return in->calls->find(in->host, name, 1, &ret_output->index);
}

/**
 * A word of control.options ("kp=0.5, channel=piccolo0.led"). 0; -ENOENT: not given, @ret_text
 * untouched; -ENAMETOOLONG. A key that init() never reads is a configuration error.
 */
static inline int ecdaq_option_text(const struct ecdaq_init *in, const char *key, char *ret_text,
				    uint32_t text_bytes)
{
	return in->calls->option_text(in->host, key, ret_text, text_bytes);
}

/** The same as a number. 0; -ENOENT: not given, @ret_value untouched; -EINVAL: not a number. */
static inline int ecdaq_option_number(const struct ecdaq_init *in, const char *key,
				      double *ret_value)
{
	return in->calls->option_number(in->host, key, ret_value);
}

/** The reason why init() is about to fail, one line; the last call counts. */
static inline void ecdaq_say(const struct ecdaq_init *in, const char *text)
{
	in->calls->say(in->host, text);
}

/* --- in cycle(): never block, never fail to return --- */

/** The physical value, in the channel's unit (`ecdaq channels`). */
static inline double ecdaq_get(const struct ecdaq_cycle *cy, struct ecdaq_input input)
{
	return cy->calls->get(cy->host, input.index);
}

/** The channel's bits, zero-extended. */
static inline uint64_t ecdaq_get_raw(const struct ecdaq_cycle *cy, struct ecdaq_input input)
{
	return cy->calls->get_raw(cy->host, input.index);
}

/** The raw integer, sign-extended if the channel is signed. */
static inline int64_t ecdaq_get_int(const struct ecdaq_cycle *cy, struct ecdaq_input input)
{
	return cy->calls->get_int(cy->host, input.index);
}

/** 1 if the input's slave has delivered a fresh and good sample in this cycle. */
static inline int ecdaq_is_good(const struct ecdaq_cycle *cy, struct ecdaq_input input)
{
	return cy->calls->is_good(cy->host, input.index);
}

/** The same by the slave's place on the bus, 0-based; 0 for one that is not there. */
static inline int ecdaq_is_slave_good(const struct ecdaq_cycle *cy, unsigned slave_pos)
{
	return slave_pos < cy->slave_count &&
	       (cy->slaves_bad[slave_pos / 64] >> slave_pos % 64 & 1) == 0;
}

/**
 * Set the output's physical value; it stays until it is set again. 0; 1: limited to what the
 * channel or outputs[].min and max allow; -EINVAL: not a number, or for a BOOL neither 0 nor 1, the
 * output is fail-safe from here on.
 */
static inline int ecdaq_set(const struct ecdaq_cycle *cy, struct ecdaq_output output,
			    double physical)
{
	return cy->calls->set(cy->host, output.index, physical);
}

/** The same by the channel's bits; bits that the channel does not have: -EINVAL. */
static inline int ecdaq_set_raw(const struct ecdaq_cycle *cy, struct ecdaq_output output,
				uint64_t raw)
{
	return cy->calls->set_raw(cy->host, output.index, raw);
}

/** Set the output to its fail-safe value until it is set again. */
static inline void ecdaq_release(const struct ecdaq_cycle *cy, struct ecdaq_output output)
{
	cy->calls->release(cy->host, output.index);
}

#ifdef __cplusplus
}
#endif

#endif
