/* SPDX-License-Identifier: MIT */
#include "changes.h"

#include <string.h>

#include "base/bytes.h"
#include "wire/datagram.h"
#include "wire/esc_reg.h"
#include "wire/mailbox.h"

enum { MEMORY_START = 0x1000 };

/* The change that is due for this answer, or NULL. */
static const uint8_t *due(struct changes *c)
{
	const uint8_t *change = c->next;

	if (c->left == 0 || c->passed < change[0]) {
		return NULL;
	}
	c->next += CHANGE_BYTES;
	c->left--;
	c->passed = 0;
	return change;
}

/* 0: it is lost. */
static int change_bytes(struct changes *c, uint8_t *bytes, size_t len)
{
	const uint8_t *change;

	while ((change = due(c)) != NULL) {
		if (change[3] == 0) {
			return 0;
		}
		if (len > 0) {
			bytes[get_le16(change + 1) % len] ^= change[3];
		}
	}
	c->passed++;
	return 1;
}

static int is_meant(const struct changes *c, const struct ecat_datagram *dg)
{
	int is_read = dg->cmd == ECAT_CMD_FPRD || dg->cmd == ECAT_CMD_APRD;

	switch (c->what) {
	case CHANGE_MAIL:
		return is_read && dg->ado >= MEMORY_START && get_le16(dg->wkc) == 1 &&
		       dg->data_len > MAILBOX_HEADER_BYTES &&
		       (dg->data[5] & 0x0f) == MAILBOX_TYPE_COE;
	case CHANGE_EEPROM:
		return is_read && dg->ado >= ESC_REG_EEPROM_CONFIG &&
		       dg->ado < ESC_REG_EEPROM_DATA + 8;
	case CHANGE_AL:
		return is_read && dg->ado == ESC_REG_AL_STATUS;
	case CHANGE_FRAME:
		break;
	}
	return 0;
}

int changes_apply(struct changes *c, uint8_t *frame, size_t len)
{
	struct ecat_datagram dg;
	size_t pos = 0;

	if (c->what == CHANGE_FRAME) {
		return change_bytes(c, frame, len);
	}
	while (ecat_frame_next(frame, len, &pos, &dg) == 1) {
		if (is_meant(c, &dg) &&
		    !change_bytes(c, dg.data, (size_t)dg.data_len + ECAT_WKC_BYTES)) {
			memset(dg.wkc, 0, ECAT_WKC_BYTES);
		}
	}
	return 1;
}
