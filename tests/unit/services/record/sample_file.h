/* SPDX-License-Identifier: MIT */
/* A small recording in memory: two channels, chunks of a few messages, metadata and an attachment.
 */
#ifndef TESTS_UNIT_RECORD_SAMPLE_FILE_H
#define TESTS_UNIT_RECORD_SAMPLE_FILE_H

#include "record/mcap_writer.h"
#include "unit/services/record/memory_file.h"

enum { SAMPLE_CHUNKS = 5, SAMPLE_CHUNK_MESSAGES = 6 };

/** Begin the file: header, schema, channels 0 and 1, metadata. CHECKs that all went well. */
struct mcap_writer *sample_file_begin(struct memory_file *f, int zstd_level);
/** Message number @n, on channel n % 2. 0 or -errno. */
int sample_file_message(struct mcap_writer *w, unsigned n);
/** The whole file, finished; or up to the end of its chunks. */
void sample_file_make(struct memory_file *f, int zstd_level);

/** What a reader finds in the first @len bytes. */
struct sample_findings {
	unsigned chunks;
	unsigned messages; /* in order and with the right content, CHECKed */
	unsigned damage;
	unsigned metadata;
	unsigned attachments;
	int has_data_end;
	int result; /* of the reader: 0 or -errno */
};

struct sample_findings sample_file_read(struct memory_file *f, size_t len);

/** All that is whole in @f as a new file, CHECKed to be whole. 0, or -errno if @f is none. */
int sample_file_recover(struct memory_file *f, struct memory_file *ret_copy);

#endif
