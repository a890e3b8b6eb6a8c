/* SPDX-License-Identifier: MIT */
/* Bytes as what a browser posts. Whatever they are: no crash, and the words of a command are as
 * many as it says, without one that the tool could take for an option. */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "web/command.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static int is_fixed(const char *word)
{
	return strcmp(word, "--json") == 0 || strcmp(word, "--force") == 0 ||
	       strcmp(word, "--reset") == 0;
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
			if (command.word[i][0] == '-' && (i != 1 || !is_fixed(command.word[i]))) {
				abort();
			}
		}
	}
	return 0;
}
