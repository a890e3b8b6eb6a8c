#!/bin/sh
# SPDX-License-Identifier: MIT
# make-bundle.sh DISK KEY CERT FOLDER: the first slot of a disk image as a bundle in FOLDER, by RAUC of the SDK chroot.
# Machine and version are those that the slot names; ECDAQ_BUNDLE_VERSION and ECDAQ_BUNDLE_MACHINE give others, and
# ECDAQ_BUNDLE_SLOT a slot of its own, for tests.
set -eu

here=$(CDPATH='' cd -- "$(dirname -- "$0")" && pwd)
disk=$1
key=$2
cert=$3
folder=$4
work=$folder/bundle.work
rm -rf "$work"
mkdir -p "$work/content"
trap 'rm -rf "$work"' EXIT
cp "$cert" "$work/cert.pem"
(umask 077 && cp "$key" "$work/key.pem")
if [ -n "${ECDAQ_BUNDLE_SLOT:-}" ]; then
	cp --sparse=always "$ECDAQ_BUNDLE_SLOT" "$work/content/rootfs.img"
else
	# Start and size of the second partition, in sectors.
	# shellcheck disable=SC2046 # two numbers
	set -- $("$here/qemu.sh" "$(dirname "$disk")" sfdisk --dump "$(basename "$disk")" |
		sed -n 's/.*start= *\([0-9]*\), size= *\([0-9]*\),.*/\1 \2/p' | sed -n 2p)
	dd if="$disk" of="$work/content/rootfs.img" bs=4096 skip=$(($1 / 8)) count=$(($2 / 8)) conv=sparse status=none
	# Sparse at its end, too.
	truncate -s $(($2 * 512)) "$work/content/rootfs.img"
fi
named=$("$here/qemu.sh" "$work" debugfs -R 'cat /usr/lib/ecdaq/image' content/rootfs.img 2> /dev/null || :)
image=${named%% *}
version=${named#* }
version=${ECDAQ_BUNDLE_VERSION:-${version%%,*}}
machine=${ECDAQ_BUNDLE_MACHINE:-${image#ecdaq-image-}}
cat > "$work/content/manifest.raucm" <<MANIFEST
[update]
compatible=$machine
version=$version
description=$named

[bundle]
format=verity

[image.rootfs]
filename=rootfs.img
MANIFEST
"$here/qemu.sh" "$work" rauc bundle --cert=cert.pem --key=key.pem --mksquashfs-args='-comp zstd -quiet -no-progress' \
	content bundle.raucb > "$work/log" 2>&1 || {
	echo "make-bundle.sh: rauc: $(tail -n 1 "$work/log")" >&2
	exit 1
}
mv "$work/bundle.raucb" "$folder/$machine-$version.raucb"
echo "$folder/$machine-$version.raucb"
