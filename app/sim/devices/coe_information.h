/* SPDX-License-Identifier: MIT */
/*
 * SDO information over a CoE dictionary (ETG.1000.6): the list of all objects, what an object is,
 * what one of its entries is. A dictionary without texts refuses all of it.
 */
#ifndef SIM_DEVICES_COE_INFORMATION_H
#define SIM_DEVICES_COE_INFORMATION_H

#include "devices/coe_dictionary.h"

/**
 * Answer one SDO information service: @request and @answer begin with the CoE header, @capacity is
 * 10 at least. Returns the answer's length; 0: a damaged request.
 */
size_t coe_information_answer(const struct coe_dictionary *d, const uint8_t *request,
			      size_t request_len, uint8_t *answer, size_t capacity);

#endif
