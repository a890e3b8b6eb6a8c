/* SPDX-License-Identifier: MIT */
#include "harness/pcapng.h"

#include <errno.h>
#include <string.h>

#include "base/bytes.h"
#include "base/clock.h"

/* draft-ietf-opsawg-pcapng, section 4 */
enum block_type {
	BLOCK_INTERFACE = 0x00000001,
	BLOCK_SIMPLE_PACKET = 0x00000003,
	BLOCK_PACKET = 0x00000006,
	BLOCK_SECTION = 0x0a0d0d0a,
};

#define BYTE_ORDER_MAGIC UINT32_C(0x1a2b3c4d)

enum {
	BLOCK_HEADER_BYTES = 8,
	BLOCK_OVERHEAD_BYTES = 12,
	SECTION_MIN_BYTES = 28,
	INTERFACE_FIXED_BYTES = 8,
	PACKET_FIXED_BYTES = 20,
	SIMPLE_FIXED_BYTES = 4,
	OPTION_END = 0,
	OPTION_RESOLUTION = 9,
	OPTION_OFFSET = 14,
	RESOLUTION_US = 6,
	RESOLUTION_NS = 9,
	RESOLUTION_BINARY = 0x80,
};

static uint32_t swap32(uint32_t v)
{
	return v >> 24 | (v >> 8 & 0xff00) | (v << 8 & 0xff0000) | v << 24;
}

static uint32_t get32(const struct pcapng *f, const uint8_t *p)
{
	return f->is_swapped ? swap32(get_le32(p)) : get_le32(p);
}

static uint16_t get16(const struct pcapng *f, const uint8_t *p)
{
	return (uint16_t)(f->is_swapped ? p[0] << 8 | p[1] : get_le16(p));
}

/* The section header defines the byte order of its numbers, its own length included. */
static int enter_section(struct pcapng *f)
{
	const uint8_t *p = f->bytes + f->pos;
	uint32_t magic;

	if (f->len - f->pos < SECTION_MIN_BYTES) {
		return -EBADMSG;
	}
	magic = get_le32(p + BLOCK_HEADER_BYTES);
	if (magic != BYTE_ORDER_MAGIC && magic != swap32(BYTE_ORDER_MAGIC)) {
		return -EBADMSG;
	}
	f->is_swapped = magic != BYTE_ORDER_MAGIC;
	f->interface_count = 0;
	return 0;
}

int pcapng_open(struct pcapng *file, const uint8_t *bytes, size_t len)
{
	struct pcapng f = { .bytes = bytes, .len = len };

	if (len < SECTION_MIN_BYTES || get_le32(bytes) != BLOCK_SECTION || enter_section(&f) < 0) {
		return -EBADMSG;
	}
	*file = f;
	return 0;
}

static void take_option(const struct pcapng *f, struct pcapng_interface *i, uint16_t code,
			const uint8_t *value, size_t len)
{
	if (code == OPTION_RESOLUTION && len >= 1) {
		i->resolution = value[0];
	} else if (code == OPTION_OFFSET && len >= 8) {
		uint32_t a = get32(f, value);
		uint32_t b = get32(f, value + 4);
		uint64_t whole = f->is_swapped ? (uint64_t)a << 32 | b : (uint64_t)b << 32 | a;

		i->offset_s = (int64_t)whole;
	}
}

static int take_interface(struct pcapng *f, const uint8_t *body, size_t len)
{
	struct pcapng_interface *i = &f->interface[f->interface_count];
	size_t pos = INTERFACE_FIXED_BYTES;

	if (len < INTERFACE_FIXED_BYTES) {
		return -EBADMSG;
	}
	if (f->interface_count == PCAPNG_LIMIT_INTERFACES) {
		return -E2BIG;
	}
	*i = (struct pcapng_interface){ .link_type = get16(f, body),
					.snap_bytes = get32(f, body + 4),
					.resolution = RESOLUTION_US };
	while (pos + 4 <= len && get16(f, body + pos) != OPTION_END) {
		size_t option_len = get16(f, body + pos + 2);

		if (option_len > len - pos - 4) {
			return -EBADMSG;
		}
		take_option(f, i, get16(f, body + pos), body + pos + 4, option_len);
		pos += 4 + (option_len + 3) / 4 * 4;
	}
	f->interface_count++;
	return 0;
}

/* Units of the interface to ns, without overflow for any value in a file. */
static int64_t time_ns(const struct pcapng_interface *i, uint64_t units)
{
	unsigned exponent = i->resolution & ~(unsigned)RESOLUTION_BINARY;
	unsigned __int128 ns = units;

	if (i->resolution & RESOLUTION_BINARY) {
		ns = exponent < 64 ? ns * (uint64_t)NS_PER_S >> exponent : 0;
	} else {
		for (; exponent > RESOLUTION_NS; exponent--) {
			ns /= 10;
		}
		for (; exponent < RESOLUTION_NS; exponent++) {
			ns *= 10;
		}
	}
	return (int64_t)((uint64_t)ns + (uint64_t)i->offset_s * (uint64_t)NS_PER_S);
}

