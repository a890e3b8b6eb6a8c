/* SPDX-License-Identifier: MIT */
#include "simulator/topology.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/limits.h"
#include "base/prng.h"
#include "devices/catalogue.h"
#include "devices/fb1111_piccolo.h"
#include "devices/plant.h"
#include "devices/wago_750_354.h"
#include "devices/wago_node.h"
#include "segment/slave_list.h"
#include "wire/sii.h"

/* Two bits of register 0x0007 a port: 0 and 1 none, 2 E-bus, 3 MII. */
enum { PORT_KIND_EBUS = 2 };
enum { PATH_BYTES = 1024, LINE_BYTES = PATH_BYTES + 200 };

#define PPM_LIMIT 1000.0

struct topology {
	const struct sim_options *opt;
	struct prng prng;
	int count;
	struct slave_list_entry entry[LIMIT_SLAVES];
	struct segment_slave_spec spec[LIMIT_SLAVES];
	uint8_t sii[LIMIT_SLAVES][SEGMENT_SII_BYTES];
};

static int take_list(struct topology *l)
{
	char why[128];
	char line[LINE_BYTES];
	int count = slave_list_parse(l->opt->slaves, l->entry, LIMIT_SLAVES, why, sizeof(why));

	if (count < 0) {
		snprintf(line, sizeof(line), "--slaves: %s", why);
		return sim_error(line);
	}
	l->count = count;
	return 0;
}

static int take_slaves(struct topology *l)
{
	char line[LINE_BYTES];
	char *end;
	long count = strtol(l->opt->slaves, &end, 10);

	if (*end != '\0' || end == l->opt->slaves) {
		return take_list(l);
	}
	if (count < 1 || count > LIMIT_SLAVES) {
		snprintf(line, sizeof(line), "--slaves: expected a number from 1 to %d",
			 LIMIT_SLAVES);
		return sim_error(line);
	}
	for (; l->count < (int)count; l->count++) {
		l->entry[l->count] = (struct slave_list_entry){ .name = "fb1111_piccolo",
								.parent = l->count - 1,
								.parent_port = 1 };
	}
	return 0;
}

/* --- EEPROM images --- */

static int read_file(const char *path, uint8_t *buf, size_t capacity, size_t *ret_bytes)
{
	FILE *file = fopen(path, "rb");
	int r = 0;

	if (file == NULL) {
		return -errno;
	}
	errno = 0;
	*ret_bytes = fread(buf, 1, capacity, file);
	if (ferror(file)) {
		r = errno != 0 ? -errno : -EIO;
	} else if (*ret_bytes == capacity && fgetc(file) != EOF) {
		r = -EFBIG;
	}
	fclose(file);
	return r;
}

static int check_image(const char *path, const uint8_t *image, size_t bytes)
{
	static struct sii sii;
	char line[LINE_BYTES];
	char why[160];

	if (bytes < SII_CATEGORIES_BYTE) {
		snprintf(line, sizeof(line),
			 "%s: not an SII image: %zu bytes, at least %d are needed", path, bytes,
			 SII_CATEGORIES_BYTE);
		return sim_error(line);
	}
	if (sii_checksum(image) != image[14]) {
		fprintf(stderr,
			"ecdaq-sim: %s: wrong checksum in word 7: this slave will not leave INIT\n",
			path);
	}
	if (sii_parse(image, bytes, &sii, why, sizeof(why)) < 0) {
		fprintf(stderr, "ecdaq-sim: %s: damaged, simulated as it is: %s\n", path, why);
	}
	return 0;
}

/* 1; 0: there is no such file. */
static int read_image(struct topology *l, int i, size_t *ret_bytes)
{
	char path[PATH_BYTES];
	char line[LINE_BYTES];
	int r;

	if (l->opt->sii_dir == NULL) {
		return 0;
	}
	if (snprintf(path, sizeof(path), "%s/%s.bin", l->opt->sii_dir, l->entry[i].name) >=
	    (int)sizeof(path)) {
		return sim_error("--sii: path too long");
	}
	r = read_file(path, l->sii[i], SEGMENT_SII_BYTES, ret_bytes);
	if (r == -ENOENT) {
		return 0;
	}
	if (r < 0) {
		snprintf(line, sizeof(line), "%s: %s", path, strerror(-r));
		return sim_error(line);
	}
	return check_image(path, l->sii[i], *ret_bytes) < 0 ? -1 : 1;
}

static int unknown_slave(const struct topology *l, int i)
{
	char near[SLAVE_LIST_NAME_BYTES];
	char line[LINE_BYTES];

	catalogue_near(l->entry[i].name, near, sizeof(near));
	snprintf(line, sizeof(line), "slave '%s': not in the catalogue%s%s%s%s: %s",
		 l->entry[i].name, l->opt->sii_dir != NULL ? " nor in " : "",
		 l->opt->sii_dir != NULL ? l->opt->sii_dir : "",
		 near[0] != '\0' ? ": did you mean " : "", near,
		 near[0] != '\0' ? "see --list-slaves"
				 : "--list-slaves lists it, --sii DIR has images of others");
	return sim_error(line);
}

