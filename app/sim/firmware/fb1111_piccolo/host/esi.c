/* SPDX-License-Identifier: MIT */
#include "esi.h"

#include <inttypes.h>

#include "../description.h"
#include "base/xml_text.h"

const char *fb1111_piccolo_esi_type(unsigned type)
{
	switch ((enum piccolo_type)type) {
	case PICCOLO_BOOL:
		return "BOOL";
	case PICCOLO_USINT:
		return "USINT";
	case PICCOLO_UINT:
		return "UINT";
	case PICCOLO_UDINT:
		return "UDINT";
	case PICCOLO_ULINT:
		return "ULINT";
	case PICCOLO_STRING:
		return "STRING";
	case PICCOLO_PADDING:
		return "";
	}
	return "";
}

static void element(FILE *out, const char *indent, const char *name, const char *text)
{
	fprintf(out, "%s<%s>", indent, name);
	xml_text_put(out, text);
	fprintf(out, "</%s>\n", name);
}

static void put_entry(FILE *out, const struct piccolo_entry *e)
{
	fputs("          <Entry>\n", out);
	fprintf(out, "            <Index>#x%04X</Index>\n", (unsigned)e->index);
	if (e->name != NULL) {
		fprintf(out, "            <SubIndex>%u</SubIndex>\n", (unsigned)e->subindex);
	}
	fprintf(out, "            <BitLen>%u</BitLen>\n", (unsigned)e->bits);
	if (e->name != NULL) {
		element(out, "            ", "Name", e->name);
		element(out, "            ", "DataType",
			fb1111_piccolo_esi_type((unsigned)e->type));
	}
	fputs("          </Entry>\n", out);
}

static void put_pdo(FILE *out, const char *kind, const struct piccolo_pdo *pdo)
{
	fprintf(out, "        <%s Fixed=\"1\" Mandatory=\"1\" Sm=\"%u\">\n", kind,
		(unsigned)pdo->sm);
	fprintf(out, "          <Index>#x%04X</Index>\n", (unsigned)pdo->index);
	element(out, "          ", "Name", pdo->name);
	for (unsigned i = 0; i < pdo->entry_count; i++) {
		put_entry(out, &pdo->entries[i]);
	}
	fprintf(out, "        </%s>\n", kind);
}

static void put_process_data(FILE *out)
{
	const struct piccolo_description *d = &piccolo_description;

	for (unsigned i = 0; i < PICCOLO_FMMU_COUNT; i++) {
		element(out, "        ", "Fmmu", d->fmmu[i].name);
	}
	for (unsigned i = 0; i < PICCOLO_SM_COUNT; i++) {
		const struct piccolo_sm *sm = &d->sm[i];

		fprintf(out,
			"        <Sm DefaultSize=\"%u\" StartAddress=\"#x%04X\" "
			"ControlByte=\"#x%02X\" "
			"Enable=\"1\">%s</Sm>\n",
			(unsigned)sm->length, (unsigned)sm->start, (unsigned)sm->control, sm->name);
	}
	put_pdo(out, "RxPdo", &d->rx);
	put_pdo(out, "TxPdo", &d->tx);
}

static void put_dc(FILE *out)
{
	fputs("        <Dc>\n", out);
	for (unsigned i = 0; i < PICCOLO_DC_MODE_COUNT; i++) {
		const struct piccolo_dc_mode *mode = &piccolo_description.dc[i];

		fputs("          <OpMode>\n", out);
		element(out, "            ", "Name", mode->name);
		element(out, "            ", "Desc", mode->text);
		fprintf(out, "            <AssignActivate>#x%04X</AssignActivate>\n",
			(unsigned)mode->assign_activate);
		if (mode->sync0_factor != 0) {
			fprintf(out,
				"            <CycleTimeSync0 Factor=\"%u\">0</CycleTimeSync0>\n"
				"            <ShiftTimeSync0>0</ShiftTimeSync0>\n",
				(unsigned)mode->sync0_factor);
		}
		fputs("          </OpMode>\n", out);
	}
	fputs("        </Dc>\n", out);
}

static void put_le16(FILE *out, uint16_t value)
{
	fprintf(out, "%02X%02X", value & 0xffu, value >> 8u);
}

static void put_eeprom(FILE *out)
{
	fputs("        <Eeprom>\n", out);
	fprintf(out, "          <ByteSize>%d</ByteSize>\n", (int)PICCOLO_EEPROM_OCTETS);
	fputs("          <ConfigData>", out);
	for (unsigned i = 0; i < PICCOLO_CONFIG_OCTETS; i++) {
		fprintf(out, "%02X", (unsigned)piccolo_description.config[i]);
	}
	fputs("</ConfigData>\n          <BootStrap>", out);
	for (unsigned i = 0; i < 2; i++) {
		put_le16(out, piccolo_description.sm[i].start);
		put_le16(out, piccolo_description.sm[i].length);
	}
	fputs("</BootStrap>\n        </Eeprom>\n", out);
}

static void put_device(FILE *out)
{
	const struct piccolo_description *d = &piccolo_description;

	fputs("      <Device Physics=\"YY\">\n", out);
	fprintf(out,
		"        <Type ProductCode=\"#x%08" PRIX32 "\" RevisionNo=\"#x%08" PRIX32 "\">",
		PICCOLO_PRODUCT_CODE, PICCOLO_REVISION);
	xml_text_put(out, d->order);
	fputs("</Type>\n        <Name LcId=\"1033\">", out);
	xml_text_put(out, d->name);
	fputs("</Name>\n", out);
	element(out, "        ", "GroupType", d->group);
	fputs("        <Profile>\n          <ProfileNo>5001</ProfileNo>\n", out);
	fb1111_piccolo_esi_dictionary(out);
	fputs("        </Profile>\n", out);
	put_process_data(out);
	fputs("        <Mailbox DataLinkLayer=\"1\">\n"
	      "          <CoE SdoInfo=\"0\" PdoAssign=\"0\" PdoConfig=\"0\" "
	      "CompleteAccess=\"0\"/>\n"
	      "          <FoE/>\n"
	      "        </Mailbox>\n",
	      out);
	put_dc(out);
	put_eeprom(out);
	fputs("      </Device>\n", out);
}

void fb1111_piccolo_esi(FILE *out)
{
	const struct piccolo_description *d = &piccolo_description;

	fputs("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<EtherCATInfo>\n  <Vendor>\n", out);
	fprintf(out, "    <Id>#x%08" PRIX32 "</Id>\n", PICCOLO_VENDOR_ID);
	element(out, "    ", "Name", d->vendor_name);
	fputs("  </Vendor>\n  <Descriptions>\n    <Groups>\n      <Group>\n", out);
	element(out, "        ", "Type", d->group);
	element(out, "        ", "Name", d->group_name);
	fputs("      </Group>\n    </Groups>\n    <Devices>\n", out);
	put_device(out);
	fputs("    </Devices>\n  </Descriptions>\n</EtherCATInfo>\n", out);
}
