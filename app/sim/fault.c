/* SPDX-License-Identifier: MIT */
#include "sim/fault.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/prng.h"
#include "wire/al.h"
#include "wire/esc_reg.h"

enum { FAULTS_MAX = 1024, LINE_BYTES = 256 };

struct fault_plan {
	struct prng prng;
	int64_t start_ns;
	uint64_t frames;
	size_t count;
	struct fault fault[FAULTS_MAX];
};

static const struct {
	const char *name;
	enum fault_action action;
	int is_of_frame;
} actions[] = {
	{ "lose", FAULT_LOSE, 1 },         { "drop", FAULT_DROP, 1 },
	{ "delay", FAULT_DELAY, 1 },       { "double", FAULT_DOUBLE, 1 },
	{ "truncate", FAULT_TRUNCATE, 1 }, { "corrupt", FAULT_CORRUPT, 1 },
	{ "cut", FAULT_CUT, 0 },           { "heal", FAULT_HEAL, 0 },
	{ "power-off", FAULT_POWER_OFF, 0 }, { "power-on", FAULT_POWER_ON, 0 },
	{ "drift", FAULT_DRIFT, 0 },       { "al-error", FAULT_AL_ERROR, 0 },
	{ "port-error", FAULT_PORT_ERROR, 0 },
};

struct fault_plan *fault_plan_create(uint64_t seed, int64_t start_ns)
{
	struct fault_plan *plan = calloc(1, sizeof(*plan));

	if (plan != NULL) {
		plan->prng.state = seed;
		plan->start_ns = start_ns;
	}
	return plan;
}

void fault_plan_destroy(struct fault_plan *plan)
{
	free(plan);
}

void fault_plan_restart(struct fault_plan *plan, int64_t start_ns)
{
	plan->start_ns = start_ns;
}

/* --- reading a line --- */

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
			*ret_ns = (int64_t)(value * units[i].ns);
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

static int parse_number(const char *text, double *ret)
{
	char *end;
	double v = strtod(text, &end);

	if (end == text || *end != '\0' || !isfinite(v)) {
		return -EINVAL;
	}
	*ret = v;
	return 0;
}

static int set_small(const char *value, uint64_t limit, unsigned *ret)
{
	uint64_t v;
	int r = parse_count(value, limit, &v);

	if (r == 0) {
		*ret = (unsigned)v;
	}
	return r;
}

static int set_trigger(struct fault *f, const char *key, const char *value)
{
	int r = -ENOENT;

	if (strcmp(key, "at") == 0) {
		f->trigger = FAULT_AT;
		r = parse_time(value, &f->at_ns);
	} else if (strcmp(key, "frame") == 0) {
		f->trigger = FAULT_FRAME;
		r = parse_count(value, UINT64_MAX, &f->frame);
	} else if (strcmp(key, "every") == 0) {
		f->trigger = FAULT_EVERY;
		r = parse_count(value, UINT64_MAX, &f->frame);
		r = r == 0 && f->frame == 0 ? -EINVAL : r;
	} else if (strcmp(key, "p") == 0) {
		f->trigger = FAULT_PROBABLY;
		r = parse_number(value, &f->probability);
		r = r == 0 && (f->probability < 0 || f->probability > 1) ? -EINVAL : r;
	}
	return r;
}

static int set_key(struct fault *f, const char *key, const char *value, size_t slave_count)
{
	unsigned code;
	int r = set_trigger(f, key, value);

	if (r != -ENOENT) {
		return r == 0 ? 1 : r;
	}
	if (strcmp(key, "for") == 0) {
		return parse_time(value, &f->for_ns);
	}
	if (strcmp(key, "by") == 0) {
		return parse_time(value, &f->by_ns);
	}
	if (strcmp(key, "slave") == 0) {
		return slave_count == 0 ? -EINVAL : set_small(value, slave_count - 1, &f->slave);
	}
	if (strcmp(key, "port") == 0) {
		return set_small(value, 3, &f->port);
	}
	if (strcmp(key, "ppm") == 0) {
		return parse_number(value, &f->ppm);
	}
	if (strcmp(key, "code") == 0) {
		r = set_small(value, 0xffff, &code);
		f->code = r == 0 ? (uint16_t)code : f->code;
		return r;
	}
	return -ENOENT;
}

static int set_action(struct fault *f, const char *word, int *ret_is_of_frame)
{
	for (size_t i = 0; i < sizeof(actions) / sizeof(actions[0]); i++) {
		if (strcmp(actions[i].name, word) == 0) {
			f->action = actions[i].action;
			*ret_is_of_frame = actions[i].is_of_frame;
			return 0;
		}
	}
	return -ENOENT;
}

static int parse_words(struct fault *f, char *line, size_t slave_count, char *error, size_t bytes)
{
	int has_trigger = 0;
	int has_action = 0;
	int is_of_frame = 0;
	char *rest = NULL;

	for (char *word = strtok_r(line, " \t\r\n", &rest); word != NULL;
	     word = strtok_r(NULL, " \t\r\n", &rest)) {
		char *equals = strchr(word, '=');
		int r;

		if (equals == NULL) {
			if (has_action || set_action(f, word, &is_of_frame) < 0) {
				snprintf(error, bytes, "'%s' is no fault", word);
				return -EINVAL;
			}
			has_action = 1;
			continue;
		}
		*equals = '\0';
		r = set_key(f, word, equals + 1, slave_count);
		if (r < 0) {
			snprintf(error, bytes, r == -ENOENT ? "unknown key '%s'" : "%s: bad value",
				 word);
			return -EINVAL;
		}
		has_trigger |= r;
	}
	if (!has_action && !has_trigger) {
		return 0;
	}
	if (!has_action || !has_trigger) {
		snprintf(error, bytes, has_action ? "when? (at=, frame=, every=, p=)" : "what?");
		return -EINVAL;
	}
	if (!is_of_frame && f->trigger != FAULT_AT && f->trigger != FAULT_FRAME) {
		snprintf(error, bytes, "a fault of a slave happens once: at= or frame=");
		return -EINVAL;
	}
	if (f->action == FAULT_DELAY && f->by_ns == 0) {
		snprintf(error, bytes, "delay by how much? (by=)");
		return -EINVAL;
	}
	return 1;
}

