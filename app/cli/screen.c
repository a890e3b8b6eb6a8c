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

static volatile sig_atomic_t is_over;
static struct termios before; /* of standard input, while keys are read one by one */
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
	(void)number;
	is_over = 1;
}

void screen_catch_signals(void)
{
	struct sigaction action = { .sa_handler = on_signal };
	static const int numbers[] = { SIGINT, SIGTERM, SIGHUP };

	sigemptyset(&action.sa_mask);
	for (size_t i = 0; i < sizeof(numbers) / sizeof(numbers[0]); i++) {
		if (sigaction(numbers[i], &action, NULL) < 0) {
			return; /* it then ends the program, as it always did */
		}
	}
}

int screen_is_over(void)
{
	return is_over != 0;
}

void screen_begin(void)
{
	struct termios raw;

	screen_catch_signals();
	if (isatty(STDIN_FILENO) && tcgetattr(STDIN_FILENO, &before) == 0) {
		raw = before;
		raw.c_lflag &= ~(tcflag_t)(ICANON | ECHO);
		raw.c_cc[VMIN] = 0;
		raw.c_cc[VTIME] = 0;
		has_keys = tcsetattr(STDIN_FILENO, TCSANOW, &raw) == 0;
	}
	if (!is_taken) {
		is_taken = 1;
		atexit(screen_end);
	}
	fputs("\033[?1049h\033[?25l\033[2J", stdout);
}

void screen_end(void)
{
	if (!is_taken) {
		return;
	}
	is_taken = 0;
	fputs("\033[?25h\033[?1049l", stdout);
	fflush(stdout);
	if (has_keys) {
		tcsetattr(STDIN_FILENO, TCSANOW, &before);
		has_keys = 0;
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

void screen_draw(const char *text)
{
	struct screen_size size = screen_size();

	fputs("\033[H", stdout);
	for (int row = 0; row < size.rows && *text != '\0'; row++) {
		size_t len = strcspn(text, "\n");

		if (row > 0) {
			fputs("\r\n", stdout);
		}
		fwrite(text, 1, cut(text, len, size.columns), stdout);
		fputs("\033[K", stdout);
		text += len + (text[len] == '\n');
	}
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
	int64_t until_ns = now_ns() + ns;
	struct pollfd fd = { .fd = STDIN_FILENO, .events = POLLIN };
	int key = 0;

	while (!is_over && key == 0) {
		int64_t left_ns = until_ns - now_ns();
		struct timespec left = { .tv_sec = left_ns / NS_PER_S,
					 .tv_nsec = left_ns % NS_PER_S };

		if (left_ns <= 0) {
			break;
		}
		if (ppoll(&fd, has_keys ? 1 : 0, &left, NULL) > 0) {
			key = take_key();
		}
	}
	if (key == 'q' || key == 'Q' || key == 3) {
		is_over = 1;
	}
	return key;
}
