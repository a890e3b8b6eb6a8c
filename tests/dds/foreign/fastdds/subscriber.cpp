/* SPDX-License-Identifier: MIT */
/*
 * fast_subscriber DOMAIN INTERFACE SECONDS OUT [sample|block]: what comes on ecdaq/sample or
 * ecdaq/block, as CSV, for some seconds, on Fast DDS. Prints "ready" with the first message.
 */
#include <arpa/inet.h>
#include <ifaddrs.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>

#include "support.hpp"
#include "types.hpp"

#if FAST_DDS_3
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.hpp>
static const auto ok = eprosima::fastdds::dds::RETCODE_OK;
using Wait = eprosima::fastdds::dds::Duration_t;
#else
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
static const auto ok = eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK;
using Wait = eprosima::fastrtps::Duration_t;
#endif

using namespace eprosima::fastdds::dds;
using std::chrono::steady_clock;

static int64_t now_ns()
{
	/* CLOCK_MONOTONIC, in libstdc++. */
	return std::chrono::nanoseconds(steady_clock::now().time_since_epoch()).count();
}

static std::string address_of(const std::string &interface)
{
	ifaddrs *all = nullptr;
	std::string found;

	if (getifaddrs(&all) != 0) {
		throw std::runtime_error("getifaddrs");
	}
	for (const ifaddrs *one = all; one != nullptr; one = one->ifa_next) {
		if (interface == one->ifa_name && one->ifa_addr != nullptr &&
		    one->ifa_addr->sa_family == AF_INET) {
			const auto *in = reinterpret_cast<const sockaddr_in *>(one->ifa_addr);
			char text[INET_ADDRSTRLEN];

			found = inet_ntop(AF_INET, &in->sin_addr, text, sizeof(text));
		}
	}
	freeifaddrs(all);
	if (found.empty()) {
		throw std::runtime_error(interface + " has no IPv4 address");
	}
	return found;
}

static DomainParticipant *join(unsigned domain, const std::string &interface)
{
	DomainParticipantQos qos;
	auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();

	udp->interfaceWhiteList.push_back(address_of(interface));
	qos.transport().use_builtin_transports = false;
	qos.transport().user_transports.push_back(udp);
	return DomainParticipantFactory::get_instance()->create_participant(domain, qos);
}

template <typename T> static DataReader *make_reader(DomainParticipant *participant)
{
	TypeSupport type(new Support<T>());
	DataReaderQos qos;

	type.register_type(participant);
	qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
	qos.history().kind = KEEP_ALL_HISTORY_QOS;
	qos.resource_limits().max_samples = 200000;
	qos.resource_limits().max_instances = 4;
	qos.resource_limits().max_samples_per_instance = 50000;
	Topic *topic = participant->create_topic(T::topic, T::type_name, TOPIC_QOS_DEFAULT);
	Subscriber *subscriber = participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
	return subscriber->create_datareader(topic, qos);
}

template <typename T>
static void subscribe(DomainParticipant *participant, double seconds, std::ostream &out)
{
	DataReader *reader = make_reader<T>(participant);
	const auto length = std::chrono::duration_cast<steady_clock::duration>(
		std::chrono::duration<double>(seconds));
	auto end = steady_clock::now() + std::chrono::seconds(30);
	bool is_ready = false;
	T message;
	SampleInfo info;

	if (reader == nullptr) {
		throw std::runtime_error("no reader");
	}
	out.precision(std::numeric_limits<double>::max_digits10);
	out << "slave,session,cycle,dc_time_ns,flags,is_good,adc,counter,sample_time_ns,raw,"
	       "taken_ns\n";
	while (steady_clock::now() < end) {
		reader->wait_for_unread_message(Wait(0, 100000000));
		/* Behind a publisher that is faster than we are, this never runs dry. */
		while (steady_clock::now() < end &&
		       reader->take_next_sample(&message, &info) == ok) {
			if (info.valid_data) {
				message.put(out, now_ns());
			}
			if (!is_ready) {
				is_ready = true;
				end = steady_clock::now() + length;
				std::cout << "ready" << std::endl;
			}
		}
	}
	if (!is_ready) {
		throw std::runtime_error("nothing came");
	}
}

static int run(int argc, char **argv)
{
	if (argc != 5 && argc != 6) {
		std::cerr << "usage: fast_subscriber DOMAIN INTERFACE SECONDS OUT [sample|block]\n";
		return 2;
	}
	DomainParticipant *participant = join(std::stoul(argv[1]), argv[2]);
	std::ofstream out(argv[4]);

	if (participant == nullptr || !out) {
		throw std::runtime_error("no participant, or no file");
	}
	if (argc == 6 && std::string(argv[5]) == "block") {
		subscribe<BlockV1>(participant, std::stod(argv[3]), out);
	} else {
		subscribe<SampleV1>(participant, std::stod(argv[3]), out);
	}
	participant->delete_contained_entities();
	DomainParticipantFactory::get_instance()->delete_participant(participant);
	out.close();
	return out ? 0 : 1;
}

int main(int argc, char **argv)
{
	try {
		return run(argc, argv);
	} catch (const std::exception &why) {
		std::cerr << "fast_subscriber: " << why.what() << '\n';
		return 1;
	}
}
