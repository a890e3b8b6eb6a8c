/* SPDX-License-Identifier: MIT */
#include "cli/source.h"

#include <assert.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cli/hex.h"
#include "reader/page.h"

enum { PROBLEM_BYTES = 128 };

#define ALIAS_PREFIX "alias:"

enum exit_code source_fail_open(const struct cli *cli, const char *path, int err)
{
	switch (err) {
	case ENOENT:
	case ENOTDIR:
		return cli_fail(cli, EXIT_CODE_NO_DAEMON, "%s is not there: is ecdaqd running?",
				path);
	case EACCES:
	case EPERM:
		return cli_fail_permission(cli, "read", path);
	case EPROTO:
		return cli_fail(cli, EXIT_CODE_FAILED,
				"%s is of another version of ecdaq, or damaged", path);
	case EPROTONOSUPPORT:
		return cli_fail(cli, EXIT_CODE_FAILED,
				"%s is of another version: restart ecdaqd of the same release",
				path);
	default:
		return cli_fail(cli, EXIT_CODE_FAILED, "%s: %s", path, strerror(err));
	}
}

enum exit_code source_status(struct cli *cli, const struct status_page **ret_page)
{
	char path[CONFIG_PATH_BYTES];
	enum exit_code result = cli_path(cli, CONFIG_RUN_STATUS, path);
	int r;

	if (result != EXIT_CODE_OK) {
		return result;
	}
	r = source_try_status(cli, ret_page);
	return r < 0 ? source_fail_open(cli, path, -r) : EXIT_CODE_OK;
}

int source_try_status(struct cli *cli, const struct status_page **ret_page)
{
	struct status_page *page = malloc(sizeof(*page));
	char path[CONFIG_PATH_BYTES];
	int r = page == NULL ? -ENOMEM
		: cli_path(cli, CONFIG_RUN_STATUS, path) != EXIT_CODE_OK
			? -ENAMETOOLONG
			: page_read_status(path, page);

	if (r < 0) {
		free(page);
		return r;
	}
	*ret_page = page;
	return 0;
}

int source_refresh_status(struct cli *cli, const struct status_page **page)
{
	const struct status_page *newer;

	if (source_try_status(cli, &newer) < 0) {
		return 0;
	}
	if (newer->session != (*page)->session) {
		source_status_close(newer);
		return 0;
	}
	source_status_close(*page);
	*page = newer;
	return 1;
}

const struct record_status *source_record(struct cli *cli)
{
	struct record_status *record = malloc(sizeof(*record));
	char path[CONFIG_PATH_BYTES];

	if (record == NULL || cli_path(cli, CONFIG_RUN_RECORD_STATUS, path) != EXIT_CODE_OK ||
	    page_read_record(path, record) < 0) {
		free(record);
		return NULL;
	}
	return record;
}

void source_status_close(const struct status_page *page)
{
	free((void *)(uintptr_t)page);
}

void source_record_close(const struct record_status *record)
{
	free((void *)(uintptr_t)record);
}

void source_dds_close(const struct dds_status *dds)
{
	free((void *)(uintptr_t)dds);
}

const struct dds_status *source_dds(struct cli *cli)
{
	struct dds_status *dds = malloc(sizeof(*dds));
	char path[CONFIG_PATH_BYTES];

	if (dds == NULL || cli_path(cli, CONFIG_RUN_DDS_STATUS, path) != EXIT_CODE_OK ||
	    page_read_dds(path, dds) < 0) {
		free(dds);
		return NULL;
	}
	return dds;
}

void source_stream_close(const struct stream_status *stream)
{
	free((void *)(uintptr_t)stream);
}

const struct stream_status *source_stream(struct cli *cli)
{
	struct stream_status *stream = malloc(sizeof(*stream));
	char path[CONFIG_PATH_BYTES];

	if (stream == NULL || cli_path(cli, CONFIG_RUN_STREAM_STATUS, path) != EXIT_CODE_OK ||
	    page_read_stream(path, stream) < 0) {
		free(stream);
		return NULL;
	}
	return stream;
}

void source_uplink_close(const struct uplink_status *uplink)
{
	free((void *)(uintptr_t)uplink);
}

const struct uplink_status *source_uplink(struct cli *cli)
{
	struct uplink_status *uplink = malloc(sizeof(*uplink));
	char path[CONFIG_PATH_BYTES];

	if (uplink == NULL || cli_path(cli, CONFIG_RUN_UPLINK_STATUS, path) != EXIT_CODE_OK ||
	    page_read_uplink(path, uplink) < 0) {
		free(uplink);
		return NULL;
	}
	return uplink;
}

