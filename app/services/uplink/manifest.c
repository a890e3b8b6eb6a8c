/* SPDX-License-Identifier: MIT */
#include "uplink/manifest.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>

#include "program/json.h"
#include "record/file_io.h"
#include "record/mcap_recover.h"
#include "record/track.h"

struct reading {
	struct track track;
	int is_recovered;
};

static void visit(void *ctx, const struct mcap_item *item)
{
	struct reading *rd = ctx;

	track_item(&rd->track, item);
	if (item->kind == MCAP_ITEM_METADATA && mcap_text_is(item->name, "ecdaq.recovered")) {
		rd->is_recovered = 1;
	}
}

/* A source that ends when it shall stop. */
struct stoppable {
	struct mcap_source plain;
	const volatile sig_atomic_t *stop;
};

static int read_at(void *ctx, uint64_t offset, void *buf, size_t len)
{
	const struct stoppable *s = ctx;

	return *s->stop != 0 ? -EINTR : s->plain.read_at(s->plain.ctx, offset, buf, len);
}

int contents_read(int fd, const volatile sig_atomic_t *stop, struct contents *ret)
{
	struct reading rd = { .is_recovered = 0 };
	const struct mcap_visitor visitor = { .item = visit, .ctx = &rd };
	struct stoppable stoppable = { .stop = stop };
	struct mcap_source source;
	struct mcap_scan *scan;
	int r = file_source(&fd, &stoppable.plain);

	if (r < 0) {
		return r;
	}
	source = (struct mcap_source){ .read_at = read_at,
				       .bytes = stoppable.plain.bytes,
				       .ctx = &stoppable };
	track_init(&rd.track);
	r = mcap_scan_create(&source, &visitor, &scan);
	if (r < 0) {
		return *stop != 0 ? -EINTR : r;
	}
	*ret = (struct contents){
		.session = rd.track.before.session,
		.cycles = rd.track.cycles,
		.first_cycle = rd.track.first_cycle,
		.last_cycle = rd.track.last_cycle,
		.missing = rd.track.missing,
		.start_ns = rd.track.start_ns,
		.end_ns = rd.track.end_ns,
		.state = !mcap_scan_is_whole(scan) ? "damaged"
			 : rd.is_recovered         ? "recovered"
						   : "clean",
	};
	mcap_scan_destroy(scan);
	return *stop != 0 ? -EINTR : 0;
}

char *manifest_format(const struct manifest *m)
{
	const struct contents *c = m->contents;
	char *text = NULL;
	size_t len = 0;
	FILE *out = open_memstream(&text, &len);
	struct json js;
	int is_bad;

	if (out == NULL) {
		return NULL;
	}
	json_init(&js, out);
	json_object_begin(&js, NULL);
	json_u64(&js, "version", 1);
	json_text(&js, "appliance", m->appliance);
	json_text(&js, "file", m->name);
	json_text(&js, "key", m->key);
	json_u64(&js, "bytes", m->plan->bytes);
	json_text(&js, "sha256", m->plan->sha256);
	json_text(&js, "state", c->state);
	json_u64(&js, "session", c->session);
	json_u64(&js, "cycles", c->cycles);
	if (c->cycles > 0) {
		json_u64(&js, "first_cycle", c->first_cycle);
		json_u64(&js, "last_cycle", c->last_cycle);
	} else {
		json_null(&js, "first_cycle");
		json_null(&js, "last_cycle");
	}
	json_u64(&js, "cycles_missing", c->missing);
	json_u64(&js, "start_ns", c->start_ns);
	json_u64(&js, "end_ns", c->end_ns);
	json_object_end(&js);
	json_end_line(&js);
	is_bad = ferror(out);
	if (fclose(out) != 0 || is_bad) {
		free(text);
		return NULL;
	}
	return text;
}
