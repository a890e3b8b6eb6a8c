/* SPDX-License-Identifier: MIT */
#include "publish/state.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "base/utf8.h"
#include "config/output.h"
#include "ecdaq.h"
#include "image/image.h"
#include "publish/domain.h"
#include "reader/utc.h"

enum { TYPE_BYTES = 16, TEXT_BYTES = 256 };

extern const char idl_text[];

void state_put_idl(const struct topics *topics)
{
	static char text[sizeof(char) * 16384];
	ecdaq_IdlV1 m = { .text = text };

	snprintf(text, sizeof(text), "%s", idl_text);
	(void)topics_write_now(topics->idl, &m);
}

/* --- channels --- */

#define SEQUENCE(sequence, n)                                                                      \
	do {                                                                                       \
		(sequence)._length = (uint32_t)(n);                                                \
		(sequence)._maximum = (uint32_t)(n);                                               \
		(sequence)._buffer = dds_alloc((n) * sizeof(*(sequence)._buffer));                 \
		(sequence)._release = true;                                                        \
	} while (0)

/* A DDS string is UTF-8. */
static char *dup_text(const char *text)
{
	char utf8[3 * LIMIT_NAME_BYTES];

	utf8_copy(text, utf8, sizeof(utf8));
	return dds_string_dup(utf8);
}

static void put_slaves(ecdaq_ChannelsV1 *m, const struct channel_table *t)
{
	uint32_t n = t->meta.slave_count;

	SEQUENCE(m->slave_name, n);
	SEQUENCE(m->slave_device, n);
	SEQUENCE(m->slave_vendor, n);
	SEQUENCE(m->slave_product, n);
	for (uint32_t i = 0; i < n; i++) {
		m->slave_name._buffer[i] = dup_text(t->slaves[i].name);
		m->slave_device._buffer[i] = dup_text(t->slaves[i].device);
		m->slave_vendor._buffer[i] = t->slaves[i].vendor;
		m->slave_product._buffer[i] = t->slaves[i].product;
	}
}

static void put_channel(ecdaq_ChannelsV1 *m, uint32_t i, const struct channel *ch,
			const struct config *cfg)
{
	int is_output = ch->direction == CHANNEL_OUTPUT;
	const struct config_output *rules = is_output ? config_output_find(cfg, ch->name) : NULL;
	char type[TYPE_BYTES];

	image_type_format(ch, type, sizeof(type));
	m->name._buffer[i] = dup_text(ch->name);
	m->unit._buffer[i] = dup_text(ch->unit);
	m->type._buffer[i] = dds_string_dup(type);
	m->slave._buffer[i] = ch->slave_pos;
	m->is_output._buffer[i] = is_output != 0;
	m->scale._buffer[i] = ch->scale;
	m->offset._buffer[i] = ch->offset;
	m->owner._buffer[i] = dds_string_dup(is_output ? config_output_owner(rules) : "");
	m->minimum._buffer[i] = rules != NULL ? rules->min : ch->min;
	m->maximum._buffer[i] = rules != NULL ? rules->max : ch->max;
	m->fail_safe._buffer[i] = rules != NULL ? rules->fail_safe : 0;
	m->timeout_ns._buffer[i] = rules != NULL ? rules->timeout_ns : 0;
}

static void put_channels(ecdaq_ChannelsV1 *m, const struct channel_table *t,
			 const struct config *cfg)
{
	uint32_t n = t->meta.channel_count;
	uint32_t place = 0;

	SEQUENCE(m->name, n);
	SEQUENCE(m->unit, n);
	SEQUENCE(m->type, n);
	SEQUENCE(m->slave, n);
	SEQUENCE(m->is_output, n);
	SEQUENCE(m->scale, n);
	SEQUENCE(m->offset, n);
	SEQUENCE(m->owner, n);
	SEQUENCE(m->minimum, n);
	SEQUENCE(m->maximum, n);
	SEQUENCE(m->fail_safe, n);
	SEQUENCE(m->timeout_ns, n);
	/* Slave by slave, each slave's in the order of its samples' values. */
	for (uint32_t s = 0; s < t->meta.slave_count; s++) {
		for (uint32_t i = 0; i < t->count[s]; i++) {
			put_channel(m, place++, channel_table_at(t, s, i), cfg);
		}
	}
}

