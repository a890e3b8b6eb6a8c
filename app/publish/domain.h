/* SPDX-License-Identifier: MIT */
/*
 * The DDS domain's configuration, from ours: one named interface, multicast or not, peers, tag.
 * Given to Cyclone DDS as XML; nothing comes from its environment. Context: blocking.
 */
#ifndef PUBLISH_DOMAIN_H
#define PUBLISH_DOMAIN_H

#include <stddef.h>

#include "config/config.h"

enum { DOMAIN_XML_BYTES = 8192 };

/** DDS Security is in use. */
static inline int domain_is_secure(const struct config *cfg)
{
	return cfg->dds_security[0] != '\0';
}

/** Only those who may command can, or it was said that anybody may. */
static inline int domain_takes_commands(const struct config *cfg)
{
	return domain_is_secure(cfg) || cfg->dds_allow_insecure_commands != 0;
}

/** 0, or -E2BIG. @cfg has passed config_check(): nothing in it needs escaping. */
int domain_xml(const struct config *cfg, char *ret_xml, size_t xml_bytes);

/**
 * May DDS use @cfg's interface? 0; or -errno with one line in @error: -ENODEV there is none of that
 * name, -EINVAL it is the EtherCAT NIC (@ethercat: the one the running master says it uses, or "").
 */
int domain_check_interface(const struct config *cfg, const char *ethercat, char *error,
			   size_t error_bytes);

#endif
