/* SPDX-License-Identifier: MIT */
/* The EtherCAT port: link, other users, energy-efficient Ethernet, interrupt coalescing. */
#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "cli/doctor/check.h"

#define NET_DIR "/sys/class/net"
#define EEE_REMEDY REMEDY "ethtool --set-eee {nic} eee off (Pi 4: dtparam=eee=off)"
#define FLAG_UP 0x1 /* IFF_UP */

enum { SPEED_MBIT = 100, PROTOCOL_ECAT = 0x88a4 };

int target_is_nic_virtual(const struct target *t)
{
	char device[PROBE_TEXT_BYTES];

	/* In a copy the link may be dangling. */
	return probe_link(&t->probe, device, NET_DIR "/%s/device", t->nic) < 0 &&
	       !probe_exists(&t->probe, NET_DIR "/%s/device", t->nic);
}

static void add_name(void *ctx, const char *name)
{
	char *names = ctx;
	size_t used = strlen(names);

	snprintf(names + used, PROBE_TEXT_BYTES - used, "%s%s", used > 0 ? ", " : "", name);
}

static void judge_absence(const struct target *t, struct finding *f)
{
	char names[PROBE_TEXT_BYTES] = "";
	int r = probe_each(&t->probe, NET_DIR, add_name, names);

	if (r < 0) {
		finding_unread(f, NET_DIR, r);
		return;
	}
	finding_set(f, FINDING_FAIL,
		    "%s: no such port; there are: %.100s" REMEDY
		    "bus.interface in ecdaq.yaml, or --interface for another one",
		    t->nic, names);
}

static void judge_speed(const struct target *t, struct finding *f)
{
	char duplex[PROBE_TEXT_BYTES] = "";
	int64_t speed_mbit;

	if (target_is_nic_virtual(t)) {
		finding_set(f, FINDING_OK, "%s: link; a virtual port", t->nic);
		return;
	}
	if (probe_number(&t->probe, &speed_mbit, NET_DIR "/%s/speed", t->nic) < 0 ||
	    speed_mbit <= 0) {
		finding_set(f, FINDING_OK, "%s: link; speed unknown", t->nic);
		return;
	}
	probe_text(&t->probe, duplex, NET_DIR "/%s/duplex", t->nic);
	if (strcmp(duplex, "half") == 0) {
		finding_set(f, FINDING_FAIL,
			    "%s: half duplex: frames collide" REMEDY
			    "ethtool --change %s autoneg on",
			    t->nic, t->nic);
	} else if (speed_mbit != SPEED_MBIT) {
		finding_set(f, FINDING_WARN,
			    "%s: %" PRId64 " Mbit/s, EtherCAT uses %d: is another device at the "
			    "other end?" REMEDY
			    "connect the IN port of the first slave directly, without a switch",
			    t->nic, speed_mbit, SPEED_MBIT);
	} else {
		finding_set(f, FINDING_OK, "%s: link, %d Mbit/s %.20s duplex", t->nic, SPEED_MBIT,
			    duplex);
	}
}

static void judge_nic(const struct target *t, struct finding *f)
{
	char flags[PROBE_TEXT_BYTES];
	int64_t carrier = 0;

	if (t->nic[0] == '\0') {
		finding_set(f, FINDING_SKIP,
			    "no port is configured" REMEDY
			    "bus.interface in ecdaq.yaml, or --interface");
	} else if (t->is_nic_elsewhere) {
		target_has(t, NEEDS_NIC, f);
	} else if (!probe_exists(&t->probe, NET_DIR "/%s", t->nic)) {
		judge_absence(t, f);
	} else if (probe_text(&t->probe, flags, NET_DIR "/%s/flags", t->nic) >= 0 &&
		   (strtoul(flags, NULL, 16) & FLAG_UP) == 0) {
		finding_set(f, FINDING_FAIL, "%s is down" REMEDY "ip link set %s up", t->nic,
			    t->nic);
	} else if (probe_number(&t->probe, &carrier, NET_DIR "/%s/carrier", t->nic) < 0 ||
		   carrier != 1) {
		finding_set(f, FINDING_FAIL,
			    "%s: no link" REMEDY "connect the cable; is the first slave powered?",
			    t->nic);
	} else {
		judge_speed(t, f);
	}
}

