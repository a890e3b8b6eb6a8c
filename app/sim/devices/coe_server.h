/* SPDX-License-Identifier: MIT */
/*
 * SDO services over a CoE dictionary (ETG.1000.6): upload (expedited, normal, segmented, complete
 * access), download (expedited, normal, segmented; complete access of an assignment); SDO
 * information (coe_information.h). A device may have a memory, object 0x2F00:01, that holds up to 1
 * MiB.
 */
#ifndef SIM_DEVICES_COE_SERVER_H
#define SIM_DEVICES_COE_SERVER_H

#include "devices/coe_dictionary.h"

enum {
	COE_UPLOAD_BYTES = 2048,
	COE_MEMORY_INDEX = 0x2f00,
	COE_MEMORY_SUBINDEX = 1,
	COE_MEMORY_BYTES = 1 << 20,
};

struct coe_server {
	struct coe_dictionary dictionary;
	uint8_t *memory; /* COE_MEMORY_BYTES; NULL: there is no such object */
	size_t memory_len;
	/* A segmented upload that goes on. */
	uint8_t upload[COE_UPLOAD_BYTES];
	const uint8_t *source; /* upload or memory */
	size_t upload_len;
	size_t upload_pos;
	uint8_t toggle;
	/* A segmented download that goes on. */
	uint8_t download[COE_UPLOAD_BYTES];
	uint8_t *target; /* download or memory; NULL: none goes on */
	size_t download_len;
	size_t download_pos;
	uint8_t download_command;
	uint16_t index; /* of the transfer begun last */
	uint8_t subindex;
	unsigned downloads; /* executed */
};

/** What the transfer begun last is answered with, when it is to fail in the middle. */
size_t coe_server_abort(struct coe_server *server, uint8_t *answer);
/** "memory": it has one of so many bytes, of a pattern. 0; -EINVAL. */
int coe_server_set(struct coe_server *server, const char *key, const char *value);
void coe_server_done(struct coe_server *server);

/**
 * Answer one CoE service: @request and @answer are mailbox data without the mailbox header. Returns
 * the answer's length; 0: nothing is answered (a damaged request).
 */
size_t coe_server_answer(struct coe_server *server, const uint8_t *request, size_t request_len,
			 uint8_t *answer, size_t capacity);

#endif
