#!/bin/sh
# SPDX-License-Identifier: MIT
# Puts a disk together, inside the SDK chroot: make-disk.sh WORKDIR. Reads WORKDIR/disk/plan (written
# by image.py); equal inputs give equal bytes. No device, no mount, no privilege is needed.
set -eu

work=$1
disk=$work/disk
out=$work/out
align=4194304
# A FAT volume number: of what belongs to it, so that two images differ.
volume_id()
{
	printf '%s' "$1" | cut -c 1-8
}

make_vfat()
{
	mkfs.vfat --invariant -F 32 -n "$(printf '%s' "$label" | cut -c 1-11)" \
		-i "$(volume_id "$uuid")" "$part" > /dev/null
	if [ "$source" = bootimg-partition ]; then
		(cd "$disk/boot" && mcopy -s -m -i "$part" ./* ::)
	fi
}

make_ext4()
{
	# shellcheck disable=SC2086 # a list of options
	set -- $options
	if [ "$source" = rootfs ]; then
		# Never written: no journal, no room kept back.
		set -- "$@" -O ^has_journal -m 0 -d "$work/tar/rootfs.tar"
	fi
	mke2fs -q -t ext4 -L "$label" -U "$uuid" -E "hash_seed=$uuid,lazy_itable_init=0" "$@" "$part"
}

type_of()
{
	case $table/$fstype in
	# "Basic data": a PC with any system shows it, and systemd does not take it for its own.
	gpt/vfat) echo EBD0A0A2-B9E5-4433-87C0-68B6B72699C7 ;;
	gpt/*) echo 0FC63DAF-8483-4772-8E79-3D69D8477DE4 ;;
	msdos/vfat) echo c ;;
	*) echo 83 ;;
	esac
}

place()
{
	size=$(((bytes + align - 1) / align * align))
	printf 'start=%d, size=%d, type=%s' $((offset / 512)) $((size / 512)) "$(type_of)" >> "$disk/table"
	if [ "$table" = gpt ]; then
		printf ', name="%s", uuid=%s' "$label" "$uuid" >> "$disk/table"
	elif [ "$source" = bootimg-partition ]; then
		printf ', bootable' >> "$disk/table"
	fi
	echo >> "$disk/table"
}

while read -r word a b c d e options; do
	case $word in
	disk)
		image=$out/$a.img
		table=$b
		identity=$c
		case $table/$c in
		gpt/* | msdos/0x*) ;;
		msdos/*) identity=0x$(volume_id "$c") ;;
		esac
		rm -f "$image"
		printf 'label: %s\nlabel-id: %s\n' \
			"$(echo "$table" | sed 's/msdos/dos/')" "$identity" > "$disk/table"
		offset=$align
		;;
	part)
		source=$a fstype=$b label=$c bytes=$d uuid=$e
		part=$disk/$label.part
		truncate -s "$bytes" "$part"
		case $fstype in
		vfat) make_vfat ;;
		ext4) make_ext4 ;;
		esac
		dd if="$part" of="$image" bs=$align seek=$((offset / align)) conv=sparse,notrunc status=none
		rm "$part"
		place
		offset=$((offset + size))
		;;
	esac
done < "$disk/plan"

# One aligned block more: the second copy of a GPT is at the end.
truncate -s $((offset + align)) "$image"
sfdisk --quiet "$image" < "$disk/table"
bmaptool --quiet create -o "${image%.img}.bmap" "$image"
zstd --quiet --force -3 -T0 -o "$image.zst" "$image"
