/* SPDX-License-Identifier: MIT */
#include "sync0/gpio.h"

#include <dirent.h>
#include <errno.h>
#include <gpiod.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/clock.h"

enum { EVENTS = 256, PATH_BYTES = 512, CONSUMER_BYTES = 64 };

/* The engine's clock is another one: its offset is found by the edges that were read fastest. */
enum { HTE_BLOCK = 64 };

struct gpio {
	struct gpiod_line_request *request;
	struct gpiod_edge_event_buffer *events;
	int is_hte;
	int64_t hte_offset_ns; /* CLOCK_MONOTONIC minus the engine's */
	int64_t hte_least_ns;  /* of the block being read */
	int hte_count;
};

/* Where a line is, once it is found. */
struct place {
	char path[PATH_BYTES];
	unsigned offset;
	int found;        /* times */
	int denied;       /* chips that may not be opened */
	int chips;        /* looked into */
	char others[128]; /* their labels, for the message */
};

/* "LABEL:17"; without a number behind the last colon, it is a line's name. */
static int split(const char *line, char *ret_chip, size_t chip_bytes, unsigned *ret_offset)
{
	const char *colon = strrchr(line, ':');
	unsigned long offset;
	char *end;

	if (colon == NULL || colon == line || colon[1] < '0' || colon[1] > '9') {
		return 0;
	}
	errno = 0;
	offset = strtoul(colon + 1, &end, 10);
	if (errno != 0 || *end != '\0' || offset > UINT16_MAX ||
	    (size_t)(colon - line) >= chip_bytes) {
		return 0;
	}
	snprintf(ret_chip, chip_bytes, "%.*s", (int)(colon - line), line);
	*ret_offset = (unsigned)offset;
	return 1;
}

static void take_place(struct place *place, const char *path, unsigned offset)
{
	if (place->found++ == 0) {
		snprintf(place->path, sizeof(place->path), "%s", path);
		place->offset = offset;
	}
}

static void note_label(struct place *place, const char *label)
{
	size_t len = strlen(place->others);

	snprintf(place->others + len, sizeof(place->others) - len, "%s%.32s", len > 0 ? ", " : "",
		 label);
}

/* Look for @line on one chip. 0, or -ERANGE with the reason. */
static int look_into(struct gpiod_chip *chip, const char *path, const char *line,
		     struct place *place, char *why)
{
	struct gpiod_chip_info *info = gpiod_chip_get_info(chip);
	char wanted[CONFIG_PATH_BYTES];
	unsigned offset;
	int r = 0;

	if (info == NULL) {
		return 0;
	}
	place->chips++;
	note_label(place, gpiod_chip_info_get_label(info));
	if (!split(line, wanted, sizeof(wanted), &offset)) {
		int found = gpiod_chip_get_line_offset_from_name(chip, line);

		if (found >= 0) {
			take_place(place, path, (unsigned)found);
		}
	} else if (strcmp(wanted, gpiod_chip_info_get_label(info)) == 0 ||
		   strcmp(wanted, gpiod_chip_info_get_name(info)) == 0) {
		if (offset < gpiod_chip_info_get_num_lines(info)) {
			take_place(place, path, offset);
		} else {
			snprintf(why, GPIO_WHY_BYTES, "chip %.100s has lines 0 to %zu only", wanted,
				 gpiod_chip_info_get_num_lines(info) - 1);
			r = -ERANGE;
		}
	}
	gpiod_chip_info_free(info);
	return r;
}

static int is_chip(const struct dirent *entry)
{
	return strncmp(entry->d_name, "gpiochip", 8) == 0;
}

static int look_at_all(const struct gpio_spec *spec, struct place *place, char *why)
{
	struct dirent **entry;
	int count = scandir(spec->dev_dir, &entry, is_chip, alphasort);
	int r = 0;

	for (int i = 0; i < count; i++) {
		char path[PATH_BYTES];
		struct gpiod_chip *chip = NULL;

		if (r == 0 && snprintf(path, sizeof(path), "%s/%s", spec->dev_dir,
				       entry[i]->d_name) < (int)sizeof(path)) {
			chip = gpiod_chip_open(path);
			place->denied += chip == NULL && (errno == EACCES || errno == EPERM);
		}
		if (chip != NULL) {
			r = look_into(chip, path, spec->line, place, why);
			gpiod_chip_close(chip);
		}
		free(entry[i]);
	}
	if (count >= 0) {
		free(entry);
	}
	return r;
}

