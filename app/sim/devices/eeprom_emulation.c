/* SPDX-License-Identifier: MIT */
#include "devices/eeprom_emulation.h"

#include <string.h>

#include "base/bytes.h"
#include "wire/esc_reg.h"

enum {
	COMMAND = 0x0700,
	READ = 0x0100,
	WRITE = 0x0200,
	ERROR = 0x2000,
	DATA_AT = 6, /* of 0x0502 to 0x0509 */
	DATA_BYTES = 8,
};

void eeprom_emulation_run(struct esc *esc, int64_t t_ns)
{
	uint8_t request[DATA_AT + DATA_BYTES];
	uint8_t status[2] = { 0, 0 };
	uint16_t command;
	uint64_t at;

	if ((esc->al_event & ESC_AL_EVENT_EEPROM) == 0) {
		return;
	}
	esc_pdi_read(esc, t_ns, ESC_REG_EEPROM_CONTROL, request, sizeof(request));
	command = get_le16(request) & COMMAND;
	at = (uint64_t)get_le32(request + 2) * 2;
	if (command == READ) {
		uint8_t data[DATA_BYTES];

		memset(data, 0xff, sizeof(data));
		for (unsigned i = 0; i < sizeof(data) && at + i < esc->sii_bytes; i++) {
			data[i] = esc->sii[at + i];
		}
		esc_pdi_write(esc, t_ns, ESC_REG_EEPROM_DATA, data, sizeof(data));
	} else if (command == WRITE && at + 2 <= esc->sii_bytes) {
		memcpy(esc->sii + at, request + DATA_AT, 2);
	} else if (command == WRITE) {
		put_le16(status, ERROR);
	}
	esc_pdi_write(esc, t_ns, ESC_REG_EEPROM_CONTROL, status, sizeof(status));
}
