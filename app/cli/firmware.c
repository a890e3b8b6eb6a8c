/* SPDX-License-Identifier: MIT */
/*
 * ecdaq firmware: a slave to BOOT, a file to it by FoE, and back to where it was. What fails leaves
 * the slave where it is, and says where that is; the update may be repeated from there.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/args.h"
#include "base/bytes.h"
#include "base/clock.h"
#include "base/stop.h"
#include "cli/admin_client.h"
#include "cli/cli.h"
#include "cli/file.h"
#include "cli/foe.h"
#include "cli/source.h"
#include "program/json.h"
#include "wire/al.h"
#include "wire/sii.h"

enum { AL_STATUS = 0x0130, SOFTWARE_VERSION = 0x100a, VERSION_BYTES = 64 };
/* A slave may restart by itself after a new firmware, and does not answer meanwhile. */
#define RESTART_NS (60 * NS_PER_S)
#define RETRY_NS (NS_PER_S / 2)

struct versions {
	char text[VERSION_BYTES]; /* 0x100A; "": it cannot be read */
	uint32_t revision;        /* of the SII; 0: it cannot be read */
};

struct firmware {
	struct cli *cli;
	const char *name; /* at the slave; NULL: that of the file */
	struct args_integer password;
	int is_json;
	uint16_t slave_pos;
	char slave_name[LIMIT_NAME_BYTES];
	uint8_t *image;
	size_t image_len;
	struct versions before;
	struct versions after;
	struct admin_request write; /* the file */
};

/* --- small requests, without a message --- */

/* AL state of the slave, an enum al_state; AL_NONE: it does not answer. */
static uint16_t state_now(const struct firmware *fw)
{
	struct admin_request rq = { .verb = ADMIN_REGISTER_READ,
				    .slave_pos = fw->slave_pos,
				    .address = AL_STATUS,
				    .length = 2 };
	struct admin_reply reply;

	if (admin_ask(fw->cli, &rq, &reply) != EXIT_CODE_OK || reply.result < 0 ||
	    reply.data_len != 2) {
		return AL_NONE;
	}
	return get_le16(reply.data) & AL_STATE_MASK;
}

static void read_version(const struct firmware *fw, char *ret_text)
{
	struct admin_request rq = { .verb = ADMIN_SDO_READ,
				    .slave_pos = fw->slave_pos,
				    .index = SOFTWARE_VERSION };
	struct admin_reply reply;
	size_t len;

	ret_text[0] = '\0';
	if (admin_ask(fw->cli, &rq, &reply) != EXIT_CODE_OK || reply.result < 0) {
		return;
	}
	len = strnlen((const char *)reply.data,
		      reply.data_len < VERSION_BYTES ? reply.data_len : VERSION_BYTES - 1);
	for (size_t i = 0; i < len; i++) {
		ret_text[i] =
			reply.data[i] >= ' ' && reply.data[i] <= '~' ? (char)reply.data[i] : '_';
	}
	ret_text[len] = '\0';
}

static uint32_t read_revision(const struct firmware *fw)
{
	struct admin_request rq = { .verb = ADMIN_SII_READ, .slave_pos = fw->slave_pos };
	struct admin_transfer tr = { .request = &rq };
	uint32_t revision = 0;

	if (admin_transfer(fw->cli, &tr) == EXIT_CODE_OK && tr.reply.result == 0 &&
	    tr.answer_len >= SII_REVISION_BYTE + 4) {
		revision = get_le32(tr.answer + SII_REVISION_BYTE);
	}
	admin_transfer_done(&tr);
	return revision;
}

static struct versions read_versions(const struct firmware *fw, uint16_t state)
{
	struct versions found = { .revision = read_revision(fw) };

	if (state == AL_PREOP) {
		read_version(fw, found.text);
	}
	return found;
}

/* --- the steps --- */

/* Where a failure leaves the slave, and what to do then. */
static enum exit_code fail(const struct firmware *fw, const char *why)
{
	uint16_t state = state_now(fw);

	return cli_fail(fw->cli, stop_requested() ? EXIT_CODE_FAILED : EXIT_CODE_REFUSED,
			"%s; slave %u (%s) %s%s: repeat ecdaq firmware, or ecdaq state PREOP %s",
			stop_requested() ? "interrupted" : why, fw->slave_pos, fw->slave_name,
			state == AL_NONE ? "does not answer" : "is in ",
			state == AL_NONE ? "" : al_state_to_str(state), fw->slave_name);
}

/* EXIT_CODE_OK with @ret_reply, which may be a refusal; else reported. */
static enum exit_code ask_state(const struct firmware *fw, enum al_state state,
				struct admin_reply *ret_reply)
{
	struct admin_request rq = { .verb = ADMIN_STATE,
				    .slave_pos = fw->slave_pos,
				    .argument = { (uint32_t)state } };

	return admin_ask(fw->cli, &rq, ret_reply);
}

static enum exit_code lead(const struct firmware *fw, enum al_state state)
{
	struct admin_reply reply = { .result = 0 };
	enum exit_code result = ask_state(fw, state, &reply);

	return result != EXIT_CODE_OK || reply.result == 0 ? result : fail(fw, reply.text);
}

/* The same of a slave that may be restarting. */
static enum exit_code lead_back(const struct firmware *fw, enum al_state state)
{
	struct admin_reply reply = { .result = 0 };

	for (int64_t waited_ns = 0; waited_ns < RESTART_NS; waited_ns += RETRY_NS) {
		enum exit_code result = ask_state(fw, state, &reply);

		if (result != EXIT_CODE_OK || reply.result == 0) {
			return result;
		}
		if (stop_requested()) {
			break;
		}
		stop_wait(RETRY_NS);
	}
	return fail(fw, reply.text);
}

