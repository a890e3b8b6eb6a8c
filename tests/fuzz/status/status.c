/* SPDX-License-Identifier: MIT */
/*
 * Status pages as another process may leave them: the input picks one of four (first byte), the
 * rest is written over a page that is right, from a place (3 bytes) on, before it is read.
 */
#include <assert.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "reader/page.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#define IS_TEXT(field) assert(strnlen(field, sizeof(field)) < sizeof(field))

static char path[64];

static void make(uint64_t magic, uint32_t bytes, const uint8_t *data, size_t size)
{
	size_t place =
		size < 3 ? 0 : (size_t)(data[0] << 16 | data[1] << 8 | data[2]) % (bytes + 8);
	void *page = status_create(path, magic, bytes, 0600);
	int fd = open(path, O_WRONLY | O_CLOEXEC);

	assert(page != NULL && fd >= 0);
	if (size > 3) {
		assert(pwrite(fd, data + 3, size - 3, (off_t)place) >= 0);
	}
	close(fd);
	status_unmap(page, bytes);
}

static void read_status(const uint8_t *data, size_t size)
{
	static struct status_page page;

	make(STATUS_MAGIC, sizeof(page), data, size);
	if (page_read_status(path, &page) < 0) {
		return;
	}
	IS_TEXT(page.version);
	IS_TEXT(page.interface);
	IS_TEXT(page.message);
	IS_TEXT(page.control.path);
	assert(page.slave_count <= LIMIT_SLAVES);
	for (uint32_t i = 0; i < LIMIT_SLAVES; i++) {
		IS_TEXT(page.slave[i].info.name);
		IS_TEXT(page.slave[i].info.device);
	}
	bus_state_to_str(page.bus_state);
	control_state_to_str(page.control.state);
	dc_state_to_str(page.cycle.dc_state);
	histogram_percentile(&page.cycle.wake_latency, 999000);
}

static void read_others(unsigned which, const uint8_t *data, size_t size)
{
	static struct sync0_status sync0;
	struct record_status record;
	struct dds_status dds;

	if (which == 1) {
		make(RECORD_STATUS_MAGIC, sizeof(record), data, size);
		if (page_read_record(path, &record) == 0) {
			IS_TEXT(record.path);
			IS_TEXT(record.message);
			record_state_to_str(record.state);
		}
	} else if (which == 2) {
		make(DDS_STATUS_MAGIC, sizeof(dds), data, size);
		if (page_read_dds(path, &dds) == 0) {
			IS_TEXT(dds.interface);
			IS_TEXT(dds.tag);
		}
	} else {
		make(SYNC0_STATUS_MAGIC, sizeof(sync0), data, size);
		if (page_read_sync0(path, &sync0) == 0) {
			assert(sync0.line_count <= LIMIT_SYNC0_LINES);
			for (uint32_t i = 0; i < LIMIT_SYNC0_LINES; i++) {
				IS_TEXT(sync0.line[i].slave);
				IS_TEXT(sync0.line[i].line);
			}
		}
	}
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	snprintf(path, sizeof(path), "/dev/shm/ecdaq-fuzz-status-%d", (int)getpid());
	if (size == 0) {
		return 0;
	}
	if (data[0] % 4 == 0) {
		read_status(data + 1, size - 1);
	} else {
		read_others(data[0] % 4, data + 1, size - 1);
	}
	unlink(path);
	return 0;
}
