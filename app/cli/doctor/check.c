/* SPDX-License-Identifier: MIT */
#include "cli/doctor/check.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/cpu_list.h"

enum { TEXT_BYTES = 2 * FINDING_TEXT_BYTES, SHOWN_MAX = 100 };

/* "value" or "value" REMEDY "remedy". */
static void finding_split(struct finding *f, enum finding_level level, const char *text)
{
	size_t len = strcspn(text, REMEDY);

	f->level = level;
	snprintf(f->value, sizeof(f->value), "%.*s", (int)len, text);
	snprintf(f->remedy, sizeof(f->remedy), "%.*s", FINDING_TEXT_BYTES - 1,
		 text[len] == '\0' ? "" : text + len + 1);
}

void finding_set(struct finding *f, enum finding_level level, const char *format, ...)
{
	char text[TEXT_BYTES];
	va_list args;

	va_start(args, format);
	vsnprintf(text, sizeof(text), format, args);
	va_end(args);
	finding_split(f, level, text);
}

void finding_unread(struct finding *f, const char *what, int err)
{
	switch (-err) {
	case EACCES:
	case EPERM:
		f->needs_root = 1;
		finding_set(f, FINDING_SKIP,
			    "%s: permission denied" REMEDY "run ecdaq doctor as root", what);
		return;
	case ENOENT:
	case ENOTDIR:
		finding_set(f, FINDING_SKIP, "%s: not found", what);
		return;
	case EPROTO:
		finding_set(f, FINDING_SKIP, "%s: written by another version of ecdaq", what);
		return;
	case EBADMSG:
		finding_set(f, FINDING_SKIP, "%s: unexpected content", what);
		return;
	default:
		finding_set(f, FINDING_SKIP, "%s: %s", what, strerror(-err));
		return;
	}
}

const char *finding_level_to_str(enum finding_level level)
{
	static const char *const names[FINDING_LEVELS] = { "OK", "WARN", "FAIL", "SKIP" };

	return names[level];
}

static int has_page(const struct target *t, struct finding *f)
{
	if (t->page == NULL && t->page_err < 0) {
		finding_unread(f, "ecdaqd's status page", t->page_err);
	} else if (t->page == NULL) {
		finding_set(f, FINDING_SKIP,
			    "ecdaqd is not running" REMEDY "start ecdaqd and repeat");
	}
	return t->page != NULL;
}

static int has_nic(const struct target *t, struct finding *f)
{
	if (t->nic[0] == '\0') {
		finding_set(f, FINDING_SKIP, "no port is configured");
	} else if (t->is_nic_elsewhere) {
		finding_set(f, FINDING_SKIP, "%s is in a network namespace of ecdaqd's own",
			    t->nic);
	} else if (!probe_exists(&t->probe, "/sys/class/net/%s", t->nic)) {
		finding_set(f, FINDING_SKIP, "%s: no such port", t->nic);
	} else {
		return 1;
	}
	return 0;
}

int target_has(const struct target *t, unsigned needs, struct finding *f)
{
	if ((needs & NEEDS_CORE) != 0 && t->cpu < 0) {
		finding_set(f, FINDING_SKIP, "the cycle has no core of its own (cycle.cpu)");
		return 0;
	}
	if ((needs & NEEDS_RECORDING) != 0 && !t->cfg->record_enable) {
		finding_set(f, FINDING_SKIP, "recording is off (record.enable)");
		return 0;
	}
	return ((needs & NEEDS_NIC) == 0 || has_nic(t, f)) &&
	       ((needs & NEEDS_PAGE) == 0 || has_page(t, f));
}

/* --- rules --- */

/* The value of {@word}; "?" for a file that cannot be read. */
static const char *word_value(const struct target *t, const char *word, const char *row,
			      char buf[PROBE_TEXT_BYTES])
{
	if (strcmp(word, "core") == 0) {
		snprintf(buf, PROBE_TEXT_BYTES, "%d", t->cpu < 0 ? 0 : t->cpu);
		return buf;
	}
	if (strcmp(word, "nic") == 0) {
		return t->nic;
	}
	if (strcmp(word, "dir") == 0) {
		return t->cfg->record_dir;
	}
	if (strcmp(word, "text") == 0) {
		return row;
	}
	return probe_text(&t->probe, buf, "%s", word) < 0 ? "?" : buf;
}

