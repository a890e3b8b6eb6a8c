/* SPDX-License-Identifier: MIT */
/* Catalogue texts from anywhere: refused with a line, or a model whose image parses to the same. */
#include <stdlib.h>
#include <string.h>

#include "devices/slave_model.h"
#include "wire/sii.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void check_image(const struct slave_model *model)
{
	static uint8_t image[MODEL_SII_BYTES];
	static struct sii made;
	char error[160] = "";
	size_t bytes = slave_model_sii(model, image);

	if (bytes > sizeof(image) || sii_parse(image, bytes, &made, error, sizeof(error)) < 0) {
		__builtin_trap();
	}
	if (made.sm_count != model->sii.sm_count || made.pdo_count != model->sii.pdo_count ||
	    made.entry_count != model->sii.entry_count || made.product != model->sii.product ||
	    memcmp(made.entry, model->sii.entry, made.entry_count * sizeof(made.entry[0])) != 0) {
		__builtin_trap();
	}
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	static struct slave_model model;
	char error[160] = "";
	char *text = malloc(size + 1);

	if (text == NULL) {
		return 0;
	}
	memcpy(text, data, size);
	text[size] = '\0';
	if (slave_model_parse("fuzz", text, &model, error, sizeof(error)) == 0) {
		check_image(&model);
	} else if (strncmp(error, "fuzz.txt:", 9) != 0) {
		__builtin_trap(); /* refused without a line */
	}
	free(text);
	return 0;
}
