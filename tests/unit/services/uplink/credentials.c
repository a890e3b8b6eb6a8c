/* SPDX-License-Identifier: MIT */
#include "uplink/credentials.h"

#include <errno.h>
#include <string.h>

#include "harness/test.h"

static struct credentials found;
static char problem[128];

static int parse(const char *text)
{
	memset(&found, 0, sizeof(found));
	return credentials_parse(text, strlen(text), &found, problem, sizeof(problem));
}

TEST(uplink_credentials, the_section_default_counts_or_the_first_one)
{
	CHECK_EQ(parse("aws_access_key_id=a\r\naws_secret_access_key = b/c+d=\n"), 0);
	CHECK_STR(found.id, "a");
	CHECK_STR(found.secret, "b/c+d=");
	CHECK_STR(found.token, "");
	CHECK_EQ(parse("[x]\naws_access_key_id=a\naws_secret_access_key=b\n"
		       "[default]\n# aws_access_key_id=n\nregion = r\n"
		       "aws_access_key_id=c\naws_secret_access_key=d\naws_session_token=e"),
		 0);
	CHECK_STR(found.id, "c");
	CHECK_STR(found.secret, "d");
	CHECK_STR(found.token, "e");
	CHECK_EQ(parse("[x]\naws_access_key_id=a\naws_secret_access_key=b\n"
		       "[y]\naws_access_key_id=c\naws_secret_access_key=d\n"),
		 0);
	CHECK_STR(found.id, "a");
}

TEST(uplink_credentials, what_is_missing_or_cannot_be_sent_is_said)
{
	CHECK_EQ(parse(""), -EINVAL);
	CHECK(strstr(problem, "aws_secret_access_key") != NULL);
	CHECK_EQ(parse("aws_access_key_id=a\n"), -EINVAL);
	CHECK_EQ(parse("aws_access_key_id=a\naws_secret_access_key=\n"), -EINVAL);
	CHECK(strstr(problem, "empty") != NULL);
	CHECK_EQ(parse("aws_access_key_id=a b\naws_secret_access_key=c\n"), -EINVAL);
	CHECK_STR(found.id, "");
}
