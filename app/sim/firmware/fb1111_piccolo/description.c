/* SPDX-License-Identifier: MIT */
#include "description.h"

static const struct piccolo_entry rx_entries[PICCOLO_RX_ENTRIES] = {
	{ 0x7000, 1, 1, PICCOLO_BOOL, "led" },
	{ 0x0000, 0, 7, PICCOLO_PADDING, 0 },
	{ 0x7000, 2, 64, PICCOLO_ULINT, "oneshot_time" },
};

static const struct piccolo_entry tx_entries[PICCOLO_TX_ENTRIES] = {
	{ 0x6000, 1, 16, PICCOLO_UINT, "adc" },
	{ 0x6000, 2, 16, PICCOLO_UINT, "counter" },
	{ 0x6000, 3, 64, PICCOLO_ULINT, "sample_time" },
	{ 0x6000, 4, 8, PICCOLO_USINT, "status" },
};

const struct piccolo_description piccolo_description = {
	.vendor_name = "Beckhoff Automation GmbH & Co. KG",
	.order = "FB1111-0141",
	.name = "FB1111-Piccolo",
	.group = "FB1111",
	.group_name = "FB1111 piggyback boards",
	.hardware_version = "FB1111-0141",
	.software_version = "1.0.0",

	/*
	 * 0x0140 = 0x05 SPI slave; 0x0141 = 0x0e enhanced link detection, DC SYNC and LATCH units on;
	 * 0x0150 = 0x03 SPI mode 3; 0x0151 = 0x06 SYNC0 pin is an output, push-pull, active high
	 * (the vendor's file has 0x00 there, which makes the pin a LATCH0 input);
	 * 0x0982 = 5000 * 10 ns = 50 us pulse.
	 */
	.config = { 0x05, 0x0e, 0x03, 0x06, 0x88, 0x13 },

	/* 0x64: as the vendor's 0x24, and the watchdog is triggered, so a dead master is noticed. */
	.sm = {
		{ 0x1000, PICCOLO_MAILBOX_OCTETS, 0x26, 1, "MBoxOut" },
		{ 0x1080, PICCOLO_MAILBOX_OCTETS, 0x22, 2, "MBoxIn" },
		{ 0x1100, PICCOLO_OUTPUT_OCTETS, 0x64, 3, "Outputs" },
		{ 0x1180, PICCOLO_INPUT_OCTETS, 0x20, 4, "Inputs" },
	},
	.fmmu = {
		{ 1, "Outputs" },
		{ 2, "Inputs" },
		{ 3, "MBoxState" },
	},
	.rx = { 0x1600, PICCOLO_SM_OUTPUTS, PICCOLO_RX_ENTRIES, rx_entries, "Outputs" },
	.tx = { 0x1a00, PICCOLO_SM_INPUTS, PICCOLO_TX_ENTRIES, tx_entries, "Inputs" },

	/*
	 * Periodic: the master owns the SYNC unit and runs SYNC0. One-shot: 0x0980 = 1 gives the unit to
	 * the PDI, and the firmware programs each single shot. Without SYNC0 the board has nothing to
	 * sample, so there is no free-run mode.
	 */
	.dc = {
		{ "DcSync", "Periodic: a sample at every SYNC0", 0x0300, 1 },
		{ "OneShot", "One-shot: a sample at oneshot_time", 0x0001, 0 },
	},
};
