/* SPDX-License-Identifier: MIT */
#include "record/layout.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "harness/test.h"
#include "record/names.h"
#include "record/ros2msg.h"

enum { SLAVES = 3, CHANNELS = 9, IMAGE_BYTES = 32 };
enum { HEAD_FIELDS = 3 + 4 }; /* those of the header; cycle, dc_time_ns, flags, good */

#define UTC_NS UINT64_C(1767225600000000123)

struct meta {
	struct sample_meta head;
	struct slave_info slave[SLAVES];
	struct channel channel[CHANNELS];
};

static struct channel make_channel(const char *name, unsigned pos, enum channel_type type,
				   unsigned bits, unsigned offset)
{
	struct channel ch = { .slave_pos = (uint16_t)pos,
			      .type = (uint8_t)type,
			      .bit_len = (uint8_t)bits,
			      .bit_offset = offset,
			      .scale = 1 };

	snprintf(ch.name, sizeof(ch.name), "%s", name);
	return ch;
}

/* A slave of all types, one without channels, one whose names are a trap. */
static void fill(struct meta *m)
{
	*m = (struct meta){
		.head = { .version = SAMPLE_VERSION,
			  .slave_count = SLAVES,
			  .channel_count = CHANNELS,
			  .image_bytes = IMAGE_BYTES,
			  .period_ns = 1000000,
			  .session = 5 },
		.slave = { { .name = "all types", .slave_pos = 0 },
			   { .name = "coupler", .slave_pos = 1 },
			   { .name = "cycle", .slave_pos = 2 } },
		.channel = { make_channel("all types.bit", 0, CHANNEL_BOOL, 1, 3),
			     make_channel("all types.Five", 0, CHANNEL_INT, 5, 4),
			     make_channel("all types.word", 0, CHANNEL_UINT, 16, 16),
			     make_channel("all types.int40", 0, CHANNEL_INT, 40, 32),
			     make_channel("all types.real", 0, CHANNEL_FLOAT, 32, 72),
			     make_channel("all types.wide", 0, CHANNEL_FLOAT, 64, 104),
			     make_channel("cycle.good", 2, CHANNEL_UINT, 8, 0),
			     make_channel("cycle.Good", 2, CHANNEL_UINT, 8, 8),
			     make_channel("cycle.class", 2, CHANNEL_UINT, 8, 16) },
	};
}

static int create_with(const struct meta *m, enum config_record_values values, struct layout **l)
{
	static struct channel_table *table; /* the newest layout's */

	channel_table_destroy(table);
	table = NULL;
	CHECK_EQ(channel_table_create(m, sizeof(*m), &table), 0);
	return layout_create(table, values, l);
}

static int create(const struct meta *m, struct layout **l)
{
	return create_with(m, CONFIG_RECORD_BOTH, l);
}

TEST(layout, each_slave_with_channels_is_a_topic_with_its_fields)
{
	struct meta m;
	struct layout *l;
	size_t count;
	const struct layout_topic *t;

	fill(&m);
	CHECK_EQ(create(&m, &l), 0);
	t = layout_topics(l, &count);
	CHECK_EQ(count, 2);
	CHECK_STR(t[0].topic, "/ecdaq/all_types");
	CHECK_STR(t[0].type, "AllTypes");
	CHECK_EQ(t[0].field_count, 6);
	CHECK_STR(t[0].field[0].ros_type, "bool");
	CHECK_STR(t[0].field[1].ros_type, "int8");
	CHECK_STR(t[0].field[1].name, "five");
	CHECK_STR(t[0].field[2].ros_type, "uint16");
	CHECK_STR(t[0].field[3].ros_type, "int64");
	CHECK_STR(t[0].field[4].ros_type, "float32");
	CHECK_STR(t[0].field[5].ros_type, "float64");
	layout_destroy(l);
	layout_destroy(NULL);
}

TEST(layout, names_that_are_taken_or_reserved_get_others)
{
	struct meta m;
	struct layout *l;
	size_t count;
	const struct layout_topic *t;

	fill(&m);
	CHECK_EQ(create(&m, &l), 0);
	t = layout_topics(l, &count);
	CHECK_STR(t[1].topic, "/ecdaq/cycle_at_2");
	CHECK_STR(t[1].type, "CycleAt2");
	CHECK_STR(t[1].field[0].name, "good_2");
	CHECK_STR(t[1].field[1].name, "good_3");
	CHECK_STR(t[1].field[2].name, "class_value");
	layout_destroy(l);
}

