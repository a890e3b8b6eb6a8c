/* SPDX-License-Identifier: MIT */
#include "uplink/answer.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "harness/test.h"

static int add(const char *text, struct answer_parts *parts)
{
	return answer_add_parts(text, strlen(text), parts);
}

TEST(uplink_answer, parts_are_listed_over_several_answers)
{
	struct answer_parts parts = { .part = NULL };

	CHECK_EQ(add("<ListPartsResult xmlns='urn:s3'><IsTruncated>true</IsTruncated>"
		     "<NextPartNumberMarker>1</NextPartNumberMarker>"
		     "<Part><PartNumber>1</PartNumber><ETag>&quot;aa&quot;</ETag>"
		     "<Size>5242880</Size></Part></ListPartsResult>",
		     &parts),
		 0);
	CHECK(parts.is_truncated);
	CHECK_EQ(parts.next_marker, 1);
	/* Some call it so, and give no size to what has none. */
	CHECK_EQ(add("<ListPartsResponse><IsTruncated>false</IsTruncated>"
		     "<Part><ETag>\"bb\"</ETag><PartNumber>2</PartNumber></Part>"
		     "</ListPartsResponse>",
		     &parts),
		 0);
	CHECK(!parts.is_truncated);
	CHECK_EQ(parts.count, 2);
	CHECK_EQ(parts.part[0].bytes, 5242880);
	CHECK_STR(parts.part[0].etag, "aa");
	CHECK_EQ(parts.part[1].number, 2);
	CHECK_EQ(parts.part[1].bytes, 0);
	CHECK_STR(parts.part[1].etag, "bb");
	free(parts.part);
}

TEST(uplink_answer, what_is_no_list_of_parts_is_refused)
{
	static const char *const bad[] = {
		"",
		"<ListPartsResult>",
		"<Error><Code>NoSuchUpload</Code></Error>",
		"<ListPartsResult><Part><ETag>a</ETag></Part></ListPartsResult>",
		"<ListPartsResult><Part><PartNumber>1</PartNumber></Part></ListPartsResult>",
		"<ListPartsResult><Part><PartNumber>10001</PartNumber><ETag>a</ETag></Part>"
		"</ListPartsResult>",
		"<ListPartsResult><Part><PartNumber>-1</PartNumber><ETag>a</ETag></Part>"
		"</ListPartsResult>",
		"<!DOCTYPE a [<!ENTITY b 'c'>]><ListPartsResult>&b;</ListPartsResult>",
	};

	for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++) {
		struct answer_parts parts = { .part = NULL };

		CHECK_EQ(add(bad[i], &parts), -EBADMSG);
		free(parts.part);
	}
}

TEST(uplink_answer, the_last_unfinished_upload_of_exactly_this_key_is_found)
{
	static const char text[] =
		"<ListMultipartUploadsResult><UploadIdMarker>m</UploadIdMarker>"
		"<Upload><Key>a/b.mcap</Key><UploadId>one</UploadId>"
		"<Owner><ID>id</ID></Owner></Upload>"
		"<Upload><UploadId>two</UploadId><Key>a/b.mcap</Key></Upload>"
		"<Upload><Key>a/b.mcap.json</Key><UploadId>three</UploadId></Upload>"
		"</ListMultipartUploadsResult>";
	char id[UPLOAD_ID_BYTES] = "before";

	CHECK_EQ(answer_find_upload(text, strlen(text), "a/b", id), 0);
	CHECK_STR(id, "before");
	CHECK_EQ(answer_find_upload(text, strlen(text), "a/b.mcap", id), 1);
	CHECK_STR(id, "two");
	CHECK(answer_find_upload("<", 1, "a", id) < 0);
}

TEST(uplink_answer, an_error_may_come_in_place_of_an_object)
{
	static const char error[] = "<?xml version='1.0'?><Error><Code>InternalError</Code>"
				    "<Message>m</Message></Error>";
	static const char good[] = "<CompleteMultipartUploadResult><ETag>\"ab-2\"</ETag>"
				   "</CompleteMultipartUploadResult>";
	struct answer_error found;
	char etag[ANSWER_ETAG_BYTES];
	char id[UPLOAD_ID_BYTES];

	CHECK_EQ(answer_get_error(error, strlen(error), &found), 1);
	CHECK_STR(found.code, "InternalError");
	CHECK_EQ(answer_get_etag(error, strlen(error), etag), -EBADMSG);
	CHECK_EQ(answer_get_id(error, strlen(error), id), -EBADMSG);
	CHECK_EQ(answer_get_error(good, strlen(good), &found), 0);
	CHECK_EQ(answer_get_etag(good, strlen(good), etag), 0);
	CHECK_STR(etag, "ab-2");
}
