/* SPDX-License-Identifier: MIT */
/* ecdaq data: the process image as bytes, as the newest cycle had it. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/args.h"
#include "cli/cli.h"
#include "cli/file.h"
#include "cli/hex.h"
#include "cli/source.h"
#include "program/json.h"

enum { ALL_SLAVES = -1 };

/* Bytes of the image: one half of it, or what a slave has there. */
struct area {
	uint32_t start;
	uint32_t end; /* one past */
};

struct data {
	struct cli *cli;
	struct samples samples;
	struct area half[2]; /* by enum channel_direction */
	int is_wanted[2];    /* the same */
	const char *output;  /* file; NULL: standard output */
	int is_json;
	uint8_t *collected; /* for the file */
	size_t collected_len;
	struct json js;
};

/* Of what its channels cover; start == end: it has none. */
static struct area area_of(const struct data *data, int pos, unsigned direction)
{
	const struct samples *sp = &data->samples;
	struct area area = data->half[direction];
	struct area found = { .start = area.end, .end = area.end };
	int is_first = 1;

	if (pos == ALL_SLAVES) {
		return area;
	}
	for (uint32_t i = 0; i < sp->meta->channel_count; i++) {
		const struct channel *ch = &sp->channels[i];
		uint32_t start = ch->bit_offset / 8;
		uint32_t end = (ch->bit_offset + ch->bit_len + 7) / 8;

		if (ch->slave_pos != pos || start < area.start || end > area.end) {
			continue;
		}
		if (is_first) {
			found = (struct area){ .start = start, .end = end };
			is_first = 0;
		}
		found.start = start < found.start ? start : found.start;
		found.end = end > found.end ? end : found.end;
	}
	return found;
}

static const char *name_of(const struct data *data, int pos)
{
	return pos == ALL_SLAVES ? NULL : data->samples.slaves[pos].name;
}

static void show_json(struct data *data, int pos, unsigned direction, struct area area)
{
	const uint8_t *bytes = samples_image(&data->samples) + area.start;
	size_t len = area.end - area.start;
	char *text = malloc(3 * len + 1);

	if (text == NULL) {
		return;
	}
	hex_format(bytes, len, text, 3 * len + 1);
	json_object_begin(&data->js, NULL);
	if (pos == ALL_SLAVES) {
		json_null(&data->js, "slave");
		json_null(&data->js, "name");
	} else {
		json_u64(&data->js, "slave", (unsigned)pos);
		json_text(&data->js, "name", name_of(data, pos));
	}
	json_text(&data->js, "direction", direction == CHANNEL_OUTPUT ? "output" : "input");
	json_u64(&data->js, "offset", area.start);
	json_u64(&data->js, "length", len);
	json_text(&data->js, "bytes", text);
	json_object_end(&data->js);
	free(text);
}

static void show_area(struct data *data, int pos, unsigned direction)
{
	struct area area = area_of(data, pos, direction);
	const uint8_t *bytes = samples_image(&data->samples) + area.start;
	size_t len = area.end - area.start;

	if (data->output != NULL) {
		if (len > 0) {
			memcpy(data->collected + data->collected_len, bytes, len);
			data->collected_len += len;
		}
	} else if (data->is_json) {
		show_json(data, pos, direction, area);
	} else {
		printf("%s%s%s: %zu bytes\n", pos == ALL_SLAVES ? "" : name_of(data, pos),
		       pos == ALL_SLAVES ? "" : " ",
		       direction == CHANNEL_OUTPUT ? "outputs" : "inputs", len);
		hex_dump(bytes, len, area.start);
	}
}

static void show_slave(struct data *data, int pos)
{
	if (data->is_wanted[CHANNEL_OUTPUT]) {
		show_area(data, pos, CHANNEL_OUTPUT);
	}
	if (data->is_wanted[CHANNEL_INPUT]) {
		show_area(data, pos, CHANNEL_INPUT);
	}
}

