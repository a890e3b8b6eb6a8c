/* SPDX-License-Identifier: MIT */
/*
 * The terminal: its size, a screen that is drawn over and over, keys without Enter, signals and job
 * control. Plain ANSI sequences, no terminal library: it must work on the serial console of the
 * appliance. One per process. Context: main thread.
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
/** Does the locale speak UTF-8? */
int screen_is_utf8(void);

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
 * Show @text, lines cut at the terminal's edge, and below it @footer (not empty), which a long
 * @text does not push out; what was there before is cleared.
 */
void screen_draw(const char *text, const char *footer);

/**
 * Wait @ns or for a key: its code, or 0. 'q', Ctrl-C and a caught signal make screen_is_over() true
 * and end the wait, and so does SIGCONT: redraw. Without screen_begin() no keys are read.
 */
int screen_wait(int64_t ns);

#endif
