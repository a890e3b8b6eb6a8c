/* SPDX-License-Identifier: MIT */
/* Bytes as what a browser posts. Whatever they are: no crash, and the words of a command are as
 * many as it says, without one that the tool could take for an option. */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "web/command.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* A word of the body; what is not from there is fixed. */
static int is_given(const struct command_body *body, const char *word)
{
	return word >= body->text && word < body->text + sizeof(body->text);
}

/* As the tool takes it: "-5" and "-.5" are none. */
static int is_option(const char *word)
{
	return word[0] == '-' && word[1] != '.' && (word[1] < '0' || word[1] > '9');
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	static struct command_body body;
	static struct command command;
	char text[WEB_BODY_BYTES] = { 0 };

	memcpy(text, data, size < sizeof(text) ? size : sizeof(text));
	if (command_body_parse(text, &body) < 0) {
		return 0;
	}
	if (body.count < 1 || body.count > COMMAND_LINES) {
		abort();
	}
	if (command_parse(body.line, body.count, &command) == 0) {
		if (command.count < 1 || command.count > COMMAND_WORDS ||
		    command.word[command.count] != NULL) {
			abort();
		}
		for (int i = 0; i < command.count; i++) {
			if (is_given(&body, command.word[i]) && is_option(command.word[i])) {
				abort();
			}
		}
		if (command.joined[0] != '\0' && is_option(command.joined)) {
			abort();
		}
	}
	return 0;
}
