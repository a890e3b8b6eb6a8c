# SPDX-License-Identifier: MIT
SUMMARY = "Linux with PREEMPT_RT for an EtherCAT measurement appliance"
DESCRIPTION = "Linux ${PV} of Debian, PREEMPT_RT, configured from the fragments in kernel-config"
HOMEPAGE = "https://www.kernel.org/"
SECTION = "kernel"
LICENSE = "GPL-2.0-only WITH Linux-syscall-note"
LIC_FILES_CHKSUM = "file://COPYING;md5=6bc538ed5bd9a7fc9398086aedcd7e46"

# Debian's source package, the newest of the suite when it is fetched: with an empty cache, or after
# ./build.sh image --refresh when the archive has changed.
SRC_URI = "apt://linux \
           file://0001-sysfs-say-that-the-kernel-is-real-time.patch \
           file://base.cfg \
           file://rt.cfg \
           file://systemd.cfg \
           file://net.cfg \
           file://storage.cfg \
           file://gpio.cfg \
           file://watchdog.cfg \
           file://qemuarm64.cfg \
           file://raspberrypi4-64.cfg"
FILESEXTRAPATHS:prepend := "${ECDAQ_TOP}/kernel-config:${ECDAQ_TOP}/kernel-config/optional:"
# One kernel for all machines: what the emulator tests is what a board runs.
S = "${WORKDIR}/linux"
# Not quilt, Isar's default: in a source that Debian's own patches are applied to it takes those away, and
# applies the first of them instead of ours.
PATCHTOOL = "patch"

inherit linux-kernel

KERNEL_NAME_PROVIDED = "ecdaq"
# "make defconfig KBUILD_DEFCONFIG=defconfig allnoconfig": everything off, then the fragments.
KERNEL_DEFCONFIG = "defconfig allnoconfig"
# Isar's default needs an initramfs generator, too; none of our machines has an initial RAM disk.
KERNEL_DEBIAN_DEPENDS = "kmod, linux-base (>= 4.3~)"

# ECDAQ_WIFI = "1" (local.conf, or the environment of ./build.sh image): one more fragment, and not the line of
# net.cfg that turns Wi-Fi off. The other images' kernel is the same with and without this function.
python () {
    if d.getVar("ECDAQ_WIFI") == "1":
        d.appendVar("SRC_URI", " file://wifi.cfg")
        d.appendVarFlag("do_unpack", "postfuncs", " allow_wifi")
}
allow_wifi() {
	sed -i '/^CONFIG_WLAN=n$/d' "${WORKDIR}/net.cfg"
}
