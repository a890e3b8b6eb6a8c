/* SPDX-License-Identifier: MIT */
/*
 * ecdaq pcap: the frames of the running bus as pcapng. ecdaqd copies them into a ring as long as
 * the request is open; here they are read from it, as samples are.
 */
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "base/args.h"
#include "base/clock.h"
#include "base/frame_record.h"
#include "base/host_clock.h"
#include "cli/admin_client.h"
#include "cli/cli.h"
#include "cli/pcapng.h"
#include "cli/screen.h"
#include "cli/source.h"
#include "program/args_duration.h"
#include "program/json.h"
#include "reader/feed.h"

#define IDLE_NS (2 * NS_PER_MS)
/* A request is open for so long at most; the next one is made well before. */
#define RENEW_NS (ADMIN_TIMEOUT_MS_MAX / 2 * NS_PER_MS)

struct pcap {
	struct cli *cli;
	const char *output;  /* NULL: standard output */
	uint64_t count;      /* of frames; 0: no end */
	int64_t duration_ns; /* 0: no end */
	int is_json;
	FILE *out;
	int fd; /* of the open request */
	int64_t renew_mono_ns;
	struct feed *feed;
	int64_t utc_minus_mono_ns;
	int64_t end_mono_ns;
	uint64_t frames;
	uint64_t missed;
	uint64_t missed_before; /* the next frame */
};

/* The one before ends afterwards, so that no frame is between. */
static enum exit_code hold(struct pcap *pcap)
{
	struct admin_request rq = { .verb = ADMIN_CAPTURE, .timeout_ms = ADMIN_TIMEOUT_MS_MAX };
	int fd;
	enum exit_code result = admin_hold(pcap->cli, &rq, &fd);

	if (result == EXIT_CODE_OK) {
		admin_hold_end(pcap->fd);
		pcap->fd = fd;
		pcap->renew_mono_ns = host_clock_ns(CLOCK_MONOTONIC) + RENEW_NS;
	}
	return result;
}

static enum exit_code open_feed(struct pcap *pcap)
{
	char path[CONFIG_PATH_BYTES];
	enum exit_code result = cli_path(pcap->cli, CONFIG_RUN_FRAMES, path);
	int r;

	if (result != EXIT_CODE_OK) {
		return result;
	}
	pcap->feed = feed_create(FEED_FRAMES, path, FEED_AT_NEWEST);
	r = pcap->feed == NULL ? -ENOMEM : feed_open(pcap->feed, NULL);
	return r < 0 ? source_fail_open(pcap->cli, path, -r) : EXIT_CODE_OK;
}

static void put(struct pcap *pcap, const uint8_t *slot)
{
	struct frame_record head;
	struct pcapng_frame frame;

	memcpy(&head, slot, sizeof(head));
	if (head.frame_bytes > LIMIT_FRAME_BYTES || head.error != 0) {
		return; /* foreign bytes; or never on the wire */
	}
	frame = (struct pcapng_frame){
		.utc_ns = head.mono_ns + pcap->utc_minus_mono_ns,
		.direction = head.direction == FRAME_OUT ? PCAPNG_OUTBOUND : PCAPNG_INBOUND,
		.dropped = pcap->missed_before,
		.bytes = slot + sizeof(head),
		.len = head.frame_bytes,
	};
	pcapng_put_frame(pcap->out, &frame);
	pcap->missed_before = 0;
	pcap->frames++;
}

static int is_over(const struct pcap *pcap)
{
	return (pcap->count > 0 && pcap->frames >= pcap->count) || screen_is_over() ||
	       ferror(pcap->out) ||
	       (pcap->duration_ns > 0 && host_clock_ns(CLOCK_MONOTONIC) >= pcap->end_mono_ns);
}

/* Nothing to read: 1 if it goes on. A request that ends, or soon would, is made again. */
static int wait_for_more(struct pcap *pcap, enum exit_code *ret_result)
{
	fflush(pcap->out);
	if (admin_hold_has_ended(pcap->fd) ||
	    host_clock_ns(CLOCK_MONOTONIC) >= pcap->renew_mono_ns) {
		*ret_result = hold(pcap);
		return *ret_result == EXIT_CODE_OK;
	}
	screen_wait(IDLE_NS);
	return 1;
}

static enum exit_code copy(struct pcap *pcap)
{
	enum exit_code result = EXIT_CODE_OK;
	uint8_t slot[FRAME_SLOT_BYTES];

