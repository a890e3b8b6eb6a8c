# SPDX-License-Identifier: MIT
# A recipe that makes Debian packages, in the order of Isar's tasks:
# fetch, unpack, patch, transform_template, prepare_build, dpkg_build, deploy_deb.

inherit sdk-run

CHANGELOG_V ??= "${PV}"
DPKG_ARCH ??= "any"
DEBIAN_BUILD_DEPENDS ??= ""
DEBIAN_DEPENDS ??= ""
DEBIAN_SECTION ??= "misc"
DEBIAN_MULTI_ARCH ??= "no"
DEBIAN_COMPAT ??= "13"
DEBIAN_STANDARDS_VERSION ??= "4.7.2"
DESCRIPTION ??= "${SUMMARY}"
TEMPLATE_FILES ??= ""
TEMPLATE_VARS ??= "PN BPN PV CHANGELOG_V DPKG_ARCH DEBIAN_BUILD_DEPENDS DEBIAN_DEPENDS DEBIAN_SECTION \
                   DEBIAN_COMPAT DESCRIPTION MAINTAINER DISTRO_ARCH"

# Debian source packages: apt://NAME or apt://NAME=VERSION.
def apt_source(d):
    for uri in (d.getVar("SRC_URI") or "").split():
        if uri.startswith("apt://"):
            return uri.removeprefix("apt://").split(";")[0]
    return ""

APT_SOURCE = "${@apt_source(d)}"
do_fetch[depends] += "${@'sdk-chroot:do_bootstrap' if apt_source(d) else ''}"
do_fetch[postfuncs] += "${@'fetch_apt_source' if apt_source(d) else ''}"
do_unpack[postfuncs] += "${@'unpack_apt_source' if apt_source(d) else ''}"
do_fetch[vardeps] += "SRC_URI fetch_apt_source download"
do_unpack[vardeps] += "unpack_apt_source"

# download SOURCE...: the first of them that the mirror gives.
download() {
	for source in "$@"; do
		rm -rf "${WORKDIR}/apt-source"
		mkdir -p "${WORKDIR}/apt-source"
		if sdk_run sh -euc 'cd "$1" && apt-get -q -o APT::Sandbox::User=root --download-only --only-source source "$2"' \
			fetch "${PP}/apt-source" "$source"; then
			return 0
		fi
		# Some mirrors list sources, of the security suite and others, and do not hold them.
		bbwarn "the mirror does not give the source of $source"
	done
	return 1
}

fetch_apt_source() {
	sdk_run -w apt-get -q update
	if download "${APT_SOURCE}" "${APT_SOURCE}/${BASE_DISTRO_CODENAME}"; then
		return 0
	fi
	# Where nothing but the .dsc is missing: the signed index states the same.
	if sdk_run sh -euc '
		cd "$1"
		apt-cache showsrc --only-source "$2" |
			sed -e "/^\$/q" -e "s/^Package: /Source: /" -e "/ [^ ]*\.dsc\$/d" > "$2.dsc"
		sed -n "/^Checksums-Sha256:/,/^[^ ]/s/^ \([0-9a-f]\{64\}\) [0-9]* /\1  /p" "$2.dsc" > sums
		sha256sum --check sums' index "${PP}/apt-source" "${@apt_source(d).partition('=')[0]}"; then
		return 0
	fi
	# The newest of the older versions that the mirror lists and holds, where none is asked for by its number.
	case "${APT_SOURCE}" in
	*=*) bbfatal "no source of ${APT_SOURCE}" ;;
	esac
	sdk_run apt-cache showsrc --only-source "${APT_SOURCE}" | sed -n 's/^Version: /${APT_SOURCE}=/p' | sort -Vru \
		> "${WORKDIR}/versions"
	download $(cat "${WORKDIR}/versions") || bbfatal "no source of ${APT_SOURCE}"
}

unpack_apt_source() {
	rm -rf "${S}"
	sdk_run sh -euc 'dpkg-source --extract "$1"/apt-source/*.dsc "$1/$2"' \
		unpack "${PP}" "${@os.path.relpath(d.getVar('S'), d.getVar('WORKDIR'))}"
}

# *.patch in SRC_URI, in order, with -p1.
addtask patch after do_unpack
do_patch() {
	for name in ${@' '.join(os.path.basename(u.split(';')[0]) for u in d.getVar('SRC_URI').split() if u.split(';')[0].endswith('.patch'))}; do
		patch -p1 -d "${S}" < "${WORKDIR}/$name"
	done
}