TEST(layout, two_slaves_of_one_name_are_two_topics)
{
	struct meta m;
	struct layout *l;
	size_t count;
	const struct layout_topic *t;

	fill(&m);
	snprintf(m.slave[2].name, sizeof(m.slave[2].name), "all_types");
	CHECK_EQ(create(&m, &l), 0);
	t = layout_topics(l, &count);
	CHECK(strcmp(t[0].topic, t[1].topic) != 0);
	CHECK(strcmp(t[0].type, t[1].type) != 0);
	layout_destroy(l);
}

TEST(layout, values_are_what_the_image_holds_with_their_sign)
{
	struct meta m;
	struct layout *l;
	size_t count;
	const struct layout_topic *t;
	struct sample_header header = { .cycle = 77, .dc_time_ns = -3, .flags = 9 };
	uint8_t image[IMAGE_BYTES] = { 0 };
	struct ros2msg msg;
	struct ros2msg_value v[16];
	uint8_t buf[256];
	char *text;
	float real = -1.5f;
	double wide = 1e300;
	size_t len;

	fill(&m);
	CHECK_EQ(create(&m, &l), 0);
	t = layout_topics(l, &count);
	image[0] = 0x08 | 0xf0; /* bit 1, the low four bits of -1 */
	image[1] = 0x01;        /* its sign */
	image[2] = 0x34;
	image[3] = 0x12;
	memset(image + 4, 0xff, 5); /* -1 in 40 bits */
	memcpy(image + 9, &real, 4);
	memcpy(image + 13, &wide, 8);
	len = layout_encode(&t[0], &header, image, UTC_NS, buf, sizeof(buf));
	CHECK_EQ(len, t[0].message_bytes);
	text = layout_ros2msg(&t[0]);
	CHECK(text != NULL);
	CHECK_EQ(ros2msg_parse(text, strlen(text), &msg), 0);
	CHECK_EQ(msg.count, HEAD_FIELDS + 6);
	CHECK_EQ(ros2msg_decode(&msg, buf, len, v), 0);
	CHECK_STR(msg.field[0].name, "header.stamp.sec");
	CHECK_EQ(v[0].raw, 1767225600);
	CHECK_STR(msg.field[1].name, "header.stamp.nanosec");
	CHECK_EQ(v[1].raw, 123);
	CHECK_EQ(v[2].raw, 0); /* frame_id */
	CHECK_EQ(v[3].raw, 77);
	CHECK_EQ((int64_t)v[4].raw, -3);
	CHECK_EQ(v[5].raw, 9);
	CHECK_EQ(v[6].raw, 1);
	CHECK_EQ(v[7].raw, 1);
	CHECK_EQ((int64_t)v[8].raw, -1);
	CHECK_EQ(v[9].raw, 0x1234);
	CHECK_EQ((int64_t)v[10].raw, -1);
	CHECK(ros2msg_number(&msg.field[11], &v[11]) == -1.5);
	CHECK(ros2msg_number(&msg.field[12], &v[12]) == 1e300);
	for (size_t cut = 0; cut < len; cut++) {
		CHECK_EQ(ros2msg_decode(&msg, buf, cut, v), -EBADMSG);
	}
	free(text);
	ros2msg_done(&msg);
	layout_destroy(l);
}

/* A slave with a scaled channel, one without a scale, and one that has the name of the raw field.
 */
static void fill_scaled(struct meta *m)
{
	fill(m);
	m->channel[6] = make_channel("cycle.volts", 2, CHANNEL_INT, 16, 0);
	m->channel[6].scale = 0.5;
	m->channel[6].offset = 1;
	m->channel[7] = make_channel("cycle.count", 2, CHANNEL_UINT, 8, 16);
	m->channel[8] = make_channel("cycle.volts raw", 2, CHANNEL_UINT, 8, 24);
}

struct decoded {
	struct ros2msg msg;
	struct ros2msg_value value[32];
};

