/* SPDX-License-Identifier: MIT */
#include "publish/domain.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "harness/test.h"

static struct config *with(const char *interface, const char *peers)
{
	static struct config cfg;

	config_defaults(&cfg);
	snprintf(cfg.dds_interface, sizeof(cfg.dds_interface), "%s", interface);
	snprintf(cfg.dds_peers, sizeof(cfg.dds_peers), "%s", peers);
	return &cfg;
}

TEST(publish_domain, loopback_goes_without_multicast_and_knows_itself)
{
	char xml[DOMAIN_XML_BYTES];

	CHECK_EQ(domain_xml(with("lo", ""), xml, sizeof(xml)), 0);
	CHECK(strstr(xml, "<AllowMulticast>false<") != NULL);
	CHECK(strstr(xml, "<Peer Address=\"localhost\"/>") != NULL);
}

TEST(publish_domain, peers_and_tag_are_handed_on)
{
	struct config *cfg = with("eth1", "10.0.0.1,,pc");
	char xml[DOMAIN_XML_BYTES];

	snprintf(cfg->dds_tag, sizeof(cfg->dds_tag), "bench");
	CHECK_EQ(domain_xml(cfg, xml, sizeof(xml)), 0);
	CHECK(strstr(xml, "name=\"eth1\"") != NULL);
	CHECK(strstr(xml, "<AllowMulticast>true<") != NULL);
	CHECK(strstr(xml, "<Peer Address=\"10.0.0.1\"/><Peer Address=\"pc\"/></Peers>") != NULL);
	CHECK(strstr(xml, "<Tag>bench</Tag>") != NULL);
	CHECK_EQ(domain_xml(cfg, xml, 100), -E2BIG);
}

TEST(publish_domain, nic_of_the_segment_and_unknown_ones_are_refused)
{
	char error[128];

	CHECK_EQ(domain_check_interface(with("lo", ""), "lo", error, sizeof(error)), -EINVAL);
	CHECK_STR(error, "dds.interface: lo is the EtherCAT segment's");
	CHECK_EQ(domain_check_interface(with("nowhere0", ""), "", error, sizeof(error)), -ENODEV);
	CHECK_EQ(domain_check_interface(with("lo", ""), "eth7", error, sizeof(error)), 0);
}
