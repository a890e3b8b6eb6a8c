/* SPDX-License-Identifier: MIT */
#include "publish/topics.h"

#include <dlfcn.h>
#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "base/clock.h"
#include "ecdaq.h"
#include "publish/dds_log.h"
#include "publish/domain.h"
#include "publish/gate.h"
#include "ros2.h"

enum { DEPTH_MIN = 16, COMMANDS_WAITING = 256 };

#define HISTORY_NS (10 * NS_PER_S)
#define DEADLINE_NS (100 * NS_PER_MS)
#define LIVELINESS_NS (2 * NS_PER_S)

struct row {
	const char *name;
	const dds_topic_descriptor_t *type;
	enum topic_access access;
	dds_durability_kind_t durability;
	int32_t depth;
};

#define TOPIC_ROW(member, topic, type_name, who, how_durable, how_deep)                            \
	{ .name = (topic),                                                                         \
	  .type = &type_name##_desc,                                                               \
	  .access = TOPIC_##who,                                                                   \
	  .durability = DDS_DURABILITY_##how_durable,                                              \
	  .depth = (how_deep) },

static const struct row rows[] = { DDS_TOPICS(TOPIC_ROW) };

static int32_t history_depth(const struct config *cfg, int32_t depth)
{
	int64_t cycles =
		depth == DEPTH_BLOCKS && cfg->dds_block_cycles > 0 ? cfg->dds_block_cycles : 1;
	int64_t computed = HISTORY_NS / (cfg->cycle_period_ns * cycles);

	if (depth > 0) {
		return depth;
	}
	return computed < DEPTH_MIN ? DEPTH_MIN : (int32_t)computed;
}

/* KEEP_LAST: a slow reader never blocks the writer. */
static dds_qos_t *writer_qos(const struct row *row, const struct config *cfg)
{
	dds_qos_t *qos = dds_create_qos();

	dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_MSECS(100));
	dds_qset_durability(qos, row->durability);
	dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, history_depth(cfg, row->depth));
	dds_qset_writer_data_lifecycle(qos, false);
	if (row->depth == DEPTH_CYCLES) {
		dds_qset_deadline(qos, DEADLINE_NS);
		dds_qset_liveliness(qos, DDS_LIVELINESS_AUTOMATIC, LIVELINESS_NS);
	}
	return qos;
}

static dds_qos_t *command_qos(const struct config *cfg)
{
	dds_qos_t *qos = dds_create_qos();

	dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_MSECS(100));
	dds_qset_history(qos, DDS_HISTORY_KEEP_ALL, 0);
	dds_qset_resource_limits(qos, COMMANDS_WAITING, DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
	dds_qset_liveliness(qos, DDS_LIVELINESS_AUTOMATIC, gate_lease_ns(cfg));
	return qos;
}

/* The writer or reader of one topic; negative: a DDS return code. */
static dds_entity_t open_one(const struct topics *t, const struct row *row,
			     const struct config *cfg, const dds_listener_t *on_command)
{
	dds_entity_t topic = dds_create_topic(t->participant, row->type, row->name, NULL, NULL);
	dds_entity_t opened = topic;
	dds_qos_t *qos;

	if (topic >= 0 && row->access == TOPIC_COMMAND) {
		qos = command_qos(cfg);
		opened = dds_create_reader(t->participant, topic, qos, on_command);
		dds_delete_qos(qos);
	} else if (topic >= 0) {
		qos = writer_qos(row, cfg);
		opened = dds_create_writer(t->participant, topic, qos, NULL);
		dds_delete_qos(qos);
	}
	return opened;
}

static int fail(const char *what, dds_return_t code, char *error, size_t error_bytes)
{
	snprintf(error, error_bytes, "DDS: %s: %s", what, dds_strretcode(-code));
	return -EIO;
}

/* Keys made before a topic existed do not allow it. Without samples they are no appliance's. */
static int is_left_out(const struct topics *t, const struct row *row, dds_entity_t opened)
{
	return opened == DDS_RETCODE_NOT_ALLOWED_BY_SECURITY && t->sample > 0 &&
	       (row->access & (TOPIC_PUBLISHED | TOPIC_MIRROR)) != 0;
}

