/* SPDX-License-Identifier: MIT */
#include "record/log.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "harness/test.h"
#include "record/store.h"
#include "unit/services/record/bench.h"

/* What a call of log_* printed. */
struct printed {
	char *out;
	size_t out_len;
	char *err;
	size_t err_len;
	FILE *out_file;
	FILE *err_file;
};

static struct printed begin(void)
{
	struct printed p = { .out = NULL };

	return p;
}

static void open_both(struct printed *p)
{
	p->out_file = open_memstream(&p->out, &p->out_len);
	p->err_file = open_memstream(&p->err, &p->err_len);
	CHECK(p->out_file != NULL && p->err_file != NULL);
}

static void close_both(struct printed *p)
{
	CHECK_EQ(fclose(p->out_file), 0);
	CHECK_EQ(fclose(p->err_file), 0);
}

static void done(struct printed *p)
{
	free(p->out);
	free(p->err);
}

static unsigned lines_of(const char *text)
{
	unsigned n = 0;

	for (; *text != '\0'; text++) {
		n += *text == '\n';
	}
	return n;
}

/* Three files of 500 cycles; one event. */
static void record(struct bench *b)
{
	bench_init(b, 100, 8192);
	b->options.rotate_period_ns = NS_PER_S;
	CHECK_EQ(bench_start(b), 0);
	for (uint64_t n = 0; n < 30; n++) {
		bench_push(b, n * 50, 50);
		if (n == 3) {
			bench_push_event(b, 1);
		}
		bench_wait(b, 100 * NS_PER_MS);
	}
	CHECK_EQ(bench_stop(b), 0);
}

static void path_of(struct bench *b, size_t number, char *path, size_t path_bytes)
{
	struct store_entry *entries;
	size_t count;

	CHECK_EQ(store_list(b->dir, &entries, &count), 0);
	CHECK(number < count);
	CHECK_EQ(store_path(b->dir, entries[number].name, path, path_bytes), 0);
	free(entries);
}

TEST(log, list_has_a_line_a_recording)
{
	struct bench b = { .calls = 0 };
	struct printed p = begin();

	record(&b);
	open_both(&p);
	CHECK_EQ(log_list(b.dir, LOG_TEXT, p.out_file, p.err_file), EXIT_CODE_OK);
	close_both(&p);
	CHECK_EQ(lines_of(p.out), 1 + 3);
	CHECK(strstr(p.out, "finished") != NULL);
	CHECK_EQ(p.err_len, 0);
	done(&p);
	open_both(&p);
	CHECK_EQ(log_list("/nowhere", LOG_TEXT, p.out_file, p.err_file), EXIT_CODE_FAILED);
	close_both(&p);
	CHECK_STR(p.err, "ecdaq: log: /nowhere: No such file or directory\n");
	done(&p);
	bench_done(&b);
}

TEST(log, check_finds_the_gap_where_a_file_between_two_is_gone)
{
	struct bench b = { .calls = 0 };
	struct printed p = begin();
	const char *paths[] = { b.dir };
	char path[512];

	record(&b);
	open_both(&p);
	CHECK_EQ(log_check(paths, 1, LOG_TEXT, p.out_file, p.err_file), EXIT_CODE_OK);
	close_both(&p);
	CHECK(strstr(p.out, "3 files, 1500 cycles, 0 gaps, 0 cycles missing, 0 damaged: clean") !=
	      NULL);
	done(&p);
	path_of(&b, 1, path, sizeof(path));
	CHECK_EQ(unlink(path), 0);
	open_both(&p);
	CHECK_EQ(log_check(paths, 1, LOG_JSON, p.out_file, p.err_file), EXIT_CODE_FAILED);
	close_both(&p);
	CHECK(strstr(p.out, "\"missing_before\":500,") != NULL ||
	      strstr(p.out, "\"missing_before\":550,") != NULL);
	CHECK(strstr(p.out, "\"gaps\":1,") != NULL);
	CHECK(strstr(p.out, "\"clean\":false") != NULL);
	done(&p);
	bench_done(&b);
}

