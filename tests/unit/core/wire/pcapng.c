/* SPDX-License-Identifier: MIT */
#include "harness/pcapng.h"

#include <errno.h>

#include "base/bytes.h"
#include "harness/test.h"

enum { CAP = 4096 };

struct file {
	uint8_t bytes[CAP];
	size_t len;
};

static void put_block(struct file *f, uint32_t type, const uint8_t *body, size_t body_len)
{
	uint8_t *p = f->bytes + f->len;
	uint32_t total = (uint32_t)(12 + (body_len + 3) / 4 * 4);

	memset(p, 0, total);
	put_le32(p, type);
	put_le32(p + 4, total);
	memcpy(p + 8, body, body_len);
	put_le32(p + total - 4, total);
	f->len += total;
}

static struct file two_packets(void)
{
	struct file f = { .len = 0 };

	f.len = pcapng_write_head(f.bytes);
	f.len += pcapng_write_packet(f.bytes + f.len, 1700000000123456789, (const uint8_t *)"abc",
				     3);
	f.len += pcapng_write_packet(f.bytes + f.len, 1700000000123456999, (const uint8_t *)"defgh",
				     5);
	return f;
}

static void swap_words(uint8_t *p, size_t len)
{
	for (size_t i = 0; i + 4 <= len; i += 4) {
		uint8_t w[4] = { p[i + 3], p[i + 2], p[i + 1], p[i] };

		memcpy(p + i, w, 4);
	}
}

TEST(pcapng, what_is_written_is_read_back_with_its_time_to_the_ns)
{
	struct file f = two_packets();
	struct pcapng_packet p;
	struct pcapng in;

	CHECK_EQ(pcapng_open(&in, f.bytes, f.len), 0);
	CHECK_EQ(pcapng_next(&in, &p), 1);
	CHECK_EQ(p.t_ns, 1700000000123456789);
	CHECK_EQ(p.len, 3);
	CHECK_MEM(p.bytes, "abc", 3);
	CHECK_EQ(in.interface[p.interface].link_type, PCAPNG_LINK_ETHERNET);
	CHECK_EQ(pcapng_next(&in, &p), 1);
	CHECK_EQ(p.t_ns, 1700000000123456999);
	CHECK_EQ(p.wire_len, 5);
	CHECK_EQ(pcapng_next(&in, &p), 0);
	CHECK_EQ(pcapng_next(&in, &p), 0);
}

TEST(pcapng, the_other_byte_order_reads_the_same)
{
	/* Two 16-bit numbers in a word change places, too: link type 1 is in the upper half then.
	 */
	uint8_t section[20] = { 0x4d, 0x3c, 0x2b, 0x1a, [8] = 0xff, [12] = 0xff };
	uint8_t interface[8] = { [2] = 1 };
	uint8_t packet[24] = { [8] = 5, [12] = 3, [16] = 3 };
	struct file f = { .len = 0 };
	struct pcapng_packet p;
	struct pcapng in;

	put_block(&f, 0x0a0d0d0a, section, sizeof(section) - 4);
	put_block(&f, 1, interface, sizeof(interface));
	put_block(&f, 6, packet, sizeof(packet));
	swap_words(f.bytes, f.len);
	memcpy(f.bytes + f.len - 8, "xyz", 3);
	CHECK_EQ(pcapng_open(&in, f.bytes, f.len), 0);
	CHECK_EQ(pcapng_next(&in, &p), 1);
	CHECK_EQ(in.interface[0].link_type, 1);
	CHECK_EQ(p.t_ns, 5000); /* microseconds, the default of an interface */
	CHECK_EQ(p.len, 3);
	CHECK_MEM(p.bytes, "xyz", 3);
}

TEST(pcapng, every_time_resolution_comes_out_in_ns)
{
	static const struct {
		uint8_t resolution;
		uint32_t units;
		int64_t t_ns;
	} cases[] = { { 0, 2, 2000000000 },    { 3, 7, 7000000 },
		      { 6, 7, 7000 },          { 9, 7, 7 },
		      { 12, 7999, 7 },         { 40, 7, 0 },
		      { 0x80, 3, 3000000000 }, { 0x8a, 1024, 1000000000 },
		      { 0xff, 9, 0 } };

	for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
		uint8_t section[16] = { 0x4d, 0x3c, 0x2b, 0x1a };
		uint8_t interface[16] = { 1, [8] = 9, [10] = 1, [12] = cases[i].resolution };
		uint8_t packet[20] = { 0 };
		struct file f = { .len = 0 };
		struct pcapng_packet p;
		struct pcapng in;

		put_le32(packet + 8, cases[i].units);
		put_block(&f, 0x0a0d0d0a, section, sizeof(section));
		put_block(&f, 1, interface, sizeof(interface));
		put_block(&f, 6, packet, sizeof(packet));
		CHECK_EQ(pcapng_open(&in, f.bytes, f.len), 0);
		CHECK_EQ(pcapng_next(&in, &p), 1);
		CHECK_EQ(p.t_ns, cases[i].t_ns);
	}
}

