/* SPDX-License-Identifier: MIT */
/* A slave's AoE server (ETG.1020): the objects of its CoE dictionary, as index group 0xF302. */
#ifndef SIM_DEVICES_AOE_SERVER_H
#define SIM_DEVICES_AOE_SERVER_H

#include "devices/mailbox.h"

/** A mailbox_server's answer() with the struct coe_dictionary as context. */
size_t aoe_server_answer(void *ctx, const struct mailbox_call *call);

#endif
