/* SPDX-License-Identifier: MIT */
/*
 * The port under SOEM's functions: frame buffers by index, as SOEM's sources use them, and the
 * line that carries the frames. One service thread uses it; nothing here is locked. Written for
 * ecdaq; the names of the file and of the functions are those that SOEM's sources use.
 */
#ifndef LINK_UNDER_SOEM_NICDRV_H
#define LINK_UNDER_SOEM_NICDRV_H

#include "ethercattype.h"

struct line;

/* There is no second port: redundancy is not done in SOEM's layer. Its init function needs a type.
 */
typedef struct ecx_redport {
	struct line *line;
} ecx_redportt;

typedef struct ecx_port {
	struct line *line;
	/* By frame index; a received frame is stored here without its Ethernet header. */
	ec_bufT rxbuf[EC_MAXBUF];
	ec_bufT txbuf[EC_MAXBUF];
	int txbuflength[EC_MAXBUF];
	int bufstat[EC_MAXBUF];
	uint8 lastidx;
	uint8 sequence; /* the index byte on the wire: 256 long, so that a late answer is
			 * distinguished
			 */
	uint64 retries; /* idempotent frames sent again */
	/* Named by SOEM's redundant init, which ecdaq does not call. */
	ec_bufT txbuf2;
	int txbuflength2;
	ecx_redportt *redport;
} ecx_portt;

extern const uint16 priMAC[3];
extern const uint16 secMAC[3];

/** Take the line bound to this thread (line_bound()). 1, or 0 when there is none. */
int ecx_setupnic(ecx_portt *port, const char *ifname, int secondary);
int ecx_closenic(ecx_portt *port);
uint8 ecx_getindex(ecx_portt *port);
void ecx_setbufstat(ecx_portt *port, uint8 idx, int bufstat);
/** Mark the frame for sending; it is sent when its answer is waited for. */
int ecx_outframe(ecx_portt *port, uint8 idx, int sock);
int ecx_outframe_red(ecx_portt *port, uint8 idx);
/** Send once and wait @timeout us: WKC of the last datagram, or EC_NOFRAME. */
int ecx_waitinframe(ecx_portt *port, uint8 idx, int timeout);
/**
 * Send and wait. A frame that may be repeated without harm is sent up to three times, waited for 2,
 * 10 and 50 ms, whatever @timeout says; a mailbox write is sent exactly once and waited for with
 * the whole
 * @timeout, 50 ms at least.
 */
int ecx_srconfirm(ecx_portt *port, uint8 idx, int timeout);

#endif