static int make_wago(struct topology *l, int i)
{
	char line[LINE_BYTES];
	int r = wago_750_354_by_name(i, l->entry[i].name, &l->spec[i]);

	if (r == -EINVAL || r == -E2BIG) {
		snprintf(line, sizeof(line),
			 "slave '%s': expected wago_750_354[+MODULE...], MODULE 430, 457, 530 "
			 "or 557, at most %d",
			 l->entry[i].name, WAGO_MODULES_MAX);
		return sim_error(line);
	}
	return r < 0 ? sim_error("no memory") : 0;
}

static int make_plant(struct topology *l, int i)
{
	char line[LINE_BYTES];
	int r = plant_by_name(i, l->entry[i].name, &l->spec[i]);

	if (r == -EINVAL) {
		snprintf(line, sizeof(line),
			 "slave '%s': expected plant[:TAU_MS[:GAIN]], each above 0 and up to "
			 "1000000",
			 l->entry[i].name);
		return sim_error(line);
	}
	return r < 0 ? sim_error("no memory") : 0;
}

static int make_slave(struct topology *l, int i)
{
	static struct slave_model model;
	size_t bytes = 0;
	int r;

	if (wago_750_354_is_name(l->entry[i].name)) {
		return make_wago(l, i);
	}
	if (plant_is_name(l->entry[i].name)) {
		return make_plant(l, i);
	}

	if (strcmp(l->entry[i].name, "fb1111_piccolo") == 0) {
		r = fb1111_piccolo_slave(i, &l->spec[i]);
		return r < 0 ? sim_error("no memory") : 0;
	}
	r = read_image(l, i, &bytes);
	if (r < 0) {
		return -1;
	}
	if (r > 0) {
		r = catalogue_sii_slave(l->sii[i], bytes, i, &l->spec[i]);
	} else if (catalogue_find(l->entry[i].name, &model) == 0) {
		r = catalogue_slave(&model, i, &l->spec[i]);
	} else {
		return unknown_slave(l, i);
	}
	return r < 0 ? sim_error("no memory") : 0;
}

/* --- cables --- */

/* A chip without a third port cannot have a branch there. */
static int connect_slave(struct topology *l, int i)
{
	const struct slave_list_entry *entry = &l->entry[i];
	struct segment_slave_spec *spec = &l->spec[i];
	char line[LINE_BYTES];
	unsigned kind;

	spec->parent = entry->parent;
	spec->parent_port = entry->parent_port;
	if (entry->parent < 0) {
		return 0;
	}
	kind = l->spec[entry->parent].features->port_descriptor >> 2 * entry->parent_port & 3u;
	if (kind < PORT_KIND_EBUS) {
		snprintf(line, sizeof(line), "--slaves: %s: port %u of %s is not there",
			 entry->name, entry->parent_port, l->entry[entry->parent].name);
		return sim_error(line);
	}
	return 0;
}

/* --- crystals --- */

static int take_ppm(const char **text, double *ret_ppm)
{
	char *end;
	double ppm = strtod(*text, &end);

	/* Written so that a NaN is refused, too. */
	if (end == *text || (*end != ',' && *end != '\0') ||
	    !(ppm >= -PPM_LIMIT && ppm <= PPM_LIMIT)) {
		return sim_error("--ppm: expected numbers from -1000 to 1000, separated by commas");
	}
	*text = *end == ',' ? end + 1 : end;
	*ret_ppm = ppm;
	return 0;
}

static int set_crystals(struct topology *l)
{
	const char *text = l->opt->ppm != NULL ? l->opt->ppm : "";

	for (int i = 0; i < l->count; i++) {
		struct segment_slave_spec *s = &l->spec[i];

		s->ppm = (prng_unit(&l->prng) - 0.5) * 100.0;
		s->clock_start_ns = prng_below(&l->prng, 10 * (uint64_t)NS_PER_S);
		s->seed = prng_next(&l->prng);
		s->jitter_ns = l->opt->jitter_ns.value;
		s->wander_ppm = l->opt->wander_ppm;
		s->signal = l->opt->signal;
		if (*text != '\0' && take_ppm(&text, &s->ppm) < 0) {
			return -1;
		}
	}
	return *text == '\0' ? 0 : sim_error("--ppm: more numbers than slaves");
}

static int make(struct topology *l, int64_t t_ns, struct segment **ret_segment)
{
	if (take_slaves(l) < 0) {
		return -1;
	}
	for (int i = 0; i < l->count; i++) {
		if (make_slave(l, i) < 0 || connect_slave(l, i) < 0) {
			return -1;
		}
	}
	if (set_crystals(l) < 0) {
		return -1;
	}
	return segment_create(l->spec, (size_t)l->count, t_ns, ret_segment) < 0
		       ? sim_error("cannot create the segment: no memory")
		       : 0;
}

int topology_create(const struct sim_options *opt, int64_t t_ns, struct segment **ret_segment)
{
	static struct topology l;

	l.opt = opt;
	l.prng.state = (uint64_t)opt->seed.value;
	l.count = 0;
	return make(&l, t_ns, ret_segment);
}
