/* SPDX-License-Identifier: MIT */
#include "segment/edge_writer.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "harness/test.h"

enum { KEEP_BYTES = 65536, LINE_BYTES = 64, TAIL_BYTES = 32768 };

#define DC0_NS UINT64_C(845000000000000000)
#define FLUSH_NS INT64_C(50000000)

/* On a tmpfs: every one can make holes. */
static void path_of(const char *name, char path[64])
{
	snprintf(path, 64, "/dev/shm/ecdaq-edges-%d-%s", (int)getpid(), name);
}

static void put(struct edge_writer *ew, int from, int to)
{
	for (int i = from; i < to; i++) {
		edge_writer_put(ew, i % 2 == 0 ? 0 : 3, i * INT64_C(1000000),
				DC0_NS + (uint64_t)i * 1000000);
		if (i % 100 == 0) {
			CHECK_EQ(edge_writer_flush(ew, (i + 1) * FLUSH_NS), 0);
		}
	}
}

static off_t size_of(const char *path, off_t *ret_taken_bytes)
{
	struct stat st;

	CHECK_EQ(stat(path, &st), 0);
	*ret_taken_bytes = st.st_blocks * 512;
	return st.st_size;
}

TEST(edge_writer, a_line_is_slave_host_time_and_dc_time)
{
	struct edge_writer *ew;
	char path[64];
	char text[2 * LINE_BYTES] = "";
	FILE *in;

	path_of("lines", path);
	CHECK_EQ(edge_writer_open(path, 0, &ew), 0);
	edge_writer_put(ew, 0, 1, DC0_NS);
	edge_writer_put(ew, 63, 2, DC0_NS + 1);
	CHECK_EQ(edge_writer_flush(ew, FLUSH_NS), 0);
	in = fopen(path, "r");
	CHECK(in != NULL);
	CHECK(fread(text, 1, sizeof(text) - 1, in) > 0);
	CHECK_STR(text, "0 1 845000000000000000\n63 2 845000000000000001\n");
	fclose(in);
	edge_writer_close(ew);
	unlink(path);
}

TEST(edge_writer, of_a_file_only_the_newest_edges_take_room_and_each_keeps_its_place)
{
	struct edge_writer *ew;
	char path[64];
	char kept[TAIL_BYTES];
	char want[LINE_BYTES];
	off_t taken_bytes;
	off_t bytes;
	int fd;

	path_of("keep", path);
	CHECK_EQ(edge_writer_open(path, KEEP_BYTES, &ew), 0);
	put(ew, 0, 20000);
	CHECK_EQ(edge_writer_flush(ew, INT64_MAX), 0);
	bytes = size_of(path, &taken_bytes);
	CHECK(bytes > 8 * KEEP_BYTES);
	CHECK(taken_bytes >= KEEP_BYTES);
	CHECK(taken_bytes <= KEEP_BYTES + 2 * 4096);
	fd = open(path, O_RDONLY | O_CLOEXEC);
	CHECK_EQ(pread(fd, kept, TAIL_BYTES, bytes - TAIL_BYTES), TAIL_BYTES);
	CHECK(memchr(kept, 0, TAIL_BYTES) == NULL);
	snprintf(want, sizeof(want), "\n3 19999000000 845000019999000000\n");
	CHECK_EQ(memcmp(kept + TAIL_BYTES - strlen(want), want, strlen(want)), 0);
	CHECK_EQ(pread(fd, kept, 1, 0), 1);
	CHECK_EQ(kept[0], 0);
	close(fd);
	edge_writer_close(ew);
	unlink(path);
}

TEST(edge_writer, without_a_limit_all_edges_stay)
{
	struct edge_writer *ew;
	char path[64];
	off_t taken_bytes;
	off_t bytes;

	path_of("all", path);
	CHECK_EQ(edge_writer_open(path, 0, &ew), 0);
	put(ew, 0, 20000);
	edge_writer_close(ew);
	bytes = size_of(path, &taken_bytes);
	CHECK(taken_bytes >= bytes);
	unlink(path);
}

TEST(edge_writer, a_file_that_cannot_be_made_is_refused)
{
	struct edge_writer *ew = NULL;

	CHECK_EQ(edge_writer_open("/nonexistent/edges", 0, &ew), -ENOENT);
	CHECK(ew == NULL);
}
