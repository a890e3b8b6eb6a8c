/* SPDX-License-Identifier: MIT */
#include "cli/cstruct.h"

#include <ctype.h>
#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "base/args.h"
#include "cli/cli.h"
#include "cli/fit.h"
#include "cli/screen.h"
#include "cli/source.h"
#include "cli/text.h"
#include "image/image.h"

enum {
	INDENT = 8, /* of what continues a line */
	PREFIX_MAX = 40,
	MEMBER_BYTES = sizeof(((struct channel *)0)->name) + 24, /* with a number */
};

/* A channel with the name of its member. */
struct member {
	const struct channel *ch;
	char name[MEMBER_BYTES];
};

struct writer {
	FILE *out;
	const char *tab; /* before a member */
	const char *prefix;
	struct member *member; /* by place in the image */
	size_t count;
	unsigned pads;
};

int cstruct_is_name(const char *text)
{
	size_t len = strlen(text);

	if (len == 0 || len > PREFIX_MAX || isdigit((unsigned char)text[0])) {
		return 0;
	}
	for (size_t i = 0; i < len; i++) {
		if (!isascii((unsigned char)text[i]) ||
		    (!isalnum((unsigned char)text[i]) && text[i] != '_')) {
			return 0;
		}
	}
	return 1;
}

/* --- names --- */

/* "piccolo0.adc" as piccolo0_adc. A dot or something in front makes it none of C's own words. */
static void make_name(struct member *member)
{
	const char *text = member->ch->name;
	int is_plain = strchr(text, '.') == NULL || isdigit((unsigned char)text[0]);
	size_t used = is_plain ? 3 : 0;

	memcpy(member->name, "ch_", 4);
	for (; *text != '\0' && used + 1 < sizeof(member->ch->name) + 4; text++) {
		int is_kept = isascii((unsigned char)*text) && isalnum((unsigned char)*text);

		member->name[used++] = is_kept ? *text : '_';
	}
	member->name[used] = '\0';
}

static int compare_names(const void *a, const void *b)
{
	return strcmp(((const struct member *)a)->name, ((const struct member *)b)->name);
}

static int compare_places(const void *a, const void *b)
{
	const struct channel *first = ((const struct member *)a)->ch;
	const struct channel *second = ((const struct member *)b)->ch;

	if (first->bit_offset != second->bit_offset) {
		return first->bit_offset < second->bit_offset ? -1 : 1;
	}
	return first < second ? -1 : first > second;
}

/* Names that are the same once made C names get the place behind them, which no other has. */
static void make_names_unique(struct writer *w)
{
	size_t i = 0;

	qsort(w->member, w->count, sizeof(*w->member), compare_names);
	while (i < w->count) {
		size_t n = 1;

		while (i + n < w->count && strcmp(w->member[i].name, w->member[i + n].name) == 0) {
			n++;
		}
		for (size_t k = i; n > 1 && k < i + n; k++) {
			size_t len = strlen(w->member[k].name);

			snprintf(w->member[k].name + len, MEMBER_BYTES - len, "__at_%" PRIu32,
				 w->member[k].ch->bit_offset);
		}
		i += n;
	}
	qsort(w->member, w->count, sizeof(*w->member), compare_places);
}

/* --- members --- */

/* A type of its own, at a whole byte; NULL: a bit-field. */
static const char *type_of(const struct channel *ch)
{
	static const char *const uints[] = { "uint8_t", "uint16_t", "uint32_t", "uint64_t" };
	static const char *const ints[] = { "int8_t", "int16_t", "int32_t", "int64_t" };
	unsigned size = 0;

	if (ch->bit_offset % 8 != 0 || ch->type == CHANNEL_BOOL) {
		return NULL;
	}
	while (size < 4 && ch->bit_len != 8u << size) {
		size++;
	}
	if (size == 4) {
		return NULL;
	}
	if (ch->type == CHANNEL_FLOAT) {
		return size == 2 ? "float" : size == 3 ? "double" : NULL;
	}
	return ch->type == CHANNEL_INT ? ints[size] : uints[size];
}

static void write_comment(const struct writer *w, const struct channel *ch)
{
	char type[16];
	char unit[sizeof(ch->unit)];

	image_type_format(ch, type, sizeof(type));
	text_plain(ch->unit, unit, sizeof(unit));
	/* What would end the comment. */
	for (char *p = unit; *p != '\0'; p++) {
		*p = *p == '*' ? '?' : *p;
	}
	fprintf(w->out, " /* %u.%u %s", ch->bit_offset / 8, ch->bit_offset % 8, type);
	if (image_is_scaled(ch)) {
		fprintf(w->out, " * %.9g + %.9g", ch->scale, ch->offset);
	}
	fprintf(w->out, "%s%s */\n", unit[0] == '\0' ? "" : " ", unit);
}

static void write_member(const struct writer *w, const struct member *member)
{
	const struct channel *ch = member->ch;
	const char *type = type_of(ch);

	if (type != NULL) {
		fprintf(w->out, "%s%s %s;", w->tab, type, member->name);
	} else {
		fprintf(w->out, "%s%sint%u_t %s : %u;", w->tab, ch->type == CHANNEL_INT ? "" : "u",
			ch->bit_len > 32 ? 64u : 32u, member->name, ch->bit_len);
	}
	write_comment(w, ch);
}

