/* SPDX-License-Identifier: MIT */
#include "devices/soe_server.h"

#include <string.h>

#include "base/bytes.h"
#include "wire/soe.h"

enum { COMMAND_SET = 3, STATE_EXECUTED = 3, STATE_RUNS = 7, TABLE_ITEMS = 300 };

struct idn {
	uint16_t number;
	const char *name;
	const char *unit;
	enum soe_length length;
	enum soe_format format;
	uint32_t min;
	uint32_t max; /* both 0: none */
	uint8_t is_writable;
	uint8_t is_command;
};

static const struct idn idns[SOE_SERVER_IDNS] = {
	{ SOE_IDN_CYCLE, "Control unit cycle time", "us", SOE_LENGTH_2, SOE_FORMAT_UNSIGNED, 250,
	  10000, 1, 0 },
	{ SOE_IDN_ALL, "IDN list of all operation data", "", SOE_LENGTH_LIST_2, SOE_FORMAT_IDN, 0,
	  0, 0, 0 },
	{ SOE_IDN_VERSION, "Manufacturer version", "", SOE_LENGTH_LIST_1, SOE_FORMAT_TEXT, 0, 0, 0,
	  0 },
	{ SOE_IDN_VELOCITY, "Velocity feedback value 1", "1/min", SOE_LENGTH_4, SOE_FORMAT_SIGNED,
	  0, 0, 0, 0 },
	{ SOE_IDN_RESET, "Reset class 1 diagnostic", "", SOE_LENGTH_2, SOE_FORMAT_BINARY, 0, 0, 1,
	  1 },
	{ SOE_IDN_TABLE, "Table", "", SOE_LENGTH_LIST_4, SOE_FORMAT_UNSIGNED, 0, 0, 1, 0 },
};

static uint32_t attribute_of(const struct idn *idn)
{
	return (uint32_t)idn->length << SOE_LENGTH_SHIFT |
	       (uint32_t)idn->format << SOE_FORMAT_SHIFT | (idn->is_command ? SOE_IS_COMMAND : 0) |
	       1;
}

static void put_number(struct soe_value *v, uint32_t number, size_t bytes)
{
	put_le32(v->bytes, number);
	v->len = bytes;
}

static void put_list(struct soe_value *v, size_t bytes)
{
	put_le16(v->bytes, (uint16_t)bytes);
	put_le16(v->bytes + 2, (uint16_t)bytes);
	v->len = SOE_LIST_HEADER_BYTES + bytes;
}

static uint8_t *list_of(struct soe_value *v)
{
	return v->bytes + SOE_LIST_HEADER_BYTES;
}

void soe_server_reset(struct soe_server *s)
{
	static const char version[] = "ecdaq simulated drive 1.0";

	memset(s, 0, sizeof(*s));
	put_number(&s->value[0], 1000, 2);
	for (unsigned i = 0; i < SOE_SERVER_IDNS; i++) {
		put_le16(list_of(&s->value[1]) + 2 * (size_t)i, idns[i].number);
	}
	put_list(&s->value[1], 2 * (size_t)SOE_SERVER_IDNS);
	memcpy(list_of(&s->value[2]), version, sizeof(version) - 1);
	put_list(&s->value[2], sizeof(version) - 1);
	put_number(&s->value[3], (uint32_t)-1234, 4);
	put_number(&s->value[4], 0, 2);
	for (uint32_t i = 0; i < TABLE_ITEMS; i++) {
		put_le32(list_of(&s->value[5]) + 4 * (size_t)i, i * i);
	}
	put_list(&s->value[5], 4 * (size_t)TABLE_ITEMS);
}

static int find(uint16_t number)
{
	for (int i = 0; i < SOE_SERVER_IDNS; i++) {
		if (idns[i].number == number) {
			return i;
		}
	}
	return -1;
}

static size_t answer_error(const struct soe_server *s, const struct mailbox_call *call,
			   const struct soe_message *m, enum soe_error error)
{
	uint8_t code[SOE_ERROR_BYTES];

	put_le16(code, (uint16_t)error);
	return soe_format(&(struct soe_message){ .operation = (uint8_t)(m->operation + 1),
						 .drive = s->drive,
						 .is_error = 1,
						 .elements = m->elements,
						 .idn = m->idn,
						 .body = code,
						 .body_len = sizeof(code) },
			  call->answer, call->capacity);
}

