/* SPDX-License-Identifier: MIT */
/*
 * The terminal: its size, colours, a screen that is drawn over and over, keys without Enter,
 * signals and job control. Plain ANSI sequences, no terminal library: it must work on the serial
 * console of the appliance. One per process. Context: main thread.
 */
#ifndef CLI_SCREEN_H
#define CLI_SCREEN_H

#include <stdint.h>

struct screen_size {
	int rows;
	int columns;
};

/** Is standard output a terminal? */
int screen_is_terminal(void);
/** Size of the terminal, or $LINES and $COLUMNS, or 24 by 80. */
struct screen_size screen_size(void);
/** The width that lines must fit: that of the terminal; 0: standard output is none, any width. */
int screen_columns(void);
/** Does the locale speak UTF-8? */
int screen_is_utf8(void);

enum screen_colour { SCREEN_PLAIN, SCREEN_GOOD, SCREEN_WARN, SCREEN_BAD, SCREEN_BOLD, SCREEN_DIM };

/**
 * The sequence that begins @colour, which SCREEN_PLAIN ends. "" where standard output is no
 * terminal, TERM is "dumb", or NO_COLOR is set and not empty (no-color.org).
 */
const char *screen_colour(enum screen_colour colour);

/* Keys that are no character. */
enum screen_key {
	SCREEN_KEY_NONE = 0,
	SCREEN_KEY_UP = 0x100,
	SCREEN_KEY_DOWN,
	SCREEN_KEY_LEFT,
	SCREEN_KEY_RIGHT,
	SCREEN_KEY_PAGE_UP,
	SCREEN_KEY_PAGE_DOWN,
	SCREEN_KEY_HOME,
	SCREEN_KEY_END,
	SCREEN_KEY_OTHER, /* a sequence that is none of these */
};

/* Which lines of a body are shown. */
struct screen_scroll {
	int first;   /* line on top, from 0 */
	int visible; /* lines that have room; screen_draw() sets it */
	int count;   /* lines of the body; screen_draw() sets it */
};

/* One picture: @head stays on top, @footer (not empty) at the bottom, @body is between. */
struct screen_frame {
	const char *head;
	const char *body;
	const char *footer;
	const char *keys;             /* what `?` shows besides the keys of every view; lines */
	struct screen_scroll *scroll; /* of @body; NULL: its first lines are shown */
};

/** SIGINT, SIGTERM and SIGHUP end screen_wait() and make screen_is_over() true, not the program. */
void screen_catch_signals(void);
int screen_is_over(void);

/**
 * Take the terminal over: another buffer, no cursor, keys one by one. Undone by screen_end(). In
 * between Ctrl-Z gives the terminal back before the process stops, and SIGCONT takes it again; both
 * in screen_wait() and screen_draw() only.
 */
void screen_begin(void);
void screen_end(void);
/**
 * Show @frame, or the keys after `?`, lines cut at the terminal's edge; what was there before is
 * cleared. A footer of more than half of the rows is left out, and head and body are cut.
 */
void screen_draw(const struct screen_frame *frame);

/**
 * Wait @ns or for a key: its character or enum screen_key, or 0. 'q', Ctrl-C and a caught signal
 * make screen_is_over() true and end the wait; SIGCONT, a new size (SIGWINCH) and `?` end it with
 * 0: redraw. Without screen_begin() no keys are read.
 */
int screen_wait(int64_t ns);

/** Move @scroll if @key is one that scrolls. 1: it was. */
int screen_scroll_key(struct screen_scroll *scroll, int key);

#endif
