/* SPDX-License-Identifier: MIT */
/* The WAGO coupler's object dictionary, and what SDO information says of it. */
#include "base/bytes.h"
#include "base/prng.h"
#include "devices/coe_dictionary.h"
#include "devices/coe_server.h"
#include "devices/wago_node.h"
#include "harness/test.h"
#include "wago_bench.h"

enum { INFORMATION = 8, LIST = 1, OBJECT = 3, ENTRY = 5, REFUSED = 7 };

static struct bench *in_preop(void)
{
	struct bench *b = wago_bench_create("wago_750_354", NULL);

	wago_bench_preop(b);
	return b;
}

static uint32_t upload(struct bench *b, uint16_t index, uint8_t subindex)
{
	int is_abort;
	uint32_t value = wago_bench_upload(b, index, subindex, &is_abort);

	CHECK_EQ(is_abort, 0);
	return value;
}

static uint32_t abort_of(struct bench *b, uint16_t index, uint8_t subindex)
{
	int is_abort;
	uint32_t code = wago_bench_upload(b, index, subindex, &is_abort);

	CHECK_EQ(is_abort, 1);
	return code;
}

TEST(wago_coe, assignment_names_coupler_analog_digital_and_padding)
{
	static const uint16_t outputs[] = { 0x16ff, 0x1601, 0x1603, 0x1701 };
	static const uint16_t inputs[] = { 0x1aff, 0x1a00, 0x1a02, 0x1b01 };
	struct bench *b = in_preop();

	CHECK_EQ(upload(b, 0x1c12, 0), 4);
	CHECK_EQ(upload(b, 0x1c13, 0), 4);
	for (uint8_t i = 0; i < 4; i++) {
		CHECK_EQ(upload(b, 0x1c12, (uint8_t)(i + 1)), outputs[i]);
		CHECK_EQ(upload(b, 0x1c13, (uint8_t)(i + 1)), inputs[i]);
	}
	bench_destroy(b);
}

TEST(wago_coe, mapping_is_that_of_published_couplers)
{
	static const uint32_t status[] = { 0xf1000101, 0xf1000201, 0xf1000301, 0xf1000401,
					   0x0000000b, 0x10f30401, 0xf1000510 };
	static const uint32_t control[] = { 0xf2000101, 0xf2000201, 0xf2000301,
					    0xf2000401, 0x0000000c, 0xf2000510 };
	struct bench *b = in_preop();

	CHECK_EQ(upload(b, 0x1aff, 0), 7);
	for (uint8_t i = 0; i < 7; i++) {
		CHECK_EQ(upload(b, 0x1aff, (uint8_t)(i + 1)), status[i]);
	}
	CHECK_EQ(upload(b, 0x16ff, 0), 6);
	for (uint8_t i = 0; i < 6; i++) {
		CHECK_EQ(upload(b, 0x16ff, (uint8_t)(i + 1)), control[i]);
	}
	CHECK_EQ(upload(b, 0x1601, 4), 0x70100410);
	CHECK_EQ(upload(b, 0x1a02, 8), 0x60200801);
	CHECK_EQ(upload(b, 0x1b01, 1), 0x00000008);
	bench_destroy(b);
}

TEST(wago_coe, modules_are_listed_with_their_idents)
{
	struct bench *b = in_preop();

	CHECK_EQ(upload(b, 0x1000, 0), 5001);
	CHECK_EQ(upload(b, 0x1018, 2), 0x07500354);
	CHECK_EQ(upload(b, 0xf050, 0), 4);
	CHECK_EQ(upload(b, 0xf050, 3), 0x80000081);
	CHECK_EQ(upload(b, 0x9020, 0x0a), 0x80000081);
	CHECK_EQ(upload(b, 0x9030, 0x0a), 0x80000082);
	CHECK_EQ(upload(b, 0xf000, 1), 0x10);
	CHECK_EQ(abort_of(b, 0xf050, 5), COE_ABORT_NO_SUBINDEX);
	CHECK_EQ(abort_of(b, 0x9020, 1), COE_ABORT_NO_SUBINDEX);
	CHECK_EQ(abort_of(b, 0x9040, 0x0a), COE_ABORT_NO_OBJECT);
	bench_destroy(b);
}

