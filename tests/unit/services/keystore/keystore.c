/* SPDX-License-Identifier: MIT */
#include "keystore/keystore.h"

#include <errno.h>
#include <fcntl.h>
#include <ftw.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "harness/test.h"
#include "keystore/policy.h"

#define DAY_S INT64_C(86400)

struct bench {
	char top[64];
	char store[96];
	char error[KEYSTORE_ERROR_BYTES];
};

static void bench_open(struct bench *b)
{
	snprintf(b->top, sizeof(b->top), "/tmp/ecdaq-keys-XXXXXX");
	CHECK(mkdtemp(b->top) != NULL);
	snprintf(b->store, sizeof(b->store), "%s/security", b->top);
	b->error[0] = '\0';
	CHECK_EQ(keystore_init(b->store, 100, b->error), 0);
}

static int remove_one(const char *path, const struct stat *st, int kind, struct FTW *ftw)
{
	(void)st;
	(void)kind;
	(void)ftw;
	return remove(path);
}

static void bench_close(const struct bench *b)
{
	CHECK_EQ(nftw(b->top, remove_one, 8, FTW_DEPTH | FTW_PHYS), 0);
}

static const char *path_of(const struct bench *b, const char *rest)
{
	static char path[256];

	snprintf(path, sizeof(path), "%s/%s", b->store, rest);
	return path;
}

static int check_at(struct bench *b, const char *who, int64_t now_s)
{
	struct keystore_identity identity = { .expires_s = 77 };
	int r = keystore_check(path_of(b, who), now_s, &identity, b->error);

	CHECK(r == 0 || identity.expires_s == 77);
	return r;
}

static int check(struct bench *b, const char *who)
{
	return check_at(b, who, (int64_t)time(NULL));
}

/* Copy a file of one participant over another's. */
static void mix(const struct bench *b, const char *from, const char *to)
{
	char data[16384];
	char target[256];
	FILE *in = fopen(path_of(b, from), "r");
	FILE *out;
	size_t bytes;

	CHECK(in != NULL);
	bytes = fread(data, 1, sizeof(data), in);
	fclose(in);
	snprintf(target, sizeof(target), "%s", path_of(b, to));
	out = fopen(target, "w");
	CHECK(out != NULL);
	CHECK_EQ(fwrite(data, 1, bytes, out), bytes);
	CHECK_EQ(fclose(out), 0);
}

TEST(keystore, every_participant_gets_a_complete_directory_that_only_its_owner_can_access)
{
	static const char *const names[] = { "appliance", "alice", "bob" };
	static const char *const files[] = { KEYSTORE_IDENTITY_CA, KEYSTORE_PERMISSIONS_CA,
					     KEYSTORE_GOVERNANCE,  KEYSTORE_CERT,
					     KEYSTORE_KEY,         KEYSTORE_PERMISSIONS };
	struct keystore_identity identity;
	struct bench b;
	struct stat st;
	char name[64];

	umask(0);
	bench_open(&b);
	CHECK_EQ(keystore_add(b.store, "alice", KEYSTORE_SUBSCRIBER, 10, b.error), 0);
	CHECK_EQ(keystore_add(b.store, "bob", KEYSTORE_COMMANDER, 10, b.error), 0);
	for (int i = 0; i < 3; i++) {
		CHECK_EQ(check(&b, names[i]), 0);
		CHECK_EQ(stat(path_of(&b, names[i]), &st), 0);
		CHECK_EQ(st.st_mode & 07777, 0700);
		for (int k = 0; k < 6; k++) {
			snprintf(name, sizeof(name), "%s/%s", names[i], files[k]);
			CHECK_EQ(stat(path_of(&b, name), &st), 0);
			CHECK_EQ(st.st_mode & 07777, 0600);
		}
	}
	CHECK_EQ(stat(path_of(&b, "ca/identity_ca.key.pem"), &st), 0);
	CHECK_EQ(st.st_mode & 07777, 0600);
	CHECK_EQ(keystore_check(path_of(&b, "alice"), (int64_t)time(NULL), &identity, b.error), 0);
	CHECK_STR(identity.name, "CN=alice");
	CHECK(identity.expires_s > (int64_t)time(NULL) + 9 * DAY_S);
	CHECK(identity.expires_s <= (int64_t)time(NULL) + 10 * DAY_S);
	bench_close(&b);
}

