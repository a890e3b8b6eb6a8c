/* SPDX-License-Identifier: MIT */
/* Start-up SDOs: the short form, and what a whole item means. */
#include "config/startup.h"

#include <ctype.h>
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "base/bytes.h"
#include "config/sdo_value.h"

/* --- the short form --- */

struct cut {
	struct startup_line *line;
	const char *at;
};

static void skip_blanks(struct cut *cut)
{
	cut->at += strspn(cut->at, " \t");
}

/* The next @len characters are option @name. 0; -EINVAL they are too many, or none. */
static int take(struct cut *cut, const char *name, size_t len)
{
	struct startup_field *field = &cut->line->field[cut->line->count];

	if (len == 0 || len >= sizeof(field->text) || cut->line->count >= STARTUP_FIELDS) {
		return -EINVAL;
	}
	field->name = name;
	memcpy(field->text, cut->at, len);
	field->text[len] = '\0';
	cut->at += len;
	cut->line->count++;
	skip_blanks(cut);
	return 0;
}

static int cut_transition(struct cut *cut)
{
	return isalpha((unsigned char)cut->at[0]) ? take(cut, "transition", strcspn(cut->at, " \t"))
						  : 0;
}

/* "0x8000:0a": both in hexadecimal, as `ecdaq sdo list` prints them. */
static int cut_object(struct cut *cut)
{
	struct startup_field *field;
	char digits[5] = "";
	size_t len;

	if (cut->at[0] != '0' || (cut->at[1] != 'x' && cut->at[1] != 'X') ||
	    take(cut, "index", strcspn(cut->at, " \t:=")) < 0) {
		return -EINVAL;
	}
	if (cut->at[0] != ':') {
		return 0;
	}
	cut->at++;
	len = strcspn(cut->at, " \t=");
	field = &cut->line->field[cut->line->count];
	if (take(cut, "subindex", len) < 0 || len > 4) {
		return -EINVAL;
	}
	if (strncasecmp(field->text, "0x", 2) != 0) {
		if (len > 2) {
			return -EINVAL;
		}
		memcpy(digits, field->text, len);
		snprintf(field->text, sizeof(field->text), "0x%s", digits);
	}
	return 0;
}

/* "complete UINT", or nothing in front of the "=": the type of the slave's dictionary. */
static int cut_type(struct cut *cut)
{
	static const char word[] = "complete";
	size_t len = strcspn(cut->at, " \t=");

	if (len == sizeof(word) - 1 && strncasecmp(cut->at, word, len) == 0) {
		if (take(cut, "complete", len) < 0) {
			return -EINVAL;
		}
		snprintf(cut->line->field[cut->line->count - 1].text, sizeof("true"), "true");
		len = strcspn(cut->at, " \t=");
	}
	return len == 0 && cut->at[0] == '=' ? 0 : take(cut, "type", len);
}

/* To the end, or to a # behind a blank; without the blanks around it. */
static int cut_value(struct cut *cut)
{
	const char *end = cut->at;
	size_t len;

	while (*end != '\0' && !(*end == '#' && (end == cut->at || end[-1] == ' '))) {
		end++;
	}
	len = (size_t)(end - cut->at);
	while (len > 0 && isblank((unsigned char)cut->at[len - 1])) {
		len--;
	}
	if (take(cut, "value", len) < 0) {
		return -EINVAL;
	}
	if (cut->at[0] != '#') {
		return 0;
	}
	cut->at++;
	skip_blanks(cut);
	len = strlen(cut->at);
	return len == 0 ? 0 : take(cut, "comment", len);
}

int startup_line_cut(const char *text, struct startup_line *ret_line, char *reason)
{
	struct cut cut = { .line = ret_line, .at = text };
	int r;

	ret_line->count = 0;
	skip_blanks(&cut);
	r = cut_transition(&cut);
	r = r < 0 ? r : cut_object(&cut);
	r = r < 0 ? r : cut_type(&cut);
	if (r == 0 && cut.at[0] == '=') {
		cut.at++;
		skip_blanks(&cut);
		r = cut_value(&cut);
	} else {
		r = -EINVAL;
	}
	if (r < 0) {
		snprintf(reason, OPTION_WHY_BYTES,
			 "expected a line such as \"" STARTUP_LINE_FORM "\", not \"%.64s\"", text);
	}
	return r;
}

/* --- a whole item --- */

static int hex_digit(char c)
{
	const char *digits = "0123456789abcdef";
	const char *found = c == '\0' ? NULL : strchr(digits, tolower((unsigned char)c));

	return found == NULL ? -1 : (int)(found - digits);
}

