# SPDX-License-Identifier: MIT
SUMMARY = "EtherCAT measurement appliance: master, recorder, tools and simulated segment"
DESCRIPTION = "${SUMMARY}"
SECTION = "net"
LICENSE = "MIT AND GPL-2.0-only WITH SOEM-exception"
LIC_FILES_CHKSUM = "file://LICENSE;md5=d93e890ea955514b83819d5724828071"

DEPENDS = "soem"

SRC_URI = "file://app;subdir=${P} \
           file://LICENSE;subdir=${P} \
           file://LICENSES;subdir=${P} \
           file://debian;subdir=${P}"
FILESEXTRAPATHS:prepend := "${ECDAQ_TOP}:"
S = "${WORKDIR}/${P}"

inherit dpkg

# SOEM comes from its own package, never from what a developer has unpacked in the tree.
do_prepare_build() {
	rm -rf "${S}/app/third_party/soem"
	deb_add_changelog
}
