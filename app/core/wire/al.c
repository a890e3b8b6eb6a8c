/* SPDX-License-Identifier: MIT */
#include "wire/al.h"

#include <stddef.h>
#include <stdio.h>

static const struct {
	uint16_t code;
	const char *text;
} codes[] = {
	{ 0x0000, "no error" },
	{ 0x0001, "unspecified error" },
	{ 0x0002, "no memory" },
	{ 0x0003, "invalid device setup" },
	{ 0x0004, "invalid revision" },
	{ 0x0006, "SII/EEPROM information does not match firmware" },
	{ 0x0007, "firmware update not successful" },
	{ 0x000e, "licence error" },
	{ 0x0011, "invalid requested state change" },
	{ 0x0012, "unknown requested state" },
	{ 0x0013, "bootstrap not supported" },
	{ 0x0014, "no valid firmware" },
	{ 0x0015, "invalid mailbox configuration (BOOT)" },
	{ 0x0016, "invalid mailbox configuration (PRE-OP)" },
	{ 0x0017, "invalid SyncManager configuration" },
	{ 0x0018, "no valid inputs available" },
	{ 0x0019, "no valid outputs" },
	{ 0x001a, "synchronisation error" },
	{ 0x001b, "SyncManager watchdog" },
	{ 0x001c, "invalid SyncManager types" },
	{ 0x001d, "invalid output configuration" },
	{ 0x001e, "invalid input configuration" },
	{ 0x001f, "invalid watchdog configuration" },
	{ 0x0020, "slave needs cold start" },
	{ 0x0021, "slave needs INIT" },
	{ 0x0022, "slave needs PRE-OP" },
	{ 0x0023, "slave needs SAFE-OP" },
	{ 0x0024, "invalid input mapping" },
	{ 0x0025, "invalid output mapping" },
	{ 0x0026, "inconsistent settings" },
	{ 0x0027, "free run not supported" },
	{ 0x0028, "SyncManager synchronisation not supported" },
	{ 0x0029, "free run needs three-buffer mode" },
	{ 0x002a, "background watchdog" },
	{ 0x002b, "no valid inputs and outputs" },
	{ 0x002c, "fatal synchronisation error" },
	{ 0x002d, "no synchronisation error: SYNC not received" },
	{ 0x002e, "invalid input FMMU configuration" },
	{ 0x0030, "invalid DC SYNC configuration" },
	{ 0x0031, "invalid DC latch configuration" },
	{ 0x0032, "PLL error" },
	{ 0x0033, "DC SYNC I/O error" },
	{ 0x0034, "DC SYNC time-out error" },
	{ 0x0035, "DC invalid SYNC cycle time" },
	{ 0x0036, "DC SYNC0 cycle time" },
	{ 0x0037, "DC SYNC1 cycle time" },
	{ 0x0041, "mailbox AoE" },
	{ 0x0042, "mailbox EoE" },
	{ 0x0043, "mailbox CoE" },
	{ 0x0044, "mailbox FoE" },
	{ 0x0045, "mailbox SoE" },
	{ 0x004f, "mailbox VoE" },
	{ 0x0050, "EEPROM no access" },
	{ 0x0051, "EEPROM error" },
	{ 0x0052, "external hardware not ready" },
	{ 0x0060, "slave restarted locally" },
	{ 0x0061, "device identification value updated" },
	{ 0x0070, "detected module list does not match" },
	{ 0x00f0, "application controller available" },
};

const char *al_state_to_str(uint16_t al_status)
{
	switch (al_status & AL_STATE_MASK) {
	case AL_INIT:
		return "INIT";
	case AL_PREOP:
		return "PRE-OP";
	case AL_BOOT:
		return "BOOT";
	case AL_SAFEOP:
		return "SAFE-OP";
	case AL_OP:
		return "OP";
	default:
		return "none";
	}
}

void al_status_format(uint32_t al_status, char *buf, size_t buf_len)
{
	if ((al_status & AL_STATE_MASK) == 0) {
		snprintf(buf, buf_len, "unknown");
		return;
	}
	snprintf(buf, buf_len, "%s%s", al_state_to_str((uint16_t)(al_status & AL_STATE_MASK)),
		 (al_status & AL_ERROR) != 0 ? "+ERROR" : "");
}

const char *al_status_code_to_str(uint16_t code)
{
	for (size_t i = 0; i < sizeof(codes) / sizeof(codes[0]); i++) {
		if (codes[i].code == code) {
			return codes[i].text;
		}
	}
	return "unknown";
}

static const char mapping[] =
	"the PDOs that are assigned (0x1C12, 0x1C13) are not what the slave expects; look: ecdaq "
	"pdo SLAVE; change: slaves[].pdos, start-up SDOs in slaves[].sdo, or the slave's setting";
static const char watchdog[] =
	"no outputs reached the slave for as long as bus.watchdog: frames are lost or late; look: "
	"ecdaq status (frames lost, wake), ecdaq crc, ecdaq doctor; change: cable, machine, or a "
	"longer bus.watchdog; then ecdaq clear";
static const char clocks[] =
	"SYNC0 is off, or not as the slave needs it; look: ecdaq slaves -v SLAVE (SYNC0 cycle, "
	"DC); change: dc.enable, slaves[].assign_activate, cycle.period";
static const char sync_type[] =
	"the synchronisation type (0x1C32:01, 0x1C33:01) is not one of the slave's; look: ecdaq "
	"sdo "
	"read SLAVE 0x1c32:4; change: slaves[].sync_type: write, slaves[].assign_activate";
static const char mailboxes[] = "the mailboxes of the slave's EEPROM are not what its firmware "
				"expects; look: ecdaq sii read "
				"SLAVE; change: the EEPROM, or the firmware";
static const char eeprom[] =
	"look: ecdaq sii read SLAVE; change: the EEPROM's content, or the device";

static const struct {
	uint16_t first;
	uint16_t last;
	const char *text;
} hints[] = {
	{ 0x0015, 0x0016, mailboxes },
	{ 0x0017, 0x0017, mapping },
	{ 0x001a, 0x001a, clocks },
	{ 0x001b, 0x001b, watchdog },
	{ 0x001c, 0x001e, mapping },
	{ 0x001f, 0x001f,
	  "the slave does not take this watchdog; change: bus.watchdog (0s: the slave's own)" },
	{ 0x0020, 0x0020, "switch the slave off and on" },
	{ 0x0024, 0x0025, mapping },
	{ 0x0026, 0x0026, "look: ecdaq sdo list SLAVE; change: start-up SDOs in slaves[].sdo" },
	{ 0x0027, 0x0029, sync_type },
	{ 0x002c, 0x002d, clocks },
	{ 0x0030, 0x0037, clocks },
	{ 0x0050, 0x0051, eeprom },
	{ 0x0070, 0x0070,
	  "the modules that are plugged in are not those configured; look: ecdaq sdo list SLAVE "
	  "(0xF030, 0xF050), ecdaq config diff; change: the modules, or start-up SDOs" },
};

const char *al_status_code_hint(uint16_t code)
{
	for (size_t i = 0; i < sizeof(hints) / sizeof(hints[0]); i++) {
		if (code >= hints[i].first && code <= hints[i].last) {
			return hints[i].text;
		}
	}
	return "";
}
