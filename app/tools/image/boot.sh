#!/bin/sh
# SPDX-License-Identifier: MIT
# The image in QEMU, for interactive use. `./build.sh boot` calls this.
set -eu

here=$(CDPATH='' cd -- "$(dirname -- "$0")" && pwd)
root=$(CDPATH='' cd -- "$here/../../.." && pwd)

usage()
{
	cat <<'USAGE'
usage: ./build.sh boot [--fresh] [--ssh-port N] [--key FILE] [--config FILE] [--icount]
                       [--lan] [--wire] [-- QEMU-OPTION...]

Boots the image of machine ecdaq-qemuarm64 in QEMU (no KVM needed): its serial console here, its SSH port on
127.0.0.1, the EtherCAT segment simulated inside. There are no passwords: log in with

  ssh -p 2222 -i build/image/boot/key operator@127.0.0.1

and end it with `sudo poweroff` there, or Ctrl-a x here. The disk keeps what was recorded.

  --fresh       start from a new disk (default: the previous disk, if the image is the same)
  --ssh-port N  port on 127.0.0.1 that leads to the guest's SSH (default: 2222)
  --key FILE    public key that may log in (default: one made for this, build/image/boot/key)
  --config FILE ecdaq.yaml for the boot partition (default: one for emulation,
                app/tools/image/profile-host.yaml or profile-guest.yaml)
  --lan         the guest's network port is a tap of this host, ecdaqlan: 192.168.77.1 here,
                192.168.77.2 there; its SSH port is there, and samples come over DDS, domain 0
  --wire        the segment is on this host, and its SYNC0 pins are wired to lines 0 and 1 of the
                guest's GPIO chip, which ecdaq-sync0 watches (app/doc/reference/sync0.md); faults by
                app/tools/tell-segment.py --control build/image/boot/control
  --icount      the guest's clock counts instructions: slower, and a 1 ms cycle holds in guest time
USAGE
}

die()
{
	printf 'build.sh: boot: %s\n' "$*" >&2
	exit 1
}

usage_error()
{
	printf 'build.sh: boot: %s\n' "$*" >&2
	exit 2
}

fresh=no
port=2222
key=
config=
lan=no
wire=no
timing=host
check=no
while [ $# -gt 0 ]; do
	case $1 in
	--fresh) fresh=yes ;;
	--check) check=yes ;; # build.sh: are the options good?
	--icount) timing=guest ;;
	--lan) lan=yes ;;
	--wire) wire=yes ;;
	--ssh-port | --key | --config)
		[ $# -ge 2 ] || usage_error "$1 needs a value"
		case $1 in
		--ssh-port) port=$2 ;;
		--key) key=$2 ;;
		--config) config=$2 ;;
		esac
		shift
		;;
	--help | -h)
		usage
		exit 0
		;;
	--)
		shift
		break
		;;
	*) usage_error "unknown option '$1' (see --help)" ;;
	esac
	shift
done
case $port in
'' | *[!0-9]*) usage_error "--ssh-port: '$port' is not a port" ;;
esac
[ "$wire$timing" != yesguest ] || usage_error "--wire: the segment keeps the host's time, --icount does not"
[ "$check" = no ] || exit 0

image=$root/build/image/ecdaq-qemuarm64
name=ecdaq-image-ecdaq-ecdaq-qemuarm64
[ -f "$image/$name.img" ] || die "no image yet: run ./build.sh image first"
vm=$root/build/image/boot
mkdir -p "$vm"
if [ -z "$key" ]; then
	[ -f "$vm/key" ] || ssh-keygen -q -t ed25519 -N '' -C 'made by build.sh boot' -f "$vm/key"
	key=$vm/key.pub
fi
[ -f "$key" ] || die "--key: no file $key"
config=${config:-$here/profile-$timing.yaml}
[ -f "$config" ] || die "--config: no file $config"
if [ "$fresh" = yes ] || [ ! -f "$vm/disk.img" ] || ! cmp -s "$image/$name.sha256" "$vm/made-of"; then
	cp --sparse=always "$image/$name.img" "$vm/disk.img"
	# Room for recordings: the data partition grows into it.
	truncate -s 4G "$vm/disk.img"
	cp "$image/$name.sha256" "$vm/made-of"
