/* SPDX-License-Identifier: MIT */
/*
 * Bytes as an ecdaq.yaml. Whatever they are: no crash, a refusal is one line and leaves the
 * configuration alone, and what is accepted is within its bounds and fits together.
 */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "config/config.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void require(int condition, const char *what)
{
	if (!condition) {
		fprintf(stderr, "fuzz_config: %s\n", what);
		abort();
	}
}

static void judge_refusal(const struct config *cfg, const char *error)
{
	static struct config untouched;

	memset(&untouched, 0x5a, sizeof(untouched));
	require(memcmp(cfg, &untouched, sizeof(untouched)) == 0,
		"a refusal touched the configuration");
	require(strncmp(error, "f.yaml:", 7) == 0, "no FILE:LINE");
	require(strpbrk(error, "\n\r") == NULL, "more than one line");
}

static void judge_config(const struct config *cfg)
{
	char error[256];

	require(config_check(cfg, error, sizeof(error)) == 0,
		"accepted, but does not fit together");
	require(cfg->cycle_period_ns >= 250000 && cfg->cycle_period_ns <= 10000000, "period");
	require(cfg->cycle_phase_percent >= 5 && cfg->cycle_phase_percent <= 95, "phase");
	require(cfg->slave_count <= LIMIT_SLAVES, "slaves");
	require(cfg->sdo_count <= CONFIG_LIMIT_SDOS, "sdos");
	require(cfg->output_count <= CONFIG_LIMIT_OUTPUTS, "outputs");
	for (size_t i = 0; i < cfg->sdo_count; i++) {
		require(cfg->sdo[i].slave_pos < cfg->slave_count, "an object of no slave");
		require(cfg->sdo[i].bytes >= 8 || cfg->sdo[i].value >> (8 * cfg->sdo[i].bytes) == 0,
			"a value wider than its type");
	}
	for (size_t i = 0; i < cfg->output_count; i++) {
		require(cfg->output[i].min <= cfg->output[i].max, "limits");
	}
}

/* The first lines also as options of a command line. */
static void try_lines(const uint8_t *data, size_t size)
{
	static struct config cfg;
	char line[64];
	char error[256];
	size_t len = 0;

	config_defaults(&cfg);
	for (size_t i = 0; i < size && i < 128; i++) {
		if (data[i] != '\n' && len < sizeof(line) - 1) {
			line[len++] = (char)data[i];
			continue;
		}
		line[len] = '\0';
		len = 0;
		error[0] = '\0';
		if (config_set(&cfg, line, error, sizeof(error)) < 0) {
			require(error[0] != '\0' && strpbrk(error, "\n\r") == NULL, "not one line");
		}
	}
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	static struct config cfg;
	char error[256] = "";

	memset(&cfg, 0x5a, sizeof(cfg));
	if (config_parse("f.yaml", (const char *)data, size, &cfg, error, sizeof(error)) < 0) {
		judge_refusal(&cfg, error);
	} else {
		judge_config(&cfg);
	}
	try_lines(data, size);
	return 0;
}
