/* SPDX-License-Identifier: MIT */
/*
 * The text of a catalogue entry: a line a fact, "KEY WORD...", "#" starts a comment. "repeat N" to
 * "end" stands for N channels: in it a number may be written BASE+STEP, and a "%" in a text is the
 * number of the channel, from 1.
 */
#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "devices/model_text.h"
#include "devices/slave_application.h"
#include "wire/esc_reg.h"

enum {
	EEPROM_BYTES_MAX = 131072,
	REPEAT_MAX = 64,
	NOT_ASSIGNED = 0xff,
	DEVICE_TYPE_MODULAR = 5001
};

#define COUNT(a) (sizeof(a) / sizeof((a)[0]))

/* --- keys: identity and chip --- */

static int take_identity(struct parse *p)
{
	long long value[3];
	static const char *const what[] = { "vendor", "product", "revision" };

	for (unsigned i = 0; i < COUNT(value); i++) {
		if (number(p, what[i], 0, UINT32_MAX, &value[i]) < 0) {
			return -EBADMSG;
		}
	}
	p->m->sii.vendor = (uint32_t)value[0];
	p->m->sii.product = (uint32_t)value[1];
	p->m->sii.revision = (uint32_t)value[2];
	p->has_product = 1;
	return 1;
}

static int take_name(struct parse *p)
{
	return text_number(p, &p->m->sii.device_name);
}

static int take_order(struct parse *p)
{
	return text_number(p, &p->m->sii.order_name);
}

static int take_group(struct parse *p)
{
	return text_number(p, &p->m->sii.group_name);
}

static int take_esc(struct parse *p)
{
	const struct esc_features *features;
	int r = need_word(p, "the kind of ESC");

	if (r < 0) {
		return r;
	}
	features = esc_chip_find(p->word);
	if (features == NULL) {
		return parse_fail(p, "unknown ESC '%s'", p->word);
	}
	p->m->features = *features;
	return 1;
}

static int take_ports(struct parse *p)
{
	static const struct word_value kinds[] = {
		{ "none", 0 }, { "unused", 1 }, { "ebus", 2 }, { "mii", 3 }
	};
	unsigned descriptor = 0;

	if (p->m->features.type == 0) {
		return parse_fail(p, "\"esc\" comes before \"ports\"");
	}
	for (unsigned port = 0; port < ESC_PORTS; port++) {
		unsigned kind = 0;

		if (need_word(p, "the kind of a port") < 0 ||
		    choose(p, kinds, COUNT(kinds), &kind) < 0) {
			return -EBADMSG;
		}
		descriptor |= kind << 2 * port;
	}
	p->m->features.port_descriptor = (uint8_t)descriptor;
	p->has_ports = 1;
	return 1;
}

static int take_config(struct parse *p)
{
	for (unsigned i = 0; i < MODEL_CONFIG_WORDS; i++) {
		if (number16(p, "EEPROM word", &p->m->config[i]) < 0) {
			return -EBADMSG;
		}
	}
	p->m->sii.pdi_control = p->m->config[0];
	return 1;
}

static int take_eeprom(struct parse *p)
{
	long long bytes = 0;
	int r = number(p, "EEPROM size", 128, EEPROM_BYTES_MAX, &bytes);

	p->m->sii.size_bytes = (uint32_t)bytes;
	return r;
}

static int take_ebus(struct parse *p)
{
	long long ma = 0;
	int r = number(p, "mA", INT16_MIN, INT16_MAX, &ma);

	p->m->ebus_ma = (int16_t)ma;
	return r;
}

static int take_no_lrw(struct parse *p)
{
	p->m->sii.general_flags |= SII_GENERAL_NOT_LRW;
	p->m->features.features |= ESC_FEATURE_NO_LRW;
	return 0;
}

static int take_device_type(struct parse *p)
{
	return number16(p, "device type", &p->m->device_type);
}

/* --- keys: mailbox --- */

