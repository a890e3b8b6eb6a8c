/* SPDX-License-Identifier: MIT */
/* Sections and lists of the file, for the pages and the parser. */
#include "config/option.h"

const struct option_section option_sections[] = {
	{ "runtime", "Run directory and access." },
	{ "bus", "The EtherCAT segment: interface, supervision, recovery." },
	{ "cycle", "The real-time loop." },
	{ "dc", "Distributed clocks: how the master follows the reference clock." },
	{ "control", "Your own program in the cycle (control.md)." },
	{ "gateway", "Mailboxes of slaves over UDP and TCP (ETG.8200)." },
	{ "eoe", "Ethernet over EtherCAT." },
	{ "ring", "Shared memory between ecdaqd and its readers." },
	{ "record", "Recording to local storage (ecdaq-record)." },
	{ "dds", "Data and commands over DDS (ecdaq-dds)." },
	{ "sync0", "SYNC0 checked on GPIO lines (ecdaq-sync0); doc/reference/sync0.md." },
};

const size_t option_section_count = sizeof(option_sections) / sizeof(option_sections[0]);

const struct option_list option_lists[OPTION_LISTS] = {
	[OPTION_LIST_SLAVES] = { "slaves", LIMIT_SLAVES, "LIMIT_SLAVES",
				 "Expected slave at each position of the segment, in order. "
				 "Without it, any slaves are accepted." },
	[OPTION_LIST_SDOS] = { "slaves[].sdo", CONFIG_LIMIT_SDOS, "CONFIG_LIMIT_SDOS",
			       "Objects written to this slave in PRE-OP, in this order." },
	[OPTION_LIST_CHANNELS] = { "slaves[].channels", CONFIG_LIMIT_CHANNELS,
				   "CONFIG_LIMIT_CHANNELS",
				   "Names, units and scales of this slave's channels, applied in "
				   "this order." },
	[OPTION_LIST_OUTPUTS] = { "outputs", CONFIG_LIMIT_OUTPUTS, "CONFIG_LIMIT_OUTPUTS",
				  "Output channels with rules other than the defaults: owner, "
				  "limits, fail-safe value, timeout." },
};