TEST(wago_coe, assignment_is_fixed)
{
	const uint8_t request[10] = { 0x00, 0x20, 0x2f, 0x12, 0x1c, 0x00, 0 };
	struct bench *b = in_preop();
	uint8_t answer[WAGO_BENCH_BOX];

	CHECK_EQ(wago_bench_coe(b, request, sizeof(request), answer), 10);
	CHECK_EQ(answer[2], 0x80);
	CHECK_EQ(get_le32(answer + 6), COE_ABORT_READ_ONLY);
	CHECK_EQ(upload(b, 0x1c12, 0), 4);
	bench_destroy(b);
}

TEST(wago_coe, sdo_reads_what_the_process_data_has)
{
	struct signal_spec direct = { .offset_v = 5.0 };
	struct bench *b = wago_bench_create("wago_750_354", &direct);
	uint8_t outputs[WAGO_BENCH_BYTES] = { [4] = 0x22, [5] = 0x11, [12] = 0x80 };
	uint8_t inputs[WAGO_BENCH_BYTES];

	wago_bench_preop(b);
	wago_bench_op(b, outputs);
	wago_bench_exchange(b, outputs, inputs);
	CHECK_EQ(upload(b, 0x6000, 1), 0x4000);
	CHECK_EQ(upload(b, 0x7010, 1), 0x1122);
	CHECK_EQ(upload(b, 0x7030, 7), 0);
	CHECK_EQ(upload(b, 0x7030, 8), 1);
	CHECK_EQ(upload(b, 0x7030, 0), 8);
	bench_destroy(b);
}

static size_t inform(struct bench *b, uint8_t opcode, uint16_t index, uint8_t subindex,
		     uint8_t *answer)
{
	uint8_t request[10] = { 0x00, INFORMATION << 4, opcode };

	put_le16(request + 6, index);
	request[8] = subindex;
	memset(answer, 0, WAGO_BENCH_BOX);
	return wago_bench_coe(b, request, sizeof(request), answer);
}

static void check_entry(struct bench *b, uint16_t index, uint8_t subindex, uint16_t type,
			const char *name)
{
	uint8_t answer[WAGO_BENCH_BOX];

	CHECK_EQ(inform(b, ENTRY, index, subindex, answer), 16 + strlen(name));
	CHECK_EQ(answer[2], ENTRY + 1);
	CHECK_EQ(get_le16(answer + 6), index);
	CHECK_EQ(answer[8], subindex);
	CHECK_EQ(get_le16(answer + 10), type);
	CHECK_STR((const char *)answer + 16, name);
}

TEST(wago_coe, entries_have_the_names_of_published_couplers)
{
	struct bench *b = in_preop();

	check_entry(b, 0xf200, 1, 1, "K-Bus Cycle Overrun Flag Disable");
	check_entry(b, 0xf200, 5, 6, "Diagnostics Control Word");
	check_entry(b, 0xf100, 5, 6, "Diagnostics Status Word");
	check_entry(b, 0x6000, 1, 3, "Channel 1 Data");
	check_entry(b, 0x7030, 8, 1, "Channel 8 Data");
	check_entry(b, 0x1018, 1, 7, "");
	bench_destroy(b);
}

TEST(wago_coe, information_of_what_is_not_there_is_refused)
{
	struct bench *b = in_preop();
	uint8_t answer[WAGO_BENCH_BOX];

	CHECK_EQ(inform(b, ENTRY, 0x6050, 1, answer), 10);
	CHECK_EQ(answer[2], REFUSED);
	CHECK_EQ(get_le32(answer + 6), COE_ABORT_NO_OBJECT);
	CHECK_EQ(inform(b, ENTRY, 0x6000, 5, answer), 10);
	CHECK_EQ(get_le32(answer + 6), COE_ABORT_NO_SUBINDEX);
	CHECK_EQ(inform(b, OBJECT, 0x6050, 0, answer), 10);
	CHECK_EQ(answer[2], REFUSED);
	CHECK_EQ(inform(b, 0x55, 0x6000, 0, answer), 10);
	CHECK_EQ(answer[2], REFUSED);
	CHECK_EQ(inform(b, LIST, 7, 0, answer), 10);
	CHECK_EQ(answer[2], REFUSED);
	bench_destroy(b);
}

