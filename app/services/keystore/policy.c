/* SPDX-License-Identifier: MIT */
#include "keystore/policy.h"

#include <assert.h>
#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "keystore/dds_topics.h"

enum { TIME_BYTES = 32 };

/* Highest domain of Cyclone DDS with the default ports. */
#define DOMAINS "<domains><id_range><min>0</min><max>230</max></id_range></domains>"
#define SCHEMA                                                                                     \
	"xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" "                                 \
	"xsi:noNamespaceSchemaLocation=\"http://www.omg.org/spec/DDS-Security/20170801/"

struct text {
	char *start;
	size_t len;
};

__attribute__((format(printf, 2, 3))) static void add(struct text *text, const char *format, ...)
{
	va_list args;
	int len;

	va_start(args, format);
	len = vsnprintf(text->start + text->len, POLICY_TEXT_BYTES - text->len, format, args);
	va_end(args);
	assert(len >= 0 && text->len + (size_t)len < POLICY_TEXT_BYTES);
	text->len += (size_t)len;
}

size_t policy_governance(char *ret_text)
{
	struct text text = { .start = ret_text, .len = 0 };

	add(&text,
	    "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
	    "<dds " SCHEMA "omg_shared_ca_governance.xsd\">\n"
	    "  <domain_access_rules>\n"
	    "    <domain_rule>\n"
	    "      " DOMAINS "\n"
	    "      <allow_unauthenticated_participants>false</allow_unauthenticated_participants>\n"
	    "      <enable_join_access_control>true</enable_join_access_control>\n"
	    "      <discovery_protection_kind>ENCRYPT</discovery_protection_kind>\n"
	    "      <liveliness_protection_kind>ENCRYPT</liveliness_protection_kind>\n"
	    "      <rtps_protection_kind>SIGN</rtps_protection_kind>\n");
	add(&text, "      <topic_access_rules>\n"
		   "        <topic_rule>\n"
		   "          <topic_expression>*</topic_expression>\n"
		   "          <enable_discovery_protection>true</enable_discovery_protection>\n"
		   "          <enable_liveliness_protection>true</enable_liveliness_protection>\n"
		   "          <enable_read_access_control>true</enable_read_access_control>\n"
		   "          <enable_write_access_control>true</enable_write_access_control>\n"
		   "          <metadata_protection_kind>ENCRYPT</metadata_protection_kind>\n"
		   "          <data_protection_kind>ENCRYPT</data_protection_kind>\n"
		   "        </topic_rule>\n"
		   "      </topic_access_rules>\n"
		   "    </domain_rule>\n"
		   "  </domain_access_rules>\n"
		   "</dds>\n");
	return text.len;
}

/* The topics with one of @access (enum topic_access). */
static void add_topics(struct text *text, const char *verb, unsigned access)
{
#define TOPIC_ROW(member, topic, type, who, ...) { topic, TOPIC_##who },
	static const struct {
		const char *name;
		enum topic_access access;
	} topics[] = { DDS_TOPICS(TOPIC_ROW) };

	add(text, "        <%s><topics>\n", verb);
	for (size_t i = 0; i < sizeof(topics) / sizeof(topics[0]); i++) {
		if ((access & topics[i].access) != 0) {
			add(text, "          <topic>%s</topic>\n", topics[i].name);
		}
	}
	add(text, "        </topics></%s>\n", verb);
}

static void format_time(int64_t unix_s, char *ret_text)
{
	time_t seconds = (time_t)unix_s;
	struct tm parts;

	gmtime_r(&seconds, &parts);
	strftime(ret_text, TIME_BYTES, "%Y-%m-%dT%H:%M:%S", &parts);
}

size_t policy_permissions(const struct policy_grant *grant, char *ret_text)
{
	const unsigned published = TOPIC_PUBLISHED | TOPIC_MIRROR;
	struct text text = { .start = ret_text, .len = 0 };
	char from[TIME_BYTES];
	char until[TIME_BYTES];

	format_time(grant->not_before_s, from);
	format_time(grant->not_after_s, until);
	add(&text,
	    "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
	    "<dds " SCHEMA "omg_shared_ca_permissions.xsd\">\n"
	    "  <permissions>\n"
	    "    <grant name=\"%s\">\n"
	    "      <subject_name>CN=%s</subject_name>\n"
	    "      <validity><not_before>%s</not_before><not_after>%s</not_after></validity>\n"
	    "      <allow_rule>\n"
	    "        " DOMAINS "\n",
	    grant->name, grant->name, from, until);
	switch (grant->role) {
	case KEYSTORE_APPLIANCE:
		add_topics(&text, "publish", published | TOPIC_REPLY);
		add_topics(&text, "subscribe", TOPIC_COMMAND);
		break;
	case KEYSTORE_COMMANDER:
		add_topics(&text, "publish", TOPIC_COMMAND);
		add_topics(&text, "subscribe", published | TOPIC_REPLY);
		break;
	case KEYSTORE_SUBSCRIBER:
		add_topics(&text, "subscribe", published);
		break;
	}
	add(&text, "      </allow_rule>\n"
		   "      <default>DENY</default>\n"
		   "    </grant>\n"
		   "  </permissions>\n"
		   "</dds>\n");
	return text.len;
}

int policy_find(const char *text, const char *tag, char *ret_value, size_t value_bytes)
{
	char open[64];
	char close[64];
	const char *start;
	const char *end;

	snprintf(open, sizeof(open), "<%s>", tag);
	snprintf(close, sizeof(close), "</%s>", tag);
	start = strstr(text, open);
	end = start == NULL ? NULL : strstr(start, close);
	if (end == NULL) {
		return -ENOENT;
	}
	start += strlen(open);
	if ((size_t)(end - start) >= value_bytes) {
		return -ENOENT;
	}
	memcpy(ret_value, start, (size_t)(end - start));
	ret_value[end - start] = '\0';
	return 0;
}

int policy_time(const char *text, int64_t *ret_s)
{
	struct tm parts = { .tm_isdst = 0 };
	const char *end = strptime(text, "%Y-%m-%dT%H:%M:%S", &parts);

	if (end == NULL || (strcmp(end, "") != 0 && strcmp(end, "Z") != 0)) {
		return -EINVAL;
	}
	*ret_s = timegm(&parts);
	return 0;
}