/* "01 0a ff", the blanks may be missing: how many, or -EINVAL. */
static int octets_parse(const char *text, uint8_t *ret, size_t capacity)
{
	size_t n = 0;

	for (const char *p = text; *p != '\0';) {
		int high;
		int low;

		if (*p == ' ') {
			p++;
			continue;
		}
		high = hex_digit(p[0]);
		low = high < 0 ? -1 : hex_digit(p[1]);
		if (low < 0 || n >= capacity) {
			return -EINVAL;
		}
		ret[n++] = (uint8_t)(high << 4 | low);
		p += 2;
	}
	return n == 0 ? -EINVAL : (int)n;
}

static int finish_octets(const struct option_sdo *item, struct config *cfg, struct config_sdo *sdo,
			 char *reason)
{
	uint8_t octets[CONFIG_OPTIONS_BYTES];
	int len = (int)strlen(item->value);

	if (sdo->type == CONFIG_SDO_OCTETS) {
		len = octets_parse(item->value, octets, sizeof(octets));
	} else {
		memcpy(octets, item->value, (size_t)len);
	}
	if (len <= 0) {
		snprintf(reason, OPTION_WHY_BYTES,
			 len == 0 ? "is empty"
				  : "expected OCTETS in hexadecimal, such as 01 00 0a ff");
		return -EINVAL;
	}
	if (cfg->octet_count + (size_t)len > sizeof(cfg->octets)) {
		snprintf(reason, OPTION_WHY_BYTES,
			 "more than CONFIG_LIMIT_OCTETS = %d bytes of OCTETS and STRING",
			 CONFIG_LIMIT_OCTETS);
		return -ERANGE;
	}
	memcpy(cfg->octets + cfg->octet_count, octets, (size_t)len);
	sdo->octets = (uint32_t)cfg->octet_count;
	sdo->bytes = (uint16_t)len;
	cfg->octet_count += (size_t)len;
	return 0;
}

static int finish_number(const struct option_sdo *item, struct config_sdo *sdo, char *reason)
{
	enum sdo_type type = (enum sdo_type)item->type;
	int r = sdo_value_parse(type, item->value, &sdo->value);

	if (r == -ERANGE) {
		snprintf(reason, OPTION_WHY_BYTES, "%.40s does not fit into %s", item->value,
			 sdo_type_to_str(type));
	} else if (r < 0) {
		snprintf(reason, OPTION_WHY_BYTES, "\"%.40s\" is not a valid %s", item->value,
			 sdo_type_to_str(type));
	}
	sdo->bytes = (uint16_t)sdo_type_bytes(type);
	return r;
}

int option_sdo_finish(const struct option_sdo *item, struct config *cfg, struct config_sdo *ret_sdo,
		      const char **ret_key, char *reason)
{
	struct config_sdo sdo = *ret_sdo;
	int r;

	sdo.transition = item->transition;
	sdo.index = item->index;
	sdo.subindex = item->subindex;
	sdo.is_complete = item->is_complete != 0;
	sdo.type = (uint8_t)(item->type < SDO_TYPES ? item->type
						    : CONFIG_SDO_STRING + (item->type - SDO_TYPES));
	memcpy(sdo.comment, item->comment, sizeof(sdo.comment));
	*ret_key = "complete";
	if (sdo.is_complete && (sdo.subindex > 1 || sdo.type != CONFIG_SDO_OCTETS)) {
		snprintf(reason, OPTION_WHY_BYTES,
			 "requires subindex 0 or 1, and type OCTETS for the whole object");
		return -EINVAL;
	}
	*ret_key = "type";
	if (sdo.type == CONFIG_SDO_AUTO && sdo.transition == CONFIG_TRANSITION_OS) {
		snprintf(reason, OPTION_WHY_BYTES,
			 "is missing: OS leaves no time to ask the slave's object dictionary");
		return -EINVAL;
	}
	*ret_key = "value";
	r = item->type < SDO_TYPES ? finish_number(item, &sdo, reason)
				   : finish_octets(item, cfg, &sdo, reason);
	if (r == 0) {
		*ret_sdo = sdo;
	}
	return r;
}

/* --- for those who write them --- */

const uint8_t *config_sdo_data(const struct config *cfg, const struct config_sdo *sdo,
			       uint8_t buffer[8])
{
	if (sdo->type >= CONFIG_SDO_STRING) {
		return cfg->octets + sdo->octets;
	}
	put_le64(buffer, sdo->value);
	return buffer;
}

const char *config_transition_to_str(enum config_transition transition)
{
	static const char *const names[CONFIG_TRANSITIONS] = {
		[CONFIG_TRANSITION_IP] = "IP",
		[CONFIG_TRANSITION_PS] = "PS",
		[CONFIG_TRANSITION_SO] = "SO",
		[CONFIG_TRANSITION_OS] = "OS",
	};

	return transition < CONFIG_TRANSITIONS ? names[transition] : "?";
}
