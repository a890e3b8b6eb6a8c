/* SPDX-License-Identifier: MIT */
#include "publish/domain.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

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

	CHECK_EQ(domain_xml(with("lo", ""), "", xml, sizeof(xml)), 0);
	CHECK(strstr(xml, "<AllowMulticast>false<") != NULL);
	CHECK(strstr(xml, "<Peer Address=\"localhost\"/>") != NULL);
}

TEST(publish_domain, peers_and_tag_are_handed_on)
{
	struct config *cfg = with("eth1", "10.0.0.1,,pc");
	char xml[DOMAIN_XML_BYTES];

	snprintf(cfg->dds_tag, sizeof(cfg->dds_tag), "bench");
	CHECK_EQ(domain_xml(cfg, "", xml, sizeof(xml)), 0);
	CHECK(strstr(xml, "name=\"eth1\"") != NULL);
	CHECK(strstr(xml, "<AllowMulticast>true<") != NULL);
	CHECK(strstr(xml, "<Peer Address=\"10.0.0.1\"/><Peer Address=\"pc\"/></Peers>") != NULL);
	CHECK(strstr(xml, "<Tag>bench</Tag>") != NULL);
	CHECK_EQ(domain_xml(cfg, "", xml, 100), -E2BIG);
}

TEST(publish_domain, nic_of_the_segment_and_unknown_ones_are_refused)
{
	char error[128];

	CHECK_EQ(domain_check_interface(with("lo", ""), "lo", error, sizeof(error)), -EINVAL);
	CHECK_STR(error, "dds.interface: lo: in use for the EtherCAT segment");
	CHECK_EQ(domain_check_interface(with("nowhere0", ""), "", error, sizeof(error)), -ENODEV);
	CHECK_EQ(domain_check_interface(with("lo", ""), "eth7", error, sizeof(error)), 0);
}

TEST(publish_domain, security_names_the_plug_ins_and_our_keys_and_is_else_not_there)
{
	struct config *cfg = with("eth1", "");
	char xml[DOMAIN_XML_BYTES];

	CHECK_EQ(domain_xml(cfg, "/lib/dds", xml, sizeof(xml)), 0);
	CHECK(strstr(xml, "Security") == NULL);
	CHECK(!domain_is_secure(cfg) && !domain_takes_commands(cfg));
	snprintf(cfg->dds_security, sizeof(cfg->dds_security), "/keys/appliance");
	CHECK(domain_is_secure(cfg) && domain_takes_commands(cfg));
	CHECK_EQ(domain_xml(cfg, "/lib/dds", xml, sizeof(xml)), 0);
	CHECK(strstr(xml, "path=\"/lib/dds/libdds_security_ac.so\" "
			  "initFunction=\"init_access_control\"") != NULL);
	CHECK(strstr(xml, "<PrivateKey>file:/keys/appliance/key.pem</PrivateKey>") != NULL);
	CHECK_EQ(domain_xml(cfg, "/lib/dds", xml, 1000), -E2BIG);
}

TEST(publish_domain, the_plug_ins_are_found_beside_the_library_or_in_their_own_folder)
{
	char top[] = "/tmp/ecdaq-plug-XXXXXX";
	char folder[64];
	char library[64];
	char plugin[128];
	char found[128] = "untouched";

	CHECK(mkdtemp(top) != NULL);
	snprintf(library, sizeof(library), "%s/libddsc.so.0", top);
	snprintf(folder, sizeof(folder), "%s/libddsc0x", top);
	CHECK_EQ(domain_find_plugins(library, found, sizeof(found)), -ENOENT);
	CHECK_EQ(domain_find_plugins("libddsc.so.0", found, sizeof(found)), -ENOENT);
	CHECK_STR(found, "untouched");
	CHECK_EQ(mkdir(folder, 0700), 0);
	snprintf(plugin, sizeof(plugin), "%s/libdds_security_auth.so", folder);
	fclose(fopen(plugin, "w"));
	CHECK_EQ(domain_find_plugins(library, found, sizeof(found)), 0);
	CHECK_STR(found, folder);
	unlink(plugin);
	rmdir(folder);
	rmdir(top);
}

TEST(publish_domain, keys_that_are_not_there_are_one_line_and_none_are_no_trouble)
{
	struct config *cfg = with("eth1", "");
	char said[DOMAIN_IDENTITY_BYTES] = "x";
	char error[256] = "";

	CHECK_EQ(domain_check_security(cfg, said, error, sizeof(error)), 0);
	CHECK_STR(said, "");
	snprintf(cfg->dds_security, sizeof(cfg->dds_security), "/nowhere/keys");
	CHECK_EQ(domain_check_security(cfg, said, error, sizeof(error)), -EKEYREJECTED);
	CHECK_STR(error, "dds.security: /nowhere/keys/key.pem: No such file or directory");
}
