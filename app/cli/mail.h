/* SPDX-License-Identifier: MIT */
/*
 * A request to the mailbox of one slave, and the values that the verbs for it read and write. A
 * failure is reported (cli_fail). Context: blocking.
 */
#ifndef CLI_MAIL_H
#define CLI_MAIL_H

#include <stddef.h>
#include <stdint.h>

#include "cli/admin_client.h"
#include "cli/cli.h"
#include "program/json.h"

/* Types of a value, besides enum sdo_type. */
enum { MAIL_NO_TYPE = -1, MAIL_STRING = -2 };

struct mail {
	struct cli *cli;
	const char *type; /* --type, as given; NULL: none */
	int is_json;
	int is_indices; /* of sdo list */
	uint64_t count; /* of sdo list; 0: all */
	struct admin_request request;
	struct admin_transfer transfer;
	uint8_t *data; /* of the request; NULL: it is in request.data */
};

void mail_init(struct mail *mail, struct cli *cli);
/** Frees what the others have allocated. */
void mail_done(struct mail *mail);

/* A word that says what to do, behind the verb: "read". */
struct mail_action {
	const char *word;
	int operands_min; /* with the word */
	int operands_max;
	const char *usage; /* "read: expected SLAVE INDEX:SUB" */
	enum exit_code (*run)(struct mail *mail, char **operands, int count);
};

/** Run the action that operands[0] names; then mail_done(). */
enum exit_code mail_run(struct mail *mail, const struct mail_action *actions, size_t action_count,
			char **operands, int count);

/** Send the request as @verb; with EXIT_CODE_OK the answer is in transfer.answer. */
enum exit_code mail_ask(struct mail *mail, enum admin_verb verb);
/** The same without a message for what the slave refuses (-EREMOTEIO): @ret_refused is 1 then. */
enum exit_code mail_try(struct mail *mail, enum admin_verb verb, int *ret_refused);

/** "0x1018:0a": both hexadecimal, with or without 0x; the subindex may be left out. */
enum exit_code mail_parse_object(struct mail *mail, const char *text);
/** --type: an enum sdo_type, MAIL_STRING or MAIL_NO_TYPE. */
enum exit_code mail_parse_type(const struct mail *mail, int *ret_type);
/** Data of the request: @text as the type of --type, which must be there. */
enum exit_code mail_parse_value(struct mail *mail, const char *text);
/** Data of the request: bytes in hex, "0a1b" or "0a 1b". */
enum exit_code mail_parse_bytes(struct mail *mail, const char *text);

/* The members of an answer as JSON before the value. */
typedef void (*mail_keys_writer)(struct json *js, const struct mail *mail);
/**
 * Send the request as @verb to the slave that @word names, and show the answer as the type of
 * --type, else by its length. As JSON: "bytes" and "value" in an object that write_keys() begins.
 */
enum exit_code mail_read(struct mail *mail, enum admin_verb verb, const char *word,
			 mail_keys_writer write_keys);
/** Send the request as @verb to the slave that @word names. */
enum exit_code mail_write(struct mail *mail, enum admin_verb verb, const char *word);

#endif
