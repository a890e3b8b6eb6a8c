/* SPDX-License-Identifier: MIT */
/* May a writer set this value? */
#include "config/output.h"

#include <errno.h>
#include <math.h>

#include "harness/test.h"
#include "image/image.h"

static const struct channel speed = { .name = "a.speed",
				      .direction = CHANNEL_OUTPUT,
				      .type = CHANNEL_FLOAT,
				      .bit_len = 32,
				      .scale = 1 };
static struct config cfg;
static char reason[128];

static int check(const char *text)
{
	uint64_t raw;

	CHECK_EQ(image_raw_parse(&speed, text, &raw), 0);
	reason[0] = '\0';
	return config_output_check(&cfg, &speed, CONFIG_OWNER_LOCAL, raw, reason, sizeof(reason));
}

TEST(config_output, a_value_that_is_not_a_number_is_refused_with_and_without_limits)
{
	memset(&cfg, 0, sizeof(cfg));
	CHECK_EQ(check("1e9"), 0);
	CHECK_EQ(check("inf"), 0);
	CHECK_EQ(check("nan"), -ERANGE);
	CHECK_STR(reason, "a.speed: is not a number");
	cfg.output_count = 1;
	cfg.output[0] = (struct config_output){ .channel = "a.speed", .min = -10, .max = 10 };
	CHECK_EQ(check("-10"), 0);
	CHECK_EQ(check("-nan"), -ERANGE);
	CHECK_STR(reason, "a.speed: is not a number");
	CHECK_EQ(check("11"), -ERANGE);
	CHECK_STR(reason, "a.speed: 11 is outside -10 to 10 (outputs[])");
	cfg.output[0].min = -INFINITY;
	cfg.output[0].max = INFINITY;
	CHECK_EQ(check("nan"), -ERANGE);
}
