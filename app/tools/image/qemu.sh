#!/bin/sh
# SPDX-License-Identifier: MIT
# A program of the SDK chroot (QEMU, mtools) on files of a folder: qemu.sh FOLDER PROGRAM [ARGUMENT...]
# The folder is seen under its own path; nothing of the chroot is changed.
set -eu

[ $# -ge 2 ] || {
	echo 'usage: app/tools/image/qemu.sh FOLDER PROGRAM [ARGUMENT...]' >&2
	exit 2
}
folder=$(CDPATH='' cd -- "$1" && pwd)
shift
cache=${XDG_CACHE_HOME:-$HOME/.cache}/ecdaq/image
sdk=$cache/sdk/ecdaq-arm64
[ -x "$sdk/usr/bin/qemu-system-aarch64" ] || {
	echo 'build.sh: boot: no QEMU yet: run ./build.sh image first' >&2
	exit 1
}
[ "$(id -u)" = 0 ] || {
	echo 'build.sh: boot: needs root (QEMU runs in the image chroot); try: sudo ./build.sh boot' >&2
	exit 1
}
mkdir -p "$cache/mount"
# shellcheck disable=SC2016  # expanded by the inner shell
exec unshare --mount --propagation private sh -euc '
	sdk=$1 folder=$2 scratch=$3
	shift 3
	mount -t tmpfs scratch "$scratch"
	mkdir "$scratch/upper" "$scratch/work" "$scratch/root"
	mount -t overlay -o "lowerdir=$sdk,upperdir=$scratch/upper,workdir=$scratch/work" \
		overlay "$scratch/root"
	root=$scratch/root
	mkdir -p "$root$folder"
	mount --bind "$folder" "$root$folder"
	mount --bind /dev "$root/dev"
	mount -t proc proc "$root/proc"
	cp -L /etc/resolv.conf "$root/etc/resolv.conf" 2> /dev/null || :
	exec chroot "$root" sh -euc "cd \"\$1\" && shift && exec \"\$@\"" in "$folder" "$@"
	' qemu "$sdk" "$folder" "$cache/mount" "$@"
