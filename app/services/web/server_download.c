/* SPDX-License-Identifier: MIT */
/* Recordings: the bytes of a file, or a part of them, and tables that ecdaq-log makes of them.
 * Figures, as ecdaq makes them. */
#include <errno.h>
#include <inttypes.h>
#include <limits.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "record/store.h"
#include "web/range.h"
#include "web/recordings.h"
#include "web/server_private.h"
#include "web/window.h"

enum {
	CHUNK_BYTES = 64 * 1024,
	CHUNK_HEAD_BYTES = 16, /* its length, as HTTP/1.1 writes it */
	HEAD_BYTES = 2048,
	HEADER_BYTES = 160,
	STALLED_SECONDS = 30, /* a client that takes nothing for so long is ended */
	POLL_US = 5000,       /* while the table is being made */
	REPORT_WORDS = 3,
	MAX_WORDS = 5 + REPORT_WORDS + 1,
	NUMBER_BYTES = 24,
};

static const char csv_suffix[] = ".csv";
static const char window_path[] = "/window.mcap";
static char log_program[] = "ecdaq-log";

struct download {
	lws_sorted_usec_list_t timer; /* first: it is all that its callback has */
	struct lws *wsi;
	struct server *server;
	int fd; /* -1: there is only a head */
	struct range rest;
	struct exports *exports; /* its process is one of these */
	int export;              /* number of the process; -1: the bytes of a file */
	const char *type;        /* of what the process prints */
	const char *suffix;      /* of the name, for that */
	int failed_status;       /* where the process fails before it printed anything */
	int good_exit;
	int has_head;
	size_t filled;               /* bytes of the table in data */
	char name[STORE_NAME_BYTES]; /* "": it is not to be kept as a file */
	uint8_t buf[LWS_PRE + CHUNK_HEAD_BYTES + CHUNK_BYTES + 2];
};

static int put_header(struct lws *wsi, const char *name, const char *value, uint8_t **p,
		      uint8_t *end)
{
	return lws_add_http_header_by_name(wsi, (const uint8_t *)name, (const uint8_t *)value,
					   (int)strlen(value), p, end);
}

/* What both kinds have in their head. */
static int put_common(const struct download *d, const char *type, const char *suffix, uint8_t **p,
		      uint8_t *end)
{
	char text[HEADER_BYTES];

	snprintf(text, sizeof(text), "attachment; filename=\"%s%s\"", d->name, suffix);
	return put_header(d->wsi, "content-type:", type, p, end) != 0 ||
			       (d->name[0] != '\0' &&
				put_header(d->wsi, "content-disposition:", text, p, end) != 0) ||
			       server_put_headers(d->wsi, p, end) != 0
		       ? -1
		       : 0;
}

static void etag_of(int fd, char ret[HEADER_BYTES])
{
	struct stat st;

	if (fstat(fd, &st) < 0) {
		st = (struct stat){ .st_size = 0 };
	}
	snprintf(ret, HEADER_BYTES, "\"%" PRIx64 "-%" PRIx64 ".%lx\"", (uint64_t)st.st_size,
		 (uint64_t)st.st_mtim.tv_sec, (unsigned long)st.st_mtim.tv_nsec);
}

/* The part that was asked for; a part of a file that has changed since is all of it. */
static int choose_range(struct lws *wsi, const char *etag, uint64_t bytes, struct range *ret)
{
	char asked[HEADER_BYTES];
	char if_range[HEADER_BYTES];

	*ret = (struct range){ 0, bytes };
	if (lws_hdr_copy(wsi, asked, sizeof(asked), WSI_TOKEN_HTTP_RANGE) <= 0 ||
	    (lws_hdr_copy(wsi, if_range, sizeof(if_range), WSI_TOKEN_HTTP_IF_RANGE) > 0 &&
	     strcmp(if_range, etag) != 0)) {
		return 0;
	}
	return range_parse(asked, bytes, ret);
}

static int put_file_head(struct download *d, uint64_t bytes)
{
	uint8_t buf[LWS_PRE + HEAD_BYTES];
	uint8_t *start = buf + LWS_PRE;
	uint8_t *p = start;
	uint8_t *end = buf + sizeof(buf) - 1;
	char etag[HEADER_BYTES];
	char text[HEADER_BYTES] = "";
	unsigned status = HTTP_STATUS_OK;
	int r;

	etag_of(d->fd, etag);
	r = choose_range(d->wsi, etag, bytes, &d->rest);
	if (r < 0) {
		status = HTTP_STATUS_REQ_RANGE_NOT_SATISFIABLE;
		d->rest = (struct range){ 0, 0 };
		snprintf(text, sizeof(text), "bytes */%" PRIu64, bytes);
	} else if (r > 0) {
		status = HTTP_STATUS_PARTIAL_CONTENT;
		snprintf(text, sizeof(text), "bytes %" PRIu64 "-%" PRIu64 "/%" PRIu64,
			 d->rest.first, d->rest.end - 1, bytes);
	}
	if (lws_add_http_header_status(d->wsi, status, &p, end) != 0 ||
	    lws_add_http_header_content_length(d->wsi, d->rest.end - d->rest.first, &p, end) != 0 ||
	    (text[0] != '\0' && put_header(d->wsi, "content-range:", text, &p, end) != 0) ||
	    put_header(d->wsi, "accept-ranges:", "bytes", &p, end) != 0 ||
	    put_header(d->wsi, "etag:", etag, &p, end) != 0 ||
	    put_common(d, "application/octet-stream", "", &p, end) != 0) {
		return -1;
	}
	return lws_finalize_write_http_header(d->wsi, start, &p, end) != 0 ? -1 : 0;
}

