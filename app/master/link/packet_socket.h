/* SPDX-License-Identifier: MIT */
/*
 * A real NIC: a packet socket bound to EtherCAT's type, with a ring of received frames. Receiving
 * never blocks past the caller's deadline: it looks at the ring without sleeping (spin), or sleeps
 * in ppoll for the time left. A cable pulled or a NIC taken down costs lost frames only; is_up()
 * binds again when the interface was removed and came back.
 */
#ifndef LINK_PACKET_SOCKET_H
#define LINK_PACKET_SOCKET_H

#include <stddef.h>

#include "base/platform.h"

enum packet_wait {
	PACKET_WAIT_AUTO, /* spin when more than two CPUs are online, else sleep */
	PACKET_WAIT_SPIN,
	PACKET_WAIT_SLEEP,
};

enum { PACKET_ERROR_BYTES = 256 };

/**
 * Open @interface. 0; or -errno and one line in @error: -ENODEV no such NIC (@error lists those
 * present), -EPERM (@error names the missing right), another. With 0, @error holds a warning (link
 * down) or is empty. Nothing is allocated afterwards. Context: blocking.
 */
int packet_socket_open(const char *interface, enum packet_wait wait,
		       struct transport *ret_transport, char *error, size_t error_bytes);

#endif