static int take_boxes(struct parse *p, uint16_t box[4])
{
	for (unsigned i = 0; i < 4; i++) {
		if (number16(p, "mailbox start or length", &box[i]) < 0) {
			return -EBADMSG;
		}
	}
	return 1;
}

static int take_bootstrap(struct parse *p)
{
	struct sii *s = &p->m->sii;
	uint16_t box[4];

	if (take_boxes(p, box) < 0) {
		return -EBADMSG;
	}
	s->boot_out_start = box[0];
	s->boot_out_len = box[1];
	s->boot_in_start = box[2];
	s->boot_in_len = box[3];
	return 1;
}

static int take_mailbox(struct parse *p)
{
	static const struct word_value protocols[] = {
		{ "aoe", SII_MAILBOX_AOE }, { "eoe", SII_MAILBOX_EOE }, { "coe", SII_MAILBOX_COE },
		{ "foe", SII_MAILBOX_FOE }, { "soe", SII_MAILBOX_SOE }, { "voe", SII_MAILBOX_VOE },
	};
	struct sii *s = &p->m->sii;
	uint16_t box[4];
	unsigned value = 0;

	if (take_boxes(p, box) < 0 || choose_all(p, protocols, COUNT(protocols), &value) < 0) {
		return -EBADMSG;
	}
	s->mailbox_out_start = box[0];
	s->mailbox_out_len = box[1];
	s->mailbox_in_start = box[2];
	s->mailbox_in_len = box[3];
	s->mailbox_protocols = (uint16_t)value;
	return 1;
}

static int take_coe(struct parse *p)
{
	static const struct word_value details[] = {
		{ "sdo", 0x01 },           { "information", 0x02 }, { "assignment", 0x04 },
		{ "configuration", 0x08 }, { "upload", 0x10 },      { "complete", 0x20 },
	};
	unsigned value = 0;
	int r = choose_all(p, details, COUNT(details), &value);

	p->m->sii.coe_details = (uint8_t)value;
	return r;
}

/* --- keys: process data --- */

static int take_fmmu(struct parse *p)
{
	static const struct word_value kinds[] = {
		{ "outputs", 1 }, { "inputs", 2 }, { "mailbox_state", 3 }, { "unused", 0xff }
	};
	struct sii *s = &p->m->sii;
	unsigned value = 0;
	int r;

	while ((r = next_word(p)) > 0) {
		if (s->fmmu_count == SII_LIMIT_FMMU) {
			return parse_fail(p, "more than %d FMMUs", SII_LIMIT_FMMU);
		}
		r = choose(p, kinds, COUNT(kinds), &value);
		if (r < 0) {
			return r;
		}
		s->fmmu[s->fmmu_count++] = (uint8_t)value;
	}
	return r;
}

static int take_sm(struct parse *p)
{
	static const struct word_value kinds[] = { { "mailbox_out", SLAVE_SM_MAILBOX_OUT },
						   { "mailbox_in", SLAVE_SM_MAILBOX_IN },
						   { "outputs", SLAVE_SM_OUTPUTS },
						   { "inputs", SLAVE_SM_INPUTS } };
	struct sii *s = &p->m->sii;
	uint16_t start;
	uint16_t len;
	long long control;
	long long enable;
	unsigned type = 0;

	if (s->sm_count == SII_LIMIT_SM) {
		return parse_fail(p, "more than %d SyncManagers", SII_LIMIT_SM);
	}
	if (number16(p, "start", &start) < 0 || number16(p, "length", &len) < 0 ||
	    number(p, "control", 0, UINT8_MAX, &control) < 0 ||
	    number(p, "enable", 0, UINT8_MAX, &enable) < 0 ||
	    need_word(p, "the kind of SyncManager") < 0 ||
	    choose(p, kinds, COUNT(kinds), &type) < 0) {
		return -EBADMSG;
	}
	s->sm[s->sm_count++] = (struct sii_sm){ .start = start,
						.len = len,
						.control = (uint8_t)control,
						.enable = (uint8_t)enable,
						.type = (uint8_t)type };
	return 1;
}

