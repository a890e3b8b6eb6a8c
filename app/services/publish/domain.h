/* SPDX-License-Identifier: MIT */
/*
 * The DDS domain's configuration, from ours: one named interface, multicast or not, peers, tag.
 * Given to Cyclone DDS as XML; nothing comes from its environment. Context: blocking.
 */
#ifndef PUBLISH_DOMAIN_H
#define PUBLISH_DOMAIN_H

#include <stddef.h>

#include "config/config.h"

enum { DOMAIN_XML_BYTES = 8192, DOMAIN_SAID_BYTES = 160 };

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

/**
 * 0, or -E2BIG. @cfg has passed config_check(): nothing in it needs escaping. @plugins: the folder
 * of the DDS Security plug-ins, used only where dds.security is given.
 */
int domain_xml(const struct config *cfg, const char *plugins, char *ret_xml, size_t xml_bytes);

/**
 * Where are the plug-ins of the Cyclone DDS whose library is the file @library: beside it, or in a
 * folder of theirs beside it (Debian)? 0, or -ENOENT.
 */
int domain_find_plugins(const char *library, char *ret_dir, size_t dir_bytes);

/**
 * Are our keys (dds.security) fit for use now? 0 and one line about them in @said
 * (DOMAIN_SAID_BYTES), empty where there are none to look at; or -EKEYREJECTED with one line in
 * @error.
 */
int domain_check_security(const struct config *cfg, char *said, char *error, size_t error_bytes);

/**
 * May DDS use @cfg's interface? 0; or -errno with one line in @error: -ENODEV there is none of that
 * name, -EINVAL it is the EtherCAT NIC (@ethercat: the one the running master says it uses, or "").
 */
int domain_check_interface(const struct config *cfg, const char *ethercat, char *error,
			   size_t error_bytes);

#endif
