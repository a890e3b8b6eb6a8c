#!/bin/sh
# SPDX-License-Identifier: MIT
# Run a command in a Debian tree, which stays as it is: in-chroot.sh [--ccache DIR] TREE FOLDER COMMAND...
# As root, on an overlay that is gone afterwards, without network, with FOLDER at /mnt. Nothing stays mounted.
set -eu

ccache=
if [ "$1" = --ccache ]; then
	ccache=$2
	mkdir -p "$ccache"
	shift 2
fi
tree=$1 folder=$2
shift 2
# shellcheck disable=SC2016 # expanded by the shell inside
exec unshare --mount --pid --ipc --uts --net --fork --kill-child --propagation private sh -euc '
	tree=$1 folder=$2 ccache=$3
	shift 3
	# Seen in this mount namespace only.
	mount -t tmpfs -o mode=755 scratch /media
	mkdir /media/upper /media/work /media/root
	mount -t overlay -o "lowerdir=$tree,upperdir=/media/upper,workdir=/media/work" overlay /media/root
	mount --bind "$folder" /media/root/mnt
	mount -t proc proc /media/root/proc
	mount -t sysfs -o ro sysfs /media/root/sys
	mount --rbind /dev /media/root/dev
	mount -t tmpfs -o mode=755 run /media/root/run
	mkdir /media/root/run/lock
	if [ -n "$ccache" ]; then
		mkdir /media/root/ccache
		mount --bind "$ccache" /media/root/ccache
	fi
	ip link set lo up
	hostname debian
	echo "127.0.0.1 localhost debian" > /media/root/etc/hosts
	cd /
	exec env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive \
		${SOURCE_DATE_EPOCH:+SOURCE_DATE_EPOCH=$SOURCE_DATE_EPOCH} ${ccache:+CCACHE_DIR=/ccache} \
		chroot /media/root "$@"
	' in-chroot "$tree" "$folder" "$ccache" "$@"