TEST(keystore, an_existing_store_or_participant_is_not_overwritten)
{
	struct bench b;

	bench_open(&b);
	CHECK_EQ(keystore_init(b.store, 100, b.error), -EEXIST);
	CHECK(strstr(b.error, "already contains a key store") != NULL);
	CHECK_EQ(keystore_add(b.store, "alice", KEYSTORE_SUBSCRIBER, 10, b.error), 0);
	CHECK_EQ(keystore_add(b.store, "alice", KEYSTORE_COMMANDER, 10, b.error), -EEXIST);
	CHECK(strstr(b.error, "already exists") != NULL);
	CHECK_EQ(keystore_add(b.top, "alice", KEYSTORE_COMMANDER, 10, b.error), -ENOENT);
	CHECK(strstr(b.error, "create one with ecdaq security init") != NULL);
	bench_close(&b);
}

TEST(keystore, names_that_are_invalid_or_reserved_are_rejected)
{
	static const char *const wrong[] = {
		"",
		"../x",
		"a b",
		"-x",
		"a/b",
		"<b>",
		"appliance",
		"ca",
		"a=b",
		"a,b",
		"a23456789012345678901234567890123456789012",
	};
	struct bench b;

	bench_open(&b);
	for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++) {
		CHECK_EQ(keystore_add(b.store, wrong[i], KEYSTORE_SUBSCRIBER, 10, b.error),
			 -EINVAL);
	}
	bench_close(&b);
}

TEST(keystore, expired_and_not_yet_valid_certificates_are_rejected_with_a_hint_at_the_clock)
{
	int64_t now_s = (int64_t)time(NULL);
	struct bench b;

	bench_open(&b);
	CHECK_EQ(check_at(&b, "appliance", now_s + 99 * DAY_S), 0);
	CHECK_EQ(check_at(&b, "appliance", now_s + 101 * DAY_S), -EKEYEXPIRED);
	CHECK(strstr(b.error, "cert.pem: expired: is the clock right?") != NULL);
	CHECK_EQ(check_at(&b, "appliance", 0), -EKEYEXPIRED); /* a clock that was never set */
	CHECK(strstr(b.error, "cert.pem: not valid yet: is the clock right?") != NULL);
	bench_close(&b);
}

TEST(keystore, files_that_do_not_belong_together_are_rejected_by_name)
{
	static const struct {
		const char *from;
		const char *to;
		int error;
		const char *said;
	} cases[] = {
		{ "bob/key.pem", "alice/key.pem", -EKEYREJECTED,
		  "key.pem: does not belong to cert.pem" },
		{ "bob/permissions.p7s", "alice/permissions.p7s", -EKEYREJECTED,
		  "permissions.p7s: is for CN=bob, but the certificate is for CN=alice" },
		{ "ca/permissions_ca.cert.pem", "alice/identity_ca.cert.pem", -EKEYREJECTED,
		  "cert.pem: not issued by identity_ca.cert.pem" },
		{ "ca/identity_ca.cert.pem", "alice/permissions_ca.cert.pem", -EKEYREJECTED,
		  "governance.p7s: modified, or not signed by permissions_ca.cert.pem" },
		{ "alice/cert.pem", "alice/governance.p7s", -EKEYREJECTED,
		  "governance.p7s: not a signed document" },
		{ "alice/governance.p7s", "alice/cert.pem", -EKEYREJECTED,
		  "cert.pem: not a certificate" },
		{ "alice/governance.p7s", "alice/key.pem", -EKEYREJECTED,
		  "key.pem: not a private key" },
	};

	for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
		struct bench b;

		bench_open(&b);
		CHECK_EQ(keystore_add(b.store, "alice", KEYSTORE_SUBSCRIBER, 10, b.error), 0);
		CHECK_EQ(keystore_add(b.store, "bob", KEYSTORE_COMMANDER, 10, b.error), 0);
		mix(&b, cases[i].from, cases[i].to);
		CHECK_EQ(check(&b, "alice"), cases[i].error);
		CHECK(strstr(b.error, cases[i].said) != NULL);
		CHECK_EQ(check(&b, "bob"), 0);
		bench_close(&b);
	}
}

