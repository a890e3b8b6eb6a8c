/* SPDX-License-Identifier: MIT */
#include "sync0/edge_file.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { BUFFER_BYTES = 65536, LINE_BYTES = 256, FIELDS_MAX = 7 };

/* No sum of such times leaves what base/timemap.h can map: 54 years. */
#define TIME_LIMIT (INT64_MAX / 16 * 3)

struct edge_file {
	char *path;
	int fd;
	dev_t dev;
	ino_t ino;
	off_t taken;
	uint64_t line;
	size_t from; /* the part of buffer not parsed yet */
	size_t to;
	int is_skipping; /* the rest of a line that was too long, or was begun before */
	char buffer[BUFFER_BYTES];
};

/*
 * At most @most decimal numbers with blanks between. Their count, or -EINVAL; *ret_rest is what
 * follows them.
 */
static int parse_numbers(const char *text, int most, int64_t *value, const char **ret_rest)
{
	for (int n = 0;; n++) {
		char *end;
		long long v;

		text += strspn(text, " \t\r\n");
		*ret_rest = text;
		if (*text == '\0' || n == most) {
			return n;
		}
		errno = 0;
		v = strtoll(text, &end, 10);
		if ((*text != '-' && (*text < '0' || *text > '9')) || errno != 0 || end == text ||
		    v > TIME_LIMIT || v < -TIME_LIMIT || strchr(" \t\r\n", *end) == NULL) {
			return -EINVAL;
		}
		value[n] = v;
		text = end;
	}
}

static int parse_edge(const int64_t *v, int count, struct edge_item *ret)
{
	if (count < 2 || count > 4 || v[0] < 0 || v[0] >= LIMIT_SLAVES || v[1] <= 0 ||
	    (count > 2 && v[2] < 0) || (count > 3 && (v[3] < 0 || v[3] > UINT32_MAX))) {
		return -EINVAL;
	}
	*ret = (struct edge_item){ .kind = EDGE_ITEM_EDGE,
				   .edge = { .line = (uint16_t)v[0],
					     .mono_ns = v[1],
					     .dc_ns = count > 2 ? v[2] : 0,
					     .seqno = count > 3 ? (uint32_t)v[3] : 0 } };
	return 0;
}

static int parse_cycle(const int64_t *v, int count, struct edge_item *ret)
{
	if (count != 7 || v[0] < 0 || v[4] < 0 || v[5] < -1 || v[6] < 0 || v[6] > 1) {
		return -EINVAL;
	}
	*ret = (struct edge_item){ .kind = EDGE_ITEM_CYCLE,
				   .cycle = { .cycle = v[0],
					      .due_dc_ns = v[1],
					      .frame_dc_ns = v[2],
					      .frame_mono_ns = v[3],
					      .frame_latency_ns = v[4],
					      .dc_diff_ns = v[5],
					      .is_judged = (int)v[6] } };
	return 0;
}

static int parse_shot(const int64_t *v, int count, struct edge_item *ret)
{
	if (count != 3 || v[0] < 0 || v[0] >= LIMIT_SLAVES || v[1] < 0 || v[2] < 0) {
		return -EINVAL;
	}
	*ret = (struct edge_item){
		.kind = EDGE_ITEM_SHOT,
		.shot = { .slave_pos = (uint16_t)v[0], .at_dc_ns = v[1], .due_dc_ns = v[2] }
	};
	return 0;
}

static int parse_line(const int64_t *v, int count, const char *name, struct edge_item *ret)
{
	size_t len = strcspn(name, "\r\n");

	if (count != 4 || v[0] < 0 || v[0] >= LIMIT_SLAVES || v[1] < 0 || v[1] > CHECKER_OFF ||
	    v[2] < 0 || v[2] > UINT32_MAX || v[3] < -INT32_MAX || v[3] > INT32_MAX || len == 0 ||
	    len >= sizeof(ret->name)) {
		return -EINVAL;
	}
	*ret = (struct edge_item){ .kind = EDGE_ITEM_LINE,
				   .line = { .slave_pos = (uint16_t)v[0],
					     .mode = (enum checker_mode)v[1],
					     .cycle_ns = v[2],
					     .shift_ns = v[3] } };
	memcpy(ret->name, name, len);
	return 0;
}

void edge_file_write_line(FILE *out, const struct checker_line *line, const char *name)
{
	fprintf(out, "l %u %d %" PRId64 " %" PRId64 " ", line->slave_pos, (int)line->mode,
		line->cycle_ns, line->shift_ns);
	for (int i = 0; i < 31 && (name[i] != '\0' || i == 0); i++) {
		fputc(name[i] > ' ' && name[i] <= '~' ? name[i] : '?', out);
	}
	fputc('\n', out);
}

