/* SPDX-License-Identifier: MIT */
/*
 * libcurl signs (AWS_SIGV4). What its versions do differently is avoided, down to 7.88 of Debian
 * 12: keys need no escape, parameters come sorted, escaped and with "=", the hash of the content is
 * always given, and no header is given without a value, as it would be signed and not sent.
 */
#include "uplink/bucket.h"

#include <curl/curl.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "base/stop.h"
#include "uplink/credentials.h"

#define SHA256_OF_NOTHING "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"

enum {
	CONNECT_S = 10,
	QUIET_S = 60, /* without a byte */
	SKEW_S = 60,  /* that is worth to be mentioned */
	URL_BYTES = 2 * CONFIG_PATH_BYTES + UPLOAD_KEY_BYTES + BUCKET_QUERY_BYTES,
	HEADER_BYTES = CREDENTIALS_TOKEN_BYTES + 64,
};

struct bucket {
	const struct config *cfg;
	struct bucket_watch watch;
	CURL *curl;
	char error[CURL_ERROR_SIZE];
	char base[2 * CONFIG_PATH_BYTES]; /* of addresses, up to the key's slash */
	char region[96];                  /* for the signature */
	struct credentials credentials;
	char *body;

	/* Of the request that is made. */
	const struct bucket_request *request;
	struct bucket_answer *answer;
	uint64_t at; /* of what is sent */
	int64_t server_s;
	int read_error;
};

int bucket_create(const struct config *cfg, struct bucket_watch watch, struct bucket **ret_bucket,
		  char problem[BUCKET_PROBLEM_BYTES])
{
	struct bucket *b = calloc(1, sizeof(*b));
	const char *host = strstr(cfg->uplink_endpoint, "://");
	int r = b == NULL || curl_global_init(CURL_GLOBAL_DEFAULT) != CURLE_OK ? -ENOMEM : 0;

	if (r == 0) {
		b->cfg = cfg;
		b->watch = watch;
		b->curl = curl_easy_init();
		b->body = malloc(BUCKET_BODY_BYTES);
		r = b->curl == NULL || b->body == NULL ? -ENOMEM : 0;
	}
	if (r < 0) {
		snprintf(problem, BUCKET_PROBLEM_BYTES, "%s", strerror(-r));
		bucket_destroy(b);
		return r;
	}
	if (cfg->uplink_addressing == CONFIG_ADDRESSING_HOST && host != NULL) {
		snprintf(b->base, sizeof(b->base), "%.*s://%s.%s",
			 (int)(host - cfg->uplink_endpoint), cfg->uplink_endpoint,
			 cfg->uplink_bucket, host + 3);
	} else {
		snprintf(b->base, sizeof(b->base), "%s/%s", cfg->uplink_endpoint,
			 cfg->uplink_bucket);
	}
	snprintf(b->region, sizeof(b->region), "aws:amz:%s:s3", cfg->uplink_region);
	r = credentials_read(cfg->uplink_credentials, &b->credentials, problem,
			     BUCKET_PROBLEM_BYTES);
	if (r == 0 && cfg->uplink_ca[0] != '\0' && access(cfg->uplink_ca, R_OK) < 0) {
		snprintf(problem, BUCKET_PROBLEM_BYTES, "uplink.ca: %.150s: %s", cfg->uplink_ca,
			 strerror(errno));
		r = -EINVAL;
	}
	if (r < 0) {
		bucket_destroy(b);
		return r;
	}
	*ret_bucket = b;
	return 0;
}

void bucket_destroy(struct bucket *b)
{
	if (b == NULL) {
		return;
	}
	curl_easy_cleanup(b->curl);
	explicit_bzero(&b->credentials, sizeof(b->credentials));
	free(b->body);
	free(b);
	curl_global_cleanup();
}

/* --- what libcurl calls --- */

static size_t give(char *buf, size_t size, size_t count, void *ctx)
{
	struct bucket *b = ctx;
	const struct bucket_request *rq = b->request;
	uint64_t left = rq->len - b->at;
	size_t wanted = left < size * count ? (size_t)left : size * count;
	ssize_t n = (ssize_t)wanted;

	if (wanted == 0) {
		return 0;
	}
	if (rq->text != NULL) {
		memcpy(buf, rq->text + b->at, wanted);
	} else {
		n = pread(rq->fd, buf, wanted, (off_t)(rq->offset + b->at));
	}
	if (n <= 0) {
		b->read_error = n < 0 ? errno : EIO;
		return CURL_READFUNC_ABORT;
	}
	b->at += (uint64_t)n;
	return (size_t)n;
}

static int seek(void *ctx, curl_off_t offset, int origin)
{
	struct bucket *b = ctx;

	if (origin != SEEK_SET || offset < 0 || (uint64_t)offset > b->request->len) {
		return CURL_SEEKFUNC_FAIL;
	}
	b->at = (uint64_t)offset;
	return CURL_SEEKFUNC_OK;
}

