/* SPDX-License-Identifier: MIT */
#include "web/command.h"

#include <errno.h>
#include <string.h>

#include "harness/test.h"

/* The outcome for the lines of @text; the words as one line to @ret_words. */
static int parse(const char *text, struct command *ret, char ret_words[WEB_BODY_BYTES])
{
	static struct command_body body;
	char padded[WEB_BODY_BYTES] = { 0 };
	int r;

	memcpy(padded, text, strlen(text));
	r = command_body_parse(padded, &body);
	r = r < 0 ? r : command_parse(body.line, body.count, ret);
	ret_words[0] = '\0';
	for (int i = 0; r == 0 && i < ret->count; i++) {
		strcat(strcat(ret_words, i == 0 ? "" : " "), ret->word[i]);
	}
	CHECK_EQ(r < 0 || ret->word[ret->count] == NULL, 1);
	return r;
}

TEST(web_command, each_command_is_a_verb_of_the_tool_for_a_role)
{
	static const struct {
		const char *text;
		const char *words;
		enum role role;
	} good[] = {
		{ "set\npiccolo0.led\n1", "set --json piccolo0.led=1", ROLE_OPERATOR },
		{ "set\na[3].b\n-1.5e-3", "set --json a[3].b=-1.5e-3", ROLE_OPERATOR },
		{ "state\nPREOP", "state PREOP", ROLE_ENGINEER },
		{ "state\nOP\n12", "state OP 12", ROLE_ENGINEER },
		{ "rescan", "rescan --force", ROLE_ENGINEER },
		{ "clear", "clear", ROLE_ENGINEER },
		{ "errors\n0", "crc --reset 0", ROLE_ENGINEER },
		{ "objects\n1\n0x1000", "sdo list --json --indices --count 1000 1 0x1000",
		  ROLE_OPERATOR },
		{ "object\n1\n0x1018:0a", "sdo list --json --count 4 1 0x1018:0a", ROLE_OPERATOR },
		{ "read\n0\n0x1018:1", "sdo read --json 0 0x1018:1", ROLE_OPERATOR },
		{ "write\nINT\n0\n0x8000:2\n-5", "sdo write --type INT 0 0x8000:2 -5",
		  ROLE_ENGINEER },
	};
	char words[WEB_BODY_BYTES];
	struct command command;

	for (size_t i = 0; i < sizeof(good) / sizeof(good[0]); i++) {
		CHECK_EQ(parse(good[i].text, &command, words), 0);
		CHECK_STR(words, good[i].words);
		CHECK_EQ(command.role, good[i].role);
	}
}

TEST(web_command, what_asks_a_mailbox_has_its_cost_and_what_only_reads_is_no_use)
{
	static const struct {
		const char *text;
		unsigned exchanges;
		int is_watching;
	} want[] = {
		{ "set\na\n1", 0, 0 },
		{ "objects\n0\n0x1000", 1, 1 },
		{ "object\n0\n0x1000", 5, 1 },
		{ "read\n0\n0x1000", 1, 1 },
		{ "write\nINT\n0\n0x1000\n1", 1, 0 },
	};
	char words[WEB_BODY_BYTES];
	struct command command;

	for (size_t i = 0; i < sizeof(want) / sizeof(want[0]); i++) {
		CHECK_EQ(parse(want[i].text, &command, words), 0);
		CHECK_EQ(command.exchanges, want[i].exchanges);
		CHECK_EQ(command.is_watching, want[i].is_watching);
	}
}

TEST(web_command, no_word_becomes_an_option_and_others_are_refused)
{
	static const struct {
		const char *text;
		int result;
	} bad[] = {
		{ "stop", -ENOENT },
		{ "se", -ENOENT },
		{ "set", -EINVAL },
		{ "set\na.b", -EINVAL },
		{ "set\na.b\n1\n2", -EINVAL },
		{ "set\n--raw\n1", -EINVAL },
		{ "set\na=b\n1", -EINVAL },
		{ "set\na.b\n1=2", -EINVAL },
		{ "set\na.b\n1 2", -EINVAL },
		{ "state", -EINVAL },
		{ "state\n-h", -EINVAL },
		{ "state\nOP\n-1", -EINVAL },
		{ "state\nOP\nall", -EINVAL },
		{ "rescan\n1", -EINVAL },
		{ "objects\n0", -EINVAL },
		{ "object\n0\n-h", -EINVAL },
		{ "object\n0\n0x1018:1 ", -EINVAL },
		{ "object\n--help\n0x1018", -EINVAL },
		{ "read\n0\n0x1018\n1", -EINVAL },
		{ "read\n0\n--complete", -EINVAL },
		{ "write\nINT\n0\n0x8000:2", -EINVAL },
		{ "write\nINT\n0\n0x8000:2\n-h", -EINVAL },
		{ "write\nINT\n0\n0x8000:2\n--complete", -EINVAL },
		{ "write\nINT\n0\n0x8000:2\n-", -EINVAL },
		{ "write\n-t\n0\n0x8000:2\n1", -EINVAL },
		{ "errors\n--json", -EINVAL },
		{ "", -EBADMSG },
		{ "\n", -EBADMSG },
		{ "set\n\na", -EBADMSG },
		{ "clear\n", -EBADMSG },
		{ "clear\t", -EBADMSG },
		{ "clear\x80", -EBADMSG },
		{ "a\nb\nc\nd\ne\nf\ng\nh\ni", -EBADMSG },
	};
	char words[WEB_BODY_BYTES];
	struct command command;

	for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++) {
		CHECK_EQ(parse(bad[i].text, &command, words), bad[i].result);
	}
}

TEST(web_command, a_body_without_an_end_is_refused)
{
	static struct command_body body;
	char text[WEB_BODY_BYTES];

	memset(text, 'a', sizeof(text));
	CHECK_EQ(command_body_parse(text, &body), -EBADMSG);
	text[sizeof(text) - 1] = '\0';
	CHECK_EQ(command_body_parse(text, &body), 0);
	CHECK_EQ(body.count, 1);
	CHECK_EQ(strlen(body.line[0]), sizeof(text) - 1);
}

TEST(web_command, an_assignment_that_does_not_fit_is_refused)
{
	char channel[COMMAND_WORD_BYTES];
	char verb[] = "set";
	char value[] = "1";
	char *line[] = { verb, channel, value };
	struct command command;

	memset(channel, 'a', sizeof(channel));
	channel[COMMAND_WORD_BYTES - 3] = '\0';
	CHECK_EQ(command_parse(line, 3, &command), 0);
	channel[COMMAND_WORD_BYTES - 3] = 'a';
	channel[COMMAND_WORD_BYTES - 2] = '\0';
	CHECK_EQ(command_parse(line, 3, &command), -EINVAL);
	CHECK_EQ(command_parse(line, 0, &command), -ENOENT);
}