/* What no channel covers: bits up to the next byte, bytes, bits. */
static void write_gap(struct writer *w, uint32_t from, uint32_t to)
{
	uint32_t whole = (from + 7) / 8 * 8;

	if (whole > to) {
		whole = to;
	}
	if (whole > from) {
		fprintf(w->out, "%suint32_t pad%u : %u;\n", w->tab, w->pads++, whole - from);
	}
	if (to / 8 > whole / 8) {
		fprintf(w->out, "%suint8_t pad%u[%u];\n", w->tab, w->pads++, (to - whole) / 8);
	}
	if (to % 8 != 0 && to / 8 * 8 >= whole) {
		fprintf(w->out, "%suint32_t pad%u : %u;\n", w->tab, w->pads++, to % 8);
	}
}

/* The bits @from to @to of the image. */
static void write_struct(struct writer *w, const char *name, uint32_t from, uint32_t to)
{
	uint32_t at = from;

	if (to == from) {
		return; /* C has no empty structure */
	}
	fprintf(w->out, "\n/* bytes %u to %u of the image */\nstruct %s_%s {\n", from / 8,
		to / 8 - 1, w->prefix, name);
	w->pads = 0;
	for (size_t i = 0; i < w->count; i++) {
		const struct channel *ch = w->member[i].ch;

		if (ch->bit_offset < from || ch->bit_offset >= to) {
			continue;
		}
		if (ch->bit_offset < at || ch->bit_offset + ch->bit_len > to) {
			fprintf(w->out, "%s/* %s lies over it:", w->tab, w->member[i].name);
			fprintf(w->out, " %u bits at %u.%u */\n", ch->bit_len, ch->bit_offset / 8,
				ch->bit_offset % 8);
			continue;
		}
		write_gap(w, at, ch->bit_offset);
		write_member(w, &w->member[i]);
		at = ch->bit_offset + ch->bit_len;
	}
	write_gap(w, at, to);
	fprintf(w->out,
		"} __attribute__((packed));\n"
		"typedef char %s_%s_has_its_size[sizeof(struct %s_%s) == %u ? 1 : -1];\n",
		w->prefix, name, w->prefix, name, (to - from) / 8);
}

int cstruct_write(FILE *out, const struct sample_meta *meta, const struct channel *channels,
		  const char *prefix, int columns)
{
	struct writer w = { .out = out, .prefix = prefix };
	struct fit fit;

	w.member = calloc((size_t)meta->channel_count + 1, sizeof(*w.member));
	if (w.member == NULL) {
		return -ENOMEM;
	}
	for (uint32_t i = 0; i < meta->channel_count; i++) {
		if (image_channel_fits(&channels[i], meta->image_bytes)) {
			w.member[w.count].ch = &channels[i];
			make_name(&w.member[w.count++]);
		}
	}
	make_names_unique(&w);
	/* A tab has no width of its own. */
	w.tab = columns > 0 ? "        " : "\t";
	out = w.out = fit_begin(&fit, columns, out);
	fprintf(out,
		"/* Process image: %u slaves, %u bytes of outputs, %u of inputs; by ecdaq "
		"cstruct. Each\n * member: byte.bit in the image, type, scale and unit. For gcc "
		"and "
		"clang on little-endian\n * machines. */\n#ifndef %s_PROCESS_IMAGE\n#define "
		"%s_PROCESS_IMAGE\n\n#include <stdint.h>\n",
		meta->slave_count, meta->output_bytes, meta->image_bytes - meta->output_bytes,
		prefix, prefix);
	write_struct(&w, "outputs", 0, meta->output_bytes * 8);
	write_struct(&w, "inputs", meta->output_bytes * 8, meta->image_bytes * 8);
	fprintf(out, "\n#endif\n");
	fit_end(&fit, INDENT);
	free(w.member);
	return 0;
}

/* --- the verb --- */

static enum exit_code write_to(struct cli *cli, const struct samples *samples, const char *path,
			       const char *prefix)
{
	FILE *out = path == NULL ? stdout : fopen(path, "we");
	int r;

	if (out == NULL) {
		return cli_fail(cli, errno == EACCES ? EXIT_CODE_PERMISSION : EXIT_CODE_FAILED,
				"%s: %s", path, strerror(errno));
	}
	errno = 0;
	r = cstruct_write(out, samples->meta, samples->channels, prefix,
			  path == NULL ? screen_columns() : 0);
	if (r == 0 && path != NULL && ferror(out)) {
		r = errno != 0 ? -errno : -EIO;
	}
	if (path != NULL && fclose(out) != 0 && r == 0) {
		r = -errno;
	}
	return r < 0 ? cli_fail(cli, EXIT_CODE_FAILED, "%s: %s",
				path == NULL ? "standard output" : path, strerror(-r))
		     : EXIT_CODE_OK;
}

enum exit_code verb_cstruct(struct cli *cli, int argc, char **argv)
{
	const char *output = NULL;
	const char *prefix = "ecdaq";
	const struct args_option options[] = {
		{ "output", 'o', args_text, &output, "FILE", "write to FILE" },
		{ "name", 'n', args_text, &prefix, "NAME",
		  "begin of the structures' names (ecdaq)" },
	};
	struct args args = { .options = options, .option_count = 2 };
	struct samples samples;
	enum exit_code result;

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	if (!cstruct_is_name(prefix)) {
		return cli_fail(cli, EXIT_CODE_USAGE,
				"--name: %s: expected a C name of up to %d characters", prefix,
				PREFIX_MAX);
	}
	result = samples_open(cli, &samples);
	if (result == EXIT_CODE_OK) {
		result = write_to(cli, &samples, output, prefix);
		samples_close(&samples);
	}
	return result;
}
