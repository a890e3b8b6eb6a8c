/* SPDX-License-Identifier: MIT */
#include "uplink/plan.h"

#include <errno.h>
#include <openssl/evp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/clock.h"

enum { BLOCK_BYTES = 1 << 16, SHA256_BYTES = 32, MIB = 1 << 20 };

static void put_hex(const unsigned char *data, size_t len, char *text)
{
	for (size_t i = 0; i < len; i++) {
		snprintf(text + 2 * i, 3, "%02x", data[i]);
	}
}

/* --- one checksum --- */

struct plan_hash {
	EVP_MD_CTX *ctx;
};

struct plan_hash *plan_hash_create(void)
{
	struct plan_hash *h = calloc(1, sizeof(*h));

	if (h == NULL) {
		return NULL;
	}
	h->ctx = EVP_MD_CTX_new();
	if (h->ctx == NULL || EVP_DigestInit_ex(h->ctx, EVP_sha256(), NULL) != 1) {
		plan_hash_end(h, NULL);
		return NULL;
	}
	return h;
}

int plan_hash_add(struct plan_hash *h, const void *data, size_t len)
{
	return EVP_DigestUpdate(h->ctx, data, len) == 1 ? 0 : -EIO;
}

void plan_hash_end(struct plan_hash *h, char *ret_sha256)
{
	unsigned char sum[SHA256_BYTES] = { 0 };

	if (h == NULL) {
		return;
	}
	if (ret_sha256 != NULL && EVP_DigestFinal_ex(h->ctx, sum, NULL) == 1) {
		put_hex(sum, sizeof(sum), ret_sha256);
	}
	EVP_MD_CTX_free(h->ctx);
	free(h);
}

static void put_base64(const unsigned char md5[PLAN_MD5_BYTES], char text[PLAN_MD5_BASE64_BYTES])
{
	EVP_EncodeBlock((unsigned char *)text, md5, PLAN_MD5_BYTES);
}

int plan_sum_text(const void *text, size_t len, struct plan_sums *ret_sums)
{
	unsigned char md5[PLAN_MD5_BYTES];
	struct plan_hash *h = plan_hash_create();
	int r = h == NULL ? -ENOMEM : plan_hash_add(h, text, len);

	plan_hash_end(h, ret_sums->sha256);
	if (r == 0 && EVP_Digest(text, len, md5, NULL, EVP_md5(), NULL) != 1) {
		r = -ENOMEM;
	}
	if (r == 0) {
		put_base64(md5, ret_sums->md5_base64);
	}
	return r;
}

/* --- a file --- */

struct reading {
	struct plan *plan;
	struct plan_hash *all;
	struct plan_hash *part;
	EVP_MD_CTX *md5;
	uint32_t index; /* of the part */
	uint64_t left;  /* of its bytes */
};

static int begin_part(struct reading *rd, uint32_t index)
{
	rd->index = index;
	rd->left = plan_part_bytes(rd->plan, index);
	rd->part = plan_hash_create();
	return rd->part != NULL && EVP_DigestInit_ex(rd->md5, EVP_md5(), NULL) == 1 ? 0 : -ENOMEM;
}

static int end_part(struct reading *rd)
{
	struct plan_part *part = &rd->plan->part[rd->index];

	plan_hash_end(rd->part, part->sha256);
	rd->part = NULL;
	return EVP_DigestFinal_ex(rd->md5, part->md5, NULL) == 1 ? 0 : -EIO;
}

static int take(struct reading *rd, const unsigned char *data, size_t len)
{
	int r = rd->part == NULL ? -EIO : plan_hash_add(rd->all, data, len);

	r = r < 0 ? r : plan_hash_add(rd->part, data, len);
	if (r == 0 && EVP_DigestUpdate(rd->md5, data, len) != 1) {
		r = -EIO;
	}
	rd->left -= len;
	if (r == 0 && rd->left == 0) {
		r = end_part(rd);
		if (r == 0 && rd->index + 1 < rd->plan->count) {
			r = begin_part(rd, rd->index + 1);
		}
	}
	return r;
}

static int read_all(struct reading *rd, int fd, const volatile sig_atomic_t *stop)
{
	static unsigned char block[BLOCK_BYTES];
	uint64_t at = 0;
	int r = begin_part(rd, 0);

	while (r == 0 && at < rd->plan->bytes) {
		size_t wanted = rd->left < BLOCK_BYTES ? (size_t)rd->left : BLOCK_BYTES;
		ssize_t n = pread(fd, block, wanted, (off_t)at);

		if (*stop != 0) {
			return -EINTR;
		}
		if (n < 0 && errno == EINTR) {
			continue;
		}
		if (n <= 0) {
			return n < 0 ? -errno : -EIO;
		}
		at += (uint64_t)n;
		r = take(rd, block, (size_t)n);
	}
	return r;
}