static int take_packet(const struct pcapng *f, const uint8_t *body, size_t len,
		       struct pcapng_packet *ret)
{
	uint32_t interface;
	uint64_t units;
	size_t captured;

	if (len < PACKET_FIXED_BYTES) {
		return -EBADMSG;
	}
	interface = get32(f, body);
	units = (uint64_t)get32(f, body + 4) << 32 | get32(f, body + 8);
	captured = get32(f, body + 12);
	if (interface >= f->interface_count || captured > len - PACKET_FIXED_BYTES) {
		return -EBADMSG;
	}
	*ret = (struct pcapng_packet){ .t_ns = time_ns(&f->interface[interface], units),
				       .interface = interface,
				       .bytes = body + PACKET_FIXED_BYTES,
				       .len = captured,
				       .wire_len = get32(f, body + 16) };
	return 1;
}

/* A simple packet has no time and no interface but the first. */
static int take_simple(const struct pcapng *f, const uint8_t *body, size_t len,
		       struct pcapng_packet *ret)
{
	size_t wire_len;
	size_t room;

	if (len < SIMPLE_FIXED_BYTES || f->interface_count == 0) {
		return -EBADMSG;
	}
	room = len - SIMPLE_FIXED_BYTES;
	wire_len = get32(f, body);
	*ret = (struct pcapng_packet){ .bytes = body + SIMPLE_FIXED_BYTES,
				       .len = wire_len < room ? wire_len : room,
				       .wire_len = wire_len };
	return 1;
}

/* One block: 1 with a packet, 0 without. */
static int take_block(struct pcapng *f, uint32_t type, const uint8_t *body, size_t len,
		      struct pcapng_packet *ret)
{
	switch (type) {
	case BLOCK_INTERFACE:
		return take_interface(f, body, len);
	case BLOCK_PACKET:
		return take_packet(f, body, len, ret);
	case BLOCK_SIMPLE_PACKET:
		return take_simple(f, body, len, ret);
	default:
		return 0;
	}
}

int pcapng_next(struct pcapng *file, struct pcapng_packet *ret)
{
	while (file->pos < file->len) {
		const uint8_t *block = file->bytes + file->pos;
		size_t left = file->len - file->pos;
		size_t total;
		int r;

		if (left < BLOCK_OVERHEAD_BYTES ||
		    (get_le32(block) == BLOCK_SECTION && enter_section(file) < 0)) {
			return -EBADMSG;
		}
		total = get32(file, block + 4);
		if (total < BLOCK_OVERHEAD_BYTES || total > left || total % 4 != 0 ||
		    get32(file, block + total - 4) != total) {
			return -EBADMSG;
		}
		r = take_block(file, get32(file, block), block + BLOCK_HEADER_BYTES,
			       total - BLOCK_OVERHEAD_BYTES, ret);
		if (r < 0) {
			return r;
		}
		file->pos += total;
		if (r == 1) {
			return 1;
		}
	}
	return 0;
}

/* --- writing --- */

size_t pcapng_write_head(uint8_t *buf)
{
	uint8_t *section = buf;
	uint8_t *interface = buf + SECTION_MIN_BYTES;
	size_t interface_bytes = PCAPNG_HEAD_BYTES - SECTION_MIN_BYTES;

	memset(buf, 0, PCAPNG_HEAD_BYTES);
	put_le32(section, BLOCK_SECTION);
	put_le32(section + 4, SECTION_MIN_BYTES);
	put_le32(section + 8, BYTE_ORDER_MAGIC);
	put_le16(section + 12, 1);          /* version 1.0 */
	put_le64(section + 16, UINT64_MAX); /* length of the section: unspecified */
	put_le32(section + 24, SECTION_MIN_BYTES);
	put_le32(interface, BLOCK_INTERFACE);
	put_le32(interface + 4, (uint32_t)interface_bytes);
	put_le16(interface + 8, PCAPNG_LINK_ETHERNET);
	put_le16(interface + 16, OPTION_RESOLUTION);
	put_le16(interface + 18, 1);
	interface[20] = RESOLUTION_NS;
	put_le32(interface + interface_bytes - 4, (uint32_t)interface_bytes);
	return PCAPNG_HEAD_BYTES;
}

size_t pcapng_packet_bytes(size_t frame_len)
{
	return PCAPNG_PACKET_OVERHEAD_BYTES + (frame_len + 3) / 4 * 4;
}

size_t pcapng_write_packet(uint8_t *buf, int64_t t_ns, const uint8_t *frame, size_t frame_len)
{
	size_t total = pcapng_packet_bytes(frame_len);
	uint64_t t = (uint64_t)t_ns;

	memset(buf, 0, total);
	put_le32(buf, BLOCK_PACKET);
	put_le32(buf + 4, (uint32_t)total);
	put_le32(buf + 12, (uint32_t)(t >> 32));
	put_le32(buf + 16, (uint32_t)t);
	put_le32(buf + 20, (uint32_t)frame_len);
	put_le32(buf + 24, (uint32_t)frame_len);
	memcpy(buf + BLOCK_HEADER_BYTES + PACKET_FIXED_BYTES, frame, frame_len);
	put_le32(buf + total - 4, (uint32_t)total);
	return total;
}
