/* SPDX-License-Identifier: MIT */
/*
 * The admin socket: SOCK_SEQPACKET, up to ADMIN_CLIENTS of them, driven from the service thread by
 * polling; it never waits, neither for a client nor for a request. The socket's mode and group
 * decide who may connect.
 */
#ifndef ADMIN_SERVER_H
#define ADMIN_SERVER_H

#include <stddef.h>
#include <sys/types.h>

#include "admin/command.h"
#include "base/clock.h"

/* Clients, and open requests of all of them. */
enum { ADMIN_CLIENTS = 16, ADMIN_PENDING = 64 };

struct admin_server;

/**
 * Listen at @path, mode 0660; a socket left by an earlier run is replaced. @group (gid_t)-1: leave.
 * 0 or -errno with one line in @error. Free with admin_server_destroy(). Context: blocking.
 */
int admin_server_create(const char *path, gid_t group, struct admin_server **ret_server,
			char *error, size_t error_bytes);
/**
 * Give the board behind @board_fd (kept by the caller) to whoever connects to the socket at @path,
 * of the same mode: who may write outputs of owner remote need not reach the admin socket. 0 or
 * -errno with one line in @error. Context: blocking.
 */
int admin_server_offer_board(struct admin_server *server, const char *path, gid_t group,
			     int board_fd, char *error, size_t error_bytes);
/** Closes all clients and removes the sockets. NULL is fine. */
void admin_server_destroy(struct admin_server *server);

/** A descriptor that polls readable when admin_server_service() has something to do. */
int admin_server_fd(const struct admin_server *server);

/** Nobody has polled readable since the last pass: the next one asks no socket. */
void admin_server_note_silence(struct admin_server *server);

/**
 * One pass: new clients, requests, answers that have become due at @now. Returns how many requests
 * are open. Context: service thread.
 */
unsigned admin_server_service(struct admin_server *server, const struct admin_target *target,
			      mono_t now);

/**
 * Cancel every open request but those that outlive the bus, which is about to go. An executor that
 * cannot complete a request in its cancel() must do so before that.
 */
void admin_server_cancel_all(struct admin_server *server);

#endif
