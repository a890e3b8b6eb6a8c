# SPDX-License-Identifier: MIT
SUMMARY = "The appliance: Debian, our kernel, our programs, set up for headless use"
DESCRIPTION = "${SUMMARY}"
SECTION = "images"
LICENSE = "MIT"
LIC_FILES_CHKSUM = "file://${ECDAQ_TOP}/LICENSE;md5=d93e890ea955514b83819d5724828071"

PV = "${DISTRO_VERSION}"

inherit image

# Our packages; the class adds the kernel, a machine its own.
IMAGE_INSTALL += "ecdaq ecdaq-config"
# Debian's: to boot, to be reached, to keep time, to be looked at; and what our packages link.
IMAGE_PREINSTALL += "init systemd-sysv udev dbus kmod \
                     openssh-server sudo chrony \
                     iproute2 ethtool iputils-ping nftables \
                     e2fsprogs fdisk dosfstools procps less gpiod \
                     libddsc0t64 libyaml-0-2 libzstd1 zlib1g"
