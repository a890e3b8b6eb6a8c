/* SPDX-License-Identifier: MIT */
#include "sync0/edge_file.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "harness/test.h"

static struct edge_item item;

TEST(sync0, a_line_of_edges_is_slave_time_dc_time_and_number)
{
	CHECK_EQ(edge_line_parse("3 7000000000123 845000000000000000 17\n", &item), 0);
	CHECK_EQ(item.kind, EDGE_ITEM_EDGE);
	CHECK_EQ(item.edge.line, 3);
	CHECK_EQ(item.edge.mono_ns, 7000000000123);
	CHECK_EQ(item.edge.dc_ns, 845000000000000000);
	CHECK_EQ(item.edge.seqno, 17);
	CHECK_EQ(edge_line_parse("  0\t5  ", &item), 0);
	CHECK_EQ(item.edge.dc_ns, 0);
	CHECK_EQ(edge_line_parse("# 0 5", &item), 0);
	CHECK_EQ(item.kind, EDGE_ITEM_NONE);
	CHECK_EQ(edge_line_parse("", &item), 0);
	CHECK_EQ(edge_line_parse("c 5 1000 1500 2500 20 -1 1", &item), 0);
	CHECK_EQ(item.kind, EDGE_ITEM_CYCLE);
	CHECK_EQ(item.cycle.cycle, 5);
	CHECK_EQ(item.cycle.frame_mono_ns, 2500);
	CHECK_EQ(item.cycle.dc_diff_ns, -1);
	CHECK_EQ(item.cycle.is_judged, 1);
	CHECK_EQ(edge_line_parse("s 63 1000 0", &item), 0);
	CHECK_EQ(item.kind, EDGE_ITEM_SHOT);
	CHECK_EQ(item.shot.slave_pos, 63);
	CHECK_EQ(item.shot.at_dc_ns, 1000);
	CHECK_EQ(item.shot.due_dc_ns, 0);
	CHECK_EQ(edge_line_parse("l 5 0 2000000 -250000 drive x\n", &item), 0);
	CHECK_EQ(item.kind, EDGE_ITEM_LINE);
	CHECK_EQ(item.line.slave_pos, 5);
	CHECK_EQ(item.line.mode, CHECKER_PERIODIC);
	CHECK_EQ(item.line.cycle_ns, 2000000);
	CHECK_EQ(item.line.shift_ns, -250000);
	CHECK_STR(item.name, "drive x");
}

TEST(sync0, a_line_that_is_none_is_refused_and_leaves_the_output_untouched)
{
	static const char *const bad[] = {
		"1",
		"512 5",
		"-1 5",
		"0 -5",
		"0 0",
		"0 5 6 7 8",
		"0 5x",
		"x 5",
		"0 5 -1",
		"0 5 6 4294967296",
		"0 1e3",
		"0,5",
		"0 +5",
		"c",
		"c 1 2 3 4 5 6",
		"c 1 2 3 4 5 6 2",
		"c -1 2 3 4 5 6 1",
		"c 1 2 3 4 5 6 1 8",
		"0 9223372036854775807",
		"0 99999999999999999999",
		"cc 1 2 3 4 5 6 1",
		"s 1 2",
		"s 512 2 3",
		"s 1 2 3 4",
		"s 1 -2 3",
		"sc 1 2 3",
		"l 5 0 1000000 0",
		"l 5 0 1000000 0 \n",
		"l 5 3 1000000 0 name",
		"l 512 0 1000000 0 name",
		"l 5 0 -1 0 name",
		"l 5 0 4294967296 0 name",
		"l 5 0 1000000 2147483648 name",
		"l 5 0 1000000 0 a_name_of_thirty-two_characters_",
	};

	for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++) {
		item.kind = EDGE_ITEM_CYCLE;
		item.edge.line = 77;
		CHECK_EQ(edge_line_parse(bad[i], &item), -EINVAL);
		CHECK_EQ(item.edge.line, 77);
	}
}

static const char *path_of(const char *name)
{
	static char path[128];

	snprintf(path, sizeof(path), "/tmp/ecdaq-unit-%d-%s", (int)getpid(), name);
	return path;
}

static FILE *fresh(const char *path)
{
	FILE *f = fopen(path, "we");

	CHECK(f != NULL);
	return f;
}

