# SPDX-License-Identifier: MIT
# A package of files: do_install copies them to ${D} with their paths on the target.
inherit dpkg

D = "${S}/image"
DPKG_ARCH = "all"
DEBIAN_MULTI_ARCH = "foreign"

addtask install after do_patch do_transform_template before do_prepare_build
do_install[cleandirs] = "${D}"
do_install() {
	:
}

do_prepare_build[cleandirs] = "${S}/debian"
do_prepare_build() {
	(cd "${D}" && find . -mindepth 1 -maxdepth 1 | sed 's:^\./::' | sort) > "${S}/debian/${PN}.install"
	deb_debianize
	printf '\noverride_dh_install:\n\tdh_install --sourcedir=image\n' >> "${S}/debian/rules"
}