/* --- read --- */

static void append(struct soe_server *s, const void *bytes, size_t len)
{
	memcpy(s->outgoing + s->outgoing_len, bytes, len);
	s->outgoing_len += len;
}

static void append_text(struct soe_server *s, const char *text)
{
	uint8_t head[SOE_LIST_HEADER_BYTES];

	put_le16(head, (uint16_t)strlen(text));
	put_le16(head + 2, (uint16_t)strlen(text));
	append(s, head, sizeof(head));
	append(s, text, strlen(text));
}

static void append_number(struct soe_server *s, uint32_t number, size_t bytes)
{
	uint8_t le[4];

	put_le32(le, number);
	append(s, le, bytes);
}

static void gather(struct soe_server *s, int i, uint8_t elements)
{
	const struct idn *idn = &idns[i];
	size_t bytes = soe_value_bytes(attribute_of(idn));

	s->outgoing_len = s->outgoing_pos = 0;
	if (elements & SOE_ELEMENT_STATE) {
		append_number(s, s->state[i], 2);
	}
	if (elements & SOE_ELEMENT_NAME) {
		append_text(s, idn->name);
	}
	if (elements & SOE_ELEMENT_ATTRIBUTE) {
		append_number(s, attribute_of(idn), 4);
	}
	if (elements & SOE_ELEMENT_UNIT) {
		append_text(s, idn->unit);
	}
	if (elements & SOE_ELEMENT_MIN) {
		append_number(s, idn->min, bytes);
	}
	if (elements & SOE_ELEMENT_MAX) {
		append_number(s, idn->max, bytes);
	}
	if (elements & SOE_ELEMENT_VALUE) {
		append(s, s->value[i].bytes, s->value[i].len);
	}
}

static size_t give_fragment(struct soe_server *s, const struct mailbox_call *call)
{
	size_t room = call->capacity > SOE_HEADER_BYTES ? call->capacity - SOE_HEADER_BYTES : 1;
	size_t left = s->outgoing_len - s->outgoing_pos;
	size_t now = left < room ? left : room;
	size_t mails_left = (left - now) / room + ((left - now) % room > 0);
	struct soe_message m = { .operation = SOE_READ_RESPONSE,
				 .drive = s->drive,
				 .has_more = left > room,
				 .elements = s->outgoing_elements,
				 .idn = s->outgoing_idn,
				 .fragments_left = (uint16_t)mails_left,
				 .body = s->outgoing + s->outgoing_pos,
				 .body_len = now };

	s->outgoing_pos += now;
	return soe_format(&m, call->answer, call->capacity);
}

static size_t answer_read(struct soe_server *s, const struct mailbox_call *call,
			  const struct soe_message *m)
{
	int i = find(m->idn);

	s->outgoing_len = s->outgoing_pos = 0;
	if (i < 0) {
		return answer_error(s, call, m, SOE_ERROR_NO_IDN);
	}
	if (m->elements == 0 || (m->elements & SOE_ELEMENT_DEFAULT)) {
		return answer_error(s, call, m, SOE_ERROR_NO_ELEMENT);
	}
	s->outgoing_idn = m->idn;
	s->outgoing_elements = m->elements;
	gather(s, i, m->elements);
	return give_fragment(s, call);
}

/* --- write --- */

static enum soe_error check_list(const struct soe_server *s)
{
	return s->incoming_len < SOE_LIST_HEADER_BYTES ||
			       get_le16(s->incoming) != s->incoming_len - SOE_LIST_HEADER_BYTES
		       ? SOE_ERROR_INVALID
		       : SOE_ERROR_NONE;
}

static enum soe_error check_number(const struct soe_server *s, const struct idn *idn)
{
	size_t bytes = soe_value_bytes(attribute_of(idn));
	uint32_t number = 0;

