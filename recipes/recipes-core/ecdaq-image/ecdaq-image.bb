# SPDX-License-Identifier: MIT
SUMMARY = "The appliance: Debian, our kernel, our programs, set up for headless use"
DESCRIPTION = "${SUMMARY}"
SECTION = "images"
LICENSE = "MIT"
LIC_FILES_CHKSUM = "file://${ECDAQ_TOP}/LICENSE;md5=d93e890ea955514b83819d5724828071"

PV = "${DISTRO_VERSION}"

inherit image

# No initial RAM disk: the kernel mounts its root directly.
ROOTFS_FEATURES:remove = "generate-initrd"

# SSH host keys are made at first boot (ecdaq-ssh-key.service); Isar makes no image that has any.
ROOTFS_POSTPROCESS_COMMAND =+ "remove_host_keys"
remove_host_keys() {
	run_privileged find "${IMAGE_ROOTFS}/etc/ssh" -name "ssh_host_*_key*" -delete
}

# The machine can say what it runs: version, commit, and the date of the Debian archive that its packages are
# from, in os-release and for `ecdaq doctor`. An image that is the same at a later commit is not built again, and
# names the one at which it was made.
def ecdaq_commit(d):
    import subprocess
    command = ["git", "-C", d.getVar("ECDAQ_TOP"), "describe", "--always", "--dirty", "--exclude=*"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.stdout.strip() or "unknown"

ECDAQ_COMMIT ?= "${@ecdaq_commit(d)}"
ECDAQ_ARCHIVE_DATE ?= "unknown"
ROOTFS_POSTPROCESS_COMMAND =+ "name_image"
name_image[vardepsexclude] += "ECDAQ_COMMIT"
name_image() {
	printf 'IMAGE_ID=%s\nIMAGE_VERSION=%s\nECDAQ_ARCHIVE_DATE=%s\n' "${PN}-${MACHINE}" \
		"${PV}-${ECDAQ_COMMIT}" "${ECDAQ_ARCHIVE_DATE}" |
		run_privileged tee -a "${IMAGE_ROOTFS}/usr/lib/os-release"
	printf '%s %s, Debian archive: %s\n' "${PN}-${MACHINE}" "${PV}-${ECDAQ_COMMIT}" "${ECDAQ_ARCHIVE_DATE}" |
		run_privileged tee "${IMAGE_ROOTFS}/usr/lib/ecdaq/image"
}

# RAUC's configuration: the slots, the boot state of the boot script, and which bundles are taken. Versions are
# compared by the rules of semver.org, by which -0 is in front of every commit.
# ECDAQ_UPDATE_KEYRING: certificates (PEM) of the keys that sign bundles. Without it no bundle is taken.
ECDAQ_UPDATE_KEYRING ??= ""
ROOTFS_POSTPROCESS_COMMAND =+ "configure_rauc"
configure_rauc[vardepsexclude] += "ECDAQ_UPDATE_KEYRING"
do_rootfs[file-checksums] += "${@d.getVar('ECDAQ_UPDATE_KEYRING') + ':True' if d.getVar('ECDAQ_UPDATE_KEYRING') else ''}"
configure_rauc() {
	run_privileged mkdir -p "${IMAGE_ROOTFS}/usr/lib/rauc"
	cat <<SYSTEM | run_privileged tee "${IMAGE_ROOTFS}/usr/lib/rauc/system.conf"
[system]
compatible=${MACHINE}
bootloader=uboot
boot-attempts=3
boot-attempts-primary=3
bundle-formats=verity
min-bundle-version=${PV}-0
data-directory=/data/rauc
mountprefix=/run/rauc

[keyring]
path=/usr/lib/rauc/keyring.pem
use-bundle-signing-time=true

[handlers]
pre-install=/usr/lib/ecdaq/update-begins

[slot.rootfs.0]
device=/dev/ecdaq-slot-a
type=raw
bootname=A

[slot.rootfs.1]
device=/dev/ecdaq-slot-b
type=raw
bootname=B
SYSTEM
	if [ -n "${ECDAQ_UPDATE_KEYRING}" ]; then
		run_privileged install -m 644 "${ECDAQ_UPDATE_KEYRING}" "${IMAGE_ROOTFS}/usr/lib/rauc/keyring.pem"
	fi
}

# Nobody changes a password, a shell or a mount as an ordinary user here: of Debian's set-user-ID and set-group-ID
# programs only sudo is left.
ROOTFS_POSTPROCESS_COMMAND =+ "clear_set_id"
clear_set_id() {
	run_privileged find "${IMAGE_ROOTFS}" -xdev -type f -perm /6000 ! -path "${IMAGE_ROOTFS}/usr/bin/sudo" \
		-exec chmod ug-s {} +
}

# Which units start is decided in the slot. systemd would do it at the first start of a machine, in /etc of the data
# partition, and a slot that comes by an update would have none of it.
ROOTFS_POSTPROCESS_COMMAND =+ "enable_units"
enable_units() {
	run_privileged chroot "${IMAGE_ROOTFS}" systemctl preset-all --preset-mode=enable-only
}

# What U-Boot takes from a slot: kernel, command line, and the board's device trees under the names that U-Boot
# has for them. Links are followed by U-Boot within the slot's file system.
ROOTFS_POSTPROCESS_COMMAND =+ "fill_slot"
fill_slot() {
	slot="${IMAGE_ROOTFS}/usr/lib/ecdaq/slot"
	run_privileged mkdir -p "$slot"
	kernel=$(find "${IMAGE_ROOTFS}/boot" -name "vmlinu[xz]-*" -type f -printf '%f')
	run_privileged ln -sf "/boot/$kernel" "$slot/kernel"
	echo 'cmdline=${KERNEL_CMDLINE}' | run_privileged tee "$slot/slot.env"
	for file in ${DTB_FILES}; do
		tree=$(find "${IMAGE_ROOTFS}/usr/lib" -path "*/linux-image-*/$file" -printf '/usr/lib/%P')
		run_privileged mkdir -p "$slot/dtb/$(dirname "$file")"
		run_privileged ln -sf "$tree" "$slot/dtb/$file"
		case $file in
		# U-Boot has one name for every Compute Module 4, Linux a tree for its carrier.
		*/bcm2711-rpi-cm4-io.dtb) run_privileged ln -sf "$tree" "$slot/dtb/${file%-io.dtb}.dtb" ;;
		esac
	done
}