fi
cp "$image/$name-u-boot.bin" "$vm/u-boot.bin"
cp "$key" "$vm/authorized_keys"
cp "$config" "$vm/ecdaq.yaml"
[ "$wire" = no ] || grep -q '^sync0:' "$vm/ecdaq.yaml" || cat "$here/profile-wire.yaml" >> "$vm/ecdaq.yaml"
# The boot partition starts at 4 MiB. Its folder network/ belongs to --lan.
boot()
{
	tool=$1
	shift
	"$here/qemu.sh" "$vm" "$tool" -i disk.img@@4M "$@"
}
boot mdeltree ::ecdaq/network > /dev/null 2>&1 || :
if [ "$lan" = yes ]; then
	grep -q '^dds:' "$vm/ecdaq.yaml" || printf 'dds:\n  enable: on\n  interface: enp0s3\n' >> "$vm/ecdaq.yaml"
	printf '[Match]\nName=enp0s3\n[Network]\nAddress=192.168.77.2/24\n' > "$vm/50-lan.network"
	boot mmd ::ecdaq/network
	boot mcopy 50-lan.network ::ecdaq/network/
fi
boot mcopy -o authorized_keys ecdaq.yaml ::ecdaq/

# What was started and created for the guest is removed when it ends.
pids=
taps=
end()
{
	# shellcheck disable=SC2086 # lists
	[ -z "$pids" ] || kill $pids 2> /dev/null || :
	for tap in $taps; do
		ip link delete "$tap"
	done
}
trap end EXIT
trap 'exit 1' INT TERM HUP
add_tap()
{
	ip tuntap add dev "$2" mode tap || die "$1: cannot create tap $2 (see above)"
	taps="$taps $2"
}

if [ "$wire" = yes ]; then
	sim=$root/build/stage/bin/ecdaq-sim
	[ -x "$sim" ] || die "--wire: no $sim yet: run ./build.sh first"
	rm -f "$vm/qtest" "$vm/qmp"
	add_tap --wire ecdaqecat
	ip link set ecdaqecat arp off multicast off up
	[ -p "$vm/edges" ] || mkfifo "$vm/edges"
	"$here/sync0-wire.py" --edges "$vm/edges" --qtest "$vm/qtest" --qmp "$vm/qmp" &
	pids=$!
	"$sim" --interface ecdaqecat --slaves 2 --edges "$vm/edges" --control "$vm/control" &
	pids="$pids $!"
	ECDAQ_APPEND="${ECDAQ_APPEND:-} ecdaq.segment=outside"
	export ECDAQ_APPEND
	set -- -netdev tap,id=ecat,ifname=ecdaqecat,script=no,downscript=no \
		-device virtio-net-pci,netdev=ecat,romfile=,mac=52:54:00:ec:da:01 \
		-qtest "unix:$vm/qtest,server=on,wait=off" -qtest-log none \
		-qmp "unix:$vm/qmp,server=on,wait=off" "$@"
fi
if [ "$lan" = yes ]; then
	add_tap --lan ecdaqlan
	ip address add 192.168.77.1/24 dev ecdaqlan
	ip link set ecdaqlan multicast on up
	echo "-- ssh -i $vm/key operator@192.168.77.2    (end: Ctrl-a x)" >&2
	port="tap,id=lan,ifname=ecdaqlan,script=no,downscript=no"
else
	echo "-- ssh -p $port -i $vm/key operator@127.0.0.1    (end: Ctrl-a x)" >&2
	port="user,id=lan,hostfwd=tcp:127.0.0.1:$port-:22"
fi
set -- "$here/virt.sh" "$vm" "$timing" -nographic -netdev "$port" \
	-device virtio-net-pci,netdev=lan,romfile= "$@"
[ -n "$taps" ] || exec "$@"
"$@"
