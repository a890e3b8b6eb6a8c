/* SPDX-License-Identifier: MIT */
#include "devices/coe_dictionary.h"

#include <string.h>

#include "base/bytes.h"

enum {
	DEVICE_TYPE = 0x1000,
	DEVICE_NAME = 0x1008,
	IDENTITY = 0x1018,
	SM_TYPES = 0x1c00,
	MODULAR_DEVICE = 5001, /* what Beckhoff's terminals say */
	SM_OUTPUTS = 3,
	SM_INPUTS = 4,
};

/* ETG.1020 base data types. */
enum { TYPE_UINT8 = 0x05, TYPE_UINT16 = 0x06, TYPE_UINT32 = 0x07, TYPE_STRING = 0x09 };

static void set_value(struct coe_value *v, uint64_t value, size_t len)
{
	v->len = len;
	for (size_t i = 0; i < len; i++) {
		v->bytes[i] = (uint8_t)(value >> (8 * i));
	}
}

void coe_dictionary_init(struct coe_dictionary *d, const struct sii *sii, const char *name)
{
	memset(d, 0, sizeof(*d));
	d->sii = sii;
	d->device_type = MODULAR_DEVICE;
	memcpy(d->name, name, strnlen(name, sizeof(d->name) - 1));
	coe_dictionary_reset(d);
}

void coe_dictionary_reset(struct coe_dictionary *d)
{
	memset(d->assignment, 0, sizeof(d->assignment));
	memset(d->entry_value, 0, sizeof(d->entry_value));
	for (size_t i = 0; i < d->sii->pdo_count; i++) {
		const struct sii_pdo *pdo = &d->sii->pdo[i];
		struct coe_assignment *a;

		if (pdo->sm >= d->sii->sm_count) {
			continue;
		}
		a = &d->assignment[pdo->sm];
		if (a->count < COE_ASSIGNED_MAX) {
			a->pdo[a->count++] = pdo->index;
		}
	}
}

/* --- finding --- */

static const struct sii_pdo *find_pdo(const struct sii *sii, uint16_t index)
{
	for (size_t i = 0; i < sii->pdo_count; i++) {
		if (sii->pdo[i].index == index) {
			return &sii->pdo[i];
		}
	}
	return NULL;
}

/* The SyncManager that 0x1c10 + n assigns PDOs to; NULL: none with process data. */
static const struct sii_sm *assigned_sm(const struct sii *sii, uint16_t index)
{
	size_t n = (size_t)(index - COE_ASSIGN_FIRST);

	if (index < COE_ASSIGN_FIRST || n >= sii->sm_count ||
	    (sii->sm[n].type != SM_OUTPUTS && sii->sm[n].type != SM_INPUTS)) {
		return NULL;
	}
	return &sii->sm[n];
}

/* Number of the entry @index:@subindex, or -1; its highest subindex into @ret_last, 0: no object.
 */
static int find_entry(const struct sii *sii, uint16_t index, uint8_t subindex, uint8_t *ret_last)
{
	int found = -1;

	*ret_last = 0;
	for (size_t i = 0; i < sii->entry_count; i++) {
		const struct sii_entry *e = &sii->entry[i];

		if (index == 0 || e->index != index) {
			continue;
		}
		*ret_last = e->subindex > *ret_last ? e->subindex : *ret_last;
		found = e->subindex == subindex && found < 0 ? (int)i : found;
	}
	return found;
}

/* --- reading --- */

static enum coe_abort read_identity(const struct sii *sii, uint8_t subindex, struct coe_value *ret)
{
	const uint32_t words[] = { 4, sii->vendor, sii->product, sii->revision, sii->serial };

	if (subindex > 4) {
		return COE_ABORT_NO_SUBINDEX;
	}
	set_value(ret, words[subindex], subindex == 0 ? 1 : 4);
	return COE_OK;
}

static enum coe_abort read_sm_types(const struct sii *sii, uint8_t subindex, struct coe_value *ret)
{
	if (subindex > sii->sm_count) {
		return COE_ABORT_NO_SUBINDEX;
	}
	set_value(ret, subindex == 0 ? sii->sm_count : sii->sm[subindex - 1].type, 1);
	return COE_OK;
}

static enum coe_abort read_assignment(const struct coe_assignment *a, uint8_t subindex,
				      struct coe_value *ret)
{
	if (subindex > a->count) {
		return COE_ABORT_NO_SUBINDEX;
	}
	set_value(ret, subindex == 0 ? a->count : a->pdo[subindex - 1], subindex == 0 ? 1 : 2);
	return COE_OK;
}

