/* SPDX-License-Identifier: MIT */
#include "cli/lines.h"

#include <inttypes.h>
#include <stdio.h>

#include "cli/text.h"
#include "image/image.h"
#include "program/json.h"
#include "reader/table.h"

static const struct channel *chosen(const struct lines *lines, unsigned i)
{
	return &lines->samples->channels[lines->choice->channel[i]];
}

int lines_is_bad(const struct sample_header *header, const struct channel *ch)
{
	return !sample_is_good(header, ch->slave_pos);
}

void lines_write_head(const struct lines *lines)
{
	printf("#%11s %19s", "cycle", "dc_time_ns");
	for (unsigned i = 0; i < lines->choice->count; i++) {
		const struct channel *ch = chosen(lines, i);
		int has_unit = !lines->is_raw && ch->unit[0] != '\0';

		printf(" %16s%s%s%s", ch->name, has_unit ? "[" : "", has_unit ? ch->unit : "",
		       has_unit ? "]" : "");
	}
	putchar('\n');
}

/* '!': not a good sample; '?': not plausible. */
static char mark_of(const struct sample_header *header, const struct channel *ch, uint64_t raw)
{
	if (lines_is_bad(header, ch)) {
		return '!';
	}
	return image_is_outside(ch, image_raw_to_physical(ch, raw)) ? '?' : ' ';
}

void lines_write_text(const struct lines *lines)
{
	const uint8_t *image = samples_image(lines->samples);
	struct sample_header header = samples_header(lines->samples);
	char flags[128];
	char value[TEXT_BYTES];

	printf("%12" PRIu64 " %19" PRId64, header.cycle, header.dc_time_ns);
	for (unsigned i = 0; i < lines->choice->count; i++) {
		const struct channel *ch = chosen(lines, i);
		uint64_t raw = image_get_raw(image, ch);

		if (lines->is_raw) {
			image_raw_format(ch, raw, value, sizeof(value));
		} else {
			text_value(ch, raw, value);
		}
		printf(" %15s%c", value, mark_of(&header, ch, raw));
	}
	samples_flags_format(header.flags, flags, sizeof(flags));
	printf("%s%s\n", flags[0] == '\0' ? "" : " ", flags);
}

void lines_write_json(const struct lines *lines)
{
	const uint8_t *image = samples_image(lines->samples);
	struct sample_header header = samples_header(lines->samples);
	struct json js;

	json_init(&js, stdout);
	json_object_begin(&js, NULL);
	json_u64(&js, "cycle", header.cycle);
	json_i64(&js, "dc_time_ns", header.dc_time_ns);
	json_object_begin(&js, "values");
	for (unsigned i = 0; i < lines->choice->count; i++) {
		text_value_json(&js, chosen(lines, i)->name, chosen(lines, i),
				image_get_raw(image, chosen(lines, i)),
				lines->is_raw ? TEXT_RAW : TEXT_PHYSICAL);
	}
	json_object_end(&js);
	json_array_begin(&js, "bad");
	for (unsigned i = 0; i < lines->choice->count; i++) {
		if (lines_is_bad(&header, chosen(lines, i))) {
			json_text(&js, NULL, chosen(lines, i)->name);
		}
	}
	json_array_end(&js);
	json_array_begin(&js, "outside");
	for (unsigned i = 0; i < lines->choice->count; i++) {
		if (mark_of(&header, chosen(lines, i), image_get_raw(image, chosen(lines, i))) ==
		    '?') {
			json_text(&js, NULL, chosen(lines, i)->name);
		}
	}
	json_array_end(&js);
	json_array_begin(&js, "flags");
	for (unsigned bit = 0; bit < 32; bit++) {
		if ((header.flags >> bit & 1) != 0 && samples_flag_name(bit) != NULL) {
			json_text(&js, NULL, samples_flag_name(bit));
		}
	}
	json_array_end(&js);
	json_object_end(&js);
	json_end_line(&js);
}