TEST(log, check_takes_a_file_that_is_being_recorded_for_no_damage)
{
	struct bench b = { .calls = 0 };
	struct printed p = begin();
	const char *paths[] = { b.dir };

	bench_init(&b, 100, 1024);
	CHECK_EQ(bench_start(&b), 0);
	bench_push(&b, 0, 500);
	bench_wait(&b, NS_PER_S);
	open_both(&p);
	CHECK_EQ(log_check(paths, 1, LOG_TEXT, p.out_file, p.err_file), EXIT_CODE_OK);
	close_both(&p);
	CHECK(strstr(p.out, "being recorded") != NULL);
	done(&p);
	bench_kill(&b);
	open_both(&p);
	CHECK_EQ(log_check(paths, 1, LOG_TEXT, p.out_file, p.err_file), EXIT_CODE_FAILED);
	close_both(&p);
	CHECK(strstr(p.out, "DAMAGED") != NULL);
	CHECK(strstr(p.out, "not finished") != NULL);
	done(&p);
	bench_done(&b);
}

TEST(log, recover_repairs_an_unfinished_recording_and_not_one_in_the_making)
{
	struct bench b = { .calls = 0 };
	struct printed p = begin();
	const char *paths[] = { b.dir };
	char path[512];

	bench_init(&b, 100, 1024);
	CHECK_EQ(bench_start(&b), 0);
	bench_push(&b, 0, 500);
	bench_wait(&b, NS_PER_S);
	path_of(&b, 0, path, sizeof(path));
	open_both(&p);
	CHECK_EQ(log_recover(path, NULL, LOG_TEXT, p.out_file, p.err_file), EXIT_CODE_FAILED);
	close_both(&p);
	CHECK(strstr(p.err, "is being recorded") != NULL);
	done(&p);
	bench_kill(&b);
	open_both(&p);
	CHECK_EQ(log_recover(path, NULL, LOG_TEXT, p.out_file, p.err_file), EXIT_CODE_OK);
	close_both(&p);
	CHECK(strstr(p.out, "repaired") != NULL);
	CHECK(strstr(p.out, "lost after cycle 499") != NULL);
	done(&p);
	open_both(&p);
	CHECK_EQ(log_check(paths, 1, LOG_TEXT, p.out_file, p.err_file), EXIT_CODE_OK);
	close_both(&p);
	done(&p);
	path_of(&b, 0, path, sizeof(path));
	CHECK_STR(path + strlen(path) - 5, ".mcap");
	open_both(&p);
	CHECK_EQ(log_recover(path, path, LOG_TEXT, p.out_file, p.err_file), EXIT_CODE_FAILED);
	close_both(&p);
	CHECK(strstr(p.err, "already exists") != NULL);
	done(&p);
	bench_done(&b);
}

TEST(log, info_tells_topics_fields_and_metadata)
{
	struct bench b = { .calls = 0 };
	struct printed p = begin();
	char path[512];

	record(&b);
	path_of(&b, 0, path, sizeof(path));
	open_both(&p);
	CHECK_EQ(log_info(path, LOG_TEXT, p.out_file, p.err_file), EXIT_CODE_OK);
	close_both(&p);
	CHECK(strstr(p.out, "topic /ecdaq/adc: ") != NULL);
	CHECK(strstr(p.out, "uint32 value") != NULL);
	CHECK(strstr(p.out, "metadata ecdaq.session") != NULL);
	CHECK(strstr(p.out, "period: 1ms") != NULL);
	CHECK(strstr(p.out, "attachment ecdaq.idl") != NULL);
	done(&p);
	bench_done(&b);
}

static char *export_of(struct bench *b, struct log_export_options options, int wanted)
{
	const char *paths[] = { b->dir };
	struct printed p = begin();
	char *out;

	options.paths = paths;
	options.path_count = 1;
	open_both(&p);
	CHECK_EQ(log_export(&options, p.out_file, p.err_file), wanted);
	close_both(&p);
	CHECK_EQ(p.err_len > 0, wanted != EXIT_CODE_OK);
	out = p.out;
	free(p.err);
	return out;
}

