/* SPDX-License-Identifier: MIT */
#include "unit/core/config/parsing.h"

#include <errno.h>

#include "harness/test.h"

void parse_ok(const char *text, struct config *cfg)
{
	char error[256] = "";

	memset(cfg, 0x5a, sizeof(*cfg));
	if (config_parse("t.yaml", text, strlen(text), cfg, error, sizeof(error)) != 0) {
		test_fail(__FILE__, __LINE__, "refused: %s", error);
	}
}

void parse_fails(const char *text, const char *wanted)
{
	static struct config before;
	static struct config cfg;
	char error[256] = "no error text";

	memset(&cfg, 0x5a, sizeof(cfg));
	before = cfg;
	CHECK_EQ(config_parse("t.yaml", text, strlen(text), &cfg, error, sizeof(error)), -EINVAL);
	CHECK_STR(error, wanted);
	CHECK_MEM(&cfg, &before, sizeof(cfg));
}