static void decode_slave_2(const struct meta *m, enum config_record_values values,
			   const struct sample_header *header, struct decoded *d)
{
	const uint8_t image[IMAGE_BYTES] = { 0xfc, 0xff, 7, 9 }; /* -4 */
	struct layout *l;
	size_t count;
	const struct layout_topic *t;
	uint8_t buf[256];
	size_t len;
	char *text;

	CHECK_EQ(create_with(m, values, &l), 0);
	t = layout_topics(l, &count);
	len = layout_encode(&t[1], header, image, UTC_NS, buf, sizeof(buf));
	CHECK_EQ(len, t[1].message_bytes);
	text = layout_ros2msg(&t[1]);
	CHECK_EQ(ros2msg_parse(text, strlen(text), &d->msg), 0);
	CHECK_EQ(ros2msg_decode(&d->msg, buf, len, d->value), 0);
	free(text);
	layout_destroy(l);
}

static double decoded_number(const struct decoded *d, const char *name)
{
	int i = ros2msg_find(&d->msg, name);

	CHECK(i >= 0);
	return ros2msg_number(&d->msg.field[i], &d->value[i]);
}

TEST(layout, a_scaled_channel_is_recorded_as_its_unit_with_the_raw_value_beside_it)
{
	struct sample_header header = { .cycle = 1 };
	struct decoded d;
	struct meta m;

	fill_scaled(&m);
	decode_slave_2(&m, CONFIG_RECORD_BOTH, &header, &d);
	CHECK_EQ(d.msg.count, HEAD_FIELDS + 4);
	CHECK(decoded_number(&d, "volts") == -4 * 0.5 + 1);
	CHECK_EQ(d.msg.field[ros2msg_find(&d.msg, "volts")].type, ROS2MSG_FLOAT);
	CHECK(decoded_number(&d, "volts_raw") == -4);
	CHECK(decoded_number(&d, "count") == 7);
	CHECK(decoded_number(&d, "volts_raw_2") == 9); /* a channel that has this name */
	ros2msg_done(&d.msg);
}

TEST(layout, only_physical_or_only_raw_values_are_recorded_where_asked_for)
{
	struct sample_header header = { .cycle = 1 };
	struct decoded d;
	struct meta m;

	fill_scaled(&m);
	decode_slave_2(&m, CONFIG_RECORD_PHYSICAL, &header, &d);
	CHECK_EQ(d.msg.count, HEAD_FIELDS + 3);
	CHECK(decoded_number(&d, "volts") == -1);
	CHECK(decoded_number(&d, "volts_raw") == 9);
	ros2msg_done(&d.msg);
	decode_slave_2(&m, CONFIG_RECORD_RAW, &header, &d);
	CHECK_EQ(d.msg.count, HEAD_FIELDS + 3);
	CHECK(decoded_number(&d, "volts") == -4);
	ros2msg_done(&d.msg);
}

TEST(layout, a_physical_value_of_a_bad_sample_is_not_a_number)
{
	struct sample_header header = { .slaves_bad = { { 1u << 2 } } };
	struct decoded d;
	struct meta m;

	fill_scaled(&m);
	decode_slave_2(&m, CONFIG_RECORD_BOTH, &header, &d);
	CHECK(isnan(decoded_number(&d, "volts")));
	CHECK(decoded_number(&d, "volts_raw") == -4); /* what the process image had */
	ros2msg_done(&d.msg);
}

TEST(layout, the_list_of_channels_has_each_once_with_both_fields)
{
	struct layout *l;
	struct meta m;
	char *text;

	fill_scaled(&m);
	CHECK_EQ(create_with(&m, CONFIG_RECORD_BOTH, &l), 0);
	text = layout_json(l);
	CHECK(strstr(text, "\"field\":\"volts\",\"raw_field\":\"volts_raw\"") != NULL);
	CHECK(strstr(text, "\"field\":\"count\",\"raw_field\":\"count\"") != NULL);
	CHECK(strstr(text, "\"field\":\"volts_raw\"") == NULL);
	free(text);
	layout_destroy(l);
	CHECK_EQ(create_with(&m, CONFIG_RECORD_PHYSICAL, &l), 0);
	text = layout_json(l);
	CHECK(strstr(text, "\"field\":\"volts\",\"raw_field\":null") != NULL);
	free(text);
	layout_destroy(l);
}