	while (!is_over(pcap)) {
		uint64_t lost = 0;
		int got = feed_read(pcap->feed, slot, sizeof(slot), NULL, &lost);

		pcap->missed += lost;
		pcap->missed_before += lost;
		if (got) {
			put(pcap, slot);
		} else if (feed_is_over(pcap->feed)) {
			return cli_fail(pcap->cli, EXIT_CODE_NO_DAEMON, "ecdaqd has ended");
		} else if (!wait_for_more(pcap, &result)) {
			return result;
		}
	}
	return EXIT_CODE_OK;
}

static void report(const struct pcap *pcap)
{
	struct json js;

	if (pcap->is_json) {
		json_init(&js, stdout);
		json_object_begin(&js, NULL);
		json_text(&js, "file", pcap->output);
		json_u64(&js, "frames", pcap->frames);
		json_u64(&js, "missed", pcap->missed);
		json_object_end(&js);
		json_end_line(&js);
	} else if (pcap->output != NULL) {
		printf("%s: %" PRIu64 " frames, %" PRIu64 " missed\n", pcap->output, pcap->frames,
		       pcap->missed);
	} else {
		fprintf(stderr, "ecdaq: pcap: %" PRIu64 " frames, %" PRIu64 " missed\n",
			pcap->frames, pcap->missed);
	}
}

static enum exit_code run(struct pcap *pcap)
{
	const struct status_page *page;
	enum exit_code result = source_status(pcap->cli, &page);
	char interface[32];

	if (result != EXIT_CODE_OK) {
		return result;
	}
	snprintf(interface, sizeof(interface), "%s", page->interface);
	source_status_close(page);
	result = hold(pcap);
	if (result == EXIT_CODE_OK) {
		result = open_feed(pcap);
	}
	if (result != EXIT_CODE_OK) {
		return result;
	}
	pcap->utc_minus_mono_ns = host_clock_ns(CLOCK_REALTIME) - host_clock_ns(CLOCK_MONOTONIC);
	pcap->end_mono_ns = host_clock_ns(CLOCK_MONOTONIC) + pcap->duration_ns;
	screen_catch_signals();
	pcapng_put_head(pcap->out, interface);
	return copy(pcap);
}

static enum exit_code finish(struct pcap *pcap, enum exit_code result)
{
	int is_failed = fflush(pcap->out) != 0 || ferror(pcap->out);

	if (pcap->output != NULL && fclose(pcap->out) != 0) {
		is_failed = 1;
	}
	if (is_failed && result == EXIT_CODE_OK) {
		result = cli_fail(pcap->cli, EXIT_CODE_FAILED, "%s: %s",
				  pcap->output == NULL ? "standard output" : pcap->output,
				  strerror(errno));
	}
	if (result == EXIT_CODE_OK) {
		report(pcap);
	}
	return result;
}

enum exit_code verb_pcap(struct cli *cli, int argc, char **argv)
{
	struct pcap pcap = { .cli = cli, .fd = -1 };
	const struct args_option options[] = {
		{ "output", 'o', args_text, &pcap.output, "FILE", "write to FILE" },
		{ "count", 'n', args_count, &pcap.count, "N", "end after N frames" },
		{ "time", 't', args_duration, &pcap.duration_ns, "T", "end after T" },
		{ "json", 0, args_flag, &pcap.is_json, NULL,
		  "the numbers of frames as a JSON object, with --output" },
	};
	struct args args = { .options = options, .option_count = 4 };
	enum exit_code result;

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	if (pcap.is_json && pcap.output == NULL) {
		return cli_fail(cli, EXIT_CODE_USAGE, "--json requires --output");
	}
	if (pcap.output == NULL && isatty(STDOUT_FILENO)) {
		return cli_fail(cli, EXIT_CODE_USAGE,
				"a capture is not shown on a terminal: --output FILE, or a pipe");
	}
	pcap.out = pcap.output == NULL ? stdout : fopen(pcap.output, "we");
	if (pcap.out == NULL) {
		return cli_fail(cli, errno == EACCES ? EXIT_CODE_PERMISSION : EXIT_CODE_FAILED,
				"%s: %s", pcap.output, strerror(errno));
	}
	result = finish(&pcap, run(&pcap));
	admin_hold_end(pcap.fd);
	feed_destroy(pcap.feed);
	return result;
}