	if (s->incoming_len != bytes) {
		return s->incoming_len < bytes ? SOE_ERROR_TOO_SHORT : SOE_ERROR_TOO_LONG;
	}
	for (size_t i = 0; i < bytes; i++) {
		number |= (uint32_t)s->incoming[i] << (8 * i);
	}
	if (idn->max > idn->min && number < idn->min) {
		return SOE_ERROR_BELOW_MIN;
	}
	return idn->max > idn->min && number > idn->max ? SOE_ERROR_ABOVE_MAX : SOE_ERROR_NONE;
}

static enum soe_error check_write(const struct soe_server *s, const struct soe_message *m, int i)
{
	if (i < 0) {
		return SOE_ERROR_NO_IDN;
	}
	if (m->elements != SOE_ELEMENT_VALUE) {
		return SOE_ERROR_NO_ELEMENT;
	}
	if (!idns[i].is_writable) {
		return SOE_ERROR_READ_ONLY;
	}
	if (s->is_too_long) {
		return SOE_ERROR_TOO_LONG;
	}
	return soe_is_list(attribute_of(&idns[i])) ? check_list(s) : check_number(s, &idns[i]);
}

static size_t answer_write(struct soe_server *s, const struct mailbox_call *call,
			   const struct soe_message *m)
{
	int i = find(m->idn);
	enum soe_error error;

	if (s->incoming_len > 0 && m->fragments_left + 1 != s->incoming_left) {
		s->incoming_len = 0; /* another write: the master has given up the one before */
		s->is_too_long = 0;
	}
	s->incoming_left = m->fragments_left;
	if (m->body_len > sizeof(s->incoming) - s->incoming_len) {
		s->is_too_long = 1;
	} else {
		memcpy(s->incoming + s->incoming_len, m->body, m->body_len);
		s->incoming_len += m->body_len;
	}
	if (m->has_more) {
		return 0;
	}
	error = check_write(s, m, i);
	if (error == SOE_ERROR_NONE) {
		memcpy(s->value[i].bytes, s->incoming, s->incoming_len);
		s->value[i].len = s->incoming_len;
	}
	if (error == SOE_ERROR_NONE && idns[i].is_command && get_le16(s->incoming) == COMMAND_SET) {
		s->state[i] = STATE_RUNS;
		s->command_until_ns = call->t_ns + SOE_COMMAND_NS;
	}
	s->incoming_len = 0;
	s->is_too_long = 0;
	if (error != SOE_ERROR_NONE) {
		return answer_error(s, call, m, error);
	}
	return soe_format(&(struct soe_message){ .operation = SOE_WRITE_RESPONSE,
						 .drive = s->drive,
						 .elements = m->elements,
						 .idn = m->idn },
			  call->answer, call->capacity);
}

/* --- public --- */

size_t soe_server_answer(void *ctx, const struct mailbox_call *call)
{
	struct soe_server *s = ctx;
	struct soe_message m;

	if (soe_parse(call->request, call->request_len, &m) < 0) {
		return 0;
	}
	s->drive = m.drive;
	if (m.operation == SOE_READ) {
		return answer_read(s, call, &m);
	}
	return m.operation == SOE_WRITE ? answer_write(s, call, &m) : 0;
}

/* The end of a procedure command comes as a notification of its data state. */
static size_t notify(struct soe_server *s, const struct mailbox_call *call)
{
	int i = find(SOE_IDN_RESET);
	uint8_t state[2];

	s->command_until_ns = 0;
	s->state[i] = STATE_EXECUTED;
	put_le16(state, STATE_EXECUTED);
	return soe_format(&(struct soe_message){ .operation = SOE_NOTIFICATION,
						 .drive = s->drive,
						 .elements = SOE_ELEMENT_STATE,
						 .idn = SOE_IDN_RESET,
						 .body = state,
						 .body_len = sizeof(state) },
			  call->answer, call->capacity);
}

size_t soe_server_next(void *ctx, const struct mailbox_call *call)
{
	struct soe_server *s = ctx;

	if (s->outgoing_pos < s->outgoing_len) {
		return give_fragment(s, call);
	}
	return s->command_until_ns != 0 && call->t_ns >= s->command_until_ns ? notify(s, call) : 0;
}