/* "SM", or "-" for a PDO that is not assigned. */
static int take_pdo_sm(struct parse *p, unsigned type, uint8_t *ret)
{
	const struct sii *s = &p->m->sii;
	long long sm;
	int r = need_word(p, "the SyncManager");

	*ret = NOT_ASSIGNED;
	if (r < 0 || strcmp(p->word, "-") == 0) {
		return r;
	}
	r = number_of(p, p->word, "the SyncManager", 0, SII_LIMIT_SM - 1, &sm);
	if (r < 0) {
		return r;
	}
	if ((size_t)sm >= s->sm_count || s->sm[sm].type != type) {
		return parse_fail(p, "SyncManager %lld is not one of this direction", sm);
	}
	*ret = (uint8_t)sm;
	return 1;
}

static int take_pdo(struct parse *p, int is_tx)
{
	struct sii *s = &p->m->sii;
	struct sii_pdo pdo = { .is_tx = is_tx != 0, .first_entry = (uint16_t)s->entry_count };

	if (s->pdo_count == SII_LIMIT_PDO) {
		return parse_fail(p, "more than %d PDOs", SII_LIMIT_PDO);
	}
	if (is_tx && s->pdo_count > 0 && !s->pdo[s->pdo_count - 1].is_tx) {
		return parse_fail(p, "TxPDOs come before RxPDOs");
	}
	if (number16(p, "PDO", &pdo.index) < 0 ||
	    take_pdo_sm(p, is_tx ? SLAVE_SM_INPUTS : SLAVE_SM_OUTPUTS, &pdo.sm) < 0 ||
	    text_number(p, &pdo.name) < 0) {
		return -EBADMSG;
	}
	s->pdo[s->pdo_count++] = pdo;
	return 1;
}

static int take_txpdo(struct parse *p)
{
	return take_pdo(p, 1);
}

static int take_rxpdo(struct parse *p)
{
	return take_pdo(p, 0);
}

static int add_entry(struct parse *p, const struct sii_entry *entry,
		     const struct model_input *input)
{
	struct sii *s = &p->m->sii;
	struct sii_pdo *pdo;

	if (s->pdo_count == 0) {
		return parse_fail(p, "an entry comes after the PDO that it belongs to");
	}
	if (s->entry_count == MODEL_ENTRIES) {
		return parse_fail(p, "more than %d entries", MODEL_ENTRIES);
	}
	pdo = &s->pdo[s->pdo_count - 1];
	if (input->source != MODEL_ZERO && !pdo->is_tx) {
		return parse_fail(p, "only an input shows something");
	}
	if (pdo->entry_count == UINT8_MAX) {
		return parse_fail(p, "more than %d entries in a PDO", UINT8_MAX);
	}
	p->m->input[s->entry_count] = *input;
	s->entry[s->entry_count++] = *entry;
	pdo->entry_count++;
	pdo->bits += entry->bit_len;
	return 1;
}

/* What an input shows: nothing, or one of the words below. */
static int take_input(struct parse *p, struct model_input *in)
{
	static const struct word_value sources[] = {
		{ "count", MODEL_COUNT },   { "toggle", MODEL_TOGGLE },
		{ "signal", MODEL_SIGNAL }, { "follow", MODEL_FOLLOW },
		{ "fixed", MODEL_FIXED },   { "statusword", MODEL_STATUSWORD },
	};
	long long volt[2] = { 0, 0 };
	long long counts = 0;
	unsigned source = MODEL_ZERO;
	int r = next_word(p);

	if (r <= 0) {
		return r;
	}
	r = choose(p, sources, COUNT(sources), &source);
	if (r < 0) {
		return r;
	}
	*in = (struct model_input){ .source = (enum model_source)source,
				    .channel = (uint8_t)p->channel };
	if (source == MODEL_SIGNAL && (number(p, "lowest V", -1000, 1000, &volt[0]) < 0 ||
				       number(p, "highest V", 1, 1000, &volt[1]) < 0)) {
		return -EBADMSG;
	}
	if ((source == MODEL_SIGNAL || source == MODEL_FIXED) &&
	    number(p, "counts", INT32_MIN, INT32_MAX, &counts) < 0) {
		return -EBADMSG;
	}
	if (source == MODEL_FOLLOW || source == MODEL_STATUSWORD) {
		r = object_address(p, &in->index, &in->subindex);
	}
	in->low_v = (double)volt[0];
	in->high_v = (double)volt[1];
	in->counts = counts;
	return r;
}

