/* SPDX-License-Identifier: MIT */
#include "cli/screen.h"

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
#include "base/stop.h"

static volatile sig_atomic_t is_over;
static volatile sig_atomic_t must_suspend; /* Ctrl-Z */
static volatile sig_atomic_t was_continued;
static struct termios before; /* of standard input, as it was at screen_begin() */
static int has_before;
static int has_keys;
static int is_taken;

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

static void on_signal(int number)
{
	switch (number) {
	case SIGTSTP:
		must_suspend = 1;
		break;
	case SIGCONT:
		was_continued = 1;
		break;
	default: /* SIGHUP: the terminal is gone */
		is_over = 1;
		break;
	}
}

/* If it fails, the signal has the effect that it always had. */
static void handle_signal(int number, void (*handler)(int number))
{
	/* Job control must not make a write to the terminal fail. */
	int is_job_control = number == SIGTSTP || number == SIGCONT;
	struct sigaction action = { .sa_handler = handler,
				    .sa_flags = is_job_control ? SA_RESTART : 0 };

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
		must_suspend = 0;
		was_continued = 0;
	}
}

/* The first @columns characters of @line; continuation bytes of UTF-8 take no column. */
static size_t cut(const char *line, size_t len, int columns)
{
	size_t i = 0;
	int used = 0;

	while (i < len) {
		int is_start = ((unsigned char)line[i] & 0xc0) != 0x80;

		if (is_start && used == columns) {
			break;
		}
		used += is_start;
		i++;
	}
	return i;
}

static int line_count(const char *text)
{
	int count = 1;

	for (; *text != '\0'; text++) {
		count += *text == '\n';
	}
	return count;
}

/* The first @rows lines of @text, from screen row @row on. The next row. */
static int draw_lines(const char *text, int row, int rows, int columns)
{
	for (; row < rows && *text != '\0'; row++) {
		size_t len = strcspn(text, "\n");

		if (row > 0) {
			fputs("\r\n", stdout);
		}
		fwrite(text, 1, cut(text, len, columns), stdout);
		fputs("\033[K", stdout);
		text += len + (text[len] == '\n');
	}
	return row;
}

void screen_draw(const char *text, const char *footer)
{
	struct screen_size size = screen_size();
	int footer_rows = line_count(footer);
	int row;

	attend_job_control();
	if (footer_rows > size.rows / 2) {
		footer_rows = 0; /* no room for it */
	}
	fputs("\033[H", stdout);
	row = draw_lines(text, 0, size.rows - footer_rows, size.columns);
	draw_lines(footer, row, row + footer_rows, size.columns);
	fputs("\033[J", stdout);
	fflush(stdout);
}

static int64_t now_ns(void)
{
	struct timespec ts;

	clock_gettime(CLOCK_MONOTONIC, &ts);
	return (int64_t)ts.tv_sec * NS_PER_S + ts.tv_nsec;
}

/* One key, or 0 if there is none. A standard input that has ended gives no more keys. */
static int take_key(void)
{
	unsigned char key = 0;
	ssize_t n = read(STDIN_FILENO, &key, 1);

	if (n == 1) {
		return key;
	}
	if (n == 0 || (errno != EINTR && errno != EAGAIN)) {
		has_keys = 0;
	}
	return 0;
}

int screen_wait(int64_t ns)
{
	static const int numbers[] = { SIGINT, SIGTERM, SIGHUP, SIGTSTP, SIGCONT };
	int64_t until_ns = now_ns() + ns;
	struct pollfd fd = { .fd = STDIN_FILENO, .events = POLLIN };
	sigset_t caught;
	sigset_t mask;
	int key = 0;

	/* Signals come in ppoll() only: none between a look at their flags and the wait. */
	sigemptyset(&caught);
	for (size_t i = 0; i < sizeof(numbers) / sizeof(numbers[0]); i++) {
		sigaddset(&caught, numbers[i]);
	}
	sigprocmask(SIG_BLOCK, &caught, &mask);
	while (!screen_is_over() && key == 0 && !must_suspend && !was_continued) {
		int64_t left_ns = until_ns - now_ns();
		struct timespec left = { .tv_sec = left_ns / NS_PER_S,
					 .tv_nsec = left_ns % NS_PER_S };

		if (left_ns <= 0) {
			break;
		}
		if (ppoll(&fd, has_keys ? 1 : 0, &left, &mask) > 0) {
			key = take_key();
		}
	}
	sigprocmask(SIG_SETMASK, &mask, NULL);
	attend_job_control();
	if (key == 'q' || key == 'Q' || key == 3) {
		is_over = 1;
	}
	return key;
}
