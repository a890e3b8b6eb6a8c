/* SPDX-License-Identifier: MIT */
/*
 * subscriber DOMAIN INTERFACE SECONDS OUT [sample|block|lossy]: what comes on ecdaq/sample or
 * ecdaq/block, as CSV, for some seconds or until SIGTERM. On a plain Cyclone DDS reader, as a C
 * user would write one; "lossy" is ecdaq/sample BEST_EFFORT. Prints "ready" when the publisher is
 * there.
 */
#include <inttypes.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "dds/dds.h"
#include "ecdaq.h"

enum { AT_ONCE = 256, NS = 1000000000 };

static volatile sig_atomic_t is_stopped;

static void stop(int number)
{
	(void)number;
	is_stopped = 1;
}

static int64_t now_ns(void)
{
	struct timespec now;

	clock_gettime(CLOCK_MONOTONIC, &now);
	return now.tv_sec * INT64_C(1000000000) + now.tv_nsec;
}

static dds_entity_t make_reader(const char *domain, const char *interface, const char *what)
{
	char xml[512];
	dds_domainid_t id = (dds_domainid_t)strtoul(domain, NULL, 10);
	dds_qos_t *qos = dds_create_qos();
	dds_entity_t participant;
	dds_entity_t topic;
	dds_entity_t reader;

	snprintf(xml, sizeof(xml),
		 "<General><Interfaces><NetworkInterface name=\"%s\"/></Interfaces></General>"
		 "<Discovery><ParticipantIndex>auto</ParticipantIndex></Discovery>",
		 interface);
	if (dds_create_domain(id, xml) < 0) {
		return -1;
	}
	participant = dds_create_participant(id, NULL, NULL);
	topic = strcmp(what, "block") == 0 ? dds_create_topic(participant, &ecdaq_BlockV1_desc,
							      "ecdaq/block", NULL, NULL)
					   : dds_create_topic(participant, &ecdaq_SampleV1_desc,
							      "ecdaq/sample", NULL, NULL);
	dds_qset_reliability(qos,
			     strcmp(what, "lossy") == 0 ? DDS_RELIABILITY_BEST_EFFORT
							: DDS_RELIABILITY_RELIABLE,
			     DDS_MSECS(100));
	dds_qset_history(qos, DDS_HISTORY_KEEP_ALL, 0);
	reader = dds_create_reader(participant, topic, qos, NULL);
	dds_delete_qos(qos);
	return reader;
}

static void put_raw(FILE *out, const uint64_t *raw, uint32_t n)
{
	for (uint32_t i = 0; i < n; i++) {
		fprintf(out, "%s%" PRIu64, i > 0 ? " " : "", raw[i]);
	}
}

static void put_sample(FILE *out, const void *message, int64_t taken_ns)
{
	const ecdaq_SampleV1 *s = message;

	fprintf(out, "%u,%" PRIu64 ",%" PRIu64 ",%" PRId64 ",%u,%d,%.17g,%" PRIu64 ",%" PRId64 ",",
		s->slave, s->session, s->cycle, s->dc_time_ns, s->flags, s->is_good, s->adc,
		s->counter, s->sample_time_ns);
	put_raw(out, s->raw._buffer, s->raw._length);
	fprintf(out, ",%" PRId64 "\n", taken_ns);
}

static void put_block(FILE *out, const void *message, int64_t taken_ns)
{
	const ecdaq_BlockV1 *b = message;

	for (uint32_t k = 0; k < b->count; k++) {
		fprintf(out,
			"%u,%" PRIu64 ",%" PRIu64 ",%" PRId64 ",%u,%d,%.17g,%" PRIu64 ",%" PRId64
			",",
			b->slave, b->session, b->cycle._buffer[k], b->dc_time_ns._buffer[k],
			b->flags._buffer[k], b->is_good._buffer[k], b->adc._buffer[k],
			b->counter._buffer[k], b->sample_time_ns._buffer[k]);
		put_raw(out, b->raw._buffer + (size_t)k * b->channel_count, b->channel_count);
		fprintf(out, ",%" PRId64 "\n", taken_ns);
	}
}

static void take(dds_entity_t reader, FILE *out, int is_block)
{
	void *messages[AT_ONCE] = { NULL };
	dds_sample_info_t info[AT_ONCE];
	int n;

	while ((n = dds_take(reader, messages, info, AT_ONCE, AT_ONCE)) > 0) {
		int64_t taken_ns = now_ns();

		for (int i = 0; i < n; i++) {
			if (info[i].valid_data) {
				(is_block ? put_block : put_sample)(out, messages[i], taken_ns);
			}
		}
		dds_return_loan(reader, messages, n);
	}
}

int main(int argc, char **argv)
{
	const char *what = argc == 6 ? argv[5] : "sample";
	dds_entity_t reader = argc == 5 || argc == 6 ? make_reader(argv[1], argv[2], what) : -1;
	FILE *out = reader < 0 ? NULL : fopen(argv[4], "w");
	dds_entity_t waitset;
	int64_t end;

	if (out == NULL) {
		fputs("usage: subscriber DOMAIN INTERFACE SECONDS OUT [sample|block|lossy]\n",
		      stderr);
		return 2;
	}
	(void)signal(SIGTERM, stop);
	fputs("slave,session,cycle,dc_time_ns,flags,is_good,adc,counter,sample_time_ns,raw,"
	      "taken_ns\n",
	      out);
	waitset = dds_create_waitset(dds_get_participant(reader));
	dds_set_status_mask(reader, DDS_DATA_AVAILABLE_STATUS);
	dds_waitset_attach(waitset, reader, 1);
	dds_waitset_wait(waitset, NULL, 0, DDS_SECS(20));
	puts("ready");
	fflush(stdout);
	end = now_ns() + (int64_t)(strtod(argv[3], NULL) * NS);
	while (!is_stopped && now_ns() < end) {
		dds_waitset_wait(waitset, NULL, 0, DDS_MSECS(100));
		take(reader, out, strcmp(what, "block") == 0);
	}
	return fclose(out) == 0 ? 0 : 1;
}
