#!/bin/sh
# SPDX-License-Identifier: MIT
# The image in QEMU, for a person. `./build.sh boot` calls this.
set -eu

here=$(CDPATH='' cd -- "$(dirname -- "$0")" && pwd)
root=$(CDPATH='' cd -- "$here/../../.." && pwd)

usage()
{
	cat <<'USAGE'
usage: ./build.sh boot [--fresh] [--ssh-port N] [--key FILE] [--config FILE] [--icount]
                       [--lan] [-- QEMU-OPTION...]

Boots the image of machine qemuarm64 in QEMU (no KVM needed): its serial console here, its SSH port on
127.0.0.1, the EtherCAT segment simulated inside. Nobody has a password: log in with

  ssh -p 2222 -i build/image/boot/key operator@127.0.0.1

and end it with `sudo poweroff` there, or Ctrl-a x here. The disk keeps what was recorded.

  --fresh       start from a new disk (default: the disk of the last time, if the image is the same)
  --ssh-port N  port on 127.0.0.1 that leads to the guest's SSH (default: 2222)
  --key FILE    public key that may log in (default: one made for this, build/image/boot/key)
  --config FILE ecdaq.yaml for the boot partition (default: one for emulation,
                app/tools/image/profile-host.yaml or profile-guest.yaml)
  --lan         the guest's network port is a tap of this host, ecdaqlan: 192.168.77.1 here,
                192.168.77.2 there; its SSH port is there, and samples come over DDS, domain 0
  --icount      the guest's clock counts instructions: slower, and a 1 ms cycle holds in guest time
USAGE
}

die()
{
	printf 'build.sh: boot: %s\n' "$*" >&2
	exit 1
}

fresh=no
port=2222
key=
config=
lan=no
timing=host
check=no
while [ $# -gt 0 ]; do
	case $1 in
	--fresh) fresh=yes ;;
	--check) check=yes ;; # build.sh: are the options good?
	--icount) timing=guest ;;
	--lan) lan=yes ;;
	--ssh-port | --key | --config)
		[ $# -ge 2 ] || die "$1 needs a value"
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
	*) die "unknown option '$1' (see --help)" ;;
	esac
	shift
done
case $port in
'' | *[!0-9]*) die "--ssh-port: '$port' is no port" ;;
esac
[ "$check" = no ] || exit 0

image=$root/build/image/qemuarm64
name=ecdaq-image-ecdaq-qemuarm64
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
cp "$image/$name-vmlinux" "$vm/vmlinux"
cp "$image/$name.cmdline" "$vm/cmdline"
cp "$key" "$vm/authorized_keys"
cp "$config" "$vm/ecdaq.yaml"
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

if [ "$lan" = no ]; then
	echo "-- ssh -p $port -i $vm/key operator@127.0.0.1    (end: Ctrl-a x)" >&2
	exec "$here/virt.sh" "$vm" "$timing" -nographic \
		-netdev "user,id=lan,hostfwd=tcp:127.0.0.1:$port-:22" \
		-device virtio-net-pci,netdev=lan,romfile= "$@"
fi
echo "-- ssh -i $vm/key operator@192.168.77.2    (end: Ctrl-a x)" >&2
ip tuntap add dev ecdaqlan mode tap || die "--lan: no tap ecdaqlan to be had (its reason stands above)"
trap 'ip link delete ecdaqlan' EXIT
trap 'exit 1' INT TERM HUP
ip address add 192.168.77.1/24 dev ecdaqlan
ip link set ecdaqlan multicast on up
"$here/virt.sh" "$vm" "$timing" -nographic -netdev tap,id=lan,ifname=ecdaqlan,script=no,downscript=no \
	-device virtio-net-pci,netdev=lan,romfile= "$@"
