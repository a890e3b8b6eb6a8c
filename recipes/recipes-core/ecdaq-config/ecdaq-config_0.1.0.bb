# SPDX-License-Identifier: MIT
SUMMARY = "How an ecdaq machine is set up: services, users, network, first boot"
DESCRIPTION = "${SUMMARY}"
SECTION = "admin"
LICENSE = "MIT"
LIC_FILES_CHKSUM = "file://${WORKDIR}/LICENSE;md5=d93e890ea955514b83819d5724828071"

SRC_URI = "file://root \
           file://postinst \
           file://LICENSE"
FILESEXTRAPATHS:prepend := "${ECDAQ_TOP}:"

inherit dpkg-raw

DEBIAN_SECTION = "admin"
DEBIAN_DEPENDS = "chrony, curl, e2fsprogs, ecdaq, ethtool, fdisk, iproute2, libubootenv-tool, linuxptp, nftables, \
                  openssh-server, procps, rauc, rauc-service, sudo, systemd, systemd-journal-remote, udev, util-linux"

# What was renamed or taken away since the last time does not stay in the folder.
do_unpack[cleandirs] += "${WORKDIR}/root"

# files/root is the root file system's tree as it is on the target.
do_install() {
	cp -r "${WORKDIR}/root/." "${D}/"
	install -d "${D}/data" "${D}/boot" "${D}/usr/share/doc/ecdaq-config"
	install -m 644 "${WORKDIR}/LICENSE" "${D}/usr/share/doc/ecdaq-config/copyright"
	chmod 755 "${D}"/usr/lib/ecdaq/* "${D}/usr/bin/ecdaq-update"
	chmod 440 "${D}/etc/sudoers.d/operator"
}
