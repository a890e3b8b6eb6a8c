/* SPDX-License-Identifier: MIT */
#include "config/pages.h"

#include <string.h>

#include "config/option.h"

enum { WRAP_COLUMNS = 92 };

static int is_number(const struct option *option)
{
	return option->min != NULL;
}

/* @option of the item or section that @prefix names, not of a list inside it. */
static const char *name_under(const struct option *option, const char *prefix)
{
	size_t len = strlen(prefix);

	if (strncmp(option->name, prefix, len) != 0 || strchr(option->name + len, '.') != NULL) {
		return NULL;
	}
	return option->name + len;
}

static void write_range(const struct option *option, FILE *out)
{
	if (option->words != NULL) {
		for (const char *p = option->words; *p != '\0'; p++) {
			fputs(*p == '|' ? ", " : "", out);
			if (*p != '|') {
				fputc(*p, out);
			}
		}
		if (is_number(option)) {
			fprintf(out, ", %s to %s", option->min, option->max);
		}
	} else if (is_number(option)) {
		fprintf(out, "%s to %s", option->min, option->max);
	} else if (option->type == OPTION_SWITCH) {
		fputs("on, off", out);
	} else if (option->type == OPTION_NAME) {
		fprintf(out, "letters, digits, _ and -, at most %zu", option->bytes - 1);
	} else {
		fprintf(out, "at most %zu bytes", option->bytes - 1);
	}
}

static void write_default(const struct option *option, FILE *out)
{
	if (option->default_value == NULL) {
		fputs("required", out);
	} else if (option->default_value[0] == '\0') {
		fputs("empty", out);
	} else {
		fprintf(out, "`%s`", option->default_value);
	}
	if (option->otherwise != NULL) {
		fprintf(out, "; %s", option->otherwise);
	}
}

/* The options below @prefix, with their names below @shown. */
static void write_rows(const char *prefix, const char *shown, FILE *out)
{
	fputs("\n| option | default | range | plain number in | takes effect | what it is |\n"
	      "| --- | --- | --- | --- | --- | --- |\n",
	      out);
	for (size_t i = 0; i < option_count(); i++) {
		const struct option *option = option_at(i);

		const char *name = name_under(option, prefix);

		if (name == NULL) {
			continue;
		}
		fprintf(out, "| `%s%s` | ", shown, name);
		write_default(option, out);
		fputs(" | ", out);
		write_range(option, out);
		fprintf(out, " | %s | %s | %s |\n", option->unit,
			config_effect_to_str((uint32_t)option->effect), option->prose);
	}
}

void pages_write_reference(FILE *out)
{
	char prefix[OPTION_KEY_BYTES];
	char shown[OPTION_KEY_BYTES];

	fputs("# Options of ecdaq.yaml\n\n"
	      "Generated from the option table (`app/core/config/options.c`) by `ecdaq-options "
	      "--reference`;\n"
	      "a test keeps it fresh. [ecdaq.sample.yaml](ecdaq.sample.yaml) holds every option at "
	      "its\n"
	      "default.\n\n"
	      "Values carry their unit: `1ms`, `500us`, `64s`, `256MiB`, `50%`. Durations take ns, "
	      "us, ms, s,\n"
	      "min, h and d; sizes take B, kB, MB, GB, TB, KiB, MiB, GiB and TiB. A plain number "
	      "is in the\n"
	      "unit of the fourth column. Switches take on and off (also true, false, yes, no).\n\n"
	      "A mistake in the file is one line, `FILE:LINE: option: why`, and nothing of the "
	      "file is used.\n"
	      "On a command line the same options are set one by one: `cycle.period=500us`,\n"
	      "`slaves[0].mode=oneshot`.\n\n"
	      "`ecdaq config reload`, or SIGHUP to `ecdaqd`, reads the file again. \"takes "
	      "effect\" says when\n"
	      "another value does: `at once`; at the next `rescan`, as every other bring-up; or "
	      "after a `restart`\n"
	      "of the program that uses it.\n",
	      out);
	for (size_t i = 0; i < option_section_count; i++) {
		fprintf(out, "\n## %s\n\n%s\n", option_sections[i].name, option_sections[i].prose);
		snprintf(prefix, sizeof(prefix), "%s.", option_sections[i].name);
		write_rows(prefix, prefix, out);
	}
	for (int i = 0; i < OPTION_LISTS; i++) {
		fprintf(out, "\n## %s[]\n\n%s At most %zu (`%s`).\n", option_lists[i].name,
			option_lists[i].prose, option_lists[i].limit, option_lists[i].limit_name);
		option_list_prefix(&option_lists[i], prefix);
		snprintf(shown, sizeof(shown), "%s[].", option_lists[i].name);
		write_rows(prefix, shown, out);
	}
}

/* @text as comment lines that start with @lead. */
static void write_comment(const char *lead, const char *text, FILE *out)
{
	size_t column = 0;

	while (*text != '\0') {
		size_t len = strcspn(text, " ");

		if (column > 0 && column + 1 + len > WRAP_COLUMNS) {
			fputc('\n', out);
			column = 0;
		}
		if (column == 0) {
			fputs(lead, out);
			column = strlen(lead);
		}
		fprintf(out, " %.*s", (int)len, text);
		column += 1 + len;
		text += len + strspn(text + len, " ");
	}
	fputc('\n', out);
}

