/* SPDX-License-Identifier: MIT */
#include <inttypes.h>
#include <stdio.h>

#include "eni/compare.h"
#include "eni/fields.h"
#include "wire/datagram.h"
#include "wire/esc_reg.h"

/* What the process data datagrams of a plan add up to. */
struct sum {
	uint32_t datagrams;
	uint32_t bytes;
	uint32_t wkc;
	int is_wkc_known;
};

static int is_logical(const struct eni_command *cmd)
{
	return cmd->cmd == ECAT_CMD_LRD || cmd->cmd == ECAT_CMD_LWR || cmd->cmd == ECAT_CMD_LRW;
}

/* Logical, and no mailbox states. */
static int is_process_data(const struct eni *eni, const struct eni_command *cmd)
{
	return is_logical(cmd) && ((eni->mailbox_states.has & ENI_IS_THERE) == 0 ||
				   cmd->addr != eni->mailbox_states.start);
}

static uint32_t bytes_of(const struct eni_command *cmd)
{
	return cmd->data.data != NULL ? (uint32_t)cmd->data.len : cmd->data_len;
}

/* The next datagram of process data at or after @from; the count: none. */
static size_t next_data(const struct eni *eni, size_t from)
{
	while (from < eni->cmd_count && !is_process_data(eni, &eni->cmd[from])) {
		from++;
	}
	return from;
}

static struct sum add_up(const struct eni *eni)
{
	struct sum sum = { .is_wkc_known = 1 };

	for (size_t i = next_data(eni, 0); i < eni->cmd_count; i = next_data(eni, i + 1)) {
		sum.datagrams++;
		sum.bytes += bytes_of(&eni->cmd[i]);
		sum.wkc += eni->cmd[i].cnt;
		sum.is_wkc_known &= (eni->cmd[i].has & ENI_HAS(ENI_CMD_CNT)) != 0;
	}
	return sum;
}

static const char *describe(const struct eni_command *cmd, char text[ENI_TEXT_BYTES])
{
	char wkc[24] = "?";

	if ((cmd->has & ENI_HAS(ENI_CMD_CNT)) != 0) {
		snprintf(wkc, sizeof(wkc), "%" PRIu32, cmd->cnt);
	}
	if (is_logical(cmd)) {
		snprintf(text, ENI_TEXT_BYTES, "%s 0x%08" PRIx32 ", %" PRIu32 " bytes, WKC %s",
			 ecat_cmd_to_str((uint8_t)cmd->cmd), cmd->addr, bytes_of(cmd), wkc);
	} else {
		snprintf(text, ENI_TEXT_BYTES,
			 "%s 0x%04" PRIx32 ":0x%04" PRIx32 ", %" PRIu32 " bytes",
			 ecat_cmd_to_str((uint8_t)cmd->cmd), cmd->adp, cmd->ado, bytes_of(cmd));
	}
	return text;
}

static int is_same_datagram(const struct eni_command *a, const struct eni_command *b)
{
	return a->cmd == b->cmd && a->addr == b->addr && bytes_of(a) == bytes_of(b) &&
	       a->cnt == b->cnt;
}

/* One by one: another cut of the same image is another layout. */
static void compare_logical(const struct eni_compare *c)
{
	size_t a = next_data(c->theirs, 0);
	size_t b = next_data(c->ours, 0);

	for (unsigned n = 0; a < c->theirs->cmd_count || b < c->ours->cmd_count; n++) {
		const struct eni_command *theirs =
			a < c->theirs->cmd_count ? &c->theirs->cmd[a] : NULL;
		const struct eni_command *ours = b < c->ours->cmd_count ? &c->ours->cmd[b] : NULL;
		char what[ENI_TEXT_BYTES];
		char their_text[ENI_TEXT_BYTES] = "none";
		char our_text[ENI_TEXT_BYTES] = "none";

		if (theirs == NULL || ours == NULL || !is_same_datagram(theirs, ours)) {
			snprintf(what, sizeof(what), "process data datagram %u", n);
			eni_differ(c, ENI_ALLOWED, ENI_MASTER, what,
				   theirs == NULL ? "none" : describe(theirs, their_text),
				   ours == NULL ? "none" : describe(ours, our_text));
		}
		a = theirs == NULL ? a : next_data(c->theirs, a + 1);
		b = ours == NULL ? b : next_data(c->ours, b + 1);
	}
}

