/* SPDX-License-Identifier: MIT */
/*
 * The rings of ecdaqd and ecdaq-sync0 as messages of the topics that a recording has, with the same
 * schemas and the same encoding (record/layout.h, record/messages.h). Follows ecdaqd through its
 * restarts; the channels of the slaves are other ones in each session. Context: one thread; never
 * waits.
 */
#ifndef WEB_SOURCE_H
#define WEB_SOURCE_H

#include <assert.h>
#include <stdint.h>

#include "base/limits.h"
#include "config/config.h"
#include "record/layout.h"
#include "record/messages.h"
#include "web/outbox.h"

/*
 * Channel ids: those of the topics that are in every session are 1 to MESSAGE_KINDS, those of
 * slaves SOURCE_IDS times the number of the session here, from 1, plus a slot.
 */
enum {
	SOURCE_IDS = 1024,
	SOURCE_FIRST_SLAVE = 1 + MESSAGE_KINDS,
	SOURCE_SLOTS = SOURCE_FIRST_SLAVE + LIMIT_SLAVES,
	SOURCE_LARGEST_BYTES = 512 * 1024, /* of a message: all channels at one slave fit */
};

static_assert(SOURCE_SLOTS <= SOURCE_IDS, "a slot is part of an id");

static inline uint32_t source_slot(uint32_t channel)
{
	return channel % SOURCE_IDS;
}

/** Id of the @slave-th topic of source_slaves() in @session. */
static inline uint32_t source_slave_channel(uint32_t session, size_t slave)
{
	return session * SOURCE_IDS + SOURCE_FIRST_SLAVE + (uint32_t)slave;
}

struct source;

/** Read the rings that @cfg names into @box, which the caller keeps; schemas as record.values says.
 * 0, -ENOMEM, -ENAMETOOLONG. Free with source_destroy(). */
int source_create(const struct config *cfg, struct outbox *box, struct source **ret_source);
void source_destroy(struct source *s);

/** Count the subscribers of the channel up (1) or down (-1): what nobody has subscribed to is not
 * encoded. */
void source_want(struct source *s, uint32_t channel, int change);
/** Read what is new; @now_ns is CLOCK_MONOTONIC. */
void source_poll(struct source *s, int64_t now_ns);

/** Number of the session whose channels there are; 0: none yet. */
uint32_t source_session(const struct source *s);
/** Where it begins in the outbox: what is before that is of earlier ones. */
uint64_t source_session_position(const struct source *s);
/** 1 if there is a channel with this id. */
int source_has_channel(const struct source *s, uint32_t channel);
/** Number of the next message of the channel. */
uint64_t source_next(const struct source *s, uint32_t channel);
/** Its topic; "" where there is none. */
const char *source_topic(const struct source *s, uint32_t channel);
/** Slaves of the session, in the order of their slots; NULL with 0: none. */
const struct layout_topic *source_slaves(const struct source *s, size_t *ret_count);
/** Of the session; NULL: there is none. */
const struct sample_meta *source_meta(const struct source *s);
/** What is added to CLOCK_TAI for Unix time. */
int64_t source_utc_minus_tai(const struct source *s);
/** Why there is no session, one line; "" if there is one. */
const char *source_problem(const struct source *s);

#endif