static int is_success(const struct bucket *b)
{
	long status = 0;

	curl_easy_getinfo(b->curl, CURLINFO_RESPONSE_CODE, &status);
	return status >= 200 && status < 300;
}

static size_t take(char *data, size_t size, size_t count, void *ctx)
{
	struct bucket *b = ctx;
	struct bucket_answer *answer = b->answer;
	size_t len = size * count;

	if (b->request->take != NULL && is_success(b)) {
		return b->request->take(b->request->ctx, data, len) < 0 ? 0 : len;
	}
	if (len > BUCKET_BODY_BYTES - answer->len) {
		return 0;
	}
	memcpy(b->body + answer->len, data, len);
	answer->len += len;
	return len;
}

/* The value of header @name in the line; NULL: it is another one. */
static const char *header_value(const char *line, size_t len, const char *name, size_t *ret_len)
{
	size_t n = strlen(name);
	const char *end = line + len;

	if (len <= n || line[n] != ':' || strncasecmp(line, name, n) != 0) {
		return NULL;
	}
	line += n + 1;
	while (line < end && (*line == ' ' || *line == '\t')) {
		line++;
	}
	while (end > line && (end[-1] == '\r' || end[-1] == '\n' || end[-1] == ' ')) {
		end--;
	}
	*ret_len = (size_t)(end - line);
	return line;
}

static void copy_value(char *to, size_t bytes, const char *value, size_t len)
{
	snprintf(to, bytes, "%.*s", len < bytes ? (int)len : 0, value);
}

static size_t take_header(char *line, size_t size, size_t count, void *ctx)
{
	struct bucket *b = ctx;
	struct bucket_answer *answer = b->answer;
	size_t len = 0;
	const char *value = header_value(line, size * count, "ETag", &len);
	char text[64];

	if (value != NULL) {
		answer_plain_etag(value, len, answer->etag);
	}
	value = header_value(line, size * count, "x-amz-meta-sha256", &len);
	if (value != NULL) {
		copy_value(answer->meta_sha256, sizeof(answer->meta_sha256), value, len);
	}
	value = header_value(line, size * count, "x-amz-server-side-encryption", &len);
	if (value != NULL) {
		copy_value(answer->encryption, sizeof(answer->encryption), value, len);
	}
	value = header_value(line, size * count, "Date", &len);
	if (value != NULL) {
		copy_value(text, sizeof(text), value, len);
		b->server_s = (int64_t)curl_getdate(text, NULL);
	}
	return size * count;
}

static int progress(void *ctx, curl_off_t down_total, curl_off_t down, curl_off_t up_total,
		    curl_off_t up)
{
	struct bucket *b = ctx;
	struct stat st;

	(void)down_total;
	(void)down;
	(void)up_total;
	b->watch.sent(b->watch.ctx, (uint64_t)up);
	/* A recording that is deleted needs its room at once. */
	if (b->request->fd >= 0 && (fstat(b->request->fd, &st) < 0 || st.st_nlink == 0)) {
		b->read_error = ESTALE;
	}
	return stop_requested() || b->read_error != 0;
}

/* --- a request --- */

static int add_header(struct curl_slist **list, const char *name, const char *value)
{
	char text[HEADER_BYTES];
	struct curl_slist *longer;

	if (value == NULL || value[0] == '\0') {
		return 0;
	}
	snprintf(text, sizeof(text), "%s: %s", name, value);
	longer = curl_slist_append(*list, text);
	explicit_bzero(text, sizeof(text));
	if (longer == NULL) {
		return -ENOMEM;
	}
	*list = longer;
	return 0;
}

static int add_headers(const struct bucket *b, struct curl_slist **list)
{
	const struct bucket_request *rq = b->request;
	int r = add_header(list, "x-amz-content-sha256",
			   rq->sha256 != NULL ? rq->sha256 : SHA256_OF_NOTHING);

	r = r < 0 ? r : add_header(list, "x-amz-security-token", b->credentials.token);
	r = r < 0 ? r : add_header(list, "x-amz-meta-sha256", rq->meta_sha256);
	r = r < 0 ? r : add_header(list, "Content-MD5", rq->md5_base64);
	return rq->sha256 == NULL ? r
	       : r < 0            ? r
				  : add_header(list, "Content-Type", "application/octet-stream");
}

