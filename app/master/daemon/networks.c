/* SPDX-License-Identifier: MIT */
#include "daemon/networks.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <unistd.h>

#include "config/gateway.h"
#include "network/eoe_switch.h"
#include "network/gateway_sockets.h"
#include "network/tap.h"

#define REPORT_NS (10 * NS_PER_S)

struct networks {
	const struct config *cfg;
	int poller;
	struct gateway_sockets *gateway; /* NULL: off */
	struct eoe_switch *eoe;          /* NULL: off */
	int tap;
	mono_t report_at;
	/* As reported. */
	struct gateway_counters gateway_seen;
	struct eoe_switch_counters eoe_seen;
};

/* --- the TAP device as the switch sees it --- */

static int receive(void *ctx, uint8_t *frame, size_t capacity)
{
	struct networks *nets = ctx;
	int r = tap_read(nets->tap, frame, capacity);

	/* Deleted: it would poll readable for ever. */
	if (r < 0 && r != -EAGAIN && r != -EINTR) {
		epoll_ctl(nets->poller, EPOLL_CTL_DEL, nets->tap, NULL);
	}
	return r;
}

static int transmit(void *ctx, const uint8_t *frame, size_t len)
{
	const struct networks *nets = ctx;

	return tap_write(nets->tap, frame, len);
}

/* --- life --- */

static enum exit_code code_of(int r)
{
	switch (-r) {
	case EPERM:
	case EACCES:
		return EXIT_CODE_PERMISSION;
	case ENOMEM:
		return EXIT_CODE_RESOURCES;
	default:
		return EXIT_CODE_CONFIG;
	}
}

static int watch_fd(const struct networks *nets, int fd)
{
	struct epoll_event interest = { .events = EPOLLIN };

	return epoll_ctl(nets->poller, EPOLL_CTL_ADD, fd, &interest) < 0 ? -errno : 0;
}

static int open_gateway(struct networks *nets, struct failure *failure)
{
	struct sockaddr_in6 address;
	socklen_t address_bytes = 0;
	char error[FAILURE_TEXT_BYTES / 2] = "";
	int r = config_gateway_address(nets->cfg, &address, &address_bytes);

	if (r == 0) {
		return 0;
	}
	if (r > 0) {
		r = gateway_sockets_create((const struct sockaddr *)&address, address_bytes,
					   &nets->gateway, error, sizeof(error));
	}
	if (r == 0) {
		r = watch_fd(nets, gateway_sockets_fd(nets->gateway));
	}
	return r < 0 ? failure_set(failure, code_of(r), r, "gateway.listen: %s, port %u: %s",
				   nets->cfg->gateway_listen, nets->cfg->gateway_port,
				   error[0] != '\0' ? error : strerror(-r))
		     : 0;
}

static int open_eoe(struct networks *nets, struct failure *failure)
{
	const struct eoe_switch_host host = { .receive = receive, .send = transmit, .ctx = nets };
	char error[FAILURE_TEXT_BYTES / 2] = "";
	int r;

	if (nets->cfg->eoe_interface[0] == '\0') {
		return 0;
	}
	r = tap_open(nets->cfg->eoe_interface, &nets->tap, error, sizeof(error));
	if (r == 0) {
		r = watch_fd(nets, nets->tap);
	}
	if (r == 0) {
		r = eoe_switch_create(&host, &nets->eoe);
	}
	return r < 0 ? failure_set(failure, code_of(r), r, "eoe.interface: %s",
				   error[0] != '\0' ? error : strerror(-r))
		     : 0;
}

int networks_open(const struct config *cfg, struct networks **ret_networks, struct failure *failure)
{
	struct networks *nets = calloc(1, sizeof(*nets));
	int r;

	if (nets == NULL) {
		return failure_set(failure, EXIT_CODE_RESOURCES, -ENOMEM, "networks: no memory");
	}
	nets->cfg = cfg;
	nets->tap = -1;
	nets->poller = epoll_create1(EPOLL_CLOEXEC);
	r = nets->poller < 0 ? failure_set(failure, EXIT_CODE_RESOURCES, -errno, "epoll: %s",
					   strerror(errno))
			     : open_gateway(nets, failure);
	r = r < 0 ? r : open_eoe(nets, failure);
	if (r < 0) {
		networks_close(nets);
		return r;
	}
	*ret_networks = nets;
	return 0;
}

