/* SPDX-License-Identifier: MIT */
/* The start-up SDOs of a slave, as ecdaqd writes them. Context: blocking. */
#ifndef CLI_STARTUP_LIST_H
#define CLI_STARTUP_LIST_H

#include <stddef.h>
#include <stdint.h>

#include "base/startup_record.h"
#include "cli/admin_client.h"
#include "program/json.h"

struct startup_list {
	struct admin_request request;
	struct admin_transfer transfer; /* reply.text: the configuration's file */
	size_t next;                    /* byte of the answer */
};

/** Those of the slave at @pos, also where the result is a failure to be ended with
 * startup_list_done(). A failure has been reported. */
enum exit_code startup_list_read(struct cli *cli, uint16_t pos, struct startup_list *ret_list);
/** 1 with the next one and its data; 0 at the end, or where the answer is not whole. */
int startup_list_next(struct startup_list *list, struct startup_record *ret_record,
		      const uint8_t **ret_data);
void startup_list_done(struct startup_list *list);

/** "slaves[].sdo", "slaves[].pdos", "slaves[].mode", "ESI"; "?" for any other number. */
const char *startup_origin_to_str(uint8_t origin);

/** Show those of the slave at @pos: a line each, or with @js as an array of it. */
enum exit_code startup_list_show(struct cli *cli, uint16_t pos, struct json *js);

#endif
