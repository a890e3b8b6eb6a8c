/* SPDX-License-Identifier: MIT */
/* SampleV1 and BlockV1 of app/services/publish/idl/ecdaq.idl, read with Fast-CDR. */
#pragma once

#include <cstdint>
#include <ostream>
#include <vector>

#include <fastcdr/Cdr.h>

struct SampleV1 {
	static constexpr const char *topic = "ecdaq/sample";
	static constexpr const char *type_name = "ecdaq::SampleV1";

	uint16_t slave = 0;
	uint64_t session = 0;
	uint64_t cycle = 0;
	int64_t dc_time_ns = 0;
	int64_t utc_ns = 0;
	uint32_t flags = 0;
	bool is_good = false;
	double adc = 0;
	uint64_t counter = 0;
	int64_t sample_time_ns = 0;
	std::vector<double> values;
	std::vector<uint64_t> raw;

	void read(eprosima::fastcdr::Cdr &cdr);
	void put(std::ostream &out, int64_t taken_ns) const;
};

struct BlockV1 {
	static constexpr const char *topic = "ecdaq/block";
	static constexpr const char *type_name = "ecdaq::BlockV1";

	uint16_t slave = 0;
	uint64_t session = 0;
	uint32_t count = 0;
	uint32_t channel_count = 0;
	std::vector<uint64_t> cycle;
	std::vector<int64_t> dc_time_ns;
	std::vector<int64_t> utc_ns;
	std::vector<uint32_t> flags;
	std::vector<bool> is_good;
	std::vector<double> adc;
	std::vector<uint64_t> counter;
	std::vector<int64_t> sample_time_ns;
	std::vector<double> values;
	std::vector<uint64_t> raw;

	void read(eprosima::fastcdr::Cdr &cdr);
	void put(std::ostream &out, int64_t taken_ns) const;
};
