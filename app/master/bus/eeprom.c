/* SPDX-License-Identifier: MIT */
#include "bus/eeprom.h"

#include <errno.h>
#include <string.h>

#include "base/bytes.h"
#include "wire/esc_reg.h"

enum step { STEP_OWNER, STEP_TAKE, STEP_COMMAND, STEP_POLL };

enum {
	OWNER_IS_PDI = 1 << 0, /* of 0x0500: offered to it; of 0x0501: it has it */
	OWNER_FORCE = 1 << 1,
	COMMAND_READ = 0x0100,
	COMMAND_WRITE = 0x0201, /* with the enable bit, which holds for this frame only */
	COMMAND_RELOAD = 0x0400,
	OWNER_BYTES = 4,   /* 0x0500 to 0x0503 */
	CONTROL_BYTES = 6, /* 0x0502 to 0x0507 */
	DATA_AT = 6,       /* of a poll: 0x0508 */
};

static const uint16_t command_word[] = {
	[EEPROM_OP_READ] = COMMAND_READ,
	[EEPROM_OP_WRITE] = COMMAND_WRITE,
	[EEPROM_OP_RELOAD] = COMMAND_RELOAD,
};

void eeprom_begin(struct eeprom_command *cmd, enum eeprom_operation operation, uint16_t station,
		  uint32_t word, mono_t give_up)
{
	cmd->operation = operation;
	cmd->station = station;
	cmd->word = word;
	cmd->words = 0;
	cmd->give_up = give_up;
	cmd->step = STEP_OWNER;
	cmd->problem = -EBUSY;
}

void eeprom_read_next(struct eeprom_command *cmd, uint32_t word)
{
	eeprom_begin(cmd, EEPROM_OP_READ, cmd->station, word, cmd->give_up);
	cmd->step = STEP_COMMAND;
}

static struct access access_of(const struct eeprom_command *cmd, enum ecat_cmd what, uint16_t reg,
			       void *data, uint16_t len)
{
	return (struct access){
		.cmd = what, .adp = cmd->station, .reg = reg, .len = len, .data = data
	};
}

static size_t prepare_command(struct eeprom_command *cmd, struct access *ret)
{
	size_t count = 0;

	if (cmd->operation == EEPROM_OP_WRITE) {
		ret[count++] = access_of(cmd, ECAT_CMD_FPWR, ESC_REG_EEPROM_DATA, cmd->data, 2);
	}
	put_le16(cmd->frame, command_word[cmd->operation]);
	put_le32(cmd->frame + 2, cmd->word);
	ret[count++] =
		access_of(cmd, ECAT_CMD_FPWR, ESC_REG_EEPROM_CONTROL, cmd->frame, CONTROL_BYTES);
	return count;
}

static uint16_t data_bytes(const struct eeprom_command *cmd)
{
	return (cmd->status & EEPROM_READS_8_BYTES) != 0 ? EEPROM_DATA_BYTES
							 : EEPROM_DATA_BYTES / 2;
}

size_t eeprom_prepare(struct eeprom_command *cmd, struct access *ret)
{
	switch ((enum step)cmd->step) {
	case STEP_OWNER:
		ret[0] = access_of(cmd, ECAT_CMD_FPRD, ESC_REG_EEPROM_CONFIG, cmd->frame,
				   OWNER_BYTES);
		return 1;
	case STEP_TAKE:
		cmd->frame[0] = OWNER_FORCE;
		cmd->frame[1] = 0;
		ret[0] = access_of(cmd, ECAT_CMD_FPWR, ESC_REG_EEPROM_CONFIG, &cmd->frame[0], 1);
		ret[1] = access_of(cmd, ECAT_CMD_FPWR, ESC_REG_EEPROM_CONFIG, &cmd->frame[1], 1);
		return 2;
	case STEP_COMMAND:
		return prepare_command(cmd, ret);
	case STEP_POLL:
		ret[0] = access_of(cmd, ECAT_CMD_FPRD, ESC_REG_EEPROM_CONTROL, cmd->frame,
				   (uint16_t)(DATA_AT + data_bytes(cmd)));
		return 1;
	}
	return 0;
}

/* Once more from the beginning, while there is time. */
static void again(struct eeprom_command *cmd, int problem)
{
	cmd->problem = problem;
	cmd->step = STEP_OWNER;
}

static void take_owner(struct eeprom_command *cmd)
{
	cmd->status = get_le16(cmd->frame + 2);
	if (((cmd->frame[0] | cmd->frame[1]) & OWNER_IS_PDI) != 0) {
		cmd->problem = -EACCES;
		cmd->step = STEP_TAKE;
	} else if ((cmd->status & EEPROM_BUSY) != 0) {
		cmd->problem = -EBUSY;
	} else {
		cmd->step = STEP_COMMAND;
	}
}

/* 0 when the command is done. */
static int take_poll(struct eeprom_command *cmd)
{
	cmd->status = get_le16(cmd->frame);
	if ((cmd->status & EEPROM_BUSY) != 0) {
		cmd->problem = -EBUSY;
		return 1;
	}
	if ((cmd->status & EEPROM_NO_ACKNOWLEDGE) != 0) {
		again(cmd, -EREMOTEIO);
		return 1;
	}
	if ((cmd->status & EEPROM_WRITE_REFUSED) != 0 || get_le32(cmd->frame + 2) != cmd->word) {
		again(cmd, -EACCES);
		return 1;
	}
	if (cmd->operation == EEPROM_OP_READ) {
		memcpy(cmd->data, cmd->frame + DATA_AT, data_bytes(cmd));
		cmd->words = (uint8_t)(data_bytes(cmd) / 2);
	}
	return 0;
}

int eeprom_take(struct eeprom_command *cmd, const struct access *access, mono_t now)
{
	enum step was = (enum step)cmd->step;
	uint16_t wkc = access[was == STEP_COMMAND && cmd->operation == EEPROM_OP_WRITE].wkc;
	int r = 1;

	if (wkc > 1) {
		return -EBADMSG;
	}
	if (was == STEP_TAKE) {
		cmd->step = STEP_OWNER;
	} else if (wkc == 0) {
		/* A command is ignored while the interface is busy or not the master's. */
		again(cmd, was == STEP_COMMAND ? cmd->problem : -ENXIO);
	} else if (was == STEP_OWNER) {
		take_owner(cmd);
	} else if (was == STEP_COMMAND) {
		cmd->step = STEP_POLL;
	} else {
		r = take_poll(cmd);
	}
	if (r == 1 && now.ns >= cmd->give_up.ns) {
		return cmd->problem;
	}
	return r;
}

int eeprom_lost(struct eeprom_command *cmd, mono_t now)
{
	again(cmd, -ETIMEDOUT);
	return now.ns >= cmd->give_up.ns ? cmd->problem : 1;
}

const char *eeprom_error_text(int result)
{
	switch (-result) {
	case EBUSY:
		return "its EEPROM interface stays busy";
	case ENXIO:
		return "the slave does not answer at 0x0500";
	case EREMOTEIO:
		return "the EEPROM does not acknowledge";
	case EACCES:
		return "the slave's controller keeps the EEPROM interface, or it is "
		       "write-protected";
	case EBADMSG:
		return "more than one slave answers at its station address";
	default:
		return "the frame was lost";
	}
}
