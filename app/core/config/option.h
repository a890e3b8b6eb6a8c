/* SPDX-License-Identifier: MIT */
/*
 * The one option table (options.c, with the rows in options_*.c): parser, --set, sample file and
 * reference page all come from it. Defaults and bounds are written as in the file ("1ms") and go
 * through the same parser as the file. Private to config/, to the generator of the pages and to
 * cli/schema.c. Context: blocking.
 */
#ifndef CONFIG_OPTION_H
#define CONFIG_OPTION_H

#include <stddef.h>
#include <stdint.h>

#include "base/config_change.h"
#include "config/config.h"

enum option_type {
	OPTION_DURATION, /* int64_t ns */
	OPTION_SIZE,     /* uint64_t bytes */
	OPTION_NUMBER,   /* double; unit "%" takes a per cent sign */
	OPTION_INT,      /* int32_t, in the option's unit */
	OPTION_UINT,     /* uint8_t to uint64_t, in the option's unit */
	OPTION_HEX,      /* the same, shown in hex */
	OPTION_SWITCH,   /* uint32_t: on, off */
	OPTION_WORD,     /* an enum: the n-th of words */
	OPTION_TEXT,     /* char[] */
	OPTION_NAME,     /* char[]: letters, digits, _ and - */
};

struct option {
	const char *name; /* "cycle.period"; in a list "slaves[].mode" */
	enum option_type type;
	size_t offset;             /* in struct config; in a list, in its item */
	size_t bytes;              /* of the field */
	const char *default_value; /* NULL: required (in lists only) */
	const char *min;           /* numbers: inclusive bounds; else NULL */
	const char *max;
	char unit[12]; /* of a plain number; "" for none */
	/* Of another value, while ecdaqd runs. CONFIG_EFFECT_NOW: of scalars that nothing but the
	 * service thread reads, and of outputs[] as far as outputs_rules_set() hands them to the
	 * cycle. */
	enum config_effect effect;
	const char *otherwise; /* when the default is another one, for the pages; mostly NULL */
	/* OPTION_WORD: "auto|spin|sleep", in the order of the enum. OPTION_HEX: words beside the
	 * numbers; the first one is 0 (below @min), the others are @max + 1, @max + 2 ... */
	const char *words;
	const char *prose;
};

/** Rows of the table. */
size_t option_count(void);
/** The row at @place, in the order of the file; NULL behind the last one. */
const struct option *option_at(size_t place);
/** The place of @option, a row of the table. */
size_t option_place(const struct option *option);

enum { OPTION_LIMIT = 160, OPTION_WHY_BYTES = CONFIG_WHY_BYTES, OPTION_KEY_BYTES = 96 };

/* A list of the file. Its items are filled by the options whose name starts with name and "[].". */
struct option_list {
	const char *name; /* "slaves", "slaves[].sdo" */
	size_t limit;
	const char *limit_name; /* as it is called in the sources */
	const char *prose;
	/* An item may be a line of text, too: its form, as a regular expression. NULL: no. */
	const char *line_pattern;
	int is_number_line; /* or a number, which YAML reads as such */
	const char *like;   /* another list whose options its items have; NULL: its own */
};

enum option_list_id {
	OPTION_LIST_SLAVES,
	OPTION_LIST_PDOS,
	OPTION_LIST_SDOS,
	OPTION_LIST_CHANNELS,
	OPTION_LIST_SLAVE_OUTPUTS,
	OPTION_LIST_OUTPUTS,
	OPTION_LISTS
};
extern const struct option_list option_lists[OPTION_LISTS];

/** What the options of @list's items start with: "slaves[].sdo[].". */
void option_list_prefix(const struct option_list *list, char ret_prefix[]);

/* Sections of the file in their order, for the pages: name and prose. */
struct option_section {
	const char *name;
	const char *prose;
};

extern const struct option_section option_sections[];
extern const size_t option_section_count;

/* An item of slaves[].sdo[] while it is parsed; becomes a struct config_sdo when it is whole. */
struct option_sdo {
	enum config_transition transition;
	uint16_t index;
	uint8_t subindex;
	uint32_t is_complete;
	uint32_t type; /* enum sdo_type, and those behind it: STRING, OCTETS, AUTO */
	char value[CONFIG_OPTIONS_BYTES];
	char comment[CONFIG_COMMENT_BYTES];
	int value_line;
};

/* An item of slaves[].pdos[] while it is parsed. */
struct option_pdo {
	char pdo[LIMIT_NAME_BYTES];
	char entries[CONFIG_OPTIONS_BYTES];
};

/** The option named @name; NULL. */
const struct option *option_find(const char *name);

/**
 * Read @text into @option's field of the struct at @base. 0; -EINVAL or -ERANGE with the reason in
 * @reason (OPTION_WHY_BYTES), field untouched.
 */
int option_parse(const struct option *option, const char *text, void *base, char *reason);

/** Put @value into @option's field, as wide as that is. */
void option_store(const struct option *option, uint64_t value, void *base);

/** Fill the fields at @base of all options named @prefix and something; "" for those of no list. */
void option_fill_defaults(const char *prefix, void *base);

/** The best guess at what was meant by @name: a name of the table, or NULL. */
const char *option_suggest(const char *name);

/** Is @name a section ("cycle"), or a list's item ("slaves[]")? */
int option_is_section(const char *name);

/** The list named @name, or -ENOENT. */
int option_list_find(const char *name);

/** Printable ASCII only, so that a message stays one line in one encoding; the rest becomes "?". */
void option_make_plain(char *text);

/* Where each option was set, by its place in the table; 0: not in the file. */
struct option_lines {
	int line[OPTION_LIMIT];
};

/* Receives options that do not fit each other: the option's name, the line to blame (0 if none is
 * known), the reason. Not 0: no more. */
struct option_faults {
	int (*add)(void *ctx, const char *key, int line, const char *reason);
	void *ctx;
};

/** Check the options against each other. 0, or -EINVAL after a fault was added. @lines may be
 * NULL. */
int option_cross_check(const struct config *cfg, const struct option_lines *lines,
		       const struct option_faults *faults);

/** Turn a whole item of slaves[].sdo[] into @ret_sdo, and its octets into @cfg. 0, or -EINVAL or
 * -ERANGE with @reason, and the option at fault in @ret_key ("value"). */
int option_sdo_finish(const struct option_sdo *item, struct config *cfg, struct config_sdo *ret_sdo,
		      const char **ret_key, char *reason);

/** Turn a whole item of slaves[].pdos[] into @ret_pdo, and its entries into @cfg; as above. */
int option_pdo_finish(const struct option_pdo *item, struct config *cfg, struct config_pdo *ret_pdo,
		      const char **ret_key, char *reason);

#endif
