/* SPDX-License-Identifier: MIT */
#include "publish/domain.h"

#include <errno.h>
#include <glob.h>
#include <net/if.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "keystore/keystore.h"

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

static void add_plugin(struct text *text, const char *dir, const char *file, const char *function)
{
	add(text,
	    "<Library path=\"%s/libdds_security_%s.so\" initFunction=\"init_%s\" "
	    "finalizeFunction=\"finalize_%s\"/>",
	    dir, file, function, function);
}

static void add_file(struct text *text, const char *element, const char *dir, const char *file)
{
	add(text, "<%s>file:%s/%s</%s>", element, dir, file, element);
}

static void add_security(struct text *text, const char *keys, const char *plugins)
{
	add(text, "<Security><Authentication>");
	add_plugin(text, plugins, "auth", "authentication");
	add_file(text, "IdentityCA", keys, KEYSTORE_IDENTITY_CA);
	add_file(text, "IdentityCertificate", keys, KEYSTORE_CERT);
	add_file(text, "PrivateKey", keys, KEYSTORE_KEY);
	add(text, "</Authentication><AccessControl>");
	add_plugin(text, plugins, "ac", "access_control");
	add_file(text, "PermissionsCA", keys, KEYSTORE_PERMISSIONS_CA);
	add_file(text, "Governance", keys, KEYSTORE_GOVERNANCE);
	add_file(text, "Permissions", keys, KEYSTORE_PERMISSIONS);
	add(text, "</AccessControl><Cryptographic>");
	add_plugin(text, plugins, "crypto", "crypto");
	add(text, "</Cryptographic></Security>");
}

int domain_find_plugins(const char *library, char *ret_dir, size_t dir_bytes)
{
	const char *slash = strrchr(library, '/');
	int folder = slash == NULL ? 0 : (int)(slash - library);
	char pattern[CONFIG_PATH_BYTES * 2];
	glob_t found = { .gl_pathc = 0 };
	int r = -ENOENT;

	snprintf(pattern, sizeof(pattern), "%.*s{,/libddsc*}/libdds_security_auth.so", folder,
		 library);
	if (slash != NULL && glob(pattern, GLOB_BRACE, NULL, &found) == 0) {
		slash = strrchr(found.gl_pathv[0], '/');
		folder = (int)(slash - found.gl_pathv[0]);
		r = snprintf(ret_dir, dir_bytes, "%.*s", folder, found.gl_pathv[0]) < (int)dir_bytes
			    ? 0
			    : -ENOENT;
		globfree(&found);
	}
	return r;
}

int domain_check_security(const struct config *cfg, char *ret_identity, char *error,
			  size_t error_bytes)
{
	struct keystore_identity identity;
	char reason[KEYSTORE_ERROR_BYTES];
	char until[16];
	struct tm parts;
	time_t expires;

	ret_identity[0] = '\0';
	if (!domain_is_secure(cfg)) {
		return 0;
	}
	if (keystore_check(cfg->dds_security, (int64_t)time(NULL), &identity, reason) < 0) {
		snprintf(error, error_bytes, "dds.security: %s", reason);
		return -EKEYREJECTED;
	}
	expires = (time_t)identity.expires_s;
	gmtime_r(&expires, &parts);
	strftime(until, sizeof(until), "%Y-%m-%d", &parts);
	snprintf(ret_identity, DOMAIN_IDENTITY_BYTES, "DDS Security: %s, valid until %s",
		 identity.name, until);
	return 0;
}

int domain_xml(const struct config *cfg, const char *plugins, char *ret_xml, size_t xml_bytes)
{
	struct text text = { .at = ret_xml, .left = xml_bytes };
	/* No multicast on Linux' lo: participants there discover each other by address. */
	int is_loopback = strcmp(cfg->dds_interface, "lo") == 0;
	int has_multicast = cfg->dds_multicast && !is_loopback;

	add(&text,
	    "<General><Interfaces><NetworkInterface name=\"%s\" presence_required=\"false\"/>",
	    cfg->dds_interface);
	add(&text, "</Interfaces><AllowMulticast>%s</AllowMulticast></General><Discovery>",
	    has_multicast ? "true" : "false");
	/* With the default index (none) unicast discovery does not work. */
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
	if (domain_is_secure(cfg)) {
		add_security(&text, cfg->dds_security, plugins);
	}
	return text.is_full ? -E2BIG : 0;
}

int domain_check_interface(const struct config *cfg, const char *ethercat, char *error,
			   size_t error_bytes)
{
	if (strcmp(cfg->dds_interface, ethercat) == 0 ||
	    strcmp(cfg->dds_interface, cfg->interface) == 0) {
		snprintf(error, error_bytes, "dds.interface: %s: in use for the EtherCAT segment",
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