TEST(layout, a_bad_sample_is_said_in_the_message_of_its_slave_only)
{
	struct meta m;
	struct layout *l;
	size_t count;
	const struct layout_topic *t;
	struct sample_header header = { .slaves_bad = { { 1u << 2 } } };
	uint8_t image[IMAGE_BYTES] = { 0 };
	uint8_t buf[256];

	fill(&m);
	CHECK_EQ(create(&m, &l), 0);
	t = layout_topics(l, &count);
	layout_encode(&t[0], &header, image, UTC_NS, buf, sizeof(buf));
	CHECK_EQ(buf[4 + 36], 1);
	layout_encode(&t[1], &header, image, UTC_NS, buf, sizeof(buf));
	CHECK_EQ(buf[4 + 36], 0);
	layout_destroy(l);
}

/* bus.datagrams: per_slave with slave 2 lost: the flag is that of the cycle, not of each slave. */
TEST(layout, a_low_working_counter_does_not_make_the_other_slaves_samples_bad)
{
	struct meta m;
	struct layout *l;
	size_t count;
	const struct layout_topic *t;
	struct sample_header header = { .flags = SAMPLE_WKC_LOW, .slaves_bad = { { 1u << 2 } } };
	uint8_t image[IMAGE_BYTES] = { 0 };
	uint8_t buf[256];

	fill(&m);
	CHECK_EQ(create(&m, &l), 0);
	t = layout_topics(l, &count);
	layout_encode(&t[0], &header, image, UTC_NS, buf, sizeof(buf));
	CHECK_EQ(buf[4 + 36], 1);
	layout_encode(&t[1], &header, image, UTC_NS, buf, sizeof(buf));
	CHECK_EQ(buf[4 + 36], 0);
	layout_destroy(l);
}

TEST(layout, texts_survive_names_from_a_hostile_eeprom)
{
	struct meta m;
	struct layout *l;
	size_t count;
	const struct layout_topic *t;
	struct ros2msg msg;
	char *text;

	fill(&m);
	memset(m.slave[0].name, '\n', sizeof(m.slave[0].name) - 1);
	memset(m.slave[0].device, 0xff, sizeof(m.slave[0].device) - 1);
	memset(m.channel[0].name, '"', sizeof(m.channel[0].name) - 1);
	memset(m.channel[0].unit, '\n', sizeof(m.channel[0].unit) - 1);
	CHECK_EQ(create(&m, &l), 0);
	t = layout_topics(l, &count);
	text = layout_ros2msg(&t[0]);
	CHECK_EQ(ros2msg_parse(text, strlen(text), &msg), 0);
	CHECK_EQ(msg.count, HEAD_FIELDS + 6);
	ros2msg_done(&msg);
	free(text);
	text = layout_json(l);
	CHECK(strchr(text, '\n') == NULL);
	CHECK(strstr(text, "\\\"") != NULL);
	free(text);
	text = layout_idl(l);
	CHECK(strstr(text, "struct Unnamed {") != NULL);
	free(text);
	layout_destroy(l);
}

static const char *field(const char *name)
{
	static char buf[32];

	name_make_field(name, buf, sizeof(buf));
	return buf;
}

TEST(names, are_made_fit_for_ros_and_idl)
{
	char type[32];

	CHECK_STR(field("adc"), "adc");
	CHECK_STR(field("Status Word.1"), "status_word_1");
	CHECK_STR(field("__a__b__"), "a_b");
	CHECK_STR(field("3rd"), "n_3rd");
	CHECK_STR(field(""), "unnamed");
	CHECK_STR(field("\xc3\xa4"), "unnamed");
	CHECK_STR(field("switch"), "switch_value");
	CHECK_STR(field("a name that is much longer than the buffer"), "a_name_that_is_much_long");
	name_make_type("piccolo0_left", type, sizeof(type));
	CHECK_STR(type, "Piccolo0Left");
}