static int put_table_head(struct download *d)
{
	uint8_t buf[LWS_PRE + HEAD_BYTES];
	uint8_t *start = buf + LWS_PRE;
	uint8_t *p = start;
	uint8_t *end = buf + sizeof(buf) - 1;

	d->has_head = 1;
	if (lws_add_http_header_status(d->wsi, HTTP_STATUS_OK, &p, end) != 0 ||
	    put_header(d->wsi, "transfer-encoding:", "chunked", &p, end) != 0 ||
	    put_common(d, d->type, d->suffix, &p, end) != 0) {
		return -1;
	}
	return lws_finalize_write_http_header(d->wsi, start, &p, end) != 0 ? -1 : 0;
}

/* What a program of ours prints; only its head if that is all that is asked for. */
static int begin_process(struct download *d, struct exports *exports, char *const words[])
{
	int r;

	if (lws_hdr_total_length(d->wsi, WSI_TOKEN_HEAD_URI) > 0) {
		return put_table_head(d) < 0 ? -EIO : 0;
	}
	r = exports_start(exports, words, EXPORTS_ERRORS_TO_LOG, &d->fd);
	if (r < 0) {
		return r;
	}
	d->exports = exports;
	d->export = r;
	return 0;
}

/* The recording that STEM.csv is made of, finished or not, in d->name without its suffix. */
static int begin_table(struct download *d, const char *stem, int stem_len)
{
	static const char *const suffixes[] = { ".mcap", ".part" };
	static char verb[] = "export";
	const char *dir = d->server->cfg->record_dir;
	char name[STORE_NAME_BYTES + 8];
	char path[PATH_MAX];
	char *words[] = { log_program, verb, path, NULL };
	uint64_t bytes;
	int fd = -ENOENT;
	int r;

	for (size_t i = 0; i < 2 && fd == -ENOENT && stem_len < STORE_NAME_BYTES; i++) {
		snprintf(name, sizeof(name), "%.*s%s", stem_len, stem, suffixes[i]);
		fd = recordings_open(dir, name, &bytes);
	}
	if (fd < 0) {
		return fd;
	}
	/* The other process opens it by its name: it was a regular file just now. */
	close(fd);
	snprintf(d->name, sizeof(d->name), "%.*s", stem_len, stem);
	d->type = "text/csv; charset=utf-8";
	d->suffix = csv_suffix;
	r = store_path(dir, name, path, sizeof(path));
	return r < 0 ? r : begin_process(d, &d->server->exports, words);
}

/* The query of the request as it came, in which the library has cut out each "&". 0 or -EINVAL. */
static int get_query(struct lws *wsi, char query[WINDOW_QUERY_BYTES])
{
	int len = 0;
	int part;

	query[0] = '\0';
	for (int i = 0; (part = lws_hdr_fragment_length(wsi, WSI_TOKEN_HTTP_URI_ARGS, i)) > 0;
	     i++) {
		if (part > WINDOW_QUERY_BYTES - len - 2) { /* with "&" before it and its end */
			return -EINVAL;
		}
		if (i > 0) {
			query[len++] = '&';
		}
		if (lws_hdr_copy_fragment(wsi, query + len, WINDOW_QUERY_BYTES - len,
					  WSI_TOKEN_HTTP_URI_ARGS, i) != part ||
		    strlen(query + len) != (size_t)part) {
			return -EINVAL;
		}
		len += part;
	}
	return 0;
}

