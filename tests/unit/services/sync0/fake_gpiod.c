/* SPDX-License-Identifier: MIT */
#include "unit/services/sync0/fake_gpiod.h"

#include <errno.h>
#include <gpiod.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

struct fake_gpiod fake_gpiod;

struct gpiod_edge_event {
	uint64_t at_ns;
	unsigned long seqno;
};

static int pipe_fd[2] = { -1, -1 };
static struct gpiod_edge_event newest;

/* Every object is this one: the functions' types keep them apart. */
static void *made(void)
{
	fake_gpiod.live++;
	return malloc(1);
}

static void freed(void *object)
{
	fake_gpiod.live--;
	free(object);
}

void fake_gpiod_reset(void)
{
	fake_gpiod = (struct fake_gpiod){ .label = "pinctrl-test", .lines = 54 };
}

void fake_gpiod_edge(uint64_t at_ns, unsigned long seqno)
{
	const struct gpiod_edge_event ev = { .at_ns = at_ns, .seqno = seqno };

	if (write(pipe_fd[1], &ev, sizeof(ev)) != (ssize_t)sizeof(ev)) {
		abort();
	}
}

void fake_gpiod_unplug(void)
{
	close(pipe_fd[1]);
	pipe_fd[1] = -1;
}

struct gpiod_chip *gpiod_chip_open(const char *path)
{
	(void)path;
	errno = fake_gpiod.open_error;
	return fake_gpiod.open_error != 0 ? NULL : made();
}

void gpiod_chip_close(struct gpiod_chip *chip)
{
	freed(chip);
}

struct gpiod_chip_info *gpiod_chip_get_info(struct gpiod_chip *chip)
{
	(void)chip;
	return made();
}

void gpiod_chip_info_free(struct gpiod_chip_info *info)
{
	freed(info);
}

const char *gpiod_chip_info_get_name(struct gpiod_chip_info *info)
{
	(void)info;
	return "gpiochip0";
}

const char *gpiod_chip_info_get_label(struct gpiod_chip_info *info)
{
	(void)info;
	return fake_gpiod.label;
}

size_t gpiod_chip_info_get_num_lines(struct gpiod_chip_info *info)
{
	(void)info;
	return fake_gpiod.lines;
}

int gpiod_chip_get_line_offset_from_name(struct gpiod_chip *chip, const char *name)
{
	(void)chip;
	errno = ENOENT;
	return fake_gpiod.name_of_5 != NULL && strcmp(name, fake_gpiod.name_of_5) == 0 ? 5 : -1;
}

struct gpiod_line_info *gpiod_chip_get_line_info(struct gpiod_chip *chip, unsigned int offset)
{
	(void)chip;
	(void)offset;
	return made();
}

void gpiod_line_info_free(struct gpiod_line_info *info)
{
	freed(info);
}

const char *gpiod_line_info_get_consumer(struct gpiod_line_info *info)
{
	(void)info;
	return fake_gpiod.consumer;
}

struct gpiod_line_settings *gpiod_line_settings_new(void)
{
	return made();
}

void gpiod_line_settings_free(struct gpiod_line_settings *settings)
{
	freed(settings);
}

int gpiod_line_settings_set_direction(struct gpiod_line_settings *settings,
				      enum gpiod_line_direction direction)
{
	(void)settings;
	return direction == GPIOD_LINE_DIRECTION_INPUT ? 0 : -1;
}

int gpiod_line_settings_set_edge_detection(struct gpiod_line_settings *settings,
					   enum gpiod_line_edge edge)
{
	(void)settings;
	fake_gpiod.asked_edge = (int)edge;
	return 0;
}

int gpiod_line_settings_set_event_clock(struct gpiod_line_settings *settings,
					enum gpiod_line_clock event_clock)
{
	(void)settings;
	fake_gpiod.asked_clock = (int)event_clock;
	return 0;
}

void gpiod_line_settings_set_debounce_period_us(struct gpiod_line_settings *settings,
						unsigned long period)
{
	(void)settings;
	fake_gpiod.asked_debounce_us = period;
}

struct gpiod_line_config *gpiod_line_config_new(void)
{
	return made();
}

void gpiod_line_config_free(struct gpiod_line_config *config)
{
	freed(config);
}

int gpiod_line_config_add_line_settings(struct gpiod_line_config *config,
					const unsigned int *offsets, size_t num_offsets,
					struct gpiod_line_settings *settings)
{
	(void)config;
	(void)settings;
	fake_gpiod.asked_offset = offsets[0];
	return num_offsets == 1 ? 0 : -1;
}

struct gpiod_request_config *gpiod_request_config_new(void)
{
	return made();
}

void gpiod_request_config_free(struct gpiod_request_config *config)
{
	freed(config);
}

void gpiod_request_config_set_consumer(struct gpiod_request_config *config, const char *consumer)
{
	(void)config;
	(void)consumer;
}

void gpiod_request_config_set_event_buffer_size(struct gpiod_request_config *config,
						size_t event_buffer_size)
{
	(void)config;
	fake_gpiod.asked_buffer = (unsigned)event_buffer_size;
}

struct gpiod_line_request *gpiod_chip_request_lines(struct gpiod_chip *chip,
						    struct gpiod_request_config *req_cfg,
						    struct gpiod_line_config *line_cfg)
{
	(void)chip;
	(void)req_cfg;
	(void)line_cfg;
	errno = fake_gpiod.request_error;
	if (errno == 0 && fake_gpiod.asked_clock == GPIOD_LINE_CLOCK_HTE && !fake_gpiod.has_hte) {
		errno = EOPNOTSUPP;
	}
	if (errno != 0 || pipe(pipe_fd) < 0) {
		return NULL;
	}
	return made();
}

void gpiod_line_request_release(struct gpiod_line_request *request)
{
	for (int i = 0; i < 2; i++) {
		if (pipe_fd[i] >= 0) {
			close(pipe_fd[i]);
		}
		pipe_fd[i] = -1;
	}
	freed(request);
}

int gpiod_line_request_get_fd(struct gpiod_line_request *request)
{
	(void)request;
	return pipe_fd[0];
}

int gpiod_line_request_read_edge_events(struct gpiod_line_request *request,
					struct gpiod_edge_event_buffer *buffer, size_t max_events)
{
	(void)request;
	(void)buffer;
	(void)max_events;
	errno = fake_gpiod.read_error;
	if (errno != 0 || read(pipe_fd[0], &newest, sizeof(newest)) != (ssize_t)sizeof(newest)) {
		return -1;
	}
	return 1;
}

struct gpiod_edge_event_buffer *gpiod_edge_event_buffer_new(size_t capacity)
{
	(void)capacity;
	return made();
}

void gpiod_edge_event_buffer_free(struct gpiod_edge_event_buffer *buffer)
{
	freed(buffer);
}

struct gpiod_edge_event *gpiod_edge_event_buffer_get_event(struct gpiod_edge_event_buffer *buffer,
							   unsigned long index)
{
	(void)buffer;
	(void)index;
	return &newest;
}

uint64_t gpiod_edge_event_get_timestamp_ns(struct gpiod_edge_event *event)
{
	return event->at_ns;
}

unsigned long gpiod_edge_event_get_line_seqno(struct gpiod_edge_event *event)
{
	return event->seqno;
}
