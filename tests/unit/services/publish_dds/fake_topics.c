/* SPDX-License-Identifier: MIT */
#include "unit/services/publish_dds/fake_topics.h"

#include <string.h>

#include "harness/test.h"

enum { QUEUE = 512 };

static struct {
	fake_writer on_write;
	ecdaq_CommandV1 *command[QUEUE];
	uint64_t sender[QUEUE];
	size_t taken;
	size_t queued;
} fake;

static struct topics numbered(void)
{
	struct topics t = { .domain = 1 };
	dds_entity_t next = 1;

#define TOPIC_NUMBER(member, ...) t.member = ++next;
	DDS_TOPICS(TOPIC_NUMBER)
	return t;
}

struct topics fake_topics(fake_writer on_write)
{
	while (fake.taken < fake.queued) {
		ecdaq_CommandV1_free(fake.command[fake.taken++], DDS_FREE_ALL);
	}
	memset(&fake, 0, sizeof(fake));
	fake.on_write = on_write;
	return numbered();
}

static void copy_sequence(const void *from, size_t bytes, void **ret_to)
{
	*ret_to = bytes == 0 ? NULL : memcpy(dds_alloc(bytes), from, bytes);
}

void fake_topics_command(const ecdaq_CommandV1 *command, uint64_t sender)
{
	ecdaq_CommandV1 *copy = ecdaq_CommandV1__alloc();
	void *buffer;

	CHECK(fake.queued < QUEUE);
	*copy = *command;
	copy->commander = dds_string_dup(command->commander);
	copy_sequence(command->channel._buffer, command->channel._length * sizeof(char *), &buffer);
	copy->channel._buffer = buffer;
	for (uint32_t i = 0; i < command->channel._length; i++) {
		copy->channel._buffer[i] = dds_string_dup(command->channel._buffer[i]);
	}
	copy_sequence(command->values._buffer, command->values._length * sizeof(double), &buffer);
	copy->values._buffer = buffer;
	copy_sequence(command->raw._buffer, command->raw._length * sizeof(uint64_t), &buffer);
	copy->raw._buffer = buffer;
	copy->channel._release = copy->values._release = copy->raw._release = true;
	fake.command[fake.queued] = copy;
	fake.sender[fake.queued++] = sender;
}

int topics_open(struct topics *topics, const struct config *cfg, const dds_listener_t *on_command,
		char *error, size_t error_bytes)
{
	(void)cfg;
	(void)on_command;
	(void)error;
	(void)error_bytes;
	*topics = numbered();
	return 0;
}

void topics_close(struct topics *topics)
{
	memset(topics, 0, sizeof(*topics));
}

int topics_write(dds_entity_t writer, const void *message, int64_t utc_ns)
{
	fake.on_write(writer, message, utc_ns);
	return 0;
}

int topics_write_now(dds_entity_t writer, const void *message)
{
	fake.on_write(writer, message, 0);
	return 0;
}

int topics_take_command(const struct topics *topics, ecdaq_CommandV1 **ret_command,
			uint64_t *ret_sender)
{
	(void)topics;
	if (fake.taken == fake.queued) {
		return 0;
	}
	*ret_command = fake.command[fake.taken];
	*ret_sender = fake.sender[fake.taken++];
	return 1;
}

void topics_wait(const struct topics *topics, int64_t timeout_ns)
{
	(void)topics;
	(void)timeout_ns;
}

uint32_t topics_reader_count(dds_entity_t writer)
{
	return writer > 0 ? 1 : 0;
}
