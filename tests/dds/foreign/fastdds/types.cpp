/* SPDX-License-Identifier: MIT */
#include "types.hpp"

#include <cstddef>

void SampleV1::read(eprosima::fastcdr::Cdr &cdr)
{
	cdr >> slave >> session >> cycle >> dc_time_ns >> utc_ns >> flags >> is_good;
	cdr >> adc >> counter >> sample_time_ns >> values >> raw;
}

void BlockV1::read(eprosima::fastcdr::Cdr &cdr)
{
	cdr >> slave >> session >> count >> channel_count >> cycle >> dc_time_ns >> utc_ns;
	cdr >> flags >> is_good >> adc >> counter >> sample_time_ns >> values >> raw;
}

static void put_raw(std::ostream &out, const uint64_t *raw, size_t n)
{
	for (size_t i = 0; i < n; i++) {
		out << (i > 0 ? " " : "") << raw[i];
	}
}

void SampleV1::put(std::ostream &out, int64_t taken_ns) const
{
	out << slave << ',' << session << ',' << cycle << ',' << dc_time_ns << ',' << flags << ','
	    << is_good << ',' << adc << ',' << counter << ',' << sample_time_ns << ',';
	put_raw(out, raw.data(), raw.size());
	out << ',' << taken_ns << '\n';
}

void BlockV1::put(std::ostream &out, int64_t taken_ns) const
{
	for (size_t k = 0; k < count; k++) {
		out << slave << ',' << session << ',' << cycle.at(k) << ',' << dc_time_ns.at(k)
		    << ',' << flags.at(k) << ',' << is_good.at(k) << ',' << adc.at(k) << ','
		    << counter.at(k) << ',' << sample_time_ns.at(k) << ',';
		put_raw(out, raw.data() + k * channel_count, channel_count);
		out << ',' << taken_ns << '\n';
	}
}
