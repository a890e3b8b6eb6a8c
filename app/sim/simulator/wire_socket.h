/* SPDX-License-Identifier: MIT */
/* The segment's end of a real Ethernet wire: frames in, frames out, on the host's clock. */
#ifndef SIM_SIMULATOR_WIRE_SOCKET_H
#define SIM_SIMULATOR_WIRE_SOCKET_H

#include <stddef.h>
#include <stdint.h>

/** A packet socket on @interface, type 0x88A4, without own outgoing frames. The fd or -errno with
 * one line in @error. */
int wire_socket_open(const char *interface, char *error, size_t error_bytes);

/**
 * Wait up to @timeout_ns for a frame. Its length, 0 for none, -errno. @ret_t_ns is CLOCK_MONOTONIC
 * at which the kernel took it in, as near as is to be had.
 */
int wire_socket_receive(int fd, uint8_t *frame, size_t capacity, int64_t timeout_ns,
			int64_t *ret_t_ns);

/**
 * Be the only segment at @interface of this network namespace, until the descriptor is closed or
 * the process ends: two of them would answer every frame twice. The descriptor, or -errno with one
 * line in @error (-EADDRINUSE: there is one).
 */
int wire_socket_claim(const char *interface, char *error, size_t error_bytes);

int64_t wire_socket_now_ns(void);

#endif