static enum coe_abort read_mapping(const struct sii *sii, const struct sii_pdo *pdo,
				   uint8_t subindex, struct coe_value *ret)
{
	const struct sii_entry *e;

	if (subindex > pdo->entry_count) {
		return COE_ABORT_NO_SUBINDEX;
	}
	if (subindex == 0) {
		set_value(ret, pdo->entry_count, 1);
		return COE_OK;
	}
	e = &sii->entry[pdo->first_entry + subindex - 1];
	set_value(ret, (uint32_t)e->index << 16 | (uint32_t)e->subindex << 8 | e->bit_len, 4);
	return COE_OK;
}

static enum coe_abort read_entry(const struct coe_dictionary *d, uint16_t index, uint8_t subindex,
				 struct coe_value *ret)
{
	uint8_t last;
	int n = find_entry(d->sii, index, subindex, &last);
	size_t bytes;

	if (n < 0 && last == 0) {
		return COE_ABORT_NO_OBJECT;
	}
	if (n < 0 && subindex == 0) {
		set_value(ret, last, 1);
		return COE_OK;
	}
	if (n < 0) {
		return COE_ABORT_NO_SUBINDEX;
	}
	bytes = (d->sii->entry[n].bit_len + 7u) / 8;
	memset(ret->bytes, 0, sizeof(ret->bytes));
	set_value(ret, d->entry_value[n], bytes < 8 ? bytes : 8);
	ret->len = bytes < COE_VALUE_BYTES ? bytes : COE_VALUE_BYTES;
	return COE_OK;
}

static enum coe_abort read_constant(const struct coe_dictionary *d, uint16_t index,
				    uint8_t subindex, struct coe_value *ret)
{
	enum coe_abort abort_code = COE_ABORT_NO_OBJECT;

	for (size_t i = 0; i < d->constant_count; i++) {
		const struct coe_constant *c = &d->constant[i];

		if (c->index != index) {
			continue;
		}
		if (c->subindex == subindex) {
			set_value(ret, c->value, c->bytes);
			return COE_OK;
		}
		abort_code = COE_ABORT_NO_SUBINDEX;
	}
	return abort_code;
}

enum coe_abort coe_dictionary_read(const struct coe_dictionary *d, uint16_t index, uint8_t subindex,
				   struct coe_value *ret)
{
	const struct sii_pdo *pdo = find_pdo(d->sii, index);
	enum coe_abort abort_code;

	if ((index == DEVICE_TYPE || index == DEVICE_NAME) && subindex != 0) {
		return COE_ABORT_NO_SUBINDEX;
	}
	if (index == DEVICE_TYPE) {
		set_value(ret, d->device_type, 4);
		return COE_OK;
	}
	if (index == DEVICE_NAME) {
		ret->len = strlen(d->name);
		memcpy(ret->bytes, d->name, ret->len);
		return COE_OK;
	}
	if (index == IDENTITY) {
		return read_identity(d->sii, subindex, ret);
	}
	if (index == SM_TYPES) {
		return read_sm_types(d->sii, subindex, ret);
	}
	if (assigned_sm(d->sii, index) != NULL) {
		return read_assignment(&d->assignment[index - COE_ASSIGN_FIRST], subindex, ret);
	}
	if (pdo != NULL) {
		return read_mapping(d->sii, pdo, subindex, ret);
	}
	abort_code = read_constant(d, index, subindex, ret);
	return abort_code != COE_ABORT_NO_OBJECT ? abort_code : read_entry(d, index, subindex, ret);
}

/* --- writing --- */

static enum coe_abort write_assignment(struct coe_dictionary *d, uint16_t index, uint8_t subindex,
				       const uint8_t *bytes, size_t len)
{
	struct coe_assignment *a = &d->assignment[index - COE_ASSIGN_FIRST];
	int is_tx = assigned_sm(d->sii, index)->type == SM_INPUTS;
	const struct sii_pdo *pdo;

	if (d->is_fixed) {
		return COE_ABORT_READ_ONLY;
	}
	if (!d->is_preop) {
		return COE_ABORT_STATE;
	}
	if (len != (subindex == 0 ? 1 : 2)) {
		return COE_ABORT_LENGTH;
	}
	if (subindex == 0) {
		for (uint8_t i = 0; i < bytes[0]; i++) {
			if (i >= COE_ASSIGNED_MAX || a->pdo[i] == 0) {
				return COE_ABORT_TOO_MANY;
			}
		}
		a->count = bytes[0];
		return COE_OK;
	}
	if (a->count != 0) {
		return COE_ABORT_COUNT_NOT_ZERO;
	}
	if (subindex > COE_ASSIGNED_MAX) {
		return COE_ABORT_NO_SUBINDEX;
	}
	pdo = find_pdo(d->sii, get_le16(bytes));
	if (pdo == NULL || pdo->is_tx != is_tx) {
		return COE_ABORT_NOT_MAPPABLE;
	}
	a->pdo[subindex - 1] = pdo->index;
	return COE_OK;
}

