/* SPDX-License-Identifier: MIT */
#include <inttypes.h>
#include <string.h>

#include "base/xml_text.h"
#include "esi/esi.h"
#include "wire/coe_type.h"
#include "wire/sii.h"

static void element(FILE *out, const char *indent, const char *name, const char *text)
{
	fprintf(out, "%s<%s>", indent, name);
	xml_text_put(out, text);
	fprintf(out, "</%s>\n", name);
}

static void put_timeouts(FILE *out, const struct esi_device *d)
{
	const struct {
		const char *name;
		uint32_t ms;
	} states[] = { { "PreopTimeout", d->preop_timeout_ms },
		       { "SafeopOpTimeout", d->safeop_op_timeout_ms },
		       { "BackToInitTimeout", d->back_to_init_timeout_ms },
		       { "BackToSafeopTimeout", d->back_to_safeop_timeout_ms } };

	if (d->preop_timeout_ms == 0 && d->request_timeout_ms == 0) {
		return;
	}
	fputs("        <Info>\n", out);
	if (d->preop_timeout_ms != 0) {
		fputs("          <StateMachine>\n            <Timeout>\n", out);
		for (size_t i = 0; i < sizeof(states) / sizeof(states[0]); i++) {
			fprintf(out, "              <%s>%" PRIu32 "</%s>\n", states[i].name,
				states[i].ms, states[i].name);
		}
		fputs("            </Timeout>\n          </StateMachine>\n", out);
	}
	if (d->request_timeout_ms != 0) {
		fprintf(out,
			"          <Mailbox>\n            <Timeout>\n"
			"              <RequestTimeout>%" PRIu32 "</RequestTimeout>\n"
			"              <ResponseTimeout>%" PRIu32 "</ResponseTimeout>\n"
			"            </Timeout>\n          </Mailbox>\n",
			d->request_timeout_ms, d->response_timeout_ms);
	}
	fputs("        </Info>\n", out);
}

static void put_sms(FILE *out, const struct esi_device *d)
{
	static const char *const fmmus[] = { "", "Outputs", "Inputs", "MBoxState" };
	static const char *const sms[] = { "", "MBoxOut", "MBoxIn", "Outputs", "Inputs" };

	for (size_t i = 0; i < d->fmmu_count; i++) {
		element(out, "        ", "Fmmu", fmmus[d->fmmu[i] < 4 ? d->fmmu[i] : 0]);
	}
	for (size_t i = 0; i < d->sm_count; i++) {
		const struct esi_sm *sm = &d->sm[i];

		fprintf(out,
			"        <Sm DefaultSize=\"%u\" StartAddress=\"#x%04X\" "
			"ControlByte=\"#x%02X\" Enable=\"%u\">%s</Sm>\n",
			sm->bytes, sm->start, sm->control, sm->enable,
			sms[sm->type < 5 ? sm->type : 0]);
	}
}

static void put_entry(FILE *out, const struct esi_entry *e)
{
	fprintf(out,
		"          <Entry>\n            <Index>#x%04X</Index>\n"
		"            <SubIndex>%u</SubIndex>\n            <BitLen>%u</BitLen>\n",
		e->index, e->subindex, e->bits);
	if (e->index != 0) {
		const char *type = e->type_name[0] != '\0' ? e->type_name : coe_type_name(e->type);

		element(out, "            ", "Name", e->name);
		if (type != NULL) {
			element(out, "            ", "DataType", type);
		}
	}
	fputs("          </Entry>\n", out);
}

