/* SPDX-License-Identifier: MIT */
/* The object dictionary as ESI has it, since the slave has no SDO information service. */
#include <inttypes.h>

#include "../objects.h"
#include "base/xml_text.h"
#include "esi.h"

/* Objects are read from a firmware that was just powered on, so defaults are what it really
 * answers. */
static void no_interrupts(void *ctx)
{
	(void)ctx;
}

static struct piccolo fresh(void)
{
	struct piccolo p = { .al = { .state = PICCOLO_INIT } };

	p.hal.interrupts_off = no_interrupts;
	p.hal.interrupts_on = no_interrupts;
	piccolo_settings_reset(&p);
	return p;
}

static unsigned default_octets(const struct piccolo_object *object, octet_t *data)
{
	struct piccolo p = fresh();

	return piccolo_object_read(&p, object, data);
}

static unsigned bits_of(const struct piccolo_object *object)
{
	octet_t data[OBJECT_OCTETS_MAX];

	return object->type == PICCOLO_BOOL ? 1 : 8u * default_octets(object, data);
}

static void put_type(FILE *out, const struct piccolo_object *object)
{
	octet_t data[OBJECT_OCTETS_MAX];

	fputs(fb1111_piccolo_esi_type((unsigned)object->type), out);
	if (object->type == PICCOLO_STRING) {
		fprintf(out, "(%u)", default_octets(object, data));
	}
}

/* The objects from @first on that share its index. */
static unsigned group_size(const struct piccolo_object *first)
{
	unsigned n = 0;
	unsigned left = piccolo_object_count - (unsigned)(first - piccolo_objects);

	while (n < left && first[n].index == first->index) {
		n++;
	}
	return n;
}

/* Entry n of a record: subindex 0 takes 16 bits, the others follow without gaps. */
static unsigned bit_offset(const struct piccolo_object *first, unsigned n)
{
	unsigned offset = n == 0 ? 0 : 16;

	for (unsigned i = 1; i < n; i++) {
		offset += bits_of(&first[i]);
	}
	return offset;
}

static void put_access(FILE *out, const char *indent, enum piccolo_access access)
{
	fprintf(out, "%s<Flags><Access%s>%s</Access></Flags>\n", indent,
		access == ACCESS_RW_PREOP ? " WriteRestrictions=\"PreOP\"" : "",
		access == ACCESS_RO ? "ro" : "rw");
}

static void put_record_type(FILE *out, const struct piccolo_object *first, unsigned count)
{
	fprintf(out, "              <DataType>\n                <Name>DT%04X</Name>\n",
		(unsigned)first->index);
	fprintf(out, "                <BitSize>%u</BitSize>\n", bit_offset(first, count));
	for (unsigned i = 0; i < count; i++) {
		fprintf(out,
			"                <SubItem>\n                  <SubIdx>%u</SubIdx>\n"
			"                  <Name>",
			(unsigned)first[i].subindex);
		xml_text_put(out, i == 0 ? "SubIndex 000" : first[i].name);
		fputs("</Name>\n                  <Type>", out);
		put_type(out, &first[i]);
		fprintf(out,
			"</Type>\n                  <BitSize>%u</BitSize>\n"
			"                  <BitOffs>%u</BitOffs>\n",
			bits_of(&first[i]), bit_offset(first, i));
		put_access(out, "                  ", first[i].access);
		fputs("                </SubItem>\n", out);
	}
	fputs("              </DataType>\n", out);
}

/* Simple types once each, then one record type per object with entries. */
static void put_types(FILE *out)
{
	static const enum piccolo_type simple[] = { PICCOLO_BOOL, PICCOLO_USINT, PICCOLO_UINT,
						    PICCOLO_UDINT, PICCOLO_ULINT };
	unsigned i;

	for (i = 0; i < sizeof(simple) / sizeof(simple[0]); i++) {
		unsigned bits = simple[i] == PICCOLO_BOOL ? 1 : 8u * piccolo_type_octets(simple[i]);

		fprintf(out,
			"              <DataType><Name>%s</Name><BitSize>%u</BitSize></DataType>\n",
			fb1111_piccolo_esi_type((unsigned)simple[i]), bits);
	}
	for (i = 0; i < piccolo_object_count; i++) {
		const struct piccolo_object *o = &piccolo_objects[i];

		if (o->type == PICCOLO_STRING) {
			fputs("              <DataType><Name>", out);
			put_type(out, o);
			fprintf(out, "</Name><BitSize>%u</BitSize></DataType>\n", bits_of(o));
		}
		if (o->subindex == 0 && group_size(o) > 1) {
			put_record_type(out, o, group_size(o));
		}
	}
}

/* DefaultData is hexadecimal, in the order of the wire. */
static void put_default(FILE *out, const struct piccolo_object *object)
{
	octet_t data[OBJECT_OCTETS_MAX];
	unsigned len = default_octets(object, data);

	fputs("<Info><DefaultData>", out);
	for (unsigned i = 0; i < len; i++) {
		fprintf(out, "%02X", (unsigned)data[i]);
	}
	fputs("</DefaultData></Info>", out);
}

static void put_object(FILE *out, const struct piccolo_object *first, unsigned count)
{
	fprintf(out,
		"              <Object>\n                <Index>#x%04X</Index>\n"
		"                <Name>",
		(unsigned)first->index);
	xml_text_put(out, first->name);
	fputs("</Name>\n                <Type>", out);
	if (count > 1) {
		fprintf(out, "DT%04X</Type>\n                <BitSize>%u</BitSize>\n",
			(unsigned)first->index, bit_offset(first, count));
		fputs("                <Info>\n", out);
		for (unsigned i = 0; i < count; i++) {
			fputs("                  <SubItem><Name>", out);
			xml_text_put(out, i == 0 ? "SubIndex 000" : first[i].name);
			fputs("</Name>", out);
			put_default(out, &first[i]);
			fputs("</SubItem>\n", out);
		}
		fputs("                </Info>\n", out);
	} else {
		put_type(out, first);
		fprintf(out, "</Type>\n                <BitSize>%u</BitSize>\n                ",
			bits_of(first));
		put_default(out, first);
		fputc('\n', out);
	}
	put_access(out, "                ", first->access);
	fputs("              </Object>\n", out);
}

void fb1111_piccolo_esi_dictionary(FILE *out)
{
	fputs("          <Dictionary>\n            <DataTypes>\n", out);
	put_types(out);
	fputs("            </DataTypes>\n            <Objects>\n", out);
	for (unsigned i = 0; i < piccolo_object_count; i++) {
		const struct piccolo_object *o = &piccolo_objects[i];

		if (o->subindex == 0) {
			put_object(out, o, group_size(o));
		}
	}
	fputs("            </Objects>\n          </Dictionary>\n", out);
}
