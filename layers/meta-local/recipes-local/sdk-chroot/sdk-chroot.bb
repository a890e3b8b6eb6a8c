# SPDX-License-Identifier: MIT
SUMMARY = "Cross-build chroot: amd64 with the arm64 compiler and libraries, and the image tools"
DESCRIPTION = "Debian of the image's own suite, so that programs link what the image has."
SECTION = "devel"
LICENSE = "MIT"

inherit sdk-run

# What recipes build with.
SDK_PREINSTALL = "crossbuild-essential-${DISTRO_ARCH} ccache cmake debhelper dpkg-dev fakeroot \
                  ninja-build patch pkgconf python3 xz-utils zstd"
# What the kernel builds with.
SDK_PREINSTALL += "bc bison cpio flex kmod libelf-dev libssl-dev rsync"
# What images are made with.
SDK_PREINSTALL += "bmap-tools dosfstools e2fsprogs fdisk mtools"
# What bundles of updates are made and signed with.
SDK_PREINSTALL += "openssl rauc squashfs-tools"
# What images are booted with.
SDK_PREINSTALL += "qemu-system-arm"
# What our programs link; each is a Build-Depends of a recipe, too.
SDK_PREINSTALL += "libyaml-dev:${DISTRO_ARCH} libzstd-dev:${DISTRO_ARCH} libdeflate-dev:${DISTRO_ARCH} \
                   libexpat1-dev:${DISTRO_ARCH} libgpiod-dev:${DISTRO_ARCH} libssl-dev:${DISTRO_ARCH} \
                   libcjson-dev:${DISTRO_ARCH} libcurl4-openssl-dev:${DISTRO_ARCH} libnats-dev:${DISTRO_ARCH} libwebsockets-dev:${DISTRO_ARCH} \
                   cyclonedds-dev:${DISTRO_ARCH} cyclonedds-tools"

do_bootstrap[dirs] = "${TMPDIR}"
do_bootstrap[network] = "1"
# The kernel's source is fetched by this chroot's apt, and so depends on the state of the archive, too.
do_bootstrap[vardeps] += "${@archive_vardeps(d)}"
# How the mirror is found does not change what it gives.
do_bootstrap[vardepsexclude] += "apt_sources"
python do_bootstrap() {
    import shutil
    sdk = d.getVar("SDK_DIR")
    shutil.rmtree(sdk, ignore_errors=True)
    os.makedirs(os.path.dirname(sdk), exist_ok=True)
    suite = d.getVar("BASE_DISTRO_CODENAME")
    sources = apt_sources(d, suite, "main")
    sources += ["deb-src" + line.removeprefix("deb") for line in sources]
    include = ",".join(d.getVar("SDK_PREINSTALL").split())
    bb.process.run(
        ["mmdebstrap", "--variant=buildd", "--architectures=amd64," + d.getVar("DISTRO_ARCH"),
         "--include=" + include, "--aptopt=APT::Install-Recommends \"false\"",
         "--aptopt=Acquire::Retries \"3\"", "--skip=cleanup/apt/lists", suite, sdk, *sources],
        log=open(d.getVar("BB_LOGFILE"), "a"))
}
addtask bootstrap before do_build

# The state of the archive as it is now becomes that of the cache. Only the Release files are fetched.
do_refresh[cleandirs] = "${WORKDIR}/archive"
do_refresh[network] = "1"
do_refresh[nostamp] = "1"
python do_refresh() {
    import glob
    import sys
    sys.path.insert(0, os.path.join(d.getVar("LAYERDIR_core"), "lib"))
    import archive
    folder = os.path.join(d.getVar("WORKDIR"), "archive")
    sources = apt_sources(d, d.getVar("BASE_DISTRO_CODENAME"), "main")
    said = apt_run(folder, sources,
                   {"Acquire::IndexTargets::deb::Packages::DefaultEnabled": "false"}, "update")
    found = glob.glob(folder + "/lists/*Release")
    # apt ends with success when a suite is missing.
    if len(found) != len(sources):
        bb.fatal(f"{len(found)} of {len(sources)} suites could be read:\n{said}")
    releases = []
    for path in found:
        with open(path) as file:
            releases.append(file.read())
    target = os.path.join(d.getVar("TMPDIR"), "archive.conf")
    with open(target + ".new", "w") as file:
        file.write(archive.configuration(releases))
    os.rename(target + ".new", target)
}
addtask refresh