void networks_close(struct networks *nets)
{
	if (nets == NULL) {
		return;
	}
	gateway_sockets_destroy(nets->gateway);
	eoe_switch_destroy(nets->eoe);
	if (nets->tap >= 0) {
		close(nets->tap);
	}
	if (nets->poller >= 0) {
		close(nets->poller);
	}
	free(nets);
}

int networks_fd(const struct networks *nets)
{
	return nets->poller;
}

int networks_are_busy(const struct networks *nets)
{
	return nets->gateway != NULL && gateway_sockets_is_busy(nets->gateway);
}

/* --- service --- */

void networks_service(struct networks *nets, struct bus *bus, mono_t now)
{
	struct gateway_bus view = { .timeout = { nets->cfg->bus_mailbox_timeout_ns } };

	if (bus != NULL) {
		view.mb = bus_mailbox(bus);
		view.slaves = bus_slaves(bus, &view.slave_count);
	}
	if (nets->gateway != NULL) {
		gateway_sockets_service(nets->gateway, &view, now);
	}
	if (nets->eoe != NULL) {
		eoe_switch_service(nets->eoe, view.mb, view.slave_count, view.timeout, now);
	}
}

void networks_detach(struct networks *nets)
{
	if (nets != NULL && nets->gateway != NULL) {
		gateway_detach(gateway_sockets_gateway(nets->gateway));
	}
	if (nets != NULL && nets->eoe != NULL) {
		eoe_switch_detach(nets->eoe);
	}
}

/* --- reports --- */

static int32_t grown(uint64_t now, uint64_t before)
{
	return (int32_t)(now - before < INT32_MAX ? now - before : INT32_MAX);
}

static int report_gateway(struct networks *nets, struct event *ret_event)
{
	const struct gateway_counters *ct =
		gateway_counters(gateway_sockets_gateway(nets->gateway));
	const struct gateway_counters *seen = &nets->gateway_seen;

	*ret_event = (struct event){
		.id = EVENT_GATEWAY_LOST,
		.slave_pos = EVENT_NO_SLAVE,
		.value = grown(ct->closed, seen->closed),
		.arg = { grown(ct->unanswered, seen->unanswered),
			 grown(ct->dropped + ct->malformed, seen->dropped + seen->malformed) },
	};
	nets->gateway_seen = *ct;
	return ret_event->value > 0 || ret_event->arg[0] > 0 || ret_event->arg[1] > 0;
}

static uint64_t frames_lost(const struct eoe_switch_counters *ct)
{
	return ct->queue_full + ct->not_taken + ct->host_lost;
}

static uint64_t frames_rejected(const struct eoe_switch_counters *ct)
{
	return ct->bad_fragments + ct->invalid_frames;
}

static int report_eoe(struct networks *nets, struct event *ret_event)
{
	const struct eoe_switch_counters *ct = eoe_switch_counters(nets->eoe);
	int32_t rejected = grown(frames_rejected(ct), frames_rejected(&nets->eoe_seen));

	*ret_event = (struct event){
		.id = EVENT_EOE_LOST,
		.slave_pos = rejected > 0 ? ct->bad_slave : EVENT_NO_SLAVE,
		.arg = { grown(frames_lost(ct), frames_lost(&nets->eoe_seen)), rejected },
	};
	nets->eoe_seen = *ct;
	return ret_event->arg[0] > 0 || rejected > 0;
}

int networks_report(struct networks *nets, mono_t now, struct event *ret_event)
{
	int has_event = 0;

	if (now.ns < nets->report_at.ns) {
		return 0;
	}
	if (nets->gateway != NULL) {
		has_event = report_gateway(nets, ret_event);
	}
	if (!has_event && nets->eoe != NULL) {
		has_event = report_eoe(nets, ret_event);
	}
	if (!has_event) {
		nets->report_at = mono_add(now, (span_t){ REPORT_NS });
	}
	return has_event;
}