static void expand(const struct target *t, const char *template, const char *row,
		   char text[TEXT_BYTES])
{
	char word[PROBE_PATH_BYTES];
	char buf[PROBE_TEXT_BYTES];
	size_t used = 0;

	text[0] = '\0';
	while (*template != '\0' && used < TEXT_BYTES) {
		size_t len = strcspn(template, "{");

		used += (size_t)snprintf(text + used, TEXT_BYTES - used, "%.*s", (int)len,
					 template);
		template += len;
		if (*template == '{' && used < TEXT_BYTES) {
			len = strcspn(++template, "}");
			snprintf(word, sizeof(word), "%.*s", (int)len, template);
			used += (size_t)snprintf(text + used, TEXT_BYTES - used, "%.*s", SHOWN_MAX,
						 word_value(t, word, row, buf));
			template += len + (template[len] == '}');
		}
	}
}

/* The text of a file, or the figure of a call. */
static int read_fact(const struct target *t, const char *fact, char text[PROBE_TEXT_BYTES])
{
	char path[TEXT_BYTES];
	int64_t value;
	char *key;
	int r;

	expand(t, fact, "", path);
	key = strchr(path, ' ');
	if (key == NULL) {
		return probe_text(&t->probe, text, "%s", path);
	}
	*key++ = '\0';
	r = probe_call(&t->probe, path, strcmp(path, "disk") == 0 ? t->cfg->record_dir : t->nic,
		       text);
	if (r >= 0) {
		r = probe_figure(text, key, &value);
	}
	if (r >= 0) {
		r = snprintf(text, PROBE_TEXT_BYTES, "%lld", (long long)value);
	}
	return r;
}

/* 1 if @text is at least @operand, 0 if not, -EBADMSG if one is no number. */
static int is_at_least(const struct target *t, const char *text, const char *operand)
{
	char other[PROBE_TEXT_BYTES];
	int64_t value;
	int64_t least;

	if (operand[0] == '/') {
		if (read_fact(t, operand, other) < 0) {
			return 0;
		}
		operand = other;
	}
	if (probe_parse(text, &value) < 0 || probe_parse(operand, &least) < 0) {
		return -EBADMSG;
	}
	return value >= least;
}

static int has_word(const char *words, const char *word)
{
	size_t len = strlen(word);

	for (const char *at = words; len > 0 && (at = strstr(at, word)) != NULL; at += len) {
		if ((at == words || at[-1] == ' ') && (at[len] == ' ' || at[len] == '\0')) {
			return 1;
		}
	}
	return 0;
}

/* @r: length of the text, or why it could not be read. 1, 0, or -errno if that decides. */
static int holds(const struct check_rule *rule, const struct target *t, const char *text, int r)
{
	char operand[TEXT_BYTES];

	if (r < 0 && rule->compare != IF_ABSENT && rule->compare != IF_UNSUPPORTED) {
		return r;
	}
	switch (rule->compare) {
	case IF_ABSENT:
		return r == -ENOENT;
	case IF_UNSUPPORTED:
		return r == -EOPNOTSUPP;
	case IF_HAS:
		return strstr(text, rule->operand) != NULL;
	case IF_IN:
		expand(t, rule->operand, "", operand);
		return has_word(operand, text);
	case IF_AT_LEAST:
		return is_at_least(t, text, rule->operand);
	case IF_LISTS_CORE:
		return cpu_list_has(text, t->cpu);
	case ALWAYS:
		break;
	}
	return 1;
}

static void judge_rules(const struct check *check, const struct target *t, struct finding *f)
{
	char row[PROBE_TEXT_BYTES] = "";
	int row_r = check->fact == NULL ? 0 : read_fact(t, check->fact, row);
	char text[TEXT_BYTES];

	for (size_t i = 0; i < CHECK_RULES && check->rules[i].text != NULL; i++) {
		const struct check_rule *rule = &check->rules[i];
		char other[PROBE_TEXT_BYTES];
		int r;

		if (rule->fact == NULL) {
			r = holds(rule, t, row, row_r);
		} else {
			r = row_r < 0 ? 0 : read_fact(t, rule->fact, other);
			r = r > 0 ? holds(rule, t, other, r) > 0 : 0;
		}
		if (r < 0) {
			expand(t, check->fact, "", text);
			finding_unread(f, text, r);
			return;
		}
		if (r > 0) {
			expand(t, rule->text, row, text);
			finding_split(f, rule->level, text);
			return;
		}
	}
}

void check_run(const struct check *check, const struct target *t, struct finding *f)
{
	if (!target_has(t, check->needs, f)) {
		return;
	}
	if (check->judge != NULL) {
		check->judge(t, f);
	} else {
		judge_rules(check, t, f);
	}
}
