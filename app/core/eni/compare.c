/* SPDX-License-Identifier: MIT */
#include "eni/compare.h"

#include <inttypes.h>
#include <string.h>

#include "eni/fields.h"

void eni_differ(const struct eni_compare *c, enum eni_weight weight, uint32_t slave,
		const char *what, const char *theirs, const char *ours)
{
	struct eni_difference difference = { .weight = weight, .slave = slave };

	snprintf(difference.what, sizeof(difference.what), "%.*s", ENI_TEXT_BYTES - 1, what);
	snprintf(difference.theirs, sizeof(difference.theirs), "%.*s", ENI_TEXT_BYTES - 1, theirs);
	snprintf(difference.ours, sizeof(difference.ours), "%.*s", ENI_TEXT_BYTES - 1, ours);
	c->found(c->ctx, &difference);
}

static void format(uint32_t value, enum eni_base base, char text[24])
{
	if (base == ENI_HEX) {
		snprintf(text, 24, "0x%04" PRIx32, value);
	} else if (base == ENI_SIGN) {
		snprintf(text, 24, "%" PRId32, (int32_t)value);
	} else {
		snprintf(text, 24, "%" PRIu32, value);
	}
}

void eni_differ_numbers(const struct eni_compare *c, enum eni_weight weight, uint32_t slave,
			const char *what, struct eni_pair pair, enum eni_base base)
{
	char theirs[24];
	char ours[24];

	if (pair.theirs != pair.ours) {
		format(pair.theirs, base, theirs);
		format(pair.ours, base, ours);
		eni_differ(c, weight, slave, what, theirs, ours);
	}
}

static int is_same_device(const struct eni_info *a, const struct eni_info *b)
{
	return a->vendor == b->vendor && a->product == b->product;
}

/* Where the other one has the device; -1: nowhere. */
static int64_t find_device(const struct eni *eni, const struct eni_info *info)
{
	for (size_t i = 0; i < eni->slave_count; i++) {
		if (is_same_device(&eni->slave[i].info, info)) {
			return (int64_t)i;
		}
	}
	return -1;
}

static void compare_missing(const struct eni_compare *c, uint32_t slave)
{
	int is_theirs = slave < c->theirs->slave_count;
	const struct eni_info *info =
		is_theirs ? &c->theirs->slave[slave].info : &c->ours->slave[slave].info;
	char text[ENI_TEXT_BYTES];

	snprintf(text, sizeof(text), "%s 0x%08" PRIx32 " 0x%08" PRIx32, info->name, info->vendor,
		 info->product);
	eni_differ(c, ENI_WRONG_SLAVE, slave, "slave", is_theirs ? text : "none",
		   is_theirs ? "none" : text);
}

/* 1 if both have the same device at @slave. */
static int compare_identity(const struct eni_compare *c, uint32_t slave)
{
	const struct eni_info *theirs = &c->theirs->slave[slave].info;
	const struct eni_info *ours = &c->ours->slave[slave].info;
	int64_t elsewhere = find_device(c->ours, theirs);
	char what[ENI_TEXT_BYTES] = "product";

	if (!is_same_device(theirs, ours) && elsewhere >= 0) {
		snprintf(what, sizeof(what), "product (that device is at position %" PRId64 ")",
			 elsewhere);
	}
	eni_differ_numbers(c, ENI_WRONG_SLAVE, slave, "vendor",
			   (struct eni_pair){ theirs->vendor, ours->vendor }, ENI_HEX);
	eni_differ_numbers(c, ENI_WRONG_SLAVE, slave, what,
			   (struct eni_pair){ theirs->product, ours->product }, ENI_HEX);
	if ((theirs->has & ENI_HAS(ENI_INFO_REVISION)) != 0) {
		eni_differ_numbers(c, ENI_WRONG_SLAVE, slave, "revision",
				   (struct eni_pair){ theirs->revision, ours->revision }, ENI_HEX);
	}
	if (theirs->serial != 0) {
		eni_differ_numbers(c, ENI_WRONG_SLAVE, slave, "serial number",
				   (struct eni_pair){ theirs->serial, ours->serial }, ENI_DECIMAL);
	}
	if ((theirs->has & ENI_HAS(ENI_INFO_PHYS_ADDR)) != 0) {
		eni_differ_numbers(c, ENI_ALLOWED, slave, "station address",
				   (struct eni_pair){ theirs->phys_addr, ours->phys_addr },
				   ENI_HEX);
	}
	if (strcmp(theirs->name, ours->name) != 0) {
		eni_differ(c, ENI_ALLOWED, slave, "name", theirs->name, ours->name);
	}
	return is_same_device(theirs, ours);
}

void eni_compare_all(const struct eni_compare *c)
{
	size_t count = c->theirs->slave_count > c->ours->slave_count ? c->theirs->slave_count
								     : c->ours->slave_count;

	for (uint32_t i = 0; i < count; i++) {
		if (i >= c->theirs->slave_count || i >= c->ours->slave_count) {
			compare_missing(c, i);
		} else if (compare_identity(c, i)) {
			eni_compare_slave(c, i);
		}
	}
	eni_compare_frames(c);
}
