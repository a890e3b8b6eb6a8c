/* SPDX-License-Identifier: MIT */
/*
 * secured DOMAIN INTERFACE KEYS SECONDS RESULT_S [OUTPUT VALUE]: a participant on the PC with the
 * keys of the folder KEYS (none: "-"), configured as ecdaq-dds configures itself. Listens until it
 * has heard enough samples, and with OUTPUT commands it until that is accepted; then for RESULT_S
 * seconds at most for a result of ecdaq-sync0. All that for SECONDS at most. Prints one line of
 * JSON at the end.
 */
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "dds/dds.h"
#include "ecdaq.h"
#include "publish/domain.h"

enum { AT_ONCE = 64, PERIOD_MS = 50, ENOUGH = 100 };

struct pc {
	dds_entity_t domain;
	dds_entity_t participant;
	dds_entity_t sample;
	dds_entity_t sync0;
	dds_entity_t reply;
	dds_entity_t command;
	long samples;
	long results; /* of ecdaq-sync0 */
	unsigned long long id;
	int is_answered;
	int is_accepted;
	char reason[256];
};

static dds_qos_t *reliable(void)
{
	dds_qos_t *qos = dds_create_qos();

	dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_MSECS(100));
	dds_qset_history(qos, DDS_HISTORY_KEEP_ALL, 0);
	return qos;
}

static int join(struct pc *pc, char **argv)
{
	static struct config cfg;
	char xml[DOMAIN_XML_BYTES];
	char plugins[256] = "";
	Dl_info library;

	config_defaults(&cfg);
	cfg.dds_domain = (uint32_t)strtoul(argv[1], NULL, 10);
	snprintf(cfg.dds_interface, sizeof(cfg.dds_interface), "%s", argv[2]);
	if (strcmp(argv[3], "-") != 0) {
		snprintf(cfg.dds_security, sizeof(cfg.dds_security), "%s", argv[3]);
	}
	if (dladdr((const void *)(uintptr_t)&dds_create_domain, &library) == 0 ||
	    domain_find_plugins(library.dli_fname, plugins, sizeof(plugins)) < 0 ||
	    domain_xml(&cfg, plugins, xml, sizeof(xml)) < 0) {
		return -1;
	}
	pc->domain = dds_create_domain(cfg.dds_domain, xml);
	pc->participant = dds_create_participant(cfg.dds_domain, NULL, NULL);
	return pc->participant < 0 ? -1 : 0;
}

static dds_entity_t topic(const struct pc *pc, const dds_topic_descriptor_t *type, const char *name)
{
	return dds_create_topic(pc->participant, type, name, NULL, NULL);
}

/* An entity rejected by permissions is not an error: it is the result under test. */
static void open_all(struct pc *pc, int is_commander)
{
	dds_qos_t *qos = reliable();

	pc->sample = dds_create_reader(pc->participant,
				       topic(pc, &ecdaq_SampleV1_desc, "ecdaq/sample"), qos, NULL);
	dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
	pc->sync0 = dds_create_reader(pc->participant,
				      topic(pc, &ecdaq_Sync0V1_desc, "ecdaq/sync0"), qos, NULL);
	dds_qset_durability(qos, DDS_DURABILITY_VOLATILE);
	if (is_commander) {
		pc->reply = dds_create_reader(
			pc->participant, topic(pc, &ecdaq_ReplyV1_desc, "ecdaq/reply"), qos, NULL);
		dds_qset_liveliness(qos, DDS_LIVELINESS_AUTOMATIC, DDS_MSECS(1000));
		dds_qset_lifespan(qos, DDS_SECS(1));
		pc->command = dds_create_writer(pc->participant,
						topic(pc, &ecdaq_CommandV1_desc, "ecdaq/command"),
						qos, NULL);
	}
	dds_delete_qos(qos);
}

static void take(struct pc *pc)
{
	void *messages[AT_ONCE] = { NULL };
	dds_sample_info_t info[AT_ONCE];
	int n;

	while ((n = dds_take(pc->sample, messages, info, AT_ONCE, AT_ONCE)) > 0) {
		pc->samples += n;
		dds_return_loan(pc->sample, messages, n);
	}
	messages[0] = NULL;
	while (pc->sync0 > 0 && (n = dds_take(pc->sync0, messages, info, AT_ONCE, AT_ONCE)) > 0) {
		pc->results += n;
		dds_return_loan(pc->sync0, messages, n);
	}
	messages[0] = NULL;
	while (pc->reply > 0 && (n = dds_take(pc->reply, messages, info, AT_ONCE, AT_ONCE)) > 0) {
		for (int i = 0; i < n; i++) {
			const ecdaq_ReplyV1 *reply = messages[i];

			pc->is_answered = 1;
			pc->is_accepted = reply->is_accepted;
			snprintf(pc->reason, sizeof(pc->reason), "%s", reply->reason);
		}
		dds_return_loan(pc->reply, messages, n);
	}
}

static void command(struct pc *pc, char *output, double value)
{
	char name[] = "secured";
	ecdaq_CommandV1 m = { .commander = name,
			      .id = ++pc->id,
			      .channel = { ._maximum = 1, ._length = 1, ._buffer = &output },
			      .values = { ._maximum = 1, ._length = 1, ._buffer = &value } };

	if (pc->command > 0 && !pc->is_accepted) {
		(void)dds_write(pc->command, &m);
	}
}

/* @output: NULL: nothing to command. */
static void run(struct pc *pc, time_t seconds, time_t result_s, char *output, double value)
{
	time_t end = time(NULL) + seconds;
	time_t had = 0; /* all but a result */

	while (time(NULL) < end) {
		if (output != NULL) {
			command(pc, output, value);
		}
		dds_sleepfor(DDS_MSECS(PERIOD_MS)); /* a pace, not a synchronisation */
		take(pc);
		if (pc->samples <= ENOUGH || (output != NULL && !pc->is_accepted)) {
			continue;
		}
		had = had == 0 ? time(NULL) : had;
		if (pc->results > 0 || time(NULL) >= had + result_s) {
			return;
		}
	}
}

int main(int argc, char **argv)
{
	struct pc pc = { .samples = 0 };
	int is_commander = argc == 8;

	if ((argc != 6 && argc != 8) || join(&pc, argv) < 0) {
		fputs("secured: cannot join\n", stderr);
		return 2;
	}
	open_all(&pc, is_commander);
	run(&pc, strtol(argv[4], NULL, 10), strtol(argv[5], NULL, 10),
	    is_commander ? argv[6] : NULL, is_commander ? strtod(argv[7], NULL) : 0);
	printf("{\"samples\": %ld, \"results\": %ld, \"sent\": %llu, \"reader\": %d, \"writer\": "
	       "%d, \"answered\": "
	       "%d, "
	       "\"accepted\": %d, \"reason\": \"%s\"}\n",
	       pc.samples, pc.results, pc.id, pc.sample > 0, pc.command > 0, pc.is_answered,
	       pc.is_accepted, pc.reason);
	/* The whole domain: its threads use libcrypto, which ends with the process. */
	dds_delete(pc.domain);
	return 0;
}
