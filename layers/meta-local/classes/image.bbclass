# SPDX-License-Identifier: MIT
# A root file system of IMAGE_PREINSTALL (Debian's) and IMAGE_INSTALL (recipes'), and a disk made of
# it as WKS_FILE describes. Variables as in Isar; the work is done by mmdebstrap and meta-local/lib.
inherit sdk-run

# An image is of one machine; everything else is shared by machines.
WORKDIR = "${TMPDIR}/work/${DISTRO}-${DISTRO_ARCH}/${PN}-${MACHINE}"
STAMP = "${STAMPS_DIR}/${PN}-${MACHINE}"
IMAGE_FULLNAME = "${PN}-${DISTRO}-${MACHINE}"
IMAGE_ROOTFS = "${WORKDIR}/rootfs"
KERNEL_IMAGE ?= "${IMAGE_FULLNAME}-vmlinux"
KERNEL_IMAGE_PKG ??= "${@'linux-image-' + d.getVar('KERNEL_NAME') if d.getVar('KERNEL_NAME') else ''}"
IMAGE_INSTALL += "${KERNEL_IMAGE_PKG}"
IMAGE_BOOT_FILES ??= ""
DEPLOYDIR = "${WORKDIR}/out"
# Functions of the recipe that have the last word on the root file system.
ROOTFS_POSTPROCESS_COMMAND ?= ""
IMAGE_COMPONENTS ??= "main"
DTB_FILES ??= ""
# What needs no room on an appliance. Licence texts stay.
ROOTFS_EXCLUDE ??= "/usr/share/man/* /usr/share/locale/* /usr/share/info/* /usr/share/lintian/* \
                    /usr/share/bash-completion/* /usr/share/zsh/* /usr/share/bug/* /usr/share/doc/*"
ROOTFS_INCLUDE ??= "/usr/share/doc/*/copyright"

def image_recipes(d):
    """The recipes whose packages IMAGE_INSTALL names."""
    kernel = d.getVar("KERNEL_IMAGE_PKG")
    names = [n for n in d.getVar("IMAGE_INSTALL").split() if n != kernel]
    if kernel:
        names.append("linux-" + d.getVar("KERNEL_NAME"))
    return names

# First Debian's part, which changes rarely and takes minutes (maintainer scripts run emulated): what all machines
# have is made once, for the first of them. Then the packages of one machine and ours, on top of it, in seconds.
ROOTFS_BASE_PACKAGES = "${@' '.join(n for n in d.getVar('IMAGE_PREINSTALL').split() \
                              if n not in d.getVar('MACHINE_PREINSTALL').split())}"
ROOTFS_BASE_PACKAGES[vardepvalue] = "${ROOTFS_BASE_PACKAGES}"
do_rootfs_base[cleandirs] = "${WORKDIR}/base"
do_rootfs_base[network] = "1"
do_rootfs_base[vardeps] += "${@archive_vardeps(d)}"
do_rootfs_base[vardepsexclude] += "apt_sources archive_vardeps"
do_rootfs_base[keep] = "${WORKDIR}/base"
python do_rootfs_base() {
    suite = d.getVar("BASE_DISTRO_CODENAME")
    options = ["--dpkgopt=path-exclude=" + p for p in d.getVar("ROOTFS_EXCLUDE").split()]
    options += ["--dpkgopt=path-include=" + p for p in d.getVar("ROOTFS_INCLUDE").split()]
    bb.process.run(
        ["mmdebstrap", "--mode=root", "--variant=essential", "--format=tar",
         "--architectures=" + d.getVar("DISTRO_ARCH"),
         "--include=" + ",".join(d.getVar("ROOTFS_BASE_PACKAGES").split()), *options,
         # Host keys made here would be deleted, and take a minute under emulation.
         "--essential-hook=mkdir -p $1/etc/ssh && cd $1/etc/ssh && "
         "touch ssh_host_rsa_key ssh_host_ecdsa_key ssh_host_ed25519_key",
         "--aptopt=APT::Install-Recommends \"false\"", "--aptopt=Acquire::Retries \"3\"",
         suite, os.path.join(d.getVar("WORKDIR"), "base", "base.tar"), *apt_sources(d, suite, "main")],
        log=open(d.getVar("BB_LOGFILE"), "a"))
}
addtask rootfs_base

