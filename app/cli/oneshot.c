/* SPDX-License-Identifier: MIT */
/* ecdaq oneshot: arm SYNC0 of one slave or of all for one instant, and wait for the conversion. */
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "base/clock.h"
#include "cli/admin_client.h"
#include "cli/cli.h"
#include "cli/follow.h"
#include "cli/screen.h"
#include "cli/text.h"
#include "image/entry.h"
#include "image/image.h"
#include "program/args_duration.h"
#include "program/json.h"
#include "reader/table.h"

/* Entries of the FB1111-Piccolo. */
#define ENTRY_TIME "oneshot_time"
#define ENTRY_SAMPLE_TIME "sample_time"
#define ENTRY_ADC "adc"
/* A slave's own reading of its SYNC0 edge may differ from the time armed by less than this. */
#define EDGE_TOLERANCE_NS (1 * NS_PER_US)
/* How long after its instant a conversion may take to come back. */
#define WAIT_SLACK_NS (2 * NS_PER_S)

struct shot {
	uint16_t slave_pos;
	const char *name;
	int sample_time; /* channels; -1: none */
	int adc;
	int is_done;
	uint64_t cycle;     /* in which the command took effect, then in which the value came */
	int64_t at_ns;      /* the instant that was armed */
	int64_t sampled_ns; /* sample time reported by the slave */
	uint64_t value;
};

struct oneshot {
	struct cli *cli;
	struct follow follow;
	int64_t at_ns;
	int64_t in_ns;
	int has_at;
	int is_wait;
	int is_json;
	struct shot shot[LIMIT_SLAVES];
	unsigned count;
	int is_all; /* "all", not a list of one */
};

static int find_entry(const struct samples *samples, uint16_t slave_pos, const char *entry)
{
	for (uint32_t i = 0; i < samples->meta->channel_count; i++) {
		if (samples->channels[i].slave_pos == slave_pos &&
		    channel_is_entry(&samples->slaves[slave_pos], &samples->channels[i], entry)) {
			return (int)i;
		}
	}
	return -1;
}

static void add(struct oneshot *one, uint16_t pos)
{
	const struct samples *samples = &one->follow.samples;

	one->shot[one->count++] = (struct shot){
		.slave_pos = pos,
		.name = samples->slaves[pos].name,
		.sample_time = find_entry(samples, pos, ENTRY_SAMPLE_TIME),
		.adc = find_entry(samples, pos, ENTRY_ADC),
	};
}

static enum exit_code choose(struct oneshot *one, const char *word)
{
	const struct samples *samples = &one->follow.samples;
	enum exit_code result;
	uint16_t pos;

	if (strcmp(word, "all") != 0) {
		if (one->follow.page == NULL) {
			return cli_fail(one->cli, EXIT_CODE_NO_DAEMON, "status: cannot be read");
		}
		result = source_find_slave(one->cli, one->follow.page, word, &pos);
		if (result == EXIT_CODE_OK && pos >= samples->meta->slave_count) {
			return cli_fail(one->cli, EXIT_CODE_FAILED, "%s: has no process data yet",
					word);
		}
		if (result == EXIT_CODE_OK) {
			add(one, pos);
		}
		return result;
	}
	one->is_all = 1;
	for (uint32_t i = 0; i < samples->meta->slave_count; i++) {
		if (find_entry(samples, (uint16_t)i, ENTRY_TIME) >= 0) {
			add(one, (uint16_t)i);
		}
	}
	if (one->count == 0) {
		return cli_fail(one->cli, EXIT_CODE_FAILED,
				"all: no slave has an output " ENTRY_TIME);
	}
	return EXIT_CODE_OK;
}

/* One request: all of them are armed in the same cycle, or none is. */
static enum exit_code arm(struct oneshot *one)
{
	struct admin_request request = {
		.verb = ADMIN_ONESHOT,
		.slave_pos = one->is_all ? ADMIN_ALL_SLAVES : one->shot[0].slave_pos,
		.is_relative = !one->has_at,
		.dc_time_ns = one->has_at ? one->at_ns : one->in_ns,
	};
	struct admin_reply reply;
	enum exit_code result = admin_do(one->cli, &request, &reply);

	if (result != EXIT_CODE_OK) {
		return result;
	}
	one->at_ns = reply.dc_time_ns;
	for (unsigned i = 0; i < one->count; i++) {
		one->shot[i].at_ns = reply.dc_time_ns;
		one->shot[i].cycle = reply.cycle;
	}
	return EXIT_CODE_OK;
}

/* Does the sample just read hold the conversion? */
static void look(struct oneshot *one, struct shot *shot)
{
	const struct samples *samples = &one->follow.samples;
	struct sample_header header = samples_header(samples);
	const uint8_t *image = samples_image(samples);
	int64_t sampled_ns;

	if (shot->is_done || !sample_is_good(&header, shot->slave_pos)) {
		return;
	}
	sampled_ns = (int64_t)image_get_raw(image, &samples->channels[shot->sample_time]);
	/* The value before that was sampled earlier. */
	if (sampled_ns < shot->at_ns - EDGE_TOLERANCE_NS) {
		return;
	}
	shot->is_done = 1;
	shot->sampled_ns = sampled_ns;
	shot->cycle = header.cycle;
	shot->value = image_get_raw(image, &samples->channels[shot->adc]);
}

