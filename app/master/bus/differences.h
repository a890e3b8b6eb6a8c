/* SPDX-License-Identifier: MIT */
/*
 * Every difference between what is configured and what is found, for people; what fits is decided
 * by compare_bind() alone. Context: service thread; allocates.
 */
#ifndef BUS_DIFFERENCES_H
#define BUS_DIFFERENCES_H

#include <stddef.h>
#include <stdint.h>

#include "base/difference.h"
#include "base/sample.h"
#include "config/config.h"

struct bus;
struct pdo_entry;

/* Zero at first. */
struct differences {
	struct difference *at;
	size_t count;
};

void differences_free(struct differences *list);
/** The next one, empty; NULL: no memory. */
struct difference *differences_add(struct differences *list, enum difference_kind kind);

/** Those of the slaves: none if compare_bind() binds them, but optional ones that are absent. @id
 * as for compare_bind(). 0 or -ENOMEM. */
int differences_of_slaves(const struct config *cfg, const struct slave_info *found,
			  const uint16_t *id, size_t found_count, struct differences *list);

/** Items of slaves[].channels[] that meet none of the channels of @slave, which have the names of
 * the device. @cfg by position. 0 or -ENOMEM. */
int differences_of_channels(const struct config *cfg, const struct slave_info *slave,
			    struct channel *channel, size_t channel_count,
			    struct differences *list);

/** slaves[].pdos[] of @slave that are not what it has assigned, with entries in the order of their
 * PDOs, a difference a direction. @cfg by position. 0 or -ENOMEM. */
int differences_of_pdos(const struct config *cfg, const struct slave_info *slave,
			const struct pdo_entry *entry, size_t count, struct differences *list);

/** outputs[] that are no output channels. @slave_count of @slaves: those of the channels. */
int differences_of_outputs(const struct config *cfg, const struct channel *channels,
			   size_t channel_count, struct differences *list);

/**
 * All of @bus against @cfg as it was configured: slaves, those that were lost since, new devices,
 * channels, PDOs, outputs. @bus NULL: no slave was found. 0 or -ENOMEM.
 */
int differences_of_bus(const struct bus *bus, const struct config *cfg, struct differences *list);

#endif
