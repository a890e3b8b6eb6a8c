/* SPDX-License-Identifier: MIT */
/*
 * Status pages, read as private copies: what another process does to the file afterwards changes
 * nothing. All texts of a copy end in zero and no count in it exceeds its array. Context: blocks
 * only as file reads on a tmpfs do.
 */
#ifndef READER_PAGE_H
#define READER_PAGE_H

#include "base/status.h"
#include "base/sync0.h"

/** 0; -ENOENT, -EACCES, ...; -EPROTO: another version, or not such a page (ret undefined). */
int page_read_status(const char *path, struct status_page *ret_page);
int page_read_record(const char *path, struct record_status *ret_page);
int page_read_dds(const char *path, struct dds_status *ret_page);
int page_read_stream(const char *path, struct stream_status *ret_page);
int page_read_uplink(const char *path, struct uplink_status *ret_page);
int page_read_sync0(const char *path, struct sync0_status *ret_page);

/** 1 if the process with @pid, the writer of a page, is still there. */
int page_is_alive(int64_t pid);

#endif