TEST(pcapng, blocks_of_other_kinds_are_passed_over)
{
	uint8_t noise[9] = { 1, 2, 3 };
	uint8_t simple[6] = { 2, 0, 0, 0, 'h', 'i' };
	struct file f = { .len = 0 };
	struct pcapng_packet p;
	struct pcapng in;

	f.len = pcapng_write_head(f.bytes);
	put_block(&f, 0x0bad, noise, sizeof(noise));
	put_block(&f, 5, noise, sizeof(noise));
	put_block(&f, 3, simple, sizeof(simple));
	CHECK_EQ(pcapng_open(&in, f.bytes, f.len), 0);
	CHECK_EQ(pcapng_next(&in, &p), 1);
	CHECK_EQ(p.len, 2);
	CHECK_MEM(p.bytes, "hi", 2);
	CHECK_EQ(pcapng_next(&in, &p), 0);
}

TEST(pcapng, a_file_cut_anywhere_gives_its_whole_packets_and_then_an_error)
{
	struct file f = two_packets();
	size_t first_end = PCAPNG_HEAD_BYTES + pcapng_packet_bytes(3);

	for (size_t len = 0; len < f.len; len++) {
		struct pcapng_packet p = { .t_ns = 77 };
		struct pcapng in;
		int packets = 0;
		int r = pcapng_open(&in, f.bytes, len);

		if (len < 28) {
			CHECK_EQ(r, -EBADMSG);
			continue;
		}
		CHECK_EQ(r, 0);
		while ((r = pcapng_next(&in, &p)) == 1) {
			packets++;
		}
		CHECK_EQ(packets, len >= first_end);
		CHECK_EQ(r,
			 len == 28 || len == PCAPNG_HEAD_BYTES || len == first_end ? 0 : -EBADMSG);
	}
}

TEST(pcapng, a_packet_of_an_undefined_interface_is_rejected)
{
	struct file f = two_packets();
	struct pcapng_packet p = { .t_ns = 77 };
	struct pcapng in;

	put_le32(f.bytes + PCAPNG_HEAD_BYTES + 8, 1);
	CHECK_EQ(pcapng_open(&in, f.bytes, f.len), 0);
	CHECK_EQ(pcapng_next(&in, &p), -EBADMSG);
	CHECK_EQ(p.t_ns, 77);
	put_le32(f.bytes + PCAPNG_HEAD_BYTES + 8, 0);
	put_le32(f.bytes + PCAPNG_HEAD_BYTES + 20, 0xfffffff0);
	CHECK_EQ(pcapng_open(&in, f.bytes, f.len), 0);
	CHECK_EQ(pcapng_next(&in, &p), -EBADMSG);
}

TEST(pcapng, more_interfaces_than_the_limit_are_named_as_such)
{
	uint8_t interface[8] = { 1 };
	struct file f = { .len = 0 };
	struct pcapng_packet p;
	struct pcapng in;

	f.len = pcapng_write_head(f.bytes);
	for (unsigned i = 0; i < PCAPNG_LIMIT_INTERFACES; i++) {
		put_block(&f, 1, interface, sizeof(interface));
	}
	CHECK_EQ(pcapng_open(&in, f.bytes, f.len), 0);
	CHECK_EQ(pcapng_next(&in, &p), -E2BIG);
}

TEST(pcapng, a_second_section_restarts_its_interfaces)
{
	struct file f = two_packets();
	struct pcapng_packet p;
	struct pcapng in;

	memcpy(f.bytes + f.len, f.bytes, f.len);
	CHECK_EQ(pcapng_open(&in, f.bytes, 2 * f.len), 0);
	for (int i = 0; i < 4; i++) {
		CHECK_EQ(pcapng_next(&in, &p), 1);
		CHECK_EQ(in.interface_count, 1);
	}
	CHECK_EQ(pcapng_next(&in, &p), 0);
}
