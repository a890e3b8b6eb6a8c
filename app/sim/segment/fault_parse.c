/* SPDX-License-Identifier: MIT */
/* One line of a fault plan. */
#include "segment/fault.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "wire/al.h"

/* How an action is written, and what it needs. */
static const struct {
	const char *name;
	enum fault_action action;
	int is_of_frame;  /* else of a slave: it happens once */
	const char *need; /* the key without which it makes no sense */
} actions[] = {
	{ "lose", FAULT_LOSE, 1, NULL },
	{ "drop", FAULT_DROP, 1, NULL },
	{ "delay", FAULT_DELAY, 1, "by" },
	{ "jitter", FAULT_JITTER, 1, "by" },
	{ "mirror", FAULT_MIRROR, 1, NULL },
	{ "hold", FAULT_HOLD, 1, NULL },
	{ "double", FAULT_DOUBLE, 1, NULL },
	{ "truncate", FAULT_TRUNCATE, 1, NULL },
	{ "damage", FAULT_DAMAGE, 1, "slave" },
	{ "corrupt", FAULT_CORRUPT, 1, NULL },
	{ "cut", FAULT_CUT, 0, "slave" },
	{ "heal", FAULT_HEAL, 0, "slave" },
	{ "power-off", FAULT_POWER_OFF, 0, "slave" },
	{ "power-on", FAULT_POWER_ON, 0, "slave" },
	{ "reset", FAULT_RESET, 0, "slave" },
	{ "drift", FAULT_DRIFT, 0, "ppm" },
	{ "al-error", FAULT_AL_ERROR, 0, "code" },
	{ "port-error", FAULT_PORT_ERROR, 0, "slave" },
	{ "watchdog", FAULT_WATCHDOG, 0, "slave" },
	{ "mailbox-stuck", FAULT_MAILBOX_STUCK, 0, "slave" },
	{ "mailbox", FAULT_MAILBOX, 0, "kind" },
	{ "identity", FAULT_IDENTITY, 0, "product" },
	{ "sync0-lost", FAULT_SYNC0_LOST, 0, "slave" },
	{ "unplug", FAULT_UNPLUG, 0, "slave" },
	{ "plug", FAULT_PLUG, 0, "slave" },
	{ "slow", FAULT_SLOW, 0, "by" },
	{ "refuse", FAULT_REFUSE, 0, "code" },
	{ "obey", FAULT_OBEY, 0, "slave" },
	{ "switch", FAULT_SWITCH, 0, "id" },
};

enum { ACTIONS = sizeof(actions) / sizeof(actions[0]), KEYS_MAX = 16 };

/* --- values --- */

static int parse_time(const char *text, int64_t *ret_ns)
{
	static const struct {
		const char *unit;
		double ns;
	} units[] = { { "ns", 1 }, { "us", 1e3 }, { "ms", 1e6 }, { "s", 1e9 } };
	char *end;
	double value = strtod(text, &end);

	for (unsigned i = 0; end != text && i < 4; i++) {
		if (strcmp(end, units[i].unit) == 0 && value >= 0 && value * units[i].ns < 9e18) {
			*ret_ns = (int64_t)nearbyint(value * units[i].ns);
			return 0;
		}
	}
	return -EINVAL;
}

static int parse_count(const char *text, uint64_t limit, uint64_t *ret)
{
	char *end;
	unsigned long long v;

	if (text[0] < '0' || text[0] > '9') {
		return -EINVAL;
	}
	errno = 0;
	v = strtoull(text, &end, 0);
	if (*end != '\0' || errno != 0 || v > limit) {
		return -EINVAL;
	}
	*ret = v;
	return 0;
}

static int parse_number(const char *text, double low, double high, double *ret)
{
	char *end;
	double v = strtod(text, &end);

	if (end == text || *end != '\0' || !isfinite(v) || v < low || v > high) {
		return -EINVAL;
	}
	*ret = v;
	return 0;
}

static int parse_small(const char *text, uint64_t limit, uint32_t *ret)
{
	uint64_t v;
	int r = parse_count(text, limit, &v);

	if (r == 0) {
		*ret = (uint32_t)v;
	}
	return r;
}

