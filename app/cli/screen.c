/* SPDX-License-Identifier: MIT */
#include "cli/screen.h"

#include <assert.h>
#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/host_clock.h"
#include "base/stop.h"
#include "cli/fit.h"

enum { KEY_BYTES = 16, ESCAPE_WAIT_MS = 50 };

static volatile sig_atomic_t is_over;
static volatile sig_atomic_t must_suspend; /* Ctrl-Z */
static volatile sig_atomic_t was_continued;
static volatile sig_atomic_t was_resized;
static struct termios before; /* of standard input, as it was at screen_begin() */
static int has_before;
static int has_keys;
static int is_taken;
static int is_help;                    /* the keys are shown in place of the view */
static unsigned char typed[KEY_BYTES]; /* read, and not yet a key */
static size_t typed_len;

int screen_is_terminal(void)
{
	return isatty(STDOUT_FILENO);
}

static int number_of(const char *name, int otherwise)
{
	const char *text = getenv(name);
	long value = text == NULL ? 0 : strtol(text, NULL, 10);

	return value > 0 && value < 10000 ? (int)value : otherwise;
}

struct screen_size screen_size(void)
{
	struct winsize ws;

	if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &ws) == 0 && ws.ws_row > 0 && ws.ws_col > 0) {
		return (struct screen_size){ .rows = ws.ws_row, .columns = ws.ws_col };
	}
	return (struct screen_size){ .rows = number_of("LINES", 24),
				     .columns = number_of("COLUMNS", 80) };
}

int screen_is_utf8(void)
{
	static const char *const names[] = { "LC_ALL", "LC_CTYPE", "LANG" };

	for (size_t i = 0; i < sizeof(names) / sizeof(names[0]); i++) {
		const char *value = getenv(names[i]);

		if (value != NULL && value[0] != '\0') {
			return strcasestr(value, "utf-8") != NULL ||
			       strcasestr(value, "utf8") != NULL;
		}
	}
	return 0;
}

int screen_columns(void)
{
	return screen_is_terminal() ? screen_size().columns : 0;
}

const char *screen_colour(enum screen_colour colour)
{
	static const char *const sequences[] = {
		[SCREEN_PLAIN] = "\033[0m",  [SCREEN_GOOD] = "\033[32m", [SCREEN_WARN] = "\033[33m",
		[SCREEN_BAD] = "\033[1;31m", [SCREEN_BOLD] = "\033[1m",  [SCREEN_DIM] = "\033[2m",
	};
	static int has_colour = -1;

	if (has_colour < 0) {
		const char *no_color = getenv("NO_COLOR");
		const char *term = getenv("TERM");

		has_colour = screen_is_terminal() && (no_color == NULL || no_color[0] == '\0') &&
			     (term == NULL || strcmp(term, "dumb") != 0);
	}
	return has_colour ? sequences[colour] : "";
}

static void on_signal(int number)
{
	switch (number) {
	case SIGTSTP:
		must_suspend = 1;
		break;
	case SIGCONT:
		was_continued = 1;
		break;
	case SIGWINCH:
		was_resized = 1;
		break;
	default: /* SIGHUP: the terminal is gone */
		is_over = 1;
		break;
	}
}

/* If it fails, the signal has the effect that it always had. */
static void handle_signal(int number, void (*handler)(int number))
{
	/* Job control and a new size must not make a write to the terminal fail. */
	int is_of_terminal = number == SIGTSTP || number == SIGCONT || number == SIGWINCH;
	struct sigaction action = { .sa_handler = handler,
				    .sa_flags = is_of_terminal ? SA_RESTART : 0 };

	sigemptyset(&action.sa_mask);
	sigaction(number, &action, NULL);
}

void screen_catch_signals(void)
{
	stop_catch(STOP_REPEAT_IGNORED, NULL);
	handle_signal(SIGHUP, on_signal);
}

int screen_is_over(void)
{
	return is_over != 0 || stop_requested();
}

