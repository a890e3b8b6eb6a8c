/* SPDX-License-Identifier: MIT */
#include "base/xml_text.h"

#include <stdlib.h>
#include <string.h>

#include "harness/test.h"

static char *put(const char *text)
{
	char *buf = NULL;
	size_t len;
	FILE *out = open_memstream(&buf, &len);

	CHECK(out != NULL);
	xml_text_put(out, text);
	fclose(out);
	return buf;
}

TEST(xml_text, what_has_a_meaning_in_xml_becomes_an_entity)
{
	char *buf = put("<a b=\"c\" d='e'>&amp;</a>");

	CHECK_STR(buf, "&lt;a b=&quot;c&quot; d=&apos;e&apos;&gt;&amp;amp;&lt;/a&gt;");
	free(buf);
}

TEST(xml_text, a_control_character_becomes_a_blank_and_utf8_stays)
{
	char *buf = put("a\nb\x01"
			"c\x7f \xc2\xb5V");

	CHECK_STR(buf, "a b c  \xc2\xb5V");
	free(buf);
}
