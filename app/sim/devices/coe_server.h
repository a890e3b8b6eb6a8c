/* SPDX-License-Identifier: MIT */
/*
 * SDO services over a CoE dictionary (ETG.1000.6): upload (expedited, normal, segmented, complete
 * access), download (expedited, normal; complete access of an assignment); SDO information
 * (coe_information.h).
 */
#ifndef SIM_DEVICES_COE_SERVER_H
#define SIM_DEVICES_COE_SERVER_H

#include "devices/coe_dictionary.h"

enum { COE_UPLOAD_BYTES = 2048 };

struct coe_server {
	struct coe_dictionary dictionary;
	/* A segmented upload that goes on. */
	uint8_t upload[COE_UPLOAD_BYTES];
	size_t upload_len;
	size_t upload_pos;
	uint8_t toggle;
};

/**
 * Answer one CoE service: @request and @answer are mailbox data without the mailbox header. Returns
 * the answer's length; 0: nothing is answered (a damaged request).
 */
size_t coe_server_answer(struct coe_server *server, const uint8_t *request, size_t request_len,
			 uint8_t *answer, size_t capacity);

#endif
