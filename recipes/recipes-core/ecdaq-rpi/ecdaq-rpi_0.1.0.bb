# SPDX-License-Identifier: MIT
SUMMARY = "What a Raspberry Pi 4 or Compute Module 4 needs beside the common setup"
DESCRIPTION = "${SUMMARY}"
SECTION = "admin"
LICENSE = "MIT"
LIC_FILES_CHKSUM = "file://${WORKDIR}/LICENSE;md5=d93e890ea955514b83819d5724828071"

SRC_URI = "file://config.txt \
           file://LICENSE"
FILESEXTRAPATHS:prepend := "${ECDAQ_TOP}:"

inherit dpkg-raw

DEBIAN_SECTION = "admin"
DEBIAN_DEPENDS = "ecdaq-config"

do_install() {
	install -d "${D}/usr/share/ecdaq-rpi" "${D}/usr/share/doc/ecdaq-rpi"
	install -m 644 "${WORKDIR}/config.txt" "${D}/usr/share/ecdaq-rpi/"
	install -m 644 "${WORKDIR}/LICENSE" "${D}/usr/share/doc/ecdaq-rpi/copyright"
}