/* The cycles of a session that its query names, as a recording. */
static int begin_window(struct download *d)
{
	static char verb[] = "cut";
	static char option[][12] = { "--dir", "--session", "--from", "--to" };
	char query[WINDOW_QUERY_BYTES];
	char number[3][NUMBER_BYTES];
	char dir[PATH_MAX];
	char *words[] = { log_program, verb,      option[0], dir,       option[1], number[0],
			  option[2],   number[1], option[3], number[2], NULL };
	struct window w;

	if (get_query(d->wsi, query) < 0 || window_parse(query, &w) < 0) {
		return -EINVAL;
	}
	if (snprintf(dir, sizeof(dir), "%s", d->server->cfg->record_dir) >= (int)sizeof(dir)) {
		return -ENAMETOOLONG;
	}
	snprintf(number[0], NUMBER_BYTES, "%" PRIu64, w.session);
	snprintf(number[1], NUMBER_BYTES, "%" PRIu64, w.from);
	snprintf(number[2], NUMBER_BYTES, "%" PRIu64, w.to);
	snprintf(d->name, sizeof(d->name), "ecdaq-%s-%s", number[1], number[2]);
	d->type = "application/octet-stream";
	d->suffix = ".mcap";
	d->failed_status = HTTP_STATUS_NOT_FOUND; /* almost always: no such cycle is recorded */
	return begin_process(d, &d->server->exports, words);
}

/* What ecdaq prints for the page, and for Prometheus. */
static const struct report {
	const char *path;
	const char *words[REPORT_WORDS]; /* the verb and its arguments */
	const char *type;
	int good_exit; /* the greatest exit code that is an answer */
} reports[] = {
	{ "/metrics", { "metrics" }, "text/plain; version=0.0.4; charset=utf-8", 0 },
	{ "/config.json", { "config", "show", "--json" }, "application/x-ndjson", 0 },
	{ "/doctor.json", { "doctor", "--json" }, "application/json", 1 }, /* 1: something is wrong
									    */
};

static int begin_report(struct download *d, const struct report *report)
{
	const char *file = d->server->cfg->path;
	const char *words[MAX_WORDS] = { "ecdaq", "--run-dir", NULL, "--config", file };
	char path[PATH_MAX];
	size_t count = file[0] != '\0' ? 5 : 3;
	int r = config_run_path(d->server->cfg, "", path, sizeof(path));

	words[2] = path;
	for (size_t i = 0; i < REPORT_WORDS && report->words[i] != NULL; i++) {
		words[count++] = report->words[i];
	}
	words[count] = NULL;
	d->type = report->type;
	d->good_exit = report->good_exit;
	/* posix_spawn() only reads them */
	return r < 0 ? r : begin_process(d, &d->server->reports, (char *const *)(uintptr_t)words);
}

static int begin_file(struct download *d, const char *name)
{
	uint64_t bytes;
	int fd = recordings_open(d->server->cfg->record_dir, name, &bytes);

	if (fd < 0) {
		return fd;
	}
	d->fd = fd;
	snprintf(d->name, sizeof(d->name), "%s", name);
	d->has_head = 1;
	if (put_file_head(d, bytes) < 0) {
		return -EIO;
	}
	if (lws_hdr_total_length(d->wsi, WSI_TOKEN_HEAD_URI) > 0) {
		d->rest = (struct range){ 0, 0 };
	}
	return 0;
}

static int status_of(int error)
{
	return error == -ENOENT || error == -ENAMETOOLONG ? HTTP_STATUS_NOT_FOUND
	       : error == -EINVAL                         ? HTTP_STATUS_BAD_REQUEST
	       : error == -EBUSY                          ? HTTP_STATUS_SERVICE_UNAVAILABLE
	       : error == -EACCES                         ? HTTP_STATUS_FORBIDDEN
							  : HTTP_STATUS_INTERNAL_SERVER_ERROR;
}

/* 0 with one more download; or the HTTP status to be answered. */
static int add(struct lws *wsi, struct download **ret_download)
{
	struct server *s = server_of(wsi);
	struct download *d;

	if (s->downloads >= s->cfg->web_clients) {
		return HTTP_STATUS_SERVICE_UNAVAILABLE;
	}
	d = calloc(1, sizeof(*d));
	if (d == NULL) {
		return HTTP_STATUS_INTERNAL_SERVER_ERROR;
	}
	d->wsi = wsi;
	d->server = s;
	d->fd = -1;
	d->export = -1;
	d->suffix = "";
	d->failed_status = HTTP_STATUS_INTERNAL_SERVER_ERROR;
	s->downloads++;
	*ret_download = d;
	return 0;
}

/* The outcome @r of its beginning. */
static int begun(struct download *d, int r, struct download **ret_download)
{
	int has_head = d->has_head;

	if (r < 0) {
		server_download_end(d);
		return has_head ? -1 : status_of(r);
	}
	lws_set_timeout(d->wsi, PENDING_TIMEOUT_HTTP_CONTENT, STALLED_SECONDS);
	lws_callback_on_writable(d->wsi);
	*ret_download = d;
	return 0;
}

