/* SPDX-License-Identifier: MIT */
/* ecdaq channels */
#include <stdio.h>
#include <string.h>

#include "base/args.h"
#include "cli/cli.h"
#include "cli/fit.h"
#include "cli/screen.h"
#include "cli/source.h"
#include "image/image.h"
#include "program/json.h"

/* Columns of a name, of what is always behind it, and before what continues a line. */
enum { NAME_COLUMNS = 28, REST_COLUMNS = 34, INDENT = 4 };

/* Of the names; of those that fit no line, the lines are broken. */
static int name_columns(const struct samples *samples, int columns)
{
	int room = columns - REST_COLUMNS > NAME_COLUMNS ? columns - REST_COLUMNS : NAME_COLUMNS;
	int longest = (int)strlen("channel");

	for (uint32_t i = 0; i < samples->meta->channel_count; i++) {
		int len = (int)strlen(samples->channels[i].name);

		longest = len > longest ? len : longest;
	}
	return columns == 0 ? NAME_COLUMNS : longest < room ? longest : room;
}

static void put_channel(FILE *out, const struct channel *ch, int name)
{
	char type[16];
	char place[24];

	image_type_format(ch, type, sizeof(type));
	snprintf(place, sizeof(place), "%u.%u", ch->bit_offset / 8, ch->bit_offset % 8);
	fprintf(out, "%-*s %-4s %-8s %8s  0x%04x:%02x", name, ch->name,
		ch->direction == CHANNEL_OUTPUT ? "out" : "in", type, place, ch->index,
		ch->subindex);
	if (image_is_scaled(ch)) {
		fprintf(out, "  * %.9g + %.9g", ch->scale, ch->offset);
	}
	fprintf(out, "%s%s", ch->unit[0] == '\0' ? "" : "  ", ch->unit);
	if (image_has_range(ch)) {
		fprintf(out, "  (%.9g to %.9g)", ch->min, ch->max);
	}
	fputc('\n', out);
}

static void show_text(const struct samples *samples)
{
	int columns = screen_columns();
	int name = name_columns(samples, columns);
	struct fit fit;
	FILE *out = fit_begin(&fit, columns, stdout);

	fprintf(out, "%-*s %-4s %-8s %8s  %s\n", name, "channel", "dir", "type", "at", "object");
	for (uint32_t i = 0; i < samples->meta->channel_count; i++) {
		put_channel(out, &samples->channels[i], name);
	}
	fit_end(&fit, INDENT);
}

static void write_json(struct json *js, const struct channel *ch, const struct samples *samples)
{
	char type[16];

	image_type_format(ch, type, sizeof(type));
	json_object_begin(js, NULL);
	json_text(js, "name", ch->name);
	json_text(js, "direction", ch->direction == CHANNEL_OUTPUT ? "output" : "input");
	json_text(js, "type", type);
	json_u64(js, "slave", ch->slave_pos);
	if (ch->slave_pos < samples->meta->slave_count) {
		json_text(js, "slave_name", samples->slaves[ch->slave_pos].name);
	}
	json_u64(js, "index", ch->index);
	json_u64(js, "subindex", ch->subindex);
	json_u64(js, "bit_offset", ch->bit_offset);
	json_u64(js, "bit_length", ch->bit_len);
	json_text(js, "unit", ch->unit);
	json_double(js, "scale", ch->scale);
	json_double(js, "offset", ch->offset);
	if (image_has_range(ch)) { /* an open end is null */
		json_double(js, "min", ch->min);
		json_double(js, "max", ch->max);
	}
	json_object_end(js);
}

static void show_json(const struct samples *samples)
{
	struct json js;

	json_init(&js, stdout);
	json_array_begin(&js, NULL);
	for (uint32_t i = 0; i < samples->meta->channel_count; i++) {
		write_json(&js, &samples->channels[i], samples);
	}
	json_array_end(&js);
	json_end_line(&js);
}

enum exit_code verb_channels(struct cli *cli, int argc, char **argv)
{
	int is_json = 0;
	const struct args_option options[] = {
		{ "json", 0, args_flag, &is_json, NULL, "a JSON array" },
	};
	struct args args = { .options = options, .option_count = 1 };
	struct samples samples;
	enum exit_code result;

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	result = samples_open(cli, &samples);
	if (result != EXIT_CODE_OK) {
		return result;
	}
	if (is_json) {
		show_json(&samples);
	} else {
		show_text(&samples);
	}
	samples_close(&samples);
	return EXIT_CODE_OK;
}
