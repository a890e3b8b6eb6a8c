/* SPDX-License-Identifier: MIT */
#include "uplink/credentials.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static int is_blank(char c)
{
	return c == ' ' || c == '\t' || c == '\r';
}

/* Part of a line. */
struct span {
	const char *at;
	size_t len;
};

static struct span trim(struct span s)
{
	while (s.len > 0 && is_blank(s.at[0])) {
		s.at++;
		s.len--;
	}
	while (s.len > 0 && is_blank(s.at[s.len - 1])) {
		s.len--;
	}
	return s;
}

static int is_text(struct span s, const char *text)
{
	return s.len == strlen(text) && memcmp(s.at, text, s.len) == 0;
}

/* A value goes into headers: printable, or it is none. */
static int take_value(struct span value, char *buf, size_t bytes)
{
	if (value.len == 0 || value.len >= bytes) {
		return -EINVAL;
	}
	for (size_t i = 0; i < value.len; i++) {
		if (value.at[i] <= ' ' || value.at[i] > '~') {
			return -EINVAL;
		}
	}
	memcpy(buf, value.at, value.len);
	buf[value.len] = '\0';
	return 0;
}

static int take_line(struct span line, struct credentials *c)
{
	const char *equals = memchr(line.at, '=', line.len);
	struct span name;
	struct span value;

	if (equals == NULL) {
		return 0;
	}
	name = trim((struct span){ line.at, (size_t)(equals - line.at) });
	value = trim((struct span){ equals + 1, line.len - (size_t)(equals - line.at) - 1 });
	if (is_text(name, "aws_access_key_id")) {
		return take_value(value, c->id, sizeof(c->id));
	}
	if (is_text(name, "aws_secret_access_key")) {
		return take_value(value, c->secret, sizeof(c->secret));
	}
	if (is_text(name, "aws_session_token")) {
		return take_value(value, c->token, sizeof(c->token));
	}
	return 0;
}

/* [default], or the only one that there is before another one begins. */
static int counts(struct span line, const struct credentials *c)
{
	return is_text(line, "[default]") || (c->id[0] == '\0' && c->secret[0] == '\0');
}

int credentials_parse(const char *text, size_t len, struct credentials *ret, char *problem,
		      size_t problem_bytes)
{
	struct credentials c = { .id = "" };
	const char *end = text + len;
	int is_ours = 1;
	int r = 0;

	while (text < end && r == 0) {
		const char *newline = memchr(text, '\n', (size_t)(end - text));
		size_t line_len = newline != NULL ? (size_t)(newline - text) : (size_t)(end - text);
		struct span line = trim((struct span){ text, line_len });

		if (line.len > 0 && line.at[0] == '[') {
			is_ours = counts(line, &c);
			if (is_text(line, "[default]")) {
				c = (struct credentials){ .id = "" };
			}
		} else if (is_ours && line.len > 0 && line.at[0] != '#' && line.at[0] != ';') {
			r = take_line(line, &c);
		}
		text += line_len + (newline != NULL);
	}
	if (r < 0 || c.id[0] == '\0' || c.secret[0] == '\0') {
		snprintf(problem, problem_bytes,
			 r < 0 ? "a value is empty, too long or not printable"
			       : "expected lines aws_access_key_id = ... and "
				 "aws_secret_access_key = ...");
		return -EINVAL;
	}
	*ret = c;
	return 0;
}

int credentials_read(const char *path, struct credentials *ret, char *problem, size_t problem_bytes)
{
	char text[CREDENTIALS_BYTES];
	char why[128] = "";
	struct stat st = { .st_mode = 0 };
	int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
	ssize_t n = fd < 0 || fstat(fd, &st) < 0 ? -1 : read(fd, text, sizeof(text));
	int r = 0;

	if (n < 0) {
		snprintf(why, sizeof(why), "%s", strerror(errno));
		r = -EINVAL;
	} else if ((st.st_mode & S_IRWXO) != 0) {
		snprintf(why, sizeof(why), "others may read it: chmod 600");
		r = -EINVAL;
	} else {
		r = credentials_parse(text, (size_t)n, ret, why, sizeof(why));
	}
	if (fd >= 0) {
		close(fd);
	}
	explicit_bzero(text, sizeof(text));
	if (r < 0) {
		snprintf(problem, problem_bytes, "uplink.credentials: %.100s: %s", path, why);
	}
	return r;
}
