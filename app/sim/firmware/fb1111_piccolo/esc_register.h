/* SPDX-License-Identifier: MIT */
/*
 * The ET1100's registers that the firmware touches, named as its data sheet (section II) names
 * them. The firmware is self-contained, so it does not include wire/esc_reg.h; a unit test holds
 * both equal.
 */
#ifndef FB1111_PICCOLO_ESC_REGISTER_H
#define FB1111_PICCOLO_ESC_REGISTER_H

enum piccolo_esc_register {
	REG_AL_CONTROL = 0x0120,
	REG_AL_STATUS = 0x0130,
	REG_AL_STATUS_CODE = 0x0134,
	REG_PDI_CONTROL = 0x0140,
	REG_WATCHDOG_STATUS_PD = 0x0440, /* bit 0: not expired */
	REG_SM = 0x0800,                 /* 8 octets each */
	REG_DC_SYSTEM_TIME = 0x0910,
	REG_DC_CYCLIC_CONTROL = 0x0980,
	REG_DC_ACTIVATION = 0x0981,
	REG_DC_START_TIME = 0x0990, /* read: time of the next SYNC0 */
	REG_DC_SYNC0_CYCLE = 0x09a0 /* 0: single shot */
};

enum piccolo_esc_bits {
	/* AL event request 0x0220, handed back in the address phase of every SPI access */
	AL_EVENT_CONTROL = 0x0001,    /* AL control written; cleared by reading 0x0120 */
	AL_EVENT_SM_CHANGED = 0x0010, /* SM activation written; cleared by reading 0x0806 + 8n */
	AL_EVENT_SM0 = 0x0100,
	AL_EVENT_SM2 = 0x0400,

	SM_OFFSET_CONTROL = 4,
	SM_OFFSET_STATUS = 5,
	SM_OFFSET_ACTIVATE = 6,
	SM_OFFSET_PDI_CONTROL = 7,
	SM_OCTETS = 8,
	SM_CONTROL_KIND = 0x0f, /* buffer mode and direction */
	SM_CONTROL_WATCHDOG = 0x40,
	SM_STATUS_MAILBOX_FULL = 0x08,
	SM_ACTIVATE_ENABLE = 0x01,
	SM_ACTIVATE_REPEAT = 0x02, /* repeat request toggle; acknowledged in the PDI control */

	CYCLIC_CONTROL_PDI = 0x01, /* SYNC unit belongs to the PDI */
	ACTIVATION_CYCLIC_SYNC0 = 0x03,

	PDI_SPI_SLAVE = 0x05
};

#endif
