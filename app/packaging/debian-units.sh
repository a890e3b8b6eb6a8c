#!/bin/sh
# SPDX-License-Identifier: MIT
# Units, users and directories of a Debian machine, from those of the image: debian-units.sh ROOT DEBIAN
# ROOT is files/root of the recipe ecdaq-config, DEBIAN the debian/ folder of the packages. There is one place
# for what a service may do; a machine that is not the image differs in paths, users' numbers and the port.
set -eu

[ $# = 2 ] || {
	echo "usage: debian-units.sh ROOT DEBIAN" >&2
	exit 2
}
root=$1 debian=$2

# The configuration is a file in /etc, not of the boot partition; recordings are below /var/lib; the port is
# the operator's choice.
to_debian='
s|^EnvironmentFile=/run/ecdaq-boot/environment$|EnvironmentFile=-/etc/default/ecdaq|
s|/run/ecdaq-boot/ecdaq\.yaml|/etc/ecdaq/ecdaq.yaml|
s|ecdaq-boot-config\.service *||
s|/data/record|/var/lib/ecdaq/record|
s|/data/uplink|/var/lib/ecdaq/uplink|
/^Wants=ecdaq-nic\.service$/d
s|ecdaq-nic\.service *||
/^After=$/d
s|^Documentation=file:///usr/share/doc/ecdaq$|&/README.Debian|
'
mkdir -p "$debian/units" "$debian/lib"
for unit in "$root"/usr/lib/systemd/system/*.service; do
	grep -q '^ExecStart=/usr/bin/ecdaq' "$unit" || continue
	sed "$to_debian" "$unit" > "$debian/units/${unit##*/}"
done
sed 's|-ecat0\.device|-%i.device|; s| ecat0$| %i|; s|^Description=.*|Description=EtherCAT port %i set up for the cycle|' \
	"$root/usr/lib/systemd/system/ecdaq-nic.service" > "$debian/units/ecdaq-nic@.service"
cp "$root/usr/lib/ecdaq/nic-setup" "$root/usr/lib/ecdaq/port-irqs" "$debian/lib/"

# Numbers as the machine has them free; the operator is whoever joins the groups.
sed -n 's|^g \(ecdaq[^ ]*\) [0-9]* -$|g \1 - -|p; /^m ecdaq/p
s|^\(u ecdaq[^ ]*\) [0-9]*:900 \(".*"\) /$|\1 -:ecdaq-read \2|p' \
	"$root/usr/lib/sysusers.d/ecdaq.conf" > "$debian/ecdaq.sysusers"
sed -n 's|^d /data/record |d /var/lib/ecdaq/record |p; s|^d /data/uplink |d /var/lib/ecdaq/uplink |p
/^d \/run\/ecdaq[ \/]/p; /^d \/var\/lib\/ecdaq /p' \
	"$root/usr/lib/tmpfiles.d/ecdaq.conf" > "$debian/ecdaq.tmpfiles"
# Other rules are for the image's port and GPIO lines.
grep '^KERNEL=="cpu_dma_latency"' "$root/usr/lib/udev/rules.d/60-ecdaq.rules" > "$debian/ecdaq.udev"

# What of the image is left has not been thought of here.
if grep -n '^[^#]*\(ecdaq-boot\|/data/\|ecat0\|90[0-9]:\|/boot\|operator\)' "$debian"/units/* \
	"$debian/ecdaq.sysusers" "$debian/ecdaq.tmpfiles" "$debian/ecdaq.udev" >&2; then
	echo "debian-units.sh: the lines above are the image's: add a rule to $0" >&2
	exit 1
fi
for kind in g u m; do
	[ "$(grep -c "^$kind ecdaq" "$root/usr/lib/sysusers.d/ecdaq.conf")" = \
		"$(grep -c "^$kind ecdaq" "$debian/ecdaq.sysusers")" ] || {
		echo "debian-units.sh: a '$kind' line of sysusers.d/ecdaq.conf was not understood" >&2
		exit 1
	}
done
