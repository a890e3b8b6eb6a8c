/* SPDX-License-Identifier: MIT */
#include "link/packet_ring.h"

#include <errno.h>
#include <linux/if_packet.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>

/* A slot has the kernel's heads and the longest frame; a block is a power of two of pages. */
enum {
	SLOT_BYTES = 2048,
	BLOCK_BYTES = 65536,
	SLOTS = 256,
	RING_BYTES = SLOTS * SLOT_BYTES,
	FROM_AT = TPACKET_ALIGN((int)sizeof(struct tpacket2_hdr)), /* where the sender is */
};

int packet_ring_open(int fd, struct packet_ring *ret_ring)
{
	int version = TPACKET_V2;
	struct tpacket_req wanted = {
		.tp_block_size = BLOCK_BYTES,
		.tp_block_nr = RING_BYTES / BLOCK_BYTES,
		.tp_frame_size = SLOT_BYTES,
		.tp_frame_nr = SLOTS,
	};
	void *bytes;

	if (setsockopt(fd, SOL_PACKET, PACKET_VERSION, &version, sizeof(version)) < 0 ||
	    setsockopt(fd, SOL_PACKET, PACKET_RX_RING, &wanted, sizeof(wanted)) < 0) {
		return -errno;
	}
	bytes = mmap(NULL, RING_BYTES, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
	if (bytes == MAP_FAILED) {
		return -errno;
	}
	*ret_ring = (struct packet_ring){ .bytes = bytes };
	return 0;
}

void packet_ring_close(struct packet_ring *ring)
{
	munmap(ring->bytes, RING_BYTES);
	ring->bytes = NULL;
}

int packet_ring_take(struct packet_ring *ring, uint8_t *frame, size_t capacity)
{
	uint8_t *slot = ring->bytes + (size_t)ring->next * SLOT_BYTES;
	struct tpacket2_hdr *head = (struct tpacket2_hdr *)(void *)slot;
	const struct sockaddr_ll *from = (const void *)(slot + FROM_AT);
	int r = -EAGAIN;

	/* The kernel writes the state after, and reads it before all else of the slot. */
	if ((__atomic_load_n(&head->tp_status, __ATOMIC_ACQUIRE) & TP_STATUS_USER) == 0) {
		return -EAGAIN;
	}
	if (from->sll_pkttype != PACKET_OUTGOING && head->tp_snaplen == head->tp_len &&
	    head->tp_len <= capacity) {
		memcpy(frame, slot + head->tp_mac, head->tp_len);
		r = (int)head->tp_len;
	}
	__atomic_store_n(&head->tp_status, TP_STATUS_KERNEL, __ATOMIC_RELEASE);
	ring->next = (ring->next + 1) % SLOTS;
	return r;
}