static void take_terminal(void)
{
	struct termios keys = before;

	if (has_before) {
		keys.c_lflag &= ~(tcflag_t)(ICANON | ECHO);
		keys.c_cc[VMIN] = 0;
		keys.c_cc[VTIME] = 0;
		/* In the background SIGTTOU stops this process here, until it is in the foreground.
		 */
		has_keys = tcsetattr(STDIN_FILENO, TCSANOW, &keys) == 0;
	}
	fputs("\033[?1049h\033[?25l\033[2J", stdout);
	is_taken = 1;
}

static void give_terminal_back(void)
{
	sigset_t ttou;
	sigset_t mask;

	is_taken = 0;
	fputs("\033[?25h\033[?1049l", stdout);
	fflush(stdout);
	if (has_before) {
		/* In the background, too: an end must not wait for the foreground. */
		sigemptyset(&ttou);
		sigaddset(&ttou, SIGTTOU);
		sigprocmask(SIG_BLOCK, &ttou, &mask);
		tcsetattr(STDIN_FILENO, TCSANOW, &before);
		sigprocmask(SIG_SETMASK, &mask, NULL);
		has_keys = 0;
	}
}

/* Ctrl-Z: stop, with the terminal restored for the shell; SIGCONT resumes. */
static void suspend(void)
{
	give_terminal_back();
	handle_signal(SIGTSTP, SIG_DFL);
	raise(SIGTSTP); /* here it stops */
	handle_signal(SIGTSTP, on_signal);
	must_suspend = 0;
	was_continued = 0;
	take_terminal();
}

/* Job control of the shell. Not with signals blocked: taking the terminal may wait for them. */
static void attend_job_control(void)
{
	if (is_taken && must_suspend) {
		suspend();
	} else if (is_taken && was_continued) {
		/* Stopped by SIGSTOP or SIGTTIN: the shell has changed the terminal meanwhile. */
		was_continued = 0;
		take_terminal();
	}
}

void screen_begin(void)
{
	struct sigaction stop;

	screen_catch_signals();
	/* A shell without job control has it ignored. */
	if (sigaction(SIGTSTP, NULL, &stop) == 0 && stop.sa_handler != SIG_IGN) {
		handle_signal(SIGTSTP, on_signal);
	}
	handle_signal(SIGCONT, on_signal);
	handle_signal(SIGWINCH, on_signal);
	has_before = isatty(STDIN_FILENO) && tcgetattr(STDIN_FILENO, &before) == 0;
	atexit(screen_end);
	take_terminal();
}

void screen_end(void)
{
	if (is_taken) {
		give_terminal_back();
		handle_signal(SIGTSTP, SIG_DFL);
		handle_signal(SIGCONT, SIG_DFL);
		handle_signal(SIGWINCH, SIG_DFL);
		must_suspend = 0;
		was_continued = 0;
	}
}

/* The first lines of @text from line @first on, to row @rows; the next row. */
static int draw_lines(const char *text, int first, int row, int rows)
{
	int columns = screen_size().columns;

	for (; first > 0 && *text != '\0'; first--) {
		size_t len = strcspn(text, "\n");

		text += len + (text[len] == '\n');
	}
	for (; row < rows && *text != '\0'; row++) {
		size_t len = strcspn(text, "\n");
		size_t fits = fit_cut(text, len, columns);

		if (row > 0) {
			fputs("\r\n", stdout);
		}
		fwrite(text, 1, fits, stdout);
		/* The colour of what was cut off does not go on. */
		fputs(fits < len ? screen_colour(SCREEN_PLAIN) : "", stdout);
		fputs("\033[K", stdout);
		text += len + (text[len] == '\n');
	}
	return row;
}

/* Lines of @text; a newline at its end begins none. */
static int line_count(const char *text)
{
	int count = 0;

	while (*text != '\0') {
		size_t len = strcspn(text, "\n");

		text += len + (text[len] == '\n');
		count++;
	}
	return count;
}

