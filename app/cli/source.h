/* SPDX-License-Identifier: MIT */
/*
 * Where the reading verbs read: status pages and rings of the run directory, by core/reader.
 * Failures are reported (cli_fail).
 */
#ifndef CLI_SOURCE_H
#define CLI_SOURCE_H

#include <stddef.h>
#include <stdint.h>

#include "base/sample.h"
#include "base/status.h"
#include "cli/cli.h"
#include "reader/reader.h"

/** Report why @path in the run directory cannot be read: errno @err. */
enum exit_code source_fail_open(const struct cli *cli, const char *path, int err);

/** A copy of ecdaqd's status page. EXIT_CODE_OK, or the code of a failure, which has been reported.
 */
enum exit_code source_status(struct cli *cli, const struct status_page **ret_page);
/** The same without a message; 0 or -errno. */
int source_try_status(struct cli *cli, const struct status_page **ret_page);
/** A newer copy in place of *@page. 0: *@page stays: there is none, or it is that of another
 * ecdaqd. */
int source_refresh_status(struct cli *cli, const struct status_page **page);
/** The recorder's page, or NULL: it may not have been started. Reports nothing. */
const struct record_status *source_record(struct cli *cli);
/** The same of ecdaq-dds. */
const struct dds_status *source_dds(struct cli *cli);
/** The same of ecdaq-stream. */
const struct stream_status *source_stream(struct cli *cli);
/** The same of ecdaq-uplink. */
const struct uplink_status *source_uplink(struct cli *cli);
void source_status_close(const struct status_page *page);
void source_record_close(const struct record_status *record);
void source_dds_close(const struct dds_status *dds);
void source_stream_close(const struct stream_status *stream);
void source_uplink_close(const struct uplink_status *uplink);

/* The sample ring with its own description. */
struct samples {
	struct reader *reader;
	const struct channel_table *table;
	const struct sample_meta *meta; /* of the table, as the others */
	const struct slave_info *slaves;
	const struct channel *channels;
};

/** EXIT_CODE_OK, or the code of a failure, which has been reported. Release with samples_close().
 */
enum exit_code samples_open(struct cli *cli, struct samples *ret_samples);
/** The same without a message; 0 or -errno. */
int samples_try(struct cli *cli, struct samples *ret_samples);
void samples_close(struct samples *samples);
/** Take the table of the session that the reader has begun. */
void samples_take_table(struct samples *samples);

/** Header and image of the slot that was read last. */
struct sample_header samples_header(const struct samples *samples);
const uint8_t *samples_image(const struct samples *samples);

/** The words of @flags, "lost late", separated by blanks. */
void samples_flags_format(uint32_t flags, char *buf, size_t buf_len);
/** The word of bit @bit; NULL for one that has none. */
const char *samples_flag_name(unsigned bit);

/** The n-th slave of the status page, copied, its texts terminated. */
struct slave_info source_slave(const struct status_page *page, uint32_t index);
uint32_t source_slave_count(const struct status_page *page);

/* Before a position that is not to be taken for a name. */
#define SOURCE_POSITION_PREFIX "position:"

/** The position that @text names, "piccolo0", "1", "position:1" or "alias:1001", or the code of a
 * failure, reported. */
enum exit_code source_find_slave(const struct cli *cli, const struct status_page *page,
				 const char *text, uint16_t *ret_pos);
enum { SOURCE_GROUP_BYTES = 33, SOURCE_GROUP_MARK = '@' };

/** The group of a slave, into @ret_group; "": none. */
const char *source_group(const struct status_page *page, uint32_t index,
			 char ret_group[SOURCE_GROUP_BYTES]);
/** The slaves that @text means: all of "@GROUP", else one. @ret_pos has room for LIMIT_SLAVES. */
enum exit_code source_find_slaves(const struct cli *cli, const struct status_page *page,
				  const char *text, uint16_t *ret_pos, unsigned *ret_count);
/** source_find_slave() of the status page as it is now. */
enum exit_code source_slave_pos(struct cli *cli, const char *text, uint16_t *ret_pos);

#endif