enum coe_abort coe_dictionary_write(struct coe_dictionary *d, uint16_t index, uint8_t subindex,
				    const uint8_t *bytes, size_t len)
{
	struct coe_value now;
	enum coe_abort abort_code;
	uint8_t last;
	int n = find_entry(d->sii, index, subindex, &last);
	uint64_t value = 0;

	if (assigned_sm(d->sii, index) != NULL) {
		return write_assignment(d, index, subindex, bytes, len);
	}
	abort_code = coe_dictionary_read(d, index, subindex, &now);
	if (abort_code != COE_OK) {
		return abort_code;
	}
	if (n < 0 || find_pdo(d->sii, index) != NULL || now.len > sizeof(value)) {
		return COE_ABORT_READ_ONLY;
	}
	if (len != now.len) {
		return COE_ABORT_LENGTH;
	}
	for (size_t i = 0; i < len; i++) {
		value |= (uint64_t)bytes[i] << (8 * i);
	}
	d->entry_value[n] = value;
	return COE_OK;
}

/* --- SDO information --- */

static const char *text_of(const struct coe_dictionary *d, uint8_t number)
{
	return number > 0 && number <= d->text_count ? d->text[number - 1] : "";
}

enum coe_abort coe_dictionary_entry_info(const struct coe_dictionary *d, uint16_t index,
					 uint8_t subindex, struct coe_entry_info *ret)
{
	static const uint16_t unsigned_by_bytes[] = { 0, TYPE_UINT8, TYPE_UINT16, 0, TYPE_UINT32 };
	struct coe_value v;
	enum coe_abort abort_code = coe_dictionary_read(d, index, subindex, &v);
	uint8_t last;
	int n = find_entry(d->sii, index, subindex, &last);

	if (abort_code != COE_OK) {
		return abort_code;
	}
	ret->text = "";
	ret->unit = 0;
	ret->bit_len = (uint16_t)(v.len * 8);
	ret->data_type = index == DEVICE_NAME ? TYPE_STRING
			 : v.len <= 4         ? unsigned_by_bytes[v.len]
					      : 0;
	if (n >= 0 && find_pdo(d->sii, index) == NULL) {
		const struct sii_entry *e = &d->sii->entry[n];

		*ret = (struct coe_entry_info){ .data_type = e->data_type,
						.bit_len = e->bit_len,
						.text = text_of(d, e->name),
						.unit = d->unit != NULL ? d->unit[n] : 0 };
	}
	return COE_OK;
}

static void take_lowest(uint16_t index, uint16_t after, uint16_t *lowest)
{
	if (index > after && (*lowest == 0 || index < *lowest)) {
		*lowest = index;
	}
}

uint16_t coe_dictionary_next(const struct coe_dictionary *d, uint16_t after)
{
	static const uint16_t always[] = { DEVICE_TYPE, DEVICE_NAME, IDENTITY, SM_TYPES };
	uint16_t lowest = 0;

	for (size_t i = 0; i < sizeof(always) / sizeof(always[0]); i++) {
		take_lowest(always[i], after, &lowest);
	}
	for (size_t n = 0; n < d->sii->sm_count; n++) {
		uint16_t index = (uint16_t)(COE_ASSIGN_FIRST + n);

		if (assigned_sm(d->sii, index) != NULL) {
			take_lowest(index, after, &lowest);
		}
	}
	for (size_t i = 0; i < d->sii->pdo_count; i++) {
		take_lowest(d->sii->pdo[i].index, after, &lowest);
	}
	for (size_t i = 0; i < d->sii->entry_count; i++) {
		take_lowest(d->sii->entry[i].index, after, &lowest);
	}
	for (size_t i = 0; i < d->constant_count; i++) {
		take_lowest(d->constant[i].index, after, &lowest);
	}
	return lowest;
}

uint32_t coe_dictionary_sm_bits(const struct coe_dictionary *d, size_t sm)
{
	const struct coe_assignment *a = &d->assignment[sm];
	uint32_t bits = 0;

	for (uint8_t i = 0; i < a->count; i++) {
		const struct sii_pdo *pdo = find_pdo(d->sii, a->pdo[i]);

		bits += pdo != NULL ? pdo->bits : 0;
	}
	return bits;
}

int coe_dictionary_sm_has_twice(const struct coe_dictionary *d, size_t sm)
{
	const struct coe_assignment *a = &d->assignment[sm];

	for (uint8_t i = 0; i < a->count; i++) {
		for (uint8_t j = 0; j < i; j++) {
			if (a->pdo[i] == a->pdo[j] && a->pdo[i] != 0) {
				return 1;
			}
		}
	}
	return 0;
}
