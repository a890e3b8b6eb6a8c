# SPDX-License-Identifier: MIT
SUMMARY = "SOEM 1.4, the EtherCAT master library, as source"
DESCRIPTION = "Sources of SOEM's 1.4 line with our patches, for programs that bring their own NIC layer"
HOMEPAGE = "https://github.com/OpenEtherCATsociety/SOEM"
SECTION = "libs"
LICENSE = "GPL-2.0-only WITH SOEM-exception"
LIC_FILES_CHKSUM = "file://${WORKDIR}/SOEM.txt;md5=9e0f3a6879e76ac16053729f3b05a2d4"

# The pin is that of app/third_party/soem.lock; tests/recipes holds the two against each other.
PYPI_PACKAGE = "pysoem"
PYPI_VERSION = "1.1.13"
PYPI_SHA256 = "4be98d8531e492f2ee5d21f6ef51e51493a10ee1322ed22e909c91a8bcfff950"
SRC_URI = "file://0004-config-bound-fmmus.patch \
           file://0005-config-map-what-is-known.patch \
           file://SOEM.txt"
FILESEXTRAPATHS:prepend := "${ECDAQ_TOP}/app/third_party/patches:${ECDAQ_TOP}/LICENSES:"
S = "${WORKDIR}/soem"

inherit pypi dpkg-raw

DEBIAN_SECTION = "libs"

# Only what is built: SOEM's own C files and its osal interface, with Unix line ends for the patches.
do_unpack[postfuncs] += "soem_layout"
soem_layout() {
	install -d "${S}/.new/soem" "${S}/.new/osal"
	for source in "${S}"/soem/soem/*.[ch] "${S}/soem/osal/osal.h"; do
		tr -d '\r' < "$source" > "${S}/.new/${source#"${S}"/soem/}"
	done
	find "${S}" -mindepth 1 -maxdepth 1 ! -name .new -exec rm -rf {} +
	mv "${S}/.new/soem" "${S}/.new/osal" "${S}/"
	rmdir "${S}/.new"
}

do_install() {
	install -d "${D}/usr/src/soem" "${D}/usr/share/doc/soem"
	cp -r "${S}/soem" "${S}/osal" "${D}/usr/src/soem/"
	install -m 644 "${WORKDIR}/SOEM.txt" "${D}/usr/share/doc/soem/copyright"
}
