/* SPDX-License-Identifier: MIT */
/* The EtherCAT port: link, sleep, waiting, and who else uses it. */
#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "cli/doctor/patient.h"

#define NET_DIR "/sys/class/net"
#define FLAG_UP 0x1 /* IFF_UP */

enum { SPEED_MBIT = 100, PROTOCOL_ECAT = 0x88a4 };

int patient_has_nic(const struct patient *p, struct finding *f)
{
	if (p->nic[0] == '\0') {
		finding_set(f, FINDING_SKIP, "no port is configured");
		return 0;
	}
	if (p->is_nic_elsewhere) {
		finding_set(f, FINDING_SKIP, "%s is in a network namespace of ecdaqd's own",
			    p->nic);
		return 0;
	}
	if (!sight_exists(&p->sight, NET_DIR "/%s", p->nic)) {
		finding_set(f, FINDING_SKIP, "no port %s", p->nic);
		return 0;
	}
	return 1;
}

int patient_is_nic_virtual(const struct patient *p)
{
	char device[SIGHT_TEXT_BYTES];

	/* In a copy the link may point at nothing. */
	return sight_link(&p->sight, device, NET_DIR "/%s/device", p->nic) < 0 &&
	       !sight_exists(&p->sight, NET_DIR "/%s/device", p->nic);
}

static void add_name(void *ctx, const char *name)
{
	char *names = ctx;
	size_t used = strlen(names);

	snprintf(names + used, SIGHT_TEXT_BYTES - used, "%s%s", used > 0 ? ", " : "", name);
}

static void judge_absence(const struct patient *p, struct finding *f)
{
	char names[SIGHT_TEXT_BYTES] = "";
	int r = sight_each(&p->sight, NET_DIR, add_name, names);

	if (r < 0) {
		finding_unread(f, NET_DIR, r);
		return;
	}
	finding_set(f, FINDING_FAIL, "%s: no such port; there are: %.100s", p->nic, names);
	finding_mend(f, "bus.interface in ecdaq.yaml, or --interface for another one");
}

static void judge_speed(const struct patient *p, struct finding *f)
{
	char duplex[SIGHT_TEXT_BYTES] = "";
	int64_t speed_mbit;

	if (patient_is_nic_virtual(p)) {
		finding_set(f, FINDING_OK, "%s: link; a virtual port", p->nic);
		return;
	}
	if (sight_number(&p->sight, &speed_mbit, NET_DIR "/%s/speed", p->nic) < 0 ||
	    speed_mbit <= 0) {
		finding_set(f, FINDING_OK, "%s: link; it does not tell its speed", p->nic);
		return;
	}
	sight_text(&p->sight, duplex, NET_DIR "/%s/duplex", p->nic);
	if (strcmp(duplex, "half") == 0) {
		finding_set(f, FINDING_FAIL, "%s: half duplex: frames collide", p->nic);
		finding_mend(f, "ethtool --change %s autoneg on", p->nic);
	} else if (speed_mbit != SPEED_MBIT) {
		finding_set(f, FINDING_WARN,
			    "%s: %" PRId64 " Mbit/s, an EtherCAT slave speaks %d: not one at the "
			    "other end?",
			    p->nic, speed_mbit, SPEED_MBIT);
		finding_mend(f, "connect the first slave's IN port without a switch between");
	} else {
		finding_set(f, FINDING_OK, "%s: link, %d Mbit/s %.20s duplex", p->nic, SPEED_MBIT,
			    duplex);
	}
}

void check_nic(const struct patient *p, struct finding *f)
{
	char flags[SIGHT_TEXT_BYTES];
	int64_t carrier = 0;

	if (p->nic[0] == '\0') {
		finding_set(f, FINDING_SKIP, "no port is configured");
		finding_mend(f, "bus.interface in ecdaq.yaml, or --interface");
	} else if (p->is_nic_elsewhere) {
		patient_has_nic(p, f);
	} else if (!sight_exists(&p->sight, NET_DIR "/%s", p->nic)) {
		judge_absence(p, f);
	} else if (sight_text(&p->sight, flags, NET_DIR "/%s/flags", p->nic) >= 0 &&
		   (strtoul(flags, NULL, 16) & FLAG_UP) == 0) {
		finding_set(f, FINDING_FAIL, "%s is switched off", p->nic);
		finding_mend(f, "ip link set %s up", p->nic);
	} else if (sight_number(&p->sight, &carrier, NET_DIR "/%s/carrier", p->nic) < 0 ||
		   carrier != 1) {
		finding_set(f, FINDING_FAIL, "%s: no link", p->nic);
		finding_mend(f, "plug the cable in; has the first slave power?");
	} else {
		judge_speed(p, f);
	}
}

