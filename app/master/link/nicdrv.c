/* SPDX-License-Identifier: MIT */
/*
 * SOEM's NIC layer on a line. What it adds to line_transact(): an index of its own on the wire, and
 * the rule which frames may be sent twice. The line has checked length and echo of every answer, so
 * what SOEM copies out of rxbuf is inside it.
 */
#include "oshw.h"

#include <errno.h>
#include <netinet/in.h>
#include <string.h>

#include "base/bytes.h"
#include "link/line.h"
#include "wire/datagram.h"
#include "wire/esc_reg.h"

const uint16 priMAC[3] = { 0x1010, 0x1010, 0x1010 };
const uint16 secMAC[3] = { 0x1010, 0x1010, 0x1014 };

enum {
	FIRST_DATAGRAM = ECAT_ETHERNET_BYTES + ECAT_FRAME_HEADER_BYTES,
	LENGTH_MASK = 0x07ff,
	MAILBOX_US = 50000,
};

static void write_ethernet_header(uint8_t *frame)
{
	memset(frame, 0xff, 6);
	memset(frame + 6, 0x10, 6);
	frame[12] = ECAT_ETHERTYPE >> 8;
	frame[13] = ECAT_ETHERTYPE & 0xff;
}

int ecx_setupnic(ecx_portt *port, const char *ifname, int secondary)
{
	(void)ifname;
	if (secondary || line_bound() == NULL) {
		return 0;
	}
	memset(port, 0, sizeof(*port));
	port->line = line_bound();
	for (int i = 0; i < EC_MAXBUF; i++) {
		write_ethernet_header(port->txbuf[i]);
		port->bufstat[i] = EC_BUF_EMPTY;
	}
	write_ethernet_header(port->txbuf2);
	return 1;
}

int ecx_closenic(ecx_portt *port)
{
	port->line = NULL;
	return 0;
}

uint8 ecx_getindex(ecx_portt *port)
{
	uint8 idx = port->lastidx;

	for (int i = 0; i < EC_MAXBUF; i++) {
		idx = (uint8)((idx + 1) % EC_MAXBUF);
		if (port->bufstat[idx] == EC_BUF_EMPTY) {
			break;
		}
	}
	port->bufstat[idx] = EC_BUF_ALLOC;
	port->lastidx = idx;
	return idx;
}

void ecx_setbufstat(ecx_portt *port, uint8 idx, int bufstat)
{
	port->bufstat[idx] = bufstat;
}

int ecx_outframe(ecx_portt *port, uint8 idx, int sock)
{
	(void)sock;
	port->bufstat[idx] = EC_BUF_TX;
	return port->txbuflength[idx];
}

int ecx_outframe_red(ecx_portt *port, uint8 idx)
{
	return ecx_outframe(port, idx, 0);
}

/*
 * A mailbox buffer is process RAM; a second write after a lost answer would queue the same message
 * twice, or block a full mailbox (T03). Registers may be written again.
 */
static int may_be_repeated(const uint8_t *frame)
{
	const uint8_t *dg = frame + FIRST_DATAGRAM;

	return (dg[0] != ECAT_CMD_FPWR && dg[0] != ECAT_CMD_APWR) ||
	       get_le16(dg + 4) < ESC_REG_PROCESS_RAM;
}

/* One try: the WKC of the last datagram, as SOEM expects it, or EC_NOFRAME. */
static int transact(ecx_portt *port, uint8 idx, int64_t timeout_ns)
{
	uint8_t frame[ECAT_FRAME_MAX_BYTES] = { 0 };
	uint8_t answer[ECAT_FRAME_MAX_BYTES];
	size_t len = (size_t)port->txbuflength[idx];
	size_t body_len;
	int r;

	if (port->line == NULL || len > sizeof(frame) || len < FIRST_DATAGRAM) {
		return EC_ERROR;
	}
	memcpy(frame, port->txbuf[idx], len);
	if (len < ECAT_FRAME_MIN_BYTES) {
		len = ECAT_FRAME_MIN_BYTES;
	}
	frame[FIRST_DATAGRAM + 1] = port->sequence++;
	port->bufstat[idx] = EC_BUF_TX;
	r = line_transact(port->line, frame, len, answer, sizeof(answer), (span_t){ timeout_ns });
	if (r < 0) {
		return r == -ECANCELED ? EC_ERROR : EC_NOFRAME;
	}
	body_len = (size_t)r - ECAT_ETHERNET_BYTES;
	memcpy(port->rxbuf[idx], answer + ECAT_ETHERNET_BYTES, body_len);
	port->bufstat[idx] = EC_BUF_COMPLETE;
	return get_le16(port->rxbuf[idx] + (get_le16(port->rxbuf[idx]) & LENGTH_MASK));
}

int ecx_waitinframe(ecx_portt *port, uint8 idx, int timeout)
{
	return transact(port, idx, (int64_t)timeout * NS_PER_US);
}

int ecx_srconfirm(ecx_portt *port, uint8 idx, int timeout)
{
	int64_t whole_us = timeout > MAILBOX_US ? timeout : MAILBOX_US;
	int wkc = EC_NOFRAME;

	if (!may_be_repeated(port->txbuf[idx])) {
		return transact(port, idx, whole_us * NS_PER_US);
	}
	for (unsigned i = 0; i < LINE_TRIES && port->line != NULL && wkc == EC_NOFRAME; i++) {
		if (line_pause(port->line, i) < 0) {
			return EC_ERROR;
		}
		port->retries += i > 0;
		wkc = transact(port, idx, line_timeout(port->line, i).ns);
	}
	return wkc;
}

uint16 oshw_htons(uint16 host)
{
	return htons(host);
}

ec_adaptert *oshw_find_adapters(void)
{
	return NULL;
}

void oshw_free_adapters(ec_adaptert *adapter)
{
	(void)adapter;
}
