/* SPDX-License-Identifier: MIT */
/* A TAP device of the host: Ethernet frames as they are. Context: any; only tap_open() blocks. */
#ifndef NETWORK_TAP_H
#define NETWORK_TAP_H

#include <stddef.h>
#include <stdint.h>

/**
 * Open the TAP device @name, or create it, which needs CAP_NET_ADMIN and lasts as long as the
 * descriptor. The descriptor does not block. 0 or -errno with one line in @error, without the name
 * of the option.
 */
int tap_open(const char *name, int *ret_fd, char *error, size_t error_bytes);
/** The next frame: its length, at most @capacity: what is longer is cut; -EAGAIN: none. */
int tap_read(int fd, uint8_t *frame, size_t capacity);
/** 0; -errno: it is lost (-EIO: the interface is down). */
int tap_write(int fd, const uint8_t *frame, size_t len);

#endif
