/* SPDX-License-Identifier: MIT */
#include "publish/topics.h"

#include <dlfcn.h>
#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "base/clock.h"
#include "ecdaq.h"
#include "publish/domain.h"
#include "publish/gate.h"
#include "ros2.h"

enum { DEPTH_MIN = 16, DEPTH_EVENTS = 1024, DEPTH_REPLIES = 100, COMMANDS_WAITING = 256 };

#define HISTORY_NS (10 * NS_PER_S)
#define DEADLINE_NS (100 * NS_PER_MS)
#define LIVELINESS_NS (2 * NS_PER_S)

static int32_t depth_of(const struct config *cfg, uint32_t cycles_each)
{
	int64_t depth = HISTORY_NS / (cfg->cycle_period_ns * (int64_t)cycles_each);

	return depth < DEPTH_MIN ? DEPTH_MIN : (int32_t)depth;
}

/* KEEP_LAST: a reader that stands still never holds the writer up. */
static dds_qos_t *reliable(dds_durability_kind_t durability, int32_t depth)
{
	dds_qos_t *qos = dds_create_qos();

	dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_MSECS(100));
	dds_qset_durability(qos, durability);
	dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, depth);
	dds_qset_writer_data_lifecycle(qos, false);
	return qos;
}

static dds_qos_t *data(int32_t depth)
{
	dds_qos_t *qos = reliable(DDS_DURABILITY_VOLATILE, depth);

	dds_qset_deadline(qos, DEADLINE_NS);
	dds_qset_liveliness(qos, DDS_LIVELINESS_AUTOMATIC, LIVELINESS_NS);
	return qos;
}

static dds_qos_t *state(void)
{
	return reliable(DDS_DURABILITY_TRANSIENT_LOCAL, 1);
}

static dds_qos_t *commands(const struct config *cfg)
{
	dds_qos_t *qos = dds_create_qos();

	dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_MSECS(100));
	dds_qset_history(qos, DDS_HISTORY_KEEP_ALL, 0);
	dds_qset_resource_limits(qos, COMMANDS_WAITING, DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
	dds_qset_liveliness(qos, DDS_LIVELINESS_AUTOMATIC, gate_lease_ns(cfg));
	return qos;
}

/* Takes over @qos. A negative entity stands for the failure of all that follows. */
static dds_entity_t writer(const struct topics *t, const dds_topic_descriptor_t *type,
			   const char *name, dds_qos_t *qos)
{
	dds_entity_t topic = dds_create_topic(t->participant, type, name, NULL, NULL);
	dds_entity_t made = topic < 0 ? topic : dds_create_writer(t->participant, topic, qos, NULL);

	dds_delete_qos(qos);
	return made;
}

/* Keys that are older than this topic do not allow it: all else goes on without. */
static dds_entity_t sync0_writer(const struct topics *t)
{
	dds_entity_t made = writer(t, &ecdaq_Sync0V1_desc, "ecdaq/sync0",
				   reliable(DDS_DURABILITY_TRANSIENT_LOCAL, DEPTH_MIN));

	return made == DDS_RETCODE_NOT_ALLOWED_BY_SECURITY ? 0 : made;
}

static dds_entity_t command_reader(const struct topics *t, const struct config *cfg,
				   const dds_listener_t *on_command)
{
	dds_entity_t topic = dds_create_topic(t->participant, &ecdaq_CommandV1_desc,
					      "ecdaq/command", NULL, NULL);
	dds_qos_t *qos = commands(cfg);
	dds_entity_t made =
		topic < 0 ? topic : dds_create_reader(t->participant, topic, qos, on_command);

	dds_delete_qos(qos);
	return made;
}

static int fail(const char *what, dds_return_t code, char *error, size_t error_bytes)
{
	snprintf(error, error_bytes, "DDS: %s: %s", what, dds_strretcode(-code));
	return -EIO;
}

static int make_all(struct topics *t, const struct config *cfg, const dds_listener_t *on_command,
		    char *error, size_t error_bytes)
{
	uint32_t block = cfg->dds_block_cycles > 0 ? cfg->dds_block_cycles : 1;
	struct {
		const char *name;
		dds_entity_t made;
	} all[] = {
		{ "ecdaq/sample", t->sample = writer(t, &ecdaq_SampleV1_desc, "ecdaq/sample",
						     data(depth_of(cfg, 1))) },
		{ "ecdaq/block",
		  t->block = writer(t, &ecdaq_BlockV1_desc, "ecdaq/block",
				    reliable(DDS_DURABILITY_VOLATILE, depth_of(cfg, block))) },
		{ "ecdaq/channels",
		  t->channels = writer(t, &ecdaq_ChannelsV1_desc, "ecdaq/channels", state()) },
		{ "ecdaq/status",
		  t->status = writer(t, &ecdaq_StatusV1_desc, "ecdaq/status", state()) },
		{ "ecdaq/event",
		  t->event = writer(t, &ecdaq_EventV1_desc, "ecdaq/event",
				    reliable(DDS_DURABILITY_VOLATILE, DEPTH_EVENTS)) },
		{ "ecdaq/timemap",
		  t->timemap = writer(t, &ecdaq_TimeMapV1_desc, "ecdaq/timemap", state()) },
		{ "ecdaq/sync0", t->sync0 = sync0_writer(t) },
		{ "ecdaq/idl", t->idl = writer(t, &ecdaq_IdlV1_desc, "ecdaq/idl", state()) },
		{ "ecdaq/reply",
		  t->reply = writer(t, &ecdaq_ReplyV1_desc, "ecdaq/reply",
				    reliable(DDS_DURABILITY_VOLATILE, DEPTH_REPLIES)) },
		{ "rt/ecdaq/sample",
		  t->ros2_sample = cfg->dds_ros2_mirror
					   ? writer(t, &ecdaq_msgs_msg_dds__Sample__desc,
						    "rt/ecdaq/sample", data(depth_of(cfg, 1)))
					   : 0 },
		{ "ecdaq/command", t->command = command_reader(t, cfg, on_command) },
	};

	for (size_t i = 0; i < sizeof(all) / sizeof(all[0]); i++) {
		if (all[i].made < 0) {
			return fail(all[i].name, all[i].made, error, error_bytes);
		}
	}
	return 0;
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
	topics->domain = dds_create_domain(cfg->dds_domain, xml);
	if (topics->domain < 0) {
		return fail("domain", topics->domain, error, error_bytes);
	}
	topics->participant = dds_create_participant(cfg->dds_domain, NULL, NULL);
	if (topics->participant < 0) {
		return fail("participant", topics->participant, error, error_bytes);
	}
	return make_all(topics, cfg, on_command, error, error_bytes);
}

void topics_close(struct topics *topics)
{
	if (topics->domain > 0) {
		dds_delete(topics->domain);
	}
	memset(topics, 0, sizeof(*topics));
}

int topics_write_now(dds_entity_t writer, const void *message)
{
	return dds_write(writer, message) < 0 ? -EIO : 0;
}

int topics_write(dds_entity_t writer, const void *message, int64_t utc_ns)
{
	return dds_write_ts(writer, message, utc_ns < 0 ? 0 : utc_ns) < 0 ? -EIO : 0;
}
