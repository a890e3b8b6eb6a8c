/* SPDX-License-Identifier: MIT */
/*
 * The one table of DDS topics: ecdaq-dds opens them by it (publish/topics.c), the permissions of
 * participants are written from it (keystore/policy.c). Types: publish/idl. A test compares the
 * table with the IDL and with the documentation. How to add a topic: app/doc/how-to.
 */
#ifndef KEYSTORE_DDS_TOPICS_H
#define KEYSTORE_DDS_TOPICS_H

enum topic_access {
	TOPIC_PUBLISHED = 1, /* written by the appliance, read by every participant */
	TOPIC_MIRROR = 2,    /* the same, only with dds.ros2_mirror */
	TOPIC_REPLY = 4,     /* written by the appliance, read by commanders */
	TOPIC_COMMAND = 8,   /* written by commanders, read by the appliance */
};

/* History depth where it is not a fixed number of samples. */
enum topic_depth {
	DEPTH_CYCLES = 0,    /* 10 s of cycles */
	DEPTH_BLOCKS = -1,   /* 10 s of blocks */
	DEPTH_KEEP_ALL = -2, /* a reader's queue */
};

/* X(MEMBER of struct topics, NAME, TYPE in C, ACCESS, DURABILITY, DEPTH) */
#define DDS_TOPICS(X)                                                                              \
	X(sample, "ecdaq/sample", ecdaq_SampleV1, PUBLISHED, VOLATILE, DEPTH_CYCLES)               \
	X(block, "ecdaq/block", ecdaq_BlockV1, PUBLISHED, VOLATILE, DEPTH_BLOCKS)                  \
	X(channels, "ecdaq/channels", ecdaq_ChannelsV1, PUBLISHED, TRANSIENT_LOCAL, 1)             \
	X(status, "ecdaq/status", ecdaq_StatusV1, PUBLISHED, TRANSIENT_LOCAL, 1)                   \
	X(event, "ecdaq/event", ecdaq_EventV1, PUBLISHED, VOLATILE, 1024)                          \
	X(timemap, "ecdaq/timemap", ecdaq_TimeMapV1, PUBLISHED, TRANSIENT_LOCAL, 1)                \
	X(sync0, "ecdaq/sync0", ecdaq_Sync0V1, PUBLISHED, TRANSIENT_LOCAL, 16)                     \
	X(idl, "ecdaq/idl", ecdaq_IdlV1, PUBLISHED, TRANSIENT_LOCAL, 1)                            \
	X(ros2_sample, "rt/ecdaq/sample", ecdaq_msgs_msg_dds__Sample_, MIRROR, VOLATILE,           \
	  DEPTH_CYCLES)                                                                            \
	X(reply, "ecdaq/reply", ecdaq_ReplyV1, REPLY, VOLATILE, 100)                               \
	X(command, "ecdaq/command", ecdaq_CommandV1, COMMAND, VOLATILE, DEPTH_KEEP_ALL)

#endif