static void set_method(struct bucket *b)
{
	const struct bucket_request *rq = b->request;
	CURL *curl = b->curl;

	switch (rq->method) {
	case BUCKET_GET:
		break;
	case BUCKET_HEAD:
		curl_easy_setopt(curl, CURLOPT_NOBODY, 1L);
		break;
	case BUCKET_PUT:
		curl_easy_setopt(curl, CURLOPT_UPLOAD, 1L);
		curl_easy_setopt(curl, CURLOPT_INFILESIZE_LARGE, (curl_off_t)rq->len);
		curl_easy_setopt(curl, CURLOPT_READFUNCTION, give);
		curl_easy_setopt(curl, CURLOPT_READDATA, b);
		curl_easy_setopt(curl, CURLOPT_SEEKFUNCTION, seek);
		curl_easy_setopt(curl, CURLOPT_SEEKDATA, b);
		break;
	case BUCKET_POST:
		curl_easy_setopt(curl, CURLOPT_POST, 1L);
		curl_easy_setopt(curl, CURLOPT_POSTFIELDS, rq->text != NULL ? rq->text : "");
		curl_easy_setopt(curl, CURLOPT_POSTFIELDSIZE_LARGE, (curl_off_t)rq->len);
		break;
	case BUCKET_DELETE:
		curl_easy_setopt(curl, CURLOPT_CUSTOMREQUEST, "DELETE");
		break;
	}
}

static void set_options(struct bucket *b, const char *url, struct curl_slist *headers)
{
	const struct config *cfg = b->cfg;
	CURL *curl = b->curl;

	curl_easy_reset(curl); /* keeps connections */
	curl_easy_setopt(curl, CURLOPT_URL, url);
	curl_easy_setopt(curl, CURLOPT_PROTOCOLS_STR, "http,https");
	curl_easy_setopt(curl, CURLOPT_HTTP_VERSION, (long)CURL_HTTP_VERSION_1_1);
	curl_easy_setopt(curl, CURLOPT_NOSIGNAL, 1L);
	curl_easy_setopt(curl, CURLOPT_ERRORBUFFER, b->error);
	curl_easy_setopt(curl, CURLOPT_AWS_SIGV4, b->region);
	curl_easy_setopt(curl, CURLOPT_USERNAME, b->credentials.id);
	curl_easy_setopt(curl, CURLOPT_PASSWORD, b->credentials.secret);
	curl_easy_setopt(curl, CURLOPT_HTTPHEADER, headers);
	curl_easy_setopt(curl, CURLOPT_CONNECTTIMEOUT, (long)CONNECT_S);
	curl_easy_setopt(curl, CURLOPT_LOW_SPEED_LIMIT, 1L);
	curl_easy_setopt(curl, CURLOPT_LOW_SPEED_TIME, (long)QUIET_S);
	curl_easy_setopt(curl, CURLOPT_WRITEFUNCTION, take);
	curl_easy_setopt(curl, CURLOPT_WRITEDATA, b);
	curl_easy_setopt(curl, CURLOPT_HEADERFUNCTION, take_header);
	curl_easy_setopt(curl, CURLOPT_HEADERDATA, b);
	curl_easy_setopt(curl, CURLOPT_NOPROGRESS, 0L);
	curl_easy_setopt(curl, CURLOPT_XFERINFOFUNCTION, progress);
	curl_easy_setopt(curl, CURLOPT_XFERINFODATA, b);
	if (cfg->uplink_rate_limit_bytes > 0) {
		curl_off_t limit = (curl_off_t)cfg->uplink_rate_limit_bytes;

		curl_easy_setopt(curl, CURLOPT_MAX_SEND_SPEED_LARGE, limit);
		curl_easy_setopt(curl, CURLOPT_MAX_RECV_SPEED_LARGE, limit);
	}
	if (cfg->uplink_ca[0] != '\0') {
		curl_easy_setopt(curl, CURLOPT_CAINFO, cfg->uplink_ca);
	}
	set_method(b);
}

/* What the store's codes mean for a person. */
static const struct {
	const char *code;
	const char *text;
} known[] = {
	{ "InvalidAccessKeyId", "access key unknown to the store: check uplink.credentials" },
	{ "SignatureDoesNotMatch", "secret key is wrong: check uplink.credentials" },
	{ "ExpiredToken", "credentials have expired: renew uplink.credentials" },
	{ "InvalidToken", "session token rejected: check uplink.credentials" },
	{ "AccessDenied", "access denied: check uplink.credentials and what they permit" },
	{ "NoSuchBucket", "bucket does not exist: create it, or check uplink.bucket" },
	{ "PermanentRedirect", "bucket is in another region: check uplink.region" },
	{ "AuthorizationHeaderMalformed", "region rejected: check uplink.region" },
	{ "SlowDown", "store is overloaded (SlowDown)" },
};

static int is_code(const struct answer_error *error, const char *code)
{
	return strcmp(error->code, code) == 0;
}

