/* SPDX-License-Identifier: MIT */
/*
 * Registers of an EtherCAT slave controller, named as the ET1100 data sheet names them
 * (section II, register description). Addresses are bytes in the ESC's 64 KiB space; multi-byte
 * registers are little-endian.
 */
#ifndef WIRE_ESC_REG_H
#define WIRE_ESC_REG_H

enum esc_reg {
	ESC_REG_TYPE = 0x0000,
	ESC_REG_REVISION = 0x0001,
	ESC_REG_BUILD = 0x0002, /* 2 */
	ESC_REG_FMMU_COUNT = 0x0004,
	ESC_REG_SM_COUNT = 0x0005,
	ESC_REG_RAM_SIZE = 0x0006,        /* KiB */
	ESC_REG_PORT_DESCRIPTOR = 0x0007, /* 2 bits a port */
	ESC_REG_FEATURES = 0x0008, /* 2; bit 0 FMMUs map bytes only, bit 2 DC, bit 3 DC 64 bit, bit
				      9 no LRW */
	ESC_REG_STATION_ADDRESS = 0x0010, /* 2 */
	ESC_REG_STATION_ALIAS = 0x0012,   /* 2 */
	ESC_REG_WRITE_ENABLE = 0x0020,
	ESC_REG_WRITE_PROTECT = 0x0021,
	ESC_REG_ESC_WRITE_ENABLE = 0x0030,
	ESC_REG_ESC_WRITE_PROTECT = 0x0031,
	ESC_REG_RESET_ECAT = 0x0040,
	ESC_REG_RESET_PDI = 0x0041,
	ESC_REG_DL_CONTROL = 0x0100,     /* 4; bit 24 station alias enable */
	ESC_REG_DL_STATUS = 0x0110,      /* 2 */
	ESC_REG_AL_CONTROL = 0x0120,     /* 2 */
	ESC_REG_AL_STATUS = 0x0130,      /* 2 */
	ESC_REG_AL_STATUS_CODE = 0x0134, /* 2 */
	ESC_REG_PDI_CONTROL = 0x0140,
	ESC_REG_ESC_CONFIG = 0x0141,
	ESC_REG_PDI_CONFIG = 0x0150, /* 4 */
	ESC_REG_SYNC_LATCH_CONFIG = 0x0151,
	ESC_REG_ECAT_EVENT_MASK = 0x0200,    /* 2 */
	ESC_REG_AL_EVENT_MASK = 0x0204,      /* 4 */
	ESC_REG_ECAT_EVENT_REQUEST = 0x0210, /* 2 */
	ESC_REG_AL_EVENT_REQUEST = 0x0220,   /* 4 */
	ESC_REG_RX_ERROR_COUNTER = 0x0300,   /* 2 a port: invalid frame, RX error */
	ESC_REG_FORWARDED_RX_ERROR = 0x0308, /* 1 a port */
	ESC_REG_ECAT_PU_ERROR = 0x030c,
	ESC_REG_PDI_ERROR = 0x030d,
	ESC_REG_LOST_LINK_COUNTER = 0x0310,  /* 1 a port */
	ESC_REG_WATCHDOG_DIVIDER = 0x0400,   /* 2; basic increment (n + 2) * 40 ns */
	ESC_REG_WATCHDOG_TIME_PDI = 0x0410,  /* 2 */
	ESC_REG_WATCHDOG_TIME_PD = 0x0420,   /* 2; process data (SM) watchdog */
	ESC_REG_WATCHDOG_STATUS_PD = 0x0440, /* 2; bit 0: not expired */
	ESC_REG_WATCHDOG_COUNTER_PD = 0x0442,
	ESC_REG_WATCHDOG_COUNTER_PDI = 0x0443,
	ESC_REG_EEPROM_CONFIG = 0x0500, /* bit 0: PDI owns the EEPROM */
	ESC_REG_EEPROM_PDI_ACCESS = 0x0501,
	ESC_REG_EEPROM_CONTROL = 0x0502, /* 2 */
	ESC_REG_EEPROM_ADDRESS = 0x0504, /* 4; words */
	ESC_REG_EEPROM_DATA = 0x0508,    /* 4 or 8 */
	ESC_REG_MII_CONTROL = 0x0510,
	ESC_REG_FMMU = 0x0600,                   /* 16 each */
	ESC_REG_SM = 0x0800,                     /* 8 each */
	ESC_REG_DC_RECEIVE_TIME_PORT = 0x0900,   /* 4 a port; writing the first latches all */
	ESC_REG_DC_SYSTEM_TIME = 0x0910,         /* 8 */
	ESC_REG_DC_RECEIVE_TIME_PU = 0x0918,     /* 8 */
	ESC_REG_DC_SYSTEM_TIME_OFFSET = 0x0920,  /* 8 */
	ESC_REG_DC_SYSTEM_TIME_DELAY = 0x0928,   /* 4 */
	ESC_REG_DC_SYSTEM_TIME_DIFF = 0x092c,    /* 4; sign and magnitude */
	ESC_REG_DC_SPEED_COUNTER_START = 0x0930, /* 2 */
	ESC_REG_DC_SPEED_COUNTER_DIFF = 0x0932,  /* 2 */
	ESC_REG_DC_TIME_FILTER = 0x0934,
	ESC_REG_DC_SPEED_FILTER = 0x0935,
	ESC_REG_DC_RECEIVE_LATCH_MODE = 0x0936,
	ESC_REG_DC_CYCLIC_CONTROL = 0x0980, /* bit 0: SYNC unit belongs to the PDI */
	ESC_REG_DC_ACTIVATION = 0x0981,     /* bit 0 cyclic unit, bit 1 SYNC0, bit 2 SYNC1 */
	ESC_REG_DC_PULSE_LENGTH = 0x0982,   /* 2; 10 ns, from SII */
	ESC_REG_DC_ACTIVATION_STATUS = 0x0984,
	ESC_REG_DC_SYNC0_STATUS = 0x098e,
	ESC_REG_DC_SYNC1_STATUS = 0x098f,
	ESC_REG_DC_START_TIME = 0x0990,   /* 8; reads the time of the next SYNC0 */
	ESC_REG_DC_NEXT_SYNC1 = 0x0998,   /* 8 */
	ESC_REG_DC_SYNC0_CYCLE = 0x09a0,  /* 4; 0: one shot */
	ESC_REG_DC_SYNC1_CYCLE = 0x09a4,  /* 4 */
	ESC_REG_DIGITAL_OUTPUTS = 0x0f00, /* 4; of a chip with a digital PDI */
	ESC_REG_GENERAL_OUTPUTS = 0x0f10, /* 8; and 8 of inputs behind them */
	ESC_REG_USER_RAM = 0x0f80,        /* 128 bytes */
	ESC_REG_PROCESS_RAM = 0x1000,
};

enum esc_size { ESC_FMMU_BYTES = 16, ESC_SM_BYTES = 8, ESC_PORTS = 4 };

/* Bits of ESC_REG_FEATURES. */
enum esc_feature {
	ESC_FEATURE_FMMU_BYTES = 0x0001, /* FMMUs map bytes only */
	ESC_FEATURE_DC = 0x0004,
	ESC_FEATURE_DC_64BIT = 0x0008,
	ESC_FEATURE_NO_LRW = 0x0200, /* LRW is not supported */
};

#endif
