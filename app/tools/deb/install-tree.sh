#!/bin/sh
# SPDX-License-Identifier: MIT
# A clean Debian tree to install packages in: install-tree.sh FILE.deb... prints its path. Its apt has, without
# network, what the packages depend on and recommend; none of that is installed. Needs root.
set -eu

here=$(CDPATH='' cd -- "$(dirname -- "$0")" && pwd)
root=$(CDPATH='' cd -- "$here/../../.." && pwd)
# shellcheck source-path=SCRIPTDIR source=../setup.sh
. "$root/app/tools/setup.sh"
# shellcheck source-path=SCRIPTDIR source=chroot.sh
. "$here/chroot.sh"

own=$(for file in "$@"; do dpkg-deb --field "$file" Package; done)
# The first of alternatives, without versions.
needed=$(for file in "$@"; do
	dpkg-deb --field "$file" Depends Recommends
done | sed 's/^[A-Za-z-]*: //' | tr ',' '\n' | sed 's/|.*//; s/(.*//; s/:any//; s/ //g' | sort -u |
	grep -vxF "$own" | paste -s -d ' ')
key=$(echo "$suite $needed" | sha256sum | cut -c 1-12)
# shellcheck disable=SC2016 # expanded by mmdebstrap's shell
need_chroot install "$key" "making a clean Debian tree" --variant=minbase --architectures=amd64 \
	--include=systemd --skip=cleanup/apt \
	--customize-hook='chroot "$1" apt-get -q -y -o APT::Install-Recommends=true --download-only install '"$needed"
printf '%s\n' "$chroot"