static void keep_in_range(struct screen_scroll *scroll, int count, int visible)
{
	scroll->count = count;
	scroll->visible = visible < 0 ? 0 : visible;
	if (scroll->first > count - scroll->visible) {
		scroll->first = count - scroll->visible;
	}
	scroll->first = scroll->first < 0 ? 0 : scroll->first;
}

static int draw_view(const struct screen_frame *frame, int rows)
{
	int row = draw_lines(frame->head, 0, 0, rows);
	int first = 0;

	if (frame->scroll != NULL) {
		keep_in_range(frame->scroll, line_count(frame->body), rows - row);
		first = frame->scroll->first;
	}
	return draw_lines(frame->body, first, row, rows);
}

static int draw_help(const struct screen_frame *frame, int rows)
{
	int row = draw_lines("keys\n"
			     "  q, Ctrl-C        leave\n"
			     "  Ctrl-Z           suspend (fg resumes)\n"
			     "  ?                these keys, and back\n",
			     0, 0, rows);

	if (frame->scroll != NULL) {
		row = draw_lines("  up, k, down, j   a line up, down\n"
				 "  PgUp, b, PgDn, f a page up, down\n"
				 "  Home, g, End, G  first, last line\n",
				 0, row, rows);
	}
	return draw_lines(frame->keys, 0, row, rows);
}

void screen_draw(const struct screen_frame *frame)
{
	int rows = screen_size().rows;
	int footer_rows = line_count(frame->footer);
	int row;

	attend_job_control();
	if (footer_rows > rows / 2) {
		footer_rows = 0; /* no room for it */
	}
	fputs("\033[H", stdout);
	row = is_help ? draw_help(frame, rows - footer_rows) : draw_view(frame, rows - footer_rows);
	draw_lines(frame->footer, 0, row, row + footer_rows);
	fputs("\033[J", stdout);
	fflush(stdout);
}

int screen_scroll_key(struct screen_scroll *scroll, int key)
{
	int page = scroll->visible > 1 ? scroll->visible - 1 : 1;

	switch (key) {
	case SCREEN_KEY_UP:
	case 'k':
		scroll->first--;
		break;
	case SCREEN_KEY_DOWN:
	case 'j':
		scroll->first++;
		break;
	case SCREEN_KEY_PAGE_UP:
	case 'b':
		scroll->first -= page;
		break;
	case SCREEN_KEY_PAGE_DOWN:
	case 'f':
		scroll->first += page;
		break;
	case SCREEN_KEY_HOME:
	case 'g':
		scroll->first = 0;
		break;
	case SCREEN_KEY_END:
	case 'G':
		scroll->first = scroll->count;
		break;
	default:
		return 0;
	}
	keep_in_range(scroll, scroll->count, scroll->visible);
	return 1;
}

/* Read what was typed. A standard input that has ended gives no more keys. */
static void read_typed(void)
{
	ssize_t n = read(STDIN_FILENO, typed + typed_len, sizeof(typed) - typed_len);

	if (n > 0) {
		typed_len += (size_t)n;
	} else if (n == 0 || (errno != EINTR && errno != EAGAIN)) {
		has_keys = 0;
	}
}

static int take_bytes(size_t len, int key)
{
	assert(len <= typed_len);
	typed_len -= len;
	memmove(typed, typed + len, typed_len);
	return key;
}