void check_eee(const struct patient *p, struct finding *f)
{
	struct sight_eee eee;
	int r;

	if (!patient_has_nic(p, f)) {
		return;
	}
	r = sight_eee(&p->sight, p->nic, &eee);
	if (r == -EOPNOTSUPP) {
		finding_set(f, FINDING_OK, "%s has no energy-efficient Ethernet", p->nic);
	} else if (r < 0) {
		finding_unread(f, "energy-efficient Ethernet", r);
	} else if (eee.is_enabled || eee.is_active) {
		finding_set(f, eee.is_active ? FINDING_FAIL : FINDING_WARN,
			    "%s: energy-efficient Ethernet is %s", p->nic,
			    eee.is_active ? "active: the link sleeps between frames"
					  : "enabled, but not in use with this other end");
		finding_mend(f, "ethtool --set-eee %s eee off (Pi 4: dtparam=eee=off)", p->nic);
	} else {
		finding_set(f, FINDING_OK, "off");
	}
}

void check_coalescing(const struct patient *p, struct finding *f)
{
	struct sight_coalesce c;
	int64_t deadline_us = (int64_t)((double)p->cfg->cycle_period_ns *
					p->cfg->cycle_receive_percent / 100 / NS_PER_US);
	int r;

	if (!patient_has_nic(p, f)) {
		return;
	}
	r = sight_coalesce(&p->sight, p->nic, &c);
	if (r == -EOPNOTSUPP) {
		finding_set(f, FINDING_OK, "%s does not collect frames", p->nic);
	} else if (r < 0) {
		finding_unread(f, "coalescing", r);
	} else if (!c.is_adaptive && (c.rx_us == 0 || c.rx_frames == 1)) {
		finding_set(f, FINDING_OK, "rx-usecs %" PRId64 ", rx-frames %" PRId64, c.rx_us,
			    c.rx_frames);
	} else {
		finding_set(f, c.rx_us >= deadline_us ? FINDING_FAIL : FINDING_WARN,
			    "%s keeps a frame back for up to %" PRId64
			    " us%s; the cycle waits %" PRId64 " us",
			    p->nic, c.rx_us, c.is_adaptive ? ", adaptively" : "", deadline_us);
		finding_mend(f, "ethtool --coalesce %s adaptive-rx off rx-usecs 0 rx-frames 1",
			     p->nic);
	}
}

/* Packet sockets on the port, or on all, that want something else than EtherCAT. */
static unsigned listeners(const struct patient *p, int64_t index)
{
	FILE *file = sight_open(&p->sight, "/proc/net/packet");
	char line[SIGHT_TEXT_BYTES];
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

static int is_managed(const struct patient *p, int64_t index)
{
	FILE *file = sight_open(&p->sight, "/run/NetworkManager/devices/%" PRId64, index);
	char line[SIGHT_TEXT_BYTES];
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

void check_nic_users(const struct patient *p, struct finding *f)
{
	char text[SIGHT_TEXT_BYTES] = "";
	int64_t index = -1;
	unsigned count;
	int r;

	if (!patient_has_nic(p, f)) {
		return;
	}
	sight_number(&p->sight, &index, NET_DIR "/%s/ifindex", p->nic);
	r = sight_addresses(&p->sight, p->nic, text);
	count = listeners(p, index);
	if (sight_link(&p->sight, text, NET_DIR "/%s/master", p->nic) >= 0) {
		finding_set(f, FINDING_FAIL, "%s is a part of %.60s", p->nic, text);
		finding_mend(f, "ip link set %s nomaster", p->nic);
	} else if (r > 0) {
		finding_set(f, FINDING_WARN, "%s has addresses, so others send on it: %.100s",
			    p->nic, text);
		finding_mend(f, "ip address flush dev %s, and no DHCP or IPv6 on it", p->nic);
	} else if (is_managed(p, index)) {
		finding_set(f, FINDING_WARN, "NetworkManager manages %s and sends on it", p->nic);
		finding_mend(f, "nmcli device set %s managed no", p->nic);
	} else if (count > 0) {
		finding_set(f, FINDING_WARN, "%u packet socket%s of others see every frame of %s",
			    count, count == 1 ? "" : "s", p->nic);
		finding_mend(f, "end tcpdump, dhclient, lldpd and the like on %s", p->nic);
	} else if (r < 0) {
		finding_unread(f, "addresses", r);
	} else {
		finding_set(f, FINDING_OK, "%s has no address and no other listener", p->nic);
	}
}
