#!/bin/sh
# SPDX-License-Identifier: MIT
# A clean Debian tree to install packages in: install-tree.sh FILE.deb... prints its path. Its apt has, without
# network, what the packages depend on and recommend; none of that is installed. Packages of another architecture
# are installed beside this machine's dpkg (multiarch), which takes seconds instead of minutes; their programs run in
# QEMU's user mode. Needs root.
set -eu

here=$(CDPATH='' cd -- "$(dirname -- "$0")" && pwd)
root=$(CDPATH='' cd -- "$here/../../.." && pwd)
# shellcheck source-path=SCRIPTDIR source=../setup.sh
. "$root/app/tools/setup.sh"
# shellcheck source-path=SCRIPTDIR source=chroot.sh
. "$here/chroot.sh"
# shellcheck source-path=SCRIPTDIR source=../arm64.sh
. "$root/app/tools/arm64.sh"

arch=$(dpkg-deb --field "$1" Architecture)
native=$(dpkg --print-architecture)
machines=$native
if [ "$arch" != "$native" ]; then
	need_arm64_programs
	machines=$native,$arch
fi
own=$(for file in "$@"; do dpkg-deb --field "$file" Package; done)
needed=$(for file in "$@"; do
	dpkg-deb --field "$file" Depends Recommends
done | sed 's/^[A-Za-z-]*: //; s/, */\n/g' | sort -u | sed 's/ .*//' | grep -vxF "$own" | paste -s -d ' ')
key=$(echo "$suite $machines $needed" | sha256sum | cut -c 1-12)
# shellcheck disable=SC2016 # expanded by mmdebstrap's shell
need_chroot "install-$arch" "$key" "making a clean Debian tree for $arch" --variant=minbase --architectures="$machines" \
	--include=systemd --skip=cleanup/apt \
	--customize-hook='mkdir "$1/tmp/packages"' --customize-hook="copy-in $* /tmp/packages" \
	--customize-hook='chroot "$1" sh -c "apt-get -q -y -o APT::Install-Recommends=true --download-only install \
		/tmp/packages/*.deb && rm -r /tmp/packages"'
printf '%s\n' "$chroot"