/* Of parts: the MD5 of their MD5s, and how many. */
static int make_etag(struct plan *p)
{
	unsigned char md5[PLAN_MD5_BYTES];
	EVP_MD_CTX *ctx;
	int is_good;

	if (p->count == 1) {
		put_hex(p->part[0].md5, PLAN_MD5_BYTES, p->etag);
		return 0;
	}
	ctx = EVP_MD_CTX_new();
	is_good = ctx != NULL && EVP_DigestInit_ex(ctx, EVP_md5(), NULL) == 1;
	for (uint32_t i = 0; i < p->count && is_good; i++) {
		is_good = EVP_DigestUpdate(ctx, p->part[i].md5, PLAN_MD5_BYTES) == 1;
	}
	is_good = is_good && EVP_DigestFinal_ex(ctx, md5, NULL) == 1;
	EVP_MD_CTX_free(ctx);
	if (!is_good) {
		return -EIO;
	}
	put_hex(md5, PLAN_MD5_BYTES, p->etag);
	snprintf(p->etag + PLAN_MD5_CHARS, sizeof(p->etag) - PLAN_MD5_CHARS, "-%u", p->count);
	return 0;
}

/* Sizes by those of the file. */
static int size_up(struct plan *p, int fd, uint64_t part_bytes)
{
	struct stat st;

	if (fstat(fd, &st) < 0) {
		return -errno;
	}
	if (!S_ISREG(st.st_mode) || st.st_size <= 0) {
		return -EINVAL;
	}
	p->bytes = (uint64_t)st.st_size;
	p->mtime_ns = (int64_t)st.st_mtim.tv_sec * NS_PER_S + st.st_mtim.tv_nsec;
	while (p->bytes / part_bytes >= ANSWER_PARTS) {
		part_bytes += MIB;
	}
	p->part_bytes = part_bytes;
	p->count = (uint32_t)((p->bytes + part_bytes - 1) / part_bytes);
	p->part = calloc(p->count, sizeof(p->part[0]));
	return p->part == NULL ? -ENOMEM : 0;
}

int plan_create(int fd, uint64_t part_bytes, const volatile sig_atomic_t *stop,
		struct plan **ret_plan)
{
	struct plan *p = calloc(1, sizeof(*p));
	struct reading rd = { .plan = p };
	int r = p == NULL ? -ENOMEM : size_up(p, fd, part_bytes);

	if (r == 0) {
		rd.all = plan_hash_create();
		rd.md5 = EVP_MD_CTX_new();
		r = rd.all == NULL || rd.md5 == NULL ? -ENOMEM : read_all(&rd, fd, stop);
	}
	plan_hash_end(rd.part, NULL);
	plan_hash_end(rd.all, r == 0 ? p->sha256 : NULL);
	EVP_MD_CTX_free(rd.md5);
	r = r < 0 ? r : make_etag(p);
	if (r == 0 && !plan_is_of(p, fd)) {
		r = -EAGAIN; /* it was changed meanwhile */
	}
	if (r < 0) {
		plan_destroy(p);
		return r;
	}
	*ret_plan = p;
	return 0;
}

void plan_destroy(struct plan *p)
{
	if (p != NULL) {
		free(p->part);
		free(p);
	}
}

uint64_t plan_offset(const struct plan *p, uint32_t index)
{
	return p->part_bytes * index;
}

uint64_t plan_part_bytes(const struct plan *p, uint32_t index)
{
	uint64_t left = p->bytes - plan_offset(p, index);

	return left < p->part_bytes ? left : p->part_bytes;
}

void plan_part_etag(const struct plan *p, uint32_t index, char ret_etag[ANSWER_ETAG_BYTES])
{
	put_hex(p->part[index].md5, PLAN_MD5_BYTES, ret_etag);
}

void plan_part_base64(const struct plan *p, uint32_t index, char ret_text[PLAN_MD5_BASE64_BYTES])
{
	put_base64(p->part[index].md5, ret_text);
}

int plan_is_of(const struct plan *p, int fd)
{
	struct stat st;

	return fstat(fd, &st) == 0 && (uint64_t)st.st_size == p->bytes &&
	       (int64_t)st.st_mtim.tv_sec * NS_PER_S + st.st_mtim.tv_nsec == p->mtime_ns;
}