/* What the sequence "ESC [ n x" or "ESC O x" of @len bytes means. */
static int key_of_sequence(size_t len)
{
	static const struct {
		const char *text; /* behind ESC and [ or O */
		int key;
	} known[] = {
		{ "A", SCREEN_KEY_UP },       { "B", SCREEN_KEY_DOWN },
		{ "C", SCREEN_KEY_RIGHT },    { "D", SCREEN_KEY_LEFT },
		{ "H", SCREEN_KEY_HOME },     { "F", SCREEN_KEY_END },
		{ "5~", SCREEN_KEY_PAGE_UP }, { "1~", SCREEN_KEY_HOME },
		{ "4~", SCREEN_KEY_END },     { "6~", SCREEN_KEY_PAGE_DOWN },
	};

	for (size_t i = 0; i < sizeof(known) / sizeof(known[0]); i++) {
		if (strlen(known[i].text) == len - 2 &&
		    memcmp(typed + 2, known[i].text, len - 2) == 0) {
			return known[i].key;
		}
	}
	return SCREEN_KEY_OTHER;
}

/* One key of what was typed, or 0: nothing, or a sequence whose end is not there yet. */
static int take_key(void)
{
	size_t len = 2;

	if (typed_len == 0 || typed[0] != '\033') {
		return typed_len == 0 ? SCREEN_KEY_NONE : take_bytes(1, typed[0]);
	}
	if (typed_len < 2) {
		return SCREEN_KEY_NONE;
	}
	if (typed[1] != '[' && typed[1] != 'O') {
		return take_bytes(1, SCREEN_KEY_OTHER);
	}
	while (len < typed_len && (typed[len] < 0x40 || typed[len] > 0x7e)) {
		len++;
	}
	if (len == sizeof(typed)) {
		return take_bytes(len, SCREEN_KEY_OTHER);
	}
	return len < typed_len ? take_bytes(len + 1, key_of_sequence(len + 1)) : SCREEN_KEY_NONE;
}

/* Keys that belong to every view. What is left of @key for this one. */
static int attend_key(int key)
{
	if (key == 'q' || key == 'Q' || key == 3) {
		is_over = 1;
	} else if (key != SCREEN_KEY_NONE && (key == '?' || is_help)) {
		is_help = !is_help;
		return SCREEN_KEY_NONE;
	}
	return key;
}

/* A key, or 0 by a signal or at @until_ns; @mask while waiting. */
static int wait_for_key(int64_t until_ns, const sigset_t *mask)
{
	struct pollfd fd = { .fd = STDIN_FILENO, .events = POLLIN };

	for (;;) {
		int64_t left_ns = until_ns - host_clock_ns(CLOCK_MONOTONIC);
		/* A single Escape is a key once nothing follows. */
		int64_t wait_ns = typed_len > 0 && left_ns > ESCAPE_WAIT_MS * NS_PER_MS
					  ? ESCAPE_WAIT_MS * NS_PER_MS
					  : left_ns;
		struct timespec left = { .tv_sec = wait_ns / NS_PER_S,
					 .tv_nsec = wait_ns % NS_PER_S };
		int key = take_key();
		int r;

		if (screen_is_over() || key != SCREEN_KEY_NONE || must_suspend || was_continued ||
		    was_resized || left_ns <= 0) {
			return key;
		}
		r = ppoll(&fd, has_keys ? 1 : 0, &left, mask);
		if (r > 0) {
			read_typed();
		} else if (r == 0 && typed_len > 0) {
			typed_len = 0;
			return SCREEN_KEY_OTHER;
		}
	}
}

int screen_wait(int64_t ns)
{
	static const int numbers[] = { SIGINT, SIGTERM, SIGHUP, SIGTSTP, SIGCONT, SIGWINCH };
	int64_t until_ns = host_clock_ns(CLOCK_MONOTONIC) + ns;
	sigset_t caught;
	sigset_t mask;
	int key;

	/* Signals come in ppoll() only: none between a look at their flags and the wait. */
	sigemptyset(&caught);
	for (size_t i = 0; i < sizeof(numbers) / sizeof(numbers[0]); i++) {
		sigaddset(&caught, numbers[i]);
	}
	sigprocmask(SIG_BLOCK, &caught, &mask);
	key = wait_for_key(until_ns, &mask);
	sigprocmask(SIG_SETMASK, &mask, NULL);
	was_resized = 0;
	attend_job_control();
	return attend_key(key);
}