static enum exit_code write_image(struct firmware *fw)
{
	struct admin_transfer tr = { .request = &fw->write,
				     .data = fw->image,
				     .data_len = fw->image_len,
				     .can_cancel = 1,
				     .what = fw->write.name };
	enum exit_code result = admin_transfer(fw->cli, &tr);

	if (result == EXIT_CODE_OK && tr.reply.result < 0) {
		result = fail(fw, tr.reply.text);
	}
	admin_transfer_done(&tr);
	return result;
}

/* From INIT, PRE-OP or BOOT only: the rest of the bus needs it in the others. */
static enum exit_code check_state(const struct firmware *fw, uint16_t state)
{
	if (state == AL_NONE) {
		return cli_fail(fw->cli, EXIT_CODE_REFUSED, "slave %u (%s): does not answer",
				fw->slave_pos, fw->slave_name);
	}
	if (state == AL_SAFEOP || state == AL_OP) {
		return cli_fail(fw->cli, EXIT_CODE_REFUSED,
				"slave %u (%s) is in %s: ecdaq state PREOP all first",
				fw->slave_pos, fw->slave_name, al_state_to_str(state));
	}
	return EXIT_CODE_OK;
}

static enum exit_code update(struct firmware *fw)
{
	uint16_t state = state_now(fw);
	enum exit_code result = check_state(fw, state);

	if (result != EXIT_CODE_OK) {
		return result;
	}
	fw->before = read_versions(fw, state);
	result = lead(fw, AL_BOOT);
	result = result == EXIT_CODE_OK ? write_image(fw) : result;
	result = result == EXIT_CODE_OK ? lead_back(fw, AL_INIT) : result;
	result = result == EXIT_CODE_OK ? lead_back(fw, AL_PREOP) : result;
	if (result != EXIT_CODE_OK) {
		return result;
	}
	fw->after = read_versions(fw, AL_PREOP);
	return state == AL_INIT ? lead(fw, AL_INIT) : EXIT_CODE_OK;
}

/* --- what it shows --- */

static void put_versions(struct json *js, const char *name, const struct versions *v)
{
	json_object_begin(js, name);
	if (v->text[0] != '\0') {
		json_text(js, "version", v->text);
	} else {
		json_null(js, "version");
	}
	if (v->revision != 0) {
		json_u64(js, "sii_revision", v->revision);
	} else {
		json_null(js, "sii_revision");
	}
	json_object_end(js);
}

static void show_json(const struct firmware *fw)
{
	struct json js;

	json_init(&js, stdout);
	json_object_begin(&js, NULL);
	json_u64(&js, "slave", fw->slave_pos);
	json_text(&js, "name", fw->slave_name);
	json_text(&js, "file", fw->write.name);
	json_u64(&js, "length", fw->image_len);
	put_versions(&js, "before", &fw->before);
	put_versions(&js, "after", &fw->after);
	json_text(&js, "state", al_state_to_str(state_now(fw)));
	json_object_end(&js);
	json_end_line(&js);
}

static void show_text(const struct firmware *fw)
{
	static const char unknown[] = "not known";

	printf("%s: %zu bytes written\n", fw->slave_name, fw->image_len);
	printf("version       %s -> %s\n", fw->before.text[0] != '\0' ? fw->before.text : unknown,
	       fw->after.text[0] != '\0' ? fw->after.text : unknown);
	printf("SII revision  0x%08x -> 0x%08x\n", fw->before.revision, fw->after.revision);
	printf("state         %s\n", al_state_to_str(state_now(fw)));
}

static enum exit_code find_slave(struct firmware *fw, const char *text)
{
	const struct status_page *page;
	enum exit_code result = source_status(fw->cli, &page);

	if (result != EXIT_CODE_OK) {
		return result;
	}
	result = source_find_slave(fw->cli, page, text, &fw->slave_pos);
	if (result == EXIT_CODE_OK) {
		struct slave_info info = source_slave(page, fw->slave_pos);

		memcpy(fw->slave_name, info.name, sizeof(fw->slave_name));
	}
	source_status_close(page);
	return result;
}

static enum exit_code run(struct firmware *fw, const struct args *args)
{
	enum exit_code result = foe_name(fw->cli, fw->name, args->operands[1], &fw->write);

	result = result == EXIT_CODE_OK
			 ? file_read(fw->cli, args->operands[1], ADMIN_TRANSFER_BYTES, &fw->image,
				     &fw->image_len)
			 : result;
	result = result == EXIT_CODE_OK ? find_slave(fw, args->operands[0]) : result;
	if (result != EXIT_CODE_OK) {
		return result;
	}
	fw->write.verb = ADMIN_FOE_WRITE;
	fw->write.slave_pos = fw->slave_pos;
	fw->write.argument[0] = (uint32_t)fw->password.value;
	result = update(fw);
	if (result == EXIT_CODE_OK && fw->is_json) {
		show_json(fw);
	} else if (result == EXIT_CODE_OK) {
		show_text(fw);
	}
	return result;
}

enum exit_code verb_firmware(struct cli *cli, int argc, char **argv)
{
	struct firmware fw = { .cli = cli, .password = { .high = UINT32_MAX } };
	const struct args_option options[] = {
		{ "name", 'n', args_text, &fw.name, "NAME", "of the file at the slave" },
		{ "password", 0, args_integer, &fw.password, "NUMBER", "that the slave asks for" },
		{ "json", 0, args_flag, &fw.is_json, NULL, "the result as a JSON object" },
	};
	struct args args = {
		.options = options, .option_count = 3, .operands_min = 2, .operands_max = 2
	};
	enum exit_code result;

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	stop_catch(5 * NS_PER_S, NULL);
	result = run(&fw, &args);
	free(fw.image);
	return result;
}
