/* SPDX-License-Identifier: MIT */
#include "segment/io_line.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LINE_BYTES = 256 };

#define SPACE " \t\r\n"

static int fail(char *answer, size_t answer_bytes, const char *what, const char *why)
{
	snprintf(answer, answer_bytes, "%s%s", what, why);
	return -EINVAL;
}

/* "slave=N" */
static struct sim_device *find_device(struct segment *segment, const char *word)
{
	char *end;
	unsigned long slave;

	if (word == NULL || strncmp(word, "slave=", 6) != 0 || word[6] < '0' || word[6] > '9') {
		return NULL;
	}
	slave = strtoul(word + 6, &end, 10);
	return *end == '\0' && slave < segment_slave_count(segment) ? segment_device(segment, slave)
								    : NULL;
}

static int set_terminal(struct sim_device *dev, char *word)
{
	char *equals = strchr(word, '=');
	int r;

	if (equals == NULL || dev->ops->io_set == NULL) {
		return -EINVAL;
	}
	*equals = '\0';
	r = dev->ops->io_set(dev, word, equals + 1);
	*equals = '=';
	return r;
}

int io_line(struct segment *segment, const char *line, char *answer, size_t answer_bytes)
{
	char copy[LINE_BYTES];
	char *rest = NULL;
	struct sim_device *dev;
	char *word;

	if (strncmp(line, "io", 2) != 0 || (line[2] != '\0' && strchr(SPACE, line[2]) == NULL)) {
		return -ENOENT;
	}
	if (snprintf(copy, sizeof(copy), "%s", line + 2) >= (int)sizeof(copy)) {
		return fail(answer, answer_bytes, "io: ", "line too long");
	}
	dev = find_device(segment, strtok_r(copy, SPACE, &rest));
	if (dev == NULL) {
		return fail(answer, answer_bytes, "io: ", "slave=N is missing, or no such slave");
	}
	if (dev->ops->io_get == NULL) {
		return fail(answer, answer_bytes, "io: ", "this slave has no terminals");
	}
	while ((word = strtok_r(NULL, SPACE, &rest)) != NULL) {
		if (set_terminal(dev, word) < 0) {
			return fail(answer, answer_bytes, word, ": unknown input or invalid value");
		}
	}
	dev->ops->io_get(dev, answer, answer_bytes);
	return 0;
}
