/* SPDX-License-Identifier: MIT */
/*
 * hostile DOMAIN INTERFACE SECONDS: a peer that announces ecdaq's topics and type names with types
 * of its own, which have a uint8 and type information, reads and writes them, and sends garbage to
 * the ports of the participants. Prints "ready", then how much it sent.
 */
#include <arpa/inet.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "dds/dds.h"
#include "hostile_types.h"

enum { PACKET = 512, PORT_BASE = 7400, PORT_A_DOMAIN = 250, PORTS = 40 };

static uint32_t random_state = 12345;

static uint32_t random_next(void)
{
	random_state = random_state * 1664525u + 1013904223u;
	return random_state >> 8;
}

/* Half of the packets begin as an RTPS message does. */
static void send_garbage(int fd, const char *host, unsigned domain)
{
	static const uint8_t head[] = { 'R', 'T', 'P', 'S', 2, 1, 1, 16 };
	uint8_t packet[PACKET];
	size_t len = 8 + random_next() % (PACKET - 8);
	struct sockaddr_in to = {
		.sin_family = AF_INET,
		.sin_port = htons(
			(uint16_t)(PORT_BASE + PORT_A_DOMAIN * domain + random_next() % PORTS)),
	};

	for (size_t i = 0; i < len; i++) {
		packet[i] = (uint8_t)random_next();
	}
	if (random_next() % 2 == 0) {
		memcpy(packet, head, sizeof(head));
	}
	inet_pton(AF_INET, host, &to.sin_addr);
	(void)!sendto(fd, packet, len, 0, (const struct sockaddr *)&to, sizeof(to));
}

static dds_entity_t announce(const char *domain, const char *interface)
{
	char xml[512];
	dds_domainid_t id = (dds_domainid_t)strtoul(domain, NULL, 10);
	dds_entity_t participant;
	dds_entity_t sample;
	dds_entity_t command;
	dds_qos_t *qos = dds_create_qos();

	snprintf(xml, sizeof(xml),
		 "<General><Interfaces><NetworkInterface name=\"%s\"/></Interfaces></General>"
		 "<Discovery><ParticipantIndex>auto</ParticipantIndex></Discovery>",
		 interface);
	if (dds_create_domain(id, xml) < 0) {
		return -1;
	}
	participant = dds_create_participant(id, NULL, NULL);
	sample = dds_create_topic(participant, &ecdaq_SampleV1_desc, "ecdaq/sample", NULL, NULL);
	command = dds_create_topic(participant, &ecdaq_CommandV1_desc, "ecdaq/command", NULL, NULL);
	dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_MSECS(10));
	dds_qset_liveliness(qos, DDS_LIVELINESS_AUTOMATIC, DDS_MSECS(20));
	dds_create_reader(participant, sample, qos, NULL);
	command = dds_create_writer(participant, command, qos, NULL);
	dds_delete_qos(qos);
	return command;
}

int main(int argc, char **argv)
{
	dds_entity_t command = argc == 5 ? announce(argv[1], argv[2]) : -1;
	int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
	ecdaq_CommandV1 m = { .byte = 7 };
	time_t end;
	unsigned sent = 0;
	unsigned written = 0;

	if (command < 0 || fd < 0) {
		fputs("usage: hostile DOMAIN INTERFACE SECONDS HOST\n", stderr);
		return 2;
	}
	puts("ready");
	fflush(stdout);
	end = time(NULL) + strtol(argv[3], NULL, 10);
	while (time(NULL) < end) {
		for (int i = 0; i < 5; i++, sent++) {
			send_garbage(fd, argv[4], (unsigned)strtoul(argv[1], NULL, 10));
		}
		m.number = random_next();
		written += dds_write(command, &m) == 0;
		(void)poll(NULL, 0, 1); /* a pace, not a synchronisation */
	}
	printf("%u packets of garbage, %u wrong commands\n", sent, written);
	close(fd);
	return 0;
}