static int take_entry(struct parse *p)
{
	/* ETG.1020 base data types. */
	static const struct word_value types[] = {
		{ "bool", 0x01 },  { "sint", 0x02 },  { "int", 0x03 },   { "dint", 0x04 },
		{ "usint", 0x05 }, { "uint", 0x06 },  { "udint", 0x07 }, { "real", 0x08 },
		{ "lint", 0x15 },  { "ulint", 0x1b }, { "byte", 0x1e },  { "bit2", 0x31 },
	};
	static const uint8_t bits[] = { [0x01] = 1,  [0x02] = 8,  [0x03] = 16, [0x04] = 32,
					[0x05] = 8,  [0x06] = 16, [0x07] = 32, [0x08] = 32,
					[0x15] = 64, [0x1b] = 64, [0x1e] = 8,  [0x31] = 2 };
	struct sii_entry entry = { .index = 0 };
	struct model_input input = { .source = MODEL_ZERO };
	unsigned type = 0;

	if (object_address(p, &entry.index, &entry.subindex) < 0 || need_word(p, "the type") < 0 ||
	    choose(p, types, COUNT(types), &type) < 0 || text_number(p, &entry.name) < 0 ||
	    take_input(p, &input) < 0) {
		return -EBADMSG;
	}
	entry.data_type = (uint8_t)type;
	entry.bit_len = bits[type];
	return add_entry(p, &entry, &input);
}

/* Of the entry before, in its SDO information. */
static int take_unit(struct parse *p)
{
	const struct sii *s = &p->m->sii;
	long long code;

	if (s->entry_count == 0 || s->entry[s->entry_count - 1].index == 0) {
		return parse_fail(p, "a unit comes after the entry that it belongs to");
	}
	if (number(p, "unit", 1, UINT32_MAX, &code) < 0) {
		return -EBADMSG;
	}
	p->m->unit[s->entry_count - 1] = (uint32_t)code;
	return 1;
}

static int take_gap(struct parse *p)
{
	static const struct model_input zero = { .source = MODEL_ZERO };
	struct sii_entry entry = { .index = 0 };
	long long bits = 0;

	if (number(p, "bits", 1, UINT8_MAX, &bits) < 0) {
		return -EBADMSG;
	}
	entry.bit_len = (uint8_t)bits;
	return add_entry(p, &entry, &zero);
}

/* dc ASSIGN_ACTIVATE FACTOR0 SHIFT0_NS FACTOR1 SHIFT1_NS "NAME" */
static int take_dc(struct parse *p)
{
	struct slave_model *m = p->m;
	struct model_dc_mode mode = { .name = 0 };
	long long factor[2];
	long long shift_ns[2];

	if (m->dc_count == MODEL_DC_MODES) {
		return parse_fail(p, "more than %d DC modes", MODEL_DC_MODES);
	}
	if (number16(p, "AssignActivate", &mode.assign_activate) < 0) {
		return -EBADMSG;
	}
	for (unsigned i = 0; i < 2; i++) {
		if (number(p, "factor", INT16_MIN, INT16_MAX, &factor[i]) < 0 ||
		    number(p, "shift", INT32_MIN, INT32_MAX, &shift_ns[i]) < 0) {
			return -EBADMSG;
		}
	}
	mode.sync0_factor = (int16_t)factor[0];
	mode.sync1_factor = (int16_t)factor[1];
	mode.sync0_shift_ns = (int32_t)shift_ns[0];
	mode.sync1_shift_ns = (int32_t)shift_ns[1];
	if (text_number(p, &mode.name) < 0) {
		return -EBADMSG;
	}
	m->dc[m->dc_count++] = mode;
	return 1;
}