static void put_pdo(FILE *out, const struct esi_device *d, const struct esi_pdo *pdo)
{
	const char *kind = pdo->is_tx ? "TxPdo" : "RxPdo";

	fprintf(out, "        <%s", kind);
	if (pdo->is_fixed) {
		fputs(" Fixed=\"1\"", out);
	}
	if (pdo->is_mandatory) {
		fputs(" Mandatory=\"1\"", out);
	}
	if (pdo->sm != ESI_NO_SM) {
		fprintf(out, " Sm=\"%d\"", pdo->sm);
	}
	fprintf(out, ">\n          <Index>#x%04X</Index>\n", pdo->index);
	element(out, "          ", "Name", pdo->name);
	for (size_t i = 0; i < pdo->exclude_count; i++) {
		fprintf(out, "          <Exclude>#x%04X</Exclude>\n", pdo->exclude[i]);
	}
	for (size_t i = 0; i < pdo->count; i++) {
		put_entry(out, &d->entry[pdo->first + i]);
	}
	fprintf(out, "        </%s>\n", kind);
}

static void put_command(FILE *out, const struct esi_command *command)
{
	static const char *const names[] = { "IP", "PS", "SO", "OS", "SP", "PI" };

	fprintf(out, "            <InitCmd%s%s>\n", command->is_fixed ? " Fixed=\"1\"" : "",
		command->is_complete_access ? " CompleteAccess=\"1\"" : "");
	for (unsigned i = 0; i < sizeof(names) / sizeof(names[0]); i++) {
		if ((command->transitions & 1u << i) != 0) {
			element(out, "              ", "Transition", names[i]);
		}
	}
	fprintf(out,
		"              <Index>#x%04X</Index>\n"
		"              <SubIndex>%u</SubIndex>\n              <Data>",
		command->index, command->subindex);
	for (size_t i = 0; i < command->len; i++) {
		fprintf(out, "%02X", command->data[i]);
	}
	fputs("</Data>\n", out);
	if (command->comment[0] != '\0') {
		element(out, "              ", "Comment", command->comment);
	}
	fputs("            </InitCmd>\n", out);
}

static void put_coe(FILE *out, const struct esi_device *d)
{
	static const struct {
		enum esi_coe_flag flag;
		const char *name;
	} flags[] = { { ESI_COE_SDO_INFO, "SdoInfo" },
		      { ESI_COE_PDO_ASSIGN, "PdoAssign" },
		      { ESI_COE_PDO_CONFIG, "PdoConfig" },
		      { ESI_COE_PDO_UPLOAD, "PdoUpload" },
		      { ESI_COE_COMPLETE_ACCESS, "CompleteAccess" } };

	fputs("          <CoE", out);
	for (size_t i = 0; i < sizeof(flags) / sizeof(flags[0]); i++) {
		fprintf(out, " %s=\"%d\"", flags[i].name, (d->coe & flags[i].flag) != 0);
	}
	if (d->command_count == 0) {
		fputs("/>\n", out);
		return;
	}
	fputs(">\n", out);
	for (size_t i = 0; i < d->command_count; i++) {
		put_command(out, &d->command[i]);
	}
	fputs("          </CoE>\n", out);
}

static void put_mailbox(FILE *out, const struct esi_device *d)
{
	static const struct {
		uint8_t protocol;
		const char *name;
	} others[] = { { SII_MAILBOX_FOE, "FoE" },
		       { SII_MAILBOX_SOE, "SoE" },
		       { SII_MAILBOX_VOE, "VoE" } };

	if (!d->has_mailbox) {
		return;
	}
	fputs("        <Mailbox>\n", out);
	if ((d->protocols & SII_MAILBOX_AOE) != 0) {
		fputs("          <AoE/>\n", out);
	}
	if ((d->protocols & SII_MAILBOX_EOE) != 0) {
		fputs("          <EoE/>\n", out);
	}
	if ((d->protocols & SII_MAILBOX_COE) != 0) {
		put_coe(out, d);
	}
	for (size_t i = 0; i < sizeof(others) / sizeof(others[0]); i++) {
		if ((d->protocols & others[i].protocol) != 0) {
			fprintf(out, "          <%s/>\n", others[i].name);
		}
	}
	fputs("        </Mailbox>\n", out);
}