TEST(keystore, modified_permissions_are_rejected)
{
	struct bench b;
	char data[8192] = "";
	char *place;
	FILE *file;
	size_t bytes;

	bench_open(&b);
	CHECK_EQ(keystore_add(b.store, "alice", KEYSTORE_SUBSCRIBER, 10, b.error), 0);
	file = fopen(path_of(&b, "alice/permissions.p7s"), "r+");
	CHECK(file != NULL);
	bytes = fread(data, 1, sizeof(data) - 1, file);
	place = strstr(data, "ecdaq/block");
	CHECK(place != NULL);
	memcpy(place, "ecdaq/reply", 11);
	rewind(file);
	CHECK_EQ(fwrite(data, 1, bytes, file), bytes);
	fclose(file);
	CHECK_EQ(check(&b, "alice"), -EKEYREJECTED);
	CHECK(strstr(b.error, "permissions.p7s: modified") != NULL);
	bench_close(&b);
}

TEST(keystore, a_missing_key_or_one_accessible_to_others_is_rejected)
{
	struct bench b;

	bench_open(&b);
	CHECK_EQ(chmod(path_of(&b, "appliance/key.pem"), 0640), 0);
	CHECK_EQ(check(&b, "appliance"), -EPERM);
	CHECK(strstr(b.error, "accessible to others (mode 0640): chmod 600") != NULL);
	CHECK_EQ(unlink(path_of(&b, "appliance/key.pem")), 0);
	CHECK_EQ(check(&b, "appliance"), -ENOENT);
	CHECK(strstr(b.error, "appliance/key.pem: No such file") != NULL);
	CHECK_EQ(check(&b, "nobody"), -ENOENT);
	bench_close(&b);
}

TEST(policy, only_a_commander_may_write_commands_and_read_replies)
{
	struct policy_grant grant = { .name = "x", .not_before_s = 0, .not_after_s = 86400 };
	char text[POLICY_TEXT_BYTES];

	grant.role = KEYSTORE_SUBSCRIBER;
	CHECK_EQ(policy_permissions(&grant, text), strlen(text));
	CHECK(strstr(text, "ecdaq/sample") != NULL);
	CHECK(strstr(text, "ecdaq/command") == NULL);
	CHECK(strstr(text, "ecdaq/reply") == NULL);
	CHECK(strstr(text, "<publish>") == NULL);
	CHECK(strstr(text, "<default>DENY</default>") != NULL);
	CHECK(strstr(text, "<not_after>1970-01-02T00:00:00<") != NULL);
	grant.role = KEYSTORE_COMMANDER;
	policy_permissions(&grant, text);
	CHECK(strstr(text, "ecdaq/command") < strstr(text, "<subscribe>"));
	CHECK(strstr(text, "ecdaq/reply") > strstr(text, "<subscribe>"));
}

TEST(policy, times_are_parsed_in_the_format_they_are_written_in)
{
	int64_t s = 5;

	CHECK_EQ(policy_time("2026-11-21T14:00:00", &s), 0);
	CHECK_EQ(s, 1795269600);
	CHECK_EQ(policy_time("2026-11-21T14:00:00Z", &s), 0);
	s = 5;
	CHECK_EQ(policy_time("2026-11-21", &s), -EINVAL);
	CHECK_EQ(policy_time("2026-11-21T14:00:00+01:00", &s), -EINVAL);
	CHECK_EQ(s, 5);
}
