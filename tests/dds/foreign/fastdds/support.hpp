/* SPDX-License-Identifier: MIT */
/*
 * What fastddsgen would make: how Fast DDS reads a message, without type information. fastddsgen is
 * not used because it brings Java along. Fast DDS 2 and 3 have the same under other names. Nothing is
 * written here, so nothing is serialised.
 */
#pragma once

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <fastcdr/config.h>
#include <fastcdr/exceptions/Exception.h>
#include <fastdds/dds/topic/TopicDataType.hpp>

#if __has_include(<fastdds/config.hpp>)
#include <fastdds/rtps/common/InstanceHandle.hpp>
#include <fastdds/rtps/common/SerializedPayload.hpp>
#define FAST_DDS_3 1
namespace fast_rtps = eprosima::fastdds::rtps;
#else
#include <fastdds/rtps/common/InstanceHandle.h>
#include <fastdds/rtps/common/SerializedPayload.h>
#define FAST_DDS_3 0
namespace fast_rtps = eprosima::fastrtps::rtps;
#endif

enum { MESSAGE_BYTES = 65536 };

template <typename T> class Support : public eprosima::fastdds::dds::TopicDataType {
    public:
	using Payload = fast_rtps::SerializedPayload_t;
	using Handle = fast_rtps::InstanceHandle_t;

	static bool read(Payload &payload, void *data)
	{
		using namespace eprosima::fastcdr;
		try {
			FastBuffer buffer(reinterpret_cast<char *>(payload.data), payload.length);
#if FASTCDR_VERSION_MAJOR == 1
			Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
#else
			Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN);
#endif
			cdr.read_encapsulation();
			static_cast<T *>(data)->read(cdr);
			return true;
		} catch (const exception::Exception &) {
			return false;
		}
	}

	/* The key is the first member: big-endian, as the standard has it. */
	static bool key_of(const T &message, Handle &handle)
	{
		for (unsigned i = 0; i < 16; i++) {
			handle.value[i] = 0;
		}
		handle.value[0] = static_cast<uint8_t>(message.slave >> 8);
		handle.value[1] = static_cast<uint8_t>(message.slave & 0xff);
		return true;
	}

#if FAST_DDS_3
	using Representation = eprosima::fastdds::dds::DataRepresentationId_t;

	Support()
	{
		set_name(T::type_name);
		max_serialized_type_size = MESSAGE_BYTES;
		is_compute_key_provided = true;
	}
	bool serialize(const void *, Payload &, Representation) override { return false; }
	bool deserialize(Payload &payload, void *data) override { return read(payload, data); }
	uint32_t calculate_serialized_size(const void *, Representation) override { return 0; }
	void *create_data() override { return new T; }
	void delete_data(void *data) override { delete static_cast<T *>(data); }
	bool compute_key(Payload &payload, Handle &handle, bool) override
	{
		T message;
		return read(payload, &message) && key_of(message, handle);
	}
	bool compute_key(const void *data, Handle &handle, bool) override
	{
		return key_of(*static_cast<const T *>(data), handle);
	}
#else
	Support()
	{
		setName(T::type_name);
		m_typeSize = MESSAGE_BYTES;
		m_isGetKeyDefined = true;
		auto_fill_type_object(false);
		auto_fill_type_information(false);
	}
	bool serialize(void *, Payload *) override { return false; }
	bool deserialize(Payload *payload, void *data) override { return read(*payload, data); }
	std::function<uint32_t()> getSerializedSizeProvider(void *) override
	{
		return [] { return 0u; };
	}
	void *createData() override { return new T; }
	void deleteData(void *data) override { delete static_cast<T *>(data); }
	bool getKey(void *data, Handle *handle, bool) override
	{
		return key_of(*static_cast<T *>(data), *handle);
	}
#endif
};
