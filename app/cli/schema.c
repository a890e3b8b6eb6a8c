/* SPDX-License-Identifier: MIT */
#include "cli/schema.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "config/number.h"
#include "config/option.h"

enum { TEXT_LIMIT_BYTES = 1024, PATTERN_BYTES = 96 };

static const char duration_pattern[] = "^[-+]?[0-9]+(\\.[0-9]*)? *(ns|us|ms|s|min|h|d)?$";
static const char size_pattern[] = "^[-+]?[0-9]+(\\.[0-9]*)? *([kMGT]?B|[KMGT]iB)?$";

static void put_enum_text(struct json *js, const char *word)
{
	json_object_begin(js, NULL);
	json_text(js, "const", word);
	json_object_end(js);
}

/* What matches @words in any case, since the words of the file are. */
static void put_pattern(struct json *js, const char *words)
{
	char pattern[TEXT_LIMIT_BYTES] = "^(";
	char *end = pattern + strlen(pattern);

	for (const char *p = words;
	     *p != '\0' && end + sizeof("[aA])$") < pattern + sizeof(pattern); p++) {
		char lower = (char)(*p | 0x20);

		if (lower >= 'a' && lower <= 'z') {
			*end++ = '[';
			*end++ = lower;
			*end++ = (char)(lower & ~0x20);
			*end++ = ']';
		} else {
			*end++ = *p;
		}
	}
	memcpy(end, ")$", sizeof(")$"));
	json_object_begin(js, NULL);
	json_text(js, "type", "string");
	json_text(js, "pattern", pattern);
	json_object_end(js);
}

static void put_words(struct json *js, const char *words)
{
	/* The words themselves as well: an editor offers them. */
	for (const char *p = words; *p != '\0';) {
		char word[OPTION_KEY_BYTES];
		size_t n = strcspn(p, "|");

		snprintf(word, sizeof(word), "%.*s", (int)n, p);
		put_enum_text(js, word);
		p += n + (p[n] == '|');
	}
	put_pattern(js, words);
}

static int has_word(const char *words, const char *word)
{
	size_t len = strlen(word);

	for (const char *p = words; p != NULL && *p != '\0';) {
		size_t n = strcspn(p, "|");

		if (n == len && strncmp(p, word, len) == 0) {
			return 1;
		}
		p += n + (p[n] == '|');
	}
	return 0;
}

static void put_truth(struct json *js, int value)
{
	json_object_begin(js, NULL);
	json_truth(js, "const", value);
	json_object_end(js);
}

static int is_of_time(const struct option *option)
{
	return number_unit_family(option) == NUMBER_OF_TIME;
}

static int has_family(const struct option *option)
{
	return number_unit_family(option) != NUMBER_PLAIN;
}

/* Bounds only where a plain number is in the same unit as they are. */
static void put_bound(struct json *js, const char *key, const char *text)
{
	char *end;
	double bound = strtod(text, &end);

	if (*end == '\0' && bound > -1e308 && bound < 1e308) {
		json_double(js, key, bound);
	}
}

static void put_number(struct json *js, const struct option *option, const char *type)
{
	json_object_begin(js, NULL);
	json_text(js, "type", type);
	if (!has_family(option) && option->unit[0] != '%') {
		put_bound(js, "minimum", option->type == OPTION_HEX ? "0" : option->min);
		put_bound(js, "maximum", option->max);
	}
	json_object_end(js);
}

static void put_text_form(struct json *js, const char *pattern)
{
	json_object_begin(js, NULL);
	json_text(js, "type", "string");
	json_text(js, "pattern", pattern);
	json_object_end(js);
}

/* Numbers as text: with their unit, or in hexadecimal. */
static void put_number_text(struct json *js, const struct option *option)
{
	char pattern[PATTERN_BYTES];
	const char *number = "[-+]?([0-9]+\\.?[0-9]*|\\.[0-9]+)([eE][-+]?[0-9]+)?";

	if (has_family(option)) {
		put_text_form(js, is_of_time(option) ? duration_pattern : size_pattern);
		return;
	}
	if (option->type != OPTION_NUMBER) {
		put_text_form(js, "^0[xX][0-9a-fA-F]+$");
	}
	if (option->type == OPTION_NUMBER && option->unit[0] == '\0') {
		put_text_form(js, "^[-+]?([iI][nN][fF]|[iI][nN][fF][iI][nN][iI][tT][yY])$");
	}
	snprintf(pattern, sizeof(pattern), "^%s *%s%s%s$", number,
		 option->unit[0] != '\0' ? "(" : "", option->unit,
		 option->unit[0] != '\0' ? ")?" : "");
	put_text_form(js, pattern);
}

static void put_text(struct json *js, const struct option *option)
{
	json_object_begin(js, NULL);
	json_text(js, "type", "string");
	json_u64(js, "maxLength", option->bytes - 1);
	if (option->type == OPTION_NAME) {
		json_text(js, "pattern", "^[A-Za-z0-9_-]*$");
	}
	json_object_end(js);
	/* A text that looks like a number or a truth value is one for YAML. */
	json_object_begin(js, NULL);
	json_array_begin(js, "type");
	json_text(js, NULL, option->type == OPTION_NAME ? "integer" : "number");
	json_text(js, NULL, "boolean");
	json_array_end(js);
	json_object_end(js);
}