static void write_value(const struct option *option, FILE *out)
{
	/* YAML 1.1 parsers read a bare on or off as a boolean, as intended. */
	if (option->default_value[0] == '\0') {
		fputs("\"\"", out);
	} else {
		fputs(option->default_value, out);
	}
}

static void write_section(const struct option_section *section, FILE *out)
{
	char prefix[OPTION_KEY_BYTES];

	fputc('\n', out);
	write_comment("#", section->prose, out);
	fprintf(out, "%s:\n", section->name);
	snprintf(prefix, sizeof(prefix), "%s.", section->name);
	for (size_t i = 0; i < option_count(); i++) {
		const struct option *option = option_at(i);
		const char *name = name_under(option, prefix);

		if (name == NULL) {
			continue;
		}
		write_comment("  #", option->prose, out);
		if (is_number(option) || option->words != NULL) {
			fputs("  # (", out);
			write_range(option, out);
			fputs(")\n", out);
		}
		if (option->otherwise != NULL) {
			fprintf(out, "  # (%s)\n", option->otherwise);
		}
		fprintf(out, "  %s%s: ", option->otherwise == NULL ? "" : "#", name);
		write_value(option, out);
		fputc('\n', out);
	}
}

/* One line "# key: value  # prose" of a commented example item; the first one opens the item. */
static void write_example(const char *prefix, const char *indent, FILE *out)
{
	static const struct {
		const char *name;
		const char *value;
	} examples[] = {
		{ "slaves[].sync0_line", "pinctrl-bcm2711:17" },
		{ "slaves[].name", "piccolo0" },
		{ "slaves[].group", "front" },
		{ "slaves[].vendor", "0x00000002" },
		{ "slaves[].product", "0x04570862" },
		{ "slaves[].mode", "periodic" },
		{ "slaves[].pdos[].pdo", "0x1a01" },
		{ "slaves[].pdos[].entries", "0x6000:11 16, gap 8" },
		{ "slaves[].sdo[].index", "0x8000" },
		{ "slaves[].sdo[].subindex", "2" },
		{ "slaves[].sdo[].type", "UINT" },
		{ "slaves[].sdo[].value", "10" },
		{ "slaves[].sdo[].comment", "refresh time" },
		{ "slaves[].channels[].match", "adc" },
		{ "slaves[].channels[].name", "pressure" },
		{ "slaves[].channels[].unit", "bar" },
		{ "slaves[].channels[].scale", "0.0025" },
		{ "slaves[].channels[].offset", "-1" },
		{ "slaves[].channels[].min", "0" },
		{ "slaves[].channels[].max", "6" },
		{ "outputs[].channel", "piccolo0.led" },
		{ "outputs[].max", "1" },
		{ "outputs[].min", "0" },
	};
	const char *dash = "- ";

	for (size_t i = 0; i < option_count(); i++) {
		const struct option *option = option_at(i);
		const char *name = name_under(option, prefix);
		const char *value = option->default_value;

		if (name == NULL) {
			continue;
		}
		for (size_t j = 0; j < sizeof(examples) / sizeof(examples[0]); j++) {
			if (strcmp(examples[j].name, option->name) == 0) {
				value = examples[j].value;
			}
		}
		fprintf(out, "#%s%s%s: %s\n", indent, dash, name, value);
		dash = "  ";
	}
}

void pages_write_sample(FILE *out)
{
	fputs("# SPDX-License-Identifier: MIT\n"
	      "# ecdaq.yaml: every option at its default. Generated from the option table by\n"
	      "# `ecdaq-options --sample`; options.md explains units and ranges.\n",
	      out);
	for (size_t i = 0; i < option_section_count; i++) {
		write_section(&option_sections[i], out);
	}
	fputc('\n', out);
	write_comment("#", option_lists[OPTION_LIST_SLAVES].prose, out);
	fputs("#slaves:\n", out);
	write_example("slaves[].", "  ", out);
	write_comment("#    #", option_lists[OPTION_LIST_PDOS].prose, out);
	fputs("#    pdos:\n", out);
	write_example("slaves[].pdos[].", "      ", out);
	write_comment("#    #", option_lists[OPTION_LIST_SDOS].prose, out);
	fputs("#    sdo:\n", out);
	write_example("slaves[].sdo[].", "      ", out);
	write_comment("#    #", option_lists[OPTION_LIST_CHANNELS].prose, out);
	fputs("#    channels:\n", out);
	write_example("slaves[].channels[].", "      ", out);
	write_comment("#    #", option_lists[OPTION_LIST_SLAVE_OUTPUTS].prose, out);
	fputs("#    outputs: []\n", out);
	fputc('\n', out);
	write_comment("#", option_lists[OPTION_LIST_OUTPUTS].prose, out);
	fputs("#outputs:\n", out);
	write_example("outputs[].", "  ", out);
}