/* --- channels --- */

static int take_repeat(struct parse *p)
{
	long long count = 0;
	long long first = 1;
	int r;

	if (p->repeat_pos != NULL) {
		return parse_fail(p, "a repeat within a repeat");
	}
	if (number(p, "channels", 1, REPEAT_MAX, &count) < 0) {
		return -EBADMSG;
	}
	r = next_word(p);
	if (r > 0) {
		r = number_of(p, p->word, "first channel", 1, REPEAT_MAX, &first);
	}
	p->channel = (long)first - 1;
	p->repeat_end = (long)(first - 1 + count);
	p->repeat_line = p->line;
	p->repeat_pos = p->pos;
	return r;
}

static int take_end(struct parse *p)
{
	if (p->repeat_pos == NULL) {
		return parse_fail(p, "an end without a repeat");
	}
	if (++p->channel < p->repeat_end) {
		p->pos = p->repeat_pos;
		p->line = p->repeat_line;
		return 1;
	}
	p->repeat_pos = NULL;
	p->channel = 0;
	return 1;
}

/* --- all --- */

static int take_line(struct parse *p)
{
	static const struct {
		const char *key;
		int (*take)(struct parse *p);
	} keys[] = {
		{ "identity", take_identity },
		{ "name", take_name },
		{ "order", take_order },
		{ "group", take_group },
		{ "esc", take_esc },
		{ "ports", take_ports },
		{ "config", take_config },
		{ "eeprom", take_eeprom },
		{ "ebus", take_ebus },
		{ "no_lrw", take_no_lrw },
		{ "device_type", take_device_type },
		{ "bootstrap", take_bootstrap },
		{ "mailbox", take_mailbox },
		{ "coe", take_coe },
		{ "fmmu", take_fmmu },
		{ "sm", take_sm },
		{ "txpdo", take_txpdo },
		{ "rxpdo", take_rxpdo },
		{ "entry", take_entry },
		{ "unit", take_unit },
		{ "gap", take_gap },
		{ "dc", take_dc },
		{ "repeat", take_repeat },
		{ "end", take_end },
	};
	int r = next_word(p);

	if (r <= 0) {
		return r;
	}
	for (size_t i = 0; i < COUNT(keys); i++) {
		if (strcmp(keys[i].key, p->word) == 0) {
			return keys[i].take(p);
		}
	}
	return parse_fail(p, "unknown key '%s'", p->word);
}

static int check_whole(struct parse *p)
{
	if (p->repeat_pos != NULL) {
		return parse_fail(p, "the repeat of line %u has no end", p->repeat_line);
	}
	if (!p->has_product || p->m->sii.device_name == 0 || !p->has_ports) {
		return parse_fail(p, "%s is missing",
				  !p->has_product              ? "identity"
				  : p->m->sii.device_name == 0 ? "name"
							       : "esc and ports");
	}
	return 0;
}

int slave_model_parse(const char *name, const char *text, struct slave_model *ret, char *error,
		      size_t error_bytes)
{
	struct parse p = {
		.m = ret, .pos = text, .line = 1, .error = error, .error_bytes = error_bytes
	};

	memset(ret, 0, sizeof(*ret));
	snprintf(ret->name, sizeof(ret->name), "%s", name);
	ret->sii.size_bytes = 2048;
	ret->sii.has_general = 1;
	ret->device_type = DEVICE_TYPE_MODULAR;
	for (;; p.line++) {
		if (take_line(&p) < 0) {
			return -EBADMSG;
		}
		skip_spaces(&p);
		if (!is_line_end(*p.pos)) {
			return parse_fail(&p, "unexpected text at the end of the line");
		}
		p.pos += strcspn(p.pos, "\n");
		if (*p.pos == '\0') {
			return check_whole(&p);
		}
		p.pos++;
	}
}