static int parse_state(const char *text, uint8_t *ret)
{
	static const struct {
		const char *name;
		uint8_t state;
	} states[] = { { "init", AL_INIT },
		       { "preop", AL_PREOP },
		       { "boot", AL_BOOT },
		       { "safeop", AL_SAFEOP },
		       { "op", AL_OP } };

	for (size_t i = 0; i < sizeof(states) / sizeof(states[0]); i++) {
		if (strcmp(states[i].name, text) == 0) {
			*ret = states[i].state;
			return 0;
		}
	}
	return -EINVAL;
}

static int parse_kind(const char *text, enum esc_mailbox_fault_kind *ret)
{
	static const struct {
		const char *name;
		enum esc_mailbox_fault_kind kind;
	} kinds[] = { { "good", ESC_MAILBOX_GOOD },     { "late", ESC_MAILBOX_LATE },
		      { "double", ESC_MAILBOX_DOUBLE }, { "counter", ESC_MAILBOX_COUNTER },
		      { "length", ESC_MAILBOX_LENGTH }, { "silent", ESC_MAILBOX_SILENT },
		      { "eoe", ESC_MAILBOX_EOE },       { "abort", ESC_MAILBOX_ABORT },
		      { "busy", ESC_MAILBOX_BUSY } };

	for (size_t i = 0; i < sizeof(kinds) / sizeof(kinds[0]); i++) {
		if (strcmp(kinds[i].name, text) == 0) {
			*ret = kinds[i].kind;
			return 0;
		}
	}
	return -EINVAL;
}

/* --- keys --- */

/* 1: it was one, 0: it was none, -EINVAL. */
static int set_trigger(struct fault *f, const char *key, const char *value)
{
	int r;

	if (strcmp(key, "at") == 0) {
		f->trigger = FAULT_AT;
		r = parse_time(value, &f->at_ns);
	} else if (strcmp(key, "frame") == 0) {
		f->trigger = FAULT_FRAME;
		r = parse_count(value, UINT64_MAX, &f->frame);
		r = r == 0 && f->frame == 0 ? -EINVAL : r;
	} else if (strcmp(key, "every") == 0) {
		f->trigger = FAULT_EVERY;
		r = parse_count(value, UINT64_MAX, &f->frame);
		r = r == 0 && f->frame == 0 ? -EINVAL : r;
	} else if (strcmp(key, "p") == 0) {
		f->trigger = FAULT_PROBABLY;
		r = parse_number(value, 0.0, 1.0, &f->probability);
	} else {
		return 0;
	}
	return r == 0 ? 1 : r;
}

static int set_key(struct fault *f, const char *key, const char *value, size_t slave_count)
{
	uint32_t small = 0;
	int r;

	if (strcmp(key, "for") == 0) {
		return parse_time(value, &f->for_ns);
	}
	if (strcmp(key, "by") == 0) {
		return parse_time(value, &f->by_ns);
	}
	if (strcmp(key, "ppm") == 0) {
		return parse_number(value, -1000.0, 1000.0, &f->ppm);
	}
	if (strcmp(key, "product") == 0) {
		return parse_small(value, UINT32_MAX, &f->product);
	}
	if (strcmp(key, "count") == 0) {
		return parse_small(value, UINT32_MAX, &f->count);
	}
	if (strcmp(key, "slave") == 0) {
		r = slave_count == 0 ? -EINVAL : parse_small(value, slave_count - 1, &small);
		f->slave = r == 0 ? small : f->slave;
		return r;
	}
	if (strcmp(key, "port") == 0) {
		r = parse_small(value, 3, &small);
		f->port = r == 0 ? small : f->port;
		return r;
	}
	if (strcmp(key, "kind") == 0) {
		return parse_kind(value, &f->kind);
	}
	if (strcmp(key, "state") == 0) {
		return parse_state(value, &f->state);
	}
	if (strcmp(key, "id") == 0) {
		r = parse_small(value, UINT16_MAX, &small);
		f->id = r == 0 ? (uint16_t)small : f->id;
		return r;
	}
	if (strcmp(key, "address") == 0) {
		r = parse_small(value, UINT16_MAX, &small);
		f->address = r == 0 ? (uint16_t)small : f->address;
		return r;
	}
	if (strcmp(key, "code") == 0) {
		r = parse_small(value, UINT16_MAX, &small);
		f->code = r == 0 ? (uint16_t)small : f->code;
		return r;
	}
	return -ENOENT;
}