int edge_line_parse(const char *line, struct edge_item *ret)
{
	int64_t value[FIELDS_MAX];
	const char *rest;
	char first;
	int count;

	line += strspn(line, " \t\r\n");
	if (*line == '#' || *line == '\0') {
		*ret = (struct edge_item){ .kind = EDGE_ITEM_NONE };
		return 0;
	}
	first = *line;
	if (first == 'c' || first == 's' || first == 'l') {
		line++;
	}
	count = parse_numbers(line, first == 'l' ? 4 : FIELDS_MAX, value, &rest);
	if (count < 0 || (first != 'l' && *rest != '\0')) {
		return -EINVAL;
	}
	return first == 'c'   ? parse_cycle(value, count, ret)
	       : first == 's' ? parse_shot(value, count, ret)
	       : first == 'l' ? parse_line(value, count, rest, ret)
			      : parse_edge(value, count, ret);
}

/* From its start it is read more than once, which a pipe cannot. */
static int kind_error(enum edge_file_from from, mode_t mode)
{
	if (S_ISDIR(mode)) {
		return -EISDIR;
	}
	return from == EDGE_FILE_START && !S_ISREG(mode) ? -ESPIPE : 0;
}

/* Where that may be within a line, begin with the one behind it. */
static void seek(struct edge_file *ef, enum edge_file_from from, const struct stat *st)
{
	off_t at = 0;

	if (from == EDGE_FILE_END) {
		at = st->st_size - 1;
	} else if (S_ISREG(st->st_mode)) {
		at = lseek(ef->fd, 0, SEEK_DATA); /* ecdaq-sim --edges-keep makes a hole before */
	}
	if (at > 0) {
		ef->taken = lseek(ef->fd, at, SEEK_SET);
		ef->is_skipping = 1;
	}
}

int edge_file_open(const char *path, enum edge_file_from from, struct edge_file **ret_file)
{
	struct edge_file *ef = calloc(1, sizeof(*ef));
	struct stat st;
	int r;

	if (ef == NULL) {
		return -ENOMEM;
	}
	ef->fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
	ef->path = strdup(path);
	if (ef->fd < 0 || ef->path == NULL || fstat(ef->fd, &st) < 0) {
		r = ef->path == NULL ? -ENOMEM : -errno;
		edge_file_close(ef);
		return r;
	}
	r = kind_error(from, st.st_mode);
	if (r < 0) {
		edge_file_close(ef);
		return r;
	}
	ef->dev = st.st_dev;
	ef->ino = st.st_ino;
	seek(ef, from, &st);
	*ret_file = ef;
	return 0;
}

void edge_file_close(struct edge_file *ef)
{
	if (ef == NULL) {
		return;
	}
	if (ef->fd >= 0) {
		close(ef->fd);
	}
	free(ef->path);
	free(ef);
}

static int fill(struct edge_file *ef)
{
	ssize_t n;

	memmove(ef->buffer, ef->buffer + ef->from, ef->to - ef->from);
	ef->to -= ef->from;
	ef->from = 0;
	n = read(ef->fd, ef->buffer + ef->to, sizeof(ef->buffer) - ef->to);
	if (n <= 0) {
		return 0;
	}
	ef->to += (size_t)n;
	ef->taken += n;
	return 1;
}

/* The end of the line in the buffer; NULL: it is not whole yet. */
static char *line_end(struct edge_file *ef)
{
	return memchr(ef->buffer + ef->from, '\n', ef->to - ef->from);
}

int edge_file_next(struct edge_file *ef, struct edge_item *ret)
{
	char line[LINE_BYTES];

	for (;;) {
		char *end = line_end(ef);
		size_t len;
		int r;

		if (end == NULL && ef->to - ef->from >= LINE_BYTES) {
			ef->is_skipping = ef->is_skipping != 0 ? ef->is_skipping : -1;
			ef->from = ef->to;
		}
		if (end == NULL) {
			if (!fill(ef)) {
				return 0;
			}
			continue;
		}
		len = (size_t)(end - (ef->buffer + ef->from));
		memcpy(line, ef->buffer + ef->from, len < LINE_BYTES ? len : 0);
		line[len < LINE_BYTES ? len : 0] = '\0';
		ef->from += len + 1;
		ef->line++;
		if (ef->is_skipping > 0) {
			ef->is_skipping = 0;
			continue;
		}
		r = len >= LINE_BYTES || ef->is_skipping < 0 || strlen(line) != len
			    ? -EINVAL
			    : edge_line_parse(line, ret);
		ef->is_skipping = 0;
		if (r < 0) {
			return -EBADMSG;
		}
		if (ret->kind != EDGE_ITEM_NONE) {
			return 1;
		}
	}
}

uint64_t edge_file_line(const struct edge_file *ef)
{
	return ef->line;
}

int edge_file_is_replaced(const struct edge_file *ef)
{
	struct stat st;

	return stat(ef->path, &st) < 0 || st.st_dev != ef->dev || st.st_ino != ef->ino ||
	       (S_ISREG(st.st_mode) && st.st_size < ef->taken);
}