int fault_plan_add(struct fault_plan *plan, const char *line, size_t slave_count, char *error,
		   size_t error_bytes)
{
	struct fault f = { .trigger = FAULT_AT };
	char copy[LINE_BYTES];
	char *comment;
	int r;

	if (snprintf(copy, sizeof(copy), "%s", line) >= (int)sizeof(copy)) {
		snprintf(error, error_bytes, "line longer than %d characters", LINE_BYTES - 1);
		return -EINVAL;
	}
	comment = strchr(copy, '#');
	if (comment != NULL) {
		*comment = '\0';
	}
	r = parse_words(&f, copy, slave_count, error, error_bytes);
	if (r <= 0) {
		return r;
	}
	if (plan->count == FAULTS_MAX) {
		snprintf(error, error_bytes, "more than FAULTS_MAX = %d faults", FAULTS_MAX);
		return -EINVAL;
	}
	f.at_ns += plan->start_ns;
	plan->fault[plan->count++] = f;
	return 0;
}

int fault_plan_load(struct fault_plan *plan, const char *path, size_t slave_count, char *error,
		    size_t error_bytes)
{
	FILE *file = fopen(path, "r");
	char line[LINE_BYTES + 2];
	char why[128];
	int number = 0;
	int r = 0;

	if (file == NULL) {
		r = -errno;
		snprintf(error, error_bytes, "%s: %s", path, strerror(-r));
		return r;
	}
	while (r == 0 && fgets(line, sizeof(line), file) != NULL) {
		number++;
		r = fault_plan_add(plan, line, slave_count, why, sizeof(why));
	}
	fclose(file);
	if (r < 0) {
		snprintf(error, error_bytes, "%s:%d: %s", path, number, why);
	}
	return r;
}

/* --- doing it --- */

static int is_due(struct fault_plan *plan, struct fault *f, int64_t t_ns)
{
	switch (f->trigger) {
	case FAULT_AT:
		if (f->is_done || t_ns < f->at_ns) {
			return 0;
		}
		if (f->for_ns > 0) {
			f->is_done = t_ns >= f->at_ns + f->for_ns;
			return !f->is_done;
		}
		f->is_done = 1;
		return 1;
	case FAULT_FRAME:
		return plan->frames == f->frame;
	case FAULT_EVERY:
		return plan->frames % f->frame == 0;
	case FAULT_PROBABLY:
		return prng_unit(&plan->prng) < f->probability;
	}
	return 0;
}

static void al_error(struct esc *esc, uint16_t code)
{
	uint8_t state = esc->reg[ESC_REG_AL_STATUS] & AL_STATE_MASK;

	/* The slave falls one state back, as on a synchronisation error. */
	esc_force_al_status(esc, (uint8_t)((state == AL_OP ? AL_SAFEOP : state) | AL_ERROR), code);
}

static void apply(struct fault_plan *plan, const struct fault *f, struct segment *segment, int64_t t_ns,
		  size_t frame_len, struct fault_verdict *v)
{
	switch (f->action) {
	case FAULT_LOSE:
		v->is_lost = 1;
		break;
	case FAULT_DROP:
		v->is_dropped = 1;
		break;
	case FAULT_DELAY:
		v->delay_ns += f->by_ns;
		break;
	case FAULT_DOUBLE:
		v->is_doubled = 1;
		break;
	case FAULT_TRUNCATE:
		v->truncate_to = 1 + (size_t)prng_below(&plan->prng, frame_len - 1);
		break;
	case FAULT_CORRUPT:
		v->corrupt_at = 14 + (size_t)prng_below(&plan->prng, frame_len - 14);
		v->corrupt_xor = (uint8_t)(1 + prng_below(&plan->prng, 255));
		break;
	case FAULT_CUT:
		segment_cut(segment, f->slave, t_ns);
		break;
	case FAULT_HEAL:
		segment_heal(segment, f->slave, t_ns);
		break;
	case FAULT_POWER_OFF:
		segment_power_off(segment, f->slave, t_ns);
		break;
	case FAULT_POWER_ON:
		segment_power_on(segment, f->slave, t_ns);
		break;
	case FAULT_DRIFT:
		esc_clock_drift(segment_esc(segment, f->slave), t_ns, f->ppm);
		break;
	case FAULT_AL_ERROR:
		al_error(segment_esc(segment, f->slave), f->code);
		break;
	case FAULT_PORT_ERROR:
		esc_count_error(segment_esc(segment, f->slave), f->port, ESC_ERROR_RX);
		break;
	}
}

struct fault_verdict fault_plan_judge(struct fault_plan *plan, struct segment *segment, int64_t t_ns,
				      size_t frame_len)
{
	struct fault_verdict v = { .is_dropped = 0 };

	plan->frames++;
	segment_advance(segment, t_ns);
	for (size_t i = 0; i < plan->count; i++) {
		if (is_due(plan, &plan->fault[i], t_ns)) {
			apply(plan, &plan->fault[i], segment, t_ns, frame_len, &v);
		}
	}
	return v;
}