static int explain_missing(const struct gpio_spec *spec, const struct place *place, char *why)
{
	char chip[CONFIG_PATH_BYTES];
	unsigned offset;

	if (place->found > 1) {
		snprintf(why, GPIO_WHY_BYTES, "the name matches more than one line");
		return -ENOTUNIQ;
	}
	if (place->denied > 0) {
		snprintf(why, GPIO_WHY_BYTES,
			 "no permission to open %.100s/gpiochip*: be root or in their group",
			 spec->dev_dir);
		return -EACCES;
	}
	if (place->chips == 0) {
		snprintf(why, GPIO_WHY_BYTES, "this machine has no GPIO chip (%.100s/gpiochip*)",
			 spec->dev_dir);
	} else if (split(spec->line, chip, sizeof(chip), &offset)) {
		snprintf(why, GPIO_WHY_BYTES, "no chip of this label; there are: %s",
			 place->others);
	} else {
		snprintf(why, GPIO_WHY_BYTES, "no line of this name on: %s", place->others);
	}
	return -ENOENT;
}

static int find(const struct gpio_spec *spec, struct place *place, char *why)
{
	int r = look_at_all(spec, place, why);

	if (r < 0) {
		return r;
	}
	return place->found == 1 ? 0 : explain_missing(spec, place, why);
}

/* The line configuration for one clock; NULL with errno. */
static struct gpiod_line_config *line_config(unsigned offset, enum gpiod_line_clock clock)
{
	struct gpiod_line_settings *settings = gpiod_line_settings_new();
	struct gpiod_line_config *config = gpiod_line_config_new();
	int r = -1;

	if (settings != NULL && config != NULL) {
		r = gpiod_line_settings_set_direction(settings, GPIOD_LINE_DIRECTION_INPUT);
		r = r < 0 ? r
			  : gpiod_line_settings_set_edge_detection(settings,
								   GPIOD_LINE_EDGE_RISING);
		r = r < 0 ? r : gpiod_line_settings_set_event_clock(settings, clock);
		gpiod_line_settings_set_debounce_period_us(settings, 0);
		r = r < 0 ? r : gpiod_line_config_add_line_settings(config, &offset, 1, settings);
	}
	if (r < 0 && config != NULL) {
		gpiod_line_config_free(config);
		config = NULL;
	}
	if (settings != NULL) {
		gpiod_line_settings_free(settings);
	}
	return config;
}

static struct gpiod_line_request *request(struct gpiod_chip *chip, const struct gpio_spec *spec,
					  unsigned offset, enum gpiod_line_clock clock)
{
	struct gpiod_line_config *lines = line_config(offset, clock);
	struct gpiod_request_config *config = gpiod_request_config_new();
	struct gpiod_line_request *request = NULL;
	int r;

	if (lines != NULL && config != NULL) {
		gpiod_request_config_set_consumer(config, "ecdaq-sync0");
		gpiod_request_config_set_event_buffer_size(config, spec->buffer);
		request = gpiod_chip_request_lines(chip, config, lines);
	}
	r = errno;
	if (config != NULL) {
		gpiod_request_config_free(config);
	}
	if (lines != NULL) {
		gpiod_line_config_free(lines);
	}
	errno = r;
	return request;
}

static int explain_request(struct gpiod_chip *chip, unsigned offset, int error, char *why)
{
	struct gpiod_line_info *info = NULL;
	const char *consumer = NULL;

	if (error == EBUSY) {
		info = gpiod_chip_get_line_info(chip, offset);
		consumer = info == NULL ? NULL : gpiod_line_info_get_consumer(info);
		snprintf(why, GPIO_WHY_BYTES, "already used by %s",
			 consumer == NULL ? "another program" : consumer);
		if (info != NULL) {
			gpiod_line_info_free(info);
		}
	} else if (error == EACCES || error == EPERM) {
		snprintf(why, GPIO_WHY_BYTES, "no permission to use it");
		error = EACCES;
	} else if (error == EOPNOTSUPP) {
		snprintf(why, GPIO_WHY_BYTES, "it cannot time edges by this clock (sync0.clock)");
	} else if (error == ENXIO) {
		snprintf(why, GPIO_WHY_BYTES, "it has no interrupt, so edges cannot be seen");
	} else {
		snprintf(why, GPIO_WHY_BYTES, "cannot be requested: %s", strerror(error));
	}
	return -error;
}

