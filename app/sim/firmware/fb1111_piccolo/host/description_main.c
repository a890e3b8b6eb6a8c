/* SPDX-License-Identifier: MIT */
/* fb1111-piccolo-description: writes the slave's EEPROM image and ESI file. */
#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "../description.h"
#include "esi.h"
#include "sii.h"

static const char program[] = "fb1111-piccolo-description";

static void usage(FILE *out)
{
	fprintf(out,
		"usage: %s [--sii FILE] [--esi FILE]\n"
		"Write the EEPROM image (--sii) and the ESI file (--esi) of the FB1111-Piccolo "
		"slave.\n"
		"FILE \"-\" is standard output. Exit codes: 0 done, 1 a file cannot be written, 2 "
		"usage.\n",
		program);
}

static void put_sii(FILE *out)
{
	uint8_t image[PICCOLO_EEPROM_OCTETS];
	size_t len = fb1111_piccolo_sii(image, sizeof(image));

	(void)fwrite(image, 1, len, out); /* errors show in ferror() */
}

/* 0, or 1 with one line on standard error. */
static int write_file(const char *path, void (*put)(FILE *out))
{
	int is_stdout = strcmp(path, "-") == 0;
	FILE *out = is_stdout ? stdout : fopen(path, "wb");
	int is_bad;

	if (out == NULL) {
		fprintf(stderr, "%s: %s: %s\n", program, path, strerror(errno));
		return 1;
	}
	put(out);
	is_bad = ferror(out) != 0;
	is_bad |= is_stdout ? fflush(out) != 0 : fclose(out) != 0;
	if (is_bad) {
		fprintf(stderr, "%s: %s: cannot write: %s\n", program, path, strerror(errno));
	}
	return is_bad;
}

int main(int argc, char **argv)
{
	const char *sii = NULL;
	const char *esi = NULL;
	int r = 0;

	for (int i = 1; i < argc; i++) {
		if (strcmp(argv[i], "--help") == 0) {
			usage(stdout);
			return 0;
		}
		if (strcmp(argv[i], "--sii") == 0 && i + 1 < argc) {
			sii = argv[++i];
		} else if (strcmp(argv[i], "--esi") == 0 && i + 1 < argc) {
			esi = argv[++i];
		} else {
			fprintf(stderr, "%s: %s: unknown, or without its file; see --help\n",
				program, argv[i]);
			return 2;
		}
	}
	if (sii == NULL && esi == NULL) {
		fprintf(stderr, "%s: nothing to write: give --sii FILE or --esi FILE\n", program);
		return 2;
	}
	if (sii != NULL) {
		r |= write_file(sii, put_sii);
	}
	if (esi != NULL) {
		r |= write_file(esi, fb1111_piccolo_esi);
	}
	return r;
}
