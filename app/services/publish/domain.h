/* SPDX-License-Identifier: MIT */
/*
 * The configuration of Cyclone DDS, as XML, from dds.*: one named interface, multicast, peers, tag,
 * security. The environment (CYCLONEDDS_URI) is not used. Context: blocking.
 */
#ifndef PUBLISH_DOMAIN_H
#define PUBLISH_DOMAIN_H

#include <stddef.h>

#include "config/config.h"

enum { DOMAIN_XML_BYTES = 8192, DOMAIN_IDENTITY_BYTES = 160 };

/** DDS Security is in use. */
static inline int domain_is_secure(const struct config *cfg)
{
	return cfg->dds_security[0] != '\0';
}

/** Commands are enabled: from commanders with a key, or by the option from anybody. */
static inline int domain_takes_commands(const struct config *cfg)
{
	return domain_is_secure(cfg) || cfg->dds_allow_insecure_commands != 0;
}

/**
 * The XML. 0, or -E2BIG. @cfg must have passed config_check(): nothing in it needs escaping.
 * @plugins: the directory of the DDS Security plug-ins, used if dds.security is set.
 */
int domain_xml(const struct config *cfg, const char *plugins, char *ret_xml, size_t xml_bytes);

/**
 * Find the DDS Security plug-ins of the Cyclone DDS library @library: in its directory, or in a
 * subdirectory of it (Debian). 0, or -ENOENT.
 */
int domain_find_plugins(const char *library, char *ret_dir, size_t dir_bytes);

/**
 * Check our keys (dds.security). 0 and one line with our identity in @ret_identity
 * (DOMAIN_IDENTITY_BYTES), "" without DDS Security; or -EKEYREJECTED with one line in @error.
 */
int domain_check_security(const struct config *cfg, char *ret_identity, char *error,
			  size_t error_bytes);

/**
 * Check dds.interface. 0; or -errno with one line in @error: -ENODEV no such interface, -EINVAL it
 * is used for EtherCAT (@ethercat: the interface of the running master, or "").
 */
int domain_check_interface(const struct config *cfg, const char *ethercat, char *error,
			   size_t error_bytes);

#endif