int server_download_begin(struct lws *wsi, const char *name, struct download **ret_download)
{
	size_t len = strlen(name);
	size_t suffix_len = strlen(csv_suffix);
	struct download *d;
	int r = add(wsi, &d);

	if (r != 0) {
		return r;
	}
	r = len > suffix_len && len < INT_MAX && strcmp(name + len - suffix_len, csv_suffix) == 0
		    ? begin_table(d, name, (int)(len - suffix_len))
		    : begin_file(d, name);
	return begun(d, r, ret_download);
}

int server_report_begin(struct lws *wsi, const char *path, struct download **ret_download)
{
	if (strcmp(path, window_path) == 0) {
		struct download *d;
		int r = add(wsi, &d);

		return r != 0 ? r : begun(d, begin_window(d), ret_download);
	}
	for (size_t i = 0; i < sizeof(reports) / sizeof(reports[0]); i++) {
		struct download *d;
		int r;

		if (strcmp(path, reports[i].path) == 0) {
			r = add(wsi, &d);
			return r != 0 ? r : begun(d, begin_report(d, &reports[i]), ret_download);
		}
	}
	return -ENOENT;
}

void server_download_end(struct download *d)
{
	if (d == NULL) {
		return;
	}
	lws_sul_cancel(&d->timer);
	if (d->fd >= 0) {
		close(d->fd);
	}
	if (d->export >= 0) {
		exports_stop(d->exports, d->export);
	}
	d->server->downloads--;
	free(d);
}

static void ask_again(lws_sorted_usec_list_t *timer)
{
	lws_callback_on_writable(((struct download *)timer)->wsi);
}

static int wait_for_table(struct download *d)
{
	lws_set_timeout(d->wsi, PENDING_TIMEOUT_HTTP_CONTENT, STALLED_SECONDS);
	lws_sul_schedule(lws_get_context(d->wsi), 0, &d->timer, ask_again, POLL_US);
	return 0;
}

static int put(struct download *d, uint8_t *data, size_t len, enum lws_write_protocol how)
{
	if (lws_write(d->wsi, data, len, how) < (int)len) {
		return -1;
	}
	lws_set_timeout(d->wsi, PENDING_TIMEOUT_HTTP_CONTENT, STALLED_SECONDS);
	if (how == LWS_WRITE_HTTP_FINAL) {
		return 1;
	}
	lws_callback_on_writable(d->wsi);
	return 0;
}

static int turn_file(struct download *d)
{
	uint64_t left = d->rest.end - d->rest.first;
	size_t wanted = left < CHUNK_BYTES ? (size_t)left : CHUNK_BYTES;
	uint8_t *data = d->buf + LWS_PRE;
	ssize_t n = left == 0 ? 0 : pread(d->fd, data, wanted, (off_t)d->rest.first);

	if (left == 0) {
		return 1;
	}
	if (n <= 0) {
		return -1; /* cut off meanwhile: not as long as it was announced */
	}
	d->rest.first += (uint64_t)n;
	return put(d, data, (size_t)n,
		   d->rest.first == d->rest.end ? LWS_WRITE_HTTP_FINAL : LWS_WRITE_HTTP);
}

/* After all of the table was read: is it complete? */
static int end_table(struct download *d)
{
	static const char last[] = "0\r\n\r\n";
	int r = exports_finish(d->exports, d->export, d->good_exit);

	if (r == 0) {
		return wait_for_table(d);
	}
	d->export = -1;
	if (r < 0) {
		/* A table that is cut off must not look like a whole one. */
		return d->has_head ? -1 : d->failed_status;
	}
	if (!d->has_head && put_table_head(d) < 0) {
		return -1;
	}
	memcpy(d->buf + LWS_PRE, last, sizeof(last));
	return put(d, d->buf + LWS_PRE, strlen(last), LWS_WRITE_HTTP_FINAL);
}

static int turn_table(struct download *d)
{
	uint8_t *data = d->buf + LWS_PRE + CHUNK_HEAD_BYTES;
	char head[CHUNK_HEAD_BYTES];
	size_t head_len;

	if (d->filled == 0) {
		ssize_t n = read(d->fd, data, CHUNK_BYTES);

		if (n < 0) {
			return errno == EAGAIN || errno == EINTR ? wait_for_table(d) : -1;
		}
		if (n == 0) {
			return end_table(d);
		}
		d->filled = (size_t)n;
	}
	if (!d->has_head) { /* known to begin well */
		if (put_table_head(d) < 0) {
			return -1;
		}
		lws_callback_on_writable(d->wsi);
		return 0;
	}
	head_len = (size_t)snprintf(head, sizeof(head), "%zx\r\n", d->filled);
	data -= head_len;
	memcpy(data, head, head_len);
	data[head_len + d->filled] = '\r';
	data[head_len + d->filled + 1] = '\n';
	head_len += d->filled + 2;
	d->filled = 0;
	return put(d, data, head_len, LWS_WRITE_HTTP);
}

int server_download_turn(struct download *d)
{
	return d->export >= 0 ? turn_table(d) : turn_file(d);
}