# On the boot partition beside the machine's own files: U-Boot's script, and a description of the ecdaq folder.
IMAGE_BOOT_FILES += "${IMAGE_ROOTFS}/usr/lib/u-boot-ecdaq/boot.scr;boot.scr \
                     ${IMAGE_ROOTFS}/usr/share/ecdaq/boot/ecdaq/README.txt;ecdaq/README.txt"
# Beside the image: the command line, and U-Boot, which an emulator starts.
do_copy_boot_files[vardeps] += "KERNEL_CMDLINE ECDAQ_UBOOT"
do_copy_boot_files:append() {
	echo '${KERNEL_CMDLINE}' > "${DEPLOYDIR}/${IMAGE_FULLNAME}.cmdline"
	cp "${IMAGE_ROOTFS}/usr/lib/u-boot-ecdaq/${ECDAQ_UBOOT}/u-boot.bin" "${DEPLOYDIR}/${IMAGE_FULLNAME}-u-boot.bin"
}

# Our packages; the class adds the kernel, a machine its own.
IMAGE_INSTALL += "ecdaq ecdaq-config u-boot-ecdaq"
# Debian's: boot, network, time, diagnosis; and the libraries of our packages.
IMAGE_PREINSTALL += "init systemd-sysv udev dbus kmod \
                     openssh-server sudo chrony linuxptp systemd-journal-remote \
                     iproute2 ethtool iputils-ping nftables \
                     e2fsprogs fdisk dosfstools procps less gpiod libubootenv-tool \
                     rauc rauc-service curl ca-certificates \
                     libcjson1 libcurl4t64 libddsc0t64 libdeflate0 libexpat1 libnats3.10 libwebsockets19t64 libyaml-0-2 libzstd1"