static int explain_answer(struct bucket *b, char *problem)
{
	struct bucket_answer *answer = b->answer;
	struct answer_error error = { .code = "" };
	int64_t ahead_s = b->server_s > 0 ? (int64_t)time(NULL) - b->server_s : 0;

	(void)answer_get_error(b->body, answer->len, &error);
	/* An answer to HEAD has no content, hence no code. */
	if (answer->status == 404 && !is_code(&error, "NoSuchBucket")) {
		return -ENOENT;
	}
	if (is_code(&error, "RequestTimeTooSkewed") || is_code(&error, "RequestExpired") ||
	    (answer->status == 403 && (ahead_s > 15L * 60 || ahead_s < -15L * 60))) {
		snprintf(problem, BUCKET_PROBLEM_BYTES,
			 "%.120s: the clock of this machine%s the store's: set it", b->base,
			 ahead_s > SKEW_S    ? " is ahead of"
			 : ahead_s < -SKEW_S ? " is behind"
					     : " differs from");
		return -EIO;
	}
	for (size_t i = 0; i < sizeof(known) / sizeof(known[0]); i++) {
		if (is_code(&error, known[i].code)) {
			snprintf(problem, BUCKET_PROBLEM_BYTES, "%.120s: %s", b->base,
				 known[i].text);
			return answer->status == 403 ? -EPERM : -EIO;
		}
	}
	snprintf(problem, BUCKET_PROBLEM_BYTES, "%.100s: HTTP status %ld%s%.60s%s", b->base,
		 answer->status, error.code[0] != '\0' ? ", " : "", error.code,
		 answer->status == 403 ? ": check what uplink.credentials permit" : "");
	return answer->status == 403 ? -EPERM : -EIO;
}

/* libcurl's own text where it does not change from try to try. */
static int explain_failure(struct bucket *b, CURLcode code, char *problem)
{
	int is_of_tls = code == CURLE_PEER_FAILED_VERIFICATION || code == CURLE_SSL_CACERT_BADFILE;
	const char *text = is_of_tls && b->error[0] != '\0' ? b->error : curl_easy_strerror(code);

	if (stop_requested()) {
		return -EINTR;
	}
	if (b->read_error != 0) {
		text = strerror(b->read_error);
	}
	snprintf(problem, BUCKET_PROBLEM_BYTES, "%.120s: %.120s", b->base, text);
	return -EIO;
}

static int make_url(const struct bucket *b, char *url)
{
	const struct bucket_request *rq = b->request;
	int n = snprintf(url, URL_BYTES, "%s%s%s%s%s", b->base, rq->key[0] != '\0' ? "/" : "",
			 rq->key, rq->query != NULL ? "?" : "", rq->query != NULL ? rq->query : "");

	return n < 0 || n >= URL_BYTES ? -ENAMETOOLONG : 0;
}

int bucket_request(struct bucket *b, const struct bucket_request *request,
		   struct bucket_answer *ret_answer, char problem[BUCKET_PROBLEM_BYTES])
{
	char url[URL_BYTES];
	struct curl_slist *headers = NULL;
	curl_off_t bytes = -1;
	CURLcode code;
	int r;

	*ret_answer = (struct bucket_answer){ .bytes = -1, .text = b->body };
	b->request = request;
	b->answer = ret_answer;
	b->at = 0;
	b->server_s = 0;
	b->read_error = 0;
	b->error[0] = '\0';
	/* Each time: they may be renewed. */
	r = credentials_read(b->cfg->uplink_credentials, &b->credentials, problem,
			     BUCKET_PROBLEM_BYTES);
	if (r < 0) {
		return -EPERM;
	}
	r = make_url(b, url);
	r = r < 0 ? r : add_headers(b, &headers);
	if (r < 0) {
		curl_slist_free_all(headers);
		snprintf(problem, BUCKET_PROBLEM_BYTES, "%.120s: %s", b->base, strerror(-r));
		return -EIO;
	}
	set_options(b, url, headers);
	code = curl_easy_perform(b->curl);
	curl_easy_getinfo(b->curl, CURLINFO_RESPONSE_CODE, &ret_answer->status);
	curl_easy_getinfo(b->curl, CURLINFO_CONTENT_LENGTH_DOWNLOAD_T, &bytes);
	ret_answer->bytes = bytes;
	curl_slist_free_all(headers);
	if (ret_answer->status >= 300) { /* also one that came before all was sent */
		return explain_answer(b, problem);
	}
	return code != CURLE_OK ? explain_failure(b, code, problem) : 0;
}

void bucket_escape(const char *text, char *buf, size_t bytes)
{
	static const char plain[] = CONFIG_TOKEN ".~";
	size_t n = strlen(buf);

	for (; *text != '\0' && n + 4 <= bytes; text++) {
		if (strchr(plain, *text) != NULL) {
			buf[n++] = *text;
		} else {
			n += (size_t)snprintf(buf + n, 4, "%%%02X", (unsigned char)*text);
		}
	}
	buf[n] = '\0';
}