static int parse(const char *text)
{
	struct ros2msg msg;
	int r = ros2msg_parse(text, strlen(text), &msg);

	if (r == 0) {
		r = (int)msg.count;
		ros2msg_done(&msg);
	}
	return r;
}

TEST(ros2msg, flat_definitions_are_read_and_others_are_refused)
{
	CHECK_EQ(parse(""), 0);
	CHECK_EQ(parse("# only a comment\n\n  \n"), 0);
	CHECK_EQ(parse("uint8 a\nstring b # text\r\n  float64   c"), 3);
	CHECK_EQ(parse("uint8"), -EBADMSG);
	CHECK_EQ(parse("uint8 # a"), -EBADMSG);
	CHECK_EQ(parse("uint8[4] a"), -ENOTSUP);
	CHECK_EQ(parse("std_msgs/Header h"), 3);
	CHECK_EQ(parse("std_msgs/Header h\nuint8 a\n===\nMSG: std_msgs/Header\nTime x"), 4);
	CHECK_EQ(parse("std_msgs/Header"), -EBADMSG);
	CHECK_EQ(parse("std_msgs/Header h=1"), -ENOTSUP);
	CHECK_EQ(parse("std_msgs/String s"), -ENOTSUP);
	CHECK_EQ(parse("uint8 A=3"), -ENOTSUP);
	CHECK_EQ(parse("uint8 a 3"), -ENOTSUP);
}

TEST(ros2msg, strings_are_bounded_by_the_message)
{
	static const char text[] = "uint8 a\nstring s\nuint8 b\n";
	const uint8_t data[] = { 0, 1, 0, 0, 7, 0, 0, 0, 3, 0, 0, 0, 'h', 'i', 0, 9 };
	struct ros2msg msg;
	struct ros2msg_value v[3];
	uint8_t bad[sizeof(data)];

	CHECK_EQ(ros2msg_parse(text, strlen(text), &msg), 0);
	CHECK_EQ(ros2msg_decode(&msg, data, sizeof(data), v), 0);
	CHECK_EQ(v[0].raw, 7);
	CHECK_EQ(v[1].raw, 2);
	CHECK_MEM(v[1].text, "hi", 2);
	CHECK_EQ(v[2].raw, 9);
	memcpy(bad, data, sizeof(data));
	bad[8] = 200;
	CHECK_EQ(ros2msg_decode(&msg, bad, sizeof(bad), v), -EBADMSG);
	bad[1] = 0; /* big-endian */
	CHECK_EQ(ros2msg_decode(&msg, bad, sizeof(bad), v), -EBADMSG);
	CHECK_EQ(ros2msg_find(&msg, "b"), 2);
	CHECK_EQ(ros2msg_find(&msg, "c"), -ENOENT);
	ros2msg_done(&msg);
}

TEST(ros2msg, only_little_endian_cdr_with_a_whole_header_is_decoded)
{
	static const uint8_t good[] = { 0, 1, 0, 0, 7 };
	struct ros2msg_value v[1];
	struct ros2msg msg;
	uint8_t bad[sizeof(good)];

	CHECK_EQ(ros2msg_parse("uint8 a\n", 8, &msg), 0);
	CHECK_EQ(ros2msg_decode(&msg, good, sizeof(good), v), 0);
	CHECK_EQ(v[0].raw, 7);
	for (size_t len = 0; len < sizeof(good); len++) {
		CHECK_EQ(ros2msg_decode(&msg, good, len, v), -EBADMSG);
	}
	memcpy(bad, good, sizeof(bad));
	bad[0] = 1;
	CHECK_EQ(ros2msg_decode(&msg, bad, sizeof(bad), v), -EBADMSG);
	memcpy(bad, good, sizeof(bad));
	bad[1] = 0; /* big-endian */
	CHECK_EQ(ros2msg_decode(&msg, bad, sizeof(bad), v), -EBADMSG);
	ros2msg_done(&msg);
	/* A message without fields has a header, too. */
	CHECK_EQ(ros2msg_parse("", 0, &msg), 0);
	CHECK_EQ(ros2msg_decode(&msg, good, 4, v), 0);
	CHECK_EQ(ros2msg_decode(&msg, good, 3, v), -EBADMSG);
	ros2msg_done(&msg);
}