static int open_all(struct topics *t, const struct config *cfg, const dds_listener_t *on_command,
		    char *error, size_t error_bytes)
{
#define TOPIC_ENTITY(member, ...) &t->member,
	dds_entity_t *const entities[] = { DDS_TOPICS(TOPIC_ENTITY) };

	for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
		dds_entity_t opened;

		if (rows[i].access == TOPIC_MIRROR && !cfg->dds_ros2_mirror) {
			continue;
		}
		opened = open_one(t, &rows[i], cfg, on_command);
		if (is_left_out(t, &rows[i], opened)) {
			fprintf(stderr,
				"ecdaq-dds: dds.security: these keys do not allow %s, which is not "
				"published: renew them with ecdaq security add-appliance\n",
				rows[i].name);
			continue;
		}
		if (opened < 0) {
			return fail(rows[i].name, opened, error, error_bytes);
		}
		*entities[i] = opened;
	}
	return 0;
}

static int open_waitset(struct topics *t, char *error, size_t error_bytes)
{
	dds_return_t r;

	t->waitset = dds_create_waitset(t->participant);
	dds_set_status_mask(t->command, DDS_DATA_AVAILABLE_STATUS | DDS_LIVELINESS_CHANGED_STATUS);
	r = t->waitset < 0 ? t->waitset : dds_waitset_attach(t->waitset, t->command, 1);
	return r < 0 ? fail("cannot create waitset", r, error, error_bytes) : 0;
}

static int find_plugins(char *ret_dir, size_t dir_bytes, char *error, size_t error_bytes)
{
	Dl_info library = { .dli_fname = NULL };

	if (dladdr((const void *)(uintptr_t)&dds_create_domain, &library) == 0 ||
	    domain_find_plugins(library.dli_fname, ret_dir, dir_bytes) < 0) {
		snprintf(error, error_bytes,
			 "dds.security: %s was installed without the DDS Security plug-ins",
			 library.dli_fname != NULL ? library.dli_fname : "Cyclone DDS");
		return -EIO;
	}
	return 0;
}

int topics_open(struct topics *topics, const struct config *cfg, const dds_listener_t *on_command,
		char *error, size_t error_bytes)
{
	char xml[DOMAIN_XML_BYTES];
	char plugins[CONFIG_PATH_BYTES] = "";
	int r = 0;

	memset(topics, 0, sizeof(*topics));
	if (domain_is_secure(cfg)) {
		r = find_plugins(plugins, sizeof(plugins), error, error_bytes);
	}
	if (r < 0) {
		return r;
	}
	if (domain_xml(cfg, plugins, xml, sizeof(xml)) < 0) {
		snprintf(error, error_bytes, "dds.peers: too many");
		return -EIO;
	}
	dds_log_begin();
	topics->domain = dds_create_domain(cfg->dds_domain, xml);
	if (topics->domain < 0) {
		return fail("domain", topics->domain, error, error_bytes);
	}
	topics->participant = dds_create_participant(cfg->dds_domain, NULL, NULL);
	if (topics->participant < 0) {
		return fail("participant", topics->participant, error, error_bytes);
	}
	r = open_all(topics, cfg, on_command, error, error_bytes);
	return r < 0 ? r : open_waitset(topics, error, error_bytes);
}

void topics_close(struct topics *topics)
{
	if (topics->domain > 0) {
		dds_delete(topics->domain);
		dds_log_end();
	}
	memset(topics, 0, sizeof(*topics));
}

int topics_write_now(dds_entity_t writer, const void *message)
{
	return writer != 0 && dds_write(writer, message) < 0 ? -EIO : 0;
}

int topics_write(dds_entity_t writer, const void *message, int64_t utc_ns)
{
	return writer != 0 && dds_write_ts(writer, message, utc_ns < 0 ? 0 : utc_ns) < 0 ? -EIO : 0;
}

int topics_take_command(const struct topics *topics, ecdaq_CommandV1 **ret_command,
			uint64_t *ret_sender)
{
	ecdaq_CommandV1 *command = ecdaq_CommandV1__alloc();
	void *message = command;
	dds_sample_info_t info;
	int taken;

	do {
		taken = dds_take(topics->command, &message, &info, 1, 1);
	} while (taken == 1 && !info.valid_data);
	if (taken != 1) {
		ecdaq_CommandV1_free(command, DDS_FREE_ALL);
		return 0;
	}
	*ret_command = command;
	*ret_sender = info.publication_handle;
	return 1;
}

void topics_wait(const struct topics *topics, int64_t timeout_ns)
{
	(void)dds_waitset_wait(topics->waitset, NULL, 0, timeout_ns);
	dds_log_tell();
}

uint32_t topics_reader_count(dds_entity_t writer)
{
	dds_return_t count = dds_get_matched_subscriptions(writer, NULL, 0);

	return count < 0 ? 0 : (uint32_t)count;
}