# NAME.tmpl of TEMPLATE_FILES becomes NAME, ${VARIABLE} replaced for each of TEMPLATE_VARS.
addtask transform_template after do_unpack
do_transform_template[vardeps] += "TEMPLATE_FILES TEMPLATE_VARS ${TEMPLATE_VARS}"
python do_transform_template() {
    workdir = d.getVar("WORKDIR")
    for name in d.getVar("TEMPLATE_FILES").split():
        with open(os.path.join(workdir, name)) as template:
            text = template.read()
        for var in d.getVar("TEMPLATE_VARS").split():
            text = text.replace("${" + var + "}", d.getVar(var) or "")
        target = os.path.join(workdir, name.removesuffix(".tmpl"))
        with open(target, "w") as out:
            out.write(text)
        os.chmod(target, os.stat(os.path.join(workdir, name)).st_mode)
}

def deb_list(d, name):
    return ", ".join(part.strip() for part in (d.getVar(name) or "").split(",") if part.strip())

# Packaging for a source that brings none: Isar's deb_debianize.
deb_debianize[vardeps] += "DEBIAN_BUILD_DEPENDS DEBIAN_DEPENDS"
deb_debianize() {
	install -d "${S}/debian"
	cat > "${S}/debian/control" <<CONTROL
Source: ${BPN}
Section: ${DEBIAN_SECTION}
Priority: optional
Standards-Version: ${DEBIAN_STANDARDS_VERSION}
Maintainer: ${MAINTAINER}
Build-Depends: debhelper-compat (= ${DEBIAN_COMPAT})${@', ' + deb_list(d, 'DEBIAN_BUILD_DEPENDS') if deb_list(d, 'DEBIAN_BUILD_DEPENDS') else ''}

Package: ${BPN}
Architecture: ${DPKG_ARCH}
Multi-Arch: ${DEBIAN_MULTI_ARCH}
${@'Depends: ' + deb_list(d, 'DEBIAN_DEPENDS') if deb_list(d, 'DEBIAN_DEPENDS') else 'Section: ' + d.getVar('DEBIAN_SECTION')}
Description: ${DESCRIPTION}
CONTROL
	if [ -f "${WORKDIR}/rules" ]; then
		install -m 755 "${WORKDIR}/rules" "${S}/debian/rules"
	else
		printf '#!/usr/bin/make -f\n\n%%:\n\tdh $@\n' > "${S}/debian/rules"
		chmod 755 "${S}/debian/rules"
	fi
	deb_add_changelog
	for hook in preinst postinst prerm postrm; do
		if [ -f "${WORKDIR}/$hook" ]; then
			install -m 755 "${WORKDIR}/$hook" "${S}/debian/$hook"
		fi
	done
}

deb_add_changelog() {
	printf '%s (%s) UNRELEASED; urgency=low\n\n  * Built from the recipe.\n\n -- %s  %s\n' \
		"${BPN}" "${CHANGELOG_V}" "${MAINTAINER}" "$(date -R -u -d "@$SOURCE_DATE_EPOCH")" \
		> "${S}/debian/changelog"
}

addtask prepare_build after do_patch do_transform_template
do_prepare_build() {
	:
}

addtask dpkg_build after do_prepare_build
do_dpkg_build[depends] += "sdk-chroot:do_bootstrap"
do_dpkg_build[deptask] = "do_deploy_deb"
do_dpkg_build[cleandirs] = "${DEB_RESULT_DIR}"
do_dpkg_build[keep] = "${DEB_RESULT_DIR}"
# DEPENDS are installed from what other recipes deployed, into this call's overlay only.
do_dpkg_build() {
	for name in ${DEPENDS}; do
		install -D -t "${WORKDIR}/build-depends" "${REPO_DIR}/$name"/*.deb
	done
	sdk_run sh -euc '
		pp=$1 source=$2 arch=$3
		cd "$pp"
		if [ -d build-depends ]; then
			dpkg --install build-depends/*.deb
		fi
		cd "$source"
		export DEB_BUILD_OPTIONS="parallel=$(nproc) nocheck noautodbgsym" DEB_BUILD_PROFILES="cross nocheck"
		export PATH=/usr/lib/ccache:$PATH
		dpkg-buildpackage --build=binary --unsigned-changes --no-pre-clean --host-arch="$arch"
		mv ../*.deb ../debs/
		' build "${PP}" "${@os.path.relpath(d.getVar('S'), d.getVar('WORKDIR'))}" "${PACKAGE_ARCH}"
	rm -rf "${WORKDIR}/build-depends"
}

addtask deploy_deb after do_dpkg_build before do_build
do_deploy_deb[cleandirs] = "${REPO_DIR}/${PN}"
do_deploy_deb() {
	cp "${DEB_RESULT_DIR}"/*.deb "${REPO_DIR}/${PN}/"
}
