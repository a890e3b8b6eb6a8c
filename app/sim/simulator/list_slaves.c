/* SPDX-License-Identifier: MIT */
#include "simulator/list_slaves.h"

#include <stdio.h>

#include "devices/catalogue.h"
#include "devices/fb1111_piccolo.h"
#include "wire/esc_reg.h"
#include "wire/sii.h"

static void print_ports(uint8_t descriptor)
{
	static const char *const kinds[] = { "", "", " E-bus", " MII" };

	for (unsigned port = 0; port < ESC_PORTS; port++) {
		fputs(kinds[descriptor >> 2 * port & 3], stdout);
	}
}

static void print_mailbox(uint16_t protocols)
{
	static const char *const names[] = { "AoE", "EoE", "CoE", "FoE", "SoE", "VoE" };

	for (unsigned i = 0; i < sizeof(names) / sizeof(names[0]); i++) {
		if (protocols >> i & 1) {
			printf(" %s", names[i]);
		}
	}
}

/* Bits of the PDOs that are assigned by default. */
static uint32_t assigned_bits(const struct sii *sii, uint8_t is_tx)
{
	uint32_t bits = 0;

	for (size_t i = 0; i < sii->pdo_count; i++) {
		const struct sii_pdo *pdo = &sii->pdo[i];

		bits += pdo->is_tx == is_tx && pdo->sm < sii->sm_count ? pdo->bits : 0;
	}
	return bits;
}

static void print_row(const char *name, const uint8_t *image, size_t image_bytes,
		      const struct esc_features *features)
{
	static struct sii sii;
	char device[SII_NAME_BYTES];
	char error[160];

	(void)sii_parse(image, image_bytes, &sii, error, sizeof(error));
	sii_text(image, image_bytes, sii.device_name, device);
	printf("| %s | %s |", name, device);
	print_ports(features->port_descriptor);
	printf(" |");
	print_mailbox(sii.mailbox_protocols);
	printf(" | %u | %u |", assigned_bits(&sii, 1), assigned_bits(&sii, 0));
	for (size_t i = 0; i < sii.dc_mode_count; i++) {
		printf("%s 0x%04x", i > 0 ? "," : "", sii.dc_mode[i].assign_activate);
	}
	puts(" |");
}

int list_slaves(void)
{
	static struct slave_model model;
	static uint8_t image[MODEL_SII_BYTES];
	struct segment_slave_spec board;
	int r = fb1111_piccolo_slave(0, &board);

	if (r < 0) {
		return r;
	}
	puts("| name | device | ports | mailbox | input bits | output bits | DC |\n"
	     "| --- | --- | --- | --- | --- | --- | --- |");
	for (size_t i = 0; i < catalogue_count(); i++) {
		catalogue_read(i, &model);
		print_row(model.name, image, slave_model_sii(&model, image), &model.features);
	}
	print_row("fb1111_piccolo", board.sii, board.sii_bytes, board.features);
	board.device->ops->destroy(board.device);
	return 0;
}