static void judge_coalescing(const struct target *t, struct finding *f)
{
	int64_t deadline_us = (int64_t)((double)t->cfg->cycle_period_ns *
					t->cfg->cycle_receive_percent / 100 / NS_PER_US);
	char text[PROBE_TEXT_BYTES];
	int64_t rx_us = 0;
	int64_t rx_frames = 0;
	int64_t is_adaptive = 0;
	int r = probe_call(&t->probe, "coalesce", t->nic, text);

	if (r >= 0 && (probe_figure(text, "rx_us", &rx_us) < 0 ||
		       probe_figure(text, "rx_frames", &rx_frames) < 0 ||
		       probe_figure(text, "adaptive", &is_adaptive) < 0)) {
		r = -EBADMSG;
	}
	if (r == -EOPNOTSUPP) {
		finding_set(f, FINDING_OK, "%s has no interrupt coalescing", t->nic);
	} else if (r < 0) {
		finding_unread(f, "coalescing", r);
	} else if (is_adaptive == 0 && (rx_us == 0 || rx_frames == 1)) {
		finding_set(f, FINDING_OK, "rx-usecs %" PRId64 ", rx-frames %" PRId64, rx_us,
			    rx_frames);
	} else {
		finding_set(f, rx_us >= deadline_us ? FINDING_FAIL : FINDING_WARN,
			    "%s delays received frames by up to %" PRId64
			    " us%s; the cycle waits %" PRId64 " us" REMEDY
			    "ethtool --coalesce %s adaptive-rx off rx-usecs 0 rx-frames 1",
			    t->nic, rx_us, is_adaptive != 0 ? ", adaptively" : "", deadline_us,
			    t->nic);
	}
}

/* Packet sockets on the port, or on all ports, for other protocols than EtherCAT. */
static unsigned listeners(const struct target *t, int64_t index)
{
	FILE *file = probe_open(&t->probe, "/proc/net/packet");
	char line[PROBE_TEXT_BYTES];
	unsigned count = 0;

	if (file == NULL) {
		return 0;
	}
	while (fgets(line, sizeof(line), file) != NULL) {
		char *field = line;
		char *word[5] = { NULL }; /* sk RefCnt Type Proto Iface */
		int words = 0;
		long iface;

		while (words < 5 && (word[words] = strsep(&field, " \n")) != NULL) {
			words += word[words][0] != '\0';
		}
		if (words < 5 || strcmp(word[0], "sk") == 0) {
			continue;
		}
		iface = strtol(word[4], NULL, 10);
		count += (iface == 0 || iface == index) && strtoul(word[3], NULL, 16) != 0 &&
			 strtoul(word[3], NULL, 16) != PROTOCOL_ECAT;
	}
	fclose(file);
	return count;
}

static int is_managed(const struct target *t, int64_t index)
{
	FILE *file = probe_open(&t->probe, "/run/NetworkManager/devices/%" PRId64, index);
	char line[PROBE_TEXT_BYTES];
	int managed = 0;

	if (file == NULL) {
		return 0;
	}
	while (fgets(line, sizeof(line), file) != NULL) {
		managed |= strcmp(line, "managed=true\n") == 0;
	}
	fclose(file);
	return managed;
}

static void judge_nic_users(const struct target *t, struct finding *f)
{
	char text[PROBE_TEXT_BYTES] = "";
	int64_t index = -1;
	unsigned count;
	int r;

	probe_number(&t->probe, &index, NET_DIR "/%s/ifindex", t->nic);
	r = probe_call(&t->probe, "addresses", t->nic, text);
	count = listeners(t, index);
	if (probe_link(&t->probe, text, NET_DIR "/%s/master", t->nic) >= 0) {
		finding_set(f, FINDING_FAIL,
			    "%s is a port of %.60s" REMEDY "ip link set %s nomaster", t->nic, text,
			    t->nic);
	} else if (r > 0) {
		finding_set(f, FINDING_WARN,
			    "%s has IP addresses, so other programs send on it: %.100s" REMEDY
			    "ip address flush dev %s, and no DHCP or IPv6 on it",
			    t->nic, text, t->nic);
	} else if (is_managed(t, index)) {
		finding_set(f, FINDING_WARN,
			    "NetworkManager manages %s and sends on it" REMEDY
			    "nmcli device set %s managed no",
			    t->nic, t->nic);
	} else if (count > 0) {
		finding_set(f, FINDING_WARN,
			    "%u other packet socket%s receive%s every frame of %s" REMEDY
			    "stop tcpdump, dhclient, lldpd and the like on %s",
			    count, count == 1 ? "" : "s", count == 1 ? "s" : "", t->nic, t->nic);
	} else if (r < 0) {
		finding_unread(f, "addresses", r);
	} else {
		finding_set(f, FINDING_OK, "%s has no address and no other listener", t->nic);
	}
}

const struct check checks_of_nic[] = {
	{ .name = "nic", .judge = judge_nic },
	{ .name = "nic_users", .needs = NEEDS_NIC, .judge = judge_nic_users },
	{ .name = "eee",
	  .needs = NEEDS_NIC,
	  .fact = "eee enabled",
	  .rules = { { FINDING_OK, "{nic} has no energy-efficient Ethernet", IF_UNSUPPORTED, NULL,
		       NULL },
		     { FINDING_FAIL,
		       "{nic}: energy-efficient Ethernet is active: the link sleeps between "
		       "frames" EEE_REMEDY,
		       IF_AT_LEAST, "1", "eee active" },
		     { FINDING_WARN,
		       "{nic}: energy-efficient Ethernet is enabled, but not in use with this "
		       "other end" EEE_REMEDY,
		       IF_AT_LEAST, "1", NULL },
		     { .level = FINDING_OK, .text = "off" } } },
	{ .name = "coalescing", .needs = NEEDS_NIC, .judge = judge_coalescing },
	{ .name = NULL },
};
