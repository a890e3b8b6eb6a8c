/* SPDX-License-Identifier: MIT */
#include "segment/edge_writer.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>

#define FLUSH_NS INT64_C(50000000) /* edges are in their file at the latest after this */
#define PAGE_BYTES INT64_C(4096)

struct edge_writer {
	FILE *file;
	int pipe; /* -1: it is a file */
	int64_t keep_bytes;
	int64_t hole_bytes; /* from the start of the file */
	int64_t flushed_ns;
};

/* The reader of a pipe gets each edge at once; a missing or slow one must not block us. */
static int set_up_pipe(struct edge_writer *ew)
{
	const struct sigaction ignore = { .sa_handler = SIG_IGN };
	struct stat st;

	if (fstat(fileno(ew->file), &st) < 0) {
		return -errno;
	}
	if (!S_ISFIFO(st.st_mode)) {
		return 0;
	}
	ew->pipe = fileno(ew->file);
	sigaction(SIGPIPE, &ignore, NULL);
	return fcntl(ew->pipe, F_SETFL, O_WRONLY | O_NONBLOCK) < 0 ? -errno : 0;
}

int edge_writer_open(const char *path, uint64_t keep_bytes, struct edge_writer **ret_writer)
{
	struct edge_writer *ew = calloc(1, sizeof(*ew));
	int r;

	if (ew == NULL) {
		return -ENOMEM;
	}
	ew->pipe = -1;
	ew->keep_bytes = (int64_t)keep_bytes;
	ew->file = fopen(path, "we");
	r = ew->file == NULL ? -errno : set_up_pipe(ew);
	if (r < 0) {
		edge_writer_close(ew);
		return r;
	}
	*ret_writer = ew;
	return 0;
}

void edge_writer_close(struct edge_writer *ew)
{
	if (ew == NULL) {
		return;
	}
	if (ew->file != NULL) {
		fclose(ew->file);
	}
	free(ew);
}

void edge_writer_put(struct edge_writer *ew, unsigned slave, int64_t mono_ns, uint64_t dc_ns)
{
	static const char form[] = "%u %lld %llu\n";
	long long at_ns = mono_ns;
	unsigned long long system_ns = dc_ns;

	if (ew->pipe < 0) {
		fprintf(ew->file, form, slave, at_ns, system_ns);
		return;
	}
	(void)!dprintf(ew->pipe, form, slave, at_ns, system_ns);
}

static int make_hole(struct edge_writer *ew)
{
	int64_t end = ftello(ew->file) - ew->keep_bytes;
	int64_t from = ew->hole_bytes;

	end -= end % PAGE_BYTES;
	if (ew->keep_bytes == 0 || end <= from) {
		return 0;
	}
	if (fallocate(fileno(ew->file), FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, from,
		      end - from) < 0) {
		ew->keep_bytes = 0;
		return -errno;
	}
	ew->hole_bytes = end;
	return 0;
}

int edge_writer_flush(struct edge_writer *ew, int64_t now_ns)
{
	if (ew->pipe >= 0 || now_ns - ew->flushed_ns < FLUSH_NS) {
		return 0;
	}
	ew->flushed_ns = now_ns;
	fflush(ew->file);
	return make_hole(ew);
}