static void put_factor(FILE *out, const char *name, int factor, uint32_t value)
{
	fprintf(out, "            <%s", name);
	if (factor != 0) {
		fprintf(out, " Factor=\"%d\"", factor);
	}
	fprintf(out, ">%" PRIu32 "</%s>\n", value, name);
}

static void put_clocks(FILE *out, const struct esi_device *d)
{
	if (d->dc_count == 0) {
		return;
	}
	fputs("        <Dc>\n", out);
	for (size_t i = 0; i < d->dc_count; i++) {
		const struct esi_dc_mode *mode = &d->dc[i];

		fputs("          <OpMode>\n", out);
		element(out, "            ", "Name", mode->name);
		element(out, "            ", "Desc", mode->text);
		fprintf(out, "            <AssignActivate>#x%04X</AssignActivate>\n",
			mode->assign_activate);
		put_factor(out, "CycleTimeSync0", mode->sync0_factor, mode->sync0_cycle_ns);
		fprintf(out, "            <ShiftTimeSync0>%" PRId32 "</ShiftTimeSync0>\n",
			mode->sync0_shift_ns);
		put_factor(out, "CycleTimeSync1", mode->sync1_factor, 0);
		fprintf(out, "            <ShiftTimeSync1>%" PRId32 "</ShiftTimeSync1>\n",
			mode->sync1_shift_ns);
		fputs("          </OpMode>\n", out);
	}
	fputs("        </Dc>\n", out);
}

/* In the order of the schema of ETG.2000. */
static void put_device(FILE *out, const struct esi_device *d)
{
	fputs("      <Device", out);
	if (d->physics[0] != '\0') {
		fputs(" Physics=\"", out);
		xml_text_put(out, d->physics);
		fputc('"', out);
	}
	fprintf(out,
		">\n        <Type ProductCode=\"#x%08" PRIX32 "\" RevisionNo=\"#x%08" PRIX32 "\">",
		d->id.product, d->id.revision);
	xml_text_put(out, d->type);
	fputs("</Type>\n        <Name LcId=\"1033\">", out);
	xml_text_put(out, d->name);
	fputs("</Name>\n", out);
	put_timeouts(out, d);
	element(out, "        ", "GroupType", d->group);
	put_sms(out, d);
	for (size_t i = 0; i < d->pdo_count; i++) {
		if (!d->pdo[i].is_tx) {
			put_pdo(out, d, &d->pdo[i]);
		}
	}
	for (size_t i = 0; i < d->pdo_count; i++) {
		if (d->pdo[i].is_tx) {
			put_pdo(out, d, &d->pdo[i]);
		}
	}
	put_mailbox(out, d);
	put_clocks(out, d);
	if (d->eeprom_bytes != 0) {
		fprintf(out,
			"        <Eeprom>\n          <ByteSize>%" PRIu32 "</ByteSize>\n"
			"        </Eeprom>\n",
			d->eeprom_bytes);
	}
	fputs("      </Device>\n", out);
}

static void put_info(FILE *out, const struct esi_device *d)
{
	fprintf(out, "<EtherCATInfo>\n  <Vendor>\n    <Id>#x%08" PRIX32 "</Id>\n", d->id.vendor);
	element(out, "    ", "Name", d->vendor_name);
	fputs("  </Vendor>\n  <Descriptions>\n    <Groups>\n      <Group>\n", out);
	element(out, "        ", "Type", d->group);
	element(out, "        ", "Name", d->group_name);
	fputs("      </Group>\n    </Groups>\n    <Devices>\n", out);
	put_device(out, d);
	fputs("    </Devices>\n  </Descriptions>\n</EtherCATInfo>\n", out);
}

void esi_write(FILE *out, const struct esi_device *const *device, size_t count)
{
	fputs("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n", out);
	if (count != 1) {
		fputs("<EtherCATInfoList>\n", out);
	}
	for (size_t i = 0; i < count; i++) {
		put_info(out, device[i]);
	}
	if (count != 1) {
		fputs("</EtherCATInfoList>\n", out);
	}
}
