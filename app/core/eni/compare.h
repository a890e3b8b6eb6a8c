/* SPDX-License-Identifier: MIT */
/* What one ENI plan has otherwise than another. Context: any. */
#ifndef ENI_COMPARE_H
#define ENI_COMPARE_H

#include <stdint.h>

#include "eni/eni.h"

enum eni_weight {
	ENI_DIFFERENT,   /* the bus would not do the same */
	ENI_WRONG_SLAVE, /* the same, for a slave is missing or another one */
	ENI_ALLOWED,     /* another layout or name of the same; what a master decides itself */
};

enum { ENI_TEXT_BYTES = 160 };

struct eni_difference {
	enum eni_weight weight;
	uint32_t slave; /* or ENI_MASTER */
	char what[ENI_TEXT_BYTES];
	char theirs[ENI_TEXT_BYTES];
	char ours[ENI_TEXT_BYTES];
};

struct eni_compare {
	const struct eni *theirs;
	const struct eni *ours;
	void (*found)(void *ctx, const struct eni_difference *difference);
	void *ctx;
};

/** Call found() for each. */
void eni_compare_all(const struct eni_compare *c);

/* --- the files of eni/ --- */

/** Report it. @what is copied. */
void eni_differ(const struct eni_compare *c, enum eni_weight weight, uint32_t slave,
		const char *what, const char *theirs, const char *ours);
enum eni_base { ENI_DECIMAL, ENI_HEX, ENI_SIGN };
struct eni_pair {
	uint32_t theirs;
	uint32_t ours;
};
/** Report two numbers if they differ. */
void eni_differ_numbers(const struct eni_compare *c, enum eni_weight weight, uint32_t slave,
			const char *what, struct eni_pair pair, enum eni_base base);
/** Slave @slave, which both have. */
void eni_compare_slave(const struct eni_compare *c, uint32_t slave);
/** Cycle time and cyclic frames. */
void eni_compare_frames(const struct eni_compare *c);

#endif