/* --- the line --- */

struct seen {
	int action; /* index into actions; -1: none yet */
	int has_trigger;
	unsigned key_count;
	const char *key[KEYS_MAX];
};

static int fail(char *error, size_t bytes, const char *what, const char *why)
{
	snprintf(error, bytes, "%s%s", what, why);
	return -EINVAL;
}

static int take_action(struct fault *f, const char *word, struct seen *seen, char *error,
		       size_t bytes)
{
	for (int i = 0; i < ACTIONS; i++) {
		if (strcmp(actions[i].name, word) != 0) {
			continue;
		}
		if (seen->action >= 0) {
			return fail(error, bytes, word, ": only one fault per line");
		}
		seen->action = i;
		f->action = actions[i].action;
		return 0;
	}
	return fail(error, bytes, word, ": unknown fault");
}

static int take_pair(struct fault *f, const char *key, const char *value, size_t slave_count,
		     struct seen *seen)
{
	int r = set_trigger(f, key, value);

	if (r > 0) {
		seen->has_trigger++;
		return 0;
	}
	return r < 0 ? r : set_key(f, key, value, slave_count);
}

static int take_word(struct fault *f, char *word, size_t slave_count, struct seen *seen,
		     char *error, size_t bytes)
{
	char *equals = strchr(word, '=');
	int r;

	if (equals == NULL) {
		return take_action(f, word, seen, error, bytes);
	}
	*equals = '\0';
	if (seen->key_count == KEYS_MAX) {
		return fail(error, bytes, word, ": too many keys");
	}
	seen->key[seen->key_count++] = word;
	r = take_pair(f, word, equals + 1, slave_count, seen);
	if (r == -ENOENT) {
		return fail(error, bytes, word, ": unknown key");
	}
	return r < 0 ? fail(error, bytes, word, ": bad value") : 0;
}

static int has_key(const struct seen *seen, const char *key)
{
	for (unsigned i = 0; i < seen->key_count; i++) {
		if (strcmp(seen->key[i], key) == 0) {
			return 1;
		}
	}
	return 0;
}

static int check_whole(const struct fault *f, const struct seen *seen, char *error, size_t bytes)
{
	const char *need;

	if (seen->action < 0) {
		return fail(error, bytes, "the fault is missing", "");
	}
	if (seen->has_trigger == 0) {
		return fail(error, bytes, "the time is missing: at=, frame=, every= or p=", "");
	}
	if (seen->has_trigger > 1) {
		return fail(error, bytes, "only one of at=, frame=, every=, p=", "");
	}
	if (!actions[seen->action].is_of_frame && f->trigger != FAULT_AT &&
	    f->trigger != FAULT_FRAME) {
		return fail(error, bytes, actions[seen->action].name,
			    " happens once: at= or frame=");
	}
	need = actions[seen->action].need;
	if (need != NULL && !has_key(seen, need)) {
		snprintf(error, bytes, "%s: %s= is missing", actions[seen->action].name, need);
		return -EINVAL;
	}
	return 1;
}

int fault_parse(char *line, size_t slave_count, struct fault *ret, char *error, size_t error_bytes)
{
	struct fault f = { .trigger = FAULT_AT, .count = 1, .state = AL_SAFEOP };
	struct seen seen = { .action = -1 };
	char *comment = strchr(line, '#');
	char *rest = NULL;
	int r;

	if (comment != NULL) {
		*comment = '\0';
	}
	for (char *word = strtok_r(line, " \t\r\n", &rest); word != NULL;
	     word = strtok_r(NULL, " \t\r\n", &rest)) {
		r = take_word(&f, word, slave_count, &seen, error, error_bytes);
		if (r < 0) {
			return r;
		}
	}
	if (seen.action < 0 && seen.key_count == 0) {
		return 0;
	}
	r = check_whole(&f, &seen, error, error_bytes);
	if (r > 0) {
		*ret = f;
	}
	return r;
}
