/* SPDX-License-Identifier: MIT */
#include "coe.h"

#include "objects.h"

enum coe_layout {
	COE_HEADER = 2, /* number, service << 12 */
	SDO_HEADER = 8, /* command, index 2, subindex, 4 of data or size */
	SDO_INDEX = 3,
	SDO_SUBINDEX = 5,
	SDO_DATA = 6,
	SDO_NORMAL_DATA = 10,
	COE_SERVICE_SDO_REQUEST = 2,
	COE_SERVICE_SDO_RESPONSE = 3
};

enum sdo_command {
	SDO_DOWNLOAD_REQUEST = 1, /* client command specifier, bits 7:5 */
	SDO_UPLOAD_REQUEST = 2,
	SDO_ABORT_REQUEST = 4,
	SDO_SIZE_INDICATED = 0x01,
	SDO_EXPEDITED = 0x02,
	SDO_COMPLETE = 0x10,
	SDO_UPLOAD_RESPONSE = 0x40,
	SDO_DOWNLOAD_RESPONSE = 0x60,
	SDO_ABORT = 0x80
};

static void put_header(octet_t *answer, const octet_t *request, unsigned service, unsigned command)
{
	uint16_t i;

	octets_put16(answer, (uint16_t)(service << 12));
	answer[COE_HEADER] = OCTET(command);
	for (i = SDO_INDEX; i <= SDO_SUBINDEX; i++) {
		answer[i] = request[i];
	}
	octets_put32(answer + SDO_DATA, 0);
}

/* An abort is an SDO *request* (service 2) of the slave with command 0x80. */
static uint16_t put_abort(octet_t *answer, const octet_t *request, uint32_t code)
{
	put_header(answer, request, COE_SERVICE_SDO_REQUEST, SDO_ABORT);
	octets_put32(answer + SDO_DATA, code);
	return COE_HEADER + SDO_HEADER;
}

/* Up to 4 octets go in the header (expedited), more behind it (normal). */
static uint16_t put_upload(octet_t *answer, const octet_t *request, const octet_t *data,
			   uint16_t len)
{
	int is_short = len >= 1 && len <= 4;
	octet_t *to = answer + (is_short ? SDO_DATA : SDO_NORMAL_DATA);
	unsigned command = SDO_UPLOAD_RESPONSE | SDO_SIZE_INDICATED;
	uint16_t i;

	if (is_short) {
		command |= SDO_EXPEDITED | (4u - len) << 2;
	}
	put_header(answer, request, COE_SERVICE_SDO_RESPONSE, command);
	if (!is_short) {
		octets_put32(answer + SDO_DATA, len);
	}
	for (i = 0; i < len; i++) {
		to[i] = data[i];
	}
	return (uint16_t)(COE_HEADER + SDO_HEADER + (is_short ? 0u : len));
}

static uint32_t find(const octet_t *request, const struct piccolo_object **ret_object)
{
	if (request[COE_HEADER] & SDO_COMPLETE) {
		return ABORT_UNSUPPORTED_ACCESS;
	}
	return piccolo_object_find(octets_get16(request + SDO_INDEX), request[SDO_SUBINDEX],
				   ret_object);
}

static uint16_t upload(struct piccolo *p, const octet_t *request, octet_t *answer)
{
	const struct piccolo_object *object;
	octet_t data[OBJECT_OCTETS_MAX];
	uint32_t abort = find(request, &object);

	if (abort != ABORT_NONE) {
		return put_abort(answer, request, abort);
	}
	return put_upload(answer, request, data, piccolo_object_read(p, object, data));
}

static uint32_t write_object(struct piccolo *p, const octet_t *request, uint16_t request_len)
{
	const struct piccolo_object *object;
	unsigned command = request[COE_HEADER];
	uint32_t abort = find(request, &object);
	uint32_t len;

	if (abort != ABORT_NONE) {
		return abort;
	}
	if ((command & SDO_EXPEDITED) == 0) {
		len = octets_get32(request + SDO_DATA);
		if (len > (uint32_t)(request_len - SDO_NORMAL_DATA)) {
			/* the rest would come in segments: longer than any object here */
			return object->access == ACCESS_RO ? ABORT_READ_ONLY : ABORT_LENGTH;
		}
		return piccolo_object_write(p, object, request + SDO_NORMAL_DATA, len);
	}
	len = piccolo_type_octets(object->type); /* no size given: as long as the object */
	if (command & SDO_SIZE_INDICATED) {
		len = 4u - (command >> 2 & 3u);
	}
	if (len > 4) {
		return object->access == ACCESS_RO ? ABORT_READ_ONLY : ABORT_LENGTH;
	}
	return piccolo_object_write(p, object, request + SDO_DATA, len);
}

static uint16_t download(struct piccolo *p, const octet_t *request, uint16_t len, octet_t *answer)
{
	uint32_t abort = write_object(p, request, len);

	if (abort != ABORT_NONE) {
		return put_abort(answer, request, abort);
	}
	put_header(answer, request, COE_SERVICE_SDO_RESPONSE, SDO_DOWNLOAD_RESPONSE);
	return COE_HEADER + SDO_HEADER;
}

enum piccolo_mailbox_error piccolo_coe(struct piccolo *p, const octet_t *request, uint16_t len,
				       octet_t *answer, uint16_t *ret_len)
{
	if (len < COE_HEADER) {
		return MAILBOX_SIZE_TOO_SHORT;
	}
	if ((unsigned)octets_get16(request) >> 12 != COE_SERVICE_SDO_REQUEST) {
		return MAILBOX_SERVICE_NOT_SUPPORTED;
	}
	if (len < COE_HEADER + SDO_HEADER) {
		return MAILBOX_SIZE_TOO_SHORT;
	}
	switch ((unsigned)request[COE_HEADER] >> 5) {
	case SDO_DOWNLOAD_REQUEST:
		*ret_len = download(p, request, len, answer);
		break;
	case SDO_UPLOAD_REQUEST:
		*ret_len = upload(p, request, answer);
		break;
	case SDO_ABORT_REQUEST:
		*ret_len = 0;
		break;
	default: /* segments, or nothing known */
		*ret_len = put_abort(answer, request, ABORT_COMMAND);
		break;
	}
	return MAILBOX_OK;
}
