/* SPDX-License-Identifier: MIT */
/*
 * Values in the process image, through their channel: raw bits, typed numbers, physical numbers. A
 * channel's bits must lie inside the image (image_channel_fits); the rest assumes it. Context: any,
 * RT-safe.
 */
#ifndef IMAGE_IMAGE_H
#define IMAGE_IMAGE_H

#include <stddef.h>
#include <stdint.h>

#include "base/sample.h"

/** 1 if the channel's type, width and place are sound for an image of @image_bytes. */
int image_channel_fits(const struct channel *ch, size_t image_bytes);

/** The channel's bits, zero-extended to 64; and back. */
uint64_t image_get_raw(const uint8_t *image, const struct channel *ch);
void image_set_raw(uint8_t *image, const struct channel *ch, uint64_t raw);

/** Raw bits as a number of the channel's type, times scale plus offset. */
double image_raw_to_physical(const struct channel *ch, uint64_t raw);
double image_get_physical(const uint8_t *image, const struct channel *ch);
/** 1 if physical and raw numbers differ: there is a scale or an offset. */
int image_is_scaled(const struct channel *ch);

/** 1 if the channel has a plausible range and @physical is not within it. */
int image_is_outside(const struct channel *ch, double physical);
/** 1 if the channel has a plausible range: one bound at least. */
int image_has_range(const struct channel *ch);

/**
 * The raw bits for @physical, rounded to nearest. 0; -ERANGE if the type cannot hold it; -EINVAL
 * for a NaN, and for a BOOL that is neither 0 nor 1 (as raw): it is neither rounded nor limited
 * (ret untouched on failure).
 */
int image_physical_to_raw(const struct channel *ch, double physical, uint64_t *ret_raw);

/** Raw bits as text: decimal for integers (exact at 64 bits), shortest round trip for floats. */
int image_raw_format(const struct channel *ch, uint64_t raw, char *buf, size_t buf_len);
/**
 * Raw bits from text as a person writes it: decimal, 0x hex, true/false/on/off for BOOL, a float.
 * Raw counts, not physical. 0, -EINVAL, -ERANGE (ret untouched on failure).
 */
int image_raw_parse(const struct channel *ch, const char *text, uint64_t *ret_raw);

/** Index of the channel named @name; -ENOENT. */
int image_channel_find(const struct channel *channels, size_t count, const char *name);

/** "BOOL", "UINT16", "INT5", "FLOAT64". Returns length as snprintf does. */
int image_type_format(const struct channel *ch, char *buf, size_t buf_len);

#endif