static void put_switch(struct json *js)
{
	put_truth(js, 1);
	put_truth(js, 0);
	put_words(js, "on|off|true|false|yes|no|1|0");
	json_object_begin(js, NULL);
	json_text(js, "type", "integer");
	json_u64(js, "minimum", 0);
	json_u64(js, "maximum", 1);
	json_object_end(js);
}

/* The forms that a value may have. */
static void put_forms(struct json *js, const struct option *option)
{
	switch (option->type) {
	case OPTION_SWITCH:
		put_switch(js);
		return;
	case OPTION_TEXT:
	case OPTION_NAME:
		put_text(js, option);
		return;
	case OPTION_WORD:
	case OPTION_HEX:
	case OPTION_DURATION:
	case OPTION_SIZE:
	case OPTION_NUMBER:
	case OPTION_INT:
	case OPTION_UINT:
		break;
	}
	if (option->words != NULL) {
		put_words(js, option->words);
	}
	/* YAML takes these words for truth values. */
	if (has_word(option->words, "on") || has_word(option->words, "true")) {
		put_truth(js, 1);
	}
	if (has_word(option->words, "off") || has_word(option->words, "false")) {
		put_truth(js, 0);
	}
	if (option->type != OPTION_WORD) {
		put_number(js, option,
			   option->type == OPTION_NUMBER || has_family(option) ? "number"
									       : "integer");
		put_number_text(js, option);
	}
}

static void put_option(struct json *js, const struct option *option, const char *name)
{
	char text[TEXT_LIMIT_BYTES];
	int len = snprintf(text, sizeof(text), "%s", option->prose);

	if (option->min != NULL && len > 0 && (size_t)len < sizeof(text)) {
		snprintf(text + len, sizeof(text) - (size_t)len, " %s to %s.", option->min,
			 option->max);
	}
	json_object_begin(js, name);
	json_text(js, "description", text);
	json_text(js, "x-takes-effect", config_effect_to_str((uint32_t)option->effect));
	if (option->default_value != NULL) {
		json_text(js, "default", option->default_value);
	}
	json_array_begin(js, "anyOf");
	put_forms(js, option);
	json_array_end(js);
	json_object_end(js);
}

/* @option of the section or item that @prefix names, not of a list inside it: its own name. */
static const char *name_under(const struct option *option, const char *prefix)
{
	size_t len = strlen(prefix);

	return strncmp(option->name, prefix, len) == 0 && strchr(option->name + len, '.') == NULL
		       ? option->name + len
		       : NULL;
}

static void put_lists(struct json *js, const char *prefix);

/* An object; the items of some lists may be a line of text instead. */
static void put_type(struct json *js, const struct option_list *list)
{
	if (list == NULL || list->line_pattern == NULL) {
		json_text(js, "type", "object");
		return;
	}
	json_array_begin(js, "type");
	json_text(js, NULL, "object");
	json_text(js, NULL, "string");
	if (list->is_number_line) {
		json_text(js, NULL, "number");
	}
	json_array_end(js);
	json_text(js, "pattern", list->line_pattern);
}

/* The inside of an object: the options, and the lists, below @prefix. */
static void put_members(struct json *js, const char *prefix)
{
	json_truth(js, "additionalProperties", 0);
	json_object_begin(js, "properties");
	for (size_t i = 0; i < option_count(); i++) {
		const char *name = name_under(option_at(i), prefix);

		if (name != NULL) {
			put_option(js, option_at(i), name);
		}
	}
	put_lists(js, prefix);
	json_object_end(js);
	json_array_begin(js, "required");
	for (size_t i = 0; i < option_count(); i++) {
		const char *name = name_under(option_at(i), prefix);

		if (name != NULL && option_at(i)->default_value == NULL) {
			json_text(js, NULL, name);
		}
	}
	json_array_end(js);
}

/* The lists right below @prefix; "" for those of the file itself. */
static void put_lists(struct json *js, const char *prefix)
{
	size_t len = strlen(prefix);

	for (int i = 0; i < OPTION_LISTS; i++) {
		const struct option_list *list = &option_lists[i];
		char inside[OPTION_KEY_BYTES];

		if (strncmp(list->name, prefix, len) != 0 ||
		    strchr(list->name + len, '.') != NULL) {
			continue;
		}
		json_object_begin(js, list->name + len);
		json_text(js, "description", list->prose);
		json_text(js, "type", "array");
		json_u64(js, "maxItems", list->limit);
		json_object_begin(js, "items");
		option_list_prefix(list, inside);
		put_type(js, list);
		put_members(js, inside);
		json_object_end(js);
		json_object_end(js);
	}
}

void schema_write(struct json *js)
{
	char prefix[OPTION_KEY_BYTES];

	json_object_begin(js, NULL);
	json_text(js, "$schema", "http://json-schema.org/draft-07/schema#");
	json_text(js, "title", "ecdaq.yaml");
	json_text(js, "description", "Configuration of ecdaq " ECDAQ_VERSION);
	json_text(js, "type", "object");
	json_truth(js, "additionalProperties", 0);
	json_object_begin(js, "properties");
	for (size_t i = 0; i < option_section_count; i++) {
		snprintf(prefix, sizeof(prefix), "%s.", option_sections[i].name);
		json_object_begin(js, option_sections[i].name);
		json_text(js, "description", option_sections[i].prose);
		put_type(js, NULL);
		put_members(js, prefix);
		json_object_end(js);
	}
	put_lists(js, "");
	json_object_end(js);
	json_object_end(js);
	json_end_line(js);
}
