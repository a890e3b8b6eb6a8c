/* SPDX-License-Identifier: MIT */
/* Sections and lists of the file, for the pages and the parser. */
#include "config/option.h"
#include "config/startup.h"

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
	{ "web", "Samples and state for browsers and Foxglove viewers (ecdaq-web); "
		 "doc/reference/web.md." },
	{ "stream", "Samples and events into NATS JetStream (ecdaq-stream); "
		    "doc/reference/stream.md." },
	{ "uplink", "Finished recordings to an object store (ecdaq-uplink); "
		    "doc/reference/uplink.md." },
	{ "sync0", "SYNC0 checked on GPIO lines (ecdaq-sync0); doc/reference/sync0.md." },
};

const size_t option_section_count = sizeof(option_sections) / sizeof(option_sections[0]);

const struct option_list option_lists[OPTION_LISTS] = {
	[OPTION_LIST_SLAVES] = { "slaves", LIMIT_SLAVES, "LIMIT_SLAVES",
				 "Expected slave at each position of the segment, in order. "
				 "Without it, any slaves are accepted.",
				 NULL, 0, NULL },
	[OPTION_LIST_PDOS] = { "slaves[].pdos", CONFIG_LIMIT_PDOS, "CONFIG_LIMIT_PDOS",
			       "PDOs that are assigned to the slave's SyncManagers, in this order, "
			       "by CoE in PRE-OP. Outputs stay as they are if no RxPDO is listed, "
			       "inputs if no TxPDO is. An item is a mapping, or the PDO alone.",
			       "^.+$", 1, NULL },
	[OPTION_LIST_SDOS] = { "slaves[].sdo", CONFIG_LIMIT_SDOS, "CONFIG_LIMIT_SDOS",
			       "Start-up SDOs: objects written to this slave in a transition, in "
			       "this order. An item is a mapping, or one line: "
			       "`\"" STARTUP_LINE_FORM
			       "\"`, with the subindex in hexadecimal and, for complete access, "
			       "`0x8000 complete OCTETS = 01 00`.",
			       STARTUP_LINE_PATTERN, 0, NULL },
	[OPTION_LIST_CHANNELS] = { "slaves[].channels", CONFIG_LIMIT_CHANNELS,
				   "CONFIG_LIMIT_CHANNELS",
				   "Names, units and scales of this slave's channels, applied in "
				   "this order.",
				   NULL, 0, NULL },
	[OPTION_LIST_SLAVE_OUTPUTS] = { "slaves[].outputs", CONFIG_LIMIT_OUTPUTS,
					"CONFIG_LIMIT_OUTPUTS",
					"Items of outputs[] that stand beside their slave: channel "
					"is "
					"the name without the slave's and the dot (`led`). "
					"Requires "
					"slaves[].name. A channel is in one of the two lists only; "
					"the limit is that of both together.",
					NULL, 0, "outputs" },
	[OPTION_LIST_OUTPUTS] = { "outputs", CONFIG_LIMIT_OUTPUTS, "CONFIG_LIMIT_OUTPUTS",
				  "Output channels with rules other than the defaults: owner, "
				  "limits, fail-safe value, timeout.",
				  NULL, 0, NULL },
};
