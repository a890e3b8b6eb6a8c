#!/bin/sh
# SPDX-License-Identifier: MIT
# The machine ecdaq-qemuarm64, in a folder with disk.img and u-boot.bin:
# virt.sh FOLDER host|guest [QEMU-OPTION...]
#
# host:  its clock is the host's; both processors run at once. Function, not timing.
# guest: its clock counts instructions, one a nanosecond, and is independent of the host's load: a
#        cycle of 1 ms holds. QEMU then runs one processor at a time and hands over when
#        1/N of the time to the next timer is spent, N being the number of processors. With two, one
#        waits up to half a cycle for the other. So N is 16, of which Linux uses two (nr_cpus=2; the
#        others are never started), and the turns are short.
# A reset ends QEMU (-no-reboot).
# The kernel comes from the disk. ECDAQ_APPEND adds words to its command line, by the file of the boot partition
# that is for this. With ECDAQ_WRITE_LOG, the name of an empty file
# in the folder, every write and flush of the disk is logged to it (QEMU's blklogwrites).
set -eu

[ $# -ge 2 ] || {
	echo 'usage: app/tools/image/virt.sh FOLDER host|guest [QEMU-OPTION...]' >&2
	exit 2
}
here=$(CDPATH='' cd -- "$(dirname -- "$0")" && pwd)
folder=$1
append=${ECDAQ_APPEND:-}
case $2 in
host) timing='-smp 2 -accel tcg,thread=multi' ;;
guest)
	timing='-smp 16 -accel tcg,thread=single -icount shift=0,sleep=off'
	append="$append nr_cpus=2"
	;;
*)
	echo "virt.sh: '$2' is neither host nor guest" >&2
	exit 2
	;;
esac
shift 2
printf 'append=%s\n' "$append" > "$folder/kernel.env"
"$here/qemu.sh" "$folder" mcopy -o -i disk.img@@4M kernel.env ::ecdaq/
disk=file=disk.img,format=raw
if [ -n "${ECDAQ_WRITE_LOG:-}" ]; then
	disk=driver=blklogwrites,file.driver=file,file.filename=disk.img
	# A flush orders the log; the host's own power is not part of the test.
	disk=$disk,log.driver=file,log.filename=$ECDAQ_WRITE_LOG,log.cache.no-flush=on
fi
# shellcheck disable=SC2086 # a list of options
exec "$here/qemu.sh" "$folder" qemu-system-aarch64 -M virt,gic-version=3 -cpu cortex-a72 -m 1024 $timing \
	-no-reboot -bios u-boot.bin \
	-drive "$disk,if=none,id=disk" -device virtio-blk-pci,drive=disk,num-queues=1 \
	-device virtio-rng-pci "$@"