int state_put_channels(const struct topics *topics, const struct config *cfg,
		       const struct channel_table *table)
{
	ecdaq_ChannelsV1 *m = ecdaq_ChannelsV1__alloc();

	if (m == NULL) {
		return -ENOMEM;
	}
	m->session = table->meta.session;
	m->period_ns = table->meta.period_ns;
	m->command_lease_ns = gate_lease_ns(cfg);
	m->are_commands_on = domain_takes_commands(cfg);
	put_slaves(m, table);
	put_channels(m, table, cfg);
	(void)topics_write_now(topics->channels, m);
	ecdaq_ChannelsV1_free(m, DDS_FREE_ALL);
	return 0;
}

/* --- status --- */

static uint64_t u64(const _Atomic uint64_t *field)
{
	return atomic_load_explicit(field, memory_order_relaxed);
}

static uint32_t u32(const _Atomic uint32_t *field)
{
	return atomic_load_explicit(field, memory_order_relaxed);
}

static void take_page(ecdaq_StatusV1 *m, const struct status_page *page)
{
	const struct cycle_stats *cycle = &page->cycle;

	m->is_simulated = page->is_simulated != 0;
	m->slaves = (uint16_t)u32(&page->slave_count);
	m->is_fail_safe = u32(&cycle->is_fail_safe) != 0;
	m->cycle = u64(&cycle->cycle_number);
	m->cycles = u64(&cycle->cycles);
	m->frames_lost = u64(&cycle->frames_lost);
	m->frames_late = u64(&cycle->frames_late);
	m->wkc_low = u64(&cycle->wkc_low);
	m->overruns = u64(&cycle->overruns);
	m->samples_good = u64(&cycle->samples_good);
	m->samples_bad = u64(&cycle->samples_bad);
	m->dc_diff_max_ns = atomic_load_explicit(&cycle->dc_diff_max_ns, memory_order_relaxed);
}

void state_put_status(const struct topics *topics, const struct state_view *view)
{
	const struct status_page *page = view->page;
	char state[32] = "NO MASTER";
	char dc_state[32] = "off";
	char message[TEXT_BYTES] = "";
	char version[sizeof(page->version)] = ECDAQ_VERSION;
	ecdaq_StatusV1 m = {
		.session = view->table == NULL ? 0 : view->table->meta.session,
		.state = state,
		.message = message,
		.version = version,
		.dc_state = dc_state,
		.cycles_published = view->samples.published,
		.cycles_missed = view->samples.missed,
		.commands_accepted = view->commands.accepted,
		.commands_refused = view->commands.refused,
	};

	if (page != NULL) {
		take_page(&m, page);
		snprintf(dc_state, sizeof(dc_state), "%s",
			 dc_state_to_str(u32(&page->cycle.dc_state)));
		snprintf(message, sizeof(message), "%s", page->message);
	}
	if (page != NULL && view->table != NULL) {
		snprintf(state, sizeof(state), "%s", bus_state_to_str(u32(&page->bus_state)));
	}
	(void)topics_write_now(topics->status, &m);
}

void state_put_timemap(const struct topics *topics, uint64_t session,
		       const struct timemap_state *map)
{
	char quality[16];
	ecdaq_TimeMapV1 m = {
		.session = session,
		.dc_ns = map->dc_ns,
		.utc_ns = map->utc_ns,
		.rate_ppb = map->rate_ppb,
		.uncertainty_ns = map->uncertainty_ns,
		.step_ns = map->step_ns,
		.steps = map->steps,
		.tai_offset_s = map->tai_offset_s,
		.quality = quality,
	};

	snprintf(quality, sizeof(quality), "%s", utc_quality(map));
	(void)topics_write(topics->timemap, &m, map->utc_ns);
}
