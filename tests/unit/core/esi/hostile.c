/* SPDX-License-Identifier: MIT */
#include <errno.h>
#include <sys/stat.h>
#include <unistd.h>

#include "bench.h"
#include "xml/xml.h"

static char *repeated(const char *head, const char *piece, size_t count)
{
	size_t head_len = strlen(head);
	size_t len = strlen(piece);
	char *text = malloc(head_len + count * len + 1);

	CHECK(text != NULL);
	memcpy(text, head, head_len);
	for (size_t i = 0; i < count; i++) {
		memcpy(text + head_len + i * len, piece, len);
	}
	text[head_len + count * len] = '\0';
	return text;
}

static void check_error(char *text, int result, const char *error)
{
	struct seen seen = bench_text(text);

	free(text);
	CHECK_EQ(seen.result, result);
	if (strstr(seen.error, error) == NULL) {
		CHECK_STR(seen.error, error);
	}
	bench_free(&seen);
}

TEST(esi_hostile, entities_and_document_types_are_refused)
{
	check_error(repeated("<!DOCTYPE x [<!ENTITY a \"aaaa\"><!ENTITY b \"&a;&a;\">]>"
			     "<EtherCATInfo>&b;</EtherCATInfo>",
			     "", 0),
		    -EBADMSG, "t.xml:1: a document type declaration (<!DOCTYPE) is not accepted");
	check_error(repeated("<!DOCTYPE x SYSTEM \"/etc/passwd\"><EtherCATInfo/>", "", 0), -EBADMSG,
		    "<!DOCTYPE");
	check_error(repeated("<EtherCATInfo>&other;</EtherCATInfo>", "", 0), -EBADMSG,
		    "undefined entity");
}

TEST(esi_hostile, depth_is_bounded)
{
	check_error(repeated("<EtherCATInfo>", "<a>", XML_LIMIT_DEPTH), -EBADMSG,
		    "more than 32 levels of elements");
}

TEST(esi_hostile, endless_tag_is_refused_before_it_is_in_memory)
{
	check_error(repeated("<EtherCATInfo ", "a", 4 << 20), -EBADMSG,
		    "a tag or comment of more than 1048576 bytes");
	check_error(repeated("<EtherCATInfo><!--", "a", 4 << 20), -EBADMSG, "a tag or comment");
}

TEST(esi_hostile, names_without_end_need_no_memory_without_end)
{
	char *text = malloc(XML_LIMIT_MEMORY_BYTES);
	size_t len = (size_t)sprintf(text, "<EtherCATInfo>");

	CHECK(text != NULL);
	for (unsigned i = 0; len + 64 < XML_LIMIT_MEMORY_BYTES; i++) {
		len += (size_t)snprintf(text + len, 64, "<a%u_%040u/>", i, 0);
	}
	check_error(text, -ENOMEM, "needs more than 32 MiB to be read");
}

TEST(esi_hostile, lists_are_bounded)
{
	char head[512];

	snprintf(head, sizeof(head), "%s", BENCH_HEAD "<Device><Type/>");
	check_error(repeated(head, "<RxPdo/>", ESI_LIMIT_PDOS + 1), -EBADMSG,
		    "more than 1024 PDOs of a device");
	check_error(repeated(head, "<Sm/>", ESI_LIMIT_SM + 1), -EBADMSG,
		    "more than 16 SyncManagers");
	check_error(repeated(head, "<Fmmu/>", ESI_LIMIT_FMMU + 1), -EBADMSG, "more than 16 FMMUs");
	check_error(repeated(head, "<Dc><OpMode/></Dc>", ESI_LIMIT_DC_MODES + 1), -EBADMSG,
		    "more than 16 DC modes");
	snprintf(head, sizeof(head), "%s", BENCH_HEAD "<Device><Type/><RxPdo>");
	check_error(repeated(head, "<Entry/>", ESI_LIMIT_ENTRIES + 1), -EBADMSG,
		    "more than 16384 PDO entries of a device");
	check_error(repeated(head, "<Exclude>1</Exclude>", ESI_LIMIT_EXCLUDES + 1), -EBADMSG,
		    "more than 32 PDOs excluded by one");
}

TEST(esi_hostile, long_text_is_cut_between_characters)
{
	char *text = repeated(BENCH_HEAD "<Device><Type/><Name>", "\xc3\xa9", 6000);
	struct seen seen;
	size_t len = strlen(text);

	text = realloc(text, len + 256);
	CHECK(text != NULL);
	memcpy(text + len, "</Name></Device>" BENCH_TAIL, sizeof("</Name></Device>" BENCH_TAIL));
	seen = bench_text(text);
	free(text);
	CHECK_EQ(seen.result, 0);
	CHECK_EQ(strlen(seen.device[0]->name), ESI_NAME_BYTES / 2 * 2 - 2);
	bench_free(&seen);
}

TEST(esi_hostile, cut_text_does_not_end_in_blanks)
{
	char text[1024];
	struct seen seen;

	snprintf(text, sizeof(text), BENCH_DEVICE("<Name>\x7f a%200sb</Name>"), "");
	seen = bench_text(text);
	CHECK_EQ(seen.result, 0);
	CHECK_STR(seen.device[0]->name, "a");
	bench_free(&seen);
}

TEST(esi_hostile, what_is_no_file_is_not_read)
{
	char dir[] = "/tmp/ecdaq-esi-XXXXXX";
	char path[64];
	struct seen seen = { .count = 0 };
	const struct esi_visitor visitor = { bench_wants, bench_take, &seen };

	CHECK(mkdtemp(dir) != NULL);
	snprintf(path, sizeof(path), "%s/pipe.xml", dir);
	CHECK_EQ(mkfifo(path, 0600), 0);
	CHECK_EQ(esi_read_file(path, &visitor, seen.error, sizeof(seen.error)), -EINVAL);
	CHECK(strstr(seen.error, "pipe.xml: not a regular file") != NULL);
	CHECK_EQ(esi_read_file(dir, &visitor, seen.error, sizeof(seen.error)), -EINVAL);
	unlink(path);
	CHECK_EQ(esi_read_file(path, &visitor, seen.error, sizeof(seen.error)), -ENOENT);
	rmdir(dir);
}
