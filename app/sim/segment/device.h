/* SPDX-License-Identifier: MIT */
/*
 * A slave's application: what sits on the PDI of an ESC. It lives on the segment's time axis and is
 * called when its time has come; it never waits.
 */
#ifndef SIM_SEGMENT_DEVICE_H
#define SIM_SEGMENT_DEVICE_H

#include <stddef.h>
#include <stdint.h>

#include "segment/esc.h"
#include "segment/signal.h"

struct sim_device;

struct sim_device_ops {
	/** Power came on at @t_ns; the ESC has just been initialised. */
	void (*power_on)(struct sim_device *dev, int64_t t_ns);
	/** True time at which run() has to be called next; INT64_MAX: not before something
	 * happens. */
	int64_t (*next_wake_ns)(const struct sim_device *dev);
	void (*run)(struct sim_device *dev, int64_t t_ns);
	/** A SYNC0 edge. */
	void (*sync0)(struct sim_device *dev, int64_t t_ns, uint64_t system_time_ns);
	/** A frame has been through the ESC at @t_ns; may be NULL. */
	void (*frame_passed)(struct sim_device *dev, int64_t t_ns);
	/** What its terminals have, as "KEY=VALUE KEY=VALUE ..."; NULL: it has none. */
	void (*io_get)(const struct sim_device *dev, char *ret_text, size_t text_bytes);
	/** A hand at its terminals. -EINVAL: no such terminal, or no such value; NULL: as that. */
	int (*io_set)(struct sim_device *dev, const char *key, const char *value);
	void (*destroy)(struct sim_device *dev);
};

/* First member of every device. */
struct sim_device {
	const struct sim_device_ops *ops;
	struct esc *esc;
	const struct signal_spec *signal; /* what its analog input sees; NULL: nothing connected */
};

#endif