TEST(sync0, a_file_that_grows_is_followed_line_by_line)
{
	const char *path = path_of("grows");
	FILE *f = fresh(path);
	struct edge_file *ef;

	fputs("0 10 20\n1 11", f);
	fflush(f);
	CHECK_EQ(edge_file_open(path, EDGE_FILE_START, &ef), 0);
	CHECK_EQ(edge_file_next(ef, &item), 1);
	CHECK_EQ(item.edge.mono_ns, 10);
	CHECK_EQ(edge_file_next(ef, &item), 0);
	fputs("5 21\n\n# x\n1 bad\n0 12 22\n", f);
	fflush(f);
	CHECK_EQ(edge_file_next(ef, &item), 1);
	CHECK_EQ(item.edge.mono_ns, 115);
	CHECK_EQ(edge_file_next(ef, &item), -EBADMSG);
	CHECK_EQ(edge_file_line(ef), 5);
	CHECK_EQ(edge_file_next(ef, &item), 1);
	CHECK_EQ(item.edge.mono_ns, 12);
	CHECK_EQ(edge_file_next(ef, &item), 0);
	CHECK(!edge_file_is_replaced(ef));
	CHECK_EQ(unlink(path), 0);
	CHECK(edge_file_is_replaced(ef));
	edge_file_close(ef);
	fclose(f);
	CHECK_EQ(edge_file_open(path, EDGE_FILE_START, &ef), -ENOENT);
}

TEST(sync0, a_file_opened_at_its_end_begins_with_the_next_whole_line)
{
	const char *path = path_of("end");
	FILE *f = fresh(path);
	struct edge_file *ef;

	fputs("0 10 20\n1 11", f);
	fflush(f);
	CHECK_EQ(edge_file_open(path, EDGE_FILE_END, &ef), 0);
	CHECK_EQ(edge_file_next(ef, &item), 0);
	fputs("5 21\n0 30 40\n", f);
	fflush(f);
	CHECK_EQ(edge_file_next(ef, &item), 1);
	CHECK_EQ(item.edge.mono_ns, 30);
	edge_file_close(ef);
	fclose(f);
	unlink(path);
}

TEST(sync0, a_line_without_end_is_refused_once_and_not_kept)
{
	const char *path = path_of("long");
	FILE *f = fresh(path);
	struct edge_file *ef;

	for (int i = 0; i < 100000; i++) {
		fputc('1', f);
	}
	fputs("\n0 5\n", f);
	fclose(f);
	CHECK_EQ(edge_file_open(path, EDGE_FILE_START, &ef), 0);
	CHECK_EQ(edge_file_next(ef, &item), -EBADMSG);
	CHECK_EQ(edge_file_next(ef, &item), 1);
	CHECK_EQ(item.edge.mono_ns, 5);
	edge_file_close(ef);
	unlink(path);
}

TEST(sync0, a_file_whose_old_edges_are_a_hole_begins_behind_it)
{
	char path[128];
	FILE *f;
	struct edge_file *ef;

	/* On a tmpfs a hole is one. */
	snprintf(path, sizeof(path), "/dev/shm/ecdaq-unit-%d-hole", (int)getpid());
	f = fresh(path);
	CHECK_EQ(fseek(f, 65536, SEEK_SET), 0);
	fputs("5 21\n0 30 40\n", f);
	fclose(f);
	CHECK_EQ(edge_file_open(path, EDGE_FILE_START, &ef), 0);
	CHECK_EQ(edge_file_next(ef, &item), 1);
	CHECK_EQ(item.edge.mono_ns, 30);
	CHECK_EQ(edge_file_next(ef, &item), 0);
	edge_file_close(ef);
	unlink(path);
}

TEST(sync0, what_cannot_be_read_twice_is_no_file_of_edges)
{
	struct edge_file *ef = NULL;

	CHECK_EQ(edge_file_open("/tmp", EDGE_FILE_START, &ef), -EISDIR);
	CHECK_EQ(edge_file_open("/tmp", EDGE_FILE_END, &ef), -EISDIR);
	CHECK_EQ(edge_file_open("/dev/null", EDGE_FILE_START, &ef), -ESPIPE);
	CHECK(ef == NULL);
}