TEST(log, export_has_a_row_a_cycle_over_all_files)
{
	struct bench b = { .calls = 0 };
	char *out;

	record(&b);
	out = export_of(&b, (struct log_export_options){ .to = UINT64_MAX }, EXIT_CODE_OK);
	CHECK_EQ(lines_of(out), 1 + 1500);
	CHECK_EQ(strncmp(out, "cycle,utc_ns,dc_time_ns,flags,adc.good,adc.value\n0,", 51), 0);
	CHECK(strstr(out, "\n1499,") != NULL);
	CHECK(strstr(out, ",0,1,1499\n") != NULL);
	free(out);
	out = export_of(
		&b,
		(struct log_export_options){
			.channels = "adc.value", .from = 700, .to = 702, .format = LOG_JSON },
		EXIT_CODE_OK);
	CHECK_EQ(lines_of(out), 3);
	CHECK(strstr(out, "{\"cycle\":701,\"utc_ns\":") != NULL);
	CHECK(strstr(out, ",\"adc.value\":701}") != NULL);
	free(out);
	out = export_of(&b,
			(struct log_export_options){ .channels = "adc.value,adc.nothing",
						     .to = UINT64_MAX },
			EXIT_CODE_FAILED);
	CHECK_STR(out, "");
	free(out);
	out = export_of(&b, (struct log_export_options){ .from = 9999, .to = UINT64_MAX },
			EXIT_CODE_FAILED);
	free(out);
	bench_done(&b);
}

/* The whole number behind @key in the @nth line of @text. */
static int64_t number_of(const char *text, unsigned nth, const char *key)
{
	const char *at = text;

	for (unsigned i = 0; i < nth; i++) {
		at = strchr(at, '\n');
		CHECK(at != NULL);
		at++;
	}
	at = strstr(at, key);
	CHECK(at != NULL);
	return strtoll(at + strlen(key), NULL, 10);
}

TEST(log, export_gives_each_cycle_its_utc)
{
	const struct log_export_options options = {
		.channels = "adc.value", .from = 700, .to = 702, .format = LOG_JSON
	};
	struct bench b = { .calls = 0 };
	int64_t utc_ns;
	char *out;

	record(&b);
	out = export_of(&b, options, EXIT_CODE_OK);
	utc_ns = number_of(out, 0, "\"utc_ns\":");
	CHECK(utc_ns / NS_PER_S == INT64_C(1766000000)); /* as bench_push() set the host's clock */
	CHECK_EQ(number_of(out, 1, "\"utc_ns\":") - utc_ns, NS_PER_MS);
	CHECK_EQ(number_of(out, 2, "\"utc_ns\":") - utc_ns, 2 * NS_PER_MS);
	free(out);
	bench_done(&b);
}

TEST(log, usage_errors_have_their_exit_code)
{
	char *none[] = { (char *)"log", NULL };
	char *verb[] = { (char *)"log", (char *)"sing", NULL };
	char *option[] = { (char *)"log", (char *)"list", (char *)"--loud", NULL };
	char *value[] = { (char *)"log", (char *)"export", (char *)"--from", (char *)"-1", NULL };
	char *foreign[] = { (char *)"log", (char *)"list", (char *)"--raw", NULL };
	char *missing[] = { (char *)"log", (char *)"info", NULL };

	CHECK_EQ(log_main(1, none), EXIT_CODE_USAGE);
	CHECK_EQ(log_main(2, verb), EXIT_CODE_USAGE);
	CHECK_EQ(log_main(3, option), EXIT_CODE_USAGE);
	CHECK_EQ(log_main(4, value), EXIT_CODE_USAGE);
	CHECK_EQ(log_main(3, foreign), EXIT_CODE_USAGE);
	CHECK_EQ(log_main(2, missing), EXIT_CODE_USAGE);
}