# MACHINE_PREINSTALL, and of what it depends on what the base does not have: fetched only.
do_rootfs_machine[cleandirs] = "${WORKDIR}/apt ${WORKDIR}/machine"
do_rootfs_machine[network] = "1"
do_rootfs_machine[vardepsexclude] += "apt_run apt_sources"
do_rootfs_machine[keep] = "${WORKDIR}/machine"
python do_rootfs_machine() {
    import shutil
    names = d.getVar("MACHINE_PREINSTALL").split()
    if not names:
        return
    folder = os.path.join(d.getVar("WORKDIR"), "apt")
    machine = os.path.join(d.getVar("WORKDIR"), "machine")
    arch = d.getVar("DISTRO_ARCH")
    status, _ = bb.process.run(["tar", "-xOf", os.path.join(d.getVar("WORKDIR"), "base", "base.tar"),
                                "./var/lib/dpkg/status"])
    with open(os.path.join(folder, "status"), "w") as file:
        file.write(status)
    sources = apt_sources(d, d.getVar("BASE_DISTRO_CODENAME"), d.getVar("IMAGE_COMPONENTS"))
    settings = {"Dir::State::status": folder + "/status", "Dir::Cache::archives": machine + "/",
                "APT::Architecture": arch, "APT::Architectures": arch}
    apt_run(folder, sources, settings, "update")
    apt_run(folder, sources, settings, "install", "--download-only", "--no-install-recommends", "--yes", *names)
    shutil.rmtree(os.path.join(machine, "partial"))
    os.remove(os.path.join(machine, "lock"))
}
addtask rootfs_machine after do_rootfs_base

do_rootfs[depends] += "${@' '.join(n + ':do_deploy_deb' for n in image_recipes(d))}"
do_rootfs[vardeps] += "IMAGE_INSTALL"
do_rootfs[file-checksums] += "${LAYERDIR_core}/lib/clean-rootfs.sh:True"
do_rootfs[cleandirs] = "${WORKDIR}/tar ${IMAGE_ROOTFS}"
do_rootfs[keep] = "${WORKDIR}/tar"
do_rootfs() {
	tar -xpf "${WORKDIR}/base/base.tar" --numeric-owner --xattrs --xattrs-include='*' -C "${IMAGE_ROOTFS}"
	mkdir "${IMAGE_ROOTFS}/tmp/debs"
	find "${WORKDIR}/machine" -name "*.deb" -exec cp -t "${IMAGE_ROOTFS}/tmp/debs" {} +
	for name in ${@' '.join(image_recipes(d))}; do
		for package in ${IMAGE_INSTALL}; do
			for deb in "${REPO_DIR}/$name/$package"_*.deb; do
				[ ! -e "$deb" ] || cp "$deb" "${IMAGE_ROOTFS}/tmp/debs/"
			done
		done
	done
	unshare --mount --pid --fork --kill-child --propagation private sh -euc '
		mount -t proc proc "$1/proc"
		mount --bind /dev "$1/dev"
		exec chroot "$1" sh -euc "dpkg --install /tmp/debs/*.deb"' rootfs "${IMAGE_ROOTFS}"
	rm -rf "${IMAGE_ROOTFS}/tmp/debs"
	${@'\n\t'.join(d.getVar('ROOTFS_POSTPROCESS_COMMAND').split())}
	sh "${LAYERDIR_core}/lib/clean-rootfs.sh" "${IMAGE_ROOTFS}"
	tar -cf "${WORKDIR}/tar/rootfs.tar" --sort=name --numeric-owner --xattrs --xattrs-include='*' \
		--format=posix --pax-option=exthdr.name=%d/PaxHeaders/%f,delete=atime,delete=ctime \
		--mtime="@$SOURCE_DATE_EPOCH" --clamp-mtime -C "${IMAGE_ROOTFS}" .
}
addtask rootfs after do_rootfs_machine

