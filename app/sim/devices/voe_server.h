/* SPDX-License-Identifier: MIT */
/* A slave's VoE server: it sends back what it gets. */
#ifndef SIM_DEVICES_VOE_SERVER_H
#define SIM_DEVICES_VOE_SERVER_H

#include "devices/mailbox.h"

/** A mailbox_server's answer(); no context. */
size_t voe_server_answer(void *ctx, const struct mailbox_call *call);

#endif
