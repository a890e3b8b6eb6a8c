# SPDX-License-Identifier: MIT
SUMMARY = "A simulated EtherCAT segment inside the machine, on port ecat0"
DESCRIPTION = "${SUMMARY}"
SECTION = "net"
LICENSE = "MIT"
LIC_FILES_CHKSUM = "file://${WORKDIR}/LICENSE;md5=d93e890ea955514b83819d5724828071"

SRC_URI = "file://ecdaq-segment.service \
           file://10-ecdaq-segment.netdev \
           file://10-ecdaq-outside.link \
           file://LICENSE"
FILESEXTRAPATHS:prepend := "${ECDAQ_TOP}:"

inherit dpkg-raw

DEBIAN_SECTION = "net"
DEBIAN_DEPENDS = "ecdaq, ecdaq-config, systemd"

do_install() {
	install -d "${D}/usr/lib/systemd/system" "${D}/usr/lib/systemd/network" \
		"${D}/usr/share/doc/ecdaq-segment"
	install -m 644 "${WORKDIR}/ecdaq-segment.service" "${D}/usr/lib/systemd/system/"
	install -m 644 "${WORKDIR}/10-ecdaq-outside.link" "${D}/usr/lib/systemd/network/"
	install -m 644 "${WORKDIR}/10-ecdaq-segment.netdev" "${D}/usr/lib/systemd/network/"
	install -m 644 "${WORKDIR}/LICENSE" "${D}/usr/share/doc/ecdaq-segment/copyright"
}
