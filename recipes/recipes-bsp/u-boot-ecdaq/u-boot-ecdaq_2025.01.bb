# SPDX-License-Identifier: MIT
SUMMARY = "U-Boot of the machines, and the script by which it chooses a slot"
DESCRIPTION = "U-Boot ${PV} of Debian, configured for a boot without operator from one of two slots"
HOMEPAGE = "https://www.u-boot.org/"
SECTION = "admin"
LICENSE = "GPL-2.0-or-later"
LIC_FILES_CHKSUM = "file://Licenses/gpl-2.0.txt;md5=b234ee4d69f5fce4486a80fdaf4a4263"

# Debian's source package; which one, see linux-ecdaq.
SRC_URI = "apt://u-boot \
           file://0001-watchdog-add-i6300esb.patch \
           file://common.cfg \
           file://qemu_arm64.cfg \
           file://qemu_arm64.env \
           file://rpi_arm64.cfg \
           file://rpi_arm64.env \
           file://boot.cmd \
           file://kconfig.py \
           file://rules"
# What was asked for is checked by the program that checks the kernel's configuration.
FILESEXTRAPATHS:prepend := "${ECDAQ_TOP}/layers/meta-local/lib:"
S = "${WORKDIR}/u-boot"
PATCHTOOL = "patch"

inherit dpkg

DEBIAN_SECTION = "admin"
DEBIAN_BUILD_DEPENDS = "bc, bison, flex, python3:any"

# The packaging is ours; Debian's has the licences, and the version that a CVE is looked up by.
do_prepare_build() {
	if [ ! -d "${S}/debian.orig" ]; then
		mv "${S}/debian" "${S}/debian.orig"
	fi
	rm -rf "${S}/debian"
	deb_debianize
	version=$(sed -n '1s/.*(\(.*\)).*/\1/p' "${S}/debian.orig/changelog")
	sed -i "s/^Description:/Built-Using: u-boot (= $version)\nDescription:/" "${S}/debian/control"
	cp "${S}/debian.orig/copyright" "${S}/debian/copyright"
	install -d "${S}/debian/ecdaq"
	for name in common.cfg qemu_arm64.cfg qemu_arm64.env rpi_arm64.cfg rpi_arm64.env boot.cmd kconfig.py; do
		cp "${WORKDIR}/$name" "${S}/debian/ecdaq/"
	done
}
