/* SPDX-License-Identifier: MIT */
/*
 * A bus is brought up to the mapping with a slave that lies: two simulated slaves whose answers are
 * changed or lost on the way back, or one with an EEPROM from anywhere. Then it is watched while a
 * slave loses its power and returns.
 *
 * Byte 0 chooses the slaves, byte 1 the number of changes. A change is how many answers pass before
 * it, where it is (2 bytes), and what the byte there is XORed with; 0: the answer is lost. What
 * follows is the EEPROM.
 */
#include <errno.h>
#include <string.h>

#include "base/bytes.h"
#include "base/status.h"
#include "bus/bus.h"
#include "devices/catalogue.h"
#include "segment/in_process.h"
#include "segment/segment.h"
#include "wire/sii.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum {
	CHANGE_BYTES = 4,
	HEAD_BYTES = 2,
	SLAVES = 2,
	TRANSMIT_NS = 4000,
	LOOKS = 24,
	POWER_OFF_LOOK = 2,
	POWER_ON_LOOK = 6,
};

#define ENDS_NS (600 * NS_PER_S)
#define LOADED_NS (50 * NS_PER_MS)
#define LOOK_NS (50 * NS_PER_MS)

struct hostile {
	struct segment *segment;
	struct in_process *host;
	struct transport wire;
	const uint8_t *changes;
	size_t left;     /* changes */
	unsigned passed; /* answers since the last one */
};

static void must(int is_true)
{
	if (!is_true) {
		__builtin_trap();
	}
}

static int64_t now_ns(const struct hostile *h)
{
	struct platform platform = in_process_platform(h->host);

	return in_process_true_ns(h->host, platform.now(platform.ctx));
}

/* --- the wire --- */

static int wire_send(void *ctx, const uint8_t *frame, size_t len)
{
	struct hostile *h = ctx;

	must(now_ns(h) < ENDS_NS);
	return h->wire.send(h->wire.ctx, frame, len);
}

/* 0: the answer is lost. */
static int change(struct hostile *h, uint8_t *frame, size_t len)
{
	while (h->left > 0 && h->passed >= h->changes[0]) {
		uint8_t with = h->changes[3];

		if (with != 0 && len > 0) {
			frame[get_le16(h->changes + 1) % len] ^= with;
		}
		h->changes += CHANGE_BYTES;
		h->left--;
		h->passed = 0;
		if (with == 0) {
			return 0;
		}
	}
	h->passed++;
	return 1;
}

static int wire_receive(void *ctx, uint8_t *frame, size_t capacity, mono_t deadline, mono_t *ret_at)
{
	struct hostile *h = ctx;
	int r;

	do {
		r = h->wire.receive(h->wire.ctx, frame, capacity, deadline, ret_at);
	} while (r > 0 && !change(h, frame, (size_t)r));
	return r;
}

/* --- the segment --- */

static int make_slaves(uint8_t choice, const uint8_t *sii, size_t sii_bytes, struct hostile *h)
{
	static const char *const names[] = { "el3104",      "akd",          "el2521",
					     "lan9252_evb", "wago_750_354", "el6910" };
	static struct slave_model model;
	struct segment_slave_spec specs[SLAVES];
	const char *name = names[choice / 2 % (sizeof(names) / sizeof(names[0]))];
	size_t count = 0;

	if (choice % 2 == 0 && sii_bytes <= SEGMENT_SII_BYTES &&
	    catalogue_sii_slave(sii, sii_bytes, 0, &specs[count]) == 0) {
		count++;
	}
	must(catalogue_find(name, &model) == 0);
	must(catalogue_slave(&model, (int)count, &specs[count]) == 0);
	count++;
	return segment_create(specs, count, 0, &h->segment);
}

/* --- the master --- */

static void check_line(int result, const char *error)
{
	must(memchr(error, '\0', BUS_ERROR_BYTES) != NULL);
	must(result >= 0 || error[0] != '\0');
}

static void check_channels(const struct bus *bus)
{
	size_t count;
	const struct channel *channel = bus_channels(bus, &count);

	must(count <= LIMIT_CHANNELS);
	for (size_t i = 0; i < count; i++) {
		must(memchr(channel[i].name, '\0', sizeof(channel[i].name)) != NULL);
		must((size_t)channel[i].bit_offset + channel[i].bit_len <=
		     (size_t)8 * LIMIT_IMAGE_BYTES);
	}
}

static void ignore_event(void *ctx, const struct event *ev)
{
	char text[200];

	(void)ctx;
	event_format(ev, text, sizeof(text));
}

static void watch(struct hostile *h, struct line *line, struct bus *bus)
{
	static struct status_page page;
	struct bus_watch_report report;

	for (unsigned i = 0; i < LOOKS; i++) {
		char who[128];

		if (i == POWER_OFF_LOOK) {
			segment_power_off(h->segment, 0, now_ns(h));
		} else if (i == POWER_ON_LOOK) {
			segment_power_on(h->segment, 0, now_ns(h));
		}
		bus_watch(bus, &page, ignore_event, NULL, &report);
		must(memchr(report.trouble, '\0', sizeof(report.trouble)) != NULL);
		must(bus_map_check(bus, who, sizeof(who)) == (who[0] != '\0'));
		bus_step(bus);
		line_sleep(line, (span_t){ LOOK_NS });
	}
}

static void bring_up(struct hostile *h, struct line *line)
{
	static struct config cfg;
	char error[BUS_ERROR_BYTES] = "";
	struct bus *bus;
	int r;

	config_defaults(&cfg);
	cfg.bus_mailbox_timeout_ns = 100 * NS_PER_MS;
	must(bus_create(&cfg, line, &bus) == 0);
	bus_listen(bus, ignore_event, NULL);
	r = bus_scan(bus, error);
	check_line(r, error);
	if (r >= 0) {
		r = bus_compare(bus, error);
		check_line(r, error);
	}
	if (r >= 0) {
		r = bus_map(bus, error);
		check_line(r, error);
	}
	if (r >= 0) {
		check_channels(bus);
		watch(h, line, bus);
	}
	bus_stop(bus, error);
	bus_destroy(bus);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct hostile h = { 0 };
	struct transport transport = { .send = wire_send, .receive = wire_receive, .ctx = &h };
	struct line *line;
	uint8_t choice;

	if (size < HEAD_BYTES) {
		return 0;
	}
	choice = data[0];
	h.left = data[1];
	h.changes = data + HEAD_BYTES;
	if (h.left > (size - HEAD_BYTES) / CHANGE_BYTES) {
		h.left = (size - HEAD_BYTES) / CHANGE_BYTES;
	}
	size -= HEAD_BYTES + h.left * CHANGE_BYTES;
	if (make_slaves(choice, h.changes + h.left * CHANGE_BYTES, size, &h) < 0) {
		return 0;
	}
	must(in_process_create(&(struct in_process_spec){ .segment = h.segment,
							  .seed = 1,
							  .transmit_ns = TRANSMIT_NS },
			       &h.host) == 0);
	h.wire = in_process_transport(h.host);
	must(line_create(in_process_platform(h.host), transport, &line) == 0);
	line_bind(line);
	line_sleep(line, (span_t){ LOADED_NS });
	bring_up(&h, line);
	line_bind(NULL);
	line_destroy(line);
	in_process_destroy(h.host);
	segment_destroy(h.segment);
	return 0;
}
