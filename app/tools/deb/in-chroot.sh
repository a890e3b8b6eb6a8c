#!/bin/sh
# SPDX-License-Identifier: MIT
# Run a command in a Debian tree, which stays as it is: in-chroot.sh [--ccache DIR | --network] TREE FOLDER COMMAND...
# As root, on an overlay that is gone afterwards, with FOLDER at /mnt; without network, or with this machine's, as pip
# and apt here reach their registries. Nothing stays mounted.
set -eu

ccache=
net=--net
case $1 in
--ccache)
	ccache=$2
	mkdir -p "$ccache"
	shift 2
	;;
--network)
	net=
	shift
	;;
esac
tree=$1 folder=$2
shift 2
# shellcheck disable=SC2016,SC2086 # expanded by the shell inside; one word or none
exec unshare --mount --pid --ipc --uts $net --fork --kill-child --propagation private sh -euc '
	tree=$1 folder=$2 ccache=$3 net=$4
	shift 4
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
	if [ -n "$net" ]; then
		ip link set lo up
	else
		cat /etc/resolv.conf > /media/root/etc/resolv.conf
		for word in $(env | sed -n "s/^\(PIP_INDEX_URL\|PIP_EXTRA_INDEX_URL\|PIP_PROXY\|PIP_DEFAULT_TIMEOUT\|[a-zA-Z]*_proxy\|[A-Z]*_PROXY\)=.*/\1/p"); do
			kept="${kept:-} $word=$(printenv "$word")"
		done
		if [ -r /etc/ssl/certs/ca-certificates.crt ]; then
			cp /etc/ssl/certs/ca-certificates.crt /media/root/run/
			kept="${kept:-} PIP_CERT=/run/ca-certificates.crt"
		fi
	fi
	hostname debian
	echo "127.0.0.1 localhost debian" > /media/root/etc/hosts
	cd /
	exec env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive \
		${SOURCE_DATE_EPOCH:+SOURCE_DATE_EPOCH=$SOURCE_DATE_EPOCH} ${ccache:+CCACHE_DIR=/ccache} ${kept:-} \
		chroot /media/root "$@"
	' in-chroot "$tree" "$folder" "$ccache" "$net" "$@"
