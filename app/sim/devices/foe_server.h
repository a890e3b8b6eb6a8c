/* SPDX-License-Identifier: MIT */
/*
 * A slave's FoE server (ETG.1000.6 part 5.8) with a small file store. What it does wrong on request
 * (busy for so many answers or for ever, an error in the middle) is for tests of masters.
 */
#ifndef SIM_DEVICES_FOE_SERVER_H
#define SIM_DEVICES_FOE_SERVER_H

#include "devices/mailbox.h"

enum foe_server_limits {
	FOE_SERVER_FILES = 4,
	FOE_SERVER_NAME_BYTES = 64,
	FOE_SERVER_FILE_BYTES = 4 << 20,
	FOE_SERVER_BUSY_FOREVER = -1,
};

struct foe_file {
	char name[FOE_SERVER_NAME_BYTES]; /* "": the place is free */
	uint8_t *bytes;                   /* malloc() */
	size_t len;
};

enum foe_transfer { FOE_TRANSFER_NONE, FOE_TRANSFER_READ, FOE_TRANSFER_WRITE };

struct foe_server {
	/* Set by the device. */
	uint32_t password; /* 0: none is asked for */
	int busy;          /* BUSY answers before each packet is taken or given */
	unsigned fail_at;  /* packet that is answered with an error; 0: none */

	struct foe_file file[FOE_SERVER_FILES];
	enum foe_transfer transfer;
	struct foe_file incoming; /* of a write that goes on */
	const struct foe_file *outgoing;
	uint32_t packet;  /* the last one taken or given */
	size_t pos;       /* bytes given in packets before that one */
	size_t given;     /* data bytes of that one */
	int busy_left;    /* before the next */
	uint8_t has_full; /* the last packet given was full: another follows */
};

/** One FoE request; a mailbox_server's answer() with the server as context. */
size_t foe_server_answer(void *ctx, const struct mailbox_call *call);
/** No transfer goes on any more; files stay. */
void foe_server_reset(struct foe_server *s);
/** Set "password", "busy" or "fail_at". 0 or -EINVAL. */
int foe_server_set(struct foe_server *s, const char *key, const char *value);
/** The file called @name; NULL: there is none. */
const struct foe_file *foe_server_find(const struct foe_server *s, const char *name);
/** Free what was stored. */
void foe_server_done(struct foe_server *s);

#endif