addtask image after do_rootfs before do_build
do_image[depends] += "sdk-chroot:do_bootstrap"
do_image[file-checksums] += "${LAYERDIR_core}/lib/image.py:True ${LAYERDIR_core}/lib/wks.py:True \
                             ${LAYERDIR_core}/lib/sbom.py:True ${LAYERDIR_core}/lib/make-disk.sh:True \
                             ${@wks_path(d)}:True"
do_image[cleandirs] = "${WORKDIR}/disk ${IMAGE_ROOTFS}"
do_image[keep] = "${DEPLOYDIR}"
do_image[vardeps] += "IMAGE_BOOT_FILES WKS_FILE do_copy_boot_files"

def wks_path(d):
    name = d.getVar("WKS_FILE")
    for folder in d.getVar("BBPATH").split(":"):
        path = os.path.join(folder, "wic", name)
        if os.path.exists(path):
            return path
    bb.fatal(f"{d.getVar('PN')}: WKS_FILE {name} is in no layer's wic/ folder")

python do_image() {
    import sys
    sys.path.insert(0, os.path.join(d.getVar("LAYERDIR_core"), "lib"))
    import image
    bb.build.exec_func("unpack_rootfs", d)
    bb.build.exec_func("do_copy_boot_files", d)
    image.prepare(image.Inputs(
        work=d.getVar("WORKDIR"), rootfs=d.getVar("IMAGE_ROOTFS"), wks=wks_path(d),
        name=d.getVar("IMAGE_FULLNAME"), boot_files=d.getVar("IMAGE_BOOT_FILES").split(),
        version=d.getVar("DISTRO_VERSION"), epoch=int(d.getVar("SOURCE_DATE_EPOCH"))))
    bb.build.exec_func("make_disk", d)
    image.finish(d.getVar("WORKDIR"), d.getVar("IMAGE_FULLNAME"))
}

unpack_rootfs() {
	tar -xpf "${WORKDIR}/tar/rootfs.tar" --numeric-owner --xattrs --xattrs-include='*' -C "${IMAGE_ROOTFS}"
}

# Kernel and device trees are beside the image.
do_copy_boot_files[cleandirs] = "${DEPLOYDIR}"
do_copy_boot_files() {
	cp "${IMAGE_ROOTFS}/boot/vmlinux" "${DEPLOYDIR}/${KERNEL_IMAGE}"
	for file in ${DTB_FILES}; do
		dtb=$(find "${IMAGE_ROOTFS}/usr/lib" -path "*/linux-image-*/$file" | head -n 1)
		if [ -z "$dtb" ]; then
			die "DTB_FILES: $file is not in the kernel package"
		fi
		cp "$dtb" "${DEPLOYDIR}/"
	done
}

make_disk() {
	cp "${LAYERDIR_core}/lib/make-disk.sh" "${WORKDIR}/disk/"
	sdk_run sh "${PP}/disk/make-disk.sh" "${PP}"
}

# Copies the newest image of this machine to the deploy folder (reflinks where the file system has them).
addtask deploy after do_image before do_build
do_deploy[nostamp] = "1"
do_deploy() {
	mkdir -p "${DEPLOY_DIR_IMAGE}"
	for file in "${WORKDIR}"/out/*; do
		rm -f "${DEPLOY_DIR_IMAGE}/$(basename "$file")"
		cp --reflink=auto --sparse=always "$file" "${DEPLOY_DIR_IMAGE}/"
	done
}