void samples_take_table(struct samples *samples)
{
	samples->table = reader_table(samples->reader);
	samples->meta = &samples->table->meta;
	samples->slaves = samples->table->slaves;
	samples->channels = samples->table->channels;
}

/* @ret_problem: if the version of the ring is the cause, the line about it, else "". */
static int open_samples(struct cli *cli, struct samples *ret_samples,
			char ret_problem[PROBLEM_BYTES])
{
	struct samples samples = { .reader = NULL };
	char path[CONFIG_PATH_BYTES];
	uint64_t lost;
	int r;

	ret_problem[0] = '\0';
	if (cli_path(cli, CONFIG_RUN_SAMPLES, path) != EXIT_CODE_OK) {
		return -ENAMETOOLONG;
	}
	r = reader_create(path, READER_AT_NEWEST, &samples.reader);
	if (r < 0) {
		return r;
	}
	if (reader_next(samples.reader, &lost) != READER_BEGUN) {
		r = reader_error(samples.reader);
		if (r == -EPROTONOSUPPORT || r == -E2BIG) {
			snprintf(ret_problem, PROBLEM_BYTES, "%s", reader_problem(samples.reader));
		}
		samples_close(&samples);
		return r;
	}
	samples_take_table(&samples);
	*ret_samples = samples;
	return 0;
}

int samples_try(struct cli *cli, struct samples *ret_samples)
{
	char problem[PROBLEM_BYTES];

	return open_samples(cli, ret_samples, problem);
}

/* There is no ring: ecdaqd makes it with the mapping, on the way to SAFE-OP. */
static enum exit_code fail_no_samples(struct cli *cli, const char *path, int err)
{
	const struct status_page *page;
	uint32_t state = BUS_DOWN;
	int is_there = source_try_status(cli, &page) == 0;

	if (is_there) {
		state = atomic_load_explicit(&page->bus_state, memory_order_relaxed);
		is_there = page_is_alive(page->pid);
		source_status_close(page);
	}
	if (!is_there) {
		return source_fail_open(cli, path, err);
	}
	return cli_fail(cli, EXIT_CODE_NO_DAEMON,
			"the bus is %s: process data are there from SAFE-OP on (ecdaq state)",
			bus_state_to_str(state));
}

enum exit_code samples_open(struct cli *cli, struct samples *ret_samples)
{
	char path[CONFIG_PATH_BYTES];
	enum exit_code result = cli_path(cli, CONFIG_RUN_SAMPLES, path);
	char problem[PROBLEM_BYTES];
	int r;

	if (result != EXIT_CODE_OK) {
		return result;
	}
	r = open_samples(cli, ret_samples, problem);
	if (problem[0] != '\0') {
		return cli_fail(cli, EXIT_CODE_FAILED, "%s: %s", path, problem);
	}
	if (r == -ENOENT || r == -ENOTDIR) {
		return fail_no_samples(cli, path, -r);
	}
	return r < 0 ? source_fail_open(cli, path, -r) : EXIT_CODE_OK;
}

void samples_close(struct samples *samples)
{
	reader_destroy(samples->reader);
	samples->reader = NULL;
}

struct sample_header samples_header(const struct samples *samples)
{
	return *reader_header(samples->reader);
}

const uint8_t *samples_image(const struct samples *samples)
{
	return reader_image(samples->reader);
}

const char *samples_flag_name(unsigned bit)
{
	static const char *const names[] = { "lost",      "late",     "wkc_low",     "not_op",
					     "fail_safe", "skipped",  "bad_counter", "dc_unlocked",
					     "doubled",   "unchecked" };

	return bit < sizeof(names) / sizeof(names[0]) ? names[bit] : NULL;
}

void samples_flags_format(uint32_t flags, char *buf, size_t buf_len)
{
	size_t used = 0;

	buf[0] = '\0';
	for (unsigned bit = 0; bit < 32 && used < buf_len; bit++) {
		if ((flags >> bit & 1) != 0 && samples_flag_name(bit) != NULL) {
			int n = snprintf(buf + used, buf_len - used, "%s%s", used == 0 ? "" : " ",
					 samples_flag_name(bit));

			used += n < 0 ? 0 : (size_t)n;
		}
	}
}

uint32_t source_slave_count(const struct status_page *page)
{
	return atomic_load_explicit(&page->slave_count, memory_order_relaxed);
}