static int open_request(struct gpio *gpio, const struct gpio_spec *spec, const struct place *place,
			char *why)
{
	struct gpiod_chip *chip = gpiod_chip_open(place->path);
	int r = -errno;

	if (chip == NULL) {
		snprintf(why, GPIO_WHY_BYTES, "%.120s: %.100s", place->path, strerror(-r));
		return r;
	}
	errno = ENODEV;
	if (spec->clock != CONFIG_EDGE_MONOTONIC) {
		gpio->request = request(chip, spec, place->offset, GPIOD_LINE_CLOCK_HTE);
		gpio->is_hte = gpio->request != NULL;
	}
	/* Whatever kept the engine from it, but what would keep any clock from it. */
	if (gpio->request == NULL && spec->clock != CONFIG_EDGE_HTE &&
	    (spec->clock == CONFIG_EDGE_MONOTONIC || errno != EBUSY)) {
		gpio->request = request(chip, spec, place->offset, GPIOD_LINE_CLOCK_MONOTONIC);
	}
	r = gpio->request == NULL ? explain_request(chip, place->offset, errno, why) : 0;
	gpiod_chip_close(chip);
	return r;
}

int gpio_open(const struct gpio_spec *spec, struct gpio **ret_gpio, char *why)
{
	struct place place = { .found = 0 };
	struct gpio *gpio;
	int r = find(spec, &place, why);

	if (r < 0) {
		return r;
	}
	gpio = calloc(1, sizeof(*gpio));
	if (gpio == NULL) {
		snprintf(why, GPIO_WHY_BYTES, "%s", strerror(ENOMEM));
		return -ENOMEM;
	}
	r = open_request(gpio, spec, &place, why);
	if (r == 0) {
		gpio->events = gpiod_edge_event_buffer_new(EVENTS);
		if (gpio->events == NULL) {
			snprintf(why, GPIO_WHY_BYTES, "%s", strerror(ENOMEM));
			r = -ENOMEM;
		}
	}
	if (r < 0) {
		gpio_close(gpio);
		return r;
	}
	*ret_gpio = gpio;
	return 0;
}

void gpio_close(struct gpio *gpio)
{
	if (gpio == NULL) {
		return;
	}
	if (gpio->events != NULL) {
		gpiod_edge_event_buffer_free(gpio->events);
	}
	if (gpio->request != NULL) {
		gpiod_line_request_release(gpio->request);
	}
	free(gpio);
}

int gpio_fd(const struct gpio *gpio)
{
	return gpiod_line_request_get_fd(gpio->request);
}

int gpio_is_hte(const struct gpio *gpio)
{
	return gpio->is_hte;
}

/* The engine's time as CLOCK_MONOTONIC: too late by the shortest way from pin to program. */
static int64_t from_hte(struct gpio *gpio, int64_t hte_ns)
{
	struct timespec ts;
	int64_t offset_ns;

	clock_gettime(CLOCK_MONOTONIC, &ts);
	offset_ns = (int64_t)ts.tv_sec * NS_PER_S + ts.tv_nsec - hte_ns;
	if (gpio->hte_count == 0 || offset_ns < gpio->hte_least_ns) {
		gpio->hte_least_ns = offset_ns;
	}
	if (gpio->hte_offset_ns == 0 || gpio->hte_least_ns < gpio->hte_offset_ns) {
		gpio->hte_offset_ns = gpio->hte_least_ns;
	}
	if (++gpio->hte_count == HTE_BLOCK) {
		gpio->hte_count = 0;
		/* The two clocks drift apart: follow, but not each late reading. */
		gpio->hte_offset_ns += (gpio->hte_least_ns - gpio->hte_offset_ns) / 4;
	}
	return hte_ns + gpio->hte_offset_ns;
}

int gpio_read(struct gpio *gpio, struct edge *edges, size_t limit)
{
	struct pollfd waiting = { .fd = gpio_fd(gpio), .events = POLLIN };
	int n;

	if (poll(&waiting, 1, 0) <= 0 || waiting.revents == 0) {
		return 0;
	}
	if (!(waiting.revents & POLLIN)) {
		return -ENODEV;
	}
	n = gpiod_line_request_read_edge_events(gpio->request, gpio->events,
						limit < EVENTS ? limit : EVENTS);
	if (n < 0) {
		return -errno;
	}
	for (int i = 0; i < n; i++) {
		struct gpiod_edge_event *ev =
			gpiod_edge_event_buffer_get_event(gpio->events, (unsigned long)i);
		int64_t at_ns = (int64_t)gpiod_edge_event_get_timestamp_ns(ev);

		edges[i] = (struct edge){
			.mono_ns = gpio->is_hte ? from_hte(gpio, at_ns) : at_ns,
			.seqno = (uint32_t)gpiod_edge_event_get_line_seqno(ev),
		};
	}
	return n;
}
