/* SPDX-License-Identifier: MIT */
#include "esi/nodes.h"

#include <stddef.h>
#include <string.h>

static const struct {
	enum esi_node parent;
	const char *name;
	enum esi_node node;
} nodes[] = {
	{ ESI_NODE_ROOT, "EtherCATInfoList", ESI_NODE_LIST },
	{ ESI_NODE_ROOT, "EtherCATInfo", ESI_NODE_INFO },
	{ ESI_NODE_LIST, "EtherCATInfo", ESI_NODE_INFO },
	{ ESI_NODE_INFO, "Vendor", ESI_NODE_VENDOR },
	{ ESI_NODE_VENDOR, "Id", ESI_NODE_VENDOR_ID },
	{ ESI_NODE_VENDOR, "Name", ESI_NODE_VENDOR_NAME },
	{ ESI_NODE_INFO, "Descriptions", ESI_NODE_DESCRIPTIONS },
	{ ESI_NODE_DESCRIPTIONS, "Groups", ESI_NODE_GROUPS },
	{ ESI_NODE_GROUPS, "Group", ESI_NODE_GROUP },
	{ ESI_NODE_GROUP, "Type", ESI_NODE_GROUP_TYPE },
	{ ESI_NODE_GROUP, "Name", ESI_NODE_GROUP_NAME },
	{ ESI_NODE_DESCRIPTIONS, "Devices", ESI_NODE_DEVICES },
	{ ESI_NODE_DESCRIPTIONS, "Modules", ESI_NODE_MODULES },
	{ ESI_NODE_DEVICES, "Device", ESI_NODE_DEVICE },
	{ ESI_NODE_MODULES, "Module", ESI_NODE_MODULE },
	{ ESI_NODE_DEVICE, "Type", ESI_NODE_TYPE },
	{ ESI_NODE_DEVICE, "Name", ESI_NODE_NAME },
	{ ESI_NODE_DEVICE, "GroupType", ESI_NODE_GROUP_OF },
	{ ESI_NODE_DEVICE, "Info", ESI_NODE_DEVICE_INFO },
	{ ESI_NODE_DEVICE_INFO, "StateMachine", ESI_NODE_STATE_MACHINE },
	{ ESI_NODE_STATE_MACHINE, "Timeout", ESI_NODE_STATE_TIMEOUT },
	{ ESI_NODE_STATE_TIMEOUT, "PreopTimeout", ESI_NODE_PREOP_TIMEOUT },
	{ ESI_NODE_STATE_TIMEOUT, "SafeopOpTimeout", ESI_NODE_SAFEOP_OP_TIMEOUT },
	{ ESI_NODE_STATE_TIMEOUT, "BackToInitTimeout", ESI_NODE_BACK_TO_INIT_TIMEOUT },
	{ ESI_NODE_STATE_TIMEOUT, "BackToSafeopTimeout", ESI_NODE_BACK_TO_SAFEOP_TIMEOUT },
	{ ESI_NODE_DEVICE_INFO, "Mailbox", ESI_NODE_INFO_MAILBOX },
	{ ESI_NODE_INFO_MAILBOX, "Timeout", ESI_NODE_MAILBOX_TIMEOUT },
	{ ESI_NODE_MAILBOX_TIMEOUT, "RequestTimeout", ESI_NODE_REQUEST_TIMEOUT },
	{ ESI_NODE_MAILBOX_TIMEOUT, "ResponseTimeout", ESI_NODE_RESPONSE_TIMEOUT },
	{ ESI_NODE_DEVICE, "Fmmu", ESI_NODE_FMMU },
	{ ESI_NODE_DEVICE, "Sm", ESI_NODE_SM },
	{ ESI_NODE_DEVICE, "RxPdo", ESI_NODE_RX_PDO },
	{ ESI_NODE_DEVICE, "TxPdo", ESI_NODE_TX_PDO },
	{ ESI_NODE_RX_PDO, "Index", ESI_NODE_PDO_INDEX },
	{ ESI_NODE_RX_PDO, "Name", ESI_NODE_PDO_NAME },
	{ ESI_NODE_RX_PDO, "Exclude", ESI_NODE_PDO_EXCLUDE },
	{ ESI_NODE_RX_PDO, "Entry", ESI_NODE_ENTRY },
	{ ESI_NODE_ENTRY, "Index", ESI_NODE_ENTRY_INDEX },
	{ ESI_NODE_ENTRY, "SubIndex", ESI_NODE_ENTRY_SUBINDEX },
	{ ESI_NODE_ENTRY, "BitLen", ESI_NODE_ENTRY_BITS },
	{ ESI_NODE_ENTRY, "Name", ESI_NODE_ENTRY_NAME },
	{ ESI_NODE_ENTRY, "DataType", ESI_NODE_ENTRY_TYPE },
	{ ESI_NODE_DEVICE, "Mailbox", ESI_NODE_MAILBOX },
	{ ESI_NODE_MAILBOX, "AoE", ESI_NODE_AOE },
	{ ESI_NODE_MAILBOX, "EoE", ESI_NODE_EOE },
	{ ESI_NODE_MAILBOX, "CoE", ESI_NODE_COE },
	{ ESI_NODE_MAILBOX, "FoE", ESI_NODE_FOE },
	{ ESI_NODE_MAILBOX, "SoE", ESI_NODE_SOE },
	{ ESI_NODE_MAILBOX, "VoE", ESI_NODE_VOE },
	{ ESI_NODE_COE, "InitCmd", ESI_NODE_COMMAND },
	{ ESI_NODE_COMMAND, "Transition", ESI_NODE_COMMAND_TRANSITION },
	{ ESI_NODE_COMMAND, "Index", ESI_NODE_COMMAND_INDEX },
	{ ESI_NODE_COMMAND, "SubIndex", ESI_NODE_COMMAND_SUBINDEX },
	{ ESI_NODE_COMMAND, "Data", ESI_NODE_COMMAND_DATA },
	{ ESI_NODE_COMMAND, "Comment", ESI_NODE_COMMAND_COMMENT },
	{ ESI_NODE_DEVICE, "Dc", ESI_NODE_DC },
	{ ESI_NODE_DC, "OpMode", ESI_NODE_MODE },
	{ ESI_NODE_MODE, "Name", ESI_NODE_MODE_NAME },
	{ ESI_NODE_MODE, "Desc", ESI_NODE_MODE_TEXT },
	{ ESI_NODE_MODE, "AssignActivate", ESI_NODE_MODE_ACTIVATE },
	{ ESI_NODE_MODE, "CycleTimeSync0", ESI_NODE_MODE_CYCLE0 },
	{ ESI_NODE_MODE, "ShiftTimeSync0", ESI_NODE_MODE_SHIFT0 },
	{ ESI_NODE_MODE, "CycleTimeSync1", ESI_NODE_MODE_CYCLE1 },
	{ ESI_NODE_MODE, "ShiftTimeSync1", ESI_NODE_MODE_SHIFT1 },
	{ ESI_NODE_DEVICE, "Slots", ESI_NODE_SLOTS },
	{ ESI_NODE_SLOTS, "Slot", ESI_NODE_SLOT },
	{ ESI_NODE_SLOT, "Name", ESI_NODE_SLOT_NAME },
	{ ESI_NODE_SLOT, "ModuleIdent", ESI_NODE_SLOT_MODULE },
	{ ESI_NODE_DEVICE, "Eeprom", ESI_NODE_EEPROM },
	{ ESI_NODE_EEPROM, "ByteSize", ESI_NODE_EEPROM_BYTES },
};

/* What has the elements of another one. */
static enum esi_node like(enum esi_node node)
{
	if (node == ESI_NODE_MODULE) {
		return ESI_NODE_DEVICE;
	}
	return node == ESI_NODE_TX_PDO ? ESI_NODE_RX_PDO : node;
}

enum esi_node esi_node_find(enum esi_node parent, const char *name)
{
	parent = like(parent);
	for (size_t i = 0; i < sizeof(nodes) / sizeof(nodes[0]); i++) {
		if (nodes[i].parent == parent && strcmp(nodes[i].name, name) == 0) {
			return nodes[i].node;
		}
	}
	return ESI_NODE_OTHER;
}
