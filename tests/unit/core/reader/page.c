/* SPDX-License-Identifier: MIT */
#include "reader/page.h"

#include <errno.h>
#include <string.h>
#include <unistd.h>

#include "harness/made_ring.h"
#include "harness/test.h"

static struct status_page copy;

static struct status_page *make(const char *path)
{
	struct status_page *page = status_create(path, STATUS_MAGIC, sizeof(*page), 0600);

	CHECK(page != NULL);
	return page;
}

TEST(page, a_copy_has_what_the_page_had)
{
	const char *path = made_path("page");
	struct status_page *page = make(path);

	CHECK_EQ(page_read_status("/nonexistent/status", &copy), -ENOENT);
	page->pid = 77;
	page->slave_count = 3;
	status_text_set(&page->text_sequence, page->message, sizeof(page->message), "no link");
	CHECK_EQ(page_read_status(path, &copy), 0);
	page->pid = 78;
	CHECK_EQ(copy.pid, 77);
	CHECK_EQ(copy.slave_count, 3);
	CHECK_STR(copy.message, "no link");
	status_unmap(page, sizeof(*page));
	unlink(path);
}

TEST(page, texts_of_a_copy_end_and_counts_fit_whatever_the_page_has)
{
	const char *path = made_path("page");
	struct status_page *page = make(path);

	memset((char *)page + 12, 'x', sizeof(*page) - 12);
	CHECK_EQ(page_read_status(path, &copy), 0);
	CHECK_EQ(strlen(copy.version), sizeof(copy.version) - 1);
	CHECK_EQ(strlen(copy.interface), sizeof(copy.interface) - 1);
	CHECK_EQ(strlen(copy.message), sizeof(copy.message) - 1);
	CHECK_EQ(strlen(copy.control.name), sizeof(copy.control.name) - 1);
	CHECK_EQ(strlen(copy.control.path), sizeof(copy.control.path) - 1);
	CHECK_EQ(strlen(copy.slave[63].info.name), sizeof(copy.slave[63].info.name) - 1);
	CHECK_EQ(strlen(copy.slave[0].info.device), sizeof(copy.slave[0].info.device) - 1);
	CHECK_EQ(copy.slave_count, LIMIT_SLAVES);
	status_unmap(page, sizeof(*page));
	unlink(path);
}

TEST(page, texts_of_the_other_programs_pages_end_too)
{
	const char *path = made_path("page");
	static struct sync0_status sync0;
	struct record_status record;
	struct dds_status dds;
	void *page;

	page = status_create(path, RECORD_STATUS_MAGIC, sizeof(record), 0600);
	memset((char *)page + 12, 'x', sizeof(record) - 12);
	CHECK_EQ(page_read_record(path, &record), 0);
	CHECK_EQ(strlen(record.path), sizeof(record.path) - 1);
	CHECK_EQ(strlen(record.message), sizeof(record.message) - 1);
	status_unmap(page, sizeof(record));
	page = status_create(path, DDS_STATUS_MAGIC, sizeof(dds), 0600);
	memset((char *)page + 12, 'x', sizeof(dds) - 12);
	CHECK_EQ(page_read_dds(path, &dds), 0);
	CHECK_EQ(strlen(dds.interface), sizeof(dds.interface) - 1);
	CHECK_EQ(strlen(dds.tag), sizeof(dds.tag) - 1);
	CHECK_EQ(page_read_record(path, &record), -EPROTO);
	status_unmap(page, sizeof(dds));
	page = status_create(path, SYNC0_STATUS_MAGIC, sizeof(sync0), 0600);
	memset((char *)page + 12, 'x', sizeof(sync0) - 12);
	CHECK_EQ(page_read_sync0(path, &sync0), 0);
	CHECK_EQ(strlen(sync0.message), sizeof(sync0.message) - 1);
	CHECK_EQ(strlen(sync0.line[LIMIT_SYNC0_LINES - 1].slave),
		 sizeof(sync0.line[LIMIT_SYNC0_LINES - 1].slave) - 1);
	CHECK_EQ(strlen(sync0.line[LIMIT_SYNC0_LINES - 1].line),
		 sizeof(sync0.line[LIMIT_SYNC0_LINES - 1].line) - 1);
	CHECK_EQ(sync0.line_count, LIMIT_SYNC0_LINES);
	status_unmap(page, sizeof(sync0));
	unlink(path);
}

TEST(page, a_page_of_another_length_or_version_is_refused)
{
	const char *path = made_path("page");
	struct status_page *page = make(path);
	uint32_t bytes = sizeof(*page) - 8;

	made_overwrite(path, 8, &bytes, sizeof(bytes));
	CHECK_EQ(page_read_status(path, &copy), -EPROTO);
	bytes = sizeof(*page);
	made_overwrite(path, 8, &bytes, sizeof(bytes));
	CHECK_EQ(page_read_status(path, &copy), 0);
	made_overwrite(path, 0, "damaged", 7);
	CHECK_EQ(page_read_status(path, &copy), -EPROTO);
	status_unmap(page, sizeof(*page));
	for (off_t length = sizeof(*page) - 1; length > 0; length /= 7) {
		made_truncate(path, length);
		CHECK_EQ(page_read_status(path, &copy), -EPROTO);
	}
	unlink(path);
	CHECK_EQ(page_read_status("/dev", &copy), -EPROTO);
}

TEST(page, a_writer_that_died_inside_a_text_does_not_hide_its_page)
{
	const char *path = made_path("page");
	struct status_page *page = make(path);

	page->pid = 5;
	page->text_sequence = 7;
	CHECK_EQ(page_read_status(path, &copy), 0);
	CHECK_EQ(copy.pid, 5);
	status_unmap(page, sizeof(*page));
	unlink(path);
}

TEST(status, a_state_that_is_not_known_has_a_name_too)
{
	static const uint32_t unknown[] = { 9, 10, 20, 64, 1000, UINT32_MAX };

	for (size_t i = 0; i < sizeof(unknown) / sizeof(unknown[0]); i++) {
		CHECK_STR(bus_state_to_str(unknown[i]), "unknown");
		CHECK_STR(dc_state_to_str(unknown[i]), "unknown");
		CHECK_STR(record_state_to_str(unknown[i]), "unknown");
		CHECK_STR(control_state_to_str(unknown[i]), "unknown");
	}
	CHECK_STR(control_state_to_str(CONTROL_STUCK), "stuck");
	CHECK_STR(bus_state_to_str(BUS_FAILED), "FAILED");
	CHECK_STR(dc_state_to_str(DC_LOST), "lost");
	CHECK_STR(record_state_to_str(RECORD_FAILED), "failed");
}