static unsigned open_shots(const struct oneshot *one)
{
	unsigned open = 0;

	for (unsigned i = 0; i < one->count; i++) {
		open += !one->shot[i].is_done;
	}
	return open;
}

static enum exit_code wait_for_all(struct oneshot *one)
{
	uint64_t lost;

	screen_catch_signals();
	while (open_shots(one) > 0) {
		switch (follow_next(&one->follow, &lost)) {
		case FOLLOW_SAMPLE:
			for (unsigned i = 0; i < one->count; i++) {
				look(one, &one->shot[i]);
			}
			if (samples_header(&one->follow.samples).dc_time_ns >
			    one->at_ns + WAIT_SLACK_NS) {
				return EXIT_CODE_OK;
			}
			break;
		case FOLLOW_LOST:
		case FOLLOW_IDLE:
			break;
		case FOLLOW_NEW_BUS:
		case FOLLOW_ENDED:
			return cli_fail(one->cli, EXIT_CODE_FAILED,
					"the bus was stopped before the conversion");
		case FOLLOW_DAMAGED:
			return cli_fail(one->cli, EXIT_CODE_FAILED, "samples: %s",
					reader_error_to_str(-EIO));
		case FOLLOW_OVER:
			return cli_fail(one->cli, EXIT_CODE_FAILED, "interrupted");
		}
	}
	return EXIT_CODE_OK;
}

static void print_text(const struct oneshot *one, const struct shot *shot)
{
	char value[TEXT_BYTES];

	if (!one->is_wait) {
		printf("%s: armed for DC %" PRId64 " from cycle %" PRIu64 " on\n", shot->name,
		       shot->at_ns, shot->cycle);
	} else if (shot->is_done) {
		text_value(&one->follow.samples.channels[shot->adc], shot->value, value);
		printf("%s: adc %s, sampled at DC %" PRId64 " (%+" PRId64 " ns), cycle %" PRIu64
		       "\n",
		       shot->name, value, shot->sampled_ns, shot->sampled_ns - shot->at_ns,
		       shot->cycle);
	}
}

static void print_json(const struct oneshot *one)
{
	struct json js;

	json_init(&js, stdout);
	json_object_begin(&js, NULL);
	json_i64(&js, "dc_time_ns", one->at_ns);
	json_array_begin(&js, "slave");
	for (unsigned i = 0; i < one->count; i++) {
		const struct shot *shot = &one->shot[i];

		json_object_begin(&js, NULL);
		json_u64(&js, "position", shot->slave_pos);
		json_text(&js, "name", shot->name);
		json_u64(&js, "cycle", shot->cycle);
		json_truth(&js, "converted", shot->is_done);
		if (shot->is_done) {
			text_value_json(&js, "adc", &one->follow.samples.channels[shot->adc],
					shot->value, TEXT_PHYSICAL);
			json_i64(&js, "sample_time", shot->sampled_ns);
		}
		json_object_end(&js);
	}
	json_array_end(&js);
	json_object_end(&js);
	json_end_line(&js);
}

static enum exit_code run(struct oneshot *one, const char *word)
{
	enum exit_code result = choose(one, word);

	for (unsigned i = 0; result == EXIT_CODE_OK && one->is_wait && i < one->count; i++) {
		if (one->shot[i].sample_time < 0 || one->shot[i].adc < 0) {
			return cli_fail(one->cli, EXIT_CODE_FAILED,
					"--wait: %s has no inputs " ENTRY_ADC
					" and " ENTRY_SAMPLE_TIME,
					one->shot[i].name);
		}
	}
	if (result == EXIT_CODE_OK) {
		result = arm(one);
	}
	if (result == EXIT_CODE_OK && one->is_wait) {
		result = wait_for_all(one);
	}
	if (result != EXIT_CODE_OK) {
		return result;
	}
	if (one->is_json) {
		print_json(one);
	}
	for (unsigned i = 0; i < one->count; i++) {
		if (!one->is_json) {
			print_text(one, &one->shot[i]);
		}
		if (one->is_wait && !one->shot[i].is_done) {
			result = cli_fail(one->cli, EXIT_CODE_FAILED, "%s: no conversion received",
					  one->shot[i].name);
		}
	}
	return result;
}

enum exit_code verb_oneshot(struct cli *cli, int argc, char **argv)
{
	struct oneshot one = { .cli = cli, .at_ns = INT64_MIN };
	const struct args_option options[] = {
		{ "at", 0, args_dc_time, &one.at_ns, "DC_NS",
		  "the instant, DC time in ns since 2000-01-01" },
		{ "in", 0, args_duration, &one.in_ns, "T", "the instant, from now on" },
		{ "wait", 0, args_flag, &one.is_wait, NULL,
		  "wait for the conversion and show its value" },
		{ "json", 0, args_flag, &one.is_json, NULL, "answer as a JSON object" },
	};
	struct args args = {
		.options = options, .option_count = 4, .operands_min = 1, .operands_max = 1
	};
	enum exit_code result;

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	one.has_at = one.at_ns != INT64_MIN;
	if (one.has_at == (one.in_ns > 0)) {
		return cli_fail(cli, EXIT_CODE_USAGE, "requires --at or --in");
	}
	result = follow_open(cli, &one.follow);
	if (result == EXIT_CODE_OK) {
		result = run(&one, args.operands[0]);
		follow_close(&one.follow);
	}
	return result;
}
