/* SPDX-License-Identifier: MIT */
#include <ctype.h>

#include "config/config.h"
#include "config/option.h"
#include "config/pages.h"
#include "harness/test.h"

static char *generated(void (*write_page)(FILE *out))
{
	char *text = NULL;
	size_t len = 0;
	FILE *out = open_memstream(&text, &len);

	CHECK(out != NULL);
	write_page(out);
	CHECK_EQ(fclose(out), 0);
	return text;
}

static char *committed(const char *path)
{
	static char text[1 << 17];
	FILE *in = fopen(path, "r");
	size_t len;

	if (in == NULL) {
		test_fail(__FILE__, __LINE__, "%s cannot be read", path);
	}
	len = fread(text, 1, sizeof(text) - 1, in);
	fclose(in);
	text[len] = '\0';
	return text;
}

static void is_fresh(const char *path, char *text)
{
	if (strcmp(committed(path), text) != 0) {
		test_fail(__FILE__, __LINE__, "%s is stale: regenerate it with ecdaq-options",
			  path);
	}
	free(text);
}

TEST(config, committed_reference_page_is_fresh)
{
	is_fresh(ECDAQ_DOC_DIR "/options.md", generated(pages_write_reference));
}

TEST(config, committed_sample_is_fresh)
{
	is_fresh(ECDAQ_DOC_DIR "/ecdaq.sample.yaml", generated(pages_write_sample));
}

TEST(config, every_option_is_on_the_reference_page_and_has_prose)
{
	char *page = generated(pages_write_reference);
	char row[128];

	for (size_t i = 0; i < option_count(); i++) {
		snprintf(row, sizeof(row), "| `%s` |", option_at(i)->name);
		if (strstr(page, row) == NULL) {
			test_fail(__FILE__, __LINE__, "%s is not on the page", option_at(i)->name);
		}
		CHECK(strlen(option_at(i)->prose) > 8);
	}
	free(page);
}

TEST(config, every_option_has_sound_bounds_and_a_default_within_them)
{
	static union {
		struct config cfg;
		struct option_sdo sdo;
		struct config_channel channel;
	} base;
	char why[OPTION_WHY_BYTES];

	for (size_t i = 0; i < option_count(); i++) {
		const struct option *option = option_at(i);
		int is_number = option->type != OPTION_SWITCH && option->type != OPTION_WORD &&
				option->type != OPTION_TEXT && option->type != OPTION_NAME;

		CHECK_EQ(option->min != NULL && option->max != NULL, is_number);
		if (option->type != OPTION_HEX) {
			CHECK_EQ(option->words != NULL, option->type == OPTION_WORD);
		}
		CHECK(option->default_value != NULL || strstr(option->name, "[]") != NULL);
		if (option->default_value != NULL) {
			CHECK_EQ(option_parse(option, option->default_value, &base, why), 0);
		}
		if (is_number) {
			CHECK_EQ(option_parse(option, option->min, &base, why), 0);
			CHECK_EQ(option_parse(option, option->max, &base, why), 0);
		}
		CHECK(option_find(option->name) == option);
	}
}

/* "slaves[].sdo[]" of "slaves[].sdo[].index"; 0: in no list */
static size_t item_len(const char *name)
{
	const char *end = strrchr(name, ']');

	return end == NULL ? 0 : (size_t)(end - name);
}

TEST(config, no_two_options_fill_the_same_field)
{
	for (size_t i = 0; i < option_count(); i++) {
		for (size_t j = 0; j < i; j++) {
			const struct option *a = option_at(i);
			const struct option *b = option_at(j);
			size_t list_len = item_len(a->name);

			if (item_len(b->name) != list_len ||
			    strncmp(a->name, b->name, list_len) != 0) {
				continue;
			}
			if (a->offset < b->offset + b->bytes && b->offset < a->offset + a->bytes) {
				test_fail(__FILE__, __LINE__, "%s and %s overlap", a->name,
					  b->name);
			}
		}
	}
}

TEST(config, sample_parses_to_the_defaults)
{
	static struct config cfg;
	static struct config defaults;
	char error[256] = "";
	char *text = generated(pages_write_sample);

	config_defaults(&defaults);
	if (config_parse("", text, strlen(text), &cfg, error, sizeof(error)) != 0) {
		test_fail(__FILE__, __LINE__, "%s", error);
	}
	CHECK_MEM(&cfg, &defaults, sizeof(cfg));
	free(text);
}

TEST(config, sample_names_every_option)
{
	char *text = generated(pages_write_sample);
	char line[128];

	for (size_t i = 0; i < option_count(); i++) {
		snprintf(line, sizeof(line), "%s: ", strrchr(option_at(i)->name, '.') + 1);
		CHECK(strstr(text, line) != NULL);
	}
	free(text);
}

TEST(config, sample_with_its_examples_uncommented_parses)
{
	static struct config cfg;
	char error[256] = "";
	char *text = generated(pages_write_sample);

	/* An example line is "#" at the line's start and no blank behind it, or a deep indent. */
	for (char *p = text; p != NULL && *p != '\0'; p = strchr(p, '\n')) {
		p += *p == '\n';
		if (p[0] == '#' && (isalpha((unsigned char)p[1]) || strncmp(p, "#  ", 3) == 0)) {
			memmove(p, p + 1, strlen(p));
		}
	}
	if (config_parse("s.yaml", text, strlen(text), &cfg, error, sizeof(error)) != 0) {
		test_fail(__FILE__, __LINE__, "%s\n%s", error, text);
	}
	CHECK_EQ(cfg.slave_count, 1);
	CHECK_EQ(cfg.sdo_count, 1);
	CHECK_EQ(cfg.output_count, 1);
	CHECK_STR(cfg.slave[0].name, "piccolo0");
	free(text);
}