/* ARMW and FRMW of the same register do the same for it. */
static int is_same_register(const struct eni_command *a, const struct eni_command *b)
{
	int is_distributed = a->cmd == ECAT_CMD_ARMW || a->cmd == ECAT_CMD_FRMW;

	if (is_logical(a) || is_logical(b)) {
		return a->cmd == b->cmd; /* mailbox states */
	}
	return a->ado == b->ado &&
	       (a->cmd == b->cmd ||
		(is_distributed && (b->cmd == ECAT_CMD_ARMW || b->cmd == ECAT_CMD_FRMW)));
}

/* Best one of the same length. */
static const struct eni_command *find_register(const struct eni *eni, const struct eni_command *cmd)
{
	const struct eni_command *found = NULL;

	for (size_t i = 0; i < eni->cmd_count; i++) {
		const struct eni_command *other = &eni->cmd[i];

		if (!is_process_data(eni, other) && is_same_register(other, cmd) &&
		    (found == NULL || bytes_of(other) == bytes_of(cmd))) {
			found = other;
		}
	}
	return found;
}

/* The time of the reference clock must go round; what else a master reads is its own affair. */
static enum eni_weight weight_of(const struct eni_command *cmd)
{
	return (cmd->cmd == ECAT_CMD_ARMW || cmd->cmd == ECAT_CMD_FRMW) &&
			       cmd->ado == ESC_REG_DC_SYSTEM_TIME
		       ? ENI_DIFFERENT
		       : ENI_ALLOWED;
}

static void compare_registers(const struct eni_compare *c)
{
	char text[ENI_TEXT_BYTES];
	char other[ENI_TEXT_BYTES];

	for (size_t i = 0; i < c->theirs->cmd_count; i++) {
		const struct eni_command *cmd = &c->theirs->cmd[i];
		const struct eni_command *ours =
			is_process_data(c->theirs, cmd) ? cmd : find_register(c->ours, cmd);

		if (ours == NULL) {
			eni_differ(c, weight_of(cmd), ENI_MASTER, "cyclic datagram",
				   describe(cmd, text), "none");
		} else if (bytes_of(ours) != bytes_of(cmd)) {
			eni_differ(c, ENI_ALLOWED, ENI_MASTER, "cyclic datagram",
				   describe(cmd, text), describe(ours, other));
		}
	}
	for (size_t i = 0; i < c->ours->cmd_count; i++) {
		const struct eni_command *cmd = &c->ours->cmd[i];

		if (!is_process_data(c->ours, cmd) && find_register(c->theirs, cmd) == NULL) {
			eni_differ(c, weight_of(cmd), ENI_MASTER, "cyclic datagram", "none",
				   describe(cmd, text));
		}
	}
}

static uint32_t cycle_us(const struct eni *eni)
{
	return eni->cyclic_count == 0 ? 0 : eni->cyclic[0].cycle_us;
}

void eni_compare_frames(const struct eni_compare *c)
{
	struct sum theirs = add_up(c->theirs);
	struct sum ours = add_up(c->ours);

	if (cycle_us(c->theirs) != 0) {
		eni_differ_numbers(c, ENI_DIFFERENT, ENI_MASTER, "cycle time in us",
				   (struct eni_pair){ cycle_us(c->theirs), cycle_us(c->ours) },
				   ENI_DECIMAL);
	}
	if (c->theirs->cyclic_count > 1) {
		eni_differ_numbers(c, ENI_DIFFERENT, ENI_MASTER, "cyclic tasks",
				   (struct eni_pair){ (uint32_t)c->theirs->cyclic_count,
						      (uint32_t)c->ours->cyclic_count },
				   ENI_DECIMAL);
	}
	if (c->theirs->cmd_count == 0) {
		if (c->ours->cmd_count > 0) {
			eni_differ(c, ENI_ALLOWED, ENI_MASTER, "cyclic frames", "none", "some");
		}
		return;
	}
	eni_differ_numbers(c, ENI_ALLOWED, ENI_MASTER, "cyclic frames",
			   (struct eni_pair){ (uint32_t)c->theirs->frame_count,
					      (uint32_t)c->ours->frame_count },
			   ENI_DECIMAL);
	eni_differ_numbers(c, ENI_DIFFERENT, ENI_MASTER, "bytes of process data",
			   (struct eni_pair){ theirs.bytes, ours.bytes }, ENI_DECIMAL);
	if (theirs.is_wkc_known && ours.is_wkc_known) {
		eni_differ_numbers(c, ENI_DIFFERENT, ENI_MASTER, "expected working counter",
				   (struct eni_pair){ theirs.wkc, ours.wkc }, ENI_DECIMAL);
	}
	compare_logical(c);
	compare_registers(c);
}
