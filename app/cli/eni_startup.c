/* SPDX-License-Identifier: MIT */
/* Start-up SDOs of a slave as an ENI file has them, in the order in which ecdaqd writes them. */
#include <stdio.h>
#include <string.h>

#include "base/bytes.h"
#include "base/clock.h"
#include "cli/eni_plan.h"
#include "cli/startup_list.h"
#include "eni/fields.h"

#define GET(field) atomic_load_explicit(&(field), memory_order_relaxed)

enum {
	OBJECT_OUTPUT_SYNC = 0x1c32,
	OBJECT_INPUT_SYNC = 0x1c33,
	CCS_DOWNLOAD = 1,
};

static void add_coe(struct slave_plan *s, const struct eni_coe *from, const void *data, size_t len)
{
	struct eni_coe *coe = eni_add_coe(s->plan->eni, s->pos);

	if (coe == NULL) {
		s->is_short = 1;
		return;
	}
	*coe = *from;
	coe->slave = s->pos;
	coe->ccs = CCS_DOWNLOAD;
	coe->timeout_ms = (uint32_t)(s->plan->cfg->bus_mailbox_timeout_ns / NS_PER_MS);
	eni_has_all(ENI_NODE_COE_INIT, coe, 0);
	s->is_short |= eni_octets_set(&coe->data, data, len) < 0;
}

static void add_word(struct slave_plan *s, uint16_t index, uint32_t type)
{
	const struct eni_coe coe = { .transitions = TURN(PS),
				     .index = index,
				     .subindex = 1,
				     .comment = "slaves[].sync_type" };
	uint8_t word[2];

	put_le16(word, (uint16_t)type);
	if (type != 0) {
		add_coe(s, &coe, word, sizeof(word));
	}
}

/* Of slaves[].sdo[]: the comment beside it, else where it is from. */
static void put_comment(const struct slave_plan *s, const struct startup_record *record,
			struct eni_coe *coe)
{
	const struct config *cfg = s->plan->cfg;

	for (size_t i = 0; i < cfg->sdo_count && record->origin == STARTUP_OF_CONFIG; i++) {
		if ((uint32_t)cfg->sdo[i].line == record->line && cfg->sdo[i].comment[0] != '\0') {
			xml_plain(cfg->sdo[i].comment, coe->comment, sizeof(coe->comment));
			return;
		}
	}
	xml_plain(startup_origin_to_str(record->origin), coe->comment, sizeof(coe->comment));
}

static void add_record(struct slave_plan *s, const struct startup_record *record,
		       const uint8_t *data)
{
	static const uint32_t transitions[CONFIG_TRANSITIONS] = {
		[CONFIG_TRANSITION_IP] = TURN(IP),
		[CONFIG_TRANSITION_PS] = TURN(PS),
		[CONFIG_TRANSITION_SO] = TURN(SO),
		[CONFIG_TRANSITION_OS] = TURN(OS),
	};
	struct eni_coe coe = { .transitions = transitions[record->transition],
			       .index = record->index,
			       .subindex = record->subindex,
			       .is_complete = record->is_complete };

	put_comment(s, record, &coe);
	add_coe(s, &coe, data, record->len);
}

/* Those that ecdaqd has, in its order; then the sync types that it writes after the mapping. */
enum exit_code eni_plan_startup(struct slave_plan *s)
{
	const struct slave_status *status = &s->plan->page->slave[s->pos];
	struct startup_list list;
	struct startup_record record;
	const uint8_t *data;
	enum exit_code result = startup_list_read(s->plan->cli, s->pos, &list);

	while (result == EXIT_CODE_OK && startup_list_next(&list, &record, &data)) {
		if (record.len > 0) {
			add_record(s, &record, data);
		} else {
			result = cli_fail(
				s->plan->cli, EXIT_CODE_FAILED,
				"%s: start-up SDO 0x%04x:%02x: its type is not known until "
				"it was written: give a type, or bring the bus to OP",
				list.transfer.reply.text, record.index, record.subindex);
		}
	}
	startup_list_done(&list);
	if (result == EXIT_CODE_OK && s->is_listed && s->item.sync_type == CONFIG_SYNC_TYPE_WRITE) {
		add_word(s, OBJECT_OUTPUT_SYNC, GET(status->output_sync_type));
		add_word(s, OBJECT_INPUT_SYNC, GET(status->input_sync_type));
	}
	return result;
}