TEST(wago_coe, the_list_has_every_object_once_in_order)
{
	struct bench *b = in_preop();
	uint8_t answer[WAGO_BENCH_BOX];
	uint16_t last = 0;
	size_t len;
	unsigned count;

	CHECK_EQ(inform(b, LIST, 0, 0, answer), 18);
	count = get_le16(answer + 8);
	len = inform(b, LIST, 1, 0, answer);
	CHECK_EQ(answer[2], LIST + 1);
	CHECK_EQ(len, 8 + 2 * count);
	for (size_t at = 8; at < len; at += 2) {
		uint16_t index = get_le16(answer + at);

		CHECK(index > last);
		last = index;
	}
	/* 1000 1008 1018 1C00 1C12 1C13, 8 PDOs, 10F3, 4 modules twice, F000 F050 F100 F200 */
	CHECK_EQ(count, 6 + 8 + 1 + 8 + 4);
	CHECK_EQ(last, 0xf200);
	bench_destroy(b);
}

TEST(wago_coe, an_object_is_a_variable_or_a_record)
{
	struct bench *b = in_preop();
	uint8_t answer[WAGO_BENCH_BOX];

	CHECK_EQ(inform(b, OBJECT, 0x1000, 0, answer), 12);
	CHECK_EQ(get_le16(answer + 8), 7);
	CHECK_EQ(answer[10], 0);
	CHECK_EQ(answer[11], 7);
	CHECK_EQ(inform(b, OBJECT, 0x6000, 0, answer), 12);
	CHECK_EQ(answer[10], 4);
	CHECK_EQ(answer[11], 9);
	bench_destroy(b);
}

/* Buffers of exactly their size, so that a sanitizer sees each byte beyond. */
static size_t answer_random(struct coe_server *server, struct prng *prng)
{
	size_t len = (size_t)prng_below(prng, 40);
	size_t capacity = 10 + (size_t)prng_below(prng, 200);
	uint8_t *request = malloc(len + 1);
	uint8_t *answer = malloc(capacity);
	size_t n;

	CHECK(request != NULL && answer != NULL);
	for (size_t i = 0; i < len; i++) {
		request[i] = (uint8_t)prng_next(prng);
	}
	if (len >= 9) {
		static const uint16_t known[] = { 0x1000, 0x1008, 0x1018, 0x1c12, 0x1aff, 0x1601,
						  0x6000, 0x7030, 0xf050, 0x9000, 0xf100, 0x10f3 };

		request[1] = (uint8_t)(prng_below(prng, 2) != 0 ? INFORMATION << 4 : 2 << 4);
		request[2] = (uint8_t)(prng_below(prng, 3) != 0 ? request[2] : prng_below(prng, 8));
		put_le16(request + (request[1] == INFORMATION << 4 ? 6 : 3),
			 known[prng_below(prng, sizeof(known) / sizeof(known[0]))]);
	}
	n = coe_server_answer(server, request, len, answer, capacity);
	CHECK(n <= capacity);
	free(request);
	free(answer);
	return n;
}

TEST(wago_coe, no_request_whatever_its_bytes_breaks_it)
{
	static struct wago_node node;
	static struct coe_server server;
	const struct wago_module *modules[] = { wago_module_find(457), wago_module_find(530) };
	struct prng prng = { 20261121 };
	struct coe_value v;
	unsigned answers = 0;

	CHECK_EQ(wago_node_init(&node, modules, 2), 0);
	coe_dictionary_init(&server.dictionary, &node.sii, "fuzzed");
	wago_node_complete(&node, &server.dictionary);
	for (int i = 0; i < 50000; i++) {
		answers += answer_random(&server, &prng) > 0;
	}
	CHECK(answers > 25000);
	CHECK_EQ(coe_dictionary_read(&server.dictionary, 0x1c12, 0, &v), COE_OK);
	CHECK_EQ(v.bytes[0], 3);
}
