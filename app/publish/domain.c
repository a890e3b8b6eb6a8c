/* SPDX-License-Identifier: MIT */
#include "publish/domain.h"

#include <errno.h>
#include <net/if.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

struct text {
	char *at;
	size_t left;
	int is_full;
};

__attribute__((format(printf, 2, 3))) static void add(struct text *text, const char *format, ...)
{
	va_list args;
	int len;

	va_start(args, format);
	len = vsnprintf(text->at, text->left, format, args);
	va_end(args);
	if (len < 0 || (size_t)len >= text->left) {
		text->is_full = 1;
		return;
	}
	text->at += len;
	text->left -= (size_t)len;
}

static void add_peers(struct text *text, const char *peers)
{
	while (*peers != '\0') {
		size_t len = strcspn(peers, ",");

		if (len > 0) {
			add(text, "<Peer Address=\"%.*s\"/>", (int)len, peers);
		}
		peers += len + (peers[len] == ',');
	}
}

int domain_xml(const struct config *cfg, char *ret_xml, size_t xml_bytes)
{
	struct text text = { .at = ret_xml, .left = xml_bytes };
	/* Linux' lo does not multicast: participants there find each other by address. */
	int is_loopback = strcmp(cfg->dds_interface, "lo") == 0;
	int has_multicast = cfg->dds_multicast && !is_loopback;

	add(&text,
	    "<General><Interfaces><NetworkInterface name=\"%s\" presence_required=\"false\"/>",
	    cfg->dds_interface);
	add(&text, "</Interfaces><AllowMulticast>%s</AllowMulticast></General><Discovery>",
	    has_multicast ? "true" : "false");
	/* With the default index (none) nobody could be found by address alone. */
	add(&text, "<ParticipantIndex>auto</ParticipantIndex>");
	add(&text, "<MaxAutoParticipantIndex>99</MaxAutoParticipantIndex>");
	if (cfg->dds_tag[0] != '\0') {
		add(&text, "<Tag>%s</Tag>", cfg->dds_tag);
	}
	if (is_loopback || cfg->dds_peers[0] != '\0') {
		add(&text, "<Peers>");
		add_peers(&text, is_loopback ? "localhost" : "");
		add_peers(&text, cfg->dds_peers);
		add(&text, "</Peers>");
	}
	add(&text, "</Discovery>");
	return text.is_full ? -E2BIG : 0;
}

int domain_check_interface(const struct config *cfg, const char *ethercat, char *error,
			   size_t error_bytes)
{
	if (strcmp(cfg->dds_interface, ethercat) == 0 ||
	    strcmp(cfg->dds_interface, cfg->interface) == 0) {
		snprintf(error, error_bytes, "dds.interface: %s is the EtherCAT segment's",
			 cfg->dds_interface);
		return -EINVAL;
	}
	if (if_nametoindex(cfg->dds_interface) == 0) {
		snprintf(error, error_bytes, "dds.interface: %s: no such network interface",
			 cfg->dds_interface);
		return -ENODEV;
	}
	return 0;
}
