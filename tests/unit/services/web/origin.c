/* SPDX-License-Identifier: MIT */
#include "web/origin.h"

#include "harness/test.h"

TEST(web, a_host_that_is_an_address_or_a_name_of_this_machine_is_served)
{
	static const char *const ours[] = {
		"localhost",      "LOCALHOST:8765", "127.0.0.1", "192.168.7.2:8765", "[::1]",
		"[fe80::1]:8765", "daq:8765",       "daq.local", "Plant.example",    "b.example:1",
	};

	for (size_t i = 0; i < sizeof(ours) / sizeof(ours[0]); i++) {
		CHECK_EQ(origin_host_is_ours(ours[i], "daq", "plant.example, b.example"), 1);
	}
}

TEST(web, a_host_of_another_name_is_rejected)
{
	static const char *const foreign[] = {
		"",
		"evil.example",
		"localhost.evil.example",
		"127.0.0.1.evil.example",
		"daq.evil",
		"daqs",
		"plant",
		"plant.example.evil",
		",",
		" ",
		"[::1",
		"[::1]x",
		"[]:1",
		":8765",
		"127.0.0.1:80a",
		"127.0.0.1@evil.example",
	};

	for (size_t i = 0; i < sizeof(foreign) / sizeof(foreign[0]); i++) {
		CHECK_EQ(origin_host_is_ours(foreign[i], "daq", "plant.example, b.example"), 0);
		CHECK_EQ(origin_host_is_ours(foreign[i], "", ""), 0);
	}
}

TEST(web, our_own_page_and_the_origins_of_the_option_may_connect)
{
	CHECK_EQ(origin_is_allowed("", "127.0.0.1:8765", ""), 1);
	CHECK_EQ(origin_is_allowed("http://127.0.0.1:8765", "127.0.0.1:8765", ""), 1);
	CHECK_EQ(origin_is_allowed("https://Daq.local", "daq.local", ""), 1);
	CHECK_EQ(origin_is_allowed("https://app.foxglove.dev", "daq.local",
				   "http://a,https://app.foxglove.dev"),
		 1);
}

TEST(web, a_page_of_another_site_may_not_connect)
{
	static const char *const foreign[] = {
		"null",
		"http://evil.example",
		"http://127.0.0.1",
		"http://127.0.0.1:8766",
		"ftp://127.0.0.1:8765",
		"http://127.0.0.1:8765.evil.example",
		"https://app.foxglove",
	};

	for (size_t i = 0; i < sizeof(foreign) / sizeof(foreign[0]); i++) {
		CHECK_EQ(
			origin_is_allowed(foreign[i], "127.0.0.1:8765", "https://app.foxglove.dev"),
			0);
	}
}