struct slave_info source_slave(const struct status_page *page, uint32_t index)
{
	return page->slave[index].info;
}

/* "alias:1001" */
static enum exit_code find_alias(const struct cli *cli, const struct status_page *page,
				 const char *text, uint16_t *ret_pos)
{
	const char *number = text + strlen(ALIAS_PREFIX);
	uint32_t count = source_slave_count(page);
	unsigned found = 0;
	uint32_t alias;

	if (hex_number(number, UINT16_MAX, &alias) < 0 || alias == 0) {
		return cli_fail(cli, EXIT_CODE_FAILED, "%s: expected an alias, 1 to 65535", text);
	}
	for (uint32_t i = count; i-- > 0;) {
		if (source_slave(page, i).alias == alias) {
			*ret_pos = (uint16_t)i;
			found++;
		}
	}
	if (found == 0) {
		return cli_fail(cli, EXIT_CODE_FAILED,
				"%s: no slave has this alias (see ecdaq slaves)", text);
	}
	return found == 1 ? EXIT_CODE_OK
			  : cli_fail(cli, EXIT_CODE_FAILED,
				     "%s: %u slaves have this alias: use name or position", text,
				     found);
}

enum exit_code source_find_slave(const struct cli *cli, const struct status_page *page,
				 const char *text, uint16_t *ret_pos)
{
	uint32_t count = source_slave_count(page);
	unsigned long pos;
	char *end;

	for (uint32_t i = 0; i < count; i++) {
		if (strcmp(source_slave(page, i).name, text) == 0) {
			*ret_pos = (uint16_t)i;
			return EXIT_CODE_OK;
		}
	}
	if (strncmp(text, ALIAS_PREFIX, strlen(ALIAS_PREFIX)) == 0) {
		return find_alias(cli, page, text, ret_pos);
	}
	if (strncmp(text, SOURCE_POSITION_PREFIX, strlen(SOURCE_POSITION_PREFIX)) == 0) {
		text += strlen(SOURCE_POSITION_PREFIX);
	}
	if (text[0] == SOURCE_GROUP_MARK) {
		return cli_fail(cli, EXIT_CODE_FAILED,
				"%s: is a group, and one slave is expected here", text);
	}
	errno = 0;
	pos = strtoul(text, &end, 10);
	if (text[0] < '0' || text[0] > '9' || *end != '\0' || errno != 0) {
		return cli_fail(cli, EXIT_CODE_FAILED,
				"%s: no slave of this name (see ecdaq slaves)", text);
	}
	if (pos >= count) {
		return cli_fail(cli, EXIT_CODE_FAILED,
				"%s: no slave at this position, there are %u", text, count);
	}
	*ret_pos = (uint16_t)pos;
	return EXIT_CODE_OK;
}

const char *source_group(const struct status_page *page, uint32_t index,
			 char ret_group[SOURCE_GROUP_BYTES])
{
	snprintf(ret_group, SOURCE_GROUP_BYTES, "%.*s", (int)sizeof(page->slave[index].group) - 1,
		 page->slave[index].group);
	return ret_group;
}

/* NOLINTNEXTLINE(readability-function-size): the interface of source.h */
enum exit_code source_find_slaves(const struct cli *cli, const struct status_page *page,
				  const char *text, uint16_t *ret_pos, unsigned *ret_count)
{
	uint32_t count = source_slave_count(page);
	char group[SOURCE_GROUP_BYTES];
	unsigned found = 0;

	if (text[0] != SOURCE_GROUP_MARK) {
		*ret_count = 1;
		return source_find_slave(cli, page, text, ret_pos);
	}
	for (uint32_t i = 0; i < count; i++) {
		if (text[1] != '\0' && strcmp(source_group(page, i, group), text + 1) == 0) {
			ret_pos[found++] = (uint16_t)i;
		}
	}
	*ret_count = found;
	return found > 0 ? EXIT_CODE_OK
			 : cli_fail(cli, EXIT_CODE_FAILED,
				    "%s: no slave is of this group (slaves[].group)", text);
}

enum exit_code source_slave_pos(struct cli *cli, const char *text, uint16_t *ret_pos)
{
	const struct status_page *page = NULL;
	enum exit_code result = source_status(cli, &page);

	if (result == EXIT_CODE_OK) {
		assert(page != NULL);
		result = source_find_slave(cli, page, text, ret_pos);
		source_status_close(page);
	}
	return result;
}
