/* SPDX-License-Identifier: MIT */
/* EEPROM images from anywhere: parsed, its names read, what was found inside of its limits. */
#include "wire/sii.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void check_limits(const struct sii *sii)
{
	size_t entries = 0;

	if (sii->sm_count > SII_LIMIT_SM || sii->fmmu_count > SII_LIMIT_FMMU ||
	    sii->pdo_count > SII_LIMIT_PDO || sii->entry_count > SII_LIMIT_ENTRIES) {
		__builtin_trap();
	}
	for (size_t i = 0; i < sii->pdo_count; i++) {
		const struct sii_pdo *pdo = &sii->pdo[i];

		entries += pdo->entry_count;
		if ((size_t)pdo->first_entry + pdo->entry_count > sii->entry_count) {
			__builtin_trap();
		}
	}
	if (entries != sii->entry_count) {
		__builtin_trap();
	}
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	static struct sii sii;
	char error[160] = "";
	char name[SII_NAME_BYTES];
	size_t offset = 0;
	size_t bytes = 0;

	if (sii_parse(data, size, &sii, error, sizeof(error)) < 0 && error[0] == '\0') {
		__builtin_trap(); /* refused without a reason */
	}
	check_limits(&sii);
	sii_text(data, size, sii.device_name, name);
	sii_text(data, size, 255, name);
	if (sii_find_category(data, size, SII_CATEGORY_SM, &offset, &bytes) == 0 &&
	    (offset > size || bytes > size - offset)) {
		__builtin_trap();
	}
	return 0;
}
