/* SPDX-License-Identifier: MIT */
#include "cli/choose.h"

#include <fnmatch.h>
#include <string.h>

/* Length of the common prefix and suffix of @name and @candidate. */
static size_t likeness(const char *name, const char *candidate)
{
	size_t name_len = strlen(name);
	size_t len = strlen(candidate);
	size_t head = 0;
	size_t tail = 0;

	while (head < name_len && name[head] == candidate[head]) {
		head++;
	}
	while (tail < name_len - head && tail < len &&
	       name[name_len - 1 - tail] == candidate[len - 1 - tail]) {
		tail++;
	}
	return head + tail;
}

enum exit_code choose_fail(const struct cli *cli, const struct samples *samples, const char *name)
{
	const char *guess = NULL;
	size_t best = strlen(name) / 2;

	for (uint32_t i = 0; i < samples->meta->channel_count; i++) {
		size_t score = likeness(name, samples->channels[i].name);

		if (score > best) {
			best = score;
			guess = samples->channels[i].name;
		}
	}
	if (guess != NULL) {
		return cli_fail(cli, EXIT_CODE_FAILED, "%s: no such channel; did you mean %s?",
				name, guess);
	}
	return cli_fail(cli, EXIT_CODE_FAILED, "%s: no such channel (see ecdaq channels)", name);
}

static enum exit_code add(const struct cli *cli, struct choice *choice, uint32_t channel)
{
	for (unsigned i = 0; i < choice->count; i++) {
		if (choice->channel[i] == channel) {
			return EXIT_CODE_OK;
		}
	}
	if (choice->count == CHOOSE_LIMIT) {
		return cli_fail(cli, EXIT_CODE_FAILED, "more than CHOOSE_LIMIT = %d channels",
				CHOOSE_LIMIT);
	}
	choice->channel[choice->count++] = channel;
	return EXIT_CODE_OK;
}

enum exit_code choose_channels(const struct cli *cli, const struct samples *samples,
			       char *const *names, int name_count, struct choice *ret_choice)
{
	struct choice choice = { .count = 0 };

	for (int n = 0; n < name_count; n++) {
		int matches = 0;

		for (uint32_t i = 0; i < samples->meta->channel_count; i++) {
			enum exit_code result;

			if (fnmatch(names[n], samples->channels[i].name, 0) != 0) {
				continue;
			}
			matches++;
			result = add(cli, &choice, i);
			if (result != EXIT_CODE_OK) {
				return result;
			}
		}
		if (matches == 0) {
			return choose_fail(cli, samples, names[n]);
		}
	}
	*ret_choice = choice;
	return EXIT_CODE_OK;
}