static void begin(struct data *data)
{
	struct sample_header header = samples_header(&data->samples);
	char flags[128];

	samples_flags_format(header.flags, flags, sizeof(flags));
	if (data->output != NULL) {
		return;
	}
	if (!data->is_json) {
		printf("cycle %" PRIu64 "%s%s\n", header.cycle, flags[0] == '\0' ? "" : "  ",
		       flags);
		return;
	}
	json_object_begin(&data->js, NULL);
	json_u64(&data->js, "cycle", header.cycle);
	json_i64(&data->js, "dc_time_ns", header.dc_time_ns);
	json_text(&data->js, "flags", flags);
	json_u64(&data->js, "output_bytes", data->samples.meta->output_bytes);
	json_u64(&data->js, "image_bytes", data->samples.meta->image_bytes);
	json_array_begin(&data->js, "area");
}

static enum exit_code end(struct data *data)
{
	if (data->output != NULL) {
		return file_write(data->cli, data->output, data->collected, data->collected_len);
	}
	if (data->is_json) {
		json_array_end(&data->js);
		json_object_end(&data->js);
		json_end_line(&data->js);
	}
	return EXIT_CODE_OK;
}

/* The positions that the words name; those of the status page are those of the ring. */
static enum exit_code find_slaves(const struct data *data, const struct args *args, int *ret_pos)
{
	const struct status_page *page = NULL;
	enum exit_code result =
		args->operand_count > 0 ? source_status(data->cli, &page) : EXIT_CODE_OK;

	for (int i = 0; i < args->operand_count && result == EXIT_CODE_OK; i++) {
		uint16_t pos = 0;

		result = source_find_slave(data->cli, page, args->operands[i], &pos);
		if (result == EXIT_CODE_OK && pos >= data->samples.meta->slave_count) {
			result = cli_fail(data->cli, EXIT_CODE_FAILED,
					  "%s: the bus is being brought up: try again",
					  args->operands[i]);
		}
		ret_pos[i] = pos;
	}
	if (page != NULL) {
		source_status_close(page);
	}
	return result;
}

static enum exit_code run(struct data *data, const struct args *args)
{
	const struct sample_meta *meta = data->samples.meta;
	int count = args->operand_count;
	int *pos = calloc((size_t)count + 1, sizeof(*pos));
	enum exit_code result;

	/* A slave may be named more than once. */
	data->collected = malloc(((size_t)count + 1) * (meta->image_bytes + 1));
	if (pos == NULL || data->collected == NULL) {
		free(pos);
		return cli_fail(data->cli, EXIT_CODE_FAILED, "out of memory");
	}
	data->half[CHANNEL_OUTPUT] = (struct area){ .start = 0, .end = meta->output_bytes };
	data->half[CHANNEL_INPUT] =
		(struct area){ .start = meta->output_bytes, .end = meta->image_bytes };
	result = find_slaves(data, args, pos);
	if (result == EXIT_CODE_OK && reader_read_newest(data->samples.reader) != 1) {
		result = cli_fail(data->cli, EXIT_CODE_FAILED, "no cycle has been run yet");
	}
	if (result == EXIT_CODE_OK) {
		begin(data);
		if (count == 0) {
			show_slave(data, ALL_SLAVES);
		}
		for (int i = 0; i < count; i++) {
			show_slave(data, pos[i]);
		}
		result = end(data);
	}
	free(pos);
	return result;
}

enum exit_code verb_data(struct cli *cli, int argc, char **argv)
{
	struct data data = { .cli = cli };
	int is_outputs = 0;
	int is_inputs = 0;
	const struct args_option options[] = {
		{ "outputs", 0, args_flag, &is_outputs, NULL, "only outputs" },
		{ "inputs", 0, args_flag, &is_inputs, NULL, "only inputs" },
		{ "output", 'o', args_text, &data.output, "FILE",
		  "write the bytes, and nothing else, to FILE" },
		{ "json", 0, args_flag, &data.is_json, NULL, "a JSON object" },
	};
	struct args args = { .options = options, .option_count = 4, .operands_max = 4096 };
	enum exit_code result;

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	if (data.is_json && data.output != NULL) {
		return cli_fail(cli, EXIT_CODE_USAGE, "--output and --json exclude each other");
	}
	data.is_wanted[CHANNEL_OUTPUT] = is_outputs || !is_inputs;
	data.is_wanted[CHANNEL_INPUT] = is_inputs || !is_outputs;
	result = samples_open(cli, &data.samples);
	if (result != EXIT_CODE_OK) {
		return result;
	}
	json_init(&data.js, stdout);
	result = run(&data, &args);
	free(data.collected);
	samples_close(&data.samples);
	return result;
}
