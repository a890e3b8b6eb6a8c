/* SPDX-License-Identifier: MIT */
#include "base/admin_protocol.h"

#include "base/clock.h"
#include "harness/test.h"

static int64_t timeout_s(enum admin_verb verb, uint16_t slave_pos)
{
	const struct admin_request rq = { .verb = verb, .slave_pos = slave_pos };

	return admin_timeout_ns(&rq) / NS_PER_S;
}

TEST(admin_protocol, a_request_may_name_its_time_out)
{
	const struct admin_request rq = { .verb = ADMIN_FOE_WRITE, .timeout_ms = 250 };

	CHECK_EQ(admin_timeout_ns(&rq), 250 * NS_PER_MS);
}

TEST(admin_protocol, long_verbs_have_time_outs_of_their_own)
{
	CHECK_EQ(timeout_s(ADMIN_SET, 0), 1);
	CHECK_EQ(timeout_s(ADMIN_SII_WRITE, 0), 600);
	CHECK_EQ(timeout_s(ADMIN_FOE_READ, 0), 3600);
	CHECK_EQ(timeout_s(ADMIN_STATE, ADMIN_ALL_SLAVES), 600);
}

TEST(admin_protocol, any_other_verb_has_the_common_time_out)
{
	CHECK_EQ(timeout_s(ADMIN_STATE, 0), ADMIN_TIMEOUT_S);
	CHECK_EQ(timeout_s(ADMIN_SDO_READ, 0), ADMIN_TIMEOUT_S);
	CHECK_EQ(timeout_s(ADMIN_VOE, 0), ADMIN_TIMEOUT_S);
	CHECK_EQ(timeout_s((enum admin_verb)1000, 0), ADMIN_TIMEOUT_S);
}
